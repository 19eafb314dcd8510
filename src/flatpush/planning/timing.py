"""The time law: each stretch of the pusher's way starts and ends at rest, within speed and acceleration."""

from dataclasses import dataclass

import numpy as np

from ..geometry.pose import Array


@dataclass(frozen=True)
class Trapezoid:
    """Speeding up, cruising and slowing down along a length [m]; a triangle where the length is too short to cruise."""

    length: float
    speed: float
    acceleration: float

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
    def ramp(self) -> float:
        """Time of speeding up [s]."""
        return min(self.speed / self.acceleration, float(np.sqrt(self.length / self.acceleration)))

    @property
    def duration(self) -> float:
        peak = self.ramp * self.acceleration
        return 2 * self.ramp + (self.length - peak * self.ramp) / peak if self.length > 0 else 0.0

    def travelled(self, time: Array) -> Array:
        """Length travelled by a time [m]."""
        T, r, a = self.duration, self.ramp, self.acceleration
        t = np.clip(time, 0.0, T)
        left = T - t
        cruising = 0.5 * a * r * r + a * r * (t - r)
        return np.where(
            t < r, 0.5 * a * t * t, np.where(left < r, self.length - 0.5 * a * left * left, cruising)
        )

    def samples(self, step: float, count: int) -> tuple[Array, Array]:
        """Times and fractions of the length: at most `step` seconds apart in the ramps, at least `count` pieces in all.

        Both include the ends exactly.
        """
        if self.length <= 0:
            return np.zeros(1), np.zeros(1)
        T, r = self.duration, self.ramp
        n = max(1, int(np.ceil(r / step)))
        ramps = np.linspace(0.0, r, n + 1)
        m = max(1, int(np.ceil(count * max(0.0, T - 2 * r) / T)) + 1)
        # A ramp that turns far is divided by the turn as well.
        k = max(n, int(np.ceil(count * 0.5)) if self.length <= self.acceleration * r * r * (1 + 1e-9) else n)
        ramps = np.linspace(0.0, r, k + 1)
        cruise = np.linspace(r, T - r, m + 1) if T - 2 * r > 1e-9 * T else np.array([])
        t = np.unique(np.concatenate([ramps, cruise, T - ramps[::-1]]))
        t = t[np.concatenate([[True], np.diff(t) > 1e-9 * T])]
        t[-1] = T
        fractions = self.travelled(t) / self.length
        fractions[0], fractions[-1] = 0.0, 1.0
        return t, fractions
