"""Tools of simulated controllers, which tests start as processes of their own: they take a target every cycle."""

import math

import numpy as np

LAG = 0.02  # [s]


class Ideal:
    """A tool that follows with a lag."""

    def __init__(self, home, period):
        self.period = period
        self.pose, self.wanted = np.array(home, dtype=float), np.array(home, dtype=float)

    def step(self, target, twist):
        if target is not None:
            self.wanted = target + LAG * twist
        self.pose = self.pose + (1 - math.exp(-self.period / LAG)) * (self.wanted - self.pose)

    def halt(self):
        self.wanted = self.pose.copy()

    object = None


class Cell:
    """The tool and the object of a plan in MuJoCo."""

    def __init__(self, plan, start, period):
        import flatpush as fp
        from flatpush.execution.cell.robot import CellRobot
        from flatpush.execution.simulated import Unknown

        self.period = period
        self.robot = CellRobot(fp.load_plan(plan), Unknown(start=start)).__enter__()

    @property
    def pose(self):
        return self.robot.state().pose

    @property
    def object(self):
        return [float(v) for v in self.robot.object]

    def step(self, target, twist):
        from flatpush.execution import Target

        now = self.robot.clock.now()
        if target is not None:
            self.robot.send(Target(now + self.period, target, twist))
        self.robot.clock.wait(now + self.period)

    def halt(self):
        self.robot.stop()
