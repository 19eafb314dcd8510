"""What a plan leaves on the table: outlines at even travel, fingertips, the path of the flat point."""

from dataclasses import dataclass

import numpy as np

from ..geometry import compose, exp, transform
from ..geometry.pose import Array
from ..problem import Arc, Plan, PushSegment, Rollout, Scene, TableSegment, TransitSegment
from .timeline import Timeline, arc_starts

MOST_MARKS = 36  # more outlines than this, and none of them can be told apart
FLAT_STEP = np.deg2rad(2.0)  # between two points of the path of a flat point


@dataclass(frozen=True, eq=False)
class PushTrace:
    """One push or slide of a plan, ready to be drawn; lengths [m], in the table frame W unless it says O.

    Attributes:
        number: of the push in the plan, from 0.
        segment: the push itself.
        marks: object poses at even intervals of travel, first and last included, shape (m, 3).
        pushers: pusher poses at the same instants, shape (m, 3).
        flat_point: midpoint of the turning centres, in O; None if it is not known.
        flat_path: its path, shape (k, 2); None likewise.
        centres: turning centre and sense (+1 counter-clockwise) of each turn of the push.
        contact, normal: the (virtual) contact point and inward normal in O; None if the scene lists none.
        motion: left and right edge of the motion cone that the plan uses, in O, shape (2, 2), or None.
    """

    number: int
    segment: TableSegment
    marks: Array
    pushers: Array
    flat_point: Array | None
    flat_path: Array | None
    centres: tuple[tuple[Array, int], ...]
    contact: Array | None
    normal: Array | None
    motion: Array | None


def trace_pushes(plan: Plan) -> tuple[PushTrace, ...]:
    """The trace of every push of a plan, in order. One interval of travel holds for the whole plan."""
    reach = 0.5 * plan.scene.object.outline.size
    travels = [_travel(s.object, plan.scene.object.cof, reach) for s in plan.on_table]
    total = sum(float(t[-1]) for t in travels)
    step = interval(reach, total)
    return tuple(
        _trace(plan, number, segment, travel, step)
        for number, (segment, travel) in enumerate(zip(plan.on_table, travels, strict=True))
    )


def interval(reach: float, total: float) -> float:
    """The travel from outline to outline [m] of an object that reaches so far [m], on a path of a total travel [m]."""
    return max(0.6 * reach, total / MOST_MARKS)


def fingertips(pusher: Array, fingers: Array) -> Array:
    """Fingertip centres in W, shape (..., k, 2), of pusher poses (..., 3) and tips in E, shape (k, 2)."""
    return transform(np.asarray(pusher)[..., None, :], fingers)


def fingers_at(plan: Plan, number: int) -> Array:
    """Fingertips in E, shape (k, 2), in a segment: its own, or of the push it leads to, else of the one before."""
    segments = plan.segments
    for segment in (*segments[number:], *reversed(segments[:number])):
        if not isinstance(segment, TransitSegment):
            return segment.fingers
    return np.zeros((0, 2))


def rollout_paths(rollout: Rollout, plan: Plan, traces: tuple[PushTrace, ...]) -> list[Array]:
    """A simulated run beside the plan: paths of the same flat points, else of the centre of friction."""
    starts = [
        start for start, s in zip(Timeline.of(plan).starts, plan.segments, strict=True) if s.kind != "transit"
    ]
    paths = []
    for start, trace in zip(starts, traces, strict=True):
        during = (rollout.times >= start - 1e-9) & (rollout.times <= start + trace.segment.times[-1] + 1e-9)
        if np.count_nonzero(during) > 1:
            point = plan.scene.object.cof if trace.flat_point is None else trace.flat_point
            paths.append(transform(rollout.object[during], point))
    return paths


def orientation_mark(scene: Scene) -> Array:
    """A short line in O, shape (2, 2), from the centre of friction along O's +x: it shows the orientation."""
    start = scene.object.cof
    return start + 0.18 * scene.object.outline.size * np.array([[0.0, 0.0], [1.0, 0.0]])


def turning_centre(arc: Arc) -> Array | None:
    """The rotation centre of an arc in O, (−vy/ω, vx/ω) ([Zhou2017] Sec. 3.1, corrected) or None."""
    vx, vy, w = np.asarray(arc.twist, dtype=float)
    return None if arc.turn == "straight" or w == 0 else np.array([-vy / w, vx / w])


def _trace(plan: Plan, number: int, segment: TableSegment, travel: Array, step: float) -> PushTrace:
    intervals = max(1, round(float(travel[-1]) / step))
    wanted = np.linspace(0.0, travel[-1], intervals + 1)
    marks, pushers = (
        np.stack([np.interp(wanted, travel, column) for column in poses.T], axis=1)
        for poses in (segment.object, segment.pusher)
    )
    if not isinstance(segment, PushSegment):
        return PushTrace(number, segment, marks, pushers, None, None, (), None, None, None)
    turning = _turning_centres(plan, segment)
    flat = None if turning is None else turning.mean(axis=0)
    contact = normal = motion = None
    if plan.scene.pushes != "auto":
        for push in plan.scene.pushes:
            if push.name == segment.push:
                contact, normal = np.asarray(push.at.point), np.asarray(push.at.normal)
    if contact is not None and turning is not None:
        # A turn about c moves the contact along ±(p − c) turned by 90°; the left turn is the right edge.
        arm = contact - turning
        motion = np.stack([[arm[1, 1], -arm[1, 0]], [-arm[0, 1], arm[0, 0]]])
    poses = arc_starts(segment)
    centres = []
    for arc, pose in zip(segment.arcs, poses[:-1], strict=True):
        centre = turning_centre(arc)
        if centre is not None:
            centres.append((transform(pose, centre), 1 if arc.twist[2] > 0 else -1))
    path = None if flat is None else _path(segment, flat, poses)
    return PushTrace(number, segment, marks, pushers, flat, path, tuple(centres), contact, normal, motion)


def _turning_centres(plan: Plan, segment: PushSegment) -> Array | None:
    """Centres of left and right turn in O, shape (2, 2): the certificate's, else those of the arcs."""
    car = None if plan.certificate is None else plan.certificate.cars.get(segment.push)
    if car is not None:
        return np.array([car.left_centre, car.right_centre])
    found = {arc.turn: turning_centre(arc) for arc in segment.arcs}
    if found.get("left") is None or found.get("right") is None:
        return None
    return np.array([found["left"], found["right"]])


def _path(segment: PushSegment, point: Array, poses: list[Array]) -> Array:
    """The path of a point of the object along the arcs, from the twists themselves; one sample each FLAT_STEP."""
    pieces = [transform(poses[0], point)[None]]
    for arc, pose in zip(segment.arcs, poses[:-1], strict=True):
        twist = arc.duration * np.asarray(arc.twist, dtype=float)
        n = 1 + int(np.ceil(abs(twist[2]) / FLAT_STEP))
        s = np.arange(1, n + 1)[:, None] / n
        pieces.append(transform(compose(pose, exp(s * twist)), point))
    return np.concatenate(pieces)


def _travel(poses: Array, point: Array, reach: float) -> Array:
    """How far the object has moved at each sample [m]: the path of a point plus reach times the turn."""
    step = np.linalg.norm(np.diff(transform(poses, point), axis=0), axis=1)
    step = step + reach * np.abs(np.diff(poses[:, 2]))
    return np.concatenate([[0.0], np.cumsum(step)])
