"""What a hand may do: the one limiter that every command of every controller goes through."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...formulas import formula
from ...geometry import pose_error, wrap_angle
from ...geometry.pose import Array
from ...problem import Pusher
from .measurement import Command, Measurement

# The share of each limit that is used: the motion in a tick is judged at its two ends.
USED = 0.999
# What is slowed down to a limit is within it, however it is rounded.
ROUNDED = 1 - 1e-9
# Of the acceleration, so much may go into turning at a constant speed.
TURNING = 0.9
# Halvings of the way from the last motion to the one that is wanted.
HALVINGS = 14
# A frame is impossible if it is off by more than the hand can have done and so many standard deviations of the noise.
DEVIATIONS = 8.0
# A pushed object runs at most so many times as fast as the finger, and it turns about a point that is at least this
# share of its size away from the contact.
FASTER, NEAREST = 2.0, 0.15
# Feedback may turn a hand by so much more than is planned [rad].
SPARE = 0.3


@dataclass(frozen=True, eq=False)
class Limits:
    """Of a hand with fingertips at fixed places.

    Attributes:
        tips: centres of the fingertips in E, shape (k, 2) [m].
        speed, acceleration: of the fastest fingertip on the table [m/s], [m/s²].
        turn_rate: of the hand, always [rad/s].
        travel_speed, travel_acceleration: of the fastest fingertip while the hand is lifted, rising included [m/s],
            [m/s²].
        size: of the object that is pushed [m]; 0: no frame is impossible.
        yaws: least and greatest yaw that the hand can have, whole turns counted [rad].
        alike: turns after which the fingertips are where they were, best first [rad].

    Raises:
        InputError: for tips of another shape, or a limit that is not positive.
    """

    tips: Array
    speed: float
    acceleration: float
    turn_rate: float
    travel_speed: float
    travel_acceleration: float
    size: float = 0.0
    yaws: tuple[float, float] = (-math.inf, math.inf)
    alike: tuple[float, ...] = (2 * math.pi,)

    def __post_init__(self) -> None:
        tips = np.array(self.tips, dtype=float)
        if tips.ndim != 2 or tips.shape[1] != 2 or not len(tips) or not np.all(np.isfinite(tips)):
            raise InputError("fingertips are one or more points [x, y]", key="tips", value=self.tips)
        for name in ("speed", "acceleration", "turn_rate", "travel_speed", "travel_acceleration"):
            if not getattr(self, name) > 0:
                raise InputError("a limit is positive", key=name, value=getattr(self, name))
        object.__setattr__(self, "tips", tips)

    @classmethod
    def of(cls, pusher: Pusher, tips: Array, size: float = 0.0) -> "Limits":
        """A scene's limits, for `tips` at places in E, shape (k, 2) [m], and an object of a `size` [m]."""
        return cls(
            tips,
            pusher.speed,
            pusher.acceleration,
            pusher.turn_rate,
            pusher.travel_speed,
            pusher.travel_acceleration,
            size,
        )

    @property
    def reach(self) -> float:
        """From E's origin to the farthest fingertip [m]."""
        return float(np.max(np.hypot(*self.tips.T)))

    def landing(
        self, yaw: float, here: float, swing: tuple[float, float], turned: float = 0.0
    ) -> tuple[float, float]:
        """The yaw at which a hand lands by the short way, and the turn that it makes besides where the push would leave
        its range, both in W, whole turns counted [rad].

        Args:
            yaw: that of the contact, and here: that of the hand now [rad].
            swing: how far the push turns the hand, at least and at most [rad].
            turned: by which the hand is taken to be turned farther than it is [rad].

        >>> arm = Limits(np.zeros((1, 2)), 0.02, 0.1, 1.5, 0.1, 0.5, yaws=(-5.0, 5.0))
        >>> arm.landing(2.0, 0.0, (0.0, 1.0)), arm.landing(2.0, 3.0, (0.0, 1.0))
        ((2.0, 0.0), (2.0, 0.0))
        >>> short, turn = arm.landing(4.0, 3.5, (0.0, 1.0))
        >>> round(short, 6), round(turn / math.pi)
        (4.0, -2)
        """
        short = here + float(wrap_angle(yaw - here))
        low, high = (
            end - short - far + turned + spare
            for end, far, spare in zip(self.yaws, swing, (SPARE, -SPARE), strict=True)
        )
        return short, turn_within(low, high, *self.alike)

    def kept(self, last: Command, climb: float, wanted: Command, yaw: float, dt: float) -> Command:
        """The command nearest to the wanted one, on the way from the last motion, that keeps to every limit.

        A motion is a hand twist and a rate of climbing. What is too fast is slowed down as a whole, so that the object
        turns about the same point; from tick to tick the twist seen from the hand changes by as much as the
        acceleration of the fastest fingertip allows.

        Args:
            last: what was done until now, and climb: the rate at which the hand rose [m/s].
            yaw: of the hand now [rad]. dt: for which a command holds [s].
        """
        up = last.height > 0 or wanted.height > 0 or climb != 0
        most = (
            HandLimits(self.travel_speed, self.travel_acceleration, self.turn_rate)
            if up
            else HandLimits(self.speed, self.acceleration, self.turn_rate)
        )
        (ax, ay, aspin), (bx, by, bspin) = last.velocity.tolist(), wanted.velocity.tolist()
        before = HandMotion(ax, ay, aspin, climb)
        motion = HandMotion(bx, by, bspin, (wanted.height - last.height) / dt)
        vx, vy, spin, rise = kept_motion(before, motion, yaw, dt, self.tips, most)
        return Command(np.array([vx, vy, spin]), max(0.0, last.height + rise * dt))

    def impossible(self, before: Measurement, frame: Measurement, noise: tuple[float, float]) -> str:
        """Why a frame cannot be true after the last good one, or "".

        Args:
            noise: standard deviations of a frame's position [m] and angle [rad].
        """
        if self.size <= 0:
            return ""
        dt = frame.time - before.time
        off = pose_error(frame.object, before.object)
        place, turned = float(np.hypot(off[0], off[1])), abs(float(off[2]))
        run = self.speed * dt
        if (
            place > FASTER * run + DEVIATIONS * noise[0]
            or turned > run / (NEAREST * self.size) + DEVIATIONS * noise[1]
        ):
            return (
                f"an outlier: the object cannot have moved by {1000 * place:.1f} mm and"
                f" {math.degrees(turned):.1f}° in {dt:.3g} s"
            )
        jump = pose_error(frame.pusher, before.pusher)
        place, turned = float(np.hypot(jump[0], jump[1])), abs(float(jump[2]))
        if place > max(self.travel_speed, self.speed) * dt + 1e-3 or turned > self.turn_rate * dt + 1e-2:
            return (
                f"an outlier: the hand cannot have moved by {1000 * place:.1f} mm and"
                f" {math.degrees(turned):.1f}° in {dt:.3g} s"
            )
        return ""

    def towards(
        self, stop: Array, hand: Array, height: float, last: Command, climb: float, dt: float, table: bool
    ) -> Command:
        """Straight to a stop and at rest there.

        Args:
            stop: X_WE and height (x, y, θ, height), shape (4,); hand, height: where it is now, X_WE (3,) and [m].
            last, climb, dt: as in kept. table: whether this leg is made at the speed on the table.
        """
        delta = np.array([*(stop[:3] - hand), stop[3] - height])
        turn = abs(float(delta[2]))
        length = float(np.sqrt(delta[0] ** 2 + delta[1] ** 2 + delta[3] ** 2)) + turn * self.reach
        if length == 0:
            return Command(np.zeros(3), height)
        most, gain = (
            (self.speed, self.acceleration) if table else (self.travel_speed, self.travel_acceleration)
        )
        # Half of the acceleration is for turning, where there is any.
        gain *= 0.5 if turn > 0 and self.reach > 0 else 0.95
        if turn > 0:
            most = min(most, 0.95 * self.turn_rate * length / turn)
            if self.reach > 0:
                most = min(most, math.sqrt(0.4 * gain / self.reach) * length / turn)
        way = delta / length
        scale = float(way @ way)
        now = max(0.0, float(np.array([*last.velocity, climb]) @ way) / scale)
        speed = min(0.95 * most, now + gain * dt, braking(length, gain, dt))
        rates = speed * way
        return Command(rates[:3], max(0.0, height + float(rates[3]) * dt))


