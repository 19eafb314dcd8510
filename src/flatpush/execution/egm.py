"""ABB's Externally Guided Motion over UDP: every 4 ms the controller says where its tool is and is told where to go.

RobotWare 6 and 7 speak it; RAPID's EGMRunPose must be running, with the tool centre point between the fingertips, its
z down and its x along the push. Each message is answered, and time is the controller's: it goes on only while messages
come.
"""

import math
import socket
import sys
import time
from importlib import import_module
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from ..errors import InputError, MissingExtra
from ..geometry import rotate
from ..problem import Plan
from .addresses import Address
from .arms import Arm
from .clock import CycleClock
from .mount import TILT, in_base, on_table
from .robot import Limits, RobotFault, State, Target

if TYPE_CHECKING:
    from abb_robot_client.egm import EGM, EGMRobotState

PORT = 6510
# A tool follows with a lag of some tens of milliseconds.
LIMITS = Limits(period=0.004, age=0.1, deviation=0.02)
CONNECT = 5.0  # patience with a controller that does not send yet [s]
SILENCE = 0.1  # patience with one that has sent, on the machine's clock [s]
# RobotWare → library, and the extra that brings it.
LIBRARIES = {6: ("abb_robot_client.egm", "abb"), 7: ("ABBRobotEGM.egm", "abb7")}
TURNOVER = 2**32  # of the controller's milliseconds


