"""From a start into the tree: the cheapest sequences of pushes, each different from the others."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from ...steering.fleet import Fleet
from .cars import axle_frames, car_table
from .tree import Tree, kinds


@dataclass(frozen=True, eq=False)
class Candidate:
    """One way to the goal.

    Attributes:
        poses: where it starts, changes the push, and ends, shape (m + 1, 3).
        pushes: of the m legs, numbers in the fleet.
        legs: their costs, shape (m,).
        cost: of all legs and changes of push.
    """

    poses: Array
    pushes: tuple[int, ...]
    legs: Array
    cost: float


def query(tree: Tree, start: ArrayLike, count: int = 30) -> list[Candidate]:
    """The best ways from a start to the tree's goal with different sequences of pushes, cheapest first.

    A way goes straight to the goal or to any pose of the tree, takes any push there, and then follows the
    tree. The first is the cheapest way through the graph, and, if count > 1, the best single push is always
    among them. With other poses in between, one push may follow itself where a word of three pieces would be
    dearer; never so for Dubins cars.

    Args:
        start: pose of the object, shape (3,).
        count: how many at most, ≥ 1.

    Raises:
        InputError: if the start is not three finite numbers.
    """
    from .kernels import cheapest, reach

    q = np.array(start, dtype=float)
    if q.shape != (3,) or not np.all(np.isfinite(q)):
        raise InputError("a pose is three finite numbers, [x, y, θ]", key="start", value=start)
    fleet = tree.fleet
    general, timed = kinds(fleet)
    k, n = tree.costs.shape
    frame = axle_frames(fleet, q[None])
    switching = np.array(fleet.switching, dtype=float, order="C")
    numbers = (len(tree.numbers[1]) + 1) * k
    reached = reach(frame, tree.frames, tree.cars, general, timed)
    best, which = cheapest(reached, tree.costs, switching, tree.keys, numbers, general is not None)
    direct = reached[:, n]
    better = direct <= best[:k]  # the number of a single push is its own
    best[:k], which[:k] = np.minimum(best[:k], direct), np.where(better, -1, which[:k])

    chosen = np.argsort(best, kind="stable")[:count].tolist()
    single = int(np.argmin(best[:k]))
    if single not in chosen and count > 1:
        chosen[-1] = single
    found = []
    for number in chosen:
        if np.isfinite(best[number]):
            found.append(_way(tree, q, reached, number % k, int(which[number])))
    return sorted(found, key=lambda way: way.cost)


def leg_cost(fleet: Fleet, push: int, start: ArrayLike, goal: ArrayLike) -> float:
    """What one push costs from pose to pose, as in the tree."""
    from .kernels import reach

    a, b = (axle_frames(fleet, np.asarray(X, dtype=float)[None]) for X in (start, goal))
    return float(reach(a, b, car_table(fleet), *kinds(fleet))[push, 0])


def _way(tree: Tree, start: Array, reached: Array, push: int, number: int) -> Candidate:
    """The way that a number of kernels.cheapest stands for; -1: straight to the goal."""
    k, n = tree.costs.shape
    poses, pushes, legs = [start], [push], []
    if number < 0:
        legs.append(reached[push, n])
    else:
        (push_there, j) = number % k, number // k % n
        legs.append(reached[push, j])
        while j >= 0:
            poses.append(tree.poses[j])
            pushes.append(push_there)
            after = int(tree.follow[push_there, j])
            rest = tree.arrived[push_there, after] if after >= 0 else 0.0
            legs.append(tree.costs[push_there, j] - rest)
            push_there, j = int(tree.take[push_there, after]), after
    poses.append(tree.goal)
    _join(tree.fleet, poses, pushes, legs)
    changes = sum(float(tree.fleet.switching[a, b]) for a, b in pairwise(pushes))
    costs = np.array(legs)
    return Candidate(np.array(poses), tuple(pushes), costs, float(costs.sum()) + changes)


def _join(fleet: Fleet, poses: list[Array], pushes: list[int], legs: list[float]) -> None:
    """Drops the pose between two legs with the same push where one leg is no dearer; in place."""
    at = 1
    while at < len(pushes):
        if pushes[at] == pushes[at - 1]:
            cost = leg_cost(fleet, pushes[at], poses[at - 1], poses[at + 1])
            if cost <= legs[at - 1] + legs[at] + 1e-12:
                legs[at - 1 : at + 1] = [cost]
                del poses[at], pushes[at]
                continue
        at += 1
