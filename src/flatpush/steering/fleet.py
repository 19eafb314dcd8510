"""Several cars of one object side by side, as the arrays that searches over pushes work on."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.pose import Array
from .car import Car

if TYPE_CHECKING:
    from .six_words import Records


@dataclass(frozen=True, eq=False)
class Fleet:
    """The cars of k pushes; poses are poses X_WO of the object frame O for all of them.

    Attributes:
        left, right: turning centres in O, shape (k, 2) [m].
        direction: straight directions, unit vectors, shape (k, 2).
        rates: what a radian to the left, a metre straight and a radian to the right cost, shape (k, 3): length of the
            path of the flat point or of the pusher, or, for the cost "time", way of the fastest fingertip [m].
        speeds, accelerations: of the time law along that way, shape (k, 3); infinite speeds where the cost is the way
            itself. Each arc then takes way/speed + speed/acceleration, or 2 √(way/acceleration) where it is too
            short to reach the speed.
        switching: cost of changing from one push to another, shape (k, k), zero on the diagonal.
    """

    left: Array
    right: Array
    direction: Array
    rates: Array
    speeds: Array
    accelerations: Array
    switching: Array

    @classmethod
    def of(
        cls,
        cars: Sequence[Car],
        rates: Array,
        speeds: Array | None = None,
        accelerations: Array | None = None,
        switching: float | Array = 0.0,
    ) -> "Fleet":
        """The arrays of cars; a single switching cost holds between all pairs."""
        k = len(cars)
        cost = np.asarray(switching, dtype=float)
        return cls(
            np.array([car.left_centre for car in cars]).reshape(k, 2),
            np.array([car.right_centre for car in cars]).reshape(k, 2),
            np.array([car.direction for car in cars]).reshape(k, 2),
            np.asarray(rates, dtype=float).reshape(k, 3),
            np.full((k, 3), np.inf) if speeds is None else np.asarray(speeds, dtype=float),
            np.full((k, 3), np.inf) if accelerations is None else np.asarray(accelerations, dtype=float),
            np.where(np.eye(k) > 0, 0.0, cost) if cost.ndim == 0 else cost,
        )

    @property
    def cars(self) -> "Records":
        """The cars as the compiled kernels take them: a record array of six_words.CAR, shape (k,)."""
        from .six_words import CAR

        cars = np.zeros(self.size, CAR)
        for at, (x, y) in (("left", self.left.T), ("right", self.right.T), ("ahead", self.direction.T)):
            cars[f"{at}_x"], cars[f"{at}_y"] = x, y
        cars["radius"], cars["rate"] = self.radius, self.rates
        cars["speed"], cars["acceleration"] = self.speeds, self.accelerations
        return cars

    @property
    def size(self) -> int:
        return len(self.left)

    @cached_property
    def radius(self) -> Array:
        """Turning radii of the flat points, shape (k,)."""
        return 0.5 * np.linalg.norm(self.left - self.right, axis=1)

    @property
    def flat_point(self) -> Array:
        """Midpoints of the turning centres in O, shape (k, 2)."""
        return 0.5 * (self.left + self.right)

    @property
    def heading(self) -> Array:
        """Angle from O's +x to the straight direction, shape (k,) [rad]."""
        return np.arctan2(self.direction[:, 1], self.direction[:, 0])

    @cached_property
    def is_dubins(self) -> bool:
        """Whether every car is a Dubins car of its flat point and the cost is the flat point's path."""
        span = self.left - self.right
        across = np.abs(np.einsum("ij,ij->i", span, self.direction))
        flat = np.stack([self.radius, np.ones(self.size), self.radius], axis=1)
        return bool(
            np.all(across <= 1e-9 * np.linalg.norm(span, axis=1))
            and np.allclose(self.rates, flat, rtol=1e-12, atol=0)
            and np.all(np.isinf(self.speeds))
        )
