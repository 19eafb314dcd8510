"""The table in a robot's base frame, and a tool that points straight down on it."""

import math
from collections.abc import Sequence

import numpy as np

from ..geometry import compose, inverse
from ..geometry.pose import Array

# (x, y, z, yaw) of the table frame in the robot's base frame [m, rad].
Base = Sequence[float]
# A tool that is tilted by less than this points straight down, as the sine.
TILT = 0.01


def in_base(base: Base, pose: Array) -> tuple[float, float, float, float]:
    """A pose of E in W (x, y, height, yaw), in the base frame."""
    # Scalars, because arms ask several times in every cycle.
    x, y, z, yaw = pose.tolist()
    c, s = math.cos(base[3]), math.sin(base[3])
    return base[0] + c * x - s * y, base[1] + s * x + c * y, z + base[2], yaw + base[3]


def on_table(base: Base, place: Sequence[float], yaw: float, near: float) -> Array:
    """The reverse: a place (x, y, z) and a yaw as a pose in W, whose yaw is within half a turn of another."""
    x, y, angle = compose(inverse([base[0], base[1], base[3]]), [place[0], place[1], yaw])
    return np.array([x, y, place[2] - base[2], near + math.remainder(angle - near, 2 * math.pi)])
