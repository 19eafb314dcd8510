"""A query as the refinement sees it: the fleet as compiled arrays, the two ends, what a sequence of pushes costs."""

from dataclasses import dataclass

import numpy as np

from ...geometry.pose import Array
from ...steering import dubins
from ...steering.fleet import Fleet

OFFSET, OFFSET_ANGLE = 2e-4, np.deg2rad(0.2)  # of the switch poses, for the cost of replanning [m, rad]
SETTLING = 4e-3 * 0.5 ** np.arange(7)  # steps of settle [m, and radii for the angle]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A sequence of pushes with its switch poses.

    Attributes:
        cost: of legs and switching.
        pushes: index of the push of every leg, shape (n,).
        poses: X_WO at the start, at every switch and at the goal, shape (n + 1, 3).
    """

    cost: float
    pushes: np.ndarray
    poses: Array

    @property
    def key(self) -> tuple[int, ...]:
        return tuple(int(p) for p in self.pushes)


@dataclass(frozen=True, eq=False)
class Query:
    """From a start to a goal with a fleet; legs of plans with several pushes are at least `least` long [m]."""

    fleet: Fleet
    start: Array
    goal: Array
    least: float
    cars: Array
    laws: Array
    offsets: Array
    flat: bool

    @classmethod
    def of(cls, fleet: Fleet, start: Array, goal: Array, least: float) -> "Query":
        cars = np.column_stack([fleet.left, fleet.right, fleet.direction, fleet.radius])
        laws = np.stack([fleet.rates, fleet.speeds, fleet.accelerations], axis=-1)
        around = np.arange(8) * (np.pi / 4)
        ring = np.column_stack([OFFSET * np.cos(around), OFFSET * np.sin(around)])
        signs = np.repeat([OFFSET_ANGLE, -OFFSET_ANGLE], 8)
        offsets = np.column_stack([np.tile(ring, (2, 1)), signs])
        return cls(
            fleet,
            start,
            goal,
            least,
            np.ascontiguousarray(cars),
            np.ascontiguousarray(laws),
            offsets,
            fleet.is_dubins,
        )

    def switching(self, pushes: np.ndarray) -> float:
        return float(np.sum(self.fleet.switching[pushes[:-1], pushes[1:]]))

    def candidate(self, pushes: np.ndarray, poses: Array) -> Candidate:
        """The cost of a sequence as it is; infinite if a leg is too short."""
        from .kernels import chain_cost, shortest_flat

        legs = np.empty((len(pushes), 3, 2))
        cost = chain_cost(self.cars, self.laws, pushes, poses, legs) + self.switching(pushes)
        if len(pushes) > 1 and shortest_flat(self.cars, pushes, legs) < self.least * (1 - 1e-6):
            cost = np.inf
        return Candidate(float(cost), pushes, poses)

    def merged(self, pushes: np.ndarray, poses: Array) -> Candidate:
        """The same, equal neighbours being joined to one leg."""
        same = np.flatnonzero(pushes[1:] == pushes[:-1])
        return self.candidate(
            np.delete(pushes, same), np.ascontiguousarray(np.delete(poses, same + 1, axis=0))
        )

    def arcs(self, found: Candidate) -> Array:
        """Rows (letter, amount) of every leg, shape (n, 3, 2); letters 0 left, 1 straight, 2 right."""
        from .kernels import chain_cost

        legs = np.empty((len(found.pushes), 3, 2))
        chain_cost(self.cars, self.laws, found.pushes, found.poses, legs)
        return legs

    def direct(self) -> Candidate:
        """The best single push."""
        ends = np.array([self.start, self.goal])
        return min(
            (self.candidate(np.array([k]), ends) for k in range(self.fleet.size)),
            key=lambda found: found.cost,
        )

    def descend(self, found: Candidate, repeats: int, steps: int) -> Candidate:
        """The sequence with its switch poses moved downhill."""
        from .descent.kernels import descend

        poses = found.poses.copy()
        cost = descend(self.cars, self.laws, found.pushes, poses, self.least, repeats, steps)
        return Candidate(float(cost) + self.switching(found.pushes), found.pushes, poses)

    def replanning(self, found: Candidate) -> float:
        """Mean cost when every leg but the first starts OFFSET and OFFSET_ANGLE off, over sixteen fixed displacements.

        The leg is planned again from there to where it was to end.
        """
        from .kernels import offsets_cost

        cost = offsets_cost(self.cars, self.laws, found.pushes, found.poses, self.offsets)
        return float(cost) + self.switching(found.pushes)

    def settle(self, found: Candidate) -> Candidate:
        """The sequence moved to where replanning costs least nearby."""
        from .kernels import settle

        poses = found.poses.copy()
        settle(self.cars, self.laws, found.pushes, poses, self.offsets, self.least, SETTLING)
        return self.candidate(found.pushes, poses)

    def table(self, starts: Array, goals: Array) -> Array:
        """Cost of every push from each start (n, 3) to each goal (m, 3), shape (k, n, m)."""
        fleet = self.fleet
        if self.flat:
            return np.stack(
                [
                    dubins.shortest_length(
                        self._flat(k, starts)[:, None], self._flat(k, goals)[None], fleet.radius[k]
                    )
                    for k in range(fleet.size)
                ]
            )
        from .kernels import leg_table

        costs = np.empty((fleet.size, len(starts), len(goals)))
        leg_table(self.cars, self.laws, np.ascontiguousarray(starts), np.ascontiguousarray(goals), costs)
        return costs

    def _flat(self, push: int, poses: Array) -> Array:
        x, y = self.fleet.flat_point[push]
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        return np.column_stack(
            [poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y, poses[:, 2] + self.fleet.heading[push]]
        )
