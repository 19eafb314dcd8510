"""The ellipsoidal limit surface: the linear relation between wrench and twist."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import finite, numbers
from ..errors import InputError
from ..geometry.pose import Array
from .surface import LimitSurface

if TYPE_CHECKING:
    from .report import FitReport


@dataclass(frozen=True, eq=False)
class Ellipsoid(LimitSurface):
    """H(F) = Fᵀ A F with a symmetric positive definite A (3, 3) ([Zhou2017] Eqs. 1-6).

    About the centre of friction. V ∝ A F: the factor 2 of ∇H is dropped everywhere, and only ratios such as ρ
    = a/b of diag(a, a, b) have a meaning (docs/errata.md row 16).

    >>> Ellipsoid(np.diag([1.0, 1.0, 4.0])).wrench([0, 0, 1]).tolist()
    [0.0, 0.0, 0.5]

    Attributes:
        matrix: A, shape (3, 3); with forces in N [1/N²], its last row and column also 1/m, and 1/m² where they meet.
        fit: how well it fits, if it was fitted.

    Raises:
        InputError: if the matrix is not symmetric (1e-9) or not positive definite.
    """

    matrix: Array
    fit: "FitReport | None" = field(default=None, kw_only=True)
    degree = 2

    def __post_init__(self) -> None:
        A = finite(self.matrix, "the matrix of an ellipsoid is 3 × 3 finite numbers")
        if A.shape != (3, 3):
            raise InputError("the matrix of an ellipsoid is 3 × 3 finite numbers", value=self.matrix)
        # Judged with unit diagonal, so that the unit of length does not matter.
        if np.any(np.diag(A) <= 0):
            raise InputError("the matrix of an ellipsoid is positive definite", value=A.tolist())
        scale = 1 / np.sqrt(np.diag(A))
        B = A * np.outer(scale, scale)
        if np.max(np.abs(B - B.T)) > 1e-9:
            raise InputError("the matrix of an ellipsoid is symmetric", value=A.tolist())
        if np.linalg.eigvalsh((B + B.T) / 2)[0] <= 1e-12:
            raise InputError("the matrix of an ellipsoid is positive definite", value=A.tolist())
        A = (A + A.T) / 2
        A.setflags(write=False)
        object.__setattr__(self, "matrix", A)
        object.__setattr__(self, "_inverse", np.linalg.inv(A))

    def value(self, wrench: ArrayLike) -> Array:
        F = numbers(wrench, "a wrench is three numbers")
        return np.sum((F @ self.matrix) * F, axis=-1)

    def twist(self, wrench: ArrayLike) -> Array:
        """A F, shape (..., 3)."""
        return finite(wrench, "a wrench is three finite numbers") @ self.matrix

    def wrench(self, twist: ArrayLike) -> Array:
        """A⁻¹ V, scaled to H = 1, shape (..., 3).

        Raises:
            InputError: for a zero twist.
        """
        V = finite(twist, "a twist is three finite numbers")
        if not np.all(np.any(V != 0, axis=-1)):
            raise InputError("a zero twist has no wrench of its own", value=twist)
        F: Array = V @ self._inverse  # type: ignore[attr-defined]
        return F / np.sqrt(np.sum(F * V, axis=-1, keepdims=True))

    def stick(self, point: ArrayLike, velocity: ArrayLike) -> Array:
        """A Jᵀ (J A Jᵀ)⁻¹ u ([Zhou2017] Eq. 13). The point has shape (2,); velocities (..., 2) broadcast."""
        p, u = np.asarray(point, dtype=float), np.asarray(velocity, dtype=float)
        J = np.array([[1.0, 0.0, -p[1]], [0.0, 1.0, p[0]]])
        AJ = self.matrix @ J.T
        return u @ np.linalg.solve(J @ AJ, AJ.T)
