"""Whether what a robot will execute, straight from sample to sample, is what was proved and within the limits.

Yaw is taken as it stands, never wrapped: a robot that goes straight from sample to sample makes every turn that is in
the file. Each segment starts and ends at rest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..contact import Placement, WrenchCone
from ..contact.cone_twists import MISSED
from ..geometry import compose, exp, pose_error, relative, rotate, shift_twist, transform
from ..geometry.pose import Array
from ..problem import PushSegment, Scene, Segment, SlideSegment, TableSegment, TransitSegment
from ..problem.mechanics import contacts_of, named, placement_of, surface_at, takes_cone, virtual_contact
from .pieces import progress, turns_along
from .plant import Plant
from .slides import beside, plant_of_slides, rolled_out

# Straight interpolation stays so near the arcs [m, rad].
SAMPLING, SAMPLING_ANGLE = 5e-5, float(np.deg2rad(0.05))
# Places agree to so much where one motion follows another [m, rad]; documents hold all digits.
SAME = 1e-9
# A slide rolled out again: other processors round a little differently [m, rad].
ROLLED = 1e-6
# A limit may be passed by this part, and by what the rounding of places (in parts of their size) makes of it.
SLACK, ROUNDING = 1e-6, 1e-15
# Velocities change from step to step of so much time at least [s].
BRIEF = 1e-9
# Between samples the hand is looked at after every turn of so much [rad]: for what is in the way, and for how fast the
# fingertips are, where a step of so little turn counts by its ends.
TURN, CHORD = 0.02, 0.5
MM, DEGREES = 1e3, 180 / np.pi


@dataclass(frozen=True)
class Finding:
    """The worst of one thing in a plan.

    Attributes:
        name: what was looked at.
        value, limit: in `unit`; it holds where value ≤ limit.
        where: the segment and the sample.
    """

    name: str
    value: float
    limit: float
    unit: str
    where: str

    @property
    def ok(self) -> bool:
        return bool(self.value <= self.limit)


def execution_findings(scene: Scene, segments: Sequence[Segment]) -> tuple[Finding, ...]:
    """The worst of each thing that the execution of a plan must keep, in mm, degrees and seconds.

    Raises:
        FlatpushError: for a push that the scene does not list or whose fingers do not fit.
    """
    worst: dict[str, Finding] = {}
    for finding in _findings(scene, segments):
        known = worst.get(finding.name)
        # Not a number counts as worst of all.
        if known is None or not finding.value - finding.limit <= known.value - known.limit:
            worst[finding.name] = finding
    return tuple(worst.values())


def _findings(scene: Scene, segments: Sequence[Segment]) -> Iterator[Finding]:
    yield from _order(segments)
    pose = scene.start_pose
    yield from _wound(_on_table(segments)[:1], pose)
    placements = {
        s.push: placement_of(scene, named(scene, s.push)) for s in segments if isinstance(s, PushSegment)
    }
    slides = any(isinstance(s, SlideSegment) for s in segments)
    plant = plant_of_slides(scene) if slides else None
    for k, segment in enumerate(segments):
        label = f"segment {k} ({segment.kind})"
        if k > 0:
            yield from _joint(segments[k - 1], segment, label)
        yield _clock(segment, label)
        if isinstance(segment, PushSegment):
            yield from _starts(segment, pose, label)
            yield from _held(scene, segment, placements[segment.push], label)
            yield from _follows(segment, label)
            if takes_cone(scene, len(segment.fingers)):
                yield _kept(scene, segment, placements[segment.push], label)
            for arc in segment.arcs:
                pose = compose(pose, exp(arc.duration * arc.twist))
            hands = [segment.fingers]
        elif isinstance(segment, SlideSegment):
            assert plant is not None
            yield from _starts(segment, pose, label)
            never = scene.pusher.fingers != 1 or scene.planning.slides == "never"
            yield Finding("slides where the scene has none", float(never), 0.0, "", label)
            yield from _slides(plant, segment, label)
            pose = segment.object[-1]
            hands = [segment.fingers]
        else:
            hands = [s.fingers for s in _neighbours(segments, k)]
            yield _turned(segment, label)
            yield from _heights(scene, segment, label)
            for hand in hands:
                yield from _free(scene, segment, pose, hand, label)
        for hand in hands:
            yield from _limits(scene, segment, hand, label)


def _on_table(segments: Sequence[Segment]) -> list[TableSegment]:
    return [s for s in segments if not isinstance(s, TransitSegment)]


def _neighbours(segments: Sequence[Segment], k: int) -> list[TableSegment]:
    """The pushes or slides before and after a transit."""
    return [*_on_table(segments[:k])[-1:], *_on_table(segments[k:])[:1]]


def _order(segments: Sequence[Segment]) -> Iterator[Finding]:
    kinds = [s.kind for s in segments]
    missing = 0 if not kinds else (kinds[0] != "transit") + (kinds[-1] != "transit")
    yield Finding("first and last transit missing", missing, 0, "", "the plan's ends")
    alone = bool(kinds) and not _on_table(segments)
    yield Finding("transits without a push", float(alone), 0.0, "", "the plan")
    for k, (a, b) in enumerate(pairwise(segments)):
        if not isinstance(a, TransitSegment) and not isinstance(b, TransitSegment):
            yield Finding(
                "changes of push without a transit", float(a.push != b.push), 0, "", f"segment {k + 1}"
            )


def _wound(first: Sequence[TableSegment], pose: Array) -> Iterator[Finding]:
    """The yaw of the first push is within half a turn of the object's: later ones follow from it without a jump."""
    for push in first:
        away = DEGREES * abs(float(push.pusher[0, 2] - pose[2]))
        yield Finding("yaw at the start is turns away", away, 180 + DEGREES * SAME, "°", "the first push")


