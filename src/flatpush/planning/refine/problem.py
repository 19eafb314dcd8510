"""Sequences of pushes with their switch poses: what they cost, and how they are moved to where they cost less."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from ...errors import InputError
from ...geometry.pose import Array
from ...steering.fleet import Fleet
from ...steering.free_heading import cheapest_headings
from ...steering.six_words import WORD, Records, chain_cost
from ..query import Query, offsets
from .descent import Work, descend

ANGLES = 24  # at a goal with a free angle, that seeds end with; the descent moves on from them
THOROUGH = 4  # repeats of a descent after which a plan also slides to the cheapest end
SLIDES = 30
PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of the way to a side of the goal's box
FOLLOWING = 40  # steps of a descent from a plan nearby
NOWHERE: Array = np.zeros((0, 3))
SETTLING: Array = 4e-3 * 0.5 ** np.arange(7.0)  # steps of settle [m, and radii for the angle]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A sequence of pushes with its switch poses.

    Attributes:
        cost: of legs and switching; infinite also where it is not known yet.
        pushes: index of the push of every leg, shape (n,).
        poses: X_WO at the start, at every switch and at the goal, shape (n + 1, 3).
    """

    cost: float
    pushes: np.ndarray
    poses: Array

    @cached_property
    def key(self) -> tuple[int, ...]:
        return tuple(self.pushes.tolist())


@dataclass(frozen=True, eq=False)
class Sequences:
    """What sequences of pushes from the start to the goal of a query cost on an empty table.

    Attributes:
        fleet, start, goal, free, slack: of the query.
        endpoints: where plans may end, shape (e, 3): the goal first, then others about it where they will do.
        least: that the flat path of each leg of a plan with several pushes is long [m].
        cars: the fleet as records; changes: its switching costs; flat: whether all are Dubins cars.
        offsets: displacements of the switch poses for the cost of replanning, shape (16, 3).
    """

    fleet: Fleet
    start: Array
    goal: Array
    free: bool
    slack: Array
    endpoints: Array
    least: float
    cars: Records
    changes: list[list[float]]
    offsets: Array
    flat: bool
    _works: dict[tuple[int, int], Work] = field(default_factory=dict)

    @classmethod
    def of(cls, query: Query, least: float) -> "Sequences":
        """Raises InputError if the least length is negative."""
        if not least >= 0:
            raise InputError("the least length of a leg is 0 or more", value=least)
        fleet = query.fleet
        return cls(
            fleet, query.start, query.goal, query.free, query.slack, _ends(query), float(least), fleet.cars,
            fleet.switching.tolist(), offsets(), fleet.is_dubins,
        )  # fmt: skip

    def switching(self, pushes: np.ndarray) -> float:
        sequence = pushes.tolist()
        return sum((self.changes[a][b] for a, b in pairwise(sequence)), 0.0)

    def chain(self, pushes: np.ndarray, poses: Array) -> tuple[float, Records]:
        """Cost of the legs between poses without switching, and their words, records of six_words.WORD, shape (n,)."""
        words = np.zeros(len(pushes), WORD)
        return chain_cost(self.cars, pushes, poses, words), words

    def candidate(self, pushes: np.ndarray, poses: Array) -> Candidate:
        """The cost of a sequence as it is; infinite if a leg is too short."""
        cost, words = self.chain(pushes, poses)
        if len(pushes) > 1 and words["flat"].min() < self.least * (1 - 1e-6):
            cost = np.inf
        return Candidate(cost + self.switching(pushes), pushes, poses)

    def merged(self, pushes: np.ndarray, poses: Array) -> Candidate:
        """The same, equal neighbours being joined to one leg."""
        return self.candidate(*joined(pushes, poses))

    def direct(self) -> Candidate:
        """The best single push."""
        singles = (
            min(
                (self.candidate(np.array([k]), np.array([self.start, end])) for end in self.endpoints),
                key=lambda found: found.cost,
            )
            for k in range(self.fleet.size)
        )
        return min((self._slid(single, np.zeros(3)) for single in singles), key=lambda found: found.cost)

    def descend(self, found: Candidate, repeats: int, steps: int) -> Candidate:
        """The sequence with its switch poses moved downhill; infinite if a leg stays too short (a single one may).

        After several repeats its end slides as well, to where it is the cheapest within the slack.
        """
        found, slopes = self._descended(found, repeats, steps)
        return self._slid(found, slopes) if repeats >= THOROUGH else found

    def _descended(
        self, found: Candidate, repeats: int, steps: int, ends: Array = NOWHERE
    ) -> tuple[Candidate, Array]:
        """The same at fixed ends, or led to others, and what the cost changes when the end moves [per m, m, rad]."""
        pushes, best = found.pushes, found.poses.copy()
        work = self._work(len(pushes), int(pushes[0]))
        cost = descend(work, self.cars, pushes, best.copy(), best, ends, repeats, steps)
        return Candidate(cost + self.switching(pushes), pushes, best), work.lam[:3].copy()

    def _work(self, count: int, first: int) -> Work:
        """For plans of so many legs that begin with a push."""
        if (count, first) not in self._works:
            radius = float(self.fleet.radius[first])
            self._works[count, first] = Work.of(count, self.least, radius, self.free)
        return self._works[count, first]

    def _slid(self, found: Candidate, slopes: Array) -> Candidate:
        """The sequence with its end moved within the slack to where the cost is least nearby, most often a corner.

        The slopes tell the way; a side of the box is also tried on its own.
        """
        movable = self.slack * [1.0, 1.0, 0.0 if self.free else 1.0] > 0.0
        if not movable.any() or not np.isfinite(found.cost):
            return found
        sides = [sign * axis for axis in np.eye(3)[movable] for sign in (-1.0, 1.0)]
        for _ in range(SLIDES):
            before = found
            for towards, part in product([-np.sign(slopes) * movable, *sides], PARTS):
                end = before.poses[-1]
                end = end + part * np.where(towards == 0.0, 0.0, self.goal + towards * self.slack - end)
                if len(found.pushes) == 1:
                    moved, after = self.candidate(found.pushes, np.array([self.start, end])), slopes
                else:
                    moved, after = self._descended(before, 2, 40, np.array([self.start, end]))
                if moved.cost < found.cost * (1 - 1e-9):
                    found, slopes = moved, after
                    break
            if found is before:
                break
        return found

    def following(self, known: Candidate) -> Candidate:
        """The arcs of a plan for a start and a goal nearby, led to these and downhill; infinite if that cannot be.

        Its switch poses alone would not do: good plans have few arcs, and those between poses a little off are others.
        """
        ends = known.poses[[0, -1]]
        ends[0], ends[1, : 2 if self.free else 3] = self.start, self.goal[: 2 if self.free else 3]
        return self._descended(known, 3, FOLLOWING, ends)[0]

    def replanning(self, found: Candidate) -> float:
        """Mean cost when every leg but the first starts off its switch pose, over sixteen fixed displacements.

        The leg is planned again from there to where it was to end.
        """
        pushes, poses = found.pushes, found.poses
        total = self.chain(pushes[:1], poses[:2])[0] + self.switching(pushes)
        for i in range(1, len(pushes)):
            for offset in self.offsets:
                endpoints = np.array([poses[i] + offset, poses[i + 1]])
                total += self.chain(pushes[i : i + 1], endpoints)[0] / len(self.offsets)
        return total

    def settle(self, found: Candidate) -> Candidate:
        """The sequence moved to where replanning costs least nearby."""
        from .replanning import settle

        poses, words = found.poses.copy(), np.zeros(len(found.pushes), WORD)
        settle(self.cars, found.pushes, poses, self.offsets, self.least, SETTLING, words)
        return self.candidate(found.pushes, poses)

    def table(self, starts: Array, goals: Array) -> Array:
        """Cost of every push from each start (n, 3) to each goal (m, 3), shape (k, n, m)."""
        from ...steering.lengths import fleet_lengths

        return fleet_lengths(self.fleet, starts[:, None], goals[None], flat=self.flat)


