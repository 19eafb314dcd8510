"""A simulated UR controller: dashboard, script port and RTDE (protocol version 2), a process of its own for tests.

It counts cycles of 8 ms. While a tool is servoed a cycle ends when a command came, or after a while without; else it
lasts as long as it says. The uploaded program is not interpreted: what it would do with the registers is done here. It
says that it is ready (1 in output register 0) whenever it runs, and of a command that is waited for that it is done (2)
until the command register is cleared. Its watchdog stops it if no command comes for so long. In a line for each request
on standard input it says what it saw, and after "again" it is as at the beginning; its arm is a lag of first order, or
the tool of the physics cell.
"""

import argparse
import json
import math
import select
import socket
import struct
import sys
import time

import numpy as np

from simulated_tools import Cell, Ideal

PERIOD = 0.008
DASHBOARD, SCRIPT, RTDE = 29999, 30003, 30004
STOPPED, PLAYING = 1, 2  # runtime states
READY, DONE = 1, 2  # what the program says in output register 0
# Commands in input register 0, as the client of ur-rtde 1.6 numbers them.
SERVOL, SERVO_STOP, SET_WATCHDOG, END = 24, 16, 35, 255
STREAMED = {6, 9, 10, 11, 24, 25, 26, 27, 38, 58}  # commands that are not waited for
ANSWERS = {
    "PolyscopeVersion": "URSoftware 5.11.0.108249 (Aug 17 2021)",
    "is in remote control": "true",
    "get serial number": "20215500001",
    "stop": "Stopped",
}
# Types of the variables by parts of their names, the first that fits; what is not here has six numbers.
KINDS = {
    "payload_inertia": "VECTOR6D",
    "payload_cog": "VECTOR3D",
    "tool_accelerometer": "VECTOR3D",
    "joint_mode": "VECTOR6INT32",
    "digital_input_bits": "UINT64",
    "digital_output_bits": "UINT64",
    "bit_registers": "UINT32",
    "runtime_state": "UINT32",
    "_status_bits": "UINT32",
    "int_register": "INT32",
    "robot_mode": "INT32",
    "safety_": "INT32",
    "double_register": "DOUBLE",
    "timestamp": "DOUBLE",
    "speed_": "DOUBLE",
    "momentum": "DOUBLE",
    "voltage": "DOUBLE",
    "robot_current": "DOUBLE",
    "standard_analog": "DOUBLE",
    "execution_time": "DOUBLE",
    "payload": "DOUBLE",
}
SIX = {"actual_joint_voltage"}
FORMS = {"VECTOR6D": "6d", "VECTOR3D": "3d", "DOUBLE": "d", "UINT32": "I", "UINT64": "Q", "INT32": "i"}
FORMS["VECTOR6INT32"] = "6i"


def kind(name):
    """Type of an RTDE variable."""
    if name in SIX:
        return "VECTOR6D"
    return next((found for part, found in KINDS.items() if part in name), "VECTOR6D")


class Arm:
    """The tool, the registers, and the program that would run."""

    last = 0.0  # angle of the last joint, which is told [rad]

    def __init__(self, tool):
        self.tool, self.before = tool, np.array(tool.pose)
        self.playing, self.state = False, READY
        self.servoing, self.watchdog = False, math.inf
        self.numbers, self.cycle, self.heard, self.commands = np.zeros(48), 0, 0, 0
        self.halted, self.fired, self.came = None, -1, 0

    def asked(self, command, numbers):
        """What the program does with a command."""
        self.heard, self.came = self.cycle, self.came + 1
        if not self.playing:
            return
        for k, value in numbers.items():
            self.numbers[k] = value
        if command == 0:
            self.state = READY
        elif command == SERVOL:
            self.servoing, self.commands = True, self.commands + 1
        elif command == SERVO_STOP:
            self.halt()
        elif command == SET_WATCHDOG:
            self.watchdog = 1 / self.numbers[0]
        elif command == END:
            self.halt()
            self.playing = False
        if command and command not in STREAMED:
            self.state = DONE

    def begin(self):
        """The program was uploaded."""
        self.playing, self.state, self.watchdog, self.heard = True, READY, math.inf, self.cycle

    def told(self):
        """What tests ask for."""
        far = 0.0 if self.halted is None else float(np.linalg.norm((self.tool.pose - self.halted)[:3]))
        pose = [float(v) for v in self.tool.pose]
        names = ("cycle", "commands", "fired", "heard", "playing")
        return {name: getattr(self, name) for name in names} | {
            "far": far,
            "pose": pose,
            "object": self.tool.object,
        }

    def halt(self):
        self.servoing, self.halted = False, np.array(self.tool.pose)
        self.tool.halt()

    def step(self):
        self.cycle += 1
        if self.playing and (self.cycle - self.heard) * PERIOD > self.watchdog:
            self.fired = self.cycle if self.fired < 0 else self.fired
            self.halt()
            self.playing = False
        self.before = np.array(self.tool.pose)
        target = None
        if self.servoing:
            x, y, z, *turn = self.numbers[:6]
            angle = 2 * math.atan2(turn[1], turn[0])
            near = float(self.before[3])
            target = np.array([x, y, z, near + math.remainder(angle - near, 2 * math.pi)])
        self.tool.step(target, np.zeros(4))

    def value(self, name):
        """Of an output."""
        pose = self.tool.pose
        if name == "timestamp":
            return [PERIOD * self.cycle]
        if name in ("actual_TCP_pose", "target_TCP_pose"):
            # Rz(yaw) Rx(π) as axis times angle
            return [*pose[:3], math.pi * math.cos(pose[3] / 2), math.pi * math.sin(pose[3] / 2), 0.0]
        if name in ("actual_TCP_speed", "target_TCP_speed"):
            rate = (pose - self.before) / PERIOD
            return [*rate[:3], 0.0, 0.0, rate[3]]
        if name == "actual_q":
            return [0.0] * 5 + [self.last]
        if name == "runtime_state":
            return [PLAYING if self.playing else STOPPED]
        if name == "output_int_register_0":
            return [self.state if self.playing else 0]
        if name in ("robot_mode", "safety_mode", "safety_status_bits", "robot_status_bits"):
            return [
                {"robot_mode": 7, "safety_mode": 1, "safety_status_bits": 1, "robot_status_bits": 3}[name]
            ]
        form = FORMS[kind(name)]
        return [0] * (int(form[0]) if len(form) > 1 else 1)


