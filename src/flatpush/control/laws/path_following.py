"""Following the path of a push in arc length, without a singularity at rest: the default for Dubins references."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...geometry.pose import Array
from ..loop.controller import ARRIVED, ControllerState
from ..loop.limits import Limits, braking
from ..loop.measurement import STOP, Command
from .formulas import along_path, nearest, place, wrapped
from .gains import limits
from .push_controller import AbstractPushController, pusher_velocity
from .reference import PathReference
from .rest_of_path import rest_of_path
from .steering_model import SteeringModel

# Poles of the default gains, per turning radius of the flat point: both at -2 / R.
POLE = 2.0
# Over the last stretch, a turning radius long, a law that closes plans what is left anew in every tick where
# it is off the path by more than a share of the tolerance, with turns of a share of the tightest where they do.
ON_PATH, EASY = 0.15, 0.8


@dataclass(frozen=True, eq=False)
class PathState(ControllerState):
    """Of PathController: with the arc length reached [m]."""

    length: float = 0.0


def path_gains(model: SteeringModel) -> tuple[float, float]:
    """Stiffness [1/m²] and damping [1/m] with a double pole at -POLE times the tightest turn."""
    pole = POLE * min(model.left, model.right)
    return pole * pole, 2 * pole


def path_command(
    model: SteeringModel,
    path: PathReference,
    pose: Array,
    length: float,
    dt: float,
    gains: tuple[float, float] | None = None,
    deceleration: float = float("inf"),
) -> tuple[float, float, float, bool] | None:
    """Flat speed, ω, arc length abeam and whether the turn is at its limit; None where the end is abeam or behind.

    Args:
        length: arc length at the last tick [m]. dt: of the tick [s].
        gains: k₁ [1/m²] and k₂ [1/m]; default: see path_gains.
        deceleration: of the flat point at the end [m/s²].
    """
    x, y, heading = model.flat_of(pose)
    reach = 0.25 / max(model.left, model.right)
    length, left, angle, bend = nearest(path.table, x, y, length, max(reach, 2 * path.speed * dt))
    # Off an ellipsoid the flat point drifts aside as it runs: its way is at an angle to the heading.
    drift = model.across(1.0, bend)
    psi = wrapped(heading + math.atan(drift) - angle)
    remaining = path.length - length
    if remaining <= 1e-9:
        return None
    remaining /= max(0.2, math.cos(psi))
    # The last tick is a short one: a pusher cannot come back.
    speed = path.speed_from(length, dt)
    speed = min(speed, remaining / dt if math.isinf(deceleration) else braking(remaining, deceleration, dt))
    if length + speed * dt < path.length:
        # The mean turn of what is driven in this tick: it may lead over a junction.
        bend = wrapped(place(path.table, length + speed * dt)[2] - angle) / (speed * dt)
    k1, k2 = gains if gains is not None else path_gains(model)
    kappa, bounded = along_path(
        float(left), psi, bend * math.hypot(1.0, drift), k1, k2, model.left, model.right
    )
    return speed, kappa * speed, length, bounded


def closing_turn(
    model: SteeringModel,
    path: PathReference,
    pose: Array,
    length: float,
    step: float,
    tolerance: tuple[float, float],
) -> float | None:
    """Turn per length [1/m] that leads to the end of a path from where the object is; None before the last stretch and
    on the path.

    A law that only comes nearer to the path leaves what a landing was off by where the push is short.

    Args:
        length: arc length abeam [m]. step: that is driven in this tick [m].
        tolerance: of the object's place [m] and angle [rad], by which errors compare where both cannot be met.
    """
    left, radius = path.length - length, 1 / (EASY * min(model.left, model.right))
    if left > radius:
        return None
    x, y, heading = model.flat_of(pose)
    # Off an ellipsoid the way of the flat point is at an angle to the heading.
    px, py, angle, bend = place(path.table, length)
    way = x, y, heading + math.atan(model.across(1.0, bend))
    if max(math.hypot(x - px, y - py) / tolerance[0], abs(wrapped(way[2] - angle)) / tolerance[1]) < ON_PATH:
        return None
    lever = float(model.flat_point @ model.direction)
    rest = rest_of_path(
        way, place(path.table, path.length)[:3], radius, model.left, model.right, left, step, lever, tolerance
    )
    return None if rest.how == "past" else rest.curvature


@dataclass(frozen=True, eq=False)
class PathController(AbstractPushController[PathState]):
    """Follows a path at its flat speed or with its time law, wherever along it the object is.

    Args:
        model: of the push. path: of its flat point, and the flat speed. rate: of the ticks [Hz].
        stiffness, damping: gains k₁ [1/m²] and k₂ [1/m]; default: see path_gains.
        deceleration: of the flat point at the end [m/s²].
        closing: the tolerance [m, rad] of a law that plans the last stretch anew in every tick; see closing_turn.
        limits, body, stale, noise: see AbstractController.

    Raises:
        InputError: for gains that are unstable at this rate and speed.
    """

    model: SteeringModel
    path: PathReference
    rate: float = 60.0
    stiffness: float | None = None
    damping: float | None = None
    deceleration: float = float("inf")
    closing: tuple[float, float] | None = None
    limits: Limits | None = None
    body: str = ""
    stale: float = 0.5
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise InputError("a rate is positive", key="rate", value=self.rate)
        self.check_stale()
        if not self.deceleration > 0:
            raise InputError("a deceleration is positive", key="deceleration", value=self.deceleration)
        k1, k2 = self.gains
        if not (np.isfinite(k1) and np.isfinite(k2) and k1 > 0 and k2 > 0):
            raise InputError("stiffness and damping are positive and finite", value=(k1, k2))
        low, high = limits(k1, self.rate / self.path.speed)  # ticks per metre
        if not low < k2 < high:
            raise InputError(
                f"at {self.rate:g} Hz and {1000 * self.path.speed:g} mm/s a stiffness of {k1:.4g}/m² is stable with a"
                f" damping between {low:.4g} and {high:.4g}/m",
                key="damping", value=k2, hint="Change the gains, the rate or the speed.",
            )  # fmt: skip

    @property
    def gains(self) -> tuple[float, float]:
        """Stiffness [1/m²] and damping [1/m] of the law, its own or those that path_gains finds."""
        k1, k2 = path_gains(self.model)
        return (
            k1 if self.stiffness is None else float(self.stiffness),
            k2 if self.damping is None else float(self.damping),
        )

    def start(self, time: float = 0.0) -> PathState:
        if not np.isfinite(time):
            raise InputError("a time is finite", value=time)
        return PathState()

    def follow(self, state: PathState, pose: Array, time: float) -> tuple[PathState, Command]:
        dt = 1 / self.rate
        found = path_command(self.model, self.path, pose, state.length, dt, self.gains, self.deceleration)
        if found is None:
            return replace(state, mode="done", outcome=ARRIVED, length=self.path.length), STOP
        speed, omega, length, bounded = found
        if self.closing is not None:
            turn = closing_turn(self.model, self.path, pose, length, speed * dt, self.closing)
            omega = omega if turn is None else turn * speed
        velocity = pusher_velocity(self.model, pose, speed, omega, dt)
        mode, note = ("saturated", "at the edge of the friction cone") if bounded else ("path", "")
        return replace(state, mode=mode, note=note, length=length), Command(velocity)
