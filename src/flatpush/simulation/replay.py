"""What the simulator makes of a run that a robot recorded: the pusher moves as it did, the object as physics says."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..documents.robot_log import RobotRun
from ..errors import InputError
from ..geometry.pose import Array, compose, inverse, relative, transform, wrap_angle
from ..problem import Object
from .plant import MODES, Plant, PlantRun

# A stroke ends where rows are missing for longer than a tick, or the pusher is suddenly elsewhere. The number of the
# push does not tell: it often changes a row before the pusher does.
GAP = 1.0  # [s]
JUMP = 0.009  # [m]
TURN_JUMP = 0.5  # [rad]
# An object that was last seen so long before the end has no final pose [s].
UNSEEN = 0.5
# Once a stroke has moved the object so far a finger touches it within so much, or so much of its size, where nothing is
# calibrated; a camera is at most so late. In one stroke of a run the object moves by more than STILL [m, s].
PUSHED, NEAR, NEAR_SIZE, LATE, STILL = 0.01, 0.005, 0.1, 0.3, 0.001
# That is looked at in these parts of the way, and at the end: a mirrored object stands well on the mirror's axis.
PARTS = (0.25, 0.5, 0.75)
# No camera misses so much of a push between two frames [m].
LEAPS = 0.03
# What belongs together ends nearer to where it is predicted, in the mean of an object's runs, also where nothing is
# calibrated (3 mm and 6° at most of four recorded objects, the runs of the paper) [m, rad]; and calibrated, the outline
# is seen nearer to the finger that pushes it (0.5 mm there) [m].
FAR, FAR_TURN, ASIDE = 0.008, 0.2, 0.0015
# A hand that has gone no further than this still rests, or rests again [m].
RESTS = 0.0003
# Two fingers hold the object between these ways of the hand from where it landed [m].
HELD = (0.01, 0.06)
# Fingers touch one straight edge where the outline turns by no more than this from the line between them [rad].
STRAIGHT = 0.02
# Of what the camera says of a landing this part is believed: it is as noisy as landings differ, 0.4 mm.
BELIEVED = 0.5


@dataclass(frozen=True, eq=False)
class CameraMap:
    """From the camera's table frame to the robot's: p ↦ pivot + shift + matrix (p - pivot).

    Attributes:
        matrix: shape (2, 2), near the identity. shift: shape (2,) [m]. pivot: shape (2,) [m].
    """

    matrix: Array = field(default_factory=lambda: np.eye(2))
    shift: Array = field(default_factory=lambda: np.zeros(2))
    pivot: Array = field(default_factory=lambda: np.zeros(2))

    @property
    def turn(self) -> float:
        """The rotation next to the matrix [rad]: by it orientations turn."""
        m = self.matrix
        return float(np.arctan2(m[1, 0] - m[0, 1], m[0, 0] + m[1, 1]))

    def apply(self, poses: Array) -> Array:
        """Poses in the robot's frame, shape (..., 3)."""
        xy = (poses[..., :2] - self.pivot) @ self.matrix.T + self.pivot + self.shift
        return np.concatenate([xy, poses[..., 2:] + self.turn], axis=-1)


@dataclass(frozen=True, eq=False)
class Registration:
    """How measured poses become poses of the outline.

    Attributes:
        camera: one for all runs.
        tag: pose of the outline's frame in the frame that the camera reports, one for each object (3,).
    """

    camera: CameraMap = field(default_factory=CameraMap)
    tag: Array = field(default_factory=lambda: np.zeros(3))

    def poses(self, measured: Array) -> Array:
        """X_WO in the robot's frame, shape (..., 3)."""
        return compose(self.camera.apply(measured), self.tag)


