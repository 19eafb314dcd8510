"""An object on an unknown table under feedback, in the simulator: first pushes that teach, then to its goal."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import ArrayLike

from ...errors import FlatpushError, InputError
from ...friction import Support
from ...geometry import Outline, transform
from ...geometry.pose import Array
from ...identification import MotionFit, fit_motion
from ...problem import Object, Scene
from ...simulation.plant import Plant, PlantState
from ..horizon.controller import HorizonController
from ..horizon.surroundings import crowded
from ..loop.closed_loop import ClosedLoopRun, drive
from ..loop.controller import ARRIVED, ControllerState
from ..loop.limits import beyond
from ..loop.sensor import AbstractSensor, Camera, SimulatedSensor
from .first_pushes import TAUGHT, FirstPushes, TeachState, filmed
from .plan_controller import beside

# A controller has so long for the first pushes, and then to the goal [s].
LESSONS, REST = 200.0, 400.0
# The hand waits so far outside of the object at the start [m].
ASIDE = 0.03


@dataclass(frozen=True, eq=False)
class UnknownTableRun:
    """What happened: the run; what was learned from the first pushes (None where they did not end); and when [s]."""

    run: ClosedLoopRun
    fit: MotionFit | None
    taught: float


def run_unknown(
    scene: Scene,
    thing: Object,
    camera: Camera,
    *,
    seed: int = 0,
    rate: float = 60.0,
    tolerance: tuple[float, float] | None = None,
    sensor: AbstractSensor | None = None,
    told: Callable[[float, ControllerState], None] | None = None,
) -> UnknownTableRun:
    """Pushes an object to the scene's goal whose table the scene does not know.

    Args:
        scene: with one finger. thing: the object as it truly is, on its table.
        camera: for the sensor, and its latency for the controllers. seed: of its noise.
        rate: of the controllers' ticks [Hz]. tolerance: distance [m] and angle [rad]; None: the scene's, of the goal.
        sensor: what sees it; None: the camera, simulated. told: called at every tick.

    Raises:
        InputError: for a scene with two fingers or obstacles, and a goal of any angle.
    """
    if np.isnan(scene.goal_pose[2]):
        raise InputError("an unknown table is learned on the way to a goal with an angle", key="goal")
    crowded(scene)  # what cannot be done inside bounds is told before the first push
    goal = scene.planning.goal_tolerance
    within = tolerance or (float(min(goal[:2])), float(goal[2]))
    eyes = sensor or SimulatedSensor(camera, np.random.default_rng(seed))
    plant = BoundedPlant(thing, scene)
    teacher = FirstPushes.of(scene, rate, stale=0.5 + camera.latency)
    states: list[TeachState] = []

    def keep(time: float, state: TeachState) -> None:
        states[:] = [state]
        if told is not None:
            told(time, state)

    outline = scene.object.outline
    reach = float(np.max(outline.polyline() @ np.array([-1.0, 0.0])))
    hand = np.append(transform(scene.start_pose, [-reach - ASIDE, 0.0]), scene.start_pose[2])
    first = drive(teacher, plant, scene.start_pose, hand, eyes, LESSONS, told=keep)
    if first.outcome != TAUGHT:
        return UnknownTableRun(first, None, float(first.times[-1]))
    taught = float(first.times[-1])
    try:
        fit = fit_motion(filmed(states[0]), scene.object, scene.pusher.tip_radius, known_support=False)
        learned = replace(scene, object=fit.thing)
        law = HorizonController.of(learned, rate, camera.latency, True, tolerance=within)
    except FlatpushError as wrong:
        return UnknownTableRun(
            replace(first, outcome=f"the first pushes do not tell enough: {wrong}"), None, taught
        )
    begin = taught + 1 / rate
    rest = drive(law, plant, first.object[-1], first.pusher[-1], eyes, REST, begin=begin, told=told)
    whole = joined(first, rest)
    if whole.outcome == ARRIVED:  # what the controller saw is one thing; here is known where the object is
        error = scene.goal_error(whole.object[-1])
        distance, turn = float(np.hypot(*error[:2])), abs(float(error[2]))
        if distance > within[0] or turn > within[1]:
            whole = replace(whole, outcome=beside(distance, turn))
    return UnknownTableRun(whole, fit, taught)


def joined(a: ClosedLoopRun, b: ClosedLoopRun) -> ClosedLoopRun:
    """A run and its continuation."""
    return ClosedLoopRun(
        np.concatenate([a.times, b.times]),
        np.concatenate([a.object, b.object]),
        np.concatenate([a.pusher, b.pusher]),
        np.concatenate([a.heights, b.heights]),
        a.modes + b.modes,
        a.contacts + b.contacts,
        b.outcome,
        a.notes + b.notes,
    )


class BoundedPlant:
    """A plant whose run ends where the object leaves the bounds of a scene."""

    def __init__(self, thing: Object, scene: Scene) -> None:
        self._plant = Plant(thing, [[0.0, 0.0]], scene.pusher.tip_radius)
        self._corners, self._bounds = thing.outline.polyline(), scene.workspace.bounds

    def start(self, object_: ArrayLike, hand: ArrayLike) -> PlantState:
        return self._plant.start(object_, hand)

    def step(self, state: PlantState, velocity: ArrayLike, dt: float) -> PlantState:
        after = self._plant.step(state, velocity, dt)
        if self._bounds is None or after.outcome:
            return after
        if beyond(transform(after.object, self._corners), self._bounds) > 0:
            return replace(after, outcome="the object left the bounds")
        return after


def same_outline(a: Outline, b: Outline) -> bool:
    """Whether two outlines are one, corner by corner, to a thousandth of the size."""
    p, q = a.polyline(), b.polyline()
    return p.shape == q.shape and bool(np.allclose(p, q, rtol=0, atol=1e-3 * a.size))


def drawn_table(outline: Outline, seed: int) -> Object:
    """An object on a table by chance: on its face, its rim, or three to eight feet, and a friction of 0.2 to 0.6 at the
    finger; the same for one number, `seed`."""
    rng = np.random.default_rng([seed, 16])
    friction = float(rng.uniform(0.2, 0.6))
    kind = int(rng.integers(4))
    if kind < 2:
        return Object(outline, ("uniform", "outline")[kind], friction)
    shape = shapely.Polygon(outline.polyline())
    inside, count = shape.buffer(-0.05 * outline.size), int(rng.integers(3, 9))
    low, high = np.array(shape.bounds[:2]), np.array(shape.bounds[2:])
    while True:
        places: Array = rng.uniform(low, high, (400, 2))
        places = places[shapely.contains_xy(inside, *places.T)][:count]
        if len(places) == count and shapely.MultiPoint(places).convex_hull.area > 0.2 * shape.area:
            return Object(outline, Support.points(places, rng.uniform(0.3, 1, count)), friction)
