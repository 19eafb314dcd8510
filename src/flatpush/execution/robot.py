"""What a robot must offer to push: say where its tool is, take targets for it, and stop."""

import math
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Protocol, Self

import numpy as np

from ..errors import FlatpushError, InputError
from ..geometry.pose import Array


class RobotFault(FlatpushError):
    """A robot that cannot go on: it is not there, does not answer, or says so itself."""


class OutOfLimits(InputError):
    """A motion that a robot may not make; the message names the segment, the time and the limit."""


class Jointed(Protocol):
    """What an arm knows of its joints (see `arms.Arm`)."""

    @property
    def speeds(self) -> Array:
        """Their greatest speeds, shape (k,) [rad/s]."""
        ...

    def unreachable(self, pose: Array) -> str:
        """Why it cannot take a pose (x, y, height, yaw), or ""."""
        ...

    def joints(self, pose: Array) -> Array:
        """Joint angles at a pose that it reaches, shape (k,) [rad]."""
        ...

    def yaws(self, pose: Array) -> tuple[float, float]:
        """Least and greatest yaw that it can have at the place of a pose, whole turns counted [rad]."""
        ...


@dataclass(frozen=True)
class Limits:
    """What a robot may be asked for, in the table frame W.

    Attributes:
        workspace: (xmin, ymin, xmax, ymax) in which E's origin stays [m].
        heights: least and greatest height of the fingertips above the table [m].
        speed, acceleration: of E's origin, rising included [m/s], [m/s²].
        turn_rate: of the hand [rad/s].
        period: of targets [s].
        age: greatest age of the feedback, and greatest delay of a cycle [s].
        deviation: greatest distance between the tool and where it was sent [m].
        arm: its joints: what they reach, and how fast they are; None: all that the numbers allow.

    Raises:
        InputError: for limits that leave nothing.
    """

    workspace: tuple[float, float, float, float] = (-1.0, -1.0, 1.0, 1.0)
    heights: tuple[float, float] = (-0.0005, 0.3)
    speed: float = 0.25
    acceleration: float = 2.5
    turn_rate: float = math.pi
    period: float = 0.01
    age: float = 0.1
    deviation: float = 0.01
    arm: Jointed | None = None

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "turn_rate", "period", "age", "deviation"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError("a limit of a robot is positive and finite", key=name, value=value)
        low, high = np.array(self.workspace[:2]), np.array(self.workspace[2:])
        if len(self.workspace) != 4 or not np.all(low < high):
            raise InputError("a workspace encloses an area", key="workspace", value=self.workspace,
                             hint="Its order is xmin, ymin, xmax, ymax.")  # fmt: skip
        if len(self.heights) != 2 or not self.heights[0] < self.heights[1]:
            raise InputError("heights are the lowest and the highest", key="heights", value=self.heights)

    def tightened(
        self,
        workspace: tuple[float, float, float, float] | None = None,
        heights: tuple[float, float] | None = None,
        speed: float = math.inf,
        acceleration: float = math.inf,
        turn_rate: float = math.inf,
    ) -> "Limits":
        """The tighter of these limits and others: workspace and heights [m], speed [m/s], acceleration [m/s²] and
        turn_rate [rad/s], in W, as the attributes of the same names."""
        a, b = self.workspace, workspace or self.workspace
        low, high = heights or self.heights
        return replace(
            self,
            workspace=(max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])),
            heights=(max(self.heights[0], low), min(self.heights[1], high)),
            speed=min(self.speed, speed),
            acceleration=min(self.acceleration, acceleration),
            turn_rate=min(self.turn_rate, turn_rate),
        )

    def yaws(self, pose: Array) -> tuple[float, float]:
        """Least and greatest yaw that the hand can have at the place of a pose [rad]."""
        return (-math.inf, math.inf) if self.arm is None else self.arm.yaws(pose)

    def outside(self, pose: Array, slack: float = 0.0) -> str:
        """Why a pose (x, y, height, yaw) is no place for the tool, or "".

        Args:
            slack: by which a measured pose may be outside [m].
        """
        at = np.asarray(pose, dtype=float).tolist()  # twice in every cycle: plain numbers are compared faster
        if not all(map(math.isfinite, at)):
            return "a pose is not finite"
        for k, axis in enumerate("xy"):
            low, high = self.workspace[k], self.workspace[k + 2]
            if not low - slack <= at[k] <= high + slack:
                room = f"{1000 * low:g} to {1000 * high:g} mm"
                return f"{axis} = {1000 * at[k]:.1f} mm is outside of the workspace, {room}"
        low, high = self.heights
        if not low - slack <= at[2] <= high + slack:
            return f"a height of {1000 * at[2]:.1f} mm is outside of {1000 * low:g} to {1000 * high:g} mm"
        return "" if self.arm is None else self.arm.unreachable(pose)


@dataclass(frozen=True, eq=False)
class State:
    """Where a robot's tool is.

    Attributes:
        pose: of E in W: (x, y, height of the fingertips, yaw), yaw not wrapped, shape (4,) [m, m, m, rad].
        twist: the velocity of that, shape (4,).
        stamp: when this was measured, on the clock of the run [s].
        fault: "" while the robot is ready, else why it is not.
        wrench: what the tool presses with, (fx, fy, fz, torque) in W, shape (4,) [N, N m]; None: not measured.
    """

    pose: Array
    twist: Array
    stamp: float
    fault: str = ""
    wrench: Array | None = None


@dataclass(frozen=True, eq=False)
class Target:
    """Where the tool shall be at a time, and how fast it goes there: pose and twist as in State.

    Attributes:
        time: on the clock of the run [s]. pose: shape (4,) [m, m, m, rad]. twist: shape (4,) [m/s, m/s, m/s, rad/s].
    """

    time: float
    pose: Array
    twist: Array


class Robot(Protocol):
    """A tool that is moved: an arm, a simulated one, or one of your own. `flatpush.testing.check_robot` tests it.

    Three more attributes are used where a robot has them. `clock`: a Clock that tells its time (a simulated robot's, or
    the controller's cycles); `object`: X_WO (3,) of an object that it knows, as simulations do; `real`: False where
    nothing moves that could hurt anybody.

    Errors of the connection are RobotFault.
    """

    @property
    def limits(self) -> Limits:
        """What it may be asked for; known once it is entered."""
        ...

    def __enter__(self) -> Self:
        """Connects and checks; nothing moves."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Always stops, and lets go."""
        ...

    def state(self) -> State:
        """The newest feedback."""
        ...

    def send(self, target: Target) -> Target:
        """Goes to a target straight from where the last one led; returns what was really sent."""
        ...

    def stop(self) -> None:
        """Comes to rest; any number of times, after any fault."""
        ...
