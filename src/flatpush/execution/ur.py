"""Universal Robots by RTDE: the program of ur-rtde on the controller is sent a pose every 8 ms, which `servoL` follows.

The tool centre point is midway between the fingertips at their height, its z down and its x along the push. Time is the
controller's: it goes on only while its states come. A watchdog on the controller stops the arm where no target comes
for a tenth of a second.
"""

import math
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from ..errors import InputError, MissingExtra
from ..problem import Plan
from .addresses import Address
from .arms import Arm
from .clock import CycleClock
from .mount import TILT, in_base, on_table
from .robot import Limits, RobotFault, State, Target

if TYPE_CHECKING:
    from rtde_control import RTDEControlInterface
    from rtde_receive import RTDEReceiveInterface

# 125 Hz suits every generation. servoL smooths over LOOKAHEAD and so lags by about that much.
LIMITS = Limits(period=0.008, age=0.1, deviation=0.03)
LOOKAHEAD, GAIN = 0.1, 300.0  # of servoL [s], [1]: the controller's own defaults
DECELERATION = 2.0  # of a stop [m/s²]
CONNECT = 5.0  # patience with a host that does not answer [s]
SILENCE = 0.1  # patience between two states, on the machine's clock [s]
# Least rate of commands [Hz]: the program stops in the twelfth cycle without one, after 96 ms (10 Hz: 104 ms).
WATCHDOG = 11.0
# At rest they are kept alive so often [s].
KEPT = 0.02
PORTS = {29999: "dashboard", 30003: "script port", 30004: "RTDE"}
PLAYING = 2  # runtime state of a program that runs
# Safety modes in which it does not move.
STOPS = {
    3: "a protective stop",
    4: "recovery mode",
    5: "a safeguard stop",
    6: "an emergency stop",
    7: "an emergency stop",
    8: "a safety violation",
    9: "a safety fault",
}
POLL = 2e-4  # [s]


