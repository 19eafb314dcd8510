"""What is asked of a search: from a start to a goal with some cars, in a world, for the least cost."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arguments import vector
from ..errors import InputError
from ..geometry.collision import Body, World
from ..geometry.collision.world import Box
from ..geometry.pose import Array
from ..steering.fleet import Fleet
from .query_arrays import HULL, QueryArrays

OFFSET, OFFSET_ANGLE = (
    2e-4,
    float(np.deg2rad(0.2)),
)  # of the switch poses, for the cost of replanning [m, rad]


def offsets() -> Array:
    """The sixteen displacements over which the cost of replanning is a mean, in W, shape (16, 3) [m, m, rad]."""
    angles = np.arange(8) * (np.pi / 4)
    ring = np.column_stack([OFFSET * np.cos(angles), OFFSET * np.sin(angles)])
    return np.column_stack([np.tile(ring, (2, 1)), np.repeat([OFFSET_ANGLE, -OFFSET_ANGLE], 8)])


@dataclass(frozen=True, eq=False)
class Query:
    """From a start to a goal with a fleet, in a world; where nothing is in the way, the world is empty.

    Attributes:
        fleet: the cars and what their motions and changes cost; an infinite cost forbids a change.
        start, goal: poses X_WO, shape (3,) [m, m, rad].
        other_starts, other_goals: where a path may begin or end as well, shape (n, 3).
        world: bounds and obstacles.
        bodies: object and fingertips of each push; needed only in a world that is not empty, as what follows.
        backs: where the fingertips land, from where they push, in O, shape (k, 2) [m]: what lies between the
            contact and that place is clear too.
        clearance: that must be kept [m].
        room: clearance that a change of push needs [m]: what the hand takes to go around the object on the table, or
            0 if it is lifted.
        inside: whether a change of push needs room to turn the hand anyhow within the bounds.
        free: whether the object may have any angle at the goal, whose own is then one of them.
        slack: how far from the goal the end may be, shape (3,) [m, m, rad]; its angle counts unless that is free.
        robust: whether a path is judged by what it costs when every switch pose is missed by a little and the next
            push is planned again (offsets), instead of by its own cost.
        begins, ends: the pushes that a path may begin with and end with, shape (k,); None: any.

    Raises:
        InputError: for poses that are not finite or of another shape, or an empty fleet.
    """

    fleet: Fleet
    start: Array
    goal: Array
    world: World = field(default_factory=World.of)
    bodies: Sequence[Body] = ()
    backs: Array = field(default_factory=lambda: np.zeros((0, 2)))
    clearance: float = 0.0
    room: float = 0.0
    inside: bool = False
    free: bool = False
    slack: Array = field(default_factory=lambda: np.zeros(3))
    robust: bool = False
    begins: NDArray[np.bool_] | None = None
    ends: NDArray[np.bool_] | None = None
    other_starts: Array = field(default_factory=lambda: np.zeros((0, 3)))
    other_goals: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        for name in ("start", "goal"):
            rule = f"the {name} is one finite pose (x, y, θ)"
            object.__setattr__(self, name, vector(getattr(self, name), 3, rule))
        if self.fleet.size == 0:
            raise InputError("there is at least one push", value=0)

    @cached_property
    def arrays(self) -> QueryArrays:
        """What the kernels among obstacles take."""
        from .obstacles.kernels import stands

        bodies = [body.arrays for body in self.bodies]
        most = max(len(body.points) for body in bodies)
        points = np.stack([_padded(body.points, most) for body in bodies])
        tips = np.ascontiguousarray(points[:, bodies[0].corners + int(self.bodies[0].outline.is_circle) :])
        places = np.stack([tips["x"], tips["y"]], axis=-1)
        middle = places.mean(axis=1)
        reach = np.max(np.linalg.norm(places - middle[:, None], axis=2) + tips["radius"], axis=1)
        hulls = np.array([body[1:] for body in bodies], HULL)
        hands = np.array([(0, *at, r) for at, r in zip(middle.tolist(), reach.tolist(), strict=True)], HULL)
        arrays = QueryArrays(
            self.world.arrays, points, hulls, tips, hands, np.array(self.backs, dtype=float, order="C"),
            self.fleet.cars, np.array(self.fleet.switching, dtype=float, order="C"),
            np.zeros(self.fleet.size, np.bool_), offsets() if self.robust else np.zeros((0, 3)), self.goal.copy(),
            np.array([*self.slack[:2], np.pi if self.free else self.slack[2]]), self.clearance, self.room, self.inside,
        )  # fmt: skip
        arrays.last[:] = [
            _among(self.ends, a) and stands(arrays, a, self.goal) for a in range(self.fleet.size)
        ]
        return arrays

    def able(self, pose: Array) -> list[int]:
        """The pushes whose fingers land or leave at a pose, clear of everything."""
        from .obstacles.kernels import stands

        return [a for a in range(self.fleet.size) if stands(self.arrays, a, pose)]

    @cached_property
    def first(self) -> list[int]:
        """The pushes that can begin: their fingers land at the start."""
        return self._beginning(self.start)

    @cached_property
    def last(self) -> list[int]:
        """The pushes that can end: their fingers leave at the goal."""
        return [a for a, able in enumerate(self.arrays.last.tolist()) if able]

    @cached_property
    def roots(self) -> list[tuple[Array, list[int]]]:
        """All poses where a path may begin, with the pushes that can begin there."""
        return [(pose, self._beginning(pose)) for pose in (self.start, *self.other_starts)]

    def _beginning(self, pose: Array) -> list[int]:
        return [a for a in self.able(pose) if _among(self.begins, a)]

    @cached_property
    def aims(self) -> list[tuple[Array, QueryArrays]]:
        """All poses where a path may end, with the arrays of a query that has this one as its goal."""
        found = [(self.goal, self.arrays)]
        for pose in self.other_goals:
            last = np.zeros(self.fleet.size, np.bool_)
            last[[a for a in self.able(pose) if _among(self.ends, a)]] = True
            found.append((pose, self.arrays._replace(goal=pose.copy(), last=last)))
        return found

    @cached_property
    def extent(self) -> Box:
        """The bounds, or a box around everything with room to pass by [m]."""
        every = np.concatenate([self.start[None, :2], self.goal[None, :2], *self.world.boxes])
        margin = 2 * self.bodies[0].outline.size + 3 * float(np.max(self.fleet.radius))
        box = np.concatenate([every.min(axis=0) - margin, every.max(axis=0) + margin])
        return Box(*np.where(np.isfinite(self.world.bounds), self.world.bounds, box).tolist())

    @cached_property
    def reversed(self) -> "Query":
        """The same backwards in time: from the goal to the start, every motion the other way around."""
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
        return replace(
            self,
            fleet=back,
            start=self.goal,
            goal=self.start,
            begins=self.ends,
            ends=self.begins,
            other_starts=self.other_goals,
            other_goals=self.other_starts,
        )


def _among(few: NDArray[np.bool_] | None, push: int) -> bool:
    return few is None or bool(few[push])


def _padded(points: np.ndarray, size: int) -> np.ndarray:
    """The same with its last row repeated."""
    return np.concatenate([points, np.repeat(points[-1:], size - len(points))])