@dataclass(frozen=True, eq=False)
class Recording:
    """A run, cut into strokes. Build with Recording.of.

    Attributes:
        run: as it was read. Its first row is not used: it is older than the run.
        strokes: first and last + 1 row of each.
    """

    run: RobotRun
    strokes: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, run: RobotRun) -> "Recording":
        """Cuts the run.

        Raises:
            InputError: if the camera saw the object in fewer than two rows, or not at the end of the run.
        """
        if len(run.times) < 3 or run.seen[1:].sum() < 2:
            raise InputError(f"run {run.name!r} has fewer than two rows with the object in view")
        last = float(run.times[run.seen][-1])
        if run.times[-1] - last > UNSEEN:
            raise InputError(
                f"run {run.name!r} has no final pose: the camera last saw the object at {last:.2f} s of"
                f" {run.times[-1]:.2f} s"
            )
        step = np.diff(run.hands[1:], axis=0)
        cut = (np.diff(run.times[1:]) > GAP) | (np.hypot(step[:, 0], step[:, 1]) > JUMP)
        cut |= np.abs(wrap_angle(step[:, 2])) > TURN_JUMP
        edges = [1, *(np.flatnonzero(cut) + 2).tolist(), len(run.times)]
        return cls(run, tuple(pairwise(edges)))

    @property
    def first(self) -> Array:
        """The first measured pose."""
        return self.run.poses[1:][self.run.seen[1:]][0]

    @property
    def final(self) -> Array:
        """The last measured pose."""
        return self.run.poses[self.run.seen][-1]

    @cached_property
    def hands(self) -> tuple[Array, ...]:
        """The pusher's poses in each stroke, angles without jumps."""
        found = []
        for a, b in self.strokes:
            hand = self.run.hands[a:b].copy()
            hand[:, 2] = np.unwrap(hand[:, 2])
            found.append(hand)
        return tuple(found)

    @cached_property
    def ways(self) -> tuple[Array, ...]:
        """How far the hand has gone at the rows of each stroke [m]."""
        steps = (np.hypot(*np.diff(hand[:, :2], axis=0).T) for hand in self.hands)
        return tuple(np.concatenate([[0.0], np.cumsum(step)]) for step in steps)

    def check(self, thing: Object, fingers: Array, tip_radius: float) -> None:
        """Refuses what cannot be a run of this object with these fingers, whatever the camera's map and lag may be.

        Raises:
            InputError: with the run and the line: for an object that jumps, one that is never pushed, and one that
                moves with no finger near it.
        """
        run, moved = self.run, 0.0
        for (a, b), hand in zip(self.strokes, self.hands, strict=True):
            seen = run.seen[a:b]
            if seen.sum() < 2:
                continue
            times, poses, lines = run.times[a:b][seen], run.poses[a:b][seen], run.lines[a:b][seen]
            step = np.hypot(*np.diff(poses[:, :2], axis=0).T)
            if np.any(step > LEAPS):
                k = int(np.argmax(step > LEAPS))
                raise InputError(
                    f"line {lines[k + 1]}: the object jumps by {1000 * step[k]:.0f} mm between two frames",
                    source=run.name,
                    hint="A tag that is mistaken for another, or seen wrongly, does that; leave such frames out.",
                )
            way = float(np.hypot(*(poses[-1] - poses[0])[:2]))
            moved = max(moved, way)
            if way < PUSHED:
                continue
            far = np.hypot(*(poses - poses[0])[:, :2].T)
            for k in sorted({len(far) - 1, *(int(np.argmax(far >= part * way)) for part in PARTS)}):
                if far[k] < PUSHED:
                    continue
                tips = transform(inverse(poses[k]), transform(hand[seen][k], fingers))
                gap = min(abs(thing.outline.nearest(tip).distance - tip_radius) for tip in tips)
                late = (times >= times[k] - LATE) & (times <= times[k])
                rushed = np.hypot(*np.ptp(hand[seen][late, :2], axis=0))
                if gap > max(NEAR, NEAR_SIZE * thing.outline.size) + rushed:
                    raise InputError(
                        f"line {lines[k]}: the object was moved by {1000 * far[k]:.0f} mm, and the nearest finger is"
                        f" {1000 * gap:.1f} mm from touching its outline",
                        source=run.name,
                        hint="The scene of another object, a wrong size of the tag, or a mirrored image does that.",
                    )
        if moved < STILL:
            raise InputError(
                f"the object is not pushed: it moves by {1000 * moved:.1f} mm at most",
                source=run.name,
                hint="Leave this run out.",
            )

    def resting(self, k: int, lag: float) -> Array:
        """Measured poses before the hand of a stroke moves, shape (n, 3): of this stroke, or else after the one
        before; lag as in replay."""
        (a, b), run, way = self.strokes[k], self.run, self.ways[k]
        begins = run.times[a:b][np.searchsorted(way, RESTS, side="right") - 1]
        found = run.poses[a:b][run.seen[a:b] & (run.times[a:b] <= begins + lag)]
        if len(found) >= 2 or k == 0:
            return found
        (a, b), way = self.strokes[k - 1], self.ways[k - 1]
        ends = run.times[a:b][np.searchsorted(way, way[-1] - RESTS)]
        return run.poses[a:b][run.seen[a:b] & (run.times[a:b] >= ends + lag)]


