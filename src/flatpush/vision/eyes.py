"""Eyes for a controller: frames of a real camera, of recorded pictures, or drawn ones, seen by the same tracker."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..control import AbstractSensor, Measurement, SensorState
from ..errors import InputError
from ..geometry.pose import Array
from .synthetic import SyntheticCamera
from .tags import Picture
from .tracker import Seen, Tracker, TrackerState

# A frame is taken when the clock is within this of its instant [s].
INSTANT = 1e-9
UNKNOWN = np.full(3, np.nan)


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture.

    Attributes:
        stamp: of its exposure, on the clock of who uses it [s]. picture: grey, shape (height, width).
    """

    stamp: float
    picture: Picture


class Source(Protocol):
    """Where frames come from; those that have come are taken, in the order of their exposure."""

    def taken(self, until: float) -> Iterator[Frame]:
        """The frames that came since the last call; it is `until` now [s]."""
        ...


@dataclass(frozen=True, eq=False)
class EyesState(SensorState):
    """With what the tracker remembers, and what it said last."""

    tracker: TrackerState = field(default_factory=TrackerState)
    seen: Seen | None = None


@dataclass(frozen=True, eq=False)
class TagEyes(AbstractSensor):
    """Sees an object by its tag in the frames of a source.

    Args:
        tracker: of one object. source: of the frames.
    """

    tracker: Tracker
    source: Source

    def start(self) -> EyesState:
        return EyesState(tracker=self.tracker.start())

    def arrived(self, state: SensorState, time: float) -> tuple[SensorState, tuple[Measurement, ...]]:
        """The poses in the frames that have come by a time [s]; of the pusher they say nothing (nan)."""
        assert isinstance(state, EyesState)
        found = []
        for frame in self.source.taken(time):
            state = _looked(self.tracker, state, frame)
            found += _measured(state, UNKNOWN)
        return state, tuple(found)


@dataclass(frozen=True, eq=False)
class DrawnEyes(AbstractSensor):
    """Sees a simulated object in pictures that are drawn of it: what a camera would, end to end.

    Args:
        tracker: of one object. drawn: the camera that draws, with its tags. rate: of its frames [Hz].
        latency: from exposure to arrival [s]. rng: of what spoils the pictures.

    Raises:
        InputError: for a rate that is not positive, or a negative latency.
    """

    tracker: Tracker
    drawn: SyntheticCamera
    rng: np.random.Generator
    rate: float = 30.0
    latency: float = 0.1

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rate) and self.rate > 0 and np.isfinite(self.latency) and self.latency >= 0):
            raise InputError("the rate of a camera is positive, and its latency 0 or more", key="camera.rate")

    def start(self) -> EyesState:
        return EyesState(tracker=self.tracker.start())

    def expose(self, state: SensorState, time: float, object: ArrayLike, pusher: ArrayLike) -> SensorState:
        """Draws object X_WO at a time [s] if a frame is due, and looks at the picture; pusher: X_WE (3,)."""
        assert isinstance(state, EyesState)
        due = int(np.floor((time + INSTANT) * self.rate))
        if due < state.next_frame:
            return state
        (name,) = self.tracker.tags
        pose = np.asarray(object, dtype=float)
        state = _looked(self.tracker, state, Frame(float(time), self.drawn.picture({name: pose}, self.rng)))
        came = tuple((time + self.latency, one) for one in _measured(state, np.asarray(pusher, dtype=float)))
        return replace(state, pending=(*state.pending, *came), next_frame=due + 1)

    def arrived(self, state: SensorState, time: float) -> tuple[SensorState, tuple[Measurement, ...]]:
        assert isinstance(state, EyesState)
        here = tuple(seen for when, seen in state.pending if when <= time + INSTANT)
        return replace(state, pending=state.pending[len(here) :]), here


def _looked(tracker: Tracker, state: EyesState, frame: Frame) -> EyesState:
    after, seen = tracker.step(state.tracker, frame.picture, frame.stamp)
    return replace(state, tracker=after, seen=seen)


def _measured(state: EyesState, pusher: Array) -> list[Measurement]:
    """What the last picture showed, for a controller; the name is left to the tracker."""
    assert state.seen is not None
    return [Measurement(state.seen.stamp, one.pose, pusher) for one in state.seen.sightings.values()]
