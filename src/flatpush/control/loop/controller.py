"""What every controller of a push is: a state, and a step from state, measurement and time to state and command."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, TypeVar

from .measurement import Command, Measurement

#: Outcome of a controller that is where it should be.
ARRIVED = "arrived"


@dataclass(frozen=True, eq=False)
class ControllerState:
    """What a controller remembers from step to step; each controller adds its own to it.

    Attributes:
        mode: what it does now, in a word: "waiting" for a first or newer measurement, "tracking", "path", "saturated",
            "guarded", "held" (a measurement was refused: the pusher stands), "transit", "done".
        note: why, for people; "" where there is nothing to say.
        outcome: "" while it is under way, "arrived", or why it gave up.
    """

    mode: str = "waiting"
    note: str = ""
    outcome: str = ""


StateT = TypeVar("StateT", bound=ControllerState)


class AbstractController(ABC, Generic[StateT]):
    """Moves the pusher so that the object goes where it should.

    Laws: a command is finite, whatever was measured; without a measurement that is finite, new, young enough and of
    the right object the pusher stands still (mode "waiting" or "held"); once the state has an outcome, every further
    command is a stop. A step depends on its arguments alone, and states are not changed.
    """

    #: Steps per second [Hz]; commands hold for 1/rate.
    rate: float

    @abstractmethod
    def start(self, time: float = 0.0) -> StateT:
        """The state before the first measurement, at a time [s]."""

    @abstractmethod
    def step(self, state: StateT, measurement: Measurement | None, time: float) -> tuple[StateT, Command]:
        """The state after a tick, and what the pusher shall do until the next.

        Args:
            measurement: the newest frame that came since the last tick, or None. It may be older than now.
            time: now [s].
        """
