"""A ROS 2 node that runs a plan: poses of the tool in, twists of the tool out, both in the table's frame.

    python3 examples/ros2_node.py plan.json

It listens to /tool_pose (geometry_msgs/PoseStamped) and sends /tool_twist (geometry_msgs/TwistStamped) at 100 Hz. Your
driver moves the tool with that twist and stops where none comes for a tenth of a second.
"""

import math
import sys

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.node import Node

import flatpush as fp
from flatpush.execution import Limits, RobotFault, State, run

GAIN = 4.0  # of the distance from where the tool should be [1/s]


class RosRobot(Node):
    """What flatpush.execution.run needs of a robot (docs/robots.md)."""

    limits, real = Limits(period=0.01, deviation=0.02), True

    def __init__(self):
        super().__init__("flatpush")
        self.seen, self.twists = None, self.create_publisher(TwistStamped, "tool_twist", 1)
        self.create_subscription(PoseStamped, "tool_pose", self.take, 1)
        self.clock = self  # ROS's own, also in simulated time

    def take(self, message):
        place, turn, stamp = message.pose.position, message.pose.orientation, message.header.stamp
        last, time = self.seen, stamp.sec + 1e-9 * stamp.nanosec
        near = 0.0 if last is None else last.pose[3]
        yaw = near + math.remainder(2 * math.atan2(turn.z, turn.w) - near, 2 * math.pi)
        pose = np.array([place.x, place.y, place.z, yaw])
        moved = last is not None and time > last.stamp
        self.seen = State(pose, (pose - last.pose) / (time - last.stamp) if moved else np.zeros(4), time)

    def now(self):
        return self.get_clock().now().nanoseconds / 1e9

    def wait(self, until):
        while self.now() < until:
            rclpy.spin_once(self, timeout_sec=max(0.0, min(0.01, until - self.now())))

    def __enter__(self):
        self.wait(self.now() + 2.0)
        return self

    def __exit__(self, *_):
        self.stop()

    def state(self):
        if self.seen is None:
            raise RobotFault("nothing came on tool_pose")
        return self.seen

    def send(self, target):
        self.tell(target.twist + GAIN * (target.pose - self.seen.pose))
        return target

    def stop(self):
        self.tell(np.zeros(4))

    def tell(self, twist):
        message = TwistStamped()
        message.header.stamp, message.header.frame_id = self.get_clock().now().to_msg(), "table"
        linear, angular = message.twist.linear, message.twist.angular
        linear.x, linear.y, linear.z, angular.z = (float(v) for v in twist)
        self.twists.publish(message)


if __name__ == "__main__":
    rclpy.init()
    with RosRobot() as robot:
        print(run(fp.load_plan(sys.argv[1]), robot).outcome)
