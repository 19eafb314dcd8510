"""Dynamic feedback linearisation of a sticking push: tracking in time, and stabilising at a pose.

[Zhou2017] Sec. 4.1, Eqs. 34-46 (docs/errata.md rows 2, 11 and 15), for any contact: the compensator's state is the flat
speed, by which the law divides. A push is quasi-static: twists a times as large lead along the same way in 1/a of the
time. So a reference that slows down is tracked at its cruising speed by a slower clock ([Dahl1990] do the same
for arms), and the clock waits for a hand that its limits hold back. Over the last stretch the path law takes over.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry import pose_error, wrap_angle
from ...geometry.pose import Array
from ..loop.controller import ARRIVED, ControllerState
from ..loop.limits import Limits
from ..loop.measurement import STOP, Command
from .formulas import CAP, FLOOR, MOST_SHARE, AxisGains, Bounds, FlatPose, FlatTarget, linearised
from .gains import HOLDS, Gains, Hold
from .path_following import EASY, closing_turn, path_command
from .push_controller import AbstractPushController, pusher_velocity
from .reference import AbstractReference, PathReference, check_reference
from .steering_model import SteeringModel


@dataclass(frozen=True, eq=False)
class TrackingState(ControllerState):
    """Of TrackingController and PostureController.

    Attributes:
        begun: when it started [s]. clock: time of the reference that was reached [s].
        speed: the compensator's state s, by the clock [m/s]; nan before the first measurement.
        scale: of ω in the last tick; below 1 the friction cone bounded it.
        length: arc length reached, once the path law has taken over [m].
        pace: of the clock in the last tick. wanted: the pusher's velocity that was asked for then, shape (3,).
    """

    begun: float = 0.0
    clock: float = 0.0
    speed: float = float("nan")
    scale: float = 1.0
    length: float = 0.0
    pace: float = 1.0
    wanted: Array | None = None


@dataclass(frozen=True, eq=False)
class _Linearised(AbstractPushController[TrackingState]):
    model: SteeringModel
    gains: Gains
    rate: float = 60.0
    hold: Hold = "ramp"
    deceleration: float = float("inf")
    limits: Limits | None = None
    body: str = ""
    stale: float = 0.5
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    def start(self, time: float = 0.0) -> TrackingState:
        if not np.isfinite(time):
            raise InputError("a time is finite", value=time)
        return TrackingState(begun=time)

    @cached_property
    def _axes(self) -> AxisGains:
        return AxisGains(*(float(k) for k in (*self.gains.kp, *self.gains.kd)))

    def _check(self) -> None:
        self.gains.check(self.rate, self.hold)
        self.check_stale()

    def _tick(
        self,
        state: TrackingState,
        pose: Array,
        time: float,
        target: FlatTarget,
        nominal: float,
        pace: float = 1.0,
    ) -> tuple[TrackingState, Command]:
        m, dt = self.model, pace / self.rate
        s0 = nominal if np.isnan(state.speed) else state.speed
        speed, out, omega, scale, bounded = linearised(
            FlatPose(*m.flat_of(pose)), s0, target, self._axes, Bounds(m.left, m.right, FLOOR * nominal, CAP * nominal),
            dt, HOLDS.index(self.hold),
        )  # fmt: skip
        mode, note = "tracking", ""
        if scale < 1:
            mode, note = "saturated", f"the friction cone allows {100 * scale:.0f} % of the correction"
        elif bounded:
            mode, note = "guarded", "the flat speed is at its bound"
        return self._command(
            replace(state, mode=mode, note=note, speed=speed, scale=scale, pace=pace),
            pose, time, pace * out, pace * omega,
        )  # fmt: skip

    def _command(
        self, state: TrackingState, pose: Array, time: float, speed: float, omega: float
    ) -> tuple[TrackingState, Command]:
        velocity = pusher_velocity(self.model, pose, speed, omega, 1 / self.rate, HOLDS.index(self.hold))
        return replace(state, wanted=velocity), Command(velocity)

    def _stop(self, state: TrackingState, time: float, outcome: str) -> tuple[TrackingState, Command]:
        return replace(state, mode="done", outcome=outcome), STOP


@dataclass(frozen=True, eq=False)
class TrackingController(_Linearised):
    """Tracks a reference in time.

    Args:
        model: of the push. gains: along x and y of W. rate: of the ticks [Hz], 10 to 1000 and beyond.
        hold: how the pusher moves in a tick, see gains.Hold.
        deceleration: of the flat point at the end [m/s²].
        limits, body, stale, noise: see AbstractController.
        reference: of the flat point; one with time laws is tracked at its largest speed, by a clock that slows down.
        finish: after the reference has ended, follow its path on until its end is abeam.
        closing: tolerance [m, rad], see PathController; the path law then has all of the last stretch.

    Raises:
        InputError: for gains that are unstable at the rate, and references that rest or reverse on the way or turn
            tighter than the push can.
    """

    reference: AbstractReference = None  # type: ignore[assignment]
    finish: bool = True
    closing: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        self._check()
        if self.reference is None:
            raise InputError("a reference is needed", key="reference")
        # Dubins references turn as tightly as their margin allows, the model a little more.
        check_reference(self._even, max(self.model.left, self.model.right))

    @cached_property
    def _even(self) -> AbstractReference:
        """The reference by the clock: a path is run along at a constant speed."""
        path = self.reference
        return replace(path, laws=()) if isinstance(path, PathReference) else path

    def follow(self, state: TrackingState, pose: Array, time: float) -> tuple[TrackingState, Command]:
        state, even = self._clocked(state, pose, time), self._even
        t, T, dt, pace = state.clock, even.duration, 1 / self.rate, 1.0
        if t >= T - self._braking_time - 1e-9:
            return self._ending(state, pose, time)
        if isinstance(self.reference, PathReference):
            pace = self.reference.speed_from(self.reference.speed * t, dt) / self.reference.speed
        now, middle = even.at(t), even.at(0.5 * T)
        # The mean acceleration over the tick: at a junction the acceleration jumps.
        mean = (even.at(min(t + pace * dt, T)).velocity - now.velocity) / (pace * dt)
        nominal = float(np.hypot(*middle.velocity))
        target = FlatTarget(*(float(x) for x in (*now.position, *now.velocity, *mean)))
        return self._tick(state, pose, time, target, nominal, pace)

    def _clocked(self, state: TrackingState, pose: Array, time: float) -> TrackingState:
        """With the clock after the last tick, in which the limits may have left less of the motion than was wanted."""
        if state.wanted is None or not state.seen.told:
            return replace(state, clock=time - state.begun)
        begun, done = state.seen.told[-1]
        share = 1.0
        if not np.array_equal(done, state.wanted):
            wanted, left = (self._flat_speed(u, pose, time - begun) for u in (state.wanted, done))
            share = min(max(left / wanted, 0.0), MOST_SHARE) if wanted > 0 else 0.0
        return replace(state, clock=state.clock + share * state.pace * (time - begun))

    def _flat_speed(self, velocity: Array, pose: Array, dt: float) -> float:
        """Of the flat point in a tick that ends at a pose, for a velocity of the pusher (3,) in W."""
        turn = float(pose[2]) - 0.5 * float(velocity[2]) * dt
        c, d = np.cos(turn), np.sin(turn)
        ux, uy = float(velocity[0]), float(velocity[1])
        return self.model.motion(float(c * ux + d * uy), float(c * uy - d * ux))[0]

    @property
    def _braking_time(self) -> float:
        """Before its end the reference is left for its path, so that there is room to come to rest [s]."""
        if not (self.finish and isinstance(self.reference, PathReference)):
            return 0.0
        if self.closing is not None:
            return 1 / (EASY * min(self.model.left, self.model.right)) / self.reference.speed
        return 0.5 * self.reference.speed / self.deceleration + (
            2 / self.rate if np.isfinite(self.deceleration) else 0
        )

    def _ending(self, state: TrackingState, pose: Array, time: float) -> tuple[TrackingState, Command]:
        """At rest the arc-length law takes over, until the end of the path is abeam."""
        path = self.reference
        if not (self.finish and isinstance(path, PathReference)):
            return self._stop(state, time, ARRIVED)
        dt = 1 / self.rate
        length = state.length if state.length > 0 else min(path.length, path.speed * state.clock)
        found = path_command(self.model, path, pose, length, dt, deceleration=self.deceleration)
        if found is None:
            return self._stop(state, time, ARRIVED)
        speed, omega, length, _ = found
        if self.closing is not None:
            turn = closing_turn(self.model, path, pose, length, speed * dt, self.closing)
            omega = omega if turn is None else turn * speed
        return self._command(replace(state, mode="path", note="", length=length), pose, time, speed, omega)


@dataclass(frozen=True, eq=False)
class PostureController(_Linearised):
    """Brings the object to a pose and stops: [Zhou2017]'s law with a reference at rest.

    Works forward only: from behind the goal, roughly in its heading; across the goal's heading the gains are stiffer
    than along it, so that the flat point arrives along it. Gains of the model's own axes: kp, kd [0] along the goal's
    heading, [1] across.

    Args:
        goal: X_WO (3,). speed: the flat speed it starts with [m/s]. tolerance: (m, rad) within which it has arrived.

    Raises:
        InputError: for a goal that is not finite, or a speed that is not positive.
    """

    goal: ArrayLike = (0.0, 0.0, 0.0)
    speed: float = 0.02
    tolerance: tuple[float, float] = (0.0005, float(np.deg2rad(0.5)))

    def __post_init__(self) -> None:
        self._check()
        goal = np.array(self.goal, dtype=float)
        if goal.shape != (3,) or not np.all(np.isfinite(goal)):
            raise InputError("a goal is three finite numbers", key="goal", value=self.goal)
        if not (np.isfinite(self.speed) and self.speed > 0):
            raise InputError("a flat speed is positive", key="speed", value=self.speed)

    def follow(self, state: TrackingState, pose: Array, time: float) -> tuple[TrackingState, Command]:
        goal = np.asarray(self.goal, dtype=float)
        gx, gy, angle = self.model.flat_of(goal)
        x, y, heading = self.model.flat_of(pose)
        c, d = np.cos(angle), np.sin(angle)
        ahead, left = (gx - x) * c + (gy - y) * d, -((y - gy) * c - (x - gx) * d)
        error = pose_error(pose, goal)
        if np.hypot(error[0], error[1]) <= self.tolerance[0] and abs(error[2]) <= self.tolerance[1]:
            return self._stop(state, time, ARRIVED)
        if ahead <= 0:
            return self._stop(
                state,
                time,
                f"the goal's position is abeam, {1000 * abs(left):.2f} mm aside; a finger cannot pull",
            )
        # In the goal's axes, so that along and across have gains of their own.
        s0 = self.speed if np.isnan(state.speed) else state.speed
        m = self.model
        speed, out, omega, scale, bounded = linearised(
            FlatPose(-ahead, -left, float(wrap_angle(heading - angle))), s0, FlatTarget(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            self._axes, Bounds(m.left, m.right, FLOOR * self.speed, CAP * self.speed), 1 / self.rate,
            HOLDS.index(self.hold),
        )  # fmt: skip
        mode = "saturated" if scale < 1 else "guarded" if bounded else "posture"
        return self._command(
            replace(state, mode=mode, note="", speed=speed, scale=scale), pose, time, out, omega
        )