def _turned(segment: TransitSegment, label: str) -> Finding:
    """Between two poses a hand needs half a turn at most."""
    turn = DEGREES * float(np.sum(np.abs(np.diff(segment.pusher[:, 2]))))
    return Finding("turns that are not needed", turn, 180 + DEGREES * SAME, "°", label)


def _joint(before: Segment, after: Segment, label: str) -> Iterator[Finding]:
    step = np.abs(after.pusher[0] - before.pusher[-1])
    where = f"{label}, sample 0"
    yield Finding(
        "jump of the pusher between segments", MM * float(np.hypot(*step[:2])), MM * SAME, "mm", where
    )
    yield Finding("jump of yaw between segments", DEGREES * float(step[2]), DEGREES * SAME, "°", where)
    rise = abs(float(_height(after)[0] - _height(before)[-1]))
    yield Finding("jump of height between segments", MM * rise, MM * SAME, "mm", where)


def _height(segment: Segment) -> Array:
    return segment.height if isinstance(segment, TransitSegment) else np.zeros(len(segment.times))


def _clock(segment: Segment, label: str) -> Finding:
    back = -np.diff(segment.times)
    return Finding("step back in time", *_most(back, "s", 0.0, label))


def _starts(segment: TableSegment, pose: Array, label: str) -> Iterator[Finding]:
    # The angle as it stands: the object makes no turn between pushes.
    error = np.abs(segment.object[0] - pose)
    where = f"{label}, sample 0"
    yield Finding(
        "push starts beside where the object is", MM * float(np.hypot(*error[:2])), MM * SAME, "mm", where
    )
    yield Finding(
        "push starts turned from how the object is", DEGREES * float(error[2]), DEGREES * SAME, "°", where
    )


def _held(scene: Scene, segment: PushSegment, placement: Placement, label: str) -> Iterator[Finding]:
    """The fingertips stand where their push says, or roll along the outline."""
    tips = transform(placement.pose, segment.fingers)
    apart = (
        float(np.max(np.abs(tips - placement.tips))) if tips.shape == placement.tips.shape else float("inf")
    )
    yield Finding("fingertips beside their places", MM * apart, MM * SAME, "mm", label)
    on = relative(segment.object, segment.pusher)
    if turns_along(segment):
        error = np.abs(pose_error(on, placement.pose))
        yield Finding(
            "pusher moves on the object", *_most(MM * np.hypot(*error[:, :2].T), "mm", MM * SAME, label)
        )
        yield Finding("pusher turns on the object", *_most(DEGREES * error[:, 2], "°", DEGREES * SAME, label))
        return
    outline, radius = scene.object.outline, scene.pusher.tip_radius
    between = relative(_halfway(segment.object), _halfway(segment.pusher))
    for name, poses, near in (("samples", on, SAME), ("between samples", between, SAMPLING)):
        gaps = np.array([abs(outline.nearest(X[:2]).distance - radius) for X in poses])
        yield Finding(f"rolling fingertip off the outline, {name}", *_most(MM * gaps, "mm", MM * near, label))


