"""A Franka Research 3 over loopback: franky-sim in a process of its own, slower than real time; judged by its clock."""

import itertools
import math
import os
import signal
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from tests.broken_off import PHASES, BrokenClient, ends, interrupts
from tests.extras import extra
from tests.simulated_controller import SimulatedController, conforms
from tests.simulated_swing import after, swing
from tests.waiting import until

import flatpush as fp
from flatpush.execution import DONE, RobotFault, Target, open_robot, run
from flatpush.execution.arms import ARMS
from flatpush.execution.cell.robot import CellRobot
from flatpush.execution.simulated import home_of

pytest.importorskip("franky", reason=extra("franka"))
pytest.importorskip("franky_sim", reason=extra("franka"))
from flatpush.execution.franka import FrankaRobot

HOME = np.array([-0.05, 0.02, 0.03, 0.5])
# franky-sim has Franka's hand: 103.4 mm long, turned by 45°.
ARM = replace(ARMS["fr3"].placed(), tool=0.1034, turn=math.pi / 4)
SILENCE = 20.0  # on a shared machine: what is asserted is the robot's time
numbers = itertools.count(1)


class Controller(SimulatedController):
    """Its port is fixed, so each has an address of its own."""

    def __init__(self, home=HOME, joints=None):
        self.host = f"127.{50 + os.getpid() // 250 % 200}.{1 + os.getpid() % 250}.{next(numbers) % 250}"
        joints = ARM.joints(home) if joints is None else joints
        super().__init__("franka_controller.py", "--host", self.host, "--joints", *joints)


def robot_at(host, **more):
    return FrankaRobot(host, **{"silence": SILENCE, "connect": SILENCE} | more)


@pytest.mark.slow
def test_the_tool_follows_and_rests_and_its_end_is_noticed():
    with Controller() as controller, robot_at(controller.host, silence=2.0) as robot:
        assert np.allclose(robot.state().pose, HOME, atol=2e-5)
        assert np.allclose(controller.asked()["q"], ARM.joints(HOME), atol=1e-4)
        # Slow enough: it turns 0.0015 rad too far whatever the load; in half the time 0.0019, more if cycles are late.
        ended = swing(robot, 120, width=0.01)
        assert ended.outcome == DONE
        poses = np.array([cycle.state.pose for cycle in ended.cycles])
        assert np.ptp(poses[:, 0]) == pytest.approx(0.01, abs=2e-4)
        assert np.ptp(poses[:, 3]) == pytest.approx(0.1, abs=2e-3)
        assert ended.off < 3e-4
        rests = robot.state().pose
        robot.clock.wait(robot.time + 0.1)
        assert np.allclose(robot.state().pose, rests, atol=5e-5)
        ended = swing(robot, 60, after(20, controller.process.kill), width=0.01)
        robot.stop()
    assert "lost" in ended.outcome or "silent" in ended.outcome or "ended the motion" in ended.outcome
    assert 20 <= len(ended.cycles) <= 31


@pytest.mark.slow
def test_a_velocity_that_is_not_renewed_ends_after_a_tenth_of_a_second():
    """As where this side hangs: one velocity is sent, and nothing more."""
    with Controller() as controller, robot_at(controller.host) as robot:
        start = robot.state()
        robot.send(Target(robot.time + 0.01, start.pose, np.array([0.05, 0.0, 0.0, 0.0])))
        begun = robot.time
        until(lambda: (robot.receive(), robot.time >= begun + 0.2)[1], pause=0)
        after = robot.state()
        far = after.pose[0] - start.pose[0]
        assert 0.002 < far < 0.05 * 0.11
        robot.clock.wait(robot.time + 0.1)
        assert np.allclose(robot.state().pose, after.pose, atol=2e-5)


@pytest.mark.slow
def test_a_robot_that_freezes_ends_the_run_and_does_not_go_on_afterwards():
    """Its time stands still as well: once it goes on, it stops within a tenth of a second of its own time."""
    with Controller() as controller, robot_at(controller.host, silence=2.0) as robot:
        freeze = after(30, lambda: controller.process.send_signal(signal.SIGSTOP))
        ended = swing(robot, 120, freeze, width=0.05)
        assert ended.outcome != DONE
        assert 30 <= len(ended.cycles) <= 41
        robot.stop()
        last = ended.cycles[-1].state
        assert np.hypot(*last.twist[:2]) > 0.02  # it was under way
        controller.process.send_signal(signal.SIGCONT)
        moved = np.array([controller.asked()["q"] for _ in range(500)]) - ARM.joints(last.pose)
        # Each answer is a step of the robot or more, of 1 ms. It comes to rest near where it was.
        assert np.abs(moved).max() < 0.02
        assert np.ptp(moved[-100:], axis=0).max() < 1e-3


# The push goes along the table's y, away from the arm.
ASIDE = (0.4, 0.0, 0.2, -math.pi / 2)


def long_push(triangle):
    """A plan of one push, and the joint angles where an arm at ASIDE begins it."""
    pusher = fp.Pusher(fingers=2, spacing=0.018, speed=0.03)
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    plan = fp.plan(fp.Scene(triangle, (-0.01, -0.06, 0.1), pusher=pusher, pushes=pushes))
    return plan, replace(ARM, base=ASIDE).joints(home_of(plan))