def joined(pushes: np.ndarray, poses: Array) -> tuple[np.ndarray, Array]:
    """Pushes and switch poses, equal neighbours being one leg: the last goes on, from where the first began."""
    kept = np.ones(len(poses), dtype=bool)
    np.not_equal(pushes[1:], pushes[:-1], out=kept[1:-1])
    if kept.all():
        return pushes, np.ascontiguousarray(poses)
    return pushes[kept[1:]], poses[kept]


def _ends(query: Query) -> Array:
    """The goal, and others within the slack: middle, sides and corners, with the cheapest angle of every single push.

    Where any angle will do, there are also some all around.
    """
    x, y, theta = query.goal
    turn = np.pi if query.free else query.slack[2]
    if not (query.slack[:2].any() or turn):
        return query.goal[None]
    (dx, dy), steps = query.slack[:2], (0.0, -1.0, 1.0)
    places = np.unique([(x + i * dx, y + j * dy) for i in steps for j in steps], axis=0)
    _, headings = cheapest_headings(query.fleet, query.start, places, theta, turn)
    angles = 2 * np.pi / ANGLES * np.arange(ANGLES) if query.free else theta + turn * np.array(steps)
    ends = [(*places[m], angle) for m in range(len(places)) for angle in (*headings[:, m], *angles)]
    return np.array([*([] if query.free else [query.goal]), *ends])