class EgmRobot:
    """An arm behind an EGM port.

    Args:
        host: the controller's address; messages from others are refused. "": anyone's.
        port: on which this machine listens.
        base: pose of the table in the frame in which the controller gives its poses (x, y, z, yaw) [m, rad].
        limits: what may be asked for.
        connect, silence: patience, in seconds of the machine's clock.
        robotware: 6 (by abb-robot-client) or 7 (by ABBRobotEGM); one process can speak to one kind only.

    Raises:
        MissingExtra: without the library.
        InputError: for another version, or after the other one was used.
    """

    real = True

    def __init__(
        self,
        host: str = "",
        port: int = PORT,
        base: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
        limits: Limits = LIMITS,
        connect: float = CONNECT,
        silence: float = SILENCE,
        robotware: int = 6,
    ) -> None:
        self._client = _load(robotware)
        self.limits, self.clock, self.time = limits, CycleClock(self, LIMITS.period), 0.0
        self._host, self._port, self._connect, self._silence = host, port, connect, silence
        self._base = base
        self._egm: EGM | None = None
        self._state: State | None = None
        self._begun: int | None = None
        self._held: Target | None = None
        self._answered = True

    def __enter__(self) -> Self:
        try:
            # The library leaves its socket open where it cannot be bound.
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind(("", self._port))
            self._egm = self._client(self._port)
        except OSError as error:
            raise RobotFault(f"UDP port {self._port} cannot be listened on ({error.strerror})") from error
        begun = time.monotonic()
        try:
            while self._state is None:
                left = self._connect - (time.monotonic() - begun)
                if left <= 0:
                    who = self._host or "any address"
                    raise RobotFault(
                        f"no EGM message from {who} on UDP port {self._port} within {self._connect:g} s; is EGMRunPose"
                        " running, and does its device point to this machine?"
                    )
                self._take(left)
        except BaseException:
            self._close()
            raise
        self._held = Target(self.time, self._state.pose, np.zeros(4))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        self._close()

    def state(self) -> State:
        if self._egm is None or self._state is None:
            raise RobotFault("the robot is not connected")
        return self._state

    def send(self, target: Target) -> Target:
        self.state()
        self._held = target
        self._answer(target)
        return target

    def stop(self) -> None:
        """Tells the controller to stay where the tool is; where nobody listens its own time-out stops it."""
        if self._egm is None or self._state is None:
            return
        self._held = Target(self.time, self._state.pose, np.zeros(4))
        self._answer(self._held)

    def receive(self) -> None:
        """Waits for the next message; one that was not answered is answered with what was sent last.

        Raises:
            RobotFault: if none comes.
        """
        if not self._answered and self._held is not None:
            self._answer(Target(self.time, self._held.pose, np.zeros(4)))
        begun = self.time
        patience = time.monotonic() + self._silence
        while self.time == begun:
            left = patience - time.monotonic()
            if left <= 0:
                raise RobotFault(f"the controller has been silent for {self._silence:g} s")
            self._take(left)

    def newest(self) -> None:
        """Passes over messages that have waited."""
        if self._egm is not None:
            while self._take(0.0):
                pass

    def _take(self, wait: float) -> bool:
        """The next message, if one comes in time from the right address."""
        if self._egm is None:
            raise RobotFault("the robot is not connected")
        came, found = self._egm.receive_from_robot(wait)
        if not came or (self._host and self._egm.egm_addr[0] != self._host):
            return False
        header = found.robot_message.header
        if self._begun is None:
            self._begun = header.tm
        self.time = ((header.tm - self._begun) % TURNOVER) / 1000
        self._answered = False
        self._state = self._read(found, self._state)
        return True

    def _read(self, found: "EGMRobotState", before: State | None) -> State:
        if found.cartesian is None:
            return State(
                np.full(4, np.nan),
                np.zeros(4),
                self.time,
                "the controller sends no pose; EGMRunPose is needed",
            )
        place, turn = found.cartesian[:2]  # RobotWare 7 adds Euler angles
        # Rz(yaw) Rx(π) = (0, cos yaw/2, sin yaw/2, 0)
        yaw = 2 * math.atan2(turn[2], turn[1])
        last = before.pose[3] if before is not None and np.isfinite(before.pose[3]) else 0.0
        pose = on_table(self._base, [v / 1000 for v in place], yaw, last)
        arm, joints = self.limits.arm, found.joint_angles
        if before is None and isinstance(arm, Arm) and joints is not None and len(joints) == len(arm.speeds):
            pose = arm.counted(pose, math.radians(joints[-1]))
        twist = np.zeros(4)
        if before is not None and self.time > before.stamp:
            twist = (pose - before.pose) / (self.time - before.stamp)
        fault = "" if found.motors_on else "the motors are off"
        fault = fault or ("" if found.rapid_running else "RAPID is not running")
        if abs(turn[0]) + abs(turn[3]) > TILT:
            fault = fault or "the tool does not point straight down"
        return State(pose, twist, self.time, fault)

    def _answer(self, target: Target) -> None:
        if self._egm is None:
            return
        x, y, z, yaw = in_base(self._base, target.pose)
        place = 1000 * np.array([x, y, z])
        turn = np.array([0.0, math.cos(yaw / 2), math.sin(yaw / 2), 0.0])
        speed = np.zeros(6)
        speed[:2] = 1000 * rotate(self._base[3], target.twist[:2])
        speed[2], speed[5] = 1000 * target.twist[2], math.degrees(target.twist[3])
        self._egm.send_to_robot_cart(place, turn, speed)
        self._answered = True

    def _close(self) -> None:
        if self._egm is not None:
            self._egm.close()
        self._egm = None


def _load(robotware: int) -> "type[EGM]":
    if robotware not in LIBRARIES:
        raise InputError("robotware is 6 or 7", value=robotware)
    module, extra = LIBRARIES[robotware]
    other = LIBRARIES[13 - robotware][0]
    if other in sys.modules:
        raise InputError(
            f"RobotWare {13 - robotware} was spoken to in this process, and both register the same messages",
            hint="Start another process.",
        )
    try:
        found: type[EGM] = import_module(module).EGM
    except ImportError:
        raise MissingExtra(
            f'Externally Guided Motion with RobotWare {robotware} needs a library: pip install "flatpush[{extra}]"'
        ) from None
    return found


def egm(address: Address, plan: Plan) -> EgmRobot:
    """`egm://HOST:PORT?connect=S&silence=S&robotware=7&arm=irb120`"""
    limits = address.limits(LIMITS)
    connect, silence = address.patience(CONNECT, SILENCE)
    robotware = round(address.numbers("robotware", 1, (6,))[0])
    limits = address.with_arm(limits)
    address.check_used()
    if address.port == 0:
        raise InputError(
            "a controller sends to a port from 1 to 65535",
            value=address.text,
            hint=f"Its usual one is {PORT}.",
        )
    return EgmRobot(address.host, address.port or PORT, address.base, limits, connect, silence, robotware)
