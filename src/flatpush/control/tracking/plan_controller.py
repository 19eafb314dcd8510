"""Following a whole plan: each push under feedback, and between pushes the pusher goes to where the object now is."""

from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from ...errors import InputError
from ...geometry import compose, relative, transform
from ...geometry.pose import Array
from ...planning.options import PushOption, push_option
from ...problem import Plan, PushSegment, Scene
from ...problem.mechanics import local_rho, named
from ..laws.gains import Gains
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..laws.reference import PathReference
from ..laws.steering_model import SteeringModel
from ..learning.belief import SD_COF, SD_RHO, SteeringBelief
from ..loop.controller import ARRIVED, AbstractController, ControllerState
from ..loop.frames import hand
from ..loop.limits import Limits
from ..loop.measurement import Command, Measurement
from .carried import CarriedController, CarriedState, KnownPose, turned
from .learning_controller import LearningController
from .touching import TouchingController

# A hand so far before or behind its place at the contact has lost the object, by the object's size; beside it, so far.
LOST_AHEAD, LOST_ASIDE = 0.25, 1.0
# Looking at an object at rest: at least so many frames, and for so long [s].
FRAMES, LOOK = 10, 0.3
# The share of a friction margin that feedback leaves to two fingers, and the share of the acceleration that is planned
# with for coming to rest: turning takes its part.
RESERVE, BRAKE = 0.5, 0.6
# The shares of the speed and the acceleration that are planned with; the rest is for corrections.
CRUISE, RAMP = {"even": 0.98, "plan": 0.998}, {"even": 0.9, "plan": 0.99}
# The share of the speed at which the junctions of arcs are passed.
SLOW = 0.03

# No camera is better than this [m, rad]: what is known is weighed by it.
LEAST_NOISE = 1e-7, 1e-6

#: How the outcome of a run begins that ended off its goal.
BESIDE = "ended beside the goal"

OnePush = TrackingController | PathController | LearningController | CarriedController | TouchingController


@dataclass(frozen=True, eq=False)
class Looking:
    """At the object at rest: poses X_WO of the frames exposed since a time [s], and the exposure of the first."""

    since: float
    poses: tuple[Array, ...] = ()
    first: float = np.nan


@dataclass(frozen=True, eq=False)
class Travelling:
    """To the stops (x, y, θ, height) that are left, the next first; then what comes after."""

    stops: tuple[Array, ...]
    pushes: bool


@dataclass(frozen=True, eq=False)
class Pushing:
    """With the state of the push's controller."""

    inner: ControllerState


@dataclass(frozen=True, eq=False)
class PlanState(ControllerState):
    """Of PlanController.

    Attributes:
        push: which is next or under way (their number: all are done), and phase: what it does for it.
        known: where the object lies, from a look, and from the last push where two fingers carried it.
    """

    push: int = 0
    phase: Looking | Travelling | Pushing = Looking(-np.inf)
    known: KnownPose | None = None


