"""Where object and pusher are at every instant of a plan."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import compose, exp
from ..geometry.pose import Array
from ..problem import Plan, PushSegment, SlideSegment, TransitSegment


@dataclass(frozen=True, eq=False)
class Timeline:
    """The samples of all segments in one row; the object rests while the pusher moves alone.

    Where two segments meet both samples are kept, at the same time, so that nothing is interpolated across.

    Attributes:
        times: [s] from the start of the plan, shape (n,), never decreasing.
        object, pusher: poses X_WO and X_WE, shape (n, 3).
        height: of the pusher above the table [m], shape (n,).
        segment: number of the segment in the plan, shape (n,).
        starts: time at which each segment starts [s].
        moves: whether there is a pusher to draw (a plan without segments has none).
    """

    times: Array
    object: Array
    pusher: Array
    height: Array
    segment: NDArray[np.int64]
    starts: tuple[float, ...]
    moves: bool

    @classmethod
    def of(cls, plan: Plan) -> "Timeline":
        """The timeline of a plan; one sample at the start if it has no segments."""
        pose, now = plan.scene.start_pose, 0.0
        times, objects, pushers, heights, numbers, starts = [], [], [], [], [], []
        for number, segment in enumerate(plan.segments):
            n = len(segment.times)
            if not isinstance(segment, TransitSegment):
                objects.append(segment.object)
                heights.append(np.zeros(n))
            else:
                objects.append(np.tile(pose, (n, 1)))
                heights.append(segment.height)
            times.append(segment.times + now)
            pushers.append(segment.pusher)
            numbers.append(np.full(n, number))
            starts.append(now)
            now, pose = float(times[-1][-1]), objects[-1][-1]
        if not times:
            nowhere = np.full((1, 3), np.nan)
            one = np.zeros(1)
            return cls(one, pose[None].copy(), nowhere, one, np.zeros(1, dtype=np.int64), (), False)
        parts = (times, objects, pushers, heights)
        time, thing, pusher, height = (np.concatenate(part) for part in parts)
        return cls(time, thing, pusher, height, np.concatenate(numbers), tuple(starts), True)

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    def at(self, time: float) -> tuple[Array, Array, float, int]:
        """Object pose, pusher pose, height and number of the segment at a time [s], held within the plan."""
        t = min(max(time, 0.0), self.duration)
        after = min(int(np.searchsorted(self.times, t, side="right")), len(self.times) - 1)
        before = max(after - 1, 0)
        span = self.times[after] - self.times[before]
        s = (t - self.times[before]) / span if span > 0 else 1.0
        pose, pusher, height = (
            (1 - s) * values[before] + s * values[after] for values in (self.object, self.pusher, self.height)
        )
        return pose, pusher, float(height), int(self.segment[after])


def arc_starts(segment: PushSegment) -> list[Array]:
    """The object's pose X_WO at the start of each arc, and at the end of the last."""
    poses = [np.asarray(segment.object[0], dtype=float)]
    for arc in segment.arcs:
        poses.append(compose(poses[-1], exp(arc.duration * np.asarray(arc.twist))))
    return poses


def doing(plan: Plan, timeline: Timeline, time: float) -> str:
    """What goes on at a time, in words."""
    if not timeline.moves:
        return "at rest"
    _, _, height, number = timeline.at(time)
    segment = plan.segments[number]
    if isinstance(segment, SlideSegment):
        return f"push “{segment.push}”, whatever the contact does"
    if not isinstance(segment, PushSegment):
        return "pusher lifted" if height > 1e-6 else "pusher alone"
    left = time - timeline.starts[number]
    for arc in segment.arcs:
        left -= arc.duration
        if left <= 0:
            break
    else:
        arc = segment.arcs[-1]
    how = "straight" if arc.turn == "straight" else f"turning {arc.turn}"
    return f"push “{segment.push}”, {how}"
