"""What a hand may do: the one limiter that every command of every controller goes through."""

import math
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...geometry import pose_error, transform
from ...geometry.pose import Array
from ...problem import Pusher
from .measurement import Command, Measurement

# The share of each limit that is used: the motion in a tick is judged at its two ends.
USED = 0.999
# Of the acceleration, so much may go into turning at a constant speed.
TURNING = 0.9
# Halvings of the way from the last motion to the one that is wanted.
HALVINGS = 14
# A frame is impossible if it is off by more than the hand can have done and so many standard deviations of the noise.
DEVIATIONS = 8.0
# A pushed object runs at most so many times as fast as the finger, and it turns about a point that is at least this
# share of its size away from the contact.
FASTER, NEAREST = 2.0, 0.15


@dataclass(frozen=True, eq=False)
class Limits:
    """Of a hand with fingertips at fixed places.

    Attributes:
        tips: centres of the fingertips in E, shape (k, 2) [m].
        speed, acceleration: of the fastest fingertip on the table [m/s], [m/s²].
        turn_rate: of the hand, always [rad/s].
        travel_speed, travel_acceleration: of the fastest fingertip while the hand is lifted, rising included.
        size: of the object that is pushed [m]; 0: no frame is impossible.
    """

    tips: Array
    speed: float
    acceleration: float
    turn_rate: float
    travel_speed: float
    travel_acceleration: float
    size: float = 0.0

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
        """A scene's limits, for fingertips at places in E."""
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

    def kept(self, last: Command, climb: float, wanted: Command, yaw: float, dt: float) -> Command:
        """The command nearest to what is wanted, on the way from the last motion, that keeps to every limit.

        A motion is a hand twist and a rate of climbing. What is too fast is slowed down as a whole, so that the object
        turns about the same point; from tick to tick the twist seen from the hand changes by as much as the
        acceleration of the fastest fingertip allows.

        Args:
            last: what was done until now, and climb: the rate at which the hand rose [m/s].
            yaw: of the hand now [rad]. dt: for which a command holds [s].
        """
        vx, vy, spin = (float(v) for v in last.velocity)
        c, s = math.cos(spin * dt), math.sin(spin * dt)
        before = (c * vx - s * vy, s * vx + c * vy, spin, climb)
        asked = (*(float(v) for v in wanted.velocity), (wanted.height - last.height) / dt)
        up = last.height > 0 or wanted.height > 0 or climb != 0
        speed, most = (
            (self.travel_speed, self.travel_acceleration * dt) if up else (self.speed, self.acceleration * dt)
        )
        speed, most = USED * speed, USED * most
        arms = [
            (math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y)
            for x, y in self.tips.tolist()
        ]
        old = _ends(arms, (vx, vy, spin, climb), -spin * dt, dt)

        def fits(motion: tuple[float, float, float, float]) -> bool:
            if abs(motion[2]) > USED * self.turn_rate:
                return False
            new = _ends(arms, motion, 0.0, dt)
            return all(
                _size(u) <= speed and _size((u[0] - w[0], u[1] - w[1], u[2] - w[2])) <= most
                for u, w in zip(new, old, strict=True)
            )

        fastest = max(_size(u) for u in _ends(arms, asked, 0.0, dt))
        share = min(
            1.0,
            speed / max(fastest, 1e-300),
            USED * self.turn_rate / max(abs(asked[2]), 1e-300),
            math.sqrt(TURNING * most / dt / max(abs(asked[2]) * fastest, 1e-300)),
        )
        goal = tuple(share * x for x in asked)
        if not fits(goal):  # type: ignore[arg-type]
            low, high = 0.0, 1.0
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                mixed = tuple(a + middle * (b - a) for a, b in zip(before, goal, strict=True))
                low, high = (middle, high) if fits(mixed) else (low, middle)  # type: ignore[arg-type]
            goal = tuple(a + low * (b - a) for a, b in zip(before, goal, strict=True))
        return Command(np.array(goal[:3]), max(0.0, last.height + goal[3] * dt))

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
            stop: X_WE and height (x, y, θ, height), shape (4,); hand, height: where it is now.
            last, climb: as in kept. table: whether this leg is made at the speed on the table.
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

    def tip_velocities(self, velocity: Array, yaw: float) -> Array:
        """Of the fingertips in W, shape (k, 2), for a velocity of the hand (3,) at a yaw."""
        arms = transform([0.0, 0.0, yaw], self.tips)
        return np.asarray(velocity[:2] + velocity[2] * np.stack([-arms[:, 1], arms[:, 0]], axis=1))


def braking(length: float, deceleration: float, dt: float) -> float:
    """The speed for the next tick from which one comes to rest after a length; the last tick ends exactly there.

    v dt + v²/2a = length: then v falls by at most a dt from tick to tick.
    """
    if length <= deceleration * dt * dt:
        return length / dt
    return deceleration * (math.sqrt(dt * dt + 2 * length / deceleration) - dt)


def _ends(
    arms: list[tuple[float, float]], motion: tuple[float, ...], angle: float, dt: float
) -> list[tuple[float, float, float]]:
    """Velocities of the fingertips at the start and at the end of a tick that begins with the arms at an angle."""
    vx, vy, spin, climb = motion
    found = []
    for turned in (angle, angle + spin * dt):
        c, s = math.cos(turned), math.sin(turned)
        found += [(vx - spin * (s * x + c * y), vy + spin * (c * x - s * y), climb) for x, y in arms]
    return found


def _size(u: tuple[float, float, float]) -> float:
    return math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
