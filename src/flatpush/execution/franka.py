"""Franka Research 3 by franky: joint velocities, each held for a tenth of a second, follow a plan's joint angles.

The end effector frame is set midway between the fingertips, its z straight down and its x along the push; the third and
fifth joint are at zero, and stay there. Time is the robot's own. Where this side is killed or hangs the arm comes to
rest: the control loop in the library ends a velocity that is not renewed, and the robot one whose loop is silent.
"""

import math
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import ModuleType, TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from ..errors import InputError, MissingExtra
from ..problem import Plan
from .addresses import Address
from .arms import ARMS
from .clock import CycleClock
from .mount import TILT, Base, on_table
from .robot import Limits, RobotFault, State, Target

if TYPE_CHECKING:
    from franky import Robot as Franky

LIMITS = Limits(period=0.01, age=0.1, deviation=0.01)
PORT = 1337
CONNECT = 5.0  # patience with a host that does not answer [s]
SILENCE = 0.2  # patience between two states, on the machine's clock [s]
HOLD = 100  # a velocity holds for so long [ms]
CATCH_UP = 0.05  # an error of the joint angles is made up for in this time [s]
STEP = 1e-4  # over which speeds of the joints are differences [s]
POSTURE = 0.02  # so near the joints are to those of the plan [rad]
AT_REST = 1.0  # patience with a stop [s]
POLL = 1e-3  # [s]
MODES = {
    "Reflex": "it has a reflex error",
    "UserStopped": "it is stopped by its user",
    "Other": "it is not ready",
}


