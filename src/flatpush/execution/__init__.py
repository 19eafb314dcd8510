"""A plan on a robot: what a robot must offer, simulated ones and real ones, and the loop that runs a plan on any."""

from .addresses import Address, open_robot
from .clock import Clock, SimulatedClock, WallClock
from .robot import Limits, OutOfLimits, Robot, RobotFault, State, Target
from .run import DONE, Cycle, Run, Unverified, run

__all__ = [
    "DONE",
    "Address",
    "Clock",
    "Cycle",
    "Limits",
    "OutOfLimits",
    "Robot",
    "RobotFault",
    "Run",
    "SimulatedClock",
    "State",
    "Target",
    "Unverified",
    "WallClock",
    "open_robot",
    "run",
]
