"""How a force through a contact turns an object whose limit surface is no ellipsoid, by the force's direction."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...geometry import perpendicular, rotate, shift_twist, velocity_at
from ...geometry.pose import Array
from ...steering.car import Car

# Directions of the force that are looked at, to either side of that to the centre of friction [rad], and how many.
_MOST, _SAMPLES = 1.2, 81
# From direction to direction, so that equal tangents have an order.
_RISE = 1e-9


@dataclass(frozen=True, eq=False)
class Turning:
    """Of the axle of diag(1, 1, 1/ρ), ρ/r beyond the centre of friction. Build with turning_of.

    With φ the angle of the force from the way to the centre of friction, the object turns about a point to the left of
    the axle's foot by -ρ / (r t(φ)); for an ellipsoid t = tan φ, and the foot moves straight ahead.

    Attributes:
        angles: φ, rising, shape (n,) [rad].
        tangents: t(φ), shape (n,).
        drifts: how far the foot moves to its left, per way ahead, shape (n,).
    """

    angles: Array
    tangents: Array
    drifts: Array

    def tangent(self, angle: float) -> float:
        """t of a force's direction [rad]."""
        return float(np.interp(angle, self.angles, self.tangents))

    def angle(self, tangent: float | Array, near: float) -> Array:
        """The force's direction [rad] of each t; where several have it (a foot stands still, or nearly so), the one
        nearest to another direction."""
        first, last = self._ends
        t = np.asarray(tangent, dtype=float)
        low, high = np.interp(t, first, self.angles), np.interp(t, last, self.angles)
        return np.clip(near, low, high)

    def drift(self, tangent: float | Array, near: float) -> Array:
        """Of the foot, to its left, per way ahead, of each t; see angle."""
        return np.interp(self.angle(tangent, near), self.angles, self.drifts)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """The tangents made to rise: what is found in them is the first direction, or the last, with a t."""
        rise = _RISE * np.arange(len(self.angles))
        first = np.maximum.accumulate(self.tangents)
        last = np.minimum.accumulate(self.tangents[::-1])[::-1]
        return first + rise, last - rise[::-1]


def turning_of(car: Car, rho: float) -> Turning:
    """Of the contact of a car, forces beyond its friction cone included.

    Args:
        rho: ρ of the axle [m²].
    """
    to = -car.contact.point
    r = float(np.hypot(*to))
    h = to / r
    foot = car.cof + rho / r * h
    angles, tangents, drifts = [], [], []
    for angle in np.linspace(-_MOST, _MOST, _SAMPLES):
        V = shift_twist(car.surface.twist(car.contact.wrench(rotate(angle, h))), -car.cof)
        v = velocity_at(V, foot)
        ahead = float(v @ h)
        if ahead > 0:
            angles.append(float(angle))
            tangents.append(-rho / r * float(V[2]) / ahead)
            drifts.append(float(perpendicular(h) @ v) / ahead)
    return Turning(np.array(angles), np.array(tangents), np.array(drifts))


def axle_of(car: Car) -> float:
    """ρ such that the axle of diag(1, 1, 1/ρ) goes through the flat point of a car [m²]."""
    to = -car.contact.point
    return float((car.flat_point - car.cof) @ to)
