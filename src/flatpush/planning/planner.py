"""Plans of one or many pushes for one object and goal, from any start."""

from collections.abc import Iterable, Iterator
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import made_of
from ..compiling import clock
from ..errors import FlatpushError, InputError
from ..geometry.collision import Body, World, pose_clearance
from ..geometry.pose import Array, wrap_angle
from ..problem import Plan, Scene
from ..problem.frame import moved_inside
from ..problem.mechanics import proved_for_set, starts_anywhere
from ..problem.scene import GOAL_TOLERANCE
from ..steering.fleet import Fleet
from ..steering.free_heading import HEADINGS, cheapest_headings
from ..steering.lengths import fleet_lengths
from .among_obstacles import AmongObstacles, Progress
from .answer import Answer
from .assembly import Segments, assemble, car_of
from .candidates import automatic_pushes
from .controllability import Controllability, controllability
from .empty_table import ROUND, Found, direct_paths, refined_paths
from .fleets import fleet_of
from .obstacles import TOUCHING, check_endpoints, check_region
from .options import PushOption, push_options
from .transits import Transits

if TYPE_CHECKING:
    from .sliding import SlidePlanner
    from .tubes import Tubes

APART = np.deg2rad(9)  # between two angles at a free goal that are searched for among obstacles
# Rounds for each of many starts: more hardly lower the cost (benchmarks/many_starts.py).
ROUNDS_OF_MANY = 1


