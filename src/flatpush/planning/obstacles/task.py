"""A query among obstacles as its searches see it: cars, bodies, the world, what must be kept."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...geometry.collision import Body, World
from ...geometry.collision.world import Box, WorldArrays
from ...geometry.pose import Array
from ...steering.fleet import Fleet

# A car in O: turning centres [m], unit vector straight on, turning radius of the flat point [m].
CAR = np.dtype(
    [(name, "f8") for name in ("left_x", "left_y", "right_x", "right_y", "ahead_x", "ahead_y", "radius")],
    align=True,
)
# What one of its motions costs, see Fleet.
LAW = np.dtype([(name, "f8") for name in ("rate", "speed", "acceleration")], align=True)
# How many points are corners, and a circle around all points, in O [m].
HULL = np.dtype([("corners", "i8"), ("x", "f8"), ("y", "f8"), ("reach", "f8")], align=True)


class TaskArrays(NamedTuple):
    """A task as kernels see it; the first axis is the push.

    Attributes:
        world: bounds and obstacles.
        points, hulls: object and fingertips; tips, hands: the fingertips alone. Of POINT (k, n) and HULL (k,).
        backs: where the fingertips land, from where they push, in O, shape (k, 2) [m].
        cars, laws: of CAR, shape (k,), and of LAW, shape (k, 3): left, straight, right.
        switching: cost of changing from one push to another, shape (k, k).
        last: whether a push may end at the goal, shape (k,).
        need, room, inside: Task.clearance, Task.room, Task.inside.
    """

    world: WorldArrays
    points: np.ndarray
    hulls: np.ndarray
    tips: np.ndarray
    hands: np.ndarray
    backs: Array
    cars: np.ndarray
    laws: np.ndarray
    switching: Array
    last: np.ndarray
    need: float
    room: float
    inside: bool


@dataclass(frozen=True, eq=False)
class Task:
    """From a start to a goal with a fleet, in a world.

    Attributes:
        fleet: the cars and what their motions and changes cost.
        world: bounds and obstacles.
        bodies: object and fingertips of each push.
        backs: where the fingertips land, from where they push, in O, shape (k, 2) [m]: what lies between the
            contact and that place is clear too.
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
    def arrays(self) -> TaskArrays:
        """What the kernels take."""
        fleet, k = self.fleet, self.fleet.size
        bodies = [body.arrays for body in self.bodies]
        most = max(len(body.points) for body in bodies)
        points = np.stack([_padded(body.points, most) for body in bodies])
        tips = np.ascontiguousarray(points[:, bodies[0].corners + int(self.bodies[0].outline.is_circle) :])
        places = np.stack([tips["x"], tips["y"]], axis=-1)
        middle = places.mean(axis=1)
        reach = np.max(np.linalg.norm(places - middle[:, None], axis=2) + tips["radius"], axis=1)
        hulls = np.array([body[1:] for body in bodies], HULL)
        hands = np.array([(0, *at, r) for at, r in zip(middle.tolist(), reach.tolist(), strict=True)], HULL)
        cars = np.ascontiguousarray(np.column_stack([fleet.left, fleet.right, fleet.direction, fleet.radius]))
        laws = np.ascontiguousarray(np.stack([fleet.rates, fleet.speeds, fleet.accelerations], axis=-1))
        arrays = TaskArrays(
            self.world.arrays, points, hulls, tips, hands, np.array(self.backs, dtype=float, order="C"),
            cars.view(CAR)[:, 0], laws.view(LAW)[:, :, 0], np.array(fleet.switching, dtype=float, order="C"),
            np.zeros(k, np.bool_), self.clearance, self.room, self.inside,
        )  # fmt: skip
        from .kernels import stands

        arrays.last[:] = [stands(arrays, a, self.goal) for a in range(k)]
        return arrays

    def __post_init__(self) -> None:
        for name in ("start", "goal"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))

    @cached_property
    def extent(self) -> Box:
        """The bounds, or a box around everything with room to pass by."""
        every = np.concatenate([self.start[None, :2], self.goal[None, :2], *self.world.boxes])
        margin = 2 * self.bodies[0].outline.size + 3 * float(np.max(self.fleet.radius))
        box = np.concatenate([every.min(axis=0) - margin, every.max(axis=0) + margin])
        return Box(*np.where(np.isfinite(self.world.bounds), self.world.bounds, box).tolist())

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
        from .kernels import stands

        return [a for a in range(self.fleet.size) if stands(self.arrays, a, self.start)]

    @cached_property
    def last(self) -> list[int]:
        """The pushes that can end: their fingers leave at the goal."""
        return [a for a, able in enumerate(self.arrays.last.tolist()) if able]


def _padded(points: np.ndarray, size: int) -> np.ndarray:
    """The same with its last row repeated."""
    return np.concatenate([points, np.repeat(points[-1:], size - len(points))])