def _kept(scene: Scene, segment: PushSegment, placement: Placement, label: str) -> Finding:
    """Two fingers that go straight from sample to sample turn the object about points beside those of its arcs.

    At both ends of every step, under the model that was planned with; how far its wrench misses the fingers' cone.
    """
    surface = surface_at(scene, virtual_contact(scene, placement))
    cone, x = WrenchCone.of(contacts_of(scene, placement)), placement.pose
    steps = np.diff(segment.pusher, axis=0)
    least = np.ones(len(steps))
    for yaw in (segment.pusher[:-1, 2], segment.pusher[1:, 2]):
        at_hand = np.column_stack([rotate(x[2] - yaw, steps[:, :2]), steps[:, 2]])
        moves = np.flatnonzero(np.any(at_hand != 0, axis=1))
        twists = shift_twist(at_hand[moves], scene.object.cof - x[:2])
        depths = cone.depth(surface.wrench(twists))
        for k in np.flatnonzero(
            (depths < 0) & surface.has_facets
        ):  # a turn just about a foot has many wrenches
            depths[k] = cone.depths(surface.wrench_set(twists[k]))[1]
        least[moves] = np.minimum(least[moves], depths)
    missed = DEGREES * np.maximum(np.arcsin(np.clip(-least, -1, 1)), 0.0)
    return Finding("force of two fingers outside their cone", *_most(missed, "°", DEGREES * MISSED, label))


def _slides(plant: Plant, segment: SlideSegment, label: str) -> Iterator[Finding]:
    """The plant, from where the slide begins, goes through its samples, and straight lines between stay near."""
    apart = float(np.max(np.abs(segment.fingers)))
    yield Finding("fingertips beside their places", MM * apart, MM * SAME, "mm", label)
    begin, between = segment.object[0], np.empty((2 * len(segment.times) - 1, 3))
    between[::2], between[1::2] = segment.pusher, _halfway(segment.pusher)
    again, finer = rolled_out(plant, begin, segment.pusher), rolled_out(plant, begin, between)
    yield Finding("slide that the simulator does not finish", float(again.outcome != ""), 0.0, "", label)
    end = np.abs(segment.end - segment.object[-1])
    yield Finding("slide ends beside what it predicts", MM * float(np.max(end)), MM * SAME, "mm", label)
    straight = between.copy()
    straight[::2], straight[1::2] = segment.object, _halfway(segment.object)
    for what, run, poses, near, near_angle in (
        ("samples beside the slide", again, segment.object, ROLLED, ROLLED),
        ("straight lines between samples beside the slide", finer, straight, SAMPLING, SAMPLING_ANGLE),
    ):
        far, turned = beside(run, poses)
        yield Finding(what, *_most(MM * far, "mm", MM * near, label))
        yield Finding(f"{what}, turn", *_most(DEGREES * turned, "°", DEGREES * near_angle, label))


def _halfway(poses: Array) -> Array:
    return 0.5 * (poses[:-1] + poses[1:])


