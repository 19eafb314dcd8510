"""Tasks of experiments.feedback among things: bounds, and five to twelve obstacles between start and goal.

Object, start, table, finger and camera are those of the study of feedback. The bounds leave 60 to 120 mm about start
and goal; obstacles are drawn until the planner finds a way from the start to the goal that keeps 3 mm of clearance.
Counted are the runs that end within 2 mm and 2° and touch nothing: object and fingertip are checked by shapely at every
tick, to a tenth of a millimetre.
"""

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import shapely

from ..control import AbstractController, ControllerState, SimulatedSensor
from ..control.horizon.controller import HorizonController
from ..control.loop.closed_loop import ClosedLoopRun, drive
from ..control.loop.sensor import Camera
from ..control.tracking.replanning_controller import ReplanningController
from ..control.tracking.touched import touched
from ..errors import FlatpushError
from ..geometry import Outline, compose, pose_error, transform
from ..geometry.pose import Array
from ..planning import Planner
from ..problem import Planning, Pusher, Scene, Workspace
from ..simulation.plant import Plant
from .feedback import WITHIN, Task, task

FEWEST, MOST = 5, 12
ROOM = 0.06, 0.12  # of the bounds about start and goal [m]
SIZES = 0.01, 0.035  # radii of obstacles [m]
ROUND = 0.3  # the part of them that are circles
BESIDE = 0.012  # between an obstacle and the object at the start and at the goal [m]
CLEARANCE = 0.003  # of the way that there is [m]
SPACING = 0.015  # of two fingers [m]
CARRIED = 0.001, float(np.deg2rad(1.0))  # the goal of two fingers
PATIENCE = 400.0  # [s]
DRAWS = 40


@dataclass(frozen=True, eq=False)
class EndedAmong:
    """How a run ended: distance [m] and angle [rad] off the goal, what the controller said, what was touched ("" if
    nothing was), landings, seconds, and within what distance and angle it should end."""

    distance: float
    angle: float
    outcome: str
    touched: str
    landings: int
    time: float
    within: tuple[float, float]

    @property
    def good(self) -> bool:
        return self.distance <= self.within[0] and self.angle <= self.within[1] and not self.touched


def carried_task(number: int, seed: int = 0) -> Task:
    """The task of a number with two fingers, and with the reserve that they have by default."""
    plain = task(number, seed)
    pusher = Pusher(fingers=2, spacing=SPACING)
    assert not isinstance(plain.scene.pushes, str)
    pushes = tuple(replace(push, fingers=2, spacing=SPACING) for push in plain.scene.pushes)
    return replace(
        plain, scene=replace(plain.scene, pusher=pusher, pushes=pushes, planning=Planning(iterations=1))
    )


def crowded_task(number: int, seed: int = 0, fingers: int = 1) -> Task:
    """The task of a number, with things in its way.

    Raises:
        ValueError: if no way was found in any draw.
    """
    plain = task(number, seed) if fingers == 1 else carried_task(number, seed)
    rng = np.random.default_rng([seed, number, 2])
    for _ in range(DRAWS):
        scene = replace(plain.scene, workspace=_things(plain.scene, rng))
        if _has_way(scene):
            return replace(plain, scene=scene)
    raise ValueError(f"nothing drawn for task {number} leaves a way")


def _has_way(scene: Scene) -> bool:
    planning = replace(scene.planning, clearance=CLEARANCE, iterations=300)
    try:
        return any(
            np.isfinite(answer.cost) for answer in Planner(replace(scene, planning=planning)).answers()
        )
    except FlatpushError:
        return False


def _things(scene: Scene, rng: np.random.Generator) -> Workspace:
    """Bounds and obstacles that leave object and fingers room at the start and at the goal."""
    corners = scene.object.outline.polyline()
    ends = [transform(pose, corners) for pose in (scene.start_pose, scene.goal_pose)]
    low, high = np.min(ends, axis=(0, 1)), np.max(ends, axis=(0, 1))
    margin = rng.uniform(*ROOM, 4)
    low, high = low - margin[:2], high + margin[2:]
    kept = shapely.union_all([shapely.Polygon(end).buffer(BESIDE) for end in ends])
    placed: list[Outline] = []
    count = int(rng.integers(FEWEST, MOST + 1))
    while len(placed) < count:
        middle, size = rng.uniform(low, high), rng.uniform(*SIZES)
        if rng.random() < ROUND:
            one = Outline.circle(size, middle)
        else:
            angles = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(3, 8))))
            shape = shapely.Polygon(middle + size * np.column_stack([np.cos(angles), np.sin(angles)]))
            if shape.area < 0.3 * size**2:
                continue
            one = Outline.polygon(np.array(shape.exterior.coords)[:-1])
        if not kept.intersects(shapely.Polygon(one.polyline())):
            placed.append(one)
    return Workspace((*low.tolist(), *high.tolist()), tuple(placed))


def attempt_among(
    given: Task, law: type[HorizonController] | type[ReplanningController] = HorizonController
) -> tuple[EndedAmong, ClosedLoopRun | None]:
    """Runs one task with a controller that lands again; without a run if the controller refuses it."""
    scene = given.scene
    try:
        controller = law.of(scene)
    except FlatpushError as error:
        return EndedAmong(np.inf, np.inf, f"refused: {error}", "", 0, 0.0, WITHIN), None
    tips = controller.limits.tips
    plant = Plant(given.truth, tips, scene.pusher.tip_radius)
    option = controller.planner.usable[0]
    assert option.placement is not None
    hand = compose(scene.start_pose, compose(option.placement.pose, [-scene.pusher.approach, 0.0, 0.0]))
    landings = 0

    def tick(time: float, state: ControllerState) -> None:
        nonlocal landings
        landings = max(landings, getattr(state, "landings", 0))

    sensor = SimulatedSensor(Camera(), np.random.default_rng(given.seed))
    law_ = cast("AbstractController[ControllerState]", controller)
    run = drive(law_, plant, scene.start_pose, hand, sensor, PATIENCE, told=tick)
    within = WITHIN if len(tips) == 1 else CARRIED
    off = pose_error(run.object[-1], scene.goal)
    hit = touched(scene, tips, run)
    ended = EndedAmong(
        float(np.hypot(*off[:2])),
        abs(float(off[2])),
        run.outcome,
        hit,
        landings,
        float(run.times[-1]),
        within,
    )
    return ended, run


def least_room(scene: Scene, run: ClosedLoopRun, tips: Array) -> float:
    """The least distance of the object, and of fingertips on the table, from obstacles and bounds in a run [m]."""
    bounds, best = scene.workspace.bounds, np.inf
    down = np.concatenate([[0.0], run.heights[:-1]]) == 0
    corners = transform(run.object[:, None], scene.object.outline.polyline(1e-5))
    points = transform(run.pusher[down][:, None], tips)
    for places, reach in ((corners, 0.0), (points, scene.pusher.tip_radius)):
        if bounds is not None:
            best = min(best, float(np.min(np.minimum(places - bounds[:2], bounds[2:] - places))) - reach)
    things = shapely.union_all([shapely.Polygon(o.polyline(1e-5)) for o in scene.workspace.obstacles])
    shapely.prepare(things)
    best = min(best, float(np.min(shapely.distance(things, shapely.polygons(corners)), initial=np.inf)))
    tip = shapely.distance(things, shapely.points(points))
    return min(best, float(np.min(tip, initial=np.inf)) - scene.pusher.tip_radius)
