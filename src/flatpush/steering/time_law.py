"""The time law: each stretch of the pusher's way starts and ends at rest, within speed and acceleration."""

import math
from dataclasses import dataclass

import numpy as np

from ..formulas import formula
from ..geometry.pose import Array


@formula
def rest_to_rest(way: float, speed: float, acceleration: float) -> float:
    """Time [s] along a way [m] that starts and ends at rest, within a speed [m/s] and an acceleration [m/s²]."""
    if way <= 0.0:
        return 0.0
    if way * acceleration >= speed * speed:
        return way / speed + speed / acceleration
    return 2.0 * math.sqrt(way / acceleration)


@dataclass(frozen=True)
class Trapezoid:
    """Speeding up, cruising and slowing down along a length; a triangle where the length is too short to cruise.

    Attributes:
        length: [m]. speed: of cruising [m/s]. acceleration: of both ramps [m/s²].
        slow: speed at both ends [m/s], 0: at rest. From piece to piece of a path the turn changes at once, and with it
            the velocity of the fingertips; the slower that is, the less there is to be made up for.
    """

    length: float
    speed: float
    acceleration: float
    slow: float = 0.0

    @classmethod
    def along(
        cls, length: float, radius: float, speed: float, acceleration: float, turn_rate: float = np.inf
    ) -> "Trapezoid":
        """For the fastest fingertip on a circle of a radius (inf: a straight line), of a hand that turns with it.

        The cruising speed leaves half of the acceleration's square for turning, so that speeding up while turning
        keeps the whole within the limit.
        """
        cruise = min(speed, float(np.sqrt(acceleration * radius / np.sqrt(2.0))))
        if not np.isinf(radius):
            cruise = min(cruise, turn_rate * radius)
        return cls(length, cruise, acceleration if np.isinf(radius) else acceleration / float(np.sqrt(2.0)))

    @property
    def top(self) -> float:
        """The highest speed that is reached [m/s]."""
        return min(self.speed, math.sqrt(self.slow**2 + self.acceleration * self.length))

    @property
    def ramp(self) -> float:
        """Time of speeding up [s]."""
        return (self.top - self.slow) / self.acceleration

    @property
    def duration(self) -> float:
        """Time from end to end [s]: that from rest to rest over what the ramps would be longer, less that on it."""
        before = self.slow / self.acceleration
        return rest_to_rest(self.length + self.slow * before, self.speed, self.acceleration) - 2 * before

    def travelled(self, time: Array) -> Array:
        """Length travelled by times (...) [s], shape (...) [m]."""
        T, r, a, v = self.duration, self.ramp, self.acceleration, self.slow
        t = np.clip(time, 0.0, T)
        left = T - t
        cruising = (v + 0.5 * a * r) * r + self.top * (t - r)
        ending = self.length - v * left - 0.5 * a * left * left
        return np.where(t < r, v * t + 0.5 * a * t * t, np.where(left < r, ending, cruising))

    def motion(self, time: float) -> tuple[float, float, float]:
        """Length [m], speed [m/s] and its rate [m/s²] at a time [s]."""
        T, r, a = self.duration, self.ramp, self.acceleration
        t = min(max(time, 0.0), T)
        left = T - t
        if t < r:
            return self.slow * t + 0.5 * a * t * t, self.slow + a * t, a
        if left < r:
            return self.length - self.slow * left - 0.5 * a * left * left, self.slow + a * left, -a
        return (self.slow + 0.5 * a * r) * r + self.top * (t - r), self.top, 0.0

    def speed_from(self, gone: float, dt: float) -> float:
        """Mean speed [m/s] over a tick of dt [s] that begins after a length [m]; never 0 before the end."""
        step = 0.5 * self.acceleration * dt
        left = max(0.0, self.length - gone)
        rising, falling = (
            math.sqrt(self.slow**2 + 2 * self.acceleration * s) for s in (max(0.0, gone), left)
        )
        return min(self.speed, rising + step, max(falling - step, step, self.slow))

    def samples(self, step: float, count: int) -> tuple[Array, Array]:
        """Times and fractions of the length: at most `step` seconds apart in the ramps, and 1 / count of the length.

        Both include the ends exactly.
        """
        if self.length <= 0:
            return np.zeros(1), np.zeros(1)
        T, r = self.duration, self.ramp
        most = count * self.top / self.length  # pieces in a second at the greatest speed
        k = max(1, int(np.ceil(max(r / step, most * r))))
        m = max(0, int(np.ceil(most * (T - 2 * r)))) + 1
        ramps = np.linspace(0.0, r, k + 1)
        cruise = np.linspace(r, T - r, m + 1) if T - 2 * r > 1e-9 * T else np.array([])
        t = np.sort(np.concatenate([ramps, cruise, T - ramps[::-1]]))
        t = t[np.concatenate([[True], np.diff(t) > 1e-9 * T])]
        t[-1] = T
        fractions = self.travelled(t) / self.length
        fractions[0], fractions[-1] = 0.0, 1.0
        return t, fractions
