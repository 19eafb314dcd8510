"""Joint angles of arms against forward kinematics by Denavit-Hartenberg parameters, as the makers print them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from flatpush.execution.arms import ARMS, arm_named

H = math.pi / 2
# Rows of (a, α, d, θ offset): modified (Craig) for ABB and Franka, standard for UR; the last is the flange.
MODIFIED = {
    "irb120": [(0, 0, 0.29, 0), (0, -H, 0, -H), (0.27, 0, 0, 0), (0.07, -H, 0.302, 0), (0, H, 0, 0),
               (0, -H, 0.072, 0)],
    "fr3": [(0, 0, 0.333, 0), (0, -H, 0, 0), (0, H, 0.316, 0), (0.0825, H, 0, 0), (-0.0825, -H, 0.384, 0), (0, H, 0, 0),
            (0.088, H, 0.107, 0)],
}  # fmt: skip
STANDARD = {
    name: [(0, H, d1, 0), (-a2, 0, 0, 0), (-a3, 0, 0, 0), (0, H, d4, 0), (0, -H, d5, 0), (0, 0, d6, 0)]
    for name, (d1, a2, a3, d4, d5, d6) in {
        "ur3e": (0.15185, 0.24355, 0.2132, 0.13105, 0.08535, 0.0921),
        "ur5e": (0.1625, 0.425, 0.3922, 0.1333, 0.0997, 0.0996),
        "ur10e": (0.1807, 0.6127, 0.57155, 0.17415, 0.11985, 0.11655),
    }.items()
}


def about(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    found = np.eye(4)
    i, j = {"x": (1, 2), "z": (0, 1)}[axis]
    found[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return found


def along(axis, far):
    found = np.eye(4)
    found["xyz".index(axis), 3] = far
    return found


def flange(name, q):
    """Of an arm at joint angles, in its base."""
    found = np.eye(4)
    for (a, alpha, d, offset), angle in zip(MODIFIED.get(name) or STANDARD[name], q, strict=True):
        turn, link = about("z", angle + offset) @ along("z", d), about("x", alpha) @ along("x", a)
        found = found @ (link @ turn if name in MODIFIED else turn @ link)
    return found


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("base", [None, (0.3, -0.25, 0.12, 1.1)])
def test_the_tool_is_where_it_was_asked_for(name, base):
    arm = replace(ARMS[name].placed(base), turn=0.3, height=0.01)
    x0, y0, z0, yaw0 = arm.base
    rng, tried = np.random.default_rng(4), 0
    for pose in rng.uniform([-0.1, -0.1, 0.0, -3.0], [0.1, 0.1, 0.05, 3.0], (40, 4)):
        if arm.unreachable(pose):
            continue
        tried += 1
        tool = flange(name, arm.joints(pose)) @ along("z", arm.tool) @ about("z", -arm.turn)
        c, s = math.cos(yaw0), math.sin(yaw0)
        place = np.array(
            [c * pose[0] - s * pose[1] + x0, s * pose[0] + c * pose[1] + y0, pose[2] + z0 + 0.01]
        )
        assert np.allclose(
            arm.counted(pose + np.array([0, 0, 0, 4 * math.pi]), arm.joints(pose)[-1]), pose, atol=1e-9
        )
        assert np.allclose(tool[:3, 3], place, atol=1e-9)
        assert np.allclose(tool[:3, 2], [0, 0, -1], atol=1e-9)
        assert math.remainder(
            math.atan2(tool[1, 0], tool[0, 0]) - pose[3] - yaw0, 2 * math.pi
        ) == pytest.approx(0, abs=1e-9)
    assert tried > 10


def test_arms_by_name():
    assert arm_named("ur5e") is ARMS["ur5e"]
    with pytest.raises(ValueError, match="no such arm"):
        arm_named("ur99")
