"""What every controller of a push is: a state, and a step from state, measurement and time to state and command."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Generic, Self, TypeVar

import numpy as np

from ...errors import InputError
from .frames import Seen, after, hand, refusal, with_command
from .limits import Limits
from .measurement import Command, Measurement

#: Outcome of a controller that is where it should be.
ARRIVED = "arrived"


@dataclass(frozen=True, eq=False)
class ControllerState:
    """What a controller remembers from step to step; each controller adds its own to it.

    Attributes:
        mode: what it does now, in a word: "waiting" for a first or newer measurement, "tracking", "path", "saturated",
            "guarded", "held" (a measurement was refused: the pusher stops), "looking", "transit", "done".
        note: why, for people; "" where there is nothing to say.
        outcome: "" while it is under way, "arrived", or why it gave up.
        ending: the outcome that it will have when the pusher stands.
        seen: the newest frame, and the commands since.
        turned: by which the hand is taken to be turned farther than frames tell: its fingertips are alike [rad].
    """

    mode: str = "waiting"
    note: str = ""
    outcome: str = ""
    ending: str = ""
    seen: Seen = field(default_factory=Seen)
    turned: float = 0.0


StateT = TypeVar("StateT", bound=ControllerState)


class AbstractController(ABC, Generic[StateT]):
    """Moves the pusher so that the object goes where it should.

    Laws: a command is finite, and within the limits if there are any, whatever was measured; without a measurement that
    is finite, possible, new, young enough and of the right object the pusher comes to a stop (mode "waiting" or
    "held"); it stands once the state has an outcome. A step depends on its arguments alone, and states are not changed.

    A controller says in `act` what it wants; `step` is the same for all.

    Attributes:
        rate: steps per second [Hz]; commands hold for 1/rate.
        body: name of the object; frames of others are refused.
        stale: age at which a frame is too old [s].
        limits: what the hand may do; None: anything.
        noise: standard deviations of a frame's position [m] and angle [rad], beyond which a jump is impossible.
    """

    rate: float
    body: str = ""
    stale: float = 0.5
    limits: Limits | None = None
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    @abstractmethod
    def start(self, time: float = 0.0) -> StateT:
        """The state before the first measurement, at a time [s].

        Raises:
            InputError: for a time that is not finite.
        """

    @abstractmethod
    def act(self, state: StateT, time: float) -> tuple[StateT, Command]:
        """The state after a tick that begins at `time` [s], and what the pusher should do, from frames that are good
        and young; see `step`."""

    def with_yaws(self, yaws: tuple[float, float], alike: tuple[float, ...]) -> Self:
        """The same for a hand that has these yaws only, from the least to the greatest, whole turns counted, and whose
        fingertips are alike after some turns, best first [rad]; a controller that cannot choose is itself."""
        return self

    def noticed(self, state: StateT, frame: Measurement) -> StateT:
        """The state after a good frame has come; it is in state.seen."""
        return state

    def step(self, state: StateT, measurement: Measurement | None, time: float) -> tuple[StateT, Command]:
        """The state after a tick, and what the pusher shall do until the next.

        Args:
            measurement: the newest frame that came since the last tick, or None. It may be older than now.
            time: now [s].
        """
        if not np.isfinite(time):
            told = state.seen.told
            now = told[-1][0] + 1 / self.rate if told else 0.0
            return self._stopping(state, now, "held", "the time is not finite")
        if state.outcome or state.ending:
            return self._commanded(state, self._standing(state), time)
        if measurement is not None:
            if state.turned != 0:
                measurement = measurement.with_hand_turned(state.turned)
            wrong = refusal(measurement, state.seen, time, self.body, self.stale)
            before = state.seen.frame
            if not wrong and self.limits is not None and before is not None:
                wrong = self.limits.impossible(before, measurement, self.noise)
            if wrong:
                return self._stopping(state, time, "held", wrong)
            state = replace(state, seen=after(state.seen, measurement))
            state = self.noticed(state, measurement)
        frame = state.seen.frame
        if frame is None:
            return self._stopping(state, time, "waiting", "no measurement yet")
        if time - frame.time > self.stale:
            age = f"the last measurement is {time - frame.time:.3g} s old"
            return self._stopping(state, time, "waiting", age)
        return self._commanded(*self.act(state, time), time)

    def check_stale(self) -> None:
        """Refuses an age that makes no sense.

        Raises:
            InputError: for one that is not positive.
        """
        if not (np.isfinite(self.stale) and self.stale > 0):
            raise InputError(
                "the age at which a measurement is too old is positive", key="stale", value=self.stale
            )

    @staticmethod
    def _standing(state: StateT) -> Command:
        return Command(np.zeros(3), state.seen.height)

    def _stopping(self, state: StateT, time: float, mode: str, note: str) -> tuple[StateT, Command]:
        if not (state.outcome or state.ending):
            state = replace(state, mode=mode, note=note)
        return self._commanded(state, self._standing(state), time)

    def _commanded(self, state: StateT, wanted: Command, time: float) -> tuple[StateT, Command]:
        """What is wanted within the limits; an outcome counts from when the pusher stands."""
        if not (np.all(np.isfinite(wanted.velocity)) and np.isfinite(wanted.height)):
            wrong = "the law gave no finite command"
            state, wanted = replace(state, mode="done", outcome=wrong), self._standing(state)
        seen, dt = state.seen, 1 / self.rate
        command = wanted
        if self.limits is not None:
            yaw = 0.0 if seen.frame is None else float(hand(seen.frame, seen.told, time)[2])
            command = self.limits.kept(seen.last, seen.climb, wanted, yaw, dt)
        stands = not np.any(command.velocity) and command.height == seen.height
        outcome = state.outcome or state.ending
        return (
            replace(
                state,
                seen=with_command(seen, time, command, dt),
                outcome=outcome if stands else "",
                ending=outcome,
            ),
            command,
        )
