"""A UR controller over loopback: simulated in a process of its own, judged by its cycles of 8 ms."""

import itertools
import math
import os
import signal
import socket
from dataclasses import replace

import numpy as np
import pytest
from tests.broken_off import PHASES, BrokenClient, ends_in_every_phase, one_push
from tests.extras import extra
from tests.simulated_controller import SimulatedController, conforms
from tests.simulated_swing import swing

import flatpush as fp
from flatpush.execution import DONE, RobotFault, Target, open_robot, run
from flatpush.execution.arms import ARMS

pytest.importorskip("rtde_control", reason=extra("ur"))
from flatpush.execution.ur import LIMITS, UrRobot

HOME = (-0.1, 0.02, 0.03, 0.5)
SILENCE = 20.0  # on a shared machine: what is asserted are cycles
numbers = itertools.count(1)


class Controller(SimulatedController):
    """Its ports are fixed, so each has an address of its own."""

    def __init__(self, *options):
        self.host = f"127.{50 + os.getpid() // 250 % 200}.{1 + os.getpid() % 250}.{next(numbers) % 250}"
        super().__init__("ur_controller.py", "--host", self.host, "--home", *HOME, *options)


def robot_at(host, **more):
    return UrRobot(host, **{"silence": SILENCE, "connect": SILENCE} | more)


def test_every_cycle_has_its_command_and_the_tool_follows():
    with Controller() as controller, robot_at(controller.host) as robot:
        ended = swing(robot, 200)
        seen = controller.asked()
    assert ended.outcome == DONE
    assert seen["fired"] < 0
    assert seen["commands"] == len(ended.cycles) >= 199
    # The watchdog is set in the first cycle, which takes some; then there is one target in each for which this machine
    # is not late.
    cycles = np.diff([cycle.time for cycle in ended.cycles])[10:] / 0.008
    assert np.allclose(cycles, np.round(cycles))
    assert np.median(cycles) == pytest.approx(1.0)
    # The simulated arm lags by 20 ms and a cycle, at 20 mm/s and more in the middle.
    poses = np.array([cycle.state.pose for cycle in ended.cycles])
    assert np.ptp(poses[:, 0]) == pytest.approx(0.02, abs=5e-4)
    assert np.ptp(poses[:, 3]) == pytest.approx(0.2, abs=5e-3)
    assert 1e-4 < ended.off < 0.002


def test_poses_and_speeds_go_through_the_base_frame():
    base = (0.3, -0.2, 0.05, 1.0)
    with Controller() as controller, robot_at(controller.host, base=base) as robot:
        tool = robot.state().pose
        c, s = math.cos(1.0), math.sin(1.0)
        assert np.allclose(np.array([[c, -s], [s, c]]) @ tool[:2] + base[:2], HOME[:2])
        assert tool[2] + 0.05 == pytest.approx(HOME[2])
        assert tool[3] + 1.0 == pytest.approx(HOME[3])
        there = tool + np.array([0.001, 0.0, 0.0, 0.0])
        for _ in range(4):
            robot.send(Target(robot.time + 0.008, there, np.zeros(4)))
            robot.receive()
        twist = robot.state().twist
        assert twist[0] > 0.005
        assert abs(twist[1]) < 0.01 * twist[0]
        robot.stop()


def test_the_last_joint_tells_how_often_the_hand_has_turned():
    arm = ARMS["ur5e"].placed((0.0, 0.0, 0.0, 0.0))
    angle = arm.joints(np.array([0.3, 0.1, 0.03, 0.5]))[-1]
    for turns in (-1, 0, 1):
        joint = ("--last", angle - 2 * math.pi * turns, "--home", 0.3, 0.1, 0.03, 0.5)
        with (
            Controller(*joint) as controller,
            robot_at(controller.host, limits=replace(LIMITS, arm=arm)) as robot,
        ):
            assert robot.state().pose[3] == pytest.approx(0.5 + 2 * math.pi * turns)


