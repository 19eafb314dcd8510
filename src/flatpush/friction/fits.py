"""Ellipsoids and convex quartics fitted to pairs of wrench and twist, measured or computed."""

from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.pose import Array
from .ellipsoid import Ellipsoid
from .exact import Exact
from .pairs import checked_pairs, typical_length
from .quartic import Quartic
from .report import FitReport, twist_angles
from .sos import coefficients_of, minors, solve, svec, tensor, tensors
from .support import Support
from .surface import LimitSurface

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

_LEAST_SCALE = 1e-3  # of a predicted twist, so that the zero gradient explains nothing
_LEAST_EIGENVALUE = 1e-6  # least eigenvalue asked for: strictly convex, invertible
_OCTANT = 20


def fit_ellipsoid(
    wrenches: ArrayLike,
    twists: ArrayLike,
    *,
    length: float | None = None,
    force: float | None = None,
    regularisation: float = 0.003,
    force_weight: float = 0.2,
    velocity_weight: float = 1.0,
) -> Ellipsoid:
    """The ellipsoid H = Fᵀ A F that explains pairs of wrench and twist best (program of arXiv 1602.06056).

    Minimises λ |A| + β mean |H(F) - 1| + γ mean |A F - s V| over A ≻ 0 and one s > 0 per pair, in
    normalised coordinates: torques over the length, forces over `force`, unit twists. The result is in SI.

    Args:
        wrenches: applied wrenches about the centre of friction, shape (n, 3), n ≥ 6 [N, N m].
        twists: of the body there, shape (n, 3); their sizes do not matter.
        length: characteristic length [m]; default: the median over the pairs of √(|τ||v| / |f||ω|), for a
            round ellipsoid its √(a/b).
        force: the unit of force [N]; default: the root mean square of the normalised wrenches.
        regularisation, force_weight, velocity_weight: the weights λ, β and γ, without unit.

    The defaults come from the 350 recorded force pushes of seven experiments (five folds, two seeds, mean
    and median angle of the twists left out): quartic 12.1° (8.1°) with β = 2, 10.7° (7.0°) with β = 0.2,
    ellipsoid 14.2° (10.7°) and 13.9° (11.1°). With β = 0.2 the quartic is the better one in every
    experiment. λ between 0.0001 and 0.01 changes the means by less than 0.1°; λ = 0.1 with β = 2, which the
    paper's toolbox used, costs the quartic another 0.9°.

    Raises:
        InputError: if there are too few pairs, they do not determine the surface, or are not finite.
    """
    data = _Pairs(wrenches, twists, length, force, needed=6)
    F = data.wrenches
    basis = np.zeros((6, 3, 3))
    places = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    for k, (i, j) in enumerate(places):
        basis[k, i, j] = basis[k, j, i] = 1.0
    gradients = np.einsum("kij,nj->nik", basis, F)
    values = np.einsum("nik,ni->nk", gradients, F)
    norm = np.diag([1.0, 1.0, 1.0] + [np.sqrt(2.0)] * 3)
    gram = np.stack([svec(B) for B in basis], axis=1)
    weights = (regularisation, force_weight, velocity_weight)
    x = _program(data, values, gradients, norm, gram, weights)
    scale = np.array([1.0, 1.0, 1 / data.length]) / data.force
    A = np.tensordot(x[:6], basis, axes=1) * np.outer(scale, scale)
    return Ellipsoid(A, fit=data.report(Ellipsoid(A), regularisation))


def fit_quartic(
    wrenches: ArrayLike,
    twists: ArrayLike,
    *,
    length: float | None = None,
    force: float | None = None,
    regularisation: float = 0.003,
    force_weight: float = 0.2,
    velocity_weight: float = 1.0,
) -> Quartic:
    """The convex quartic that explains pairs of wrench and twist best, proved convex by its Gram matrix.

    The program of fit_ellipsoid with the 15 coefficients in the place of A, ∇H in the place of A F and the
    Gram matrix of the Hessian positive semidefinite.

    Args:
        wrenches, twists: shape (n, 3), n ≥ 15; the rest as there: length [m], force [N], and the weights
            regularisation, force_weight and velocity_weight, numbers without unit.
    """
    data = _Pairs(wrenches, twists, length, force, needed=15)
    F = data.wrenches
    T = tensors()
    gradients = 4 * np.einsum("Kijkl,nj,nk,nl->niK", T, F, F, F, optimize=True)
    values = np.einsum("niK,ni->nK", gradients, F) / 4
    grams, gram = _grams()
    weights = (regularisation, force_weight, velocity_weight)
    x = _program(data, values, gradients, np.eye(15), gram, weights)
    scale = np.array([1.0, 1.0, 1 / data.length]) / data.force
    mixed = np.outer(scale, scale).ravel()
    Q = np.tensordot(x[:24], grams, axes=1) * np.outer(mixed, mixed)
    v = coefficients_of(np.einsum("ijkl,i,j,k,l->ijkl", tensor(x[:15]), scale, scale, scale, scale))
    return Quartic(v, gram=Q, fit=data.report(Quartic(v, gram=Q), regularisation))


