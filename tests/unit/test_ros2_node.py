"""The ROS 2 node of the examples, with stand-ins for rclpy and its messages: a tool that moves as it is told."""

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import flatpush as fp
from flatpush.execution import DONE, RobotFault, run
from flatpush.execution.simulated import home_of

NODE = Path(__file__).parents[2] / "examples" / "ros2_node.py"


def record(**fields):
    """A message class whose fields are records with numbers that start at 0."""

    class Message:
        def __init__(self):
            for name, inner in fields.items():
                setattr(self, name, inner() if callable(inner) else inner)

    return Message


POINT = record(x=0.0, y=0.0, z=0.0)
STAMP = record(sec=0, nanosec=0)
HEADER = record(stamp=STAMP, frame_id="")
POSE = record(header=HEADER, pose=record(position=POINT, orientation=record(x=0.0, y=0.0, z=0.0, w=1.0)))
TWIST = record(header=HEADER, twist=record(linear=POINT, angular=POINT))


class Graph:
    """ROS: a clock in nanoseconds, a tool driven by twists, and its pose every 5 ms."""

    def __init__(self, pose):
        self.nanoseconds, self.pose, self.twist, self.heard, self.silent = (
            0,
            np.array(pose),
            np.zeros(4),
            None,
            False,
        )

    def stamp(self):
        stamp = STAMP()
        stamp.sec, stamp.nanosec = divmod(self.nanoseconds, 10**9)
        return stamp

    def spin(self, seconds):
        step = min(5_000_000, max(1, round(1e9 * seconds)))
        self.nanoseconds += step
        self.pose = self.pose + 1e-9 * step * self.twist
        if self.heard is not None and not self.silent:
            told = POSE()
            told.header.stamp = self.stamp()
            place, turn = told.pose.position, told.pose.orientation
            place.x, place.y, place.z, yaw = (float(v) for v in self.pose)
            turn.z, turn.w = math.sin(yaw / 2), math.cos(yaw / 2)
            self.heard(told)


@pytest.fixture
def plan(triangle):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    return fp.plan(fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=pusher, pushes=pushes))


@pytest.fixture
def graph(plan, monkeypatch):
    found = Graph(home_of(plan))

    class Node:
        def __init__(self, name):
            assert name == "flatpush"

        def create_publisher(self, kind, topic, depth):
            assert (kind, topic) == (TWIST, "tool_twist")
            return SimpleNamespace(publish=self.told)

        def told(self, message):
            assert message.header.frame_id == "table"
            linear = message.twist.linear
            found.twist = np.array([linear.x, linear.y, linear.z, message.twist.angular.z])

        def create_subscription(self, kind, topic, callback, depth):
            assert (kind, topic) == (POSE, "tool_pose")
            found.heard = callback

        def get_clock(self):
            return SimpleNamespace(
                now=lambda: SimpleNamespace(nanoseconds=found.nanoseconds, to_msg=found.stamp)
            )

    def spin_once(node, timeout_sec):
        found.spin(timeout_sec)

    parts = {
        "rclpy": {"spin_once": spin_once},
        "rclpy.node": {"Node": Node},
        "geometry_msgs": {},
        "geometry_msgs.msg": {"PoseStamped": POSE, "TwistStamped": TWIST},
    }
    for name, inside in parts.items():
        module = ModuleType(name)
        vars(module).update(inside)
        monkeypatch.setitem(sys.modules, name, module)
    return found


def node(graph):
    spec = importlib.util.spec_from_file_location("ros2_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.RosRobot()


def test_a_plan_runs_over_topics(plan, graph):
    with node(graph) as robot:
        ended = run(plan, robot)
    assert ended.outcome == DONE
    assert not np.any(graph.twist)
    assert np.allclose(graph.pose[[0, 1, 3]], plan.segments[-1].pusher[-1], atol=1e-3)
    assert ended.off < 0.003


def test_a_topic_that_falls_silent_ends_the_run(plan, graph):
    with node(graph) as robot:
        ended = run(plan, robot, told=lambda cycle: setattr(graph, "silent", cycle.time > 1.0))
    assert " old" in ended.outcome
    assert ended.cycles[-1].time < 1.15
    assert not np.any(graph.twist)


def test_without_a_pose_nothing_moves(plan, graph):
    graph.silent = True
    with node(graph) as robot, pytest.raises(RobotFault, match="nothing came on tool_pose"):
        run(plan, robot)
    assert not np.any(graph.twist)


def test_it_is_short():
    assert len(NODE.read_text(encoding="utf-8").splitlines()) <= 80