class Planner:
    """Builds once for an object, its pushes and a goal, and plans from many starts.

    Args:
        scene: its start is the default start of plan().
        progress: called among obstacles after every round of the search, some hundredths of a second, with the cost
            so far (infinite: none), the seconds since it began and the number of poses in its trees.

    Attributes:
        scene: with its pushes listed.
        options: the pushes as cars, or why they are none; left_out: automatic candidates that were dropped.
        controllability: whether the pushes move the object "free"-ly, by "detours", or not ("none").
        explored: after a search among obstacles, paths of the COF along edges of its tree, shape (m, k, 2) [m].

    Raises:
        InputError: for an object whose support is unknown, and pushes that cannot be placed.

    >>> import flatpush as fp
    >>> thing = fp.Object([(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)], "outline")
    >>> planner = fp.Planner(fp.Scene(thing, (0.06, 0.02, 2.6), pusher=fp.Pusher(fingers=2, spacing=0.018)))
    >>> [len(plan.pushes) <= 4 for plan in planner.plans([(0.06, 0.02, 2.6), (0.02, -0.03, 1.6)])]
    [True, True]
    """

    def __init__(self, scene: Scene, progress: Progress | None = None) -> None:
        self.left_out: tuple[PushOption, ...] = ()
        if scene.object.support_word == "unknown":
            raise InputError(
                "nothing is planned for an object of which it is not known where it presses on the table",
                key="object.support",
                hint="fp.identification.fit_motion finds it from pushes.",
            )
        anywhere = scene.pushes == "auto"
        if anywhere:
            pushes, self.left_out = automatic_pushes(scene)
            scene = replace(scene, pushes=pushes or "auto")
        self.scene = scene
        self.options = () if scene.pushes == "auto" else push_options(scene)
        self.usable = tuple(option for option in self.options if option.car is not None)
        self._anywhere = anywhere
        self._progress = progress
        self._among: AmongObstacles | None = None

    @property
    def controllability(self) -> Controllability:
        """Whether the pushes move the object "free"-ly, by "detours", or not ("none")."""
        return controllability([car_of(option) for option in self.usable])

    @property
    def reasons(self) -> dict[str, str]:
        """Why each refused push is refused."""
        return {o.push.name: o.refusal for o in (*self.left_out, *self.options) if o.car is None}

    def plan(self, start: ArrayLike | None = None) -> Plan:
        """The best plan found from a start pose X_WO (3,), by default the scene's.

        A start within the goal tolerance is a solved plan without a push. The plan keeps bounds and obstacles.
        """
        *_, best = self.answers(start)
        return best.plan()

    def plans(self, starts: Iterable[ArrayLike]) -> list[Plan]:
        """A plan from each start, after one round of the search each where nothing is in the way."""
        rounds = ROUNDS_OF_MANY * ROUND
        planning = replace(self.scene.planning, iterations=min(self.scene.planning.iterations, rounds))
        few = copy(self)
        few.scene = self.scene if _crowded(self.scene) else replace(self.scene, planning=planning)
        return [few.plan(start) for start in starts]

    def moved(self, start: ArrayLike, goal: ArrayLike, progress: Progress | None = None) -> "Planner":
        """The same pushes, worked out once, from another start to another goal, poses X_WO (3,), with a progress."""
        other = copy(self)
        other.scene = replace(self.scene, start=start, goal=goal)
        other._progress = progress
        return other

    def answers(self, start: ArrayLike | None = None) -> Iterator[Answer]:
        """Better and better answers, each as soon as it is found and certified only when its plan is called for.

        There is always one; where there is no plan, its cost is infinite. The search may be left at any answer.

        Raises:
            InputError: if the object cannot be at the start or at the goal, among what is in the way there.
        """
        began = clock()
        scene = self.scene if start is None else replace(self.scene, start=start)
        if _crowded(scene) and not scene.free_angle:
            check_endpoints(scene)
        tubed = starts_anywhere(scene) and proved_for_set(scene)
        if tubed:
            check_region(scene)
        if _at_goal(scene, tubed):
            yield Answer(0.0, partial(_solved, scene, (), began, {}))
            return
        if not self.usable:
            reason = f"no push can steer the object.\n{_listed(self.reasons)}"
            if self._slides_too:
                slid = list(self._slides(scene, began, np.inf))
                yield from slid
                if slid:
                    return
                why = self.sliding.refusal(scene.start_pose, scene.goal_pose)
                reason = (
                    f"no push can steer the object, and of pushes that slide: {why}.\n{_listed(self.reasons)}"
                )
            yield Answer(np.inf, partial(_none, scene, reason, began))
            return
        tubes = self._tubes(scene) if tubed else None
        if tubes is not None and (reason := tubes.refusal()):
            lines = (reason, _listed(self.reasons))
            yield Answer(np.inf, partial(_none, scene, "\n".join(line for line in lines if line), began))
            return
        best, stopped_by, details = np.inf, "", dict[str, Any]()
        failed: dict[str, str] = {}
        if _crowded(scene):
            endpoints = self._fitting(scene) if scene.free_angle else scene.goal_pose[None]
            for found, segments in self._found_among(scene, endpoints, tubes):
                best, details = found.cost, found.details
                yield Answer(best, partial(_solved, scene, segments, began, details), details, found.path)
            stopped_by = self._among.stopped_by if self._among is not None else ""
        else:
            for found in self._candidates(scene) if tubes is None else tubes.paths():
                stopped_by = found.details.pop("stopped_by", "")
                if found.cost >= best * (1 - 1e-12):
                    continue
                try:
                    segments = assemble(scene, self.transits, self.usable, found.path)
                    if tubes is not None and (lacks := tubes.complaint(segments)):
                        raise InputError(lacks)
                except FlatpushError as error:
                    failed.setdefault(self.usable[found.path.pushes[0]].push.name, str(error))
                    continue
                best, details = found.cost, found.details
                yield Answer(best, partial(_solved, scene, segments, began, details), details, found.path)
        if stopped_by == "time_limit":
            details["stopped_by"] = stopped_by  # of the last answer, whose plan is yet to be made
        if self._slides_too:
            for answer in self._slides(scene, began, best):
                best = answer.cost
                yield answer
        if np.isinf(best):
            blocked = "" if self._among is None else self._among.tried.strip()
            lines = (blocked, _listed(self.reasons | failed))
            yield Answer(np.inf, partial(_none, scene, "\n".join(line for line in lines if line), began))

    def _tubes(self, scene: Scene) -> "Tubes":
        from .tubes import Tubes

        return Tubes(scene, self.usable, self.fleet)

    def _found_among(
        self, scene: Scene, endpoints: Array, tubes: "Tubes | None"
    ) -> Iterator[tuple[Found, Segments]]:
        """What is found among obstacles, better and better."""
        if tubes is None:
            self._among = AmongObstacles(
                scene, self.usable, self.fleet, self.transits, self._progress, endpoints
            )
            yield from self._among.plans()
            return
        # What costs least on an empty table may keep clear; if not, it is searched for with room for the tube, and
        # without where there is none.
        best = np.inf
        for found in tubes.paths():
            best = np.inf
            try:
                segments = assemble(scene, self.transits, self.usable, found.path)
            except FlatpushError:
                continue
            if not tubes.complaint(segments):
                best = found.cost
                yield found, segments
        if np.isfinite(best):
            return
        from .tubes import Layers

        layers = Layers(tubes)
        for more in tubes.rooms():
            planning = replace(
                scene.planning, clearance=scene.planning.clearance + more, goal_tolerance=GOAL_TOLERANCE
            )
            self._among = AmongObstacles(
                replace(scene, planning=planning), layers.options, layers.fleet, self.transits, self._progress,
                endpoints, layers,
            )  # fmt: skip
            for found, segments in self._among.plans():
                if found.cost < best:
                    best = found.cost
                    yield found, segments
            if np.isfinite(best):
                return

    @property
    def _slides_too(self) -> bool:
        """Whether pushes that slide may be in a plan of this scene."""
        wanted, one = self.scene.planning.slides, self.scene.pusher.fingers == 1
        return one and (wanted == "join" or (wanted == "auto" and self._anywhere and not self.usable))

    @cached_property
    def sliding(self) -> "SlidePlanner":
        """Plans pushes that slide, whatever start and goal."""
        from .sliding import slide_planner

        return slide_planner(self.scene)

    def _slides(self, scene: Scene, began: float, below: float) -> Iterator[Answer]:
        """The cheapest plan of pushes that slide, and of a slide and a car, if they cost less than this."""
        from .sliding import mixed_segments, slide_plans, slide_segments

        plans = []
        for found in slide_plans(self.sliding, scene):
            plans.append(found)
            if clock() - began > scene.planning.time_limit:
                break
        slid = (slide_segments(scene, found.pushes) for found in reversed(plans))
        for segments in slid:
            plan = self._clear(scene, segments, began)
            if plan is not None:
                if plan.cost < below:
                    below = plan.cost
                    yield Answer(plan.cost, partial(_again, plan))
                break
        pusher = scene.pusher
        if self.usable and not scene.free_angle and pusher.transit == "lift" and pusher.turns:
            for segments in mixed_segments(
                scene, self.sliding, self.usable, self.fleet, self.transits, below
            ):
                plan = self._clear(scene, segments, began)
                if plan is not None and plan.cost < below:
                    yield Answer(plan.cost, partial(_again, plan))
                    return

    def _clear(self, scene: Scene, segments: Segments, began: float) -> Plan | None:
        """The plan of segments, if it keeps its clearance, the way of the hand between the pushes included."""
        plan = _solved(scene, segments, began, {})
        assert plan.certificate is not None
        clear = plan.certificate.clearance
        return plan if clear is None or clear >= scene.planning.clearance else None

    @property
    def explored(self) -> Array | None:
        """Paths of the COF along edges of the search tree, shape (m, samples, 2) [m]; None without obstacles."""
        return None if self._among is None else self._among.explored

    def _candidates(self, scene: Scene) -> Iterator[Found]:
        """The cheapest single push, then what the refinement finds; all words of the push if it is the only one."""
        endpoints = self.endpoints(scene)
        singles = direct_paths(self.fleet, scene.start_pose, endpoints)
        several = len(self.usable) > 1 or scene.wide_goal
        single = {"single_cost": singles[0].cost}
        for path in singles[:1] if several else singles:
            yield Found(path, path.cost, dict(single))
        if several:
            for found in refined_paths(scene, self.fleet):
                found.details.update(single)
                yield found

    def endpoints(self, scene: Scene) -> Array:
        """For every push where it best ends: the goal, or with the cheapest angle where any will do, shape (k, 3)."""
        if not scene.free_angle:
            return np.tile(scene.goal_pose, (self.fleet.size, 1))
        place = scene.goal_pose[:2]
        _, headings = cheapest_headings(self.fleet, scene.start_pose, place)
        return np.column_stack([np.tile(place, (self.fleet.size, 1)), headings])

    def _fitting(self, scene: Scene) -> Array:
        """Poses at the goal where the object fits, turned by at least APART, shape (e, 3): the cheapest of an empty
        table first.

        Raises:
            InputError: if it fits with none, what is in the way with the cheapest.
        """
        place = scene.goal_pose[:2]
        turns = np.arange(HEADINGS) * (2 * np.pi / HEADINGS)
        costs = fleet_lengths(self.fleet, scene.start_pose, [(*place, turn) for turn in turns]).min(axis=0)
        tried = turns[np.argsort(costs, kind="stable")]
        world = World.of(scene.workspace.bounds, scene.workspace.obstacles)
        body, need = Body.of(scene.object.outline), scene.clearance - TOUCHING
        fits: list[tuple[float, ...]] = []
        for angle in tried:
            pose = (*place, angle)
            if all(abs(wrap_angle(angle - other)) >= APART for *_, other in fits) and (
                pose_clearance(world, body, pose) >= need
            ):
                fits.append(pose)
        try:
            check_endpoints(replace(scene, goal=fits[0] if fits else (*place, tried[0])))
        except InputError as error:
            if error.key != "goal":
                raise
            rule = f"{error.rule} when it is turned by {np.rad2deg(tried[0]):.0f}°, and it fits at no other angle"
            raise InputError(rule, key="goal") from None
        return np.array(fits)

    @cached_property
    def transits(self) -> Transits:
        return Transits(self.scene)

    @cached_property
    def fleet(self) -> Fleet:
        """The usable cars as arrays, with the switching costs, the transits' own included where they count."""
        return fleet_of(self.scene, self.usable, self.transits)