class UrRobot:
    """An arm behind a UR controller of the CB3 or e-Series.

    Args:
        host: the controller's address.
        base: pose of the table in the arm's base (x, y, z, yaw) [m, rad].
        limits: what may be asked for.
        connect, silence: patience, in seconds of the machine's clock.

    Raises:
        MissingExtra: without ur-rtde.
    """

    real = True

    def __init__(
        self,
        host: str,
        base: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
        limits: Limits = LIMITS,
        connect: float = CONNECT,
        silence: float = SILENCE,
    ) -> None:
        _load()
        self.limits, self.clock, self.time = limits, CycleClock(self, LIMITS.period), 0.0
        self._host, self._base, self._connect, self._silence = host, base, connect, silence
        self._control: RTDEControlInterface | None = None
        self._receive: RTDEReceiveInterface | None = None
        self._begun, self._yaw, self._streaming = 0.0, 0.0, False
        self._line, self._keeper, self._closing = threading.Lock(), threading.Thread(), threading.Event()

    def __enter__(self) -> Self:
        control, receive = _load()
        _answers(self._host, self._connect)
        rate = 1 / LIMITS.period
        with _faults("the controller was reached but does not work with ur-rtde"):
            self._receive = receive(self._host, rate)
            self._control = control(self._host, rate)
        self._begun = self._receive.getTimestamp()
        if isinstance(self.limits.arm, Arm):
            angle = self._receive.getActualQ()[-1]
            self._yaw = float(self.limits.arm.counted(self.state().pose, angle)[3])
        self.newest()
        self._closing.clear()
        self._keeper = threading.Thread(target=self._keep, daemon=True)
        self._keeper.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.stop()
        finally:
            self._closing.set()
            if self._keeper.is_alive():
                self._keeper.join()
            control, receive = self._control, self._receive
            alive, self._control, self._receive = control is not None and self._alive(), None, None
            with _faults("the connection could not be closed"):
                if control is not None:
                    if alive:
                        control.stopScript()
                    control.disconnect()
                if receive is not None:
                    receive.disconnect()

    def state(self) -> State:
        _, receive = self._connected()
        with _faults("the controller's state cannot be read"):
            x, y, z, *turn = receive.getActualTCPPose()
            speed = receive.getActualTCPSpeed()
            safety, running = receive.getSafetyMode(), receive.getRuntimeState() == PLAYING
        # Rz(yaw) Rx(π) is half a turn about (cos yaw/2, sin yaw/2, 0).
        pose = on_table(self._base, (x, y, z), 2 * math.atan2(turn[1], turn[0]), self._yaw)
        self._yaw = float(pose[3])
        vx, vy, vz, _, _, spin = speed
        c, s = math.cos(self._base[3]), math.sin(self._base[3])
        twist = np.array([c * vx + s * vy, c * vy - s * vx, vz, spin])
        fault = STOPS.get(safety, "") or ("" if running else "its program was stopped")
        if abs(turn[2]) > TILT * math.pi or abs(math.hypot(*turn) - math.pi) > TILT:
            fault = fault or "the tool does not point straight down"
        return State(pose, twist, self.time, fault)

    def send(self, target: Target) -> Target:
        control, _ = self._connected()
        x, y, z, yaw = in_base(self._base, target.pose)
        place = [x, y, z, math.pi * math.cos(yaw / 2), math.pi * math.sin(yaw / 2), 0.0]
        with self._line, _faults("the controller takes no targets"):
            if not self._streaming:
                control.setWatchdog(WATCHDOG)
                self._streaming = True
            if not control.servoL(place, 0.0, 0.0, self.limits.period, LOOKAHEAD, GAIN):
                raise RobotFault("the controller takes no targets: its program was stopped")
        return target

    def stop(self) -> None:
        """Decelerates; a controller that is silent or gone is stopped by its own watchdog."""
        control, streaming = self._control, self._streaming
        self._streaming = False
        # The client waits for minutes for the answer of a controller that has gone silent.
        if control is not None and streaming and self._alive() and control.isProgramRunning():
            with self._line, _faults("the controller takes no stop"):
                control.servoStop(DECELERATION)

    def newest(self) -> None:
        """The time of the newest state."""
        if self._receive is not None:
            self.time = self._receive.getTimestamp() - self._begun

    def receive(self) -> None:
        """Waits for the next state.

        Raises:
            RobotFault: if none comes.
        """
        _, receive = self._connected()
        last, patience = self.time, time.monotonic() + self._silence
        self.newest()
        while self.time == last:
            if time.monotonic() > patience or not receive.isConnected():
                raise RobotFault(f"the controller has been silent for {self._silence:g} s")
            time.sleep(POLL)
            self.newest()

    def _alive(self) -> bool:
        try:
            self.receive()
        except RobotFault:
            return False
        return True

    def _keep(self) -> None:
        """While nothing is sent the watchdog is kept quiet."""
        while not self._closing.wait(KEPT):
            with self._line:
                if not self._streaming and self._control is not None and self._alive():
                    self._control.kickWatchdog()

    def _connected(self) -> "tuple[RTDEControlInterface, RTDEReceiveInterface]":
        if self._control is None or self._receive is None:
            raise RobotFault("the robot is not connected")
        return self._control, self._receive


@contextmanager
def _faults(what: str) -> Iterator[None]:
    """The client's errors as ours."""
    try:
        yield
    except RuntimeError as error:
        raise RobotFault(f"{what}: {error}") from error


def _answers(host: str, patience: float) -> None:
    """Compares that the controller is there; the client itself would wait for it for ever."""
    for port, name in PORTS.items():
        try:
            with socket.create_connection((host, port), patience) as line:
                line.settimeout(patience)
                if name == "dashboard" and b"Dashboard" not in line.recv(200):
                    raise RobotFault(f"what answers at {host} on port {port} is no UR controller")
        except OSError as error:
            why = error.strerror or "no answer"
            raise RobotFault(
                f"no UR controller at {host}: its {name}, port {port}, does not answer within {patience:g} s ({why})"
            ) from error


def _load() -> "tuple[type[RTDEControlInterface], type[RTDEReceiveInterface]]":
    try:
        from rtde_control import RTDEControlInterface
        from rtde_receive import RTDEReceiveInterface
    except ImportError:
        raise MissingExtra('an arm of Universal Robots needs ur-rtde: pip install "flatpush[ur]"') from None
    return RTDEControlInterface, RTDEReceiveInterface


def ur(address: Address, plan: Plan) -> UrRobot:
    """`ur://HOST?connect=S&silence=S&arm=ur5e`"""
    if not address.host:
        raise InputError("an arm of Universal Robots has an address", value=address.text, hint="ur://HOST")
    limits = address.limits(LIMITS)
    connect, silence = address.patience(CONNECT, SILENCE)
    limits = address.with_arm(limits)
    address.check_used(port=False)
    return UrRobot(address.host, address.base, limits, connect, silence)
