"""Following a whole plan: each push under feedback, and between pushes the pusher goes to where the object now is."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from ...errors import InputError
from ...geometry import compose, pose_error, relative
from ...geometry.pose import Array
from ...planning.options import push_option
from ...problem import Plan
from ...problem.mechanics import local_rho, named
from ..laws.gains import Gains
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..laws.reference import PathReference
from ..laws.steering_model import SteeringModel
from ..learning.belief import SteeringBelief
from ..loop.controller import ARRIVED, AbstractController, ControllerState
from ..loop.frames import Seen, refusal
from ..loop.measurement import STOP, Command, Measurement
from .learning_controller import LearningController

# The prior of the centre of friction, by the object's size, and of ρ, by itself.
SD_COF, SD_RHO = 0.03, 0.3
# A hand so far before or behind its place at the contact has lost the object, by the object's size; beside it, so far.
LOST_AHEAD, LOST_ASIDE = 0.25, 1.0


@dataclass(frozen=True, eq=False)
class PlanState(ControllerState):
    """Of PlanController: which push, its controller's state, whether it is on its way, and on the table."""

    push: int = 0
    inner: Any = None
    landing: bool = True
    down: bool = False
    hand: Array | None = None
    newest: float = -np.inf


@dataclass(frozen=True, eq=False)
class PlanController(AbstractController[PlanState]):
    """Runs the pushes of a plan one after the other. Build with PlanController.of.

    Attributes:
        plan: what is followed. inner: a controller for each push. speed: of the lifted pusher [m/s].
    """

    plan: Plan
    inner: tuple[Any, ...]
    speed: float
    stale: float = 0.5
    rate: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", self.inner[0].rate)

    @classmethod
    def of(
        cls,
        plan: Plan,
        law: Literal["dfl", "path"] = "path",
        rate: float = 60.0,
        *,
        gains: Gains | None = None,
        timing: Literal["even", "plan"] = "even",
        learn: bool = False,
        sd: tuple[float, float] = (0.0003, float(np.deg2rad(0.3))),
        stale: float = 0.5,
    ) -> "PlanController":
        """The controllers of a plan's pushes.

        Args:
            gains: of the law dfl; default: natural frequency 2 rad/s, critically damped.
            timing: "even": a constant flat speed, the mean of the plan, through all junctions; "plan": the plan's time
                law, from rest to rest in each arc, for the law path.
            learn: adapts the model of each push. sd: of a frame's position and angle [m, rad], for learning.

        Raises:
            InputError: for a plan without pushes, and as the laws do.
        """
        if timing == "plan" and law != "path":
            raise InputError(
                "feedback linearisation needs a flat speed > 0, and the plan's time law rests between its arcs",
                key="timing", value=timing, hint="Use an even speed, or the path law.",
            )  # fmt: skip
        if plan.status != "solved" or not plan.pushes:
            raise InputError("there is no push to follow in this plan", hint="It has none, or is not solved.")
        scene = plan.scene
        found: list[Any] = []
        for segment in plan.pushes:
            push = named(scene, segment.push)
            option, whole = push_option(scene, push), push_option(scene, push, margin=0.0)
            if option.car is None:
                raise InputError(f"the push {segment.push!r} cannot be steered: {option.refusal}")
            model = SteeringModel.of_car(option.car, scene.pusher.turns, whole.car)
            path = PathReference.of_push(segment, model, pusher=scene.pusher if timing == "plan" else None)
            one: Any
            if law == "dfl":
                one = TrackingController(model, gains or Gains.of(2.0), rate, reference=path, stale=stale)
            else:
                one = PathController(model, path, rate, fastest=scene.pusher.speed, stale=stale)
            if learn:
                d = -option.car.contact.point
                rho = local_rho(scene.object, d / float(np.hypot(*d)))
                size = scene.object.outline.size
                prior = SteeringBelief.prior(scene.object.cof, rho, SD_COF * size, SD_RHO * rho)
                one = LearningController(one, prior, sd, max(0.002, 5 * sd[0]))
            found.append(one)
        return cls(plan, tuple(found), 5 * scene.pusher.speed, stale)

    def landing(self, push: int, pose: Array, before: float) -> Array:
        """Where the pusher is a distance before the contact of a push, with the object at X_WO: X_WE."""
        back = np.array([-before, 0.0, 0.0])
        return compose(pose, compose(self.inner[push].model.pusher, back))

    def start(self, time: float = 0.0) -> PlanState:
        if not np.isfinite(time):
            raise InputError("a time is finite", value=time)
        return PlanState()

    def step(
        self, state: PlanState, measurement: Measurement | None, time: float
    ) -> tuple[PlanState, Command]:
        if state.outcome:
            return state, STOP
        if not np.isfinite(time):
            return replace(state, mode="held", note="the time is not finite"), STOP
        if state.landing:
            return self._land(state, measurement, time)
        inner = self.inner[state.push]
        below, command = inner.step(state.inner, measurement, time)
        state = replace(state, inner=below, mode=below.mode, note=below.note)
        if not below.outcome:
            if measurement is not None and below.mode != "held" and self._lost(state.push, measurement):
                return replace(state, mode="done", outcome="the finger lost the object"), STOP
            return state, command
        if below.outcome != ARRIVED or state.push + 1 == len(self.inner):
            return replace(state, mode="done", outcome=below.outcome), STOP
        return replace(
            state, push=state.push + 1, inner=None, landing=True, down=False, hand=None, newest=time
        ), STOP

    def _lost(self, push: int, frame: Measurement) -> bool:
        """Whether the hand is nowhere near its place at the contact of a push; going on would push the air."""
        size = self.plan.scene.object.outline.size
        ahead, aside, _ = relative(self.inner[push].model.pusher, relative(frame.object, frame.pusher))
        return abs(float(ahead)) > LOST_AHEAD * size or abs(float(aside)) > LOST_ASIDE * size

    def _land(self, state: PlanState, frame: Measurement | None, time: float) -> tuple[PlanState, Command]:
        """Lifted, to the approach distance from where the object was seen; then on the table, straight to the contact.

        Frames from before the last push ended do not count.
        """
        dt, pusher = 1 / self.rate, self.plan.scene.pusher
        if frame is not None:
            wrong = refusal(frame, Seen(), time, "", self.stale)
            if wrong:
                return replace(state, mode="held", note=wrong), STOP
            if frame.time > state.newest:
                hand = frame.pusher if state.hand is None else state.hand
                state = replace(
                    state, hand=np.asarray(hand, dtype=float), newest=frame.time, inner=frame.object
                )
        if state.hand is None or state.inner is None:
            return replace(state, mode="waiting", note="no measurement yet"), STOP
        before = 0.0 if state.down else pusher.approach
        target = self.landing(state.push, np.asarray(state.inner, dtype=float), before)
        way = pose_error(target, state.hand)
        distance = float(np.hypot(way[0], way[1]))
        share = min(1.0, (pusher.speed if state.down else self.speed) * dt / max(distance, 1e-12))
        if distance < 1e-9 and abs(way[2]) < 1e-9 and not state.down:
            return replace(state, down=True, mode="transit"), STOP
        ahead = float(way[:2] @ [np.cos(target[2]), np.sin(target[2])])
        if state.down and ahead < 1e-9:
            begun = replace(state, landing=False, inner=self.inner[state.push].start(time), mode="transit")
            return begun, STOP
        velocity = share * way / dt
        moved = replace(state, hand=state.hand + share * way, mode="transit", note="")
        return moved, Command(velocity, 0.0 if state.down else pusher.lift)
