"""The graph of [Zhou2017] Sec. 5.1 in plain numpy: a table of all edges, Dijkstra on it, and queries.

Any pose may follow any other; pushing with push a from pose j to pose i costs the shortest Dubins path between them,
and a change of push costs fleet.switching[from, to].
"""

from typing import NamedTuple

import numpy as np

from flatpush.geometry import compose
from flatpush.steering import dubins
from flatpush.steering.fleet import Fleet


class PoseSequence(NamedTuple):
    """A way to the goal: poses (m + 1, 3), pushes and costs of the m legs, and the cost with the changes of push."""

    poses: np.ndarray
    pushes: list[int]
    legs: list[float]
    cost: float


class PlanGraph:
    """Cheapest ways of Dubins cars from poses (n, 3) to a goal.

    Attributes:
        costs: from pose j to the goal when the next push is a, shape (k, n).
        arrived: the same when push a has led to j, shape (k, n).
        follow: the pose where push a from pose j ends, shape (k, n); -1 is the goal.
    """

    def __init__(self, fleet: Fleet, poses: np.ndarray, goal: np.ndarray) -> None:
        self.fleet, self.poses, self.goal = fleet, np.asarray(poses, float), np.asarray(goal, float)
        k, n = fleet.size, len(self.poses)
        table = self._lengths(self.poses[:, None], np.vstack([self.poses, self.goal]))  # (k, n, n + 1)
        self.costs, self.follow = table[:, :, n].copy(), np.full((k, n), -1)
        self.arrived = np.min(self.costs[None] + fleet.switching[:, :, None], axis=1)
        open_ = np.ones((k, n), dtype=bool)
        for _ in range(k * n):
            a, i = np.unravel_index(np.argmin(np.where(open_, self.arrived, np.inf)), (k, n))
            open_[a, i] = False
            cost = table[a, :, i] + self.arrived[a, i]
            cost[i] = np.inf
            better = cost < self.costs[a]
            self.costs[a, better], self.follow[a, better] = cost[better], i
            self.arrived = np.minimum(self.arrived, self.costs[a] + fleet.switching[:, a][:, None])

    def query(self, start: np.ndarray) -> tuple[PoseSequence, float]:
        """The cheapest way from a start, and the cost of the best single push."""
        reached = self._lengths(np.asarray(start, float)[None], np.vstack([self.poses, self.goal]))
        onward = np.hstack([self.arrived, np.zeros((self.fleet.size, 1))])
        push, at = np.unravel_index(np.argmin(reached + onward), reached.shape)
        poses, pushes, legs = [np.asarray(start, float)], [int(push)], [float(reached[push, at])]
        cost, n = float((reached + onward)[push, at]), len(self.poses)
        while at < n:
            poses.append(self.poses[at])
            push = np.argmin(self.costs[:, at] + self.fleet.switching[push])
            then = self.follow[push, at]
            pushes.append(int(push))
            legs.append(float(self.costs[push, at] - (self.arrived[push, then] if then >= 0 else 0.0)))
            at = then if then >= 0 else n
        return PoseSequence(np.array([*poses, self.goal]), pushes, legs, cost), float(reached[:, n].min())

    def _lengths(self, starts: np.ndarray, goals: np.ndarray) -> np.ndarray:
        cars = np.column_stack([self.fleet.flat_point, self.fleet.heading])
        return np.stack(
            [
                dubins.shortest_length(compose(starts, car), compose(goals, car), radius)
                for car, radius in zip(cars, self.fleet.radius, strict=True)
            ]
        )
