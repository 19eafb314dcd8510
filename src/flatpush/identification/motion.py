"""A recorded push by one finger, made smooth and cut into short stretches; nothing but poses was measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..documents.motion_file import Motion
from ..errors import InputError
from ..geometry import Outline, compose, exp, log, perpendicular, relative, rotate, wrap_angle
from ..geometry.pose import Array

# Way of the finger from which a pose and its velocity are taken (a local quadratic), and of one stretch [m].
SMOOTHED, STRETCH = 0.01, 0.015
# The finger's way along a stretch is given by so many places.
PLACES = 9
LEAST_FRAMES = 5  # of a local quadratic
# The object moves where, over the smoothing window, it goes so much of the finger's way, and more than noise.
MOVES, ABOVE_NOISE = 0.1, 4.0
# What the quasi-static model leaves out of a stretch, by its length: in place, and in angle [rad/m].
MODEL = (0.001, 0.05)
# While it moves, its outline is so near the finger, by its size, or scene and recording do not belong together [m].
NEAR, NEAR_SIZE = 0.002, 0.04
# A tag that jumps: between two frames the object goes so much farther than the finger, and turns so much [m, rad].
JUMP, JUMP_TURN = 0.005, 0.25
# A contact is on a corner where the normal turns by so much within so much of the outline [rad, m].
CORNER, CORNER_REACH = np.deg2rad(20), 0.0006


class Frames(NamedTuple):
    """Moments of pushing, each made smooth over its neighbours; n of them.

    Attributes:
        poses: X_WO (n, 3), the outline brought to the fingertip. variance: of the smoothed value, by that of one frame.
        twists: of the object in O, per way of the finger (n, 3). tips, slides: fingertip in W (n, 2) and its direction
            in O (n, 2).
        points, normals: contacts in O, (n, 2), and inward normals. corner: whether on a corner.
        way: of the finger since the recording began (n,) [m].
        gaps: between fingertip and outline as measured (n,) [m].
    """

    poses: Array
    variance: Array
    twists: Array
    tips: Array
    slides: Array
    points: Array
    normals: Array
    corner: np.ndarray
    way: Array
    gaps: Array


class Stretches(NamedTuple):
    """Short parts of pushes; n of them.

    Attributes:
        starts, ends: X_WO, the outline at the fingertip, (n, 3). variance: of both, by that of one frame, (n, 2).
        tips: the fingertip's places (n, PLACES, 2).
        push: number of the recording (n,).
    """

    starts: Array
    ends: Array
    variance: Array
    tips: Array
    push: np.ndarray


@dataclass(frozen=True, eq=False)
class Seen:
    """What recordings say, for an outline and a fingertip.

    Attributes:
        frames, stretches: of all recordings. noise: standard deviation of one frame, place [m] and angle [rad].
        notes: recordings that say little, in words.
        model: what the quasi-static model leaves out, by the length of a stretch: in place, and in angle [rad/m].
    """

    frames: Frames
    stretches: Stretches
    noise: tuple[float, float]
    notes: tuple[str, ...]
    model: tuple[float, float] = MODEL

    @property
    def longest(self) -> float:
        """The way of the longest push [m]."""
        pushes = [self.stretches.tips[self.stretches.push == k] for k in np.unique(self.stretches.push)]
        return max(float(np.sum(np.hypot(*np.moveaxis(np.diff(tips, axis=1), -1, 0)))) for tips in pushes)


def look(motions: Sequence[Motion], outline: Outline, tip_radius: float) -> Seen:
    """Finds where the finger pushed, smooths it, and cuts it into stretches.

    Args:
        motions: the recordings. outline: of the object. tip_radius: of the finger [m].

    Raises:
        InputError: with recording and line: for an object that jumps, one that moves with no finger near it (the scene
            of another object, a wrong scale, a mirrored image), and where nothing moves at all.
    """
    frames, parts, notes, noise = [], [], [], []
    for k, motion in enumerate(motions):
        _refuse_jumps(motion)
        found = list(_pushing(motion, outline.size))
        pushed = 0.0
        for a, b in found:
            part, sd = _smoothed(motion, a, b, outline, tip_radius)
            if part is None:
                continue
            _refuse_far(motion, a, part, outline)
            frames.append(part)
            noise.append((*sd, len(part.way)))
            pushed += float(part.way[-1] - part.way[0])
            parts += _cut(part, motion, a, k)
        if pushed < STRETCH:
            notes.append(
                f"{motion.name}: the object is pushed for {1000 * pushed:.1f} mm, which tells nothing"
            )
    if not parts:
        raise InputError(
            "no recording holds a push of 15 mm by the finger",
            value="; ".join(notes[:5]) or "no recordings",
            hint="Are the columns of object and pusher exchanged, or the units wrong?",
        )
    n = np.array(noise)
    one = np.sqrt(np.average(n[:, :2] ** 2, axis=0, weights=n[:, 2]))
    columns = (np.concatenate(column) for column in zip(*frames, strict=True))
    cut = (np.array(column) for column in zip(*parts, strict=True))
    return Seen(
        Frames(*columns), Stretches(*cut), (max(float(one[0]), 1e-6), max(float(one[1]), 1e-5)), tuple(notes)
    )


def _refuse_jumps(motion: Motion) -> None:
    step = np.hypot(*np.diff(motion.poses[:, :2], axis=0).T) - np.hypot(*np.diff(motion.tips, axis=0).T)
    turn = np.abs(wrap_angle(np.diff(motion.poses[:, 2])))
    away = np.flatnonzero((step > JUMP) | (turn > JUMP_TURN))
    if len(away):
        k = int(away[0])
        raise InputError(
            f"line {motion.lines[k + 1]}: the object jumps by {1000 * max(step[k], 0.0):.1f} mm farther than the finger"
            f" moves, and by {np.rad2deg(turn[k]):.1f}°",
            source=motion.name,
            hint="A tag that is mistaken for another, or seen wrongly, does that (leave such frames out), or a wrong"
            " unit.",
        )


def _pushing(motion: Motion, size: float) -> list[tuple[int, int]]:
    """First and last + 1 frame of each part in which the finger moves on and the object with it."""
    if len(motion.times) < LEAST_FRAMES:
        return []
    step = np.hypot(*np.diff(motion.tips, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(step)])
    turned = np.unwrap(motion.poses[:, 2])
    # A second or so of rest tells the noise; the median of second differences tells it always.
    rough = np.array([np.median(np.abs(np.diff(column, 2))) for column in (*motion.poses[:, :2].T, turned)])
    noise = float(np.max(rough * np.array([1, 1, 0.5 * size])))
    moved = np.zeros(len(way), dtype=bool)
    a = np.searchsorted(way, way - SMOOTHED / 2)
    b = np.minimum(np.searchsorted(way, way + SMOOTHED / 2), len(way) - 1)
    going = way[b] - way[a]
    shift = np.hypot(*(motion.poses[b, :2] - motion.poses[a, :2]).T) + 0.25 * size * np.abs(
        turned[b] - turned[a]
    )
    moved = (shift > MOVES * going) & (shift > ABOVE_NOISE * noise) & (going > 0.2 * SMOOTHED)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moved, [False]]).astype(int)))
    return [(int(i), int(j)) for i, j in zip(edges[::2], edges[1::2], strict=True) if j - i >= LEAST_FRAMES]


def _smoothed(
    motion: Motion, a: int, b: int, outline: Outline, tip_radius: float
) -> tuple[Frames | None, tuple[float, float]]:
    tips, poses = motion.tips[a:b], motion.poses[a:b].copy()
    poses[:, 2] = np.unwrap(poses[:, 2])
    step = np.hypot(*np.diff(tips, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(step)])
    fresh = np.concatenate([[True], step > 1e-7])  # a finger that waits adds nothing
    tips, poses, way = tips[fresh], poses[fresh], way[fresh]
    rows, values, slopes, variance, left = [], [], [], [], []
    for i in range(len(way)):
        window = np.abs(way - way[i]) <= SMOOTHED / 2
        # At the ends of a push the window is cut; half a window from them it is worth little.
        if way[i] < SMOOTHED / 4 or way[-1] - way[i] < SMOOTHED / 4 or window.sum() < LEAST_FRAMES:
            continue
        s = way[window] - way[i]
        X = np.column_stack([np.ones_like(s), s, s * s]) * [1, 1 / SMOOTHED, 1 / SMOOTHED**2]
        inverse = np.linalg.pinv(X.T @ X)
        fit = inverse @ X.T @ poses[window]
        rows.append(i)
        values.append(fit[0])
        slopes.append(fit[1] / SMOOTHED)
        variance.append(inverse[0, 0])
        left.append((poses[window] - X @ fit)[np.argmin(np.abs(s))] ** 2 / max(1 - inverse[0, 0], 0.05))
    if len(rows) < LEAST_FRAMES:
        return None, (0.0, 0.0)
    spread = np.mean(left, axis=0)
    at, slope, kept = np.array(values), np.array(slopes), np.array(rows)
    tip, path = tips[kept], np.gradient(tips, way, axis=0)[kept]
    path /= np.maximum(np.hypot(*path.T), 1e-12)[:, None]
    touch = [touching(outline, q, t, tip_radius) for q, t in zip(at, tip, strict=True)]
    points, normals, gaps, corner = (np.array(column) for column in zip(*touch, strict=True))
    at[:, :2] -= gaps[:, None] * rotate(at[:, 2], normals)  # the outline at the fingertip
    twists = np.column_stack([rotate(-at[:, 2], slope[:, :2]), slope[:, 2]])
    slides = rotate(-at[:, 2], path)
    sd = float(np.sqrt(0.5 * (spread[0] + spread[1]))), float(np.sqrt(spread[2]))
    return Frames(at, np.array(variance), twists, tip, slides, points, normals, corner, way[kept], gaps), sd


def touching(
    outline: Outline, pose: Array, tip: Array, tip_radius: float
) -> tuple[Array, Array, float, bool]:
    """Where a fingertip at W touches: point of the outline and inward normal in O, gap [m], whether on a corner."""
    place = rotate(-pose[2], tip - pose[:2])
    near = outline.nearest(place)
    gap = near.distance - tip_radius
    beside = perpendicular(near.normal) * CORNER_REACH
    normals = [outline.nearest(near.point + side * beside).normal for side in (-1, 1)]
    corner = near.corner or bool(normals[0] @ normals[1] < np.cos(CORNER))
    return near.point, near.normal, gap, corner


def _refuse_far(motion: Motion, a: int, part: Frames, outline: Outline) -> None:
    """The finger that moves the object is at its outline."""
    allowed = max(NEAR, NEAR_SIZE * outline.size)
    middle = float(np.median(part.gaps))
    spread = float(np.percentile(np.abs(part.gaps - middle), 80))
    if abs(middle) > allowed or spread > 0.5 * allowed:
        raise InputError(
            f"line {motion.lines[a]} and after: the object moves while the finger is {1000 * middle:.1f} mm"
            f" (± {1000 * spread:.1f} mm) from its outline",
            source=motion.name,
            hint="The scene of another object, a wrong scale or size of the tag, a mirrored image, or a tag whose place"
            " on the object is not the drawing's origin does that.",
        )


def _cut(part: Frames, motion: Motion, a: int, push: int) -> list[tuple[Array, Array, Array, Array, int]]:
    found = []
    i = 0
    good = ~part.corner
    while i < len(part.way):
        j = int(np.searchsorted(part.way, part.way[i] + STRETCH))
        if j >= len(part.way):
            break
        inside = slice(i, j + 1)
        if good[inside].all() and part.way[j] - part.way[i] < 1.5 * STRETCH:
            at = np.linspace(part.way[i], part.way[j], PLACES)
            tips = np.column_stack([np.interp(at, part.way[inside], x) for x in part.tips[inside].T])
            variance = np.array([part.variance[i], part.variance[j]])
            found.append((part.poses[i], part.poses[j], variance, tips, push))
            i = j
        else:
            i += max(1, (j - i) // 4)
    return found


def seen_of(
    stretches: Stretches,
    outline: Outline,
    tip_radius: float,
    noise: tuple[float, float],
    model: tuple[float, float] = MODEL,
) -> Seen:
    """What stretches say of which only both ends were measured; the moment in the middle stands for each.

    Args:
        noise: standard deviation of an end's place [m] and angle [rad]. model: see Seen.
    """
    step = relative(stretches.starts, stretches.ends)
    way = np.hypot(*(stretches.tips[:, -1] - stretches.tips[:, 0]).T)
    twists = log(np.column_stack([step[:, :2], wrap_angle(step[:, 2])]))
    poses = compose(stretches.starts, exp(0.5 * twists))
    tips = stretches.tips.mean(axis=1)
    touch = [touching(outline, q, t, tip_radius) for q, t in zip(poses, tips, strict=True)]
    points, normals, gaps, corner = (np.array(column) for column in zip(*touch, strict=True))
    slides = rotate(-poses[:, 2], (stretches.tips[:, -1] - stretches.tips[:, 0]) / way[:, None])
    variance = np.ones(len(way))
    frames = Frames(poses, variance, twists / way[:, None], tips, slides, points, normals, corner, way, gaps)
    return Seen(frames, stretches, noise, (), model)
