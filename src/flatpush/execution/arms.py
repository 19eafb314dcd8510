"""Arms whose tool points straight down: joint angles in closed form, and why a pose cannot be taken.

The first joint turns a vertical plane that holds the upper arm and the forearm; the wrist keeps the tool vertical, and
the last joint turns it. An FR3 keeps its third and fifth joint at zero. What a maker puts into a joint's zero and sense
stands in a matrix.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .mount import Base, in_base

# Nearer to a singularity than this it is not sent: of the shoulder [m], of a straight elbow and of the wrist [rad].
OVERHEAD, STRAIGHT, WRIST = 0.05, 0.05, 0.1
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh")
QUARTER = math.pi / 2


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm beside the table.

    Attributes:
        shoulder: its height above the base [m]. upper, forearm: lengths between the axes of shoulder, elbow, wrist [m].
        aside: by which that plane lies beside the first axis, to its left [m].
        reach, drop: from the wrist's axis to the flange, away from the first axis and down [m].
        angles, zeros: joint angles are angles @ (first, upper, bend, yaw) + zeros, shape (k, 4) and (k,): azimuth of
            the plane, elevation of the upper arm, bend of the elbow, and yaw of the tool in the base, which only the
            last joint turns.
        limits: of the joints, shape (k, 2) [rad]. speeds: their greatest, shape (k,) [rad/s].
        wrist: index of a joint at whose zero the wrist is straight; None: it cannot be.
        tool: from the flange to the middle of the fingertips [m]. turn: yaw of E in the flange at zero [rad].
        base: pose of the table in the arm's base (x, y, z, yaw) [m, rad]. stands: where it is, if nobody says.
        height: of the middle of the fingertips above the table where their height counts as 0 [m].
    """

    name: str
    shoulder: float
    upper: float
    forearm: float
    aside: float
    reach: float
    drop: float
    angles: Array
    zeros: Array
    limits: Array
    speeds: Array
    wrist: int | None = None
    tool: float = 0.1
    turn: float = 0.0
    base: Base = (0.0, 0.0, 0.0, 0.0)
    height: float = 0.0
    stands: Base = field(default=(0.0, 0.0, 0.0, 0.0))

    def placed(self, base: Base | None = None, height: float = 0.0) -> "Arm":
        """Beside a table; without one, where the arm usually stands."""
        return replace(self, base=tuple(self.stands if base is None else base), height=height)

    def unreachable(self, pose: Array) -> str:
        """Why it cannot take a pose (x, y, height, yaw) of E in W, or ""."""
        x, y, across, up, yaw = self._wrist(pose)
        if math.hypot(x, y) < abs(self.aside) + OVERHEAD or across < OVERHEAD:
            return "it is too near to the axis of the arm's first joint"
        bend = self._bend(across, up)
        if not abs(bend) <= 1:
            where = "too far away from" if bend > 1 else "too near to"
            return f"it is {where} the arm: {1000 * math.hypot(across, up):.0f} mm from its shoulder"
        if math.acos(bend) < STRAIGHT:
            return "the arm's elbow is straight there"
        q = self._angles(x, y, across, up, yaw)
        outside = (q < self.limits[:, 0]) | (q > self.limits[:, 1])
        if outside.any():
            k = int(np.argmax(outside))
            angle, low, high = np.degrees([q[k], *self.limits[k]])
            return f"the arm's {ORDINALS[k]} joint would be at {angle:.0f}°, outside of {low:.0f}° to {high:.0f}°"
        if self.wrist is not None and abs(q[self.wrist]) < WRIST:
            return "the arm's wrist is straight there"
        return ""

    def joints(self, pose: Array) -> Array:
        """Joint angles for a pose of E in W that it reaches, elbow up, shape (k,) [rad]."""
        return self._angles(*self._wrist(pose))

    def yaws(self, pose: Array) -> tuple[float, float]:
        """Least and greatest yaw that the last joint allows at the place of a pose of E in W [rad]."""
        one, other = (self._yaw(pose, float(end)) for end in self.limits[-1])
        return min(one, other), max(one, other)

    def counted(self, pose: Array, angle: float) -> Array:
        """A pose of E in W, whose yaw is known up to whole turns, with those that the last joint at an angle has made
        [rad]."""
        near = self._yaw(pose, angle)
        return np.array([*pose[:3], near + math.remainder(pose[3] - near, 2 * math.pi)])

    def _yaw(self, pose: Array, angle: float) -> float:
        """Of E in W at the place of a pose, with the last joint at an angle."""
        x, y, _, _, _ = self._wrist(pose)
        azimuth, _, _, rate = self.angles[-1]
        turned = (angle - self.zeros[-1] - azimuth * self._first(x, y)) / rate
        return float(turned + self.turn - self.base[3])

    def _first(self, x: float, y: float) -> float:
        """Azimuth of the vertical plane for a place of the tool in the base."""
        far = math.hypot(x, y)
        return math.atan2(y, x) + math.asin(min(max(self.aside / far, -1.0), 1.0) if far > 0 else 0.0)

    def _angles(self, x: float, y: float, across: float, up: float, yaw: float) -> Array:
        first = self._first(x, y)
        bend = math.acos(self._bend(across, up))
        upper = math.atan2(up, across) + math.atan2(
            self.forearm * math.sin(bend), self.upper + self.forearm * math.cos(bend)
        )
        return np.asarray(self.angles @ [first, upper, bend, yaw - self.turn] + self.zeros)

    def _wrist(self, pose: Array) -> tuple[float, float, float, float, float]:
        """Place of the tool (x, y), the wrist seen from the shoulder (across, up), and yaw, in the base."""
        x, y, z, yaw = in_base(self.base, pose)
        across = math.sqrt(max(x * x + y * y - self.aside**2, 0.0)) - self.reach
        return x, y, across, z + self.height + self.tool + self.drop - self.shoulder, yaw

    def _bend(self, across: float, up: float) -> float:
        """The cosine of the angle by which the elbow is bent."""
        return (across**2 + up**2 - self.upper**2 - self.forearm**2) / (2 * self.upper * self.forearm)


