"""How the object's pose is seen: a camera that takes frames at a rate, late, with noise, and that drops some."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from .measurement import Measurement

# A frame is taken when the clock is within this of its instant [s].
INSTANT = 1e-9


@dataclass(frozen=True)
class Camera:
    """What a camera is like.

    Attributes:
        rate: frames per second [Hz].
        latency: from the exposure of a frame to its arrival [s].
        position, angle: standard deviations of the pose that is seen, each axis [m], and of its angle [rad];
            independent from frame to frame.
        dropped: the share of frames that never arrive, at least 0 and less than 1.

    Raises:
        InputError: for a rate that is not positive, a negative or non-finite number, or a camera that drops all.
    """

    rate: float = 30.0
    latency: float = 0.1
    position: float = 0.0003
    angle: float = float(np.deg2rad(0.3))
    dropped: float = 0.0

    def __post_init__(self) -> None:
        for name in ("latency", "position", "angle", "dropped"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError("a finite number, 0 or more, is needed", key=f"camera.{name}", value=value)
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise InputError("the rate of a camera is positive", key="camera.rate", value=self.rate)
        if self.dropped >= 1:
            raise InputError(
                "a camera that drops every frame sees nothing", key="camera.dropped", value=self.dropped
            )

    @property
    def covariance(self) -> Array:
        """Of the noise of one frame (x, y, θ), shape (3, 3)."""
        return np.diag([self.position**2, self.position**2, self.angle**2])


@dataclass(frozen=True)
class SensorState:
    """Frames on their way.

    Attributes:
        pending: times at which they come [s], and the frames.
        next_frame: number of the next one to be taken.
    """

    pending: tuple[tuple[float, Measurement], ...] = ()
    next_frame: int = 0


class AbstractSensor(ABC):
    """Whatever sees the object: a camera, or a simulated one.

    Laws: frames come in the order of their exposure; each comes once; none comes before its exposure.
    """

    @abstractmethod
    def start(self) -> SensorState:
        """The state before the first frame."""

    def expose(self, state: SensorState, time: float, object: ArrayLike, pusher: ArrayLike) -> SensorState:
        """Shows the object X_WO and the pusher X_WE at a time [s] to a simulated sensor; others look for themselves."""
        return state

    @abstractmethod
    def arrived(self, state: SensorState, time: float) -> tuple[SensorState, tuple[Measurement, ...]]:
        """The frames that have come since the last call, by a time [s]."""


@dataclass(frozen=True, eq=False)
class SimulatedSensor(AbstractSensor):
    """A camera that looks at a simulated object; frames are taken at 0, 1/rate, 2/rate, …

    Args:
        camera: what it is like.
        rng: for noise and dropped frames.

    >>> sensor = SimulatedSensor(Camera(rate=10, latency=0.2), np.random.default_rng(0))
    >>> state = sensor.expose(sensor.start(), 0.0, [0, 0, 0], [-0.02, 0, 0])
    >>> state, early = sensor.arrived(state, 0.1)
    >>> state, late = sensor.arrived(state, 0.2)
    >>> len(early), len(late), late[0].time
    (0, 1, 0.0)
    """

    camera: Camera
    rng: np.random.Generator

    def start(self) -> SensorState:
        return SensorState()

    def expose(self, state: SensorState, time: float, object: ArrayLike, pusher: ArrayLike) -> SensorState:
        """Shows the object X_WO and the pusher X_WE at a time [s]; a frame is taken if one is due.

        Of several instants that have passed unseen, only the last is taken, with the time of now.
        """
        due = int(np.floor((time + INSTANT) * self.camera.rate))
        if due < state.next_frame:
            return state
        noise = self.rng.standard_normal(3) * (self.camera.position, self.camera.position, self.camera.angle)
        lost = self.rng.random() < self.camera.dropped
        pending = state.pending
        if not lost:
            seen = Measurement(
                float(time), np.asarray(object, dtype=float) + noise, np.asarray(pusher, dtype=float)
            )
            pending = (*pending, (time + self.camera.latency, seen))
        return SensorState(pending, due + 1)

    def arrived(self, state: SensorState, time: float) -> tuple[SensorState, tuple[Measurement, ...]]:
        here = tuple(seen for when, seen in state.pending if when <= time + INSTANT)
        return SensorState(state.pending[len(here) :], state.next_frame), here