def test_a_controller_that_is_killed_or_freezes_ends_the_run():
    for how in (signal.SIGKILL, signal.SIGSTOP):
        with Controller() as controller, robot_at(controller.host, silence=0.5) as robot:
            count = 0

            def told(cycle, how=how, controller=controller):
                nonlocal count
                count += 1
                if count == 100:
                    controller.process.send_signal(how)

            ended = swing(robot, 500, told)
            robot.stop()
        assert "silent for 0.5 s" in ended.outcome
        assert 99 <= len(ended.cycles) <= 103


@pytest.mark.slow
def test_interrupts_and_ends_of_the_controller_stop_in_every_phase(three_feet, tmp_path):
    def robot_on(controller, **more):
        return robot_at(controller.host, **more)

    ends_in_every_phase(Controller, robot_on, one_push(three_feet), tmp_path, 3, 12, "cycle")


@pytest.mark.slow
def test_the_watchdog_stops_the_arm_when_this_side_is_killed_frozen_or_late_in_every_phase(
    three_feet, tmp_path
):
    plan, late = one_push(three_feet), 4.0
    with (
        Controller("--patience", 0.05) as controller,
        BrokenClient(__name__, controller.host, plan, tmp_path) as client,
    ):
        for how in ("killed", "frozen", "late"):
            for phase in PHASES:
                controller.asked("again")
                client.breaks(phase, how, late)
                seen = controller.until(lambda told: told["fired"] >= 0)
                # The watchdog of 11 Hz waits for more than 11 cycles of 8 ms: 12 are 96 ms.
                assert seen["fired"] - seen["heard"] == 12, (how, phase)
                if how == "late":
                    assert client.said() != DONE
                later = controller.until(lambda told, seen=seen: told["cycle"] > seen["fired"] + 10)
                assert later["far"] < 1e-9, (how, phase)
                assert not later["playing"]


def test_where_nobody_or_somebody_else_answers():
    with pytest.raises(RobotFault, match=r"no UR controller at 127\.1\.2\.3: its dashboard, port 29999"):
        UrRobot("127.1.2.3", connect=0.2).__enter__()
    with socket.create_server(("127.1.2.4", 29999)), pytest.raises(RobotFault, match="does not answer"):
        UrRobot("127.1.2.4", connect=0.2).__enter__()


def test_its_address(triangle):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", triangle.outline.nearest([0.0, -0.0095]), 2, 0.018),)
    plan = fp.plan(fp.Scene(triangle, (-0.02, -0.05, 0.2), pusher=pusher, pushes=pushes))
    robot = open_robot("ur://10.0.0.7?speed=50&connect=2", plan)
    assert robot.limits.speed == pytest.approx(0.05)
    for address, rule in (("ur", "has an address"), ("ur://10.0.0.7?colour=1", "no option 'colour'")):
        with pytest.raises(fp.InputError, match=rule):
            open_robot(address, plan)


@pytest.mark.slow
def test_it_conforms():
    assert conforms(lambda: Controller("--patience", 0.1), lambda one: robot_at(one.host, silence=1.0)) == 10


@pytest.mark.slow
def test_a_plan_ends_in_the_cell_as_without_the_network(three_feet, tmp_path):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", three_feet.outline.nearest([0.0, -0.0175]), 2, 0.018),)
    plan = fp.plan(fp.Scene(three_feet, (-0.02, -0.04, 0.2), pusher=pusher, pushes=pushes))
    plan.save(tmp_path / "plan.json")
    with (
        Controller("--plan", tmp_path / "plan.json") as controller,
        open_robot(f"ur://{controller.host}?silence={SILENCE}&connect={SILENCE}", plan) as robot,
    ):
        ended = run(plan, robot)
        there = np.array(controller.asked()["object"])
    assert ended.outcome == DONE
    with open_robot("mujoco://tool", plan) as robot:
        run(plan, robot)
        here = robot.object
    assert np.hypot(*(here - there)[:2]) < 0.0005
    assert abs(here[2] - there[2]) < math.radians(0.3)