def _irb120() -> Arm:
    """ABB IRB 120: offsets 290, 270, 70, 302 and 72 mm, limits and speeds of its data sheet."""
    rise = math.atan2(0.07, 0.302)
    return Arm(
        "ABB IRB 120", 0.29, 0.27, math.hypot(0.302, 0.07), 0.0, 0.0, 0.072,
        np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0], [0, 1, -1, 0], [1, 0, 0, -1]], dtype=float),
        np.array([0, QUARTER, rise - QUARTER, 0, QUARTER - rise, 0]),
        np.radians([[-165, 165], [-110, 110], [-110, 70], [-160, 160], [-120, 120], [-400, 400]]),
        np.radians([250, 250, 250, 320, 320, 420]), wrist=4, stands=(0.36, 0.0, 0.2, 0.0),
    )  # fmt: skip


def _fr3() -> Arm:
    """Franka Research 3: offsets 333, 316, 82.5, 384, 88 and 107 mm, limits and speeds of its data sheet."""
    upper, forearm = math.atan2(0.316, 0.0825), math.atan2(0.384, -0.0825)
    return Arm(
        "Franka Research 3", 0.333, math.hypot(0.316, 0.0825), math.hypot(0.384, 0.0825), 0.0, 0.088, 0.107,
        np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 0], [0, -1, 1, 0], [1, 0, 0, -1]],
                 dtype=float),
        np.array([0, upper, 0, upper - forearm, 0, forearm, 0]),
        np.array([[-2.7437, 2.7437], [-1.7837, 1.7837], [-2.9007, 2.9007], [-3.0421, -0.1518], [-2.8065, 2.8065],
                  [0.5445, 4.5169], [-3.0159, 3.0159]]),
        np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26]), stands=(0.45, 0.0, 0.2, 0.0),
    )  # fmt: skip


def _ur(
    name: str, d1: float, a2: float, a3: float, d4: float, d5: float, d6: float, speeds: list[float]
) -> Arm:
    """An e-Series arm of Universal Robots by the parameters of its data sheet [m]."""
    return Arm(
        name, d1, a2, a3, -d4, d5, d6,
        np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0], [0, 1, -1, 0], [0, 0, 0, 0], [1, 0, 0, -1]], dtype=float),
        np.array([math.pi, 0, 0, -QUARTER, -QUARTER, -QUARTER]),
        np.tile([-2 * math.pi, 2 * math.pi], (6, 1)), np.radians(speeds), stands=(0.45, 0.0, 0.1, 0.0),
    )  # fmt: skip


ARMS = {
    "irb120": _irb120(),
    "fr3": _fr3(),
    "ur3e": _ur("UR3e", 0.15185, 0.24355, 0.2132, 0.13105, 0.08535, 0.0921, [180, 180, 180, 360, 360, 360]),
    "ur5e": _ur("UR5e", 0.1625, 0.425, 0.3922, 0.1333, 0.0997, 0.0996, [180] * 6),
    "ur10e": _ur("UR10e", 0.1807, 0.6127, 0.57155, 0.17415, 0.11985, 0.11655, [120, 120, 180, 180, 180, 180]),
}


def arm_named(name: str) -> Arm:
    """One of ARMS.

    Raises:
        InputError: if there is none of this name.
    """
    if name not in ARMS:
        raise InputError("there is no such arm", value=name, hint=f"There are {', '.join(ARMS)}.")
    return ARMS[name]
