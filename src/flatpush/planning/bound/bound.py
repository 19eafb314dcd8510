"""A lower bound on what plans cost, which gets better the longer it is sought."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np

from ...errors import InputError
from ...geometry import rotate
from ...geometry.pose import Array, wrap_angle
from ...problem import Scene
from ...steering.fleet import Fleet
from ..query import Query

if TYPE_CHECKING:
    from ..refine.problem import Candidate, Sequences
    from .chains import Chains

CHANGES = 2  # of contact, of the plans that are searched
OPEN = 1_000_000  # boxes that are kept at most, 130 MB in all
HALVED = 20_000  # boxes that are halved before the bound is told
SHORTEST = 5e-3  # leg of a plan, as in refine [m]


@dataclass(frozen=True, eq=False)
class Bound:
    """What was found by some moment.

    Attributes:
        least: what no plan costs less than: of at most one change of contact, and of at most two, shape (2,).
        least_of_all: the same of any number of changes between these pushes.
        found: a plan cheaper than the one that was given, or None.
        boxes: how many have been halved; open: how many are left.
        complete: whether the known plan is the cheapest of at most two changes, to a millionth.
        full: whether the search ends because there is no room for more boxes.
    """

    least: tuple[float, float]
    least_of_all: float
    found: "Candidate | None"
    boxes: int
    open: int
    complete: bool
    full: bool


def check_bound(scene: Scene) -> None:
    """Raises InputError for scenes of which no bound is known."""
    if scene.workspace.bounds is not None or scene.workspace.obstacles:
        raise InputError(
            "a bound on the cost is known for an empty table only", key="workspace", hint="Leave out --bound."
        )
    if scene.planning.cost == "time":
        raise InputError(
            "a bound is known for the costs flat and pusher", key="planning.cost", value="time",
            hint="Leave out --bound.",
        )  # fmt: skip
    if not scene.pusher.turns:
        raise InputError(
            "a bound is known for a hand that turns with the object", key="pusher.turns", value=False,
            hint="Leave out --bound.",
        )  # fmt: skip


def bounds(query: Query, cost: float, *, most: int = OPEN) -> Iterator[Bound]:
    """Better and better lower bounds on the cost of plans, endless until complete or full.

    Plans of at most one change and of two are searched by turns.

    Args:
        query: its cars have linear costs (no time laws); its world and `robust` are left out.
        cost: of a known plan [m]; plans that cost more are not looked at.
        most: how many boxes are kept open.

    Raises:
        InputError: for cars whose pieces take time, and for no room.
    """
    if not np.all(np.isinf(query.fleet.speeds)):
        raise InputError("a bound is known for costs that are lengths", key="planning.cost")
    from ..refine.problem import Sequences

    searches = [_Search(query, cost, legs, most // 2) for legs in ((1, 2), (3,))]
    more, sequences, found = _least_of_more(query, CHANGES + 1), Sequences.of(query, SHORTEST), None
    turn = 0
    while True:
        best = min(cost if found is None else found.cost, *(search.best for search in searches))
        for search in searches:
            better = search.taken(sequences)
            if better is not None and better.cost < (cost if found is None else found.cost) * (1 - 1e-9):
                found, best = better, min(best, better.cost)
        for search in searches:
            search.best = best
        one, two = (min(search.least, best) for search in searches)
        yield Bound(
            (one, min(one, two)), min(one, two, more), found, sum(search.halved for search in searches),
            sum(search.open for search in searches), all(search.complete for search in searches),
            any(search.full for search in searches),
        )  # fmt: skip
        going = [search for search in searches if not (search.complete or search.full)]
        if not going:
            return
        turn += 1
        going[turn % len(going)].go_on()


class _Search:
    """A search over the plans of some numbers of legs.

    Attributes:
        complete: whether no box is left that could hold a plan cheaper by a millionth, or only what is no box any more.
        full: whether there is no room for more.
    """

    def __init__(self, query: Query, cost: float, legs: tuple[int, ...], most: int) -> None:
        from .boxes import STATE, Boxes, begin

        self._cars, self._chains = query.fleet.cars, _chains(query, cost, legs)
        if len(self._chains.legs) + 2 > most:
            raise InputError("there is room for fewer boxes than sequences of pushes", value=most)
        self._boxes, self._state = Boxes.new(most), np.zeros(1, STATE)
        self._state["best"], self._state["chain"] = cost, -1
        begin(self._cars, self._chains, self._boxes, self._state)
        self.complete = self.full = False

    @property
    def best(self) -> float:
        """The cost of the cheapest plan that is known."""
        return float(self._state["best"][0])

    @best.setter
    def best(self, cost: float) -> None:
        from .boxes import CLOSE

        self._state["best"] = cost
        self.complete |= self.least >= cost * (1 - CLOSE)

    @property
    def least(self) -> float:
        """The least bound of the boxes that are left; infinite without any."""
        return float(self._boxes.bound[self._boxes.heap[0]]) if self.open else np.inf

    @property
    def open(self) -> int:
        return int(self._state["size"][0])

    @property
    def halved(self) -> int:
        return int(self._state["halved"][0])

    def go_on(self) -> None:
        from .boxes import CLOSE, halve

        if not halve(self._cars, self._chains, self._boxes, self._state, HALVED):
            room = len(self._boxes.bound) - int(self._state["used"][0] - self._state["freed"][0])
            self.full = room < 2 and self.least < self.best * (1 - CLOSE)
            self.complete = not self.full

    def taken(self, sequences: "Sequences") -> "Candidate | None":
        """The plan through the middle of a box that was cheaper than what was known, led downhill; once."""
        chain = int(self._state["chain"][0])
        self._state["chain"] = -1
        return None if chain < 0 else _polished(sequences, self._chains, chain, self._state["ends"][0])


def _polished(sequences: "Sequences", chains: "Chains", chain: int, ends: Array) -> "Candidate":
    """The plan through given ends of its legs, led downhill."""
    from ..refine.problem import Candidate

    legs = int(chains.legs[chain])
    poses = np.empty((legs + 1, 3))
    poses[0] = chains.start
    for leg, end in enumerate(ends[: 3 * legs].reshape(legs, 3)):
        poses[leg + 1] = [*(end[:2] - rotate(end[2], chains.at[chain, leg])), end[2]]
    begun = sequences.merged(chains.pushes[chain, :legs].copy(), poses)
    if len(begun.pushes) == 1:
        return begun
    descended = sequences.descend(Candidate(np.inf, begun.pushes, begun.poses), 6, 80)
    return min(begun, descended, key=lambda plan: plan.cost)


def _chains(query: Query, cost: float, numbers: tuple[int, ...]) -> "Chains":
    """Sequences of so many pushes, and a box that holds the ends of their legs in plans up to a cost."""
    from .chains import MOST_LEGS, Chains

    fleet, rows, way = query.fleet, [], _least_way(query)
    for number in numbers:
        for pushes in product(range(fleet.size), repeat=number):
            switching = sum(float(fleet.switching[a, b]) for a, b in pairwise(pushes))
            if all(a != b for a, b in pairwise(pushes)) and switching + way < cost:
                rows.append((pushes, switching))
    n = len(rows)
    legs = np.array([len(pushes) for pushes, _ in rows], np.int64)
    goal_half = query.slack * [1.0, 1.0, 0.0] + [0.0, 0.0, np.pi if query.free else query.slack[2]]
    middle, half, lever = np.zeros((3, n, MOST_LEGS, 3))
    at, order = np.zeros((n, MOST_LEGS, 2)), np.zeros((n, MOST_LEGS), np.int64)
    speeds = {}
    for i, (pushes, switching) in enumerate(rows):
        order[i, : len(pushes)] = pushes
        for leg in range(len(pushes)):
            lever[i, leg] = _levers(fleet, pushes[leg : leg + 2], at[i, leg])
            if leg == len(pushes) - 1:
                middle[i, leg], half[i, leg] = query.goal, goal_half
                continue
            pair = pushes[leg : leg + 2]
            point = at[i, leg] = np.mean(
                np.concatenate([fleet.left[list(pair)], fleet.right[list(pair)]]), axis=0
            )
            if pair not in speeds:
                speeds[pair] = _fastest(fleet, point)
            middle[i, leg], half[i, leg] = _ellipse(
                query, point, (cost - switching) * speeds[pair], goal_half
            )
    flat = (n, 3 * MOST_LEGS)
    changing = np.array([value for _, value in rows], dtype=float)
    return Chains(
        legs,
        order,
        changing,
        changing + way,
        query.start,
        middle.reshape(flat),
        half.reshape(flat),
        lever.reshape(flat),
        at,
    )


def _levers(fleet: Fleet, pushes: tuple[int, ...], point: Array) -> Array:
    """What the sides of a box are worth, which changes when legs end there, shape (3,): the mean over their cars."""
    some = list(pushes)
    arms = np.linalg.norm(np.stack([fleet.left[some], fleet.right[some]]) - point, axis=2)
    straight = np.mean(fleet.rates[some, 1])
    return np.array([straight, straight, straight * np.mean(arms) + np.mean(fleet.rates[some][:, [0, 2]])])


def _fastest(fleet: Fleet, point: Array) -> float:
    """How far a point of the object goes at most for a cost of 1 [m per unit of cost]."""
    arms = np.linalg.norm(np.stack([fleet.left, fleet.right]) - point, axis=2)
    return float(max(np.max(arms.T / fleet.rates[:, [0, 2]]), np.max(1.0 / fleet.rates[:, 1])))


def _ellipse(query: Query, point: Array, length: float, slack: Array) -> tuple[Array, Array]:
    """A box around the places of a point on ways up to a length, and all angles: middle and half sides, (3,) each."""
    a = query.start[:2] + rotate(query.start[2], point)
    b = query.goal[:2] + rotate(query.goal[2], point)
    length += float(np.hypot(*slack[:2])) + 2 * float(np.hypot(*point)) * np.sin(0.5 * min(slack[2], np.pi))
    d = b - a
    apart = float(np.hypot(*d))
    along = d / apart if apart > 0 else np.array([1.0, 0.0])
    major = 0.5 * max(length, apart)
    minor = np.sqrt(max(major**2 - 0.25 * apart**2, 0.0))
    half = np.hypot(major * along, minor * along[::-1])
    return np.array([*(0.5 * (a + b)), 0.0]), np.array([*half, np.pi])


def _least_of_more(query: Query, changes: int) -> float:
    """What plans of at least so many changes cost at least."""
    fleet = query.fleet
    if fleet.size == 1:
        return np.inf
    apart = ~np.eye(fleet.size, dtype=bool)
    return changes * float(np.min(fleet.switching[apart])) + _least_way(query)


def _least_way(query: Query) -> float:
    """What any pushes cost at least, changes aside: by the way of a point of the object, or by its turn."""
    fleet = query.fleet
    turn = abs(float(wrap_angle(query.goal[2] - query.start[2])))
    slack = np.pi if query.free else float(query.slack[2])
    least = float(np.min(fleet.rates[:, [0, 2]])) * max(turn - slack, 0.0)
    for point in (*fleet.left, *fleet.right, *fleet.flat_point, np.zeros(2)):
        a = query.start[:2] + rotate(query.start[2], point)
        b = query.goal[:2] + rotate(query.goal[2], point)
        spare = float(np.hypot(*query.slack[:2])) + 2 * float(np.hypot(*point)) * np.sin(
            0.5 * min(slack, np.pi)
        )
        least = max(least, (float(np.hypot(*(b - a))) - spare) / _fastest(fleet, point))
    return least
