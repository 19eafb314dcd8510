"""Cheapest ways from many poses to a goal with many pushes: the graph of [Zhou2017] Sec. 5.1 as a tree."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from ...steering.fleet import Fleet
from .cars import axle_frames, car_table, has_time_law

VERSION = 1  # of what a tree means; part of its key
STORED = {"costs": np.float64, "arrived": np.float64, "follow": np.int32, "take": np.int16}


@dataclass(frozen=True, eq=False)
class Tree:
    """For every pose and push what the rest of the way to the goal costs, and where it leads.

    Any pose may follow any other: pushing with push a from pose j to pose i costs the cheapest word between
    them. A change of push costs fleet.switching[from, to]. No push leads back to the pose where it began.

    Attributes:
        fleet, poses, goal: what it was built for; poses of shape (n, 3).
        costs: V, from pose j when the next push is a, shape (k, n).
        arrived: W, from pose j when push a has led there: the least of V(j, b) + switching(a, b), shape (k, n).
        follow: the pose where push a from pose j ends, shape (k, n); -1 is the goal.
        take: the push that then goes on from pose j, if push a has led there, shape (k, n).
    """

    fleet: Fleet
    poses: Array
    goal: Array
    costs: Array
    arrived: Array
    follow: np.ndarray
    take: np.ndarray

    @cached_property
    def key(self) -> str:
        """tree_key of what it was built for."""
        return tree_key(self.fleet, self.poses, self.goal)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """What to store; the rest is given by what the tree was built for."""
        return {name: getattr(self, name) for name in STORED}

    @classmethod
    def from_arrays(cls, fleet: Fleet, poses: Array, goal: Array, arrays: Mapping[str, np.ndarray]) -> "Tree":
        """A stored tree.

        Raises:
            InputError: if the arrays cannot be a tree of these pushes and poses.
        """
        fleet, poses, goal = _checked(fleet, poses, goal)
        k, n = fleet.size, len(poses)
        for name, kind in STORED.items():
            if name not in arrays or arrays[name].shape != (k, n) or arrays[name].dtype != kind:
                raise InputError("a tree has costs and followers for each push and pose", key=name)
        tree = cls(fleet, poses, goal, *(np.ascontiguousarray(arrays[name]) for name in STORED))
        sound = (
            not np.any(np.isnan(tree.costs) | np.isnan(tree.arrived))
            and np.all((tree.follow >= -1) & (tree.follow < n))
            and np.all((tree.take >= 0) & (tree.take < k))
        )
        if not sound:
            raise InputError("a tree points to its own poses and pushes")
        _ = tree.numbers  # refuses ways that never end
        return tree

    @cached_property
    def frames(self) -> Array:
        """The axle frames of the poses and the goal."""
        return axle_frames(self.fleet, np.vstack([self.poses, self.goal]))

    @cached_property
    def cars(self) -> Array:
        return car_table(self.fleet)

    @cached_property
    def numbers(self) -> tuple[np.ndarray, list[int], list[int]]:
        """The push sequences of the tree, numbered.

        Returns:
            the number for each push and pose, shape (k, n), and for each number its first push and the number of the
            rest (-1: nothing).
        """
        k, n = self.costs.shape
        number = np.full((k, n), -2)
        firsts: list[int] = []
        rests: list[int] = []
        known: dict[tuple[int, int], int] = {}
        a, j = (x.ravel() for x in np.indices((k, n)))
        while len(a):
            i = self.follow[a, j]
            then = self.take[a, i]
            rest = np.where(i < 0, -1, number[then, i])
            same = (i >= 0) & (then == a)
            ready = rest > -2
            if not ready.any():
                raise InputError("the ways of a tree end at the goal")
            pairs = np.stack([a, rest], axis=1)[ready & ~same]
            distinct, back = np.unique(pairs, axis=0, return_inverse=True)
            found = []
            for push, tail in distinct.tolist():
                if (push, tail) not in known:
                    known[push, tail] = len(firsts)
                    firsts.append(push)
                    rests.append(tail)
                found.append(known[push, tail])
            fresh = ready & ~same
            number[a[fresh], j[fresh]] = np.array(found, dtype=int)[back.ravel()]
            chained = ready & same
            number[a[chained], j[chained]] = rest[chained]
            a, j = a[~ready], j[~ready]
        return number, firsts, rests

    @cached_property
    def keys(self) -> np.ndarray:
        """Numbers of push sequences from outside: push i to pose j, then push b there, shape (k, k, n), int32.

        A sequence of first push i and rest t has the number (t + 1) k + i.
        """
        k, n = self.costs.shape
        number, _, rests = self.numbers
        table = np.empty((k, k, n), dtype=np.int32)
        for i in range(k):
            table[i] = (number + 1) * k + i
            table[i, i] = (np.array(rests, dtype=int)[number[i]] + 1) * k + i if n else 0
        return table

    def sequence(self, number: int) -> tuple[int, ...]:
        """The pushes of a sequence of `keys`."""
        k = self.fleet.size
        _, firsts, rests = self.numbers
        pushes, rest = [number % k], number // k - 1
        while rest >= 0:
            pushes.append(firsts[rest])
            rest = rests[rest]
        return tuple(pushes)


def build_tree(fleet: Fleet, poses: ArrayLike, goal: ArrayLike) -> Tree:
    """Builds the tree, exactly; compiled, on one thread and without the interpreter's lock.

    Args:
        fleet: the cars, costs and switching costs of k pushes.
        poses: of the object, shape (n, 3); n may be 0.
        goal: of the object, shape (3,).

    Raises:
        InputError: for no push, poses that are not finite, or switching costs that are negative or nan. An infinite
            one forbids the switch.
    """
    from .kernels import grow

    fleet, X, Y = _checked(fleet, poses, goal)
    frames = axle_frames(fleet, np.vstack([X, Y]))
    general, timed = kinds(fleet)
    switching = np.array(fleet.switching, dtype=float, order="C")
    switch_only = fleet.is_dubins and _obeys_triangle(switching)
    V, W, follow, take = grow(frames, car_table(fleet), switching, switch_only, general, timed)
    return Tree(fleet, X, Y, V, W, follow, take)


def tree_key(fleet: Fleet, poses: ArrayLike, goal: ArrayLike) -> str:
    """What a tree belongs to, as a hash (sha256, hexadecimal): all that it is built from, and the version."""
    digest = hashlib.sha256(f"flatpush tree {VERSION}".encode())
    parts = [getattr(fleet, name) for name in Fleet.__dataclass_fields__]
    for part in (*parts, poses, goal):
        array = np.ascontiguousarray(part, dtype="<f8")
        digest.update(repr(array.shape).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def kinds(fleet: Fleet) -> tuple[int | None, int | None]:
    """The arguments `general` and `timed` of the kernels: None for what the fleet does not need."""
    if fleet.is_dubins:
        return None, None
    return 1, 1 if has_time_law(fleet) else None


def _obeys_triangle(switching: Array) -> bool:
    through = np.min(switching[:, :, None] + switching[None], axis=1)
    return bool(np.all(switching <= through))


def _checked(fleet: Fleet, poses: ArrayLike, goal: ArrayLike) -> tuple[Fleet, Array, Array]:
    X = np.array(poses, dtype=float).reshape(-1, 3)
    Y = np.array(goal, dtype=float)
    if fleet.size == 0:
        raise InputError("a tree needs at least one push", key="pushes")
    if Y.shape != (3,) or not (np.all(np.isfinite(X)) and np.all(np.isfinite(Y))):
        raise InputError("poses are three finite numbers each")
    switching = np.asarray(fleet.switching)
    if (
        switching.shape != (fleet.size, fleet.size)
        or not np.all(switching >= 0)
        or np.any(np.diag(switching))
    ):
        raise InputError(
            "switching costs are k × k numbers, 0 or more, zero on the diagonal",
            key="switch_cost",
            value=switching.tolist(),
        )
    return fleet, X, Y