def _follows(segment: PushSegment, label: str) -> Iterator[Finding]:
    """Samples lie on the arcs, and straight lines between them stay near."""
    if not segment.arcs or len(segment.times) < 2:
        yield Finding("pushes without arcs or samples", 1.0, 0.0, "", label)
        return
    starts = [np.asarray(segment.object[0], dtype=float)]
    for arc in segment.arcs:
        starts.append(compose(starts[-1], exp(arc.duration * arc.twist)))
    end = np.abs(segment.object[-1] - starts[-1])
    where = f"{label}, sample {len(segment.times) - 1}"
    yield Finding("push ends beside its arcs", MM * float(np.hypot(*end[:2])), MM * SAME, "mm", where)
    yield Finding("push ends turned from its arcs", DEGREES * float(end[2]), DEGREES * SAME, "°", where)
    if not turns_along(segment):
        return
    listed = progress(segment)
    at = np.array([arc for arc, _, _ in listed])
    low, high = (np.array([part[i] for part in listed]) for i in (1, 2))
    steps = np.array([arc.duration * np.asarray(arc.twist) for arc in segment.arcs])
    on = segment.object, segment.pusher
    X_OE = relative(segment.object[0], segment.pusher[0])
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        exact = compose(np.array(starts)[at], exp((low + share * (high - low))[:, None] * steps[at]))
        ends = share in (0.0, 1.0)
        for name, poses, target in zip(("object", "pusher"), on, (exact, compose(exact, X_OE)), strict=True):
            straight = (1 - share) * poses[:-1] + share * poses[1:]
            error = np.abs(straight - target)
            far, turned = MM * np.hypot(*error[:, :2].T), DEGREES * error[:, 2]
            near, near_angle = (SAME, SAME) if ends else (SAMPLING, SAMPLING_ANGLE)
            what = "samples beside their arc" if ends else "straight lines between samples beside their arc"
            yield Finding(f"{name}: {what}", *_most(far, "mm", MM * near, label))
            yield Finding(f"{name}: {what}, turn", *_most(turned, "°", DEGREES * near_angle, label))


def _most(values: Array, unit: str, limit: float, label: str) -> tuple[float, float, str, str]:
    """Value, limit, unit and place of the worst of a list, one entry for each sample or step."""
    if len(values) == 0:
        return 0.0, limit, unit, label
    k = int(np.argmax(np.where(np.isnan(values), np.inf, values)))
    return float(values[k]), limit, unit, f"{label}, sample {k}"


def _heights(scene: Scene, segment: TransitSegment, label: str) -> Iterator[Finding]:
    """On the table or above, and sideways only on it or at the full height."""
    h, lift = segment.height, scene.pusher.lift
    yield Finding("height below the table", *_most(-MM * h, "mm", 0.0, label))
    yield Finding("height above the lift", *_most(MM * h, "mm", MM * (lift + SAME), label))
    step = np.abs(np.diff(segment.pusher, axis=0))
    low, high = np.minimum(h[:-1], h[1:]), np.maximum(h[:-1], h[1:])
    between = (high > 0) & (low < lift - SAME)
    aside = np.where(between, np.hypot(step[:, 0], step[:, 1]), 0.0)
    turned = np.where(between, step[:, 2], 0.0)
    yield Finding("sideways on the way up or down", *_most(MM * aside, "mm", MM * SAME, label))
    yield Finding("turn on the way up or down", *_most(DEGREES * turned, "°", DEGREES * SAME, label))


def _free(scene: Scene, segment: TransitSegment, pose: Array, hand: Array, label: str) -> Iterator[Finding]:
    """The fingertips stay off the resting object wherever they are not at the full height, between samples too."""
    import shapely

    outline, radius = scene.object.outline, scene.pusher.tip_radius
    low = np.minimum(segment.height[:-1], segment.height[1:]) < scene.pusher.lift - SAME
    poses, which = _fine(segment.pusher, TURN)
    inside = low[which]
    reach = float(np.max(np.linalg.norm(hand, axis=1)))
    bow = 0.125 * reach * TURN**2 if np.ptp(segment.pusher[:, 2]) > 0 else 0.0
    shape = shapely.Point(outline.centre) if outline.is_circle else shapely.Polygon(outline.vertices)
    shapely.prepare(shape)
    need = radius + (outline.radius if outline.is_circle else 0.0)
    for finger in hand:
        tips = transform(relative(pose, poses), finger)
        ways = shapely.linestrings(np.stack([tips[:-1], tips[1:]], axis=1)[inside])
        overlap = np.zeros(len(segment.times) - 1)
        np.maximum.at(overlap, which[inside], need + bow - shapely.distance(shape, ways))
        # A turn bows the way by up to `bow`; where the hand does not turn, contact is exact.
        yield Finding("fingertip in the object", *_most(MM * overlap, "mm", MM * (SAME + bow), label))


