"""Plans of sliding pushes that end at their goal: sequences of a library, their pushes adjusted through the plant."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlatpushError
from ...geometry import compose, inverse, log, pose_error, relative, transform, wrap_angle
from ...geometry.collision import Body, World, path_clearance
from ...geometry.outline import Outline
from ...geometry.pose import Array
from ...problem import Pusher
from ...simulation.plant import Plant, PlantRun
from ...steering.time_law import Trapezoid
from ..segments import SAG, SAG_ANGLE
from ..transits import LEAST_GAP, Network
from .sequences import SlideSearch
from .slides import BEFORE, LENGTHS, STEEPEST, finger_ways, slide_library

NEAR = 0.08  # sequences that miss the goal by less are adjusted, by the reach
EXACT = 1e-5  # a plan misses the goal by less, measured at the outline's farthest point [m]
ADJUSTMENTS = 8
LEAST_GAIN = 0.8  # of what a sequence misses the goal by, that an adjustment leaves at most
PROBE = 1e-3  # by which a parameter is varied to see what it changes, by the reach
LARGEST = 0.15  # change of a parameter at once, by the reach
CORNER = 0.02  # contacts keep this share of an edge from its ends
EFFORT = 1  # pushes adjusted by try, after which a plan that was found is enough
TRIES = 6  # sequences that are adjusted for a plan, and twice as many while there is none
APPROACHES = 6  # pairs of pushes towards a goal that is out of reach
STEADY = 2.0  # growth of a push that is planned with, see SlideLibrary.growth
MOST_GROWTH = 10.0  # of a plan, see SlidePlan.growth
SAMPLE = 0.002  # way of the finger between samples of a push [m]
HALVINGS = 12  # of the steps between samples where the object's motion bends
SWITCH = 0.03  # a push costs as much as so much way, by default [m]
TURNS = 1e-6  # a push turns the object if by more [rad]


@dataclass(frozen=True, eq=False)
class SlidePush:
    """One push of a plan.

    Attributes:
        edge, along, direction, length: as in SlideLibrary.
        way: of the fingertip's centre from its last push to this one on the table, (n, 2) in W; None: lifted.
        tip: its way while it pushes, shape (m, 2) in W [m].
        object: X_WO at each of its places, shape (m, 3), as the plant rolled them out.
        times: at which it is there, from rest to rest, shape (m,) [s]; None: of a planner without a pusher.
    """

    edge: int
    along: float
    direction: float
    length: float
    tip: Array
    object: Array
    times: Array | None = None
    way: Array | None = None


@dataclass(frozen=True, eq=False)
class SlidePlan:
    """Pushes one after another.

    Attributes:
        status: "solved" or "no_plan". reason: why there is none.
        pushes: in their order.
        end: X_WO after the last, shape (3,).
        cost: length of the pushes, and the switch cost for each but the first [m].
        growth: a factor: how far the end moves, at the outline's farthest point, when a push begins a metre further
            along the outline, is longer by a metre, or turned by as much at the outline's reach: the most of them all.
    """

    status: str
    reason: str = ""
    pushes: tuple[SlidePush, ...] = ()
    end: Array | None = None
    cost: float = np.inf
    growth: float = 0.0


class SlidePlanner:
    """Plans pushes that slide for one object and one finger, among obstacles and within bounds.

    Args:
        plant: of the object and one finger at its hand's origin.
        world: bounds and obstacles, which object and fingertip keep clear of.
        clearance: by so much [m].
        planar: whether the fingertip goes from push to push on the table, around the object, instead of lifted.
        switch_cost: of each change of contact [m].
        pusher: whose speed and acceleration give the pushes their times; they then begin at least its approach distance
            away, and samples are dense enough for straight interpolation.

    Raises:
        InputError: as slide_library does.
    """

    def __init__(
        self,
        plant: Plant,
        world: World | None = None,
        clearance: float = 0.0,
        planar: bool = False,
        switch_cost: float = SWITCH,
        pusher: Pusher | None = None,
    ) -> None:
        self.plant, self.world, self.pusher = plant, world, pusher
        self.clearance, self.planar, self.switch_cost = clearance, planar, switch_cost
        self.outline = plant.thing.outline
        self._room = max(BEFORE * self.outline.size, 0.0 if pusher is None else pusher.approach)
        self.slides = slide_library(plant.thing, plant, before=self._room).steady(STEADY)
        self.search = SlideSearch(self.slides)
        self.turns = bool(np.max(np.abs(self.slides.displacement[:, 2])) > TURNS)
        self._bodies = Body.of(self.outline), Body.of(Outline.circle(max(plant.tip_radius, 1e-9)))

    def plan(
        self, start: ArrayLike, goal: ArrayLike, tries: int = TRIES, tip: ArrayLike | None = None
    ) -> SlidePlan:
        """The cheapest of the plans that so many tries give, from X_WO to X_WO, both (3,).

        With `planar` and the place (2,) where the fingertip is, the first push has a way from there, too.
        """
        begin, end = np.array(start, dtype=float), np.array(goal, dtype=float)
        found = list(self.plans(begin, end, tries, tip))
        return found[-1] if found else SlidePlan("no_plan", self.refusal(begin, end))

    def refusal(self, start: ArrayLike, goal: ArrayLike) -> str:
        """Why there is no plan from X_WO to X_WO, both (3,), where plans() gives none."""
        turn = wrap_angle(np.asarray(goal, dtype=float)[2] - np.asarray(start, dtype=float)[2])
        if not self.turns and abs(turn) > TURNS:
            return (
                "no push of this finger turns the object: without friction its force goes through the centre of"
                " friction wherever it touches"
            )
        return "no sequence of sliding pushes could be made to end at the goal"

    def continued(
        self, pushes: Sequence[SlidePush], start: ArrayLike, goal: ArrayLike, tip: ArrayLike | None = None
    ) -> SlidePlan | None:
        """The same pushes adjusted from where the object is now; None where that is not possible.

        After each push of a plan the rest of it is nearly right still; a new plan might begin all over.
        """
        numbers = np.array([(p.edge, p.along, p.direction, p.length) for p in pushes]).reshape(-1, 4)
        moves = self._moves(numbers) if len(numbers) else None
        if moves is None:
            return None
        at = None if tip is None else np.array(tip, dtype=float)
        return self._adjusted(np.array(start, dtype=float), np.array(goal, dtype=float), numbers, moves, at)

    def plans(
        self, start: ArrayLike, goal: ArrayLike, tries: int = TRIES, tip: ArrayLike | None = None
    ) -> Iterator[SlidePlan]:
        """Plans each cheaper than the one before; the same for the same arguments.

        Args:
            start, goal, tip, tries: as in plan.
        """
        at = None if tip is None else np.array(tip, dtype=float)
        X_WO, goal_W = np.array(start, dtype=float), np.array(goal, dtype=float)
        slides = self.slides
        if not self.turns and abs(wrap_angle(goal_W[2] - X_WO[2])) > TURNS:
            return
        way: tuple[int, ...] = ()
        least, tried, effort = np.inf, 0, 0
        failed: Counter[int] = Counter()  # by number of pushes
        for _ in range(1 + APPROACHES):
            left = relative(X_WO, goal_W)
            for sequence in self.search.sequences(left, NEAR * slides.reach):
                numbers = list(way + sequence.pushes)
                cost = float(np.sum(slides.length[numbers])) + self.switch_cost * (len(numbers) - 1)
                if cost >= least or 2 * failed[len(numbers)] >= tries:
                    continue
                tried, effort = tried + 1, effort + len(numbers)
                begun, moves = self._parameters(numbers), slides.displacement[numbers]
                plan = self._adjusted(np.array(start, dtype=float), goal_W, begun, moves, at)
                failed[len(numbers)] += plan is None
                if plan is not None and plan.cost < least:
                    least = plan.cost
                    yield plan
                if tried >= 2 * tries or (least < np.inf and (tried >= tries or effort >= EFFORT * tries)):
                    return
            nearer = next(
                (s for s in self.search.approaches(left) if self.world is None or self.made(X_WO, s.pushes)),
                None,
            )
            if least < np.inf or nearer is None:
                return
            way += nearer.pushes
            for k in nearer.pushes:
                X_WO = compose(X_WO, slides.displacement[k])

    def made(self, X_WO: Array, numbers: tuple[int, ...]) -> list[SlidePush] | None:
        """Pushes of the library, by their numbers, one after another from X_WO (3,); None if they cannot be made."""
        return self._rolled_out(X_WO, self._parameters(list(numbers)))

    def _parameters(self, numbers: list[int]) -> Array:
        """Edge, place on it, direction and length of pushes of the library, shape (n, 4)."""
        s = self.slides
        return np.column_stack([s.edge[numbers], s.along[numbers], s.direction[numbers], s.length[numbers]])

    def _adjusted(
        self, start: Array, goal: Array, pushes: Array, moves: Array, tip: Array | None
    ) -> SlidePlan | None:
        """Pushes (n, 4) that move by (n, 3) made exact by Gauss and Newton's method, with the smallest changes; None if
        that fails.
        """
        target, scale = relative(start, goal), self._scale(pushes)
        miss, growth = self._miss(moves, target), np.inf
        for _ in range(ADJUSTMENTS):
            slope = self._slope(pushes, moves, target, scale)
            if slope is None:
                return None
            growth = float(np.max(np.linalg.norm(slope, axis=0)))
            if np.linalg.norm(miss) < EXACT or growth > MOST_GROWTH:
                break
            step = -np.linalg.lstsq(slope, miss, rcond=1e-6)[0].reshape(-1, 3)
            step *= min(1.0, LARGEST * self.slides.reach / np.max(np.abs(step)))
            for share in (1.0, 0.3):
                changed = self._within(pushes, share * step / scale)
                made = self._moves(changed)
                if made is not None and np.linalg.norm(
                    self._miss(made, target)
                ) < LEAST_GAIN * np.linalg.norm(miss):
                    pushes, moves, miss = changed, made, self._miss(made, target)
                    break
            else:
                return None
        if np.linalg.norm(miss) >= EXACT or growth > MOST_GROWTH:
            return None
        rolled = self._rolled_out(start, pushes, tip)
        if rolled is None:
            return None
        end = rolled[-1].object[-1]
        if np.linalg.norm(self._miss(relative(start, end)[None], target)) > 10 * EXACT:
            return None  # so uncertain that it depends on how the plant's steps fall
        cost = float(np.sum(pushes[:, 3])) + self.switch_cost * (len(pushes) - 1)
        return SlidePlan("solved", "", tuple(rolled), end, cost, growth)

    def _scale(self, pushes: Array) -> Array:
        """Metres of place, direction (at the reach) and length by unit of the parameters, shape (n, 3)."""
        outline = self.outline
        if outline.is_circle:
            edges = np.full(len(pushes), 2 * np.pi * outline.radius)
        else:
            ends = outline.edges[pushes[:, 0].astype(int)]
            edges = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        return np.column_stack([edges, np.full(len(pushes), self.slides.reach), np.ones(len(pushes))])

    def _within(self, pushes: Array, step: Array) -> Array:
        """Pushes after a step, each parameter kept within its bounds."""
        new = pushes.copy()
        new[:, 1:] += step
        new[:, 1] = new[:, 1] % 1.0 if self.outline.is_circle else np.clip(new[:, 1], CORNER, 1 - CORNER)
        new[:, 2] = np.clip(new[:, 2], -STEEPEST, STEEPEST)
        new[:, 3] = np.clip(new[:, 3], LENGTHS[0] * self.outline.size, LENGTHS[-1] * self.outline.size)
        return new

    def _ways(self, pushes: Array) -> Array | None:
        """The fingertip's centre before and after each push in O, (n, 2, 2); None if one cannot begin."""
        begin, touch, heading, good = finger_ways(
            self.outline, self.plant.tip_radius, self._room, pushes[:, :3]
        )
        return np.stack([begin, touch + pushes[:, 3:] * heading], axis=1) if good.all() else None

    def _moves(self, pushes: Array) -> Array | None:
        """Displacements by pushes, each rolled out from the origin, shape (n, 3)."""
        ways = self._ways(pushes)
        if ways is None:
            return None
        hand = np.concatenate([ways, np.zeros((len(ways), 2, 1))], axis=2)
        runs = self.plant.many(np.zeros((len(ways), 3)), hand, push_out=False, threads=1)
        return None if np.any(runs.outcome) else runs.final

    def _miss(self, moves: Array, target: Array) -> Array:
        """By how much a product of displacements misses a pose, at the centre of friction and by the turn [m]."""
        end = np.zeros(3)
        for move in moves:
            end = compose(end, move)
        off = pose_error(end, target)
        there = transform(end, self.slides.cof) - transform(target, self.slides.cof)
        return np.array([*there, self.slides.reach * off[2]])

    def _slope(self, pushes: Array, moves: Array, target: Array, scale: Array) -> Array | None:
        """Derivative of the miss by the scaled parameters, shape (3, 3 n)."""
        probe = PROBE * self.slides.reach
        varied = np.repeat(pushes, 3, axis=0)
        row = np.arange(len(varied))
        # Towards the inside of the bounds, so that it is no other push.
        signs = np.where(
            row % 3 == 0, np.where(varied[:, 1] > 0.5, -1.0, 1.0), np.where(varied[:, 2] > 0, -1.0, 1.0)
        )
        signs = np.where(row % 3 == 2, 1.0, signs)
        varied[row, 1 + row % 3] += signs * probe / scale[row // 3, row % 3]
        made = self._moves(varied)
        if made is None:
            return None
        here, columns = self._miss(moves, target), []
        for k, move in enumerate(made):
            with_it = moves.copy()
            with_it[k // 3] = move
            columns.append((self._miss(with_it, target) - here) / (signs[k] * probe))
        return np.array(columns).T

    def _rolled_out(self, start: Array, pushes: Array, before: Array | None = None) -> list[SlidePush] | None:
        """The pushes made in the plant one after another, as they will be; None if something is in the way."""
        X_WO, made = start, []
        ways = self._ways(pushes)
        if ways is None:
            return None
        for (edge, along, direction, length), (begin, end) in zip(pushes, ways, strict=True):
            tip_ends = transform(X_WO, np.stack([begin, end]))
            if self.pusher is None:
                times = None
                shares = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(end - begin) / SAMPLE))
            else:
                times, shares = self._timed(X_WO, tip_ends, self.pusher)
            run = self._followed(X_WO, tip_ends, shares)
            tip = tip_ends[0] + shares[:, None] * (tip_ends[1] - tip_ends[0])
            push = SlidePush(int(edge), along, direction, length, tip, run.object, times)
            if self.planar and before is not None:
                around = self._around(X_WO, before, tip[0])
                if around is None:
                    return None
                push = replace(push, way=around)
            if run.outcome or not self._clear(push):
                return None
            X_WO, before = run.object[-1], tip[-1]
            made.append(push)
        return made

    def _followed(self, X_WO: Array, tip: Array, shares: Array) -> PlantRun:
        """The plant under a finger that goes from one place to another, (2, 2), through shares of its way (m,)."""
        places = tip[0] + shares[:, None] * (tip[1] - tip[0])
        hand = np.column_stack([places, np.full(len(shares), np.arctan2(*(tip[1] - tip[0])[::-1]))])
        return self.plant.follow(X_WO, hand, push_out=False)

    def _timed(self, X_WO: Array, tip: Array, pusher: Pusher) -> tuple[Array, Array]:
        """Times and shares of a push's way: dense where the object's motion bends, as when it is touched or let go."""
        length = float(np.linalg.norm(tip[1] - tip[0]))
        law = Trapezoid.along(length, np.inf, pusher.speed, pusher.acceleration)
        times, shares = law.samples(float(np.sqrt(8 * SAG / law.acceleration)), 1 + int(length / SAMPLE))
        for _ in range(HALVINGS):
            halfway = 0.5 * (times[:-1] + times[1:])
            both = np.empty(2 * len(times) - 1)
            both[::2], both[1::2] = shares, 0.5 * (shares[:-1] + shares[1:])
            poses = self._followed(X_WO, tip, both).object
            sag = np.abs(pose_error(0.5 * (poses[:-2:2] + poses[2::2]), poses[1::2]))
            bent = (np.hypot(sag[:, 0], sag[:, 1]) > SAG) | (sag[:, 2] > SAG_ANGLE)
            if not bent.any():
                break
            times = np.sort(np.concatenate([times, halfway[bent]]))
            shares = np.clip(law.travelled(times) / length, 0.0, 1.0)
            shares[0], shares[-1] = 0.0, 1.0
        return times, shares

    def _around(self, X_WO: Array, tip: Array, target: Array) -> Array | None:
        """The way of the fingertip on the table around the object at rest, (n, 2) in W; None if there is none."""
        ends = []
        for point in transform(inverse(X_WO), np.stack([tip, target])):
            near, off = self.outline.nearest(point), 0.0
            away = (point - near.point) / np.linalg.norm(point - near.point)
            while self.outline.nearest(point + off * away).distance < self._network_gap:
                off += 0.5 * LEAST_GAP
                if off > 4 * self._network_gap:
                    return None
            ends.append((point, point + off * away))
        (a, a_off), (b, b_off) = ends
        try:
            points = self._network.shortest(a_off, b_off)
        except FlatpushError:
            return None
        return transform(X_WO, np.concatenate([a[None], points, b[None]]))

    @property
    def _network_gap(self) -> float:
        return self.plant.tip_radius + 2 * LEAST_GAP

    @cached_property
    def _network(self) -> Network:
        return Network(self.outline, self.plant.tip_radius + LEAST_GAP)

    def _clear(self, push: SlidePush) -> bool:
        """Whether object and fingertip keep their clearance on a push and on the way to it."""
        if self.world is None:
            return True
        thing, finger = self._bodies
        tips = push.tip if push.way is None else np.concatenate([push.way, push.tip])
        steps = np.column_stack([np.diff(tips, axis=0), np.zeros(len(tips) - 1)])
        moved = log(relative(push.object[:-1], push.object[1:]))
        for body, begin, twists in ((finger, [*tips[0], 0.0], steps), (thing, push.object[0], moved)):
            if path_clearance(self.world, body, begin, twists, need=self.clearance).distance < self.clearance:
                return False
        return True