@dataclass(frozen=True, eq=False)
class Replayed:
    """What is predicted for a run.

    Attributes:
        poses: X_WO in the robot's frame at the rows of each stroke, shapes (n, 3).
        outcomes: of each stroke; "" if all is well, else as in PlantState, or "not touched".
    """

    poses: tuple[Array, ...]
    outcomes: tuple[str, ...]

    @property
    def final(self) -> Array:
        return self.poses[-1][-1]


def replay(
    recording: Recording, plant: Plant, registration: Registration, lag: float | None = None
) -> Replayed:
    """The run's pusher motion through the simulator, from the first measured pose.

    Landings are not in the logs: where a stroke begins inside the object, the object is moved out the shortest way.

    Args:
        lag: of the camera's poses [s]. With it, how far the object slid along two fingers as they landed on a straight
            edge is estimated from what the camera saw before and after; None: of the camera only the first pose is
            used.
    """
    pose = registration.poses(recording.first)
    poses, outcomes = [], []
    for k, hand in enumerate(recording.hands):
        run = plant.follow(pose, hand)
        if lag is not None and (further := _slid(recording, k, plant, pose, run, registration, lag)):
            pose = pose + BELIEVED * further * _along(hand[0])
            run = plant.follow(pose, hand)
        outcomes.append(run.outcome or ("" if np.any(_touching(run.modes)) else "not touched"))
        poses.append(run.object)
        pose = run.object[-1]
    return Replayed(tuple(poses), tuple(outcomes))


def _along(hand: Array) -> Array:
    """The direction along the fingers, as a change of a pose."""
    return np.array([-np.sin(hand[2]), np.cos(hand[2]), 0.0])


def _slid(
    recording: Recording,
    k: int,
    plant: Plant,
    pose: Array,
    run: PlantRun,
    registration: Registration,
    lag: float,
) -> float:
    """How much further the object slid along the fingers of a stroke than in the simulator, from its rest before the
    landing, there at pose, to where it is held, by the camera [m]; 0 where that is not seen."""
    hand, way = recording.hands[k], recording.ways[k]
    held = (way >= HELD[0]) & (way <= HELD[1]) & _touching(run.modes).all(axis=1)
    if run.points.shape[1] != 2 or held.sum() < 3:
        return 0.0
    first, second = run.points[held][-1]
    line, outline = second - first, plant.thing.outline
    if max(abs(outline.nearest(p).normal @ line) for p in (first, second)) > STRAIGHT * np.hypot(*line):
        return 0.0
    (a, b), seen = recording.strokes[k], recording.run.seen
    times = recording.run.times[a:b]
    gone = np.interp(times - lag, times, way)
    after = seen[a:b] & (gone >= HELD[0]) & (gone <= HELD[1])
    before = recording.resting(k, lag)
    if after.sum() < 3 or not len(before):
        return 0.0
    there = np.column_stack([np.interp(times[after] - lag, times, column) for column in hand.T])
    seen_in_hand = relative(there, registration.poses(recording.run.poses[a:b][after]))[:, 1]
    in_hand = relative(hand[held], run.object[held])[:, 1]
    moved = np.median(registration.poses(before)[:, :2], axis=0) - pose[:2]
    return float(np.median(seen_in_hand) - np.median(in_hand) - _along(hand[0])[:2] @ moved)


