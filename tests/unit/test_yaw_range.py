"""A hand keeps to the range of its arm's last joint: it is not wound up by landings, and turns back in the air."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.test_execution_arm import model_of

import flatpush as fp
from flatpush.control import Camera, SimulatedSensor
from flatpush.control.loop.limits import turn_within
from flatpush.control.tracking.simulated_run import TrackedRun
from flatpush.execution import DONE, OutOfLimits, open_robot, run
from flatpush.execution.arms import ARMS
from flatpush.execution.course import alike, in_range, planned, reach_of
from flatpush.execution.robot import Limits
from flatpush.execution.run import slowed, way
from flatpush.execution.simulated import SimRobot, Unknown, home_of
from flatpush.geometry import pose_error

TURN = 2 * math.pi
SIDES = {"bottom": (0.0, -0.0175), "right": (0.025, 0.0), "top": (0.0, 0.0175), "left": (-0.025, 0.0)}


def around(block, fingers):
    """A plan of some pushes that lead the hand around the object."""
    spacing, names = (0.018, ("bottom", "right")) if fingers == 2 else (0.0, SIDES)
    pushes = tuple(fp.Push(name, block.outline.nearest(SIDES[name]), fingers, spacing) for name in names)
    start = (-0.06, 0.0, 1.5) if fingers == 2 else (0.06, 0.0, 3.0)
    planning = fp.Planning(friction_margin=0.4 if fingers == 1 else 0.2, switch_cost=0.001, iterations=200)
    pusher = fp.Pusher(fingers=fingers, spacing=spacing)
    return fp.plan(fp.Scene(block, start, (0.0, 0.0, 0.0), pusher, pushes, planning=planning))


@pytest.fixture(scope="module")
def block():
    outline = [(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)]
    return fp.Object(outline, "uniform", friction=0.2, name="block")


def limits_of(name, base=None):
    return replace(Limits(), arm=ARMS[name].placed(base, height=0.01))


def last_joint(limits, ended):
    """Of the targets of a run, and of its range."""
    found = np.array([limits.arm.joints(cycle.target.pose)[-1] for cycle in ended.cycles])
    return found, limits.arm.limits[-1]


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("base", [None, (0.3, -0.25, 0.12, 2.9)])
def test_the_range_of_yaws_ends_where_the_last_joint_does(name, base):
    arm, tried = replace(ARMS[name].placed(base), turn=0.3), 0
    for place in np.random.default_rng(1).uniform([-0.1, -0.1, 0.0], [0.1, 0.1, 0.05], (20, 3)):
        low, high = arm.yaws(np.append(place, 7.0))
        assert high - low == pytest.approx(np.ptp(arm.limits[-1]))
        if arm.unreachable(np.append(place, 0.5 * (low + high))):
            continue
        tried += 1
        for end, inward in ((low, 1), (high, -1)):
            assert arm.unreachable(np.append(place, end + 1e-9 * inward)) == ""
            assert "joint would be at" in arm.unreachable(np.append(place, end - 1e-9 * inward))
    assert tried > 5


def test_fingers_are_where_they_were_after_some_turns(block):
    one, two = around(block, 1), around(block, 2)
    assert alike(one) == (TURN, 0.0)
    assert alike(two) == (TURN, math.pi)
    beside = replace(two.pushes[0], fingers=two.pushes[0].fingers + np.array([0.0, 0.001]))
    assert alike(replace(two, segments=(beside,))) == (TURN,)


@pytest.mark.parametrize("fingers", [1, 2])
def test_a_plan_that_would_leave_the_range_turns_in_the_air(block, fingers):
    """It was refused, and a plan for one finger, which is round, need never be."""
    plan = around(block, fingers)
    limits, course = limits_of("fr3"), planned(plan)
    with pytest.raises(OutOfLimits, match="seventh joint"):
        course.check(limits)
    found = in_range(course, limits, plan.scene.pusher, reach_of(plan), alike(plan))
    found.check(limits)
    assert found.legs == course.legs
    for one in np.unique(course.leg):
        a, b = course.poses[course.leg == one], found.poses[found.leg == one]
        assert np.allclose(a[[0, -1], :3], b[[0, -1], :3])
        if "push" in course.legs[one]:
            assert np.allclose(a[:, :3], b[:, :3])
            turned = b[:, 3] - a[:, 3]
            assert np.ptp(turned) < 1e-12
            if fingers == 2:
                assert math.remainder(turned[0], math.pi) == pytest.approx(0, abs=1e-9)
    rates = np.diff(found.poses, axis=0) / np.diff(found.times)[:, None]
    assert np.max(np.abs(rates[:, 3])) <= plan.scene.pusher.turn_rate * (1 + 1e-9)
    turning = np.abs(np.diff(found.poses[:, 3])) > 1e-9
    down = np.maximum(found.poses[1:, 2], found.poses[:-1, 2]) < plan.scene.pusher.lift
    assert not np.any(turning & down & ["transit" in found.legs[leg] for leg in found.leg[1:]])


def test_a_plan_within_the_range_is_as_it_was(block):
    plan = around(block, 2)
    course = planned(plan, yaw=0.0)
    wide = limits_of("irb120")
    course.check(wide)
    found = in_range(course, wide, plan.scene.pusher, reach_of(plan), alike(plan))
    assert np.array_equal(found.times, course.times)
    assert np.array_equal(found.poses, course.poses)
    assert in_range(course, Limits(), plan.scene.pusher, reach_of(plan), alike(plan)) is course


def followed(plan, robot, law, seed=0):
    camera = Camera()
    ticks = max(1, round(1 / (60 * robot.limits.period)))
    tracked = TrackedRun(law, 1 / (ticks * robot.limits.period), camera=camera)
    eyes = SimulatedSensor(camera, np.random.default_rng(seed))
    return run(plan, robot, tracked.law(slowed(plan, robot.limits)), eyes)


def home_in(plan, limits):
    home = home_of(plan)
    low, high = limits.yaws(home)
    home[3] += turn_within(low - home[3], high - home[3], *alike(plan))
    return home


@pytest.mark.parametrize("name", ["irb120", pytest.param("fr3", marks=pytest.mark.slow)])
def test_one_finger_is_turned_in_the_air_only_where_its_arm_needs_it(block, name):
    """Every landing turned the hand the short way: an IRB 120 stopped at 400° after 54 s of one run."""
    plan, limits = around(block, 1), limits_of(name)
    with SimRobot(plan, home=home_in(plan, limits), limits=limits) as robot:
        ended = followed(plan, robot, "horizon")
    assert ended.outcome == "arrived"
    angles, (low, high) = last_joint(limits, ended)
    assert np.all((angles >= low) & (angles <= high))
    landings = [cycle for cycle in ended.cycles if cycle.mode == "transit" and cycle.target.pose[2] > 0.0]
    spin = np.abs([cycle.target.twist[3] for cycle in landings])
    assert len(landings) > 100
    if name == "irb120":
        assert np.max(spin) == 0
    assert np.max(spin) <= plan.scene.pusher.turn_rate
    changes = np.abs(np.diff([cycle.target.twist[3] for cycle in ended.cycles]))
    assert np.max(changes) < 0.2 * plan.scene.pusher.turn_rate


@pytest.mark.slow
@pytest.mark.parametrize("name", ["irb120", "fr3"])
def test_many_landings_on_an_arm(block, name):
    model_of(name)
    plan = around(block, 1)
    with open_robot(f"mujoco://{name}?start=2,-2,10", plan) as robot:
        ended = followed(plan, robot, "horizon")
        error = pose_error(robot.object, plan.scene.goal)
    assert ended.outcome == "arrived"
    assert len([text for _, text in ended.notes if text.startswith("landing")]) > 2
    assert np.hypot(*error[:2]) < 0.0012
    assert abs(error[2]) < math.radians(1.2)


class Narrow:
    """An arm whose hand has a yaw from -210° to 130°."""

    speeds = np.array([10.0])

    def unreachable(self, pose):
        low, high = self.yaws(pose)
        return "" if low <= pose[3] <= high else "the hand would be wound up"

    def joints(self, pose):
        return pose[3:]

    def yaws(self, pose):
        return math.radians(-210), math.radians(130)


@pytest.mark.parametrize("law", [None, "path", "horizon"])
@pytest.mark.parametrize("arm", [Narrow(), ARMS["fr3"].placed(height=0.01)], ids=["narrow", "fr3"])
def test_two_fingers_land_within_the_range(block, law, arm):
    """The short way to the last landing, at 158°, led through yaws that the arm does not have; an FR3 does not have
    those of this push either, so that the fingers are exchanged for it."""
    plan, limits = around(block, 2), replace(Limits(), arm=arm)
    home = home_in(plan, limits)
    with pytest.raises(OutOfLimits, match=r"wound up|seventh joint"):
        planned(plan, yaw=home[3]).check(limits)
    with SimRobot(plan, home=home, limits=limits) as robot:
        ended = run(plan, robot) if law is None else followed(plan, robot, law)
        error = pose_error(robot.object, plan.scene.goal)
    assert ended.outcome == (DONE if law is None else "arrived")
    assert np.hypot(*error[:2]) < 0.001
    assert abs(error[2]) < math.radians(1)


class Beside(Narrow):
    """One whose hand has a yaw from -150° to 150°: none of the plan's without half a turn."""

    def yaws(self, pose):
        return math.radians(-150), math.radians(150)