class Client:
    """One that has connected to the RTDE port."""

    def __init__(self, line):
        self.line, self.data, self.outputs, self.inputs, self.started = line, b"", [], {}, False

    def say(self, letter, payload):
        self.line.sendall(struct.pack("!HB", 3 + len(payload), ord(letter)) + payload)

    def take(self, came, arm):
        """Answers what has come."""
        self.data += came
        while len(self.data) >= 3:
            size, letter = struct.unpack("!HB", self.data[:3])
            if len(self.data) < size:
                break
            payload, self.data = self.data[3:size], self.data[size:]
            self.answer(chr(letter), payload, arm)

    def answer(self, letter, payload, arm):
        if letter == "V":
            self.say("V", b"\x01")
        elif letter == "v":
            self.say("v", struct.pack("!4I", 5, 11, 0, 108249))
        elif letter == "O":
            self.outputs = [name for name in payload[8:].decode().split(",") if name]
            self.say("O", b"\x01" + ",".join(map(kind, self.outputs)).encode())
        elif letter == "I":
            names = [name for name in payload.decode().split(",") if name]
            self.inputs[len(self.inputs) + 1] = names
            self.say("I", bytes([len(self.inputs)]) + ",".join(map(kind, names)).encode())
        elif letter in "SP":
            self.started = letter == "S"
            self.say(letter, b"\x01")
        elif letter == "U":
            names = self.inputs[payload[0]]
            values = struct.unpack("!" + "".join(FORMS[kind(name)] for name in names), payload[1:])

            where = dict(zip(names, values, strict=True))
            arm.asked(
                where["input_int_register_0"],
                {int(n.rsplit("_", 1)[1]): v for n, v in where.items() if "double" in n},
            )

    def tell(self, arm):
        if not self.started:
            return
        form = "!B" + "".join(FORMS[kind(name)] for name in self.outputs)
        self.say("U", struct.pack(form, 1, *(v for name in self.outputs for v in arm.value(name))))


def listen(host, port):
    line = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    line.bind((host, port))
    line.listen(8)
    return line


class Controller:
    """The three ports, whoever is connected to them, and the arm."""

    def __init__(self, host, arm, home, patience):
        self.arm, self.home, self.patience = arm, home, patience
        self.doors = {listen(host, port): port for port in (DASHBOARD, SCRIPT, RTDE)}
        self.others, self.clients, self.script = {}, {}, b""

    def run(self):
        """Cycle after cycle, until standard input ends."""
        while True:
            began, due = self.arm.came, time.monotonic() + PERIOD
            limit = due + (self.patience if self.arm.servoing else 0.0)
            while (left := limit - time.monotonic()) > 0 and not (
                self.arm.servoing and self.arm.came > began
            ):
                for line in select.select(
                    [*self.doors, *self.others, *self.clients, sys.stdin], [], [], left
                )[0]:
                    if line is sys.stdin:
                        if not (word := sys.stdin.readline()):
                            return
                        if word.strip() == "again":
                            self.arm = Arm(Ideal(self.home, PERIOD))
                            began = 0
                        print(json.dumps(self.arm.told()), flush=True)
                    else:
                        self.take(line)
            self.arm.step()
            for line, client in list(self.clients.items()):
                try:
                    client.tell(self.arm)
                except ConnectionError:
                    del self.clients[line]

    def take(self, line):
        """What has come on one of the lines."""
        if line in self.doors:
            new, _ = line.accept()
            new.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if self.doors[line] == RTDE:
                self.clients[new] = Client(new)
                return
            self.others[new] = self.doors[line]
            if self.doors[line] == DASHBOARD:
                new.sendall(b"Connected: Universal Robots Dashboard Server\n")
            return
        try:
            came = line.recv(65536)
        except ConnectionError:
            came = b""
        if not came:
            self.others.pop(line, None)
            self.clients.pop(line, None)
            line.close()
        elif line in self.clients:
            self.clients[line].take(came, self.arm)
        elif self.others[line] == DASHBOARD:
            for word in came.decode().splitlines():
                line.sendall((ANSWERS.get(word.strip(), "ok") + "\n").encode())
        else:
            self.script += came
            if self.script.endswith(b"\nend\n"):
                self.script = b""
                self.arm.begin()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--host", required=True)
    parser.add_argument("--home", type=float, nargs=4, default=[0.0, 0.0, 0.03, 0.5])
    parser.add_argument("--plan")
    parser.add_argument("--start", type=float, nargs=3, default=[0.0, 0.0, 0.0])
    parser.add_argument("--patience", type=float, default=0.5, help="with a command while it servoes [s]")
    parser.add_argument(
        "--last", type=float, default=0.0, help="angle of the last joint, which is told [rad]"
    )
    asked = parser.parse_args()
    Arm.last = asked.last
    tool = Cell(asked.plan, asked.start, PERIOD) if asked.plan else Ideal(asked.home, PERIOD)
    controller = Controller(asked.host, Arm(tool), asked.home, asked.patience)
    print(json.dumps({"host": asked.host}), flush=True)
    controller.run()


if __name__ == "__main__":
    main()
