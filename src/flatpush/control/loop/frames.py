"""From measurements to the pose of now: what is refused, and prediction over the time since the exposure."""

from dataclasses import dataclass

import numpy as np

from ...geometry.pose import Array
from ..laws.steering_model import SteeringModel
from .measurement import Measurement

# A frame from later than this is from another clock [s].
AHEAD = 1e-6


@dataclass(frozen=True, eq=False)
class Seen:
    """The newest frame that was accepted, and what the pusher was told since.

    Attributes:
        frame: None before the first.
        told: (from time, velocity in W (3,)) of the commands that began since, or before and hold on, oldest first.
    """

    frame: Measurement | None = None
    told: tuple[tuple[float, Array], ...] = ()


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
    return Seen(frame, told)


def with_command(seen: Seen, time: float, velocity: Array) -> Seen:
    told = seen.told if len(seen.told) < 1000 else seen.told[1:]
    return Seen(seen.frame, (*told, (time, velocity)))


def predicted(seen: Seen, time: float, model: SteeringModel) -> Array:
    """X_WO now: the frame's pose moved on by the commands given since its exposure, as the model sticks."""
    assert seen.frame is not None
    x, y, turn = (float(v) for v in seen.frame.object)
    for k, (begun, velocity) in enumerate(seen.told):
        ended = seen.told[k + 1][0] if k + 1 < len(seen.told) else time
        dt = min(ended, time) - max(begun, seen.frame.time)
        ux, uy = float(velocity[0]), float(velocity[1])
        if dt > 1e-12 and (ux != 0 or uy != 0):
            x, y, turn = model.moved(x, y, turn, ux, uy, dt)
    return np.array([x, y, turn])
