"""How well a fitted limit surface predicts the twists it was fitted to."""

from dataclasses import dataclass

import numpy as np

from ..geometry.pose import Array


@dataclass(frozen=True, eq=False)
class FitReport:
    """Angles between a surface's twists ∇H(F) and the given ones, with (v, ω · length) as coordinates.

    Attributes:
        angles: of each pair, shape (n,) [rad].
        length: the characteristic length [m].
        regularisation: the weight λ of the coefficients' norm.
    """

    angles: Array
    length: float
    regularisation: float

    @property
    def n(self) -> int:
        """How many pairs there are."""
        return len(self.angles)

    @property
    def mean(self) -> float:
        """Mean angle [rad]."""
        return float(np.mean(self.angles))

    @property
    def median(self) -> float:
        """Median angle [rad]."""
        return float(np.median(self.angles))

    @property
    def worst(self) -> float:
        """Largest angle [rad]."""
        return float(np.max(self.angles))


def twist_angles(one: Array, other: Array, length: float) -> Array:
    """The angles between twists (n, 3) with ω · length as third coordinate [rad]."""
    a, b = one * [1.0, 1.0, length], other * [1.0, 1.0, length]
    a = a / np.linalg.norm(a, axis=1, keepdims=True)
    b = b / np.linalg.norm(b, axis=1, keepdims=True)
    return 2 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