def fit_surface(
    surface: Support | LimitSurface,
    kind: Literal["ellipsoid", "quartic"],
    *,
    length: float | None = None,
    regularisation: float = 0.001,
) -> Ellipsoid | Quartic:
    """The ellipsoid or quartic fitted to another limit surface over fixed, evenly spread twists.

    Hammersley points on an octant of the sphere of (vx, vy, ω · length), mirrored in the principal axes of
    the pressure, in their diagonals and by V → -V, so that the fit has the symmetries of the support.

    Args:
        surface: a support (taken about its centre, with its exact surface) or any limit surface.
        kind: "ellipsoid" or "quartic".
        length: characteristic length [m]; default: the gyration radius of a support; of another surface, torque over
            force it resists.
        regularisation: the weight λ, without unit; the data have no noise.

    Raises:
        InputError: for another kind.
    """
    if kind not in ("ellipsoid", "quartic"):
        raise InputError('a surface is fitted by an "ellipsoid" or a "quartic"', value=kind)
    axes = np.eye(2)
    if isinstance(surface, Support):
        spread, axes = np.linalg.eigh(surface.covariance)
        if spread[1] - spread[0] <= 1e-9 * spread[1]:
            axes = np.eye(2)
        length = float(np.sqrt(np.sum(spread))) if length is None else length
        surface = Exact(surface.centred())
    elif length is None:
        length = float(surface.wrench([0.0, 0.0, 1.0])[2] / surface.wrench([1.0, 0.0, 0.0])[0])
    twists = even_twists(length)
    twists[:, :2] = twists[:, :2] @ axes.T
    wrenches = surface.wrench(twists)
    fit = fit_ellipsoid if kind == "ellipsoid" else fit_quartic
    return fit(wrenches, twists, length=length, regularisation=regularisation)


def even_twists(length: float, octant: int = _OCTANT) -> Array:
    """Twists (8 · octant, 3), even on the half sphere of (vx, vy, ω · length > 0), in a square's mirrors."""
    i = np.arange(octant)
    z = (i + 0.5) / octant
    angle = np.pi / 2 * np.remainder(0.5 + i * (np.sqrt(5) - 1) / 2, 1.0)
    across = np.sqrt(1 - z * z)
    V = np.stack([across * np.cos(angle), across * np.sin(angle), z / length], axis=1)
    mirrors = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1]])
    return (mirrors[:, None] * np.concatenate([V, V[:, [1, 0, 2]]])).reshape(-1, 3)


def sized(surface: Ellipsoid | Quartic, wrenches: ArrayLike) -> Ellipsoid | Quartic:
    """The same surface in another size: half of the wrenches lie inside it. No direction of a twist changes.

    A fit pays for the norm of its coefficients, so that its surface comes out too large for the forces themselves.

    Args:
        wrenches: measured ones about the centre of friction, shape (n, 3) [N, N m].
    """
    middle = float(np.median(surface.value(wrenches)))
    if isinstance(surface, Ellipsoid):
        return Ellipsoid(surface.matrix / middle, fit=surface.fit)
    return Quartic(surface.coefficients / middle, gram=surface.gram / middle, fit=surface.fit)


@cache
def _grams() -> tuple[Array, Array]:
    """The Gram matrices (24, 9, 9) of the 15 monomials and of zero, and the same as columns for the solver."""
    grams = np.concatenate([12 * tensors().reshape(15, 9, 9), minors()])
    return grams, np.stack([svec(G) for G in grams], axis=1)


