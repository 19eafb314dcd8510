"""Random limit surfaces about a nominal one: Wishart draws that stay convex and keep the nominal as their mean.

An ellipsoid's A is drawn as Wishart(A/df, df). For a quartic with a Gram matrix Q = L Lᵀ of its Hessian, the same
is done in the coordinates in which Q is the identity: S = Wishart(I/df, df). L S Lᵀ is a Gram matrix, but of no
quartic's Hessian; those that are form a linear space of 24 dimensions, 𝓛 in these coordinates. So D, the part of
S - I in 𝓛, moves the quartic: Q + L D Lᵀ satisfies all equalities exactly, its mean is Q, and it is positive
semidefinite while D ⪰ -I. Where D is longer, it is cut to the length at which neither D nor -D leaves. A random sign
keeps the mean in spite of that; at the default one draw in fifty is cut.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .ellipsoid import Ellipsoid
from .quartic import Quartic
from .sos import coefficients_of, minors, tensor_of_gram, tensors
from .support import Support
from .surface import LimitSurface

DF = 50.0
_RANGE = 1e-8  # eigenvalues of Q below this part of the largest count as zero: a draw stays on that face
_WITHIN_BOUNDARY = 1 - 1e-9


@dataclass(frozen=True, eq=False)
class SurfaceDraws:
    """Random ellipsoids or quartics whose mean is a nominal one. What draws share is computed once.

    Relative standard deviations of an ellipsoid's diagonal are √(2/df): 20 % at 50, 4.5 % at 1000. A draw is the same
    surface in all units.

    Attributes:
        surface: the nominal one, an Ellipsoid or a Quartic.
        df: degrees of freedom, any number of at least 3 (ellipsoid) or 9 (quartic); the larger, the nearer.

    Raises:
        InputError: for another surface or too few degrees of freedom.

    >>> sphere = Ellipsoid(np.eye(3))
    >>> drawn = SurfaceDraws(sphere, df=1e6).draw(np.random.default_rng(0))
    >>> bool(np.max(np.abs(drawn.matrix - np.eye(3))) < 0.01)
    True
    """

    surface: LimitSurface
    df: float = DF

    def __post_init__(self) -> None:
        if not isinstance(self.surface, Ellipsoid | Quartic):
            raise InputError(
                "random surfaces are drawn about an ellipsoid or a quartic",
                value=type(self.surface).__name__,
                hint="Of a support, draw its loads and its centre instead.",
            )
        least = 3 if isinstance(self.surface, Ellipsoid) else 9
        if not (np.isfinite(self.df) and self.df >= least):
            raise InputError(
                f"a Wishart draw has at least {least} degrees of freedom here", key="df", value=self.df
            )

    def draw(self, rng: np.random.Generator) -> Ellipsoid | Quartic:
        """One surface."""
        if isinstance(self.surface, Ellipsoid):
            L = np.linalg.cholesky(self.surface.matrix)
            return Ellipsoid(L @ wishart(3, self.df, rng) @ L.T)
        assert isinstance(self.surface, Quartic)
        L, directions = self._face
        move, _ = self.move(rng)
        Q = self.surface.gram * self._mixed + L @ np.tensordot(move, directions, axes=1) @ L.T
        Q = Q / self._mixed
        return Quartic(coefficients_of(tensor_of_gram(Q)), gram=Q)

    def move(self, rng: np.random.Generator) -> tuple[Array, bool]:
        """The coordinates of D along 𝓛, and whether they were cut."""
        L, directions = self._face
        S = wishart(L.shape[1], self.df, rng) - np.eye(L.shape[1])
        sign = 1.0 if rng.random() < 0.5 else -1.0
        move = np.tensordot(directions, S, axes=2)
        reach = float(np.max(np.abs(np.linalg.eigvalsh(np.tensordot(move, directions, axes=1)))))
        cut = reach > _WITHIN_BOUNDARY
        return sign * move * (_WITHIN_BOUNDARY / reach if cut else 1.0), cut

    @cached_property
    def _units(self) -> Array:
        """Force and torque in units in which the coefficients of x⁴, y⁴ and z⁴ are about 1."""
        assert isinstance(self.surface, Quartic)
        v = self.surface.coefficients
        force = float((v[0] * v[1]) ** -0.125)
        return np.array([force, force, float(v[2] ** -0.25)])

    @cached_property
    def _mixed(self) -> Array:
        mixed = np.outer(self._units, self._units).ravel()
        return np.outer(mixed, mixed)

    @cached_property
    def _face(self) -> tuple[Array, Array]:
        """L (9, 9) and an orthonormal basis (k, 9, 9) of 𝓛: symmetric B for which L B Lᵀ is of a quartic's Hessian.

        L is the symmetric root of Q, which no choice of eigenvectors changes.
        """
        assert isinstance(self.surface, Quartic)
        values, vectors = np.linalg.eigh(self.surface.gram * self._mixed)
        kept = values > _RANGE * values[-1]
        L = (vectors[:, kept] * np.sqrt(values[kept])) @ vectors[:, kept].T
        back = (vectors[:, kept] / np.sqrt(values[kept])) @ vectors[:, kept].T
        grams = np.concatenate([12 * tensors().reshape(15, 9, 9), minors()])
        if not kept.all():  # only those that vanish where Q does
            outside = np.einsum("kij,jn->kin", grams, vectors[:, ~kept]).reshape(24, -1)
            _, singular, right = np.linalg.svd(outside.T)
            rank = int(np.count_nonzero(singular > 1e-6 * singular[0]))
            grams = np.tensordot(right[rank:], grams, axes=1)
        inside = np.einsum("ri,kij,sj->krs", back, grams, back).reshape(len(grams), -1)
        _, singular, rows = np.linalg.svd(inside, full_matrices=False)
        count = int(np.count_nonzero(singular > 1e-12 * singular[0]))
        return L, rows[:count].reshape(count, L.shape[1], L.shape[1])


def wishart(size: int, df: float, rng: np.random.Generator) -> Array:
    """A draw (size, size) with mean I: Wishart(I/df, df), by Bartlett's decomposition."""
    lower = np.tril(rng.standard_normal((size, size)), -1)
    lower[np.diag_indices(size)] = np.sqrt(rng.chisquare(df - np.arange(size)))
    return lower @ lower.T / df


def draw_loads(support: Support, rng: np.random.Generator, relative: float) -> Support:
    """The support with the load of every foot scaled by a factor, uniform within 1 ± relative.

    Args:
        support: on feet.
        relative: from 0 to below 1.

    Raises:
        InputError: for a spread support, or another relative.
    """
    points, weights = support.feet
    if not len(weights):
        raise InputError(
            "loads are drawn for a support on feet", hint="Of a spread support, shift the centre instead."
        )
    if not 0 <= relative < 1:
        raise InputError("the loads of feet vary by a part from 0 to below 1", value=relative)
    return Support.points(points, weights * (1 + relative * rng.uniform(-1, 1, size=len(weights))))
