"""Whose time it is: the machine's, a simulation's, or that of a robot's cycles."""

import time
from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """Tells the time [s] and waits."""

    def now(self) -> float:
        """The time [s], from any origin."""
        ...

    def wait(self, until: float) -> None:
        """Comes back at the time `until` [s] or later; at once if it has passed."""
        ...


class WallClock:
    """The machine's."""

    def now(self) -> float:
        """The time [s]."""
        return time.monotonic()

    def wait(self, until: float) -> None:
        """Sleeps until a time [s]."""
        left = until - time.monotonic()
        if left > 0:
            time.sleep(left)


class SimulatedClock:
    """Of a simulation that is moved on while one waits, as fast as the machine can.

    Args:
        advance: moves the simulation on to a time.
    """

    def __init__(self, advance: Callable[[float], None]) -> None:
        self._advance, self._time = advance, 0.0

    def now(self) -> float:
        """The time [s] since the simulation began."""
        return self._time

    def wait(self, until: float) -> None:
        """Moves the simulation on until a time [s]."""
        if until > self._time:
            self._advance(until)
            self._time = until


class Cycles(Protocol):
    """A controller that tells its time with every message."""

    time: float

    def newest(self) -> None:
        """Passes over what has come already."""
        ...

    def receive(self) -> None:
        """Waits for the next message."""
        ...


class CycleClock:
    """The controller's: it goes on only while messages come.

    Args:
        period: of the messages [s].
    """

    def __init__(self, controller: Cycles, period: float) -> None:
        self._controller, self._period = controller, period

    def now(self) -> float:
        self._controller.newest()
        return self._controller.time

    def wait(self, until: float) -> None:
        while self._controller.time < until - 0.5 * self._period:
            self._controller.receive()