def rigid(recording: Recording, plant: Plant, registration: Registration) -> Replayed:
    """The object never moves in the hand once both fingers touch it, or one if they never both do; no physics."""
    pose = registration.poses(recording.first)
    poses, outcomes = [], []
    for hand in recording.hands:
        seen = plant.follow(pose, hand)
        touching = _touching(seen.modes)
        both = np.flatnonzero(touching.all(axis=1))
        any_ = np.flatnonzero(touching.any(axis=1))
        held = both if len(both) else any_
        way = seen.object.copy()
        if len(held):
            k = int(held[0])
            way[k:] = compose(hand[k:], compose(inverse(hand[k]), way[k]))
        outcomes.append("" if len(held) else "not touched")
        poses.append(way)
        pose = way[-1]
    return Replayed(tuple(poses), tuple(outcomes))


def trajectory_errors(
    recording: Recording, predicted: Replayed, registration: Registration, lag: float
) -> Array:
    """Distance [m] and angle [rad] at every row in which the object was seen, shape (n, 2).

    Args:
        lag: the camera's poses come so much later than the robot's [s].
    """
    run, found = recording.run, []
    for (a, b), way in zip(recording.strokes, predicted.poses, strict=True):
        seen = run.seen[a:b]
        if not np.any(seen):
            continue
        turned = np.column_stack([way[:, :2], np.unwrap(way[:, 2])])
        at = run.times[a:b][seen] - lag
        then = np.column_stack([np.interp(at, run.times[a:b], column) for column in turned.T])
        found.append(errors(then, registration.poses(run.poses[a:b][seen])))
    return np.concatenate(found)


def gap_seen(
    recording: Recording, plant: Plant, fingers: Array, registration: Registration, lag: float
) -> float:
    """How far the camera saw the outline from the nearest finger while it was pushed [m]: the median over the second
    half of a stroke, of the stroke with the most. No prediction is in it.

    Args:
        lag: the camera's poses come so much later than the robot's [s].
    """
    run, most, outline = recording.run, 0.0, plant.thing.outline
    for (a, b), hand, way in zip(recording.strokes, recording.hands, recording.ways, strict=True):
        times, seen = run.times[a:b], run.seen[a:b]
        at = times[seen] - lag
        late = np.interp(at, times, way) > 0.5 * way[-1]
        if late.sum() < 2:
            continue
        poses = registration.poses(run.poses[a:b][seen][late])
        there = np.column_stack([np.interp(at[late], times, column) for column in hand.T])
        tips = transform(inverse(poses)[:, None], transform(there[:, None], fingers))
        gaps = [min(abs(outline.nearest(p).distance - plant.tip_radius) for p in pair) for pair in tips]
        if np.hypot(*(poses[-1] - poses[0])[:2]) > PUSHED:
            most = max(most, float(np.median(gaps)))
    return most


def doubts(name: str, ends: Array, gaps: Array, calibrated: bool) -> tuple[str, ...]:
    """What says that runs are not those of the scene's object, or that the camera sees wrongly.

    Args:
        name: of the object. ends: errors at the ends of its runs, (n, 2) [m, rad]. gaps: of gap_seen, (n,) [m].
        calibrated: whether the camera's map is known, without which gaps tell nothing.
    """
    place, turn = ends.mean(axis=0)
    found = []
    if place > FAR or turn > FAR_TURN:
        found.append(
            f"runs of {name} end {1000 * place:.0f} mm and {np.rad2deg(turn):.0f}° from where they are predicted"
        )
    if calibrated and gaps.mean() > ASIDE:
        found.append(f"{name} was seen {1000 * gaps.mean():.1f} mm from the finger that pushed it")
    does = "the scene of another object, a wrong size or place of the tag, or another camera's calibration does that"
    return tuple(f"{what}, in the mean of {len(ends)}: {does}" for what in found)


def errors(predicted: Array, measured: Array) -> Array:
    """Distance [m] and angle [rad] between poses, shape (..., 2)."""
    gap = predicted - measured
    return np.stack([np.hypot(gap[..., 0], gap[..., 1]), np.abs(wrap_angle(gap[..., 2]))], axis=-1)


def _touching(modes: Any) -> Any:
    off = [MODES.index("rest"), MODES.index("separation")]
    return ~np.isin(modes, off)
