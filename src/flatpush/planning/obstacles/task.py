"""A query among obstacles as its searches see it: cars, bodies, the world, what must be kept."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...geometry.collision import Body, World
from ...geometry.pose import Array
from ...steering.fleet import Fleet


@dataclass(frozen=True, eq=False)
class Task:
    """From a start to a goal with a fleet, in a world.

    Attributes:
        fleet: the cars and what their motions and changes cost.
        world: bounds and obstacles.
        bodies: object and fingertips of each push.
        backs: where the fingertips land, from where they push, in O, shape (k, 2) [m]: their way onto the contact and
            off it is clear too.
        start, goal: poses X_WO.
        clearance: that must be kept [m].
        room: clearance that a change of push needs [m]: what the hand takes to go around the object on the table, or
            0 if it is lifted.
        inside: whether a change of push needs room to turn the hand anyhow within the bounds.
    """

    fleet: Fleet
    world: World
    bodies: Sequence[Body]
    backs: Array
    start: Array
    goal: Array
    clearance: float
    room: float = 0.0
    inside: bool = False

    @cached_property
    def arrays(self) -> tuple[Any, ...]:
        """What the kernels take."""
        fleet = self.fleet
        hands = [Body.of(body.outline, body.discs, body.radius).arrays for body in self.bodies]
        most = max(len(points) for points, _ in hands)
        corners = hands[0][1][0]
        round_ = int(self.bodies[0].outline.is_circle)
        points = np.stack([_padded(p, most) for p, _ in hands])
        balls = np.array([ball for _, ball in hands], dtype=float)
        tips = np.ascontiguousarray(points[:, corners + round_ :])
        middle = tips[:, :, :2].mean(axis=1)
        reach = np.max(np.linalg.norm(tips[:, :, :2] - middle[:, None], axis=2) + tips[:, :, 2], axis=1)
        hulls = np.column_stack([np.zeros(len(tips)), middle, reach])
        cars = np.ascontiguousarray(np.column_stack([fleet.left, fleet.right, fleet.direction, fleet.radius]))
        laws = np.ascontiguousarray(np.stack([fleet.rates, fleet.speeds, fleet.accelerations], axis=-1))
        numbers = np.array([self.clearance, self.room, self.inside, *np.zeros(fleet.size)], dtype=float)
        arrays = (
            self.world.arrays, points, balls, tips, hulls, np.ascontiguousarray(self.backs), cars, laws,
            np.ascontiguousarray(fleet.switching), numbers,
        )  # fmt: skip
        from .kernels import free, lands

        numbers[3:] = [free(arrays, a, self.goal) and lands(arrays, a, self.goal) for a in range(fleet.size)]
        return arrays

    @cached_property
    def extent(self) -> Array:
        """The bounds, or a box around everything with room to pass by, (xmin, ymin, xmax, ymax)."""
        F = self.world.features
        points = [self.start[:2], self.goal[:2], F[:, :2] - F[:, 4:5], F[:, 2:4] + F[:, 4:5]]
        every = np.concatenate([np.atleast_2d(p) for p in points])
        margin = 2 * self.bodies[0].outline.size + 3 * float(np.max(self.fleet.radius))
        box = np.concatenate([every.min(axis=0) - margin, every.max(axis=0) + margin])
        return np.where(np.isfinite(self.world.bounds), self.world.bounds, box)

    @cached_property
    def reversed(self) -> "Task":
        """The same task backwards in time: from the goal to the start, every motion the other way around."""
        fleet = self.fleet
        back = replace(
            fleet,
            left=fleet.right,
            right=fleet.left,
            direction=-fleet.direction,
            rates=fleet.rates[:, ::-1],
            speeds=fleet.speeds[:, ::-1],
            accelerations=fleet.accelerations[:, ::-1],
            switching=fleet.switching.T,
        )
        return replace(self, fleet=back, start=self.goal, goal=self.start)

    @cached_property
    def first(self) -> list[int]:
        """The pushes that can begin: their fingers land at the start."""
        from .kernels import free, lands

        T = self.arrays
        return [a for a in range(self.fleet.size) if free(T, a, self.start) and lands(T, a, self.start)]

    @cached_property
    def last(self) -> list[int]:
        """The pushes that can end: their fingers leave at the goal."""
        return [a for a, able in enumerate(self.arrays[9][3:].tolist()) if able]


def _padded(points: Array, size: int) -> Array:
    return np.concatenate([points, np.repeat(points[-1:], size - len(points), axis=0)])
