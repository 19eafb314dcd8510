"""A motion that tests send to robots: aside and back, smoothly."""

import numpy as np

from flatpush.execution.course import Course
from flatpush.execution.run import Played, stream


def swing(robot, cycles, told=None, width=0.02):
    """For so many of the robot's cycles; the run."""
    period = robot.limits.period
    t = period * np.arange(cycles - 1.0)
    shape = 0.5 - 0.5 * np.cos(2 * np.pi * t / t[-1])
    poses = robot.state().pose + shape[:, None] * width * np.array([1.0, 0.0, 0.0, 10.0])
    course = Course(t, poses, np.zeros(len(t), int), ("swing",), (-1,))
    course.check(robot.limits)
    return stream(Played(course, period), robot, robot.clock, told=told)
