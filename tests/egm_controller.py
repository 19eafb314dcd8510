"""A simulated robot controller that speaks Externally Guided Motion: a process of its own, started by tests.

It counts cycles of 4 ms; a cycle ends when its message was answered, or after a while without. After 25 cycles in a
row without an answer it stops the arm, as a controller's communication time-out does. In a line for each request on
standard input it says what it saw, and after "again" it is as at the beginning; its arm is a lag of first order, or the
tool of the physics cell.
"""

import argparse
import json
import math
import select
import socket
import sys

import numpy as np
from abb_robot_client._egm_protobuf import egm_pb2

from simulated_tools import Cell, Ideal

PERIOD, MISSED = 0.004, 25


def message(cycle, pose, alive, last):
    told = egm_pb2.EgmRobot()
    told.header.seqno, told.header.tm = cycle, round(1000 * PERIOD * cycle)
    told.header.mtype = egm_pb2.EgmHeader.MessageType.Value("MSGTYPE_DATA")
    place, turn = told.feedBack.cartesian.pos, told.feedBack.cartesian.orient
    place.x, place.y, place.z = (1000 * v for v in pose[:3])
    if last is not None:
        told.feedBack.joints.joints.extend([0.0] * 5 + [last])
    turn.u0, turn.u1, turn.u2, turn.u3 = 0.0, math.cos(pose[3] / 2), math.sin(pose[3] / 2), 0.0
    told.motorState.state = told.motorState.MOTORS_ON
    told.rapidExecState.state = (
        told.rapidExecState.RAPID_RUNNING if alive else told.rapidExecState.RAPID_STOPPED
    )
    return told.SerializeToString()


def wish(data, yaw):
    told = egm_pb2.EgmSensor()
    told.ParseFromString(data)
    place, turn = told.planned.cartesian.pos, told.planned.cartesian.orient
    angle = 2 * math.atan2(turn.u2, turn.u1)
    angle = yaw + math.remainder(angle - yaw, 2 * math.pi)
    speed = list(told.speedRef.cartesians.value)
    twist = np.array([speed[0] / 1000, speed[1] / 1000, speed[2] / 1000, math.radians(speed[5])])
    return np.array([place.x / 1000, place.y / 1000, place.z / 1000, angle]), twist


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--home", type=float, nargs=4, default=[0.0, 0.0, 0.03, 0.5])
    parser.add_argument("--plan")
    parser.add_argument("--start", type=float, nargs=3, default=[0.0, 0.0, 0.0])
    parser.add_argument("--patience", type=float, default=2.0, help="with an answer [s]")
    parser.add_argument("--cycles", type=int, default=10**9)
    parser.add_argument(
        "--freeze", type=int, default=-1, help="says nothing any more from this answered cycle on"
    )
    parser.add_argument("--last", type=float, help="angle of the last joint, which is told [°]")
    asked = parser.parse_args()
    arm = Cell(asked.plan, asked.start, PERIOD) if asked.plan else Ideal(asked.home, PERIOD)
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.bind(("127.0.0.1", 0))
    print(json.dumps({"port": line.getsockname()[1]}), flush=True)
    answered = missed = worst = 0
    connected, stopped, after, farthest, last = False, -1, None, 0.0, arm.pose
    for cycle in range(asked.cycles):
        if select.select([sys.stdin], [], [], 0)[0]:
            if not (word := sys.stdin.readline()):
                break
            if word.strip() == "again":
                arm, answered, missed, worst = Ideal(asked.home, PERIOD), 0, 0, 0
                connected, stopped, after, farthest = False, -1, None, 0.0
                while select.select([line], [], [], 0)[0]:
                    line.recv(65536)
            told = {
                "cycles": cycle,
                "answered": answered,
                "worst": worst,
                "stopped": stopped,
                "farthest": farthest,
            }
            told |= {"pose": [float(v) for v in arm.pose], "object": arm.object}
            print(json.dumps(told), flush=True)
        if 0 <= asked.freeze <= answered:
            select.select([sys.stdin], [], [], 0.05)
            continue
        line.sendto(message(cycle, arm.pose, stopped < 0, asked.last), ("127.0.0.1", asked.port))
        # Before anybody has answered it only calls.
        came = select.select([line], [], [], asked.patience if connected and stopped < 0 else 0.02)[0]
        target = twist = None
        if came:
            target, twist = wish(line.recv(65536), float(arm.pose[3]))
            while select.select([line], [], [], 0)[0]:
                target, twist = wish(line.recv(65536), float(arm.pose[3]))
            answered, missed, connected = answered + 1, 0, True
        elif connected:
            missed += 1
            worst = max(worst, missed)
            if missed == MISSED and stopped < 0:
                stopped, after = cycle, arm.pose.copy()
                arm.halt()
        arm.step(None if stopped >= 0 else target, twist)
        if after is not None:
            farthest = max(farthest, float(np.linalg.norm((arm.pose - after)[:3])))
        last = arm.pose
    return last


if __name__ == "__main__":
    main()
