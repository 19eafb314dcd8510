"""Plans of one or many pushes for one object and goal, from any start."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FlatpushError, InputError
from ..geometry import pose_error, relative
from ..geometry.pose import Array
from ..problem import Certificate, Plan, PushSegment, Scene, TransitSegment
from ..simulation import certify, clearance_of
from ..steering.car import Car
from ..steering.fleet import Fleet
from ..steering.three_twist import words
from .candidates import automatic_pushes
from .freedom import Freedom, freedom
from .options import PushOption, push_options
from .rolling import rolling_segment
from .segments import ArcGeometry, arc_duration, arcs_of, fingertips, push_segment, tip_radii
from .timing import Trapezoid
from .transits import Transits, Way

if TYPE_CHECKING:
    from .graph import Tree

Segments = tuple[PushSegment | TransitSegment, ...]
# A round of the search counts as this many of the scene's iterations.
ROUND = 3300
# Poses of the search tree, and how many of its ways are refined.
SAMPLES, SEEDS = 1500, 30


@dataclass(frozen=True, eq=False)
class Leg:
    """One push of a plan before it is timed: which one, and its arcs."""

    option: PushOption
    word: str
    amounts: Array
    goal: Array


class Planner:
    """Builds once for an object, its pushes and a goal, and plans from many starts.

    Args:
        scene: its start is the default start of plan().
        tree: whether a search tree towards the goal is built to start the search from (kept in a cache keyed by
            content), or the file to keep it in: read if it exists, else written. For one start it does not pay.

    Attributes:
        scene: with its pushes listed.
        options: the pushes as cars, or why they are none; left_out: automatic candidates that were dropped.
        freedom: whether the pushes move the object "free"-ly, by "detours", or not ("none").

    >>> import flatpush as fp
    >>> thing = fp.Object([(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)], "outline")
    >>> planner = fp.Planner(fp.Scene(thing, (0.06, 0.02, 2.6), pusher=fp.Pusher(fingers=2, spacing=0.018)))
    >>> [len(plan.pushes) <= 4 for plan in planner.plans([(0.06, 0.02, 2.6), (0.02, -0.03, 1.6)])]
    [True, True]
    """

    def __init__(self, scene: Scene, tree: bool | str | Path = True) -> None:
        if scene.planning.two_finger == "cone":
            raise InputError(
                "two_finger: cone, the true composite cone, is not available yet",
                key="planning.two_finger",
                value="cone",
                hint="Use middle, the virtual middle contact.",
            )
        self.left_out: tuple[PushOption, ...] = ()
        if scene.pushes == "auto":
            pushes, self.left_out = automatic_pushes(scene)
            scene = replace(scene, pushes=pushes)
        self.scene = scene
        self.options = push_options(scene)
        self.usable = tuple(option for option in self.options if option.car is not None)
        self._tree = tree

    @property
    def freedom(self) -> Freedom:
        return freedom([_car(option) for option in self.usable])

    @property
    def reasons(self) -> dict[str, str]:
        """Why each refused push is refused."""
        return {o.push.name: o.refusal for o in (*self.left_out, *self.options) if o.car is None}

    def plan(self, start: ArrayLike | None = None) -> Plan:
        """The best plan found from a start pose X_WO (3,), by default the scene's.

        A start within the goal tolerance is a solved plan without a push. The plan keeps bounds and obstacles, or
        there is none: the ways found are checked in the order of their cost, but none is sought around obstacles.
        """
        *_, best = self._answers(start)
        return best()

    def plans(self, starts: Iterable[ArrayLike]) -> list[Plan]:
        """A plan from each start."""
        return [self.plan(start) for start in starts]

    def improving(self, start: ArrayLike | None = None) -> Iterator[Plan]:
        """Plans that get better, the first one at once; plan() is the last of them."""
        for answer in self._answers(start):
            yield answer()

    def _answers(self, start: ArrayLike | None) -> Iterator[Callable[[], Plan]]:
        """Better and better answers; each is certified only when it is called for."""
        began = time.perf_counter()
        scene = self.scene if start is None else replace(self.scene, start=start)
        if np.all(np.abs(pose_error(scene.start, scene.goal)) <= scene.planning.goal_tolerance):
            yield partial(_solved, scene, (), began, {})
            return
        if not self.usable:
            yield partial(_none, scene, f"no push can steer the object. {_listed(self.reasons)}", began)
            return
        best = np.inf
        reasons, tightest, count = self.reasons, -np.inf, 0
        for expected, legs, found in self._candidates(scene):
            if expected >= best * (1 - 1e-12):
                continue
            count += 1
            try:
                segments = self._segments(scene, legs)
            except FlatpushError as error:
                reasons.setdefault(legs[0].option.push.name, str(error))
                continue
            clearance = clearance_of(scene, segments, scene.planning.clearance)
            if clearance is not None and clearance < scene.planning.clearance:
                tightest = max(tightest, clearance)
                continue
            best = expected
            yield partial(_solved, scene, segments, began, found)
        if np.isinf(best):
            blocked = ""
            if np.isfinite(tightest):
                blocked = (
                    f"each of the {count} ways that were tried comes too near to an obstacle or the bounds: the best"
                    f" has {1000 * tightest:.2f} mm of clearance, {1000 * scene.planning.clearance:.2f} mm are asked"
                    " for. "
                )
            yield partial(_none, scene, blocked + _listed(reasons), began)

    def _candidates(self, scene: Scene) -> Iterator[tuple[float, Sequence[Leg], dict[str, Any]]]:
        """Ways with their costs: all words of single pushes, cheapest first, then what the search finds."""
        singles = sorted(
            (
                (cost, i, k)
                for i, option in enumerate(self.usable)
                for k, cost in enumerate(self._costs(scene, option))
            ),
        )
        several = len(self.usable) > 1
        for cost, i, k in singles[:1] if several and not _crowded(scene) else singles:
            word = self._words(scene, self.usable[i])[k]
            leg = Leg(self.usable[i], word.word, word.parameters, scene.goal_pose)
            yield cost, (leg,), {"single_cost": singles[0][0]}
        if several:
            yield from self._searched(scene, singles[0][0])

    def _searched(self, scene: Scene, single: float) -> Iterator[tuple[float, Sequence[Leg], dict[str, Any]]]:
        from .graph import query
        from .refine import improvements

        planning = scene.planning
        # Among obstacles the ways of the tree are also alternatives where better ones are blocked.
        seeds = query(self.tree, scene.start_pose, SEEDS) if self._tree or _crowded(scene) else []
        if _crowded(scene) and not planning.robust:
            for way in seeds:
                yield (
                    way.cost,
                    self._legs(way.pushes, way.poses),
                    {"graph_cost": seeds[0].cost, "single_cost": single},
                )
        search = improvements(
            self.fleet,
            scene.start_pose,
            scene.goal_pose,
            [(way.pushes, way.poses) for way in seeds],
            robust=planning.robust,
            seed=planning.seed,
        )
        clock = 0.0
        for done, refined in enumerate(search):
            found = {
                "single_cost": single,
                "graph_cost": seeds[0].cost if seeds else None,
                "cost_before_refinement": refined.cost_before,
                "replanning_cost": refined.replanning_cost,
                "rounds": done,
            }
            legs = [
                Leg(self.usable[int(a)], word, np.asarray(amounts), np.asarray(goal))
                for a, word, amounts, goal in zip(
                    refined.pushes, refined.words, refined.amounts, refined.poses[1:], strict=True
                )
            ]
            yield (refined.replanning_cost if planning.robust else refined.cost), legs, found
            if done == 1:
                # The first round is always finished, and what it compiles on first use is not the search's time.
                clock = time.perf_counter()
            late = done >= 1 and time.perf_counter() - clock > planning.time_limit
            if late or done >= max(1, planning.iterations // ROUND):
                return

    @cached_property
    def tree(self) -> "Tree":
        """The search tree towards the goal: read from its file or the cache, or built.

        Its poses fill a square about the goal that holds the scene's start. The square grows by doubling, so that
        near starts share a tree.
        """
        from .graph import pose_samples, stored_tree

        scene = self.scene
        region = 4 * float(np.max(self.fleet.radius))
        while region < np.max(np.abs((scene.start_pose - scene.goal_pose)[:2])):
            region *= 2
        poses = pose_samples(SAMPLES, scene.goal_pose, region, scene.planning.seed)
        file = None if isinstance(self._tree, bool) else self._tree
        return stored_tree(self.fleet, poses, scene.goal_pose, file)

    def _legs(self, pushes: Sequence[int], poses: Array) -> list[Leg]:
        """Legs between given poses, each with its cheapest word."""
        legs = []
        for a, start, goal in zip(pushes, poses[:-1], poses[1:], strict=True):
            option = self.usable[int(a)]
            part = replace(self.scene, start=start, goal=goal)
            k = int(np.argmin(self._costs(part, option)))
            word = self._words(part, option)[k]
            legs.append(Leg(option, word.word, word.parameters, np.asarray(goal)))
        return legs

    def _words(self, scene: Scene, option: PushOption) -> list[Any]:
        car = _car(option)
        return words(car.left_centre, car.right_centre, car.direction, scene.start_pose, scene.goal_pose)

    def _costs(self, scene: Scene, option: PushOption) -> list[float]:
        """The cost of each word of a push from the scene's start to its goal."""
        return [self._cost(option, word.word, word.parameters) for word in self._words(scene, option)]

    def _cost(self, option: PushOption, word: str, amounts: Array) -> float:
        car, planning = _car(option), self.scene.planning
        if planning.cost == "time":
            tips = fingertips(option.push.fingers, option.push.spacing)
            return sum(arc_duration(arc, self.scene.pusher) for arc in arcs_of(car, word, amounts, tips))
        each = dict(zip("LSR", car.weights(planning.cost), strict=True))
        return sum(each[letter] * float(x) for letter, x in zip(word, amounts, strict=True))

    @cached_property
    def transits(self) -> Transits:
        return Transits(self.scene)

    @cached_property
    def _ways(self) -> dict[tuple[str, str], Way | str]:
        """The pusher's way from each push to each other one, or why there is none."""
        found: dict[tuple[str, str], Way | str] = {}
        for a in self.usable:
            for b in self.usable:
                if a is b or a.placement is None or b.placement is None:
                    continue
                try:
                    found[a.push.name, b.push.name] = self.transits.between(a.placement, b.placement)
                except FlatpushError as error:
                    found[a.push.name, b.push.name] = str(error)
        return found

    @cached_property
    def fleet(self) -> Fleet:
        """The usable cars as arrays, with the switching costs, the transits' own included where they count."""
        planning, pusher = self.scene.planning, self.scene.pusher
        cars = [_car(option) for option in self.usable]
        k = len(cars)
        switching = np.full((k, k), planning.switching)
        for i, a in enumerate(self.usable):
            for j, b in enumerate(self.usable):
                if i == j:
                    switching[i, j] = 0.0
                    continue
                way = self._ways[a.push.name, b.push.name]
                if isinstance(way, str):
                    switching[i, j] = np.inf
                elif planning.cost == "pusher":
                    switching[i, j] += way.pusher_length
                elif planning.cost == "time":
                    switching[i, j] += way.duration(pusher)
        if planning.cost != "time":
            return Fleet.of(cars, np.array([car.weights(planning.cost) for car in cars]), switching=switching)
        radii = np.array(
            [tip_radii(car, fingertips(o.push.fingers, o.push.spacing)) for car, o in self._pairs()]
        )
        laws = [
            [Trapezoid.along(1.0, float(r), pusher.speed, pusher.acceleration) for r in row] for row in radii
        ]
        return Fleet.of(
            cars,
            np.where(np.isinf(radii), 1.0, radii),
            np.array([[law.speed for law in row] for row in laws]),
            np.array([[law.acceleration for law in row] for row in laws]),
            switching,
        )

    def _pairs(self) -> list[tuple[Car, PushOption]]:
        return [(_car(option), option) for option in self.usable]

    def _segments(self, scene: Scene, legs: Sequence[Leg]) -> Segments:
        """Landing, pushes and transits between them, leaving."""
        segments: list[PushSegment | TransitSegment] = []
        pose, hand = scene.start_pose, None
        for leg in legs:
            there = leg.option.placement
            assert there is not None
            way = self.transits.landing(there) if hand is None else self.transits.between(hand, there)
            segments.append(way.segment(scene.pusher, pose))
            push = self._push(scene, leg, pose)
            segments.append(push)
            pose = push.object[-1]
            # Where the fingers now stand on the object; a finger that kept its direction has rolled along.
            stand = relative(pose, push.pusher[-1])
            hand = there if scene.pusher.turns else replace(there, pose=stand, tips=stand[None, :2])
        assert hand is not None
        segments.append(self.transits.landing(hand).reversed().segment(scene.pusher, pose))
        return tuple(segments)

    def _push(self, scene: Scene, leg: Leg, start: Array) -> PushSegment:
        option, car = leg.option, _car(leg.option)
        tips = fingertips(option.push.fingers, option.push.spacing)
        part = replace(scene, start=start, goal=leg.goal)
        # The same word from where the last push really ended: rounding must not change a word that sits on a jump.
        same = [w for w in self._words(part, option) if w.word == leg.word]
        near = (
            min((float(np.max(np.abs(w.parameters - leg.amounts))), k) for k, w in enumerate(same))
            if same
            else None
        )
        amounts = same[near[1]].parameters if near is not None and near[0] < 1e-6 else leg.amounts
        arcs: list[ArcGeometry] = arcs_of(car, leg.word, amounts, tips)
        if not scene.pusher.turns:
            return rolling_segment(part, option, arcs)
        return push_segment(part, option.push.name, car, tips, arcs, start)


def plan(scene: Scene) -> Plan:
    """The best plan found for a scene, with its certificate; see Planner.

    Returns:
        a Plan; where there is none, status "no_plan" and the reason of each push.
    """
    return Planner(scene, tree=False).plan()


def _car(option: PushOption) -> Car:
    assert option.car is not None
    return option.car


def _crowded(scene: Scene) -> bool:
    return scene.workspace.bounds is not None or bool(scene.workspace.obstacles)


def _listed(reasons: dict[str, str]) -> str:
    return " · ".join(f"{name}: {reason}" for name, reason in reasons.items())


def _solved(scene: Scene, segments: Segments, began: float, found: dict[str, Any]) -> Plan:
    run = _run(began) | found
    certificate = certify(scene, segments)
    return Plan(
        "solved",
        scene,
        certificate["cost"],
        certificate["duration"],
        segments,
        Certificate(certificate),
        run=run,
    )


def _none(scene: Scene, reason: str, began: float) -> Plan:
    return Plan("no_plan", scene, reason=reason, run=_run(began))


def _run(began: float) -> dict[str, Any]:
    from .. import __version__

    return {"version": __version__, "planning_time": time.perf_counter() - began}