class FrankaRobot:
    """An FR3 whose control interface is active.

    Args:
        host: its address.
        base: pose of the table in the arm's base (x, y, z, yaw) [m, rad].
        limits: what may be asked for; the arm's own joints come in addition.
        connect, silence: patience, in seconds of the machine's clock.

    Raises:
        MissingExtra: without franky-control.
    """

    real = True

    def __init__(
        self,
        host: str,
        base: Base | None = None,
        limits: Limits = LIMITS,
        connect: float = CONNECT,
        silence: float = SILENCE,
    ) -> None:
        self._franky = _load()
        self._arm = ARMS["fr3"].placed(base)
        self.limits = replace(limits, arm=self._arm)
        self.clock, self.time = CycleClock(self, LIMITS.period), 0.0
        self._host, self._connect, self._silence = host, connect, silence
        self._robot: Franky | None = None
        self._state: State | None = None
        self._begun, self._joints = 0.0, np.zeros((2, 7))

    def __enter__(self) -> Self:
        try:
            socket.create_connection((self._host, PORT), self._connect).close()
        except OSError as error:
            why = error.strerror or "no answer"
            raise RobotFault(
                f"no Franka robot at {self._host}: port {PORT} does not answer within {self._connect:g} s ({why});"
                " is the control interface active?"
            ) from error
        with self._faults("the robot refuses the connection"):
            # A kernel without real-time scheduling does too, where cycles are late the robot stops.
            self._robot = self._franky.Robot(self._host, realtime_config=self._franky.RealtimeConfig.Ignore)
            tool = self._robot.state.F_T_EE.matrix
            self._begun = self._robot.state.time.to_sec()
        if abs(tool[2, 2] - 1) > TILT or math.hypot(tool[0, 3], tool[1, 3]) > 1e-4:
            raise RobotFault("the end effector frame is not on the flange's axis; set it in Desk")
        # About an axis that points down.
        turn = -math.atan2(tool[1, 0], tool[0, 0])
        self._arm = replace(self._arm, tool=float(tool[2, 3]), turn=turn)
        self.limits = replace(self.limits, arm=self._arm)
        self.newest()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.stop()
        finally:
            self._robot = self._state = None

    def state(self) -> State:
        self._connected()
        if self._state is None:
            raise RobotFault("the robot is not connected")
        return self._state

    def send(self, target: Target) -> Target:
        robot, pose = self._connected(), target.pose
        there, then = self._arm.joints(pose), self._arm.joints(pose + STEP * target.twist)
        rate = (then - there) / STEP
        angles, rates = self._joints
        rate = rate + (there - angles - self.limits.period * rates) / CATCH_UP
        rate = np.clip(rate, -self._arm.speeds, self._arm.speeds)
        with self._faults("the robot ended the motion"):
            robot.move(self._franky.JointVelocityMotion(rate, self._franky.Duration(HOLD)), asynchronous=True)
        return target

    def stop(self) -> None:
        """Decelerates and waits until it rests; a robot that is gone has stopped by itself."""
        robot = self._robot
        if robot is None:
            return
        try:
            if robot.is_in_control:
                robot.move(self._franky.JointVelocityStopMotion(), asynchronous=True)
            patience = time.monotonic() + AT_REST
            while robot.is_in_control and time.monotonic() < patience:
                time.sleep(POLL)
            robot.poll_motion()
            self.newest()
        except (self._franky.Exception, RuntimeError, RobotFault):
            # It tells of the motion that was ended once, and is ready for the next.
            return

    def newest(self) -> None:
        """The newest state."""
        if self._robot is None:
            return
        with self._faults("the connection is lost"):
            told = self._robot.state
        self.time = told.time.to_sec() - self._begun
        self._joints = np.array([told.q, told.dq])
        self._state = self._read(told.O_T_EE.matrix, str(told.robot_mode).rsplit(".", 1)[-1], self._state)

    def receive(self) -> None:
        """Waits for the next state.

        Raises:
            RobotFault: if none comes.
        """
        self._connected()
        last, patience = self.time, time.monotonic() + self._silence
        self.newest()
        while self.time == last:
            if time.monotonic() > patience:
                raise RobotFault(f"the robot has been silent for {self._silence:g} s")
            time.sleep(POLL)
            self.newest()

    def _read(self, tool: np.ndarray, mode: str, before: State | None) -> State:
        last = 0.0 if before is None else float(before.pose[3])
        pose = on_table(self._arm.base, tool[:3, 3].tolist(), math.atan2(tool[1, 0], tool[0, 0]), last)
        if before is None:
            pose = self._arm.counted(pose, float(self._joints[0, -1]))
        twist = np.zeros(4) if before is None else before.twist
        if before is not None and self.time > before.stamp:
            twist = (pose - before.pose) / (self.time - before.stamp)
        fault = MODES.get(mode, "")
        if tool[2, 2] > -1 + TILT:
            fault = fault or "the tool does not point straight down"
        elif not self._arm.unreachable(pose):
            off = np.max(np.abs(self._joints[0] - self._arm.joints(pose)))
            if off > POSTURE:
                fault = fault or "its third and fifth joint are not at zero, where a plan has them"
        return State(pose, twist, self.time, fault)

    def _connected(self) -> "Franky":
        if self._robot is None:
            raise RobotFault("the robot is not connected")
        return self._robot

    @contextmanager
    def _faults(self, what: str) -> Iterator[None]:
        """The library's errors as ours."""
        try:
            yield
        except (self._franky.Exception, RuntimeError) as error:
            raise RobotFault(f"{what}: {error}") from error


def _load() -> ModuleType:
    try:
        import franky
    except ImportError:
        raise MissingExtra('a Franka robot needs franky-control: pip install "flatpush[franka]"') from None
    return franky


def franka(address: Address, plan: Plan) -> FrankaRobot:
    """`franka://HOST?connect=S&silence=S`"""
    if not address.host:
        raise InputError("a Franka robot has an address", value=address.text, hint="franka://HOST")
    limits = address.limits(LIMITS)
    connect, silence = address.patience(CONNECT, SILENCE)
    address.check_used(port=False)
    base = address.base if any(address.base) else None
    return FrankaRobot(address.host, base, limits, connect, silence)
