"""A plan under feedback in the contact simulator, with a simulated camera: what `flatpush track` runs."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from shapely import MultiPoint, Point

from ...errors import InputError
from ...geometry import compose
from ...geometry.pose import Array
from ...problem import Plan
from ...simulation.plant import Plant
from ..horizon.controller import HorizonController
from ..laws.gains import Gains
from ..loop.closed_loop import ClosedLoopRun, drive
from ..loop.controller import ARRIVED, AbstractController, ControllerState
from ..loop.sensor import Camera, SimulatedSensor
from .plan_controller import BESIDE, PlanController, beside, check_pushes, goal_error
from .replanning_controller import ReplanningController
from .slides import slide_by_slide
from .touched import touched

Law = Literal["path", "dfl", "horizon"]
Timing = Literal["even", "plan"]
Parts = tuple[AbstractController, Plant, Array, Array, SimulatedSensor]


@dataclass(frozen=True)
class TrackedRun:
    """What is simulated: a controller of a plan, and in what the world differs from the plan.

    Attributes:
        controller: its name. rate: of its ticks [Hz]. timing, learn: see PlanController.of.
        frequency: natural frequency [rad/s], and damping: ratio, of the law dfl.
        camera: the simulated one.
        friction: at the finger; None: the scene's.
        centre: the centre of friction is off by this in O, (x, y) [m].
        start: X_WO is off by this at the start [m, m, rad].
        seed: of the camera's noise.
        tolerance: it arrives within this distance [m] and angle [rad]; None: the scene's, of the goal.
    """

    controller: Law = "path"
    rate: float = 60.0
    timing: Timing = "even"
    learn: bool = False
    frequency: float = 2.0
    damping: float = 1.0
    camera: Camera = field(default_factory=Camera)
    friction: float | None = None
    centre: tuple[float, float] = (0.0, 0.0)
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0
    tolerance: tuple[float, float] | None = None

    def of(self, plan: Plan, told: Callable[[float, ControllerState], None] | None = None) -> ClosedLoopRun:
        """Runs it; told is called at every tick with the time and the controller's state.

        Raises:
            InputError: for a plan that cannot be followed so, and a centre of friction that is off the object.
        """
        run = self._slid(plan) if plan.slides else drive(*self.parts(plan), self.patience(plan), told=told)
        return replace(
            run,
            outcome=touched(plan.scene, plan.on_table[0].fingers, run)
            or self.judged(plan, run.outcome, run.object[-1]),
        )

    def judged(self, plan: Plan, outcome: str, pose: Array) -> str:
        """The outcome of a run that ended with the object at X_WO: what the controller saw is one thing, where the
        object is another."""
        if outcome != ARRIVED and not outcome.startswith(BESIDE):
            return outcome
        (distance, turn), within = goal_error(plan, pose), self._within(plan)
        inside = distance <= within[0] and turn <= within[1]
        return ARRIVED if inside else beside(distance, turn)

    def patience(self, plan: Plan) -> float:
        """How long it may take [s]. The horizon controller looks, and lands again, as often as it takes."""
        return 3 * plan.duration + (200 if self.controller == "horizon" else 10)

    def parts(self, plan: Plan) -> Parts:
        """The controller, the plant, X_WO and X_WE at the start, and the sensor; errors as of `of`."""
        check_pushes(plan)
        law = self.law(plan)
        scene, first = plan.scene, plan.pushes[0]
        if any(p.fingers.shape != first.fingers.shape for p in plan.pushes):
            raise InputError("every push of a tracked plan has as many fingers as the first")
        cof = scene.object.cof + np.array(self.centre)
        if not MultiPoint(scene.object.outline.polyline()).convex_hull.covers(Point(cof)):
            raise InputError("the centre of friction is off the object", key="centre", value=self.centre)
        plant = Plant(scene.object, first.fingers, scene.pusher.tip_radius, friction=self.friction, cof=cof)
        # The pusher waits behind the first contact: at the approach distance where something may stand farther back.
        room = 1 if scene.workspace.obstacles or scene.workspace.bounds is not None else 2
        hand = compose(first.pusher[0], [-room * scene.pusher.approach, 0.0, 0.0])
        begin = scene.start_pose + np.array(self.start)
        return law, plant, begin, hand, SimulatedSensor(self.camera, np.random.default_rng(self.seed))

    def _slid(self, plan: Plan) -> ClosedLoopRun:
        """A plan with slides: look, push once, look and plan again."""
        thing, off = plan.scene.object, np.array(self.centre)
        table = replace(
            thing,
            friction=thing.friction if self.friction is None else self.friction,
            support=thing.support.translated(off) if off.any() else thing.support,
            uncertainty=None,
        )
        world = replace(plan.scene, object=table, start=plan.scene.start_pose + np.array(self.start))
        sensor = SimulatedSensor(self.camera, np.random.default_rng(self.seed))
        return slide_by_slide(plan, world, sensor, self._within(plan))

    def _within(self, plan: Plan) -> tuple[float, float]:
        goal = plan.scene.planning.goal_tolerance
        return self.tolerance or (float(min(goal[:2])), float(goal[2]))

    @property
    def _sd(self) -> tuple[float, float]:
        return max(self.camera.position, 1e-5), max(self.camera.angle, 1e-4)

    def law(self, plan: Plan) -> AbstractController:
        """The controller alone."""
        if self.controller == "horizon" and plan.scene.pusher.fingers == 2:
            return ReplanningController.of(
                plan,
                self.rate,
                self.camera.latency,
                tolerance=self._within(plan),
                sd=self._sd,
            )
        if self.controller == "horizon":
            return HorizonController.of(
                plan,
                self.rate,
                self.camera.latency,
                self.learn,
                tolerance=self._within(plan),
            )
        return PlanController.of(
            plan,
            self.controller,
            self.rate,
            gains=Gains.of(self.frequency, self.damping),
            timing=self.timing,
            learn=self.learn,
            sd=self._sd,
            stale=0.5 + self.camera.latency,
            tolerance=self._within(plan),
        )
