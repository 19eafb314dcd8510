"""A robot in the cell: a plan on a simulated ABB IRB 120 in MuJoCo. Needs pip install "flatpush[sim]"."""

from pathlib import Path

import numpy as np

import flatpush as fp
from flatpush.execution import open_robot, run
from flatpush.geometry import pose_error

scene = fp.load_scene(Path(__file__).parent / "triangle.yaml")
plan = fp.plan(scene)
assert fp.verify(plan).ok  # what runs on a robot was verified before

# `mujoco://tool` is the same without an arm; egm://, franka:// and ur:// are real ones.
with open_robot("mujoco://irb120", plan) as robot:
    done = run(plan, robot)
    end = robot.object
print(done.outcome)
x, y, angle = pose_error(end, scene.goal_pose)
print(f"{1000 * np.hypot(x, y):.2f} mm and {abs(np.rad2deg(angle)):.2f}° off the goal")
assert np.hypot(x, y) < 1e-3
