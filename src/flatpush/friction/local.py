"""The ellipsoid that is exact for pushing straight in one direction ([Zhou2017] Eqs. 2-3, corrected)."""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .ellipsoid import Ellipsoid
from .exact import Exact
from .quartic import Quartic
from .support import Support
from .surface import LimitSurface


def local_ellipsoid(surface: Support | LimitSurface, direction: ArrayLike) -> Ellipsoid:
    """diag(a, a, b) with the surface's own ρ = a/b for a straight push in the direction (2,), contact → COF.

    Of a support (or its exact surface) with pressure covariance Σ: linearised about translation along the
    unit vector n, torque = (nᵀ Σ n) ω, so ρ = nᵀ Σ n and the result is diag(1, 1, 1/ρ). It depends on the
    direction: for a uniform rectangle ρ is the square of its length along the push over 12.

    Of an ellipsoid or a quartic, with F₀ the pure force along the direction: a is the entry of ∇²H(F₀)
    tangential to F₀ in the force plane, b that of the torque. The entry along F₀, which [Zhou2017] Eq. 2
    averages in, carries a factor degree - 1 (docs/errata.md row 7). The result is
    isotropic in the force plane, so that it holds in every frame.

    >>> square = Support.polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    >>> np.round(np.diag(local_ellipsoid(square, [0, 1]).matrix), 12).tolist()
    [1.0, 1.0, 3.0]

    Raises:
        InputError: if the direction is zero, the surface is of another kind, or a support has no extent along the
            direction.
    """
    n = np.asarray(direction, dtype=float)
    if n.shape != (2,) or not np.isfinite(n).all() or not np.any(n):
        raise InputError("a direction is two finite numbers, not both zero", value=direction)
    n = n / np.hypot(n[0], n[1])
    if isinstance(surface, Exact):
        surface = surface.support
    if isinstance(surface, Support):
        rho = float(n @ surface.covariance @ n)
        if rho <= 1e-12 * float(np.trace(surface.covariance)):
            raise InputError(
                "the support points lie on a line square to the push: it has no local model", value=direction
            )
        return Ellipsoid(np.diag([1.0, 1.0, 1 / rho]))
    if isinstance(surface, Ellipsoid):
        H = surface.matrix
    elif isinstance(surface, Quartic):
        H = surface.hessian([n[0], n[1], 0.0])
    else:
        raise InputError("a support, an exact surface, an ellipsoid or a quartic", value=surface)
    t = np.array([-n[1], n[0], 0.0])
    a, b = float(t @ H @ t), float(H[2, 2])
    return Ellipsoid(np.diag([a, a, b]))
