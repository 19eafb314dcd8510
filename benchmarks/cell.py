"""How many times as fast as real time the physics cell is, in CPU seconds: python benchmarks/cell.py

A push of examples/triangle.yaml with the tool alone and on each arm, and the first run of [Zhou2017] Fig. 8, whose
outline has the most corners. Printed: simulated and CPU seconds, their ratio, and how far off the goal the object is.
"""

import time
from collections.abc import Sequence

import numpy as np

import flatpush as fp
from flatpush.execution import open_robot, run
from flatpush.execution.cell.robot import CellRobot
from flatpush.experiments.robot_runs import STARTS, beside, plans
from flatpush.geometry import pose_error


def pushed() -> fp.Plan:
    """A push of two fingers by the long edge."""
    thing = fp.load_scene("examples/triangle.yaml").object
    pushes = (fp.Push("long edge", thing.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    return fp.plan(fp.Scene(thing, (-0.02, -0.05, 0.2), pusher=fp.Pusher(2, 0.018), pushes=pushes))


def told(name: str, robot: CellRobot, made: Sequence[fp.Plan]) -> None:
    """Runs plans one after the other and prints a line."""
    with robot:
        begun = time.process_time()
        for one in made:
            run(one, robot)
        cpu, seconds = time.process_time() - begun, robot.clock.now()
        x, y, turn = pose_error(robot.object, made[-1].scene.goal)
    print(
        f"{name:18}{seconds:7.1f} s simulated{cpu:7.2f} s of CPU{seconds / cpu:6.1f} times real time"
        f"{1000 * np.hypot(x, y):7.3f} mm{abs(np.degrees(turn)):7.3f}°",
        flush=True,
    )


if __name__ == "__main__":
    one = pushed()
    for arm in ("tool", "irb120", "fr3", "ur5e"):
        robot = open_robot(f"mujoco://{arm}", one)
        assert isinstance(robot, CellRobot)
        told(arm, robot, [one])
    both = plans("fig8", STARTS["fig8"][0])
    told("tool, butterfly", CellRobot(both[0], beside("fig8", 0, 0, 0)), both)