def turn_within(low: float, high: float, *steps: float) -> float:
    """The turn that brings a hand into its range: none where it is there; else as near to the middle as steps come.

    Args:
        low, high: turns that lead to the ends of the range [rad]. steps: in which it may turn; the first with which it
            gets there, or the last; 0: by anything.

    >>> turn_within(-1.0, 2.0, 3.0), turn_within(1.0, 4.0, 3.0), turn_within(1.0, 2.0, 3.0, 0.0)
    (0.0, 3.0, 1.5)
    """
    if low <= 0 <= high:
        return 0.0
    turn, middle = 0.0, 0.5 * (low + high)
    for step in steps:
        turn = step * round(middle / step) if step > 0 else middle
        if low <= turn <= high:
            break
    return turn


def braking(length: float, deceleration: float, dt: float) -> float:
    """The speed for the next tick from which one comes to rest after a length; the last tick ends exactly there.

    v dt + v²/2a = length: then v falls by at most a dt from tick to tick.
    """
    if length <= deceleration * dt * dt:
        return length / dt
    return deceleration * (math.sqrt(dt * dt + 2 * length / deceleration) - dt)


def beyond(points: Array, bounds: tuple[float, float, float, float], room: float = 0.0) -> float:
    """How far the farthest of points (n, 2) lies outside of bounds (xmin, ymin, xmax, ymax) that are narrower by a room
    on each side [m]; negative if all lie inside."""
    low, high = np.array(bounds[:2]) + room, np.array(bounds[2:]) - room
    return float(np.max(np.maximum(low - points, points - high)))