@dataclass(frozen=True, eq=False)
class PlanController(AbstractController[PlanState]):
    """Runs the pushes of a plan one after the other. Build with PlanController.of.

    Before every push and after the last it looks at the object at rest; it arrives if that is within the tolerance.

    Attributes:
        plan: what is followed. inner: a controller for each push. tolerance: distance [m] and angle [rad].
        limits, stale, noise: see AbstractController.
    """

    plan: Plan
    inner: tuple[OnePush, ...]
    tolerance: tuple[float, float]
    limits: Limits
    stale: float = 0.5
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    @property
    def rate(self) -> float:  # type: ignore[override]
        """Ticks per second [Hz]."""
        return self.inner[0].rate

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
        tolerance: tuple[float, float] | None = None,
    ) -> "PlanController":
        """The controllers of a plan's pushes.

        Args:
            gains: of the law dfl; default: natural frequency 2 rad/s, critically damped.
            timing: "even": the plan's time law without its rests: slow at the junctions of its arcs;
                "plan": from rest to rest in each arc, in the plan's time.
            learn: adapts the model of each push of one finger. sd: of a frame's position and angle [m, rad].
            tolerance: distance and angle of the goal [m, rad]; default: the scene's.
            rate: ticks per second [Hz]. stale: age at which a frame is too old [s].

        Raises:
            InputError: for a plan without pushes, a push without motion, and as the laws do.
        """
        check_pushes(plan)
        plan.check_motion()
        sd = max(sd[0], LEAST_NOISE[0]), max(sd[1], LEAST_NOISE[1])
        scene, first = plan.scene, plan.pushes[0]
        limits = Limits.of(scene.pusher, first.fingers, scene.object.outline.size)
        goal = scene.planning.goal_tolerance
        usual = float(min(goal[:2])), float(goal[2])
        within = usual if tolerance is None else tolerance
        if not min(within) > 0:
            raise InputError("a tolerance is positive", key="tolerance", value=within)
        gentle = replace(
            scene.pusher,
            speed=CRUISE[timing] * scene.pusher.speed,
            acceleration=RAMP[timing] * scene.pusher.acceleration,
            turn_rate=CRUISE[timing] * scene.pusher.turn_rate,
        )
        found: list[OnePush] = []
        for segment in plan.pushes:
            option = push_option(scene, named(scene, segment.push))
            if option.car is None:
                raise InputError(f"the push {segment.push!r} cannot be steered: {option.refusal}")
            model = _model(scene, option)
            path = PathReference.of_push(
                segment, model, pusher=gentle, slow=0.0 if timing == "plan" else SLOW
            )
            braking = BRAKE * scene.pusher.acceleration / _fastest(model, segment)
            one: OnePush
            if law == "dfl":
                one = TrackingController(
                    model, gains or Gains.of(2.0), rate, deceleration=braking, stale=stale, reference=path
                )
            else:
                one = PathController(model, path, rate, deceleration=braking, stale=stale)
            if len(segment.fingers) == 2:
                one = CarriedController(
                    one,
                    scene.object.outline,
                    segment.fingers,
                    scene.pusher.tip_radius,
                    scene.object.friction,
                    sd,
                )
            elif learn:
                one = _learning(scene, option, one, sd)
            else:
                one = replace(one, closing=usual)  # the run is the same whatever is asked of its end
                if scene.pusher.turns:
                    one = TouchingController(one, scene.object.outline, scene.pusher.tip_radius)
            found.append(one)
        return cls(plan, tuple(found), within, limits, stale, sd)

    def landing(self, push: int, pose: Array, before: float) -> Array:
        """X_WE a distance `before` [m] the contact of a push of that number, with the object at a pose X_WO."""
        return compose(pose, compose(self._model(push).pusher, [-before, 0.0, 0.0]))

    def with_yaws(self, yaws: tuple[float, float], alike: tuple[float, ...]) -> Self:
        return replace(self, limits=replace(self.limits, yaws=yaws, alike=alike))

    def start(self, time: float = 0.0) -> PlanState:
        if not np.isfinite(time):
            raise InputError("a time is finite", value=time)
        return PlanState(phase=Looking(time))

    def noticed(self, state: PlanState, frame: Measurement) -> PlanState:
        phase = state.phase
        if isinstance(phase, Looking) and frame.time >= phase.since - 1e-9:
            pose = np.asarray(frame.object, dtype=float)
            first = frame.time if not phase.poses else phase.first
            return replace(state, phase=replace(phase, poses=(*phase.poses, pose), first=first))
        if isinstance(phase, Pushing):
            below = replace(phase.inner, seen=state.seen)
            inner = self.inner[state.push].noticed(below, frame)  # type: ignore[arg-type]
            return replace(state, phase=Pushing(inner))
        return state

    def act(self, state: PlanState, time: float) -> tuple[PlanState, Command]:
        phase, seen = state.phase, state.seen
        assert seen.frame is not None
        if isinstance(phase, Looking):
            enough = len(phase.poses) >= FRAMES and seen.frame.time - phase.first >= LOOK
            if not enough:
                note = f"looking at the object: {len(phase.poses)} frames"
                return replace(state, mode="looking", note=note), self._standing(state)
            look = KnownPose.of_look(phase.poses, self.noise)
            state = replace(state, known=look if state.known is None else state.known.seen(look))
            if state.push == len(self.inner):
                return self._ended(state), self._standing(state)
            state = self._to_land(state, hand(seen.frame, seen.told, time))
            return self._travel(state, time)
        if isinstance(phase, Travelling):
            return self._travel(state, time)
        return self._push(state, phase, time)

    def _ended(self, state: PlanState) -> PlanState:
        assert state.known is not None
        distance, turn = goal_error(self.plan, state.known.pose)
        inside = distance <= self.tolerance[0] and turn <= self.tolerance[1]
        return replace(state, mode="done", note="", outcome=ARRIVED if inside else beside(distance, turn))

    def _to_land(self, state: PlanState, here: Array) -> PlanState:
        """Up, over to before the contact, down, and to the contact."""
        assert state.known is not None
        pusher, pose = self.plan.scene.pusher, state.known.pose
        before, contact = (self.landing(state.push, pose, d) for d in (pusher.approach, 0.0))
        yaws = self.plan.pushes[state.push].pusher[:, 2]
        swing = float(np.min(yaws) - yaws[0]), float(np.max(yaws) - yaws[0])
        before[2], turn = self.limits.landing(float(before[2]), float(here[2]), swing, state.turned)
        contact[2] = before[2]
        if turn != 0:
            # Fingertips that are alike: the hand is taken to be so much less turned, and turns as much more.
            assert state.seen.frame is not None
            seen = replace(state.seen, frame=state.seen.frame.with_hand_turned(-turn))
            state = replace(state, seen=seen, turned=state.turned - turn)
            here = here - np.array([0.0, 0.0, turn])
        stops = ([*here, pusher.lift], [*before, pusher.lift], [*before, 0.0], [*contact, 0.0])
        return replace(state, phase=Travelling(tuple(np.array(stop) for stop in stops), True), note="")

    def _travel(self, state: PlanState, time: float) -> tuple[PlanState, Command]:
        phase, seen = state.phase, state.seen
        assert isinstance(phase, Travelling)
        assert seen.frame is not None
        here, stops = hand(seen.frame, seen.told, time), phase.stops
        still = not np.any(seen.last.velocity) and seen.climb == 0
        while stops and still and np.max(np.abs(stops[0] - [*here, seen.height])) < 1e-6:
            stops = stops[1:]
        state = replace(state, mode="transit", note="", phase=replace(phase, stops=stops))
        if stops:
            table = bool(stops[0][3] == 0 and seen.height == 0)
            return state, self.limits.towards(
                stops[0], here, seen.height, seen.last, seen.climb, 1 / self.rate, table
            )
        if phase.pushes:
            begun = Pushing(self._landed(state, time, float(here[2])))
            return self._push(replace(state, phase=begun, known=None), begun, time)
        return replace(state, phase=Looking(time)), self._standing(state)

    def _landed(self, state: PlanState, time: float, yaw: float) -> ControllerState:
        """The push's controller at its start, with the hand at a yaw."""
        one = self.inner[state.push]
        if not isinstance(one, CarriedController) or state.known is None:
            return one.start(time)
        return one.landed(time, turned(state.known.covariance, -yaw))

    def _push(self, state: PlanState, phase: Pushing, time: float) -> tuple[PlanState, Command]:
        frame = state.seen.frame
        assert frame is not None
        below = replace(phase.inner, seen=state.seen)
        below, command = self.inner[state.push].act(below, time)  # type: ignore[arg-type]
        state = replace(state, phase=Pushing(below), mode=below.mode, note=below.note)
        if below.outcome and below.outcome != ARRIVED:
            return replace(state, mode="done", outcome=below.outcome), command
        if self._lost(state.push, frame):
            return replace(state, mode="done", outcome="the finger lost the object"), self._standing(state)
        if not below.outcome:
            return state, command
        if np.any(state.seen.last.velocity):
            return state, self._standing(state)
        # Back from the object; then it is looked at.
        here = hand(frame, state.seen.told, time)
        back = compose(here, [-self.plan.scene.pusher.approach, 0.0, 0.0])
        away = Travelling((np.array([*back, 0.0]),), False)
        one, known = self.inner[state.push], None
        if isinstance(one, CarriedController) and isinstance(below, CarriedState):
            known = one.known(below, here)
        return self._travel(replace(state, push=state.push + 1, phase=away, known=known), time)

    def _lost(self, push: int, frame: Measurement) -> bool:
        """Whether the hand is nowhere near its place at the contact of a push; going on would push the air."""
        size = self.plan.scene.object.outline.size
        ahead, aside, _ = relative(self._model(push).pusher, relative(frame.object, frame.pusher))
        return abs(float(ahead)) > LOST_AHEAD * size or abs(float(aside)) > LOST_ASIDE * size

    def _model(self, push: int) -> SteeringModel:
        return self.inner[push].model