class _Pairs:
    """Wrenches and twists, checked and normalised."""

    def __init__(
        self,
        wrenches: ArrayLike,
        twists: ArrayLike,
        length: float | None,
        force: float | None,
        needed: int,
    ) -> None:
        F, V = checked_pairs(wrenches, twists, needed, "a fit of this surface")
        for name, given in (("length", length), ("force", force)):
            if given is not None and not (np.isfinite(given) and given > 0):
                raise InputError(f"the {name} is positive and finite", value=given)
        self.raw = F, V
        self.length = typical_length(F, V) if length is None else float(length)
        F, V = F / [1, 1, self.length], V * [1, 1, self.length]
        self.force = float(np.sqrt(np.mean(np.sum(F * F, axis=1)))) if force is None else float(force)
        self.wrenches = F / self.force
        self.twists = V / np.linalg.norm(V, axis=1, keepdims=True)
        scale = np.linalg.norm(F, axis=1, keepdims=True)
        for vectors, what in ((F / scale, "wrenches"), (self.twists, "twists")):
            singular = np.linalg.svd(vectors, compute_uv=False)
            if singular[2] < 1e-6 * np.sqrt(len(F)):
                spanned = int(np.count_nonzero(singular >= 1e-6 * np.sqrt(len(F))))
                raise InputError(
                    f"the {what} of a fit span all three directions",
                    value=spanned,
                    hint="Add pushes that turn the object, and pushes at other places.",
                )
        different = len(np.unique(np.round(np.hstack([F / scale, self.twists]), 9), axis=0))
        if different < needed:
            raise InputError(
                f"a fit of this surface needs at least {needed} different pairs", value=different
            )

    def report(self, surface: LimitSurface, regularisation: float) -> FitReport:
        F, V = self.raw
        return FitReport(twist_angles(surface.twist(F), V, self.length), self.length, regularisation)


def _program(
    data: _Pairs,
    values: Array,
    gradients: Array,
    norm: Array,
    gram: Array,
    weights: tuple[float, float, float],
) -> Array:
    """The θ of least λ |norm θ| + β mean |values θ - 1| + γ mean |gradients θ - s V| with gram θ ⪰ 0.

    Unknowns: θ (and what else the Gram matrix has), s, ξ, δ of each pair, and the norm.
    """
    regularisation, force_weight, velocity_weight = weights
    n, count = values.shape
    width, size = gram.shape[1], int(np.sqrt(2 * len(gram)))
    s, xi, delta, r = (width + k * n + np.arange(n) for k in range(4))  # their columns; of r only the first
    each = np.arange(n)
    rows = _Rows()
    for sign in (1.0, -1.0):  # ξ ≥ ±(H - 1)
        rows.dense(sign * values)
        rows.entries(each, xi, -1.0)
        rows.end(np.full(n, sign))
    rows.entries(each, s, -1.0)
    rows.end(np.full(n, -_LEAST_SCALE))
    # |D θ - s V| ≤ δ, four rows a pair.
    D = np.zeros((n, 4, count))
    D[:, 1:] = -gradients
    rows.dense(D.reshape(4 * n, count))
    rows.entries(4 * each, delta, -1.0)
    for k in range(3):
        rows.entries(4 * each + 1 + k, s, data.twists[:, k])
    rows.end(np.zeros(4 * n))
    # |norm θ| ≤ r.
    rows.entries(np.zeros(1, dtype=int), r[:1], -1.0)
    rows.dense(np.concatenate([np.zeros((1, count)), -norm]))
    rows.end(np.zeros(1 + count))
    rows.dense(-gram)
    rows.end(-_LEAST_EIGENVALUE * svec(np.eye(size)))
    cones = [("positive", 3 * n), *[("norm", 4)] * n, ("norm", 1 + count), ("psd", size)]
    cost = np.concatenate(
        [
            np.zeros(width + n),
            np.full(n, force_weight / n),
            np.full(n, velocity_weight / n),
            [regularisation],
        ]
    )
    A, b = rows.matrix(width + 3 * n + 1)
    return solve(cost, A, b, cones, "the fit")


class _Rows:
    """A sparse matrix and its right side, put together block of rows by block of rows."""

    def __init__(self) -> None:
        self.first = 0
        self.at: list[tuple[Any, Any, Array]] = []
        self.right: list[Array] = []

    def dense(self, block: Array) -> None:
        """Entries of the present block from the first column on."""
        i, j = np.nonzero(block)
        self.at.append((self.first + i, j, block[i, j]))

    def entries(self, rows: np.ndarray, columns: np.ndarray, values: ArrayLike) -> None:
        self.at.append((self.first + rows, columns, np.broadcast_to(values, rows.shape)))

    def end(self, right: Array) -> None:
        """The block has as many rows as this right side."""
        self.right.append(right)
        self.first += len(right)

    def matrix(self, width: int) -> tuple["csc_matrix", Array]:
        from scipy import sparse

        i, j, values = (np.concatenate(part) for part in zip(*self.at, strict=True))
        return sparse.csc_matrix((values, (i, j)), shape=(self.first, width)), np.concatenate(self.right)
