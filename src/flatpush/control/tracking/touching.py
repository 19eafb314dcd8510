"""One finger holds a point of the object: the angle, and slowly the place along the edge, are left to the camera."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...geometry import Outline, relative, rotate, wrap_angle
from ...geometry.pose import Array
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..loop.frames import hand, predicted
from ..loop.measurement import Command, Measurement
from .law_runner import AbstractLawRunner, RunnerState

# The place at which it landed counts as so many frames: the object was seen so often before.
KNOWN = 10
# What is believed of the angle and of the place follows what is seen within these times [s]: the angle is moved on with
# the push and forgets what the model of the push does not know, the place changes only where the finger slips.
ANGLE, PLACE = 0.25, 0.6


@dataclass(frozen=True, eq=False, kw_only=True)
class TouchingState(RunnerState):
    """Of TouchingController.

    Attributes:
        place: centre of the fingertip in O, shape (2,) [m]. count: of the frames in it.
        believed: the newest frame with the pose as it is believed; None before the push begins.
    """

    place: Array
    count: float
    believed: Measurement | None = None


@dataclass(frozen=True, eq=False)
class TouchingController(AbstractLawRunner[TouchingState]):
    """Runs the law of one push with the pose of an object that one finger touches and turns with.

    While it sticks the fingertip stays where it is on the object, and where the fingertip is in W is known far better
    than what a camera sees: of the pose only the angle has to be seen.

    Args:
        inner: the law. outline: of the object. tip_radius: [m].
    """

    inner: TrackingController | PathController
    outline: Outline
    tip_radius: float

    def start(self, time: float = 0.0) -> TouchingState:
        return TouchingState(
            inner=self.inner.start(time),
            place=self.model.pusher[:2],
            count=KNOWN,
        )

    def noticed(self, state: TouchingState, frame: Measurement) -> TouchingState:
        before = state.believed
        if before is None or frame.time <= before.time:
            return state
        dt = frame.time - before.time
        u = (np.asarray(frame.pusher, dtype=float) - before.pusher) / dt
        x, y, turned = (float(v) for v in before.object)
        turned = self.model.moved(x, y, turned, float(u[0]), float(u[1]), dt)[2]
        seen, count = np.asarray(frame.object, dtype=float), state.count + 1
        turned += max(1 / count, 1 - math.exp(-dt / ANGLE)) * float(wrap_angle(seen[2] - turned))
        share = max(1 / count, 1 - math.exp(-dt / PLACE))
        place = state.place + share * (relative(seen, frame.pusher)[:2] - state.place)
        place = self._touching(place)
        return replace(state, place=place, count=count, believed=self._at(frame, turned, place))

    def act(self, state: TouchingState, time: float) -> tuple[TouchingState, Command]:
        seen = state.seen
        assert seen.frame is not None
        if state.believed is None:
            # It landed where the place is, with the hand at the contact's angle.
            here = hand(seen.frame, seen.told, time)
            landed = self._at(
                Measurement(time, here, here), float(here[2] - self.model.pusher[2]), state.place
            )
            state = replace(state, believed=landed)
        assert state.believed is not None
        pose = predicted(state.believed, seen.told, time, self.model)
        below = replace(state.inner, seen=seen)
        return self.ran(state, *self.inner.follow(below, pose, time))  # type: ignore[arg-type]

    def _touching(self, place: Array) -> Array:
        """The place nearest to one at which the fingertip touches."""
        near = self.outline.nearest(place)
        normal = near.normal
        if near.corner and near.distance > 1e-9:
            normal = (near.point - place) / near.distance
        return np.asarray(near.point - self.tip_radius * normal)

    @staticmethod
    def _at(frame: Measurement, turned: float, place: Array) -> Measurement:
        """The frame with the object turned so, and the fingertip at its place."""
        return replace(frame, object=np.array([*(frame.pusher[:2] - rotate(turned, place)), turned]))