class HandMotion(NamedTuple):
    """Velocity of the hand in W [m/s], its yaw rate [rad/s] and the rate at which it rises [m/s]."""

    vx: float
    vy: float
    spin: float
    climb: float


class HandLimits(NamedTuple):
    """Of the fastest fingertip [m/s], [m/s²], and of the hand's turning [rad/s]; infinite where there is none."""

    speed: float
    acceleration: float
    turn_rate: float


@formula
def kept_motion(
    last: HandMotion, wanted: HandMotion, yaw: float, dt: float, tips: Array, limits: HandLimits
) -> HandMotion:
    """The motion nearest to the wanted one, on the way from the last one as seen from the hand, that keeps to limits.

    Args:
        yaw: of the hand at the start of the tick [rad]. tips: of the fingers in E, shape (k, 2).
    """
    fastest = 0.0
    for i in range(tips.shape[0]):
        for angle in (yaw, yaw + wanted.spin * dt):
            fastest = max(fastest, _speed(tip_motion(wanted, tips[i, 0], tips[i, 1], angle)))
    share = min(
        1.0,
        USED * limits.speed / max(fastest, 1e-300),
        USED * limits.turn_rate / max(abs(wanted.spin), 1e-300),
        math.sqrt(TURNING * USED * limits.acceleration / max(abs(wanted.spin) * fastest, 1e-300)),
    )
    share *= ROUNDED if share < 1.0 else 1.0
    goal = HandMotion(share * wanted.vx, share * wanted.vy, share * wanted.spin, share * wanted.climb)
    if _fits(last, goal, yaw, dt, tips, limits):
        return goal
    c, s = math.cos(last.spin * dt), math.sin(last.spin * dt)
    before = HandMotion(c * last.vx - s * last.vy, s * last.vx + c * last.vy, last.spin, last.climb)
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _fits(last, _between(before, goal, middle), yaw, dt, tips, limits):
            low = middle
        else:
            high = middle
    return _between(before, goal, low)


@formula
def tip_motion(motion: HandMotion, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """Velocity of the point (x, y) of E in W, the rise included, of a hand at a yaw."""
    c, s = math.cos(yaw), math.sin(yaw)
    return motion.vx - motion.spin * (s * x + c * y), motion.vy + motion.spin * (c * x - s * y), motion.climb


@formula
def _speed(u: tuple[float, float, float]) -> float:
    return math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])


@formula
def _between(before: HandMotion, goal: HandMotion, share: float) -> HandMotion:
    return HandMotion(
        before.vx + share * (goal.vx - before.vx),
        before.vy + share * (goal.vy - before.vy),
        before.spin + share * (goal.spin - before.spin),
        before.climb + share * (goal.climb - before.climb),
    )


@formula
def _fits(
    last: HandMotion, motion: HandMotion, yaw: float, dt: float, tips: Array, limits: HandLimits
) -> bool:
    """Whether the fingertips keep to their limits after the last motion, at the starts and the ends of both ticks."""
    speed, most = USED * limits.speed, USED * limits.acceleration * dt
    for i in range(tips.shape[0]):
        x, y = tips[i, 0], tips[i, 1]
        for k in range(2):
            u = tip_motion(motion, x, y, yaw + k * motion.spin * dt)
            w = tip_motion(last, x, y, yaw + (k - 1) * last.spin * dt)
            if _speed(u) > speed or _speed((u[0] - w[0], u[1] - w[1], u[2] - w[2])) > most:
                return False
    return True