def plan(scene: Scene) -> Plan:
    """The best plan found for a scene, with its certificate; see Planner.

    An outline more than 100 of its sizes from its origin is moved there first: the plan's scene tells its poses.

    Returns:
        a Plan; where there is none, status "no_plan" and the reason of each push.

    Raises:
        InputError: for what is no Scene.
    """
    made_of(Scene, scene, "load_scene")
    return Planner(moved_inside(scene)).plan()


def _crowded(scene: Scene) -> bool:
    return scene.workspace.bounds is not None or bool(scene.workspace.obstacles)


def _at_goal(scene: Scene, tubed: bool) -> bool:
    """Whether the start is within the goal's tolerance, with all of the region about it."""
    off = np.abs(scene.goal_error(scene.start))
    known = scene.object.uncertainty
    if tubed and known is not None and known.start is not None:
        off += [
            known.start.position,
            known.start.position,
            0.0 if scene.free_angle else known.start.angle,
        ]
    return bool(np.all(off <= scene.planning.goal_tolerance))


def _listed(reasons: dict[str, str]) -> str:
    return "\n".join(f"{name}: {reason}" for name, reason in reasons.items())


def _solved(scene: Scene, segments: Segments, began: float, found: dict[str, Any]) -> Plan:
    from ..simulation import certify  # a first path is there before the judge is

    run = _run(began) | found
    certificate = certify(scene, segments)
    return Plan(
        "solved",
        scene,
        certificate.cost,
        certificate.duration,
        segments,
        certificate,
        run=run,
    )


def _none(scene: Scene, reason: str, began: float) -> Plan:
    return Plan("no_plan", scene, reason=reason, run=_run(began))


def _again(plan: Plan) -> Plan:
    return plan


def _run(began: float) -> dict[str, Any]:
    from .. import __version__

    return {"version": __version__, "planning_time": clock() - began}
