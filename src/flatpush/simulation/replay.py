"""What the simulator makes of a run that a robot recorded: the pusher moves as it did, the object as physics says."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..documents.robot_log import RobotRun
from ..errors import InputError
from ..geometry.pose import Array, compose, inverse, wrap_angle
from .plant import MODES, Plant

# A stroke ends where rows are missing for longer than a tick, or the pusher is suddenly elsewhere. The number of the
# push does not tell: it often changes a row before the pusher does.
GAP = 1.0  # [s]
JUMP = 0.009  # [m]
TURN_JUMP = 0.5  # [rad]
# An object that was last seen so long before the end has no final pose [s].
UNSEEN = 0.5


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


def replay(recording: Recording, plant: Plant, registration: Registration) -> Replayed:
    """The run's pusher motion through the simulator, from the first measured pose.

    Landings are not in the logs: where a stroke begins inside the object, the object is moved out the shortest way.
    """
    pose = registration.poses(recording.first)
    poses, outcomes = [], []
    for hand in recording.hands:
        run = plant.follow(pose, hand)
        outcomes.append(run.outcome or ("" if np.any(_touching(run.modes)) else "not touched"))
        poses.append(run.object)
        pose = run.object[-1]
    return Replayed(tuple(poses), tuple(outcomes))


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


def errors(predicted: Array, measured: Array) -> Array:
    """Distance [m] and angle [rad] between poses, shape (..., 2)."""
    gap = predicted - measured
    return np.stack([np.hypot(gap[..., 0], gap[..., 1]), np.abs(wrap_angle(gap[..., 2]))], axis=-1)


def _touching(modes: Any) -> Any:
    off = [MODES.index("rest"), MODES.index("separation")]
    return ~np.isin(modes, off)
