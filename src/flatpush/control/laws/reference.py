"""Where the flat point of a push should be: the path of a plan, exactly, with its derivatives."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry import compose, cross, exp, perpendicular, relative, rotate, transform, velocity_at
from ...geometry.pose import Array
from ...problem import Arc, Pusher, PushSegment
from ...steering.time_law import Trapezoid
from .formulas import place
from .steering_model import SteeringModel

# Below this share of its largest value a flat speed counts as none.
AT_REST = 1e-3
# A plan turns as tightly as its car, the model of it by a millionth less (steering_model.EDGE).
TIGHTER = 1e-5
_SAMPLES = 4001


class FlatState(NamedTuple):
    """z, ż and z̈ in W, each of shape (2,)."""

    position: Array
    velocity: Array
    acceleration: Array


class AbstractReference(ABC):
    """A motion of the flat point for 0 ≤ t ≤ duration, twice differentiable but at junctions."""

    duration: float

    @abstractmethod
    def at(self, time: float) -> FlatState:
        """Position and derivatives at a time [s]."""


@dataclass(frozen=True, eq=False)
class PathReference(AbstractReference):
    """Arcs and lines, at a constant flat speed through the junctions (z is C¹ there, z̈ jumps) or with a time law.

    Attributes:
        table: the path, shape (n, 6), see control.laws.formulas.
        speed: of the flat point [m/s]; with a time law, its largest.
        laws: of the flat point in each piece; none: the speed is constant.

    Raises:
        InputError: for no pieces, pieces without length, a speed that is not positive, or another number of laws.
    """

    table: Array
    speed: float
    laws: tuple[Trapezoid, ...] = ()

    def __post_init__(self) -> None:
        if not (np.isfinite(self.speed) and self.speed > 0):
            raise InputError("a flat speed is positive and finite", key="speed", value=self.speed)
        if self.table.ndim != 2 or self.table.shape[1] != 6 or not len(self.table):
            raise InputError("a path has at least one piece", value=self.table.shape)
        if not np.all(np.isfinite(self.table)) or np.any(self.table[:, 1] <= 0):
            raise InputError("the pieces of a path are finite and of positive length")
        if self.laws and len(self.laws) != len(self.table):
            raise InputError("a time law for each piece is needed", key="laws", value=len(self.laws))

    @property
    def length(self) -> float:
        """Of the flat path [m]."""
        return float(self.table[-1, 0] + self.table[-1, 1])

    @property
    def duration(self) -> float:  # type: ignore[override]
        """From start to end [s]."""
        return sum(law.duration for law in self.laws) if self.laws else self.length / self.speed

    def at(self, time: float) -> FlatState:
        length, v, a = self.run(time)
        x, y, angle, bend = place(self.table, length)
        t = np.array([np.cos(angle), np.sin(angle)])
        return FlatState(np.array([x, y]), v * t, a * t + v**2 * bend * perpendicular(t))

    def run(self, time: float) -> tuple[float, float, float]:
        """Arc length [m], flat speed [m/s] and its rate [m/s²] at a time [s]."""
        if not self.laws:
            return self.speed * time, self.speed, 0.0
        k = 0
        while k + 1 < len(self.laws) and time > self.laws[k].duration:
            time -= self.laws[k].duration
            k += 1
        length, speed, rate = self.laws[k].motion(time)
        return float(self.table[k, 0]) + length, speed, rate

    def speed_from(self, length: float, dt: float) -> float:
        """Mean flat speed [m/s] of the time law in a tick of dt [s] that begins at an arc length [m]; never 0 before
        its end."""
        if not self.laws:
            return self.speed
        k = int(np.clip(np.searchsorted(self.table[:, 0], length, side="right") - 1, 0, len(self.laws) - 1))
        return self.laws[k].speed_from(length - float(self.table[k, 0]), dt)

    @classmethod
    def straight(cls, start: ArrayLike, angle: float, length: float, speed: float) -> "PathReference":
        """A line of a length [m] from `start`, a flat point (2,) [m], at an angle [rad] and a speed [m/s]."""
        x, y = np.asarray(start, dtype=float)
        return cls(np.array([[0.0, length, x, y, angle, 0.0]]), speed)

    @classmethod
    def of_push(
        cls,
        segment: PushSegment,
        model: SteeringModel,
        speed: float | None = None,
        pusher: Pusher | None = None,
        slow: float = 0.0,
    ) -> "PathReference":
        """The path of a planned push, from its arcs.

        Args:
            speed: of the flat point [m/s]; default: the mean of the plan.
            pusher: given, each arc has the plan's time law within this pusher's speed and acceleration.
            slow: the share of its speed at which the slowest arc begins and ends, as do all others; 0: at rest.

        Raises:
            InputError: where the flat point rests or reverses in an arc.
        """
        X = np.asarray(segment.object[0], dtype=float)
        rows: list[list[float]] = []
        laws: list[Trapezoid] = []
        done = 0.0
        tips = transform(relative(segment.object[0], segment.pusher[0]), segment.fingers)
        for arc in segment.arcs:
            v = velocity_at(arc.twist, model.flat_point)
            size, h = float(np.hypot(*v)), model.direction
            length = size * arc.duration
            if not np.isfinite(length) or length <= 0 or float(v @ h) <= 0.2 * size:
                raise InputError(
                    f"the flat point does not run forward in the {arc.turn} arc of this push",
                    value=float(v @ h),
                    hint="Feedback linearisation needs a flat speed > 0; follow the path, or plan anew.",
                )
            z, u = transform(X, model.flat_point), rotate(X[2], v)
            angle = float(np.arctan2(u[1], u[0]))
            rows.append([done, length, *z, angle, float(arc.twist[2]) / size])
            done += length
            X = compose(X, exp(arc.duration * arc.twist))
            if pusher is not None:
                laws.append(_law(length, arc, tips, pusher))
        if not rows:
            raise InputError("a push without arcs has no reference")
        if laws:
            begin = slow * min(law.speed for law in laws)
            laws = [replace(law, slow=begin) for law in laws]
            speed = max(law.top for law in laws)
        if speed is None:
            speed = done / float(segment.times[-1])
        return cls(np.array(rows), speed, tuple(laws))


def _law(length: float, arc: Arc, tips: Array, pusher: Pusher) -> Trapezoid:
    """The planner's time law of an arc, for the fastest of the fingertips (k, 2) in O, in the flat point's lengths."""
    fastest = float(np.max(np.hypot(*velocity_at(arc.twist, tips).T)))
    turn = abs(float(arc.twist[2]))
    law = Trapezoid.along(
        fastest * arc.duration, fastest / turn if turn > 0 else np.inf, pusher.speed, pusher.acceleration,
        pusher.turn_rate,
    )  # fmt: skip
    share = length / law.length
    return Trapezoid(length, share * law.speed, share * law.acceleration)


def check_reference(reference: AbstractReference, most: float = np.inf) -> None:
    """Refuses what feedback linearisation cannot follow: a flat speed that vanishes or reverses on the way.

    At the start and the end of the reference it may be zero.

    Args:
        most: turn per length that the push can make [1/m]; tighter references are refused.

    Raises:
        InputError: with the time at which it happens.
    """
    T = reference.duration
    if not (np.isfinite(T) and T > 0):
        raise InputError("a reference takes a positive, finite time", key="duration", value=T)
    times = np.linspace(0.0, T, _SAMPLES)
    found = [reference.at(float(t)) for t in times]
    v, a = np.array([f.velocity for f in found]), np.array([f.acceleration for f in found])
    z = np.array([f.position for f in found])
    if not (np.all(np.isfinite(v)) and np.all(np.isfinite(a)) and np.all(np.isfinite(z))):
        raise InputError("a reference is finite everywhere")
    speed = np.hypot(v[:, 0], v[:, 1])
    edge = max(1, _SAMPLES // 100)
    inner = slice(edge, -edge)
    slow = int(np.argmin(speed[inner])) + edge
    if speed[slow] <= AT_REST * speed.max():
        raise InputError(
            "the flat speed vanishes on the way", key=f"at {times[slow]:.4g} s", value=float(speed[slow]),
            hint="Split the reference there, or follow it as a path.",
        )  # fmt: skip
    ahead = np.sum(v[1:] * v[:-1], axis=1)[edge:-edge]
    if np.any(ahead < 0):
        where = int(np.argmax(ahead < 0)) + edge
        raise InputError(
            "the flat point reverses; a finger can only push", key=f"at {times[where]:.4g} s",
            value=float(ahead.min()), hint="Split the reference there and push from the other side.",
        )  # fmt: skip
    bend = np.abs(cross(v, a))[inner] / speed[inner] ** 3
    if bend.max() > most * (1 + TIGHTER):
        raise InputError(
            f"the reference turns by at most {most:.4g} per metre", value=float(bend.max()),
            hint="It is tighter than the friction cone of this push allows.",
        )  # fmt: skip


def dubins_of(lengths: Sequence[float], word: str, start: ArrayLike, radius: float) -> Array:
    """The table of a Dubins path of the flat point from (x, y, heading); lengths [m] of its three pieces."""
    x, y, angle = (float(v) for v in np.asarray(start, dtype=float))
    rows: list[list[float]] = []
    done = 0.0
    for letter, length in zip(word, lengths, strict=True):
        if length <= 1e-9:
            continue
        bend = {"L": 1 / radius, "S": 0.0, "R": -1 / radius}[letter]
        rows.append([done, float(length), x, y, angle, bend])
        x, y, angle, _ = place(np.array([[0.0, length, x, y, angle, bend]]), float(length))
        done += float(length)
    return np.array(rows)