def check_pushes(plan: Plan) -> None:
    """Refuses a plan without a push (InputError)."""
    if plan.status != "solved" or not plan.pushes:
        raise InputError("there is no push to follow in this plan", hint="It has none, or is not solved.")


def _model(scene: Scene, option: PushOption) -> SteeringModel:
    """Of a push as it is planned, with what feedback may use beyond that."""
    assert option.car is not None
    assert option.placement is not None
    if len(option.placement.tips) == 2:
        margin = RESERVE * scene.planning.friction_margin
        wide = push_option(scene, option.push, margin=margin).car or option.car
        return SteeringModel.of_two(option.car, wide)
    whole = push_option(scene, option.push, margin=0.0).car
    return SteeringModel.of_car(option.car, scene.pusher.turns, whole)


def _fastest(model: SteeringModel, segment: PushSegment) -> float:
    """Speed of the fastest fingertip in the tightest turn, per flat speed."""
    away = transform(model.pusher, segment.fingers) - model.flat_point
    turn, h = max(model.left, model.right), model.direction
    return max(1.0, *(float(np.hypot(h[0] - k * y, h[1] + k * x)) for k in (turn, -turn) for x, y in away))


def _learning(
    scene: Scene, option: PushOption, one: TrackingController | PathController, sd: tuple[float, float]
) -> LearningController:
    assert option.car is not None
    d = -option.car.contact.point
    rho = local_rho(scene.object, d / float(np.hypot(*d)))
    prior = SteeringBelief.prior(scene.object.cof, rho, SD_COF * scene.object.outline.size, SD_RHO * rho)
    return LearningController(one, prior, sd, max(0.002, 5 * sd[0]))


def goal_error(plan: Plan, pose: Array) -> tuple[float, float]:
    """Distance [m] and angle [rad] of a pose from the goal."""
    error = plan.scene.goal_error(pose)
    return float(np.hypot(error[0], error[1])), abs(float(error[2]))


def beside(distance: float, turn: float) -> str:
    """The outcome of a run that ended off its goal, by a distance [m] and an angle [rad]."""
    return f"{BESIDE}: {1000 * distance:.2f} mm and {np.rad2deg(turn):.2f}° off"
