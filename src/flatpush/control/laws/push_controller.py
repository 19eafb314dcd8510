"""What the laws of one push share: the pose of now from the frames, and the pusher's velocity for a motion."""

from abc import abstractmethod
from typing import TypeVar

import numpy as np

from ...geometry.pose import Array
from ..loop.controller import AbstractController, ControllerState
from ..loop.frames import predicted
from ..loop.measurement import Command
from .formulas import RAMP, point_velocity
from .steering_model import SteeringModel

PushStateT = TypeVar("PushStateT", bound=ControllerState)


class AbstractPushController(AbstractController[PushStateT]):
    """A law for one push that sticks, in `follow`.

    Attributes:
        model: of the push.
    """

    model: SteeringModel

    @abstractmethod
    def follow(self, state: PushStateT, pose: Array, time: float) -> tuple[PushStateT, Command]:
        """The state after a tick that begins at `time` [s], and the command, for an object at a pose X_WO now."""

    def act(self, state: PushStateT, time: float) -> tuple[PushStateT, Command]:
        assert state.seen.frame is not None
        return self.follow(state, predicted(state.seen.frame, state.seen.told, time, self.model), time)


def pusher_velocity(
    model: SteeringModel, pose: Array, speed: float, omega: float, dt: float, hold: int = RAMP
) -> Array:
    """Of the pusher in W, shape (3,), for a flat speed and ω of an object at X_WO, held for dt; see gains.Hold."""
    angle = float(pose[2])
    heading, (ax, ay) = angle + model.heading, model.arm
    ux, uy = point_velocity(heading, speed, omega, float(ax), float(ay), angle, dt, hold)
    across, middle = model.across(speed, omega), heading + 0.5 * omega * dt
    return np.array(
        [ux - across * np.sin(middle), uy + across * np.cos(middle), omega if model.turns else 0.0]
    )