def _fine(poses: Array, turn: float) -> tuple[Array, NDArray[np.intp]]:
    """Poses along straight interpolation, at most a turn apart in yaw, and the step of samples that each step is of."""
    parts = np.maximum(1, np.ceil(np.minimum(np.abs(np.diff(poses[:, 2])) / turn, 1e6)).astype(int))
    which = np.repeat(np.arange(len(parts)), parts)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    share = ((np.arange(len(which)) - first) / parts[which])[:, None]
    moved = poses[which] + share * (poses[which + 1] - poses[which])
    return np.concatenate([moved, poses[-1:]]), which


def _begins(times: Array) -> NDArray[np.intp]:
    """Where steps begin of which each takes BRIEF at least: those that are shorter are one with the next ones.

    The rounding of places would make any velocity of them.
    """
    begin, since = [], np.inf
    for k, dt in enumerate(times.tolist()):
        if since >= BRIEF:
            begin.append(k)
            since = 0.0
        since += dt
    return np.array(begin[:-1] if since < BRIEF and len(begin) > 1 else begin, dtype=int)


def _limits(scene: Scene, segment: Segment, hand: Array, label: str) -> Iterator[Finding]:
    """Speed and acceleration of the fastest fingertip and turn rate of the hand, from rest to rest."""
    pusher, height = scene.pusher, _height(segment)
    moves = np.any(np.diff(segment.pusher, axis=0) != 0, axis=1) | (np.diff(height) != 0)
    dt = np.diff(segment.times)
    keep = (dt > 0) | moves
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.abs(np.diff(segment.pusher[:, 2])) / dt
        rate = np.where(keep, rate, 0.0)
        fastest = DEGREES * pusher.turn_rate * (1 + SLACK)
        yield Finding("turn rate", *_most(DEGREES * rate, "°/s", fastest, label))
        if np.max(rate, initial=0.0) > 2 * pusher.turn_rate:
            return  # no more is asked of a hand that spins
        poses, which = _fine(segment.pusher, CHORD)
        parts = np.bincount(which, minlength=len(dt))
        share = np.repeat(dt / parts, parts)
        first = np.repeat(np.cumsum(parts) - parts, parts)
        part = (np.arange(len(which)) - first) / parts[which]
        rise = np.append(height[which] + part * np.diff(height)[which], height[-1])
        lifted = (np.maximum(height[:-1], height[1:]) > 0)[which]
        speed_limit = np.where(lifted, pusher.travel_speed, pusher.speed)
        limit = np.where(lifted, pusher.travel_acceleration, pusher.acceleration)
        use = keep[which]
        size = float(np.max(np.abs(segment.pusher[:, :2]))) + float(np.max(np.linalg.norm(hand, axis=1)))
        for finger in hand:
            tips = np.column_stack([transform(poses, finger), rise])
            velocity = np.diff(tips, axis=0)[use] / share[use, None]
            t, kind = share[use], which[use]
            over = (
                np.linalg.norm(velocity, axis=1) / speed_limit[use] - ROUNDING * size / t / speed_limit[use]
            )
            value = np.zeros(len(dt))
            np.maximum.at(value, kind, np.where(np.isnan(over), np.inf, over))
            yield Finding("fingertip speed, of the limit", *_most(value, "", 1 + SLACK, label))
            # From rest to rest; across a sample each side has its limit for its half of the time.
            begin = _begins(t)
            if not len(begin):
                continue
            way, most, t = (
                np.add.reduceat(a, begin) for a in (np.diff(tips, axis=0)[use], limit[use] * t, t)
            )
            velocity = np.concatenate([np.zeros((1, 3)), way / t[:, None], np.zeros((1, 3))])
            times, most = np.concatenate([[0.0], t, [0.0]]), np.concatenate([[0.0], most, [0.0]])
            change = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
            allowed = 0.5 * (most[:-1] + most[1:])
            noise = (
                4
                * ROUNDING
                * size
                / np.minimum(*(np.where(x > 0, x, np.inf) for x in (times[:-1], times[1:])))
            )
            ratio = np.maximum(change - noise, 0.0) / allowed
            kind = kind[begin]
            value = np.zeros(len(segment.times))
            np.maximum.at(value, np.append(kind, len(dt)), np.where(np.isnan(ratio), 0.0, ratio))
            yield Finding("fingertip acceleration, of the limit", *_most(value, "", 1 + SLACK, label))
