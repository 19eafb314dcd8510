"""A plan as a sequence of short motions of the object and the pusher, as the plan means them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from ..geometry import compose, exp, pose_error, relative, wrap_angle
from ..geometry.pose import Array
from ..problem import PushSegment, Segment, TableSegment, TransitSegment

Source = Literal["arcs", "samples"]


@dataclass(frozen=True, eq=False)
class Piece:
    """One motion between two samples.

    Attributes:
        time, duration: from the start of the plan [s].
        object, object_step: X_WO at its start, and the displacement's body twist; on "samples" a step in W.
        pusher, pusher_step: X_WE and its displacement, alike.
        body: whether the steps are body twists (exact arcs), or straight steps (x, y, θ) in W.
        push: index of the push or slide among Plan.on_table, or None in a transit.
        lifted: whether the pusher is off the table during all or part of it.
        height: the least height of the fingertips in it [m].
    """

    time: float
    duration: float
    object: Array
    object_step: Array
    pusher: Array
    pusher_step: Array
    body: bool
    push: int | None
    lifted: bool
    height: float = 0.0

    def pusher_at(self, fraction: float) -> Array:
        """X_WE as planned, at a fraction of the piece."""
        if self.body:
            return compose(self.pusher, exp(fraction * self.pusher_step))
        return self.pusher + fraction * self.pusher_step

    def pusher_velocity(self, fraction: float) -> Array:
        """Velocity (x, y) of E's origin in W and its yaw rate, per whole piece, shape (3,)."""
        if not self.body:
            return self.pusher_step
        theta = self.pusher[2] + fraction * self.pusher_step[2]
        c, s = np.cos(theta), np.sin(theta)
        vx, vy, w = self.pusher_step
        return np.array([c * vx - s * vy, s * vx + c * vy, w])


def pieces(segments: Sequence[Segment], start: Array, source: Source = "arcs") -> Iterator[Piece]:
    """The pieces of a plan in order.

    Args:
        start: X_WO where the first push finds the object.
        source: "arcs" takes each piece from the arcs' twists, exactly; "samples" goes straight from sample to sample,
            as a robot controller does. Slides have samples only, and pushes whose pusher does not turn with the object.
    """
    clock, resting, push = 0.0, np.asarray(start, dtype=float), -1
    for segment in segments:
        t = segment.times
        if isinstance(segment, TransitSegment):
            for i in range(len(t) - 1):
                step = pose_error(segment.pusher[i + 1], segment.pusher[i])
                lifted = bool(max(segment.height[i], segment.height[i + 1]) > 0)
                yield Piece(
                    clock + t[i],
                    t[i + 1] - t[i],
                    resting,
                    np.zeros(3),
                    segment.pusher[i],
                    step,
                    False,
                    None,
                    lifted,
                    float(min(segment.height[i], segment.height[i + 1])),
                )
        else:
            push += 1
            steps, arcs = _from_samples(segment), False
            if isinstance(segment, PushSegment) and source == "arcs" and turns_along(segment):
                steps, arcs = _from_arcs(segment), True
            for i, (object_, object_step, pusher, pusher_step) in enumerate(steps):
                yield Piece(
                    clock + t[i],
                    t[i + 1] - t[i],
                    object_,
                    object_step,
                    pusher,
                    pusher_step,
                    arcs,
                    push,
                    False,
                )
            resting = segment.object[-1]
        clock += float(t[-1]) if len(t) else 0.0


def turns_along(segment: PushSegment) -> bool:
    """Whether the pusher keeps its pose on the object, so that the arcs say all."""
    drift = wrap_angle(segment.pusher[:, 2] - segment.object[:, 2])
    return bool(np.all(np.abs(wrap_angle(drift - drift[0])) < 1e-6))


def _from_samples(segment: TableSegment) -> Iterator[tuple[Array, Array, Array, Array]]:
    for i in range(len(segment.times) - 1):
        yield (
            segment.object[i],
            pose_error(segment.object[i + 1], segment.object[i]),
            segment.pusher[i],
            pose_error(segment.pusher[i + 1], segment.pusher[i]),
        )


def _from_arcs(segment: PushSegment) -> Iterator[tuple[Array, Array, Array, Array]]:
    X_OE = relative(segment.object[0], segment.pusher[0])
    for arc, low, high in progress(segment):
        X = arc_pose(segment, arc, low)
        twist = segment.arcs[arc].twist * segment.arcs[arc].duration
        step = (high - low) * twist
        yield X, step, compose(X, X_OE), _in_frame(step, X_OE)


def arc_pose(segment: PushSegment, arc: int, fraction: float) -> Array:
    """X_WO at a fraction of an arc, by the twists alone."""
    X = segment.object[0]
    for previous in segment.arcs[:arc]:
        X = compose(X, exp(previous.twist * previous.duration))
    return compose(X, exp(fraction * segment.arcs[arc].twist * segment.arcs[arc].duration))


def progress(segment: PushSegment) -> list[tuple[int, float, float]]:
    """For each pair of neighbouring samples: the arc they lie on and the fractions of it at which they lie."""
    ends = np.cumsum([arc.duration for arc in segment.arcs])
    starts = np.concatenate([[0.0], ends[:-1]])
    # Where each arc starts among the samples: the samples at the junctions are part of every plan.
    first = [int(np.argmin(np.abs(segment.times - s))) for s in starts] + [len(segment.times) - 1]
    found = []
    for k, arc in enumerate(segment.arcs):
        i, j = first[k], first[k + 1]
        if arc.twist[2] != 0:
            travelled = segment.object[i : j + 1, 2] - segment.object[i, 2]
        else:
            travelled = np.linalg.norm(segment.object[i : j + 1, :2] - segment.object[i, :2], axis=1)
        fractions = travelled / travelled[-1] if travelled[-1] != 0 else np.linspace(0, 1, j - i + 1)
        found += [(k, float(a), float(b)) for a, b in pairwise(fractions)]
    return found


def _in_frame(twist: Array, X_OE: Array) -> Array:
    """A body twist in O as a body twist of the rigidly attached frame E."""
    c, s = np.cos(X_OE[2]), np.sin(X_OE[2])
    vx = twist[0] - twist[2] * X_OE[1]
    vy = twist[1] + twist[2] * X_OE[0]
    return np.array([c * vx + s * vy, -s * vx + c * vy, twist[2]])
