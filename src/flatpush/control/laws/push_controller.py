"""What the laws of one push share: the pose of now from the frames, and the pusher's velocity for a motion."""

from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from ...errors import InputError
from ...geometry.pose import Array
from ..loop.controller import AbstractController, ControllerState
from ..loop.frames import Seen, after, predicted, refusal, with_command
from ..loop.measurement import STOP, Command, Measurement
from .formulas import RAMP, point_velocity
from .steering_model import SteeringModel


@dataclass(frozen=True, eq=False)
class PushState(ControllerState):
    """Of a law of one push.

    Attributes:
        seen: the newest frame, and the commands since.
    """

    seen: Seen = field(default_factory=Seen)


PushStateT = TypeVar("PushStateT", bound=PushState)


class AbstractPushController(AbstractController[PushStateT]):
    """A law for one push that sticks, in `act`; what was not measured well stops the pusher before that.

    Attributes:
        model: of the push. body: name of the object; frames of others are refused.
        stale: age at which a frame is too old [s].
    """

    model: SteeringModel
    body: str
    stale: float

    @abstractmethod
    def act(self, state: PushStateT, pose: Array, time: float) -> tuple[PushStateT, Command]:
        """The state after a tick, and the command, for an object at X_WO now."""

    def step(
        self, state: PushStateT, measurement: Measurement | None, time: float
    ) -> tuple[PushStateT, Command]:
        if state.outcome:
            return state, STOP
        if not np.isfinite(time):
            return replace(state, mode="held", note="the time is not finite"), STOP
        if measurement is not None:
            wrong = refusal(measurement, state.seen, time, self.body, self.stale)
            if wrong:
                return self._stands(state, time, "held", wrong)
            state = replace(state, seen=after(state.seen, measurement))
        frame = state.seen.frame
        if frame is None:
            return self._stands(state, time, "waiting", "no measurement yet")
        if time - frame.time > self.stale:
            return self._stands(
                state, time, "waiting", f"the last measurement is {time - frame.time:.3g} s old"
            )
        return self.act(state, predicted(state.seen, time, self.model), time)

    def moved(self, state: PushStateT, time: float, velocity: Array) -> tuple[PushStateT, Command]:
        """The state and the command of a velocity of the pusher (3,), or the end if it is not finite."""
        if not np.all(np.isfinite(velocity)):
            return replace(state, mode="done", outcome="the law gave no finite command"), STOP
        return replace(state, seen=with_command(state.seen, time, velocity)), Command(velocity)

    def check_stale(self) -> None:
        """Refuses an age that makes no sense."""
        if not (np.isfinite(self.stale) and self.stale > 0):
            raise InputError(
                "the age at which a measurement is too old is positive", key="stale", value=self.stale
            )

    @staticmethod
    def _stands(state: PushStateT, time: float, mode: str, note: str) -> tuple[PushStateT, Command]:
        seen = with_command(state.seen, time, np.zeros(3))
        return replace(state, mode=mode, note=note, seen=seen), STOP


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
