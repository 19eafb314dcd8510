"""The convex quartic limit surface."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import finite, vector
from ..errors import FlatpushError, InputError
from ..geometry.pose import Array
from .sos import best_gram, gram_defect, tensor
from .surface import LimitSurface

if TYPE_CHECKING:
    from .report import FitReport

_MAX_STEPS = 100
# The least eigenvalue of a Gram matrix, relative to x⁴'s coefficient in balanced coordinates.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Quartic(LimitSurface):
    """A homogeneous quartic H(F), proved convex by a Gram matrix of its Hessian (arXiv 1602.06056).

    Coefficients of x⁴ y⁴ z⁴ x³y x³z y³x y³z z³x z³y x²y² x²z² y²z² x²yz y²xz z²xy with F = (x, y, z) about
    the centre of friction. y'∇²H(F)y = m'Qm with m = (y₁F₁, y₁F₂, …, y₃F₃): Q ⪰ 0, with eigenvalues of at
    least -1e-9 where both force and torque are measured in units that make their coefficients 1.

    >>> sphere = Quartic([1, 1, 1, 0, 0, 0, 0, 0, 0, 2, 2, 2, 0, 0, 0])
    >>> sphere.value([0, 2, 0]).item(), np.round(sphere.wrench([0, 0, 3]), 12).tolist()
    (16.0, [0.0, 0.0, 1.0])

    Attributes:
        coefficients: shape (15,).
        gram: Q (9, 9); found by a semidefinite program if it is not given.
        fit: how well it fits, if it was fitted.

    Raises:
        InputError: if no such Q exists (the quartic is not SOS-convex), if the one given belongs to another
            quartic or is not positive semidefinite, or if H does not bound the wrenches.
    """

    coefficients: Array
    gram: Array = field(default=None, kw_only=True)  # type: ignore[arg-type]  # set below
    fit: "FitReport | None" = field(default=None, kw_only=True)
    degree = 4

    def __post_init__(self) -> None:
        v = finite(self.coefficients, "a quartic has 15 finite coefficients")
        if v.shape != (15,):
            raise InputError("a quartic has 15 finite coefficients", value=self.coefficients)
        if not np.all(v[:3] > 0):
            raise InputError("the coefficients of x⁴, y⁴ and z⁴ are positive", value=v.tolist())
        T = tensor(v)
        # Balanced coordinates: force and torque in units that make T about 1.
        force = float((v[0] * v[1]) ** -0.125)
        units = np.array([force, force, float(v[2] ** -0.25)])
        T1 = np.einsum("ijkl,i,j,k,l->ijkl", T, units, units, units, units)
        mixed = np.outer(units, units).ravel()
        if self.gram is None:
            Q1 = best_gram(T1)
        else:
            Q = np.array(self.gram, dtype=float)
            if Q.shape != (9, 9) or not np.isfinite(Q).all():
                raise InputError("a Gram matrix is 9 × 9 finite numbers", value=self.gram)
            Q1 = Q * np.outer(mixed, mixed)
            if np.max(np.abs(Q1 - Q1.T)) > _SLACK or gram_defect(Q1, T1) > _SLACK * np.max(np.abs(Q1)):
                raise InputError("the Gram matrix belongs to the Hessian of the quartic", value=v.tolist())
            Q1 = (Q1 + Q1.T) / 2
        least = float(np.linalg.eigvalsh(Q1)[0])
        if least < -_SLACK * max(1.0, float(np.max(np.abs(T1)))):
            raise InputError(
                f"a quartic is SOS-convex (least eigenvalue of its Gram matrix {least:.2g})", value=v.tolist()
            )
        if np.linalg.eigvalsh(np.einsum("ijkk->ij", T1))[0] <= 1e-9:
            raise InputError(
                "a quartic limit surface bounds every wrench", value=v.tolist(), hint="It is flat along one."
            )
        keep = {"coefficients": v, "gram": Q1 / np.outer(mixed, mixed), "_tensor": T1, "_units": units}
        for name, array in keep.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def value(self, wrench: ArrayLike) -> Array:
        F = self._balanced(wrench)
        return np.einsum("...i,...ij,...j->...", F, _contracted(self._tensor, F), F)

    def twist(self, wrench: ArrayLike) -> Array:
        """∇H(F), shape (..., 3)."""
        F = self._balanced(wrench)
        return 4 * np.einsum("...ij,...j->...i", _contracted(self._tensor, F), F) / self._units

    def hessian(self, wrench: ArrayLike) -> Array:
        """∇²H(F), shape (..., 3, 3)."""
        return 12 * _contracted(self._tensor, self._balanced(wrench)) / np.outer(self._units, self._units)

    def wrench(self, twist: ArrayLike) -> Array:
        """The F of least H(F) - V·F, scaled to H = 1, shape (..., 3).

        Raises:
            InputError: for a twist that is zero or not finite.
        """
        V = finite(twist, "a twist is three finite numbers, not all zero")
        if V.shape[-1:] != (3,) or not np.all(np.any(V != 0, axis=-1)):
            raise InputError("a twist is three finite numbers, not all zero", value=twist)
        flat = (V * self._units).reshape(-1, 3)
        F = np.array([_conjugate(self._tensor, b / np.sqrt(b @ b)) for b in flat]).reshape(V.shape)
        size = np.einsum("...i,...ij,...j->...", F, _contracted(self._tensor, F), F) ** 0.25
        return F / size[..., None] * self._units

    def stick(self, point: ArrayLike, velocity: ArrayLike) -> Array:
        """∇H(Jᵀf) for the f of least H(Jᵀf) - u·f, a strictly convex problem in the plane."""
        rule = "a point and its velocity are two finite numbers each"
        p, u = vector(point, 2, rule), vector(velocity, 2, rule)
        speed = float(np.hypot(u[0], u[1]))
        if speed == 0:
            return np.zeros(3)
        J = np.array([[1.0, 0.0, -p[1]], [0.0, 1.0, p[0]]])
        G = J.T / self._units[:, None]  # of a force at p, the wrench in balanced coordinates
        scale = 1 / np.sqrt(np.sum(G * G))
        G = G * scale
        T = np.einsum("ijkl,ia,jb->abkl", self._tensor, G, G)
        T = np.einsum("abkl,kc,ld->abcd", T, G, G)
        F = G @ _conjugate(T, u / speed)
        return 4 * speed * scale * (_contracted(self._tensor, F) @ F) / self._units

    def _balanced(self, wrench: ArrayLike) -> Array:
        F = finite(wrench, "a wrench is three finite numbers")
        if F.shape[-1:] != (3,):
            raise InputError("a wrench is three numbers (fx, fy, τ)", value=wrench)
        return F / self._units

    _tensor: Array = field(init=False, repr=False, default=None)  # type: ignore[arg-type]
    _units: Array = field(init=False, repr=False, default=None)  # type: ignore[arg-type]


def _contracted(T: Array, x: Array) -> Array:
    """T(x, x, ·, ·), shape (..., n, n): the Hessian over 12."""
    n = T.shape[0]
    squares = (x[..., :, None] * x[..., None, :]).reshape(*x.shape[:-1], n * n)
    return (squares @ T.reshape(n * n, n * n)).reshape(*x.shape[:-1], n, n)


def _conjugate(T: Array, b: Array) -> Array:
    """The x of least T(x, x, x, x) - b·x for a unit b: damped Newton, from the best multiple of b on.

    After each step x is scaled to the best of its multiples, where 4 T(x, x, x, x) = b·x; what is left to
    reduce is then -(3/4) b·x.
    """
    x = _best_multiple(T, b, b)
    M = _contracted(T, x)
    residual = 4 * M @ x - b
    for _ in range(_MAX_STEPS):
        size = float(residual @ residual)
        if size <= 1e-29:
            break
        H = 12 * M
        H.flat[:: len(b) + 1] += 1e-14 * np.trace(H)
        step = -np.linalg.solve(H, residual)
        power, descent, fraction = float(b @ x), float(residual @ step), 1.0
        while fraction > 1e-6:
            x1 = _best_multiple(T, b, x + fraction * step)
            M1 = _contracted(T, x1)
            r1 = 4 * M1 @ x1 - b
            change = -0.75 * (float(b @ x1) - power)
            # Near the end the objective shows no progress beyond its rounding, but the residual does.
            if change <= 1e-4 * fraction * descent or (
                change <= 1e-13 * power and float(r1 @ r1) < 0.25 * size
            ):
                break
            fraction *= 0.5
        else:
            break
        x, M, residual = x1, M1, r1
    if size > 1e-20:
        raise FlatpushError(f"the wrench of a twist was not found (residual {size**0.5:.1e})")
    return x


def _best_multiple(T: Array, b: Array, x: Array) -> Array:
    """t x with the least T(tx, tx, tx, tx) - t b·x."""
    power, quartic = float(b @ x), float(x @ _contracted(T, x) @ x)
    if power <= 0:
        return x
    return x * (power / (4 * quartic)) ** (1 / 3)
