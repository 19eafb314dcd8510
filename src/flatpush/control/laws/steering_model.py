"""What a controller knows of a push that sticks: its flat point, its heading and how tightly it turns."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry import cross, perpendicular, rotate, shift_twist, velocity_at
from ...geometry.pose import Array
from ...steering.car import Car
from ...steering.flat import FlatOutput
from ..learning.belief import SteeringEstimate
from .formulas import flat_motion

# Turns per length at which the drift is computed; for each, steps of the force's angle, and what is exact enough, as a
# part of the whole range of turns.
_SAMPLES, _STEPS, _EXACT = 21, 40, 1e-12
# The same for two fingers, where they cost nothing.
_FINE = 801
# The edges of a friction cone themselves belong to sliding.
EDGE = 1 - 1e-6


@dataclass(frozen=True, eq=False)
class SteeringModel:
    """A push as its flat output, in the object frame O. Build with of_car, of_flat, or about() an estimate.

    A finger that sticks makes the flat point run at s > 0 along the heading while the object turns at any ω within
    -right ≤ ω/s ≤ left; what the pusher must do for that is the rigid motion of its place on the object.

    Attributes:
        flat_point: shape (2,) [m].
        heading: from O's +x to the way the flat point moves [rad].
        left, right: most turn per length to either side, what the friction cone allows [1/m].
        contact: the contact point, shape (2,).
        pusher: X_OE while it sticks, shape (3,).
        turns: whether the pusher turns with the object; if not, its round finger rolls on it.
        drift: how far the flat point moves to its left, per length along the heading, at turns per length evenly from
            -right to left, shape (n,): zero for an ellipsoidal limit surface, on which flatness is exact.

    Raises:
        InputError: for points that are not finite, a model that does not turn to both sides, and a flat point that is
            not ahead of the contact.
    """

    flat_point: Array
    heading: float
    left: float
    right: float
    contact: Array
    pusher: Array
    turns: bool = True
    drift: Array | None = None

    def __post_init__(self) -> None:
        for name, size in (("flat_point", 2), ("contact", 2), ("pusher", 3)):
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != (size,) or not np.all(np.isfinite(value)):
                raise InputError(f"{size} finite numbers are needed", key=name, value=getattr(self, name))
            object.__setattr__(self, name, value)
        if not (np.isfinite(self.heading) and 0 < self.left < np.inf and 0 < self.right < np.inf):
            raise InputError(
                "a model has a finite heading and turns to both sides",
                value=(self.heading, self.left, self.right),
            )
        d = self.flat_point - self.contact
        if float(d @ self.direction) <= 0:
            raise InputError("the flat point lies ahead of the contact", value=self.flat_point)

    @classmethod
    def of_car(cls, car: Car, turns: bool = True, whole: Car | None = None) -> "SteeringModel":
        """Of a car; its flat point is the midpoint of the turning centres, and its heading is across them.

        Args:
            whole: the car of the same push without a margin, whose turns are the limits; default: the car itself.
        """
        span = car.left_centre - car.right_centre
        across = -perpendicular(span)
        angle = float(np.arctan2(across[1], across[0]))
        full = car if whole is None else whole
        h = np.array([np.cos(angle), np.sin(angle)])
        n = perpendicular(h)
        left, right = (
            float((full.left_centre - car.flat_point) @ n),
            float((car.flat_point - full.right_centre) @ n),
        )
        kappas = np.linspace(-EDGE / right, EDGE / left, _SAMPLES)
        drift = np.zeros(_SAMPLES)
        for k, kappa in enumerate(kappas):
            # Twists of the whole car, per length of its own flat point; of ours, along our heading.
            v = velocity_at(_twist(full, car.flat_point, h, float(kappa)), car.flat_point)
            drift[k] = float(v @ n) / float(v @ h)
        contact = car.contact.point + car.cof
        return cls(car.flat_point, angle, EDGE / left, EDGE / right, contact, car.pusher, turns, drift)

    @classmethod
    def of_two(cls, car: Car, wide: Car) -> "SteeringModel":
        """Of two fingers that carry the object: every twist of it is a mixture of twists of the two cars.

        Args:
            car: as planned. wide: of the same push with a smaller margin, whose turns are the limits.
        """
        span = car.left_centre - car.right_centre
        across = -perpendicular(span)
        angle = float(np.arctan2(across[1], across[0]))
        h, z = np.array([np.cos(angle), np.sin(angle)]), car.flat_point
        n = perpendicular(h)
        turns, drifts = [], []
        for V in (wide.right, car.right, car.straight, car.left, wide.left):
            # Per length along the heading turn and drift of a mixture are the same mixture of turns and drifts.
            v = velocity_at(V, z)
            turns.append(float(V[2]) / float(v @ h))
            drifts.append(float(v @ n) / float(v @ h))
        left, right = EDGE * max(turns), -EDGE * min(turns)
        order = np.argsort(turns)
        curvatures = np.linspace(-right, left, _FINE)
        drift = np.interp(curvatures, np.array(turns)[order], np.array(drifts)[order])
        return cls(z, angle, left, right, car.contact.point + car.cof, car.pusher, True, drift)

    @classmethod
    def of_flat(
        cls, flat: FlatOutput, pusher: ArrayLike | None = None, turns: bool = True
    ) -> "SteeringModel":
        """Of a flat output; the contact's frame is O, or the pusher stands at the contact."""
        p, n = flat.contact.point, flat.contact.normal
        stands = np.array([*p, np.arctan2(n[1], n[0])]) if pusher is None else pusher
        left, right = flat.along - flat.c_right, flat.c_left - flat.along
        return cls(
            flat.flat_point, flat.heading_offset, 1 / left, 1 / right, p, np.asarray(stands, float), turns
        )

    @property
    def direction(self) -> Array:
        """h in O, shape (2,)."""
        return np.array([np.cos(self.heading), np.sin(self.heading)])

    @property
    def arm(self) -> Array:
        """From the flat point to what the pusher moves: its own origin, or the contact where it rolls; in O (2,)."""
        return (self.pusher[:2] if self.turns else self.contact) - self.flat_point

    def about(self, estimate: SteeringEstimate) -> "SteeringModel":
        """The same push by an estimate in O: the flat point moves to the new axle, ahead of the contact as before."""
        axle = estimate.axle(self.contact)
        h = axle.heading
        c = float(cross(self.flat_point - self.contact, self.direction))  # to the right
        point = self.contact + axle.offset * h - c * perpendicular(h)
        return replace(self, flat_point=point, heading=float(np.arctan2(h[1], h[0])))

    @cached_property
    def _drifts(self) -> list[float]:
        return [] if self.drift is None else [float(x) for x in np.asarray(self.drift).tolist()]

    @cached_property
    def _numbers(self) -> tuple[float, ...]:
        """h, the arm and the flat point as plain numbers: a control step is made of few of numpy's."""
        h, r, z = self.direction, self.arm, self.flat_point
        return float(h[0]), float(h[1]), float(r[0]), float(r[1]), float(z[0]), float(z[1])

    def motion(self, ux: float, uy: float) -> tuple[float, float]:
        """Flat speed [m/s] and ω [rad/s] of the object under a velocity (ux, uy) in O [m/s] of the pusher (where it
        turns) or the contact."""
        hx, hy, rx, ry, _, _ = self._numbers
        across = 0.0
        for _ in range(1 if self.drift is None else 3):
            speed, omega = flat_motion(hx, hy, rx, ry, ux + across * hy, uy - across * hx)
            across = self.across(speed, omega)
        return speed, omega

    def moved(
        self, x: float, y: float, turn: float, ux: float, uy: float, dt: float
    ) -> tuple[float, float, float]:
        """X_WO, from (x, y, turn), after a time dt [s] in which the pusher goes straight with a velocity (ux, uy) in W
        [m/s] and the contact sticks."""
        hx, hy, _, _, zx, zy = self._numbers
        middle, speed, omega = turn, 0.0, 0.0
        for _ in range(2):  # the second time with the heading of the middle of the stretch
            c, d = math.cos(middle), math.sin(middle)
            speed, omega = self.motion(c * ux + d * uy, c * uy - d * ux)
            middle = turn + 0.5 * omega * dt
        # The flat point's chord, then O about it.
        half = 0.5 * omega * dt
        chord = dt * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        across = self.across(speed, omega)
        vx, vy = chord * (speed * hx - across * hy), chord * (speed * hy + across * hx)
        c, d = math.cos(middle), math.sin(middle)
        px, py = c * vx - d * vy, d * vx + c * vy
        c, d = math.cos(turn), math.sin(turn)
        px, py, turn = px + c * zx - d * zy, py + d * zx + c * zy, turn + omega * dt
        c, d = math.cos(turn), math.sin(turn)
        return x + px - c * zx + d * zy, y + py - d * zx - c * zy, turn

    def across(self, speed: float, omega: float) -> float:
        """Speed of the flat point to its left [m/s], of a flat speed [m/s] and omega [rad/s]; see drift."""
        d = self._drifts
        if not d or speed <= 0:
            return 0.0
        last = len(d) - 1
        place = (omega / speed + self.right) / (self.left + self.right) * last
        place = 0.0 if place < 0 else place if place < last else last - 1e-6
        k = int(place)
        return speed * (d[k] + (place - k) * (d[k + 1] - d[k]))

    def twist(self, speed: float, omega: float) -> Array:
        """Body twist in O, shape (3,), for a flat speed [m/s] and omega [rad/s]."""
        h = self.direction
        v = speed * h + self.across(speed, omega) * perpendicular(h)
        return np.array([*(v - omega * perpendicular(self.flat_point)), omega])

    def flat_of(self, pose: ArrayLike) -> tuple[float, float, float]:
        """Flat point x, y and heading in W at a pose X_WO."""
        x, y, turn = (float(v) for v in np.asarray(pose, dtype=float))
        _, _, _, _, zx, zy = self._numbers
        c, d = math.cos(turn), math.sin(turn)
        return x + c * zx - d * zy, y + d * zx + c * zy, turn + self.heading


def _twist(car: Car, point: Array, h: Array, kappa: float) -> Array:
    """The sticking twist in O whose turn, per length of a point along h, is kappa: by the Illinois rule."""

    def at(angle: float) -> tuple[Array, float]:
        wrench = car.contact.wrench(rotate(angle, car.contact.normal))
        V = shift_twist(car.surface.twist(wrench), -car.cof)
        return V, float(V[2]) / float(velocity_at(V, point) @ h) - kappa

    before, _, here = car.contact.force_angles(car.forces)
    (_, over), (V, off) = at(before), at(here)
    least = _EXACT * (abs(over) + abs(off))
    for _ in range(_STEPS):
        angle = here - off * (here - before) / (off - over)
        V, value = at(angle)
        if abs(value) <= least:
            break
        # The end that stays counts half, so that both ends move.
        before, over = (before, 0.5 * over) if (value < 0) == (off < 0) else (here, off)
        here, off = angle, value
    return V
