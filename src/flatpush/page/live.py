"""Plans that follow a scene that is being moved: at once near the last one, then better ones."""

import json
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from ..compiling import clock
from ..documents import parse_ends, parse_scene
from ..errors import FlatpushError
from ..geometry.pose import Array
from ..planning import Planner
from ..planning.among_obstacles import Progress
from ..planning.assembly import assemble, car_of
from ..planning.empty_table import direct_paths, refined_paths
from ..planning.options import PushOption
from ..planning.path import Path, pieces_of
from ..planning.query import Query
from ..problem import CarCentres, Certificate, Plan, Scene
from ..steering.car import Car
from .sketch import Sketch

if TYPE_CHECKING:
    from ..planning.refine.problem import Candidate

Options = tuple[PushOption, ...]
KEPT = 4  # planners that are remembered, of scenes that differ in more than start and goal


class LivePlanner:
    """Plans scene after scene; what start and goal do not change is worked out once."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, _Prepared] = OrderedDict()
        self._stored: list[tuple[Mapping[str, object], Plan]] = []

    def keep(self, document: Mapping[str, object], plan: Plan) -> None:
        """Remembers a plan that was not made here, and the document of its scene."""
        self._stored = [(document, plan), *self._stored][:KEPT]

    def kept(self, document: Mapping[str, object]) -> Plan | None:
        """The plan that was remembered for exactly this document."""
        return next((plan for known, plan in self._stored if known == document), None)

    def answers(
        self, document: Mapping[str, object], progress: Progress | None = None, sketched: bool = False
    ) -> Iterator[tuple[Plan | Sketch, Options]]:
        """Better and better plans of a scene document, with all pushes that were considered.

        The first one comes at once; where nothing is in the way it has not been certified, and its certificate
        states no more than cost, duration and turning centres. With `sketched` a sketch of it comes before, where
        there can be one.

        Raises:
            InputError: for a document that is no scene, or a start or a goal where something is in the way.
        """
        known = self._prepared(document)
        yield from known.answers(known.moved(document), progress, sketched)

    def listed(self, document: Mapping[str, object]) -> Scene:
        """A scene with its pushes listed; errors as in answers."""
        return self._prepared(document).moved(document)

    def _prepared(self, document: Mapping[str, object]) -> "_Prepared":
        key = json.dumps({k: v for k, v in document.items() if k not in ("start", "goal")}, sort_keys=True)
        if key not in self._known:
            self._known[key] = _Prepared(document)
            while len(self._known) > KEPT:
                self._known.popitem(last=False)
        self._known.move_to_end(key)
        return self._known[key]


class _Prepared:
    """The pushes of a scene, and the last sequence of them that was best."""

    def __init__(self, document: Mapping[str, object]) -> None:
        scene = parse_scene(document)
        self._planner = Planner(scene)
        if self._planner.usable:
            _ = self._planner.fleet  # worked out here once, for all that are moved
        self._seed: Candidate | None = None
        # A far outline is moved to its origin, and with it what poses mean.
        self._in_place = np.array_equal(parse_ends(document)[0], scene.start)

    def moved(self, document: Mapping[str, object]) -> Scene:
        """The scene, pushes listed, of a document that differs in start and goal alone."""
        start, goal = parse_ends(document) if self._in_place else _ends(parse_scene(document))
        return replace(self._planner.scene, start=start, goal=goal)

    def answers(
        self, scene: Scene, progress: Progress | None, sketched: bool
    ) -> Iterator[tuple[Plan | Sketch, Options]]:
        planner = self._planner.moved(scene.start, scene.goal, progress)
        options = (*planner.options, *planner.left_out)
        space = scene.workspace
        near = np.all(np.abs(scene.goal_error(scene.start_pose)) <= scene.planning.goal_tolerance)
        known, planning = scene.object.uncertainty, scene.planning
        whole = (
            near or not planner.usable or planning.robust or (known is not None and known.start is not None)
        )
        if space.bounds is not None or space.obstacles or whole:
            for answer in planner.answers():
                if sketched and answer.path is not None:
                    sketched = False
                    sketch = Sketch.of(planner, answer.path)
                    if sketch is not None:
                        yield sketch, options
                yield answer.plan(), options
            return
        for plan in self._free(planner, sketched):
            yield plan, options

    def _free(self, planner: Planner, sketched: bool) -> Iterator[Plan | Sketch]:
        """With nothing in the way: from the last sequence and from every single push downhill, then by search."""
        scene, began = planner.scene, clock()
        best = np.inf
        complaint = ""
        for path in self._quick(planner):
            try:
                sketch = Sketch.of(planner, path) if sketched else None
                if sketch is not None:
                    yield sketch
                plan = _plan(planner, path, began)
            except FlatpushError as error:
                complaint = str(error)
                continue
            best = path.cost
            yield plan
            yield _certified(plan)
            break
        for found in islice(refined_paths(scene, planner.fleet), 1, None):
            if found.path.cost >= best * (1 - 1e-9):
                continue
            try:
                plan = _certified(_plan(planner, found.path, began))
            except FlatpushError as error:
                complaint = str(error)
                continue
            best = found.path.cost
            self._remember(found.path)
            yield plan
        if np.isinf(best):
            yield Plan("no_plan", scene, reason=complaint, run={"planning_time": clock() - began})

    def _quick(self, planner: Planner) -> list[Path]:
        """The cheapest single push and the last sequence moved to the new start and goal, cheapest first."""
        scene, fleet = planner.scene, planner.fleet
        paths = direct_paths(fleet, scene.start_pose, planner.endpoints(scene))[:3]
        if self._seed is not None:
            from ..planning.refine.problem import Sequences
            from ..planning.refine.refine import LEAST

            goal = np.nan_to_num(scene.goal_pose)
            sequences = Sequences.of(Query(fleet, scene.start_pose, goal, free=scene.free_angle), LEAST)
            moved = sequences.following(self._seed)
            if np.isfinite(moved.cost):
                _, words = sequences.chain(moved.pushes, moved.poses)
                pieces = [
                    piece
                    for push, word in zip(moved.pushes.tolist(), words, strict=True)
                    for piece in pieces_of(push, word)
                ]
                paths.append(Path.of(fleet, scene.start_pose, pieces))
        paths.sort(key=lambda path: path.cost)
        if len(paths[0].pushes) > 1:
            self._remember(paths[0])
        return paths

    def _remember(self, path: Path) -> None:
        if len(path.pushes) > 1:
            from ..planning.refine.problem import Candidate

            poses = np.array([path.start, *(end for *_, end in path.stretches)])
            self._seed = Candidate(path.cost, np.array(path.pushes, dtype=np.int64), poses)


def _ends(scene: Scene) -> tuple[Array, Array]:
    return scene.start_pose, scene.goal_pose


def _plan(planner: Planner, path: Path, began: float) -> Plan:
    """The plan of a path, with the turning centres of its pushes and nothing proved yet."""
    scene = planner.scene
    segments = assemble(scene, planner.transits, planner.usable, path)
    duration = sum(float(segment.times[-1]) for segment in segments)
    cars = {planner.usable[k].push.name: _centres(car_of(planner.usable[k])) for k in path.pushes}
    certificate = Certificate((np.nan, np.nan, np.nan), path.cost, duration, cars=cars)
    run = {"planning_time": clock() - began}
    return Plan("solved", scene, path.cost, duration, segments, certificate, run=run)


def _certified(plan: Plan) -> Plan:
    from ..simulation import certify

    certificate = certify(plan.scene, plan.segments)
    return replace(plan, certificate=certificate, cost=certificate.cost, duration=certificate.duration)


def _centres(car: Car) -> CarCentres:
    left, right, ahead = ((float(x), float(y)) for x, y in (car.left_centre, car.right_centre, car.direction))
    return CarCentres(left, right, ahead)
