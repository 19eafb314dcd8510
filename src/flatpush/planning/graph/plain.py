"""The plain twin of the compiled tree: a table of all edges, then Dijkstra in a few lines of numpy."""

import numpy as np

from ...geometry import compose
from ...geometry.pose import Array
from ...steering import dubins
from ...steering.fleet import Fleet
from ...steering.three_twist import words


def plain_tree(table: Array, switching: Array) -> tuple[Array, Array]:
    """V and W of tree.Tree from edge_table; every settled copy is relaxed."""
    k, n = table.shape[0], table.shape[1] - 1
    V = table[:, :n, n].copy()
    W = np.min(V[None] + switching[:, :, None], axis=1)
    settled = np.zeros((k, n), dtype=bool)
    for _ in range(k * n):
        a, i = np.unravel_index(np.argmin(np.where(settled, np.inf, W)), W.shape)
        settled[a, i] = True
        cost = table[a, :n, i] + W[a, i]
        cost[i] = np.inf
        V[a] = np.minimum(V[a], cost)
        W = np.minimum(W, V[a][None] + switching[:, a][:, None])
    return V, W


def edge_table(fleet: Fleet, poses: Array, goal: Array) -> Array:
    """Costs of pushing from pose to pose, the goal last, shape (k, n + 1, n + 1)."""
    X = np.vstack([poses, goal])
    if fleet.is_dubins:
        cars = [compose(X, np.array([*p, h])) for p, h in zip(fleet.flat_point, fleet.heading, strict=True)]
        return np.stack(
            [dubins.shortest_length(Z[:, None], Z[None], r) for Z, r in zip(cars, fleet.radius, strict=True)]
        )
    return np.array([[[edge_cost(fleet, a, x, y) for y in X] for x in X] for a in range(fleet.size)])


def edge_cost(fleet: Fleet, push: int, start: Array, goal: Array) -> float:
    """Cost of the cheapest word of one push from pose to pose, time law included."""
    found = words(fleet.left[push], fleet.right[push], fleet.direction[push], start, goal)
    return min(
        sum(
            _arc_cost(fleet, push, "LSR".index(letter), p)
            for letter, p in zip(w.word, w.parameters, strict=True)
        )
        for w in found
    )


def _arc_cost(fleet: Fleet, push: int, letter: int, parameter: float) -> float:
    way = float(fleet.rates[push, letter] * parameter)
    speed, acceleration = float(fleet.speeds[push, letter]), float(fleet.accelerations[push, letter])
    if np.isinf(speed):
        return way
    if way * acceleration >= speed**2:
        return way / speed + speed / acceleration
    return 2 * float(np.sqrt(way / acceleration))