@pytest.mark.parametrize("law", [None, "path", "horizon"])
def test_two_fingers_that_stand_alike_are_exchanged(block, law):
    pushes = tuple(fp.Push(name, block.outline.nearest(place), 2, 0.018) for name, place in SIDES.items())
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    plan = fp.plan(fp.Scene(block, (0.06, -0.02, -0.2), (0.0, 0.0, 0.0), pusher, pushes))
    limits = replace(Limits(), arm=Beside())
    # Fingers with half of the friction slip; the horizon controller lands more than once.
    off = Unknown(friction=0.1) if law == "horizon" else None
    with SimRobot(plan, off, home=[0.1, 0.0, 0.03, 0.3], limits=limits) as robot:
        ended = run(plan, robot) if law is None else followed(plan, robot, law)
        error = pose_error(robot.object, plan.scene.goal)
    assert ended.outcome == (DONE if law is None else "arrived")
    assert law != "horizon" or len([text for _, text in ended.notes if text.startswith("landing")]) > 2
    assert np.hypot(*error[:2]) < 0.001
    assert abs(error[2]) < math.radians(1)
    lopsided = replace(plan.pushes[0], fingers=plan.pushes[0].fingers + np.array([0.0, 1e-6]))
    other = replace(plan, segments=(plan.segments[0], lopsided, plan.segments[2]))
    with SimRobot(plan, home=[0.1, 0.0, 0.03, 0.3], limits=limits) as robot, pytest.raises(OutOfLimits):
        way(other, robot)
