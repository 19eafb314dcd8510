"""Gains of the feedback laws, and the rates at which they are stable."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array

#: How the pusher moves during a tick. "ramp": ṡ and ω are held and the flat speed ramps, the pusher's velocity is the
#: mean over the tick. "before", "after": the pusher's velocity is held, and the flat speed is updated before, or after,
#: the velocity is put out.
Hold = Literal["ramp", "before", "after"]
HOLDS: tuple[Hold, ...] = ("ramp", "before", "after")


@dataclass(frozen=True, eq=False)
class Gains:
    """Proportional and derivative gains along the axes x and y of W: ë + k_d ė + k_p e = 0 ([Zhou2017] Eq. 46).

    Attributes:
        kp: shape (2,) [1/s²].
        kd: shape (2,) [1/s].

    Raises:
        InputError: for gains that are not positive and finite.

    >>> Gains.of(2.0, 1.0).kp.tolist(), Gains.of(2.0, 1.0).kd.tolist()
    ([4.0, 4.0], [4.0, 4.0])
    """

    kp: Array
    kd: Array

    def __post_init__(self) -> None:
        for name in ("kp", "kd"):
            value = np.asarray(getattr(self, name), dtype=float)
            value = np.array(np.broadcast_to(value, (2,))) if value.shape in ((), (1,), (2,)) else value
            if value.shape != (2,) or not np.all(np.isfinite(value)) or np.any(value <= 0):
                raise InputError("gains are one or two positive numbers", key=name, value=getattr(self, name))
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, frequency: ArrayLike, damping: ArrayLike = 1.0) -> "Gains":
        """By natural frequency ω [rad/s] and damping ratio ζ: k_p = ω², k_d = 2ζω.

        Raises:
            InputError: for gains that are not positive and finite.
        """
        w, z = np.asarray(frequency, dtype=float), np.asarray(damping, dtype=float)
        for name, value in (("frequency", w), ("damping", z)):
            if not np.all(np.isfinite(value) & (value > 0)):
                raise InputError("gains are positive and finite", key=name, value=value.tolist())
        return cls(w * w, 2 * z * w)

    def check(self, rate: float, hold: Hold = "ramp") -> None:
        """Refuses a rate [Hz] that makes no sense, or at which these gains are not stable.

        The errors at the ticks obey λ² - tλ + d = 0, stable while |d| < 1 and |t| < 1 + d (Jury); with Δ = 1/rate that
        is k_p Δ/2 < k_d < 2/Δ on a ramp, k_p Δ < k_d < 2/Δ + k_p Δ/2 updating after, and 0 < k_d < 2/Δ - k_p Δ/2
        before the output.

        Raises:
            InputError: with the limits.
        """
        if not (np.isfinite(rate) and rate > 0):
            raise InputError("a rate is positive", key="rate", value=rate)
        if hold not in HOLDS:
            raise InputError(f"hold is one of {', '.join(HOLDS)}", key="hold", value=hold)
        for axis, p, d in zip("xy", self.kp, self.kd, strict=True):
            low, high = limits(float(p), rate, hold)
            if not low < d < high:
                rule = f"at {rate:g} Hz a k_p of {p:g}/s² is stable with a k_d between {low:.4g} and {high:.4g}/s"
                if low >= high:
                    rule = f"at {rate:g} Hz no k_d makes a k_p of {p:g}/s² stable"
                raise InputError(
                    rule, key=f"k_d along {axis}", value=float(d), hint="Change the gains or the rate."
                )

    def decay(self, rate: float = np.inf, hold: Hold = "ramp") -> Array:
        """Rate at which the error's envelope shrinks along the travel, to first order in 1/rate, shape (2,) [1/s].

        Holds where the error oscillates (k_d² < 4 k_p).
        """
        loss = {"ramp": 0.5, "after": 1.0, "before": 0.0}[hold] / rate
        return np.asarray(0.5 * (self.kd - self.kp * loss))


def limits(kp: float, rate: float, hold: Hold = "ramp") -> tuple[float, float]:
    """Between which k_d [1/s] a k_p [1/s²] is stable at a rate [Hz]; see Gains.check."""
    step = 1.0 / rate
    if hold == "ramp":
        return 0.5 * kp * step, 2 / step
    if hold == "after":
        return kp * step, 2 / step + 0.5 * kp * step
    return 0.0, 2 / step - 0.5 * kp * step
