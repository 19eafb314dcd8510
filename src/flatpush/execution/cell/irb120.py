"""The ABB IRB 120 with its tool pointing straight down: joint angles in closed form, and a model from primitives.

Joint offsets 290, 270, 70, 302 and 72 mm, limits of its data sheet. At zero the upper arm is upright and the forearm
level; the axes are z, y, y, x, y, x. With the tool down the fourth joint rests at zero.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...geometry import compose
from ...geometry.pose import Array

SHOULDER, UPPER, ELBOW, FOREARM, FLANGE = 0.29, 0.27, 0.07, 0.302, 0.072  # [m]
FINGERS = 0.1  # from the flange to the middle of the fingertips [m]
LIMITS = np.radians([[-165, 165], [-110, 110], [-110, 70], [-160, 160], [-120, 120], [-400, 400]])
NAMES = ("first", "second", "third", "fourth", "fifth", "sixth")
# Nearer to a singularity than this it is not sent: of the shoulder [m], of a straight elbow and of the wrist [rad].
OVERHEAD, STRAIGHT, WRIST = 0.05, 0.05, 0.1
# Drives of the simulated arm: stiffness [N m/rad], damping [N m s/rad] and rotor inertia [kg m²] of every joint.
STIFFNESS, DAMPING, ROTOR = 2e4, 200.0, 0.5


@dataclass(frozen=True)
class Irb120:
    """An arm that stands somewhere beside the table.

    Attributes:
        base: pose of the table in the arm's base (x, y, z, yaw) [m, rad].
        height: of the middle of the fingertips above the table where their height counts as 0 [m].
    """

    base: tuple[float, float, float, float] = (0.36, 0.0, 0.2, 0.0)
    height: float = 0.0

    def unreachable(self, pose: Array) -> str:
        """Why it cannot take a pose (x, y, height, yaw) of E in W, or ""."""
        x, y, z, _ = self._in_base(pose)
        across, up = math.hypot(x, y), z + FLANGE + FINGERS - SHOULDER
        if across < OVERHEAD:
            return "it is too near to the axis of the arm's first joint"
        bend = self._bend(across, up)
        if not abs(bend) <= 1:
            where = "too far away from" if bend > 1 else "too near to"
            return f"it is {where} the arm: {1000 * math.hypot(across, up):.0f} mm from its shoulder"
        if math.acos(bend) < STRAIGHT:
            return "the arm's elbow is straight there"
        q = self.joints(pose)
        for name, angle, (low, high) in zip(NAMES, q, LIMITS, strict=True):
            if not low <= angle <= high:
                return (
                    f"the arm's {name} joint would be at {math.degrees(angle):.0f}°, outside of"
                    f" {math.degrees(low):.0f}° to {math.degrees(high):.0f}°"
                )
        if abs(q[4]) < WRIST:
            return "the arm's wrist is straight there"
        return ""

    def joints(self, pose: Array) -> Array:
        """Joint angles for a pose of E in W that it reaches, elbow up, shape (6,) [rad]."""
        x, y, z, yaw = self._in_base(pose)
        across, up = math.hypot(x, y), z + FLANGE + FINGERS - SHOULDER
        first = math.atan2(y, x)
        link, rise = math.hypot(FOREARM, ELBOW), math.atan2(ELBOW, FOREARM)
        bend = math.acos(self._bend(across, up))
        upper = math.atan2(up, across) + math.atan2(link * math.sin(bend), UPPER + link * math.cos(bend))
        second = math.pi / 2 - upper
        third = rise - (upper - bend) - second
        return np.array([first, second, third, 0.0, math.pi / 2 - second - third, first - yaw])

    def _in_base(self, pose: Array) -> tuple[float, float, float, float]:
        x, y, yaw = compose([self.base[0], self.base[1], self.base[3]], [pose[0], pose[1], pose[3]])
        return float(x), float(y), float(pose[2]) + self.height + self.base[2], float(yaw)

    @staticmethod
    def _bend(across: float, up: float) -> float:
        """The cosine of the angle by which the elbow is bent."""
        link2 = FOREARM**2 + ELBOW**2
        return (across**2 + up**2 - UPPER**2 - link2) / (2 * UPPER * math.sqrt(link2))

    def model(self, fingers: str, level: float) -> tuple[str, str]:
        """Bodies and drives of the arm in MuJoCo's language.

        Args:
            fingers: geoms in E, x along the push and z up. level: height of the table in the model [m].
        """
        x, y, z, yaw = self.base
        c, s = math.cos(-yaw), math.sin(-yaw)
        place = (-(c * x - s * y), -(s * x + c * y), level - z)
        look = 'contype="0" conaffinity="0" rgba="0.95 0.45 0.1 1"'

        def link(
            offset: tuple[float, float, float],
            axis: str,
            name: str,
            to: tuple[float, float, float],
            mass: float,
        ) -> str:
            bar = f'<geom type="capsule" size="0.03" fromto="0 0 0 {to[0]} {to[1]} {to[2]}" mass="{mass}" {look}/>'
            joint = f'<joint name="arm-{name}" axis="{axis}" armature="{ROTOR}"/>'
            return f'<body pos="{offset[0]} {offset[1]} {offset[2]}" gravcomp="1">{joint}{bar}'

        chain = (
            link((0, 0, 0), "0 0 1", "1", (0, 0, SHOULDER), 3.0)
            + link((0, 0, SHOULDER), "0 1 0", "2", (0, 0, UPPER), 4.0)
            + link((0, 0, UPPER), "0 1 0", "3", (0, 0, ELBOW), 2.0)
            + link((0, 0, ELBOW), "1 0 0", "4", (FOREARM, 0, 0), 3.0)
            + link((FOREARM, 0, 0), "0 1 0", "5", (FLANGE / 2, 0, 0), 0.5)
            + link((FLANGE, 0, 0), "1 0 0", "6", (FINGERS / 3, 0, 0), 0.2)
        )
        # E hangs from the flange, whose x points down and whose z points along the push.
        hand = (
            f'<body name="tool" gravcomp="1" pos="{FINGERS} 0 0" quat="{math.sqrt(0.5)} 0 {-math.sqrt(0.5)} 0">'
            f"{fingers}</body>"
        )
        turn = f"{math.cos(-yaw / 2)} 0 0 {math.sin(-yaw / 2)}"
        foot = f'<body name="arm" pos="{place[0]} {place[1]} {place[2]}" quat="{turn}">'
        drives = "".join(
            f'<position joint="arm-{k}" kp="{STIFFNESS:g}" kv="{DAMPING:g}"/>' for k in range(1, 7)
        )
        return foot + chain + hand + "</body>" * 7, drives