@pytest.mark.slow
def test_interrupts_and_ends_of_the_robot_stop_in_every_phase(triangle, tmp_path):
    plan, joints = long_push(triangle)
    with Controller(joints=joints) as controller, robot_at(controller.host, base=ASIDE) as robot:
        assert interrupts(robot, plan, tmp_path, 0.003) == PHASES
    for phase in PHASES:
        with (
            Controller(joints=joints) as controller,
            robot_at(controller.host, base=ASIDE, silence=2.0) as robot,
        ):
            more, outcome = ends(robot, plan, tmp_path, phase, controller.process.kill)
        assert 0 <= more <= 11, outcome


@pytest.mark.slow
def test_a_robot_that_freezes_in_any_phase_ends_the_run_and_rests_when_it_goes_on(triangle, tmp_path):
    plan, joints = long_push(triangle)
    for phase in PHASES:
        with (
            Controller(joints=joints) as controller,
            robot_at(controller.host, base=ASIDE, silence=2.0) as robot,
        ):
            freeze = partial(controller.process.send_signal, signal.SIGSTOP)
            more, outcome = ends(robot, plan, tmp_path, phase, freeze)
            assert 0 <= more <= 11, outcome
            last = robot.state()
            assert np.linalg.norm(last.twist[:3]) > 0.001, phase  # it was under way
            controller.process.send_signal(signal.SIGCONT)
            there = robot.limits.arm.joints(last.pose)
            moved = np.array([controller.asked()["q"] for _ in range(500)]) - there
            # Each answer is a millisecond of the robot or more.
            assert np.abs(moved).max() < 0.005, phase
            assert np.abs(moved[100:] - moved[-1]).max() < 2e-3, phase


@pytest.mark.slow
def test_the_arm_stops_within_100_ms_when_this_side_is_killed_in_every_phase(triangle, tmp_path):
    """Where it freezes franky-sim goes on with its last velocity, as it counts no missed cycles."""
    plan, joints = long_push(triangle)
    with (
        Controller(joints=joints) as controller,
        BrokenClient(__name__, controller.host, plan, tmp_path, base=ASIDE) as client,
    ):
        for phase in PHASES:
            client.breaks(phase, "killed")
            begun = controller.asked()
            rests, later = (
                controller.until(lambda told, begun=begun, steps=steps: told["step"] >= begun["step"] + steps)
                for steps in (100, 300)
            )
            # The simulated last joint trembles about where it rests.
            moved = np.abs(np.subtract(rests["q"], later["q"]))
            assert moved[:6].max() < 2e-4, phase
            assert moved[6] < 2e-3, phase


@pytest.mark.slow
def test_a_turned_elbow_is_no_start():
    joints = ARM.joints(HOME)
    joints[2] = 0.1
    with Controller(joints=joints) as controller, robot_at(controller.host) as robot:
        assert "third and fifth joint" in robot.state().fault or "straight down" in robot.state().fault


@pytest.mark.slow
def test_it_conforms():
    assert conforms(Controller, lambda one: robot_at(one.host, silence=2.0)) == 10


@pytest.mark.slow
def test_the_same_plan_ends_at_the_same_place_on_all_robots(triangle, tmp_path):
    """On the network the FR3 has no object: the way that its tool really made pushes the one of the physics cell."""
    pytest.importorskip("abb_robot_client", reason=extra("abb"))
    from tests.unit.test_execution_egm import Controller as EgmController

    plan, joints = long_push(triangle)
    with Controller(joints=joints) as controller, robot_at(controller.host, base=ASIDE) as robot:
        ended = run(plan, robot)
    assert ended.outcome == DONE
    off = [cycle.off for cycle in ended.cycles if "push" in cycle.leg]
    assert np.mean(off) < 1e-4
    assert np.max(off) < 3e-4
    found = {}
    plan.save(tmp_path / "plan.json")
    with EgmController("--plan", tmp_path / "plan.json") as controller:
        address = f"egm://127.0.0.1:{controller.port}?silence={SILENCE}&connect={SILENCE}"
        with open_robot(address, plan) as robot:
            assert run(plan, robot).outcome == DONE
            found["egm"] = np.array(controller.asked()["object"])
    with CellRobot(plan) as cell:
        for cycle in ended.cycles:
            cell.send(Target(cell.clock.now() + 0.01, cycle.state.pose, cycle.state.twist))
            cell.clock.wait(cell.clock.now() + 0.01)
        found["network"] = cell.object
    for name in ("tool", "fr3", "irb120"):
        with open_robot(f"mujoco://{name}", plan, ASIDE) as cell:
            run(plan, cell)
            found[name] = cell.object
    assert np.hypot(*(found["tool"] - plan.scene.start_pose)[:2]) > 0.04
    for one, other in itertools.combinations(found.values(), 2):
        assert np.hypot(*(one - other)[:2]) < 0.0005
        assert abs(one[2] - other[2]) < math.radians(0.3)


def test_where_nobody_answers_and_its_address(triangle):
    with pytest.raises(RobotFault, match=r"no Franka robot at 127\.1\.2\.3: port 1337 does not answer"):
        FrankaRobot("127.1.2.3", connect=0.2).__enter__()
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    plan = fp.plan(fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=pusher, pushes=pushes))
    assert open_robot("franka://10.0.0.7?speed=50", plan).limits.speed == pytest.approx(0.05)
    with pytest.raises(fp.InputError, match="has an address"):
        open_robot("franka", plan)
