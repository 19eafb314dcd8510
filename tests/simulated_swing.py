"""A motion that tests send to robots: aside and back, smoothly."""

from itertools import count

import numpy as np

from flatpush.execution.course import Course
from flatpush.execution.run import Played, stream


def after(cycles, act):
    """What is to be told each cycle, so that something happens in the one of this number."""
    numbers = count(1)
    return lambda cycle: act() if next(numbers) == cycles else None


def swing(robot, cycles, told=None, width=0.02):
    """For so many of the robot's cycles; the run."""
    period = robot.limits.period
    t = period * np.arange(cycles - 1.0)
    shape = 0.5 - 0.5 * np.cos(2 * np.pi * t / t[-1])
    poses = robot.state().pose + shape[:, None] * width * np.array([1.0, 0.0, 0.0, 10.0])
    course = Course(t, poses, np.zeros(len(t), int), ("swing",), (-1,))
    course.check(robot.limits)
    return stream(Played(course, period), robot, robot.clock, told=told)
