"""From measurements to now: what is refused, where the hand is, and prediction over the time since the exposure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...geometry import pose_error
from ...geometry.pose import Array
from .measurement import Command, Measurement

# A frame from later than this is from another clock [s].
AHEAD = 1e-6
# Commands that are remembered.
MOST = 2000


@dataclass(frozen=True, eq=False)
class Seen:
    """The newest frame that was accepted, and what the pusher was told since.

    Attributes:
        frame: None before the first.
        told: (from time, velocity in W (3,)) of the commands that began since, or before and hold on, oldest first.
        height: that was told last [m], and climb: the rate at which the hand gets there [m/s].
    """

    frame: Measurement | None = None
    told: tuple[tuple[float, Array], ...] = ()
    height: float = 0.0
    climb: float = 0.0

    @property
    def last(self) -> Command:
        """The command that holds now."""
        return Command(self.told[-1][1] if self.told else np.zeros(3), self.height)


class SticksAndMoves(Protocol):
    """What predicts an object that sticks to the pusher: a SteeringModel."""

    def moved(
        self, x: float, y: float, turn: float, ux: float, uy: float, dt: float
    ) -> tuple[float, float, float]:
        """X_WO after a time in which the pusher goes straight with a velocity in W."""
        ...


def refusal(frame: Measurement, seen: Seen, time: float, body: str, stale: float) -> str:
    """Why a frame is not to be used, or ""."""
    if not frame.finite:
        return "a measurement is not finite"
    if body and frame.body and frame.body != body:
        return f"a measurement of another object, {frame.body!r}"
    if frame.time > time + AHEAD:
        return f"a measurement from {frame.time - time:.3g} s ahead of now"
    if time - frame.time > stale:
        return f"a measurement that is {time - frame.time:.3g} s old"
    if seen.frame is not None and frame.time <= seen.frame.time:
        return "a measurement no newer than the last"
    return ""


def after(seen: Seen, frame: Measurement) -> Seen:
    """With a newer frame; commands that ended before its exposure are forgotten."""
    told = seen.told
    while len(told) > 1 and told[1][0] <= frame.time:
        told = told[1:]
    return Seen(frame, told, seen.height, seen.climb)


def with_command(seen: Seen, time: float, command: Command, dt: float) -> Seen:
    """With a command that begins now and holds for dt."""
    told = seen.told if len(seen.told) < MOST else seen.told[1:]
    climb = (command.height - seen.height) / dt
    return Seen(seen.frame, (*told, (time, command.velocity)), command.height, climb)


def hand(frame: Measurement, told: tuple[tuple[float, Array], ...], time: float) -> Array:
    """X_WE now: where a frame's log has it, moved on by the commands since."""
    found = np.array(frame.pusher, dtype=float)
    for k, (begun, velocity) in enumerate(told):
        ended = told[k + 1][0] if k + 1 < len(told) else time
        dt = min(ended, time) - max(begun, frame.time)
        if dt > 0:
            found += dt * velocity
    return found


def predicted(
    frame: Measurement, told: tuple[tuple[float, Array], ...], time: float, model: SticksAndMoves
) -> Array:
    """X_WO now: the frame's pose moved on by the commands given since its exposure, as the model sticks."""
    x, y, turn = (float(v) for v in frame.object)
    for k, (begun, velocity) in enumerate(told):
        ended = told[k + 1][0] if k + 1 < len(told) else time
        dt = min(ended, time) - max(begun, frame.time)
        ux, uy = float(velocity[0]), float(velocity[1])
        if dt > 1e-12 and (ux != 0 or uy != 0):
            x, y, turn = model.moved(x, y, turn, ux, uy, dt)
    return np.array([x, y, turn])


def mean_pose(poses: Sequence[Array]) -> Array:
    """The mean of poses that lie near to each other."""
    first = np.asarray(poses[0], dtype=float)
    return np.asarray(first + np.mean([pose_error(p, first) for p in poses], axis=0))
