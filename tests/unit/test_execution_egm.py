"""Externally Guided Motion over loopback: a simulated controller in a process of its own, judged by its cycles."""

import math
import re
import socket
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from tests.broken_off import PHASES, BrokenClient, ends_in_every_phase, one_push
from tests.extras import extra
from tests.simulated_controller import SimulatedController, conforms
from tests.simulated_swing import after, swing
from tests.waiting import python

import flatpush as fp
from flatpush.execution import DONE, OutOfLimits, RobotFault, Target, open_robot, run

pytest.importorskip("abb_robot_client", reason=extra("abb"))
from flatpush.execution.egm import EgmRobot

SCRIPT = Path(__file__).parents[1] / "egm_controller.py"
HOME = (-0.1, 0.02, 0.03, 0.5)
SILENCE = 20.0  # on a shared machine: what is asserted are cycles


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", 0))
        return line.getsockname()[1]


class Controller(SimulatedController):
    def __init__(self, *options, port=None):
        self.port = port or free_port()
        super().__init__("egm_controller.py", "--port", self.port, "--home", *HOME, *options)


def robot_at(port, **more):
    return EgmRobot("127.0.0.1", port, **{"silence": SILENCE, "connect": SILENCE} | more)


@pytest.mark.parametrize("cycles", [500, pytest.param(15000, marks=pytest.mark.slow)])
def test_every_cycle_is_answered(cycles):
    with Controller() as controller, robot_at(controller.port) as robot:
        ended = swing(robot, cycles)
        seen = controller.asked()
    assert ended.outcome == DONE
    assert seen["answered"] >= cycles
    assert seen["worst"] <= 1  # the one after the last cycle, which nobody answers any more
    assert seen["stopped"] < 0
    times = np.array([cycle.time for cycle in ended.cycles])
    # The controller waits for answers from the first one on.
    assert np.allclose(np.diff(times)[1:], 0.004)
    # The tool is where the plan has it, with the speed fed forward.
    assert ended.off < 0.0005
    assert max(cycle.late for cycle in ended.cycles[2:]) < 0.004


def test_poses_go_through_the_base_frame():
    base = (0.3, -0.2, 0.05, 1.0)
    with Controller() as controller, robot_at(controller.port, base=base) as robot:
        tool = robot.state().pose
        c, s = math.cos(1.0), math.sin(1.0)
        place = np.array([[c, -s], [s, c]]) @ tool[:2] + base[:2]
        assert np.allclose(place, HOME[:2])
        assert tool[2] + 0.05 == pytest.approx(HOME[2])
        assert tool[3] + 1.0 == pytest.approx(HOME[3])
        robot.send(Target(robot.time + 0.004, tool, np.zeros(4)))
        robot.receive()
        assert np.allclose(controller.asked()["pose"], HOME, atol=1e-6)


def test_a_controller_that_is_killed_or_freezes_ends_the_run():
    with Controller() as controller, robot_at(controller.port, silence=0.5) as robot:
        ended = swing(robot, 500, after(100, controller.process.kill))
        robot.stop()
    assert "silent for 0.5 s" in ended.outcome
    assert 99 <= len(ended.cycles) <= 102
    with Controller("--freeze", 100) as controller, robot_at(controller.port, silence=0.5) as robot:
        ended = swing(robot, 500)
    assert "silent for 0.5 s" in ended.outcome
    assert 99 <= len(ended.cycles) <= 101


@pytest.mark.slow
def test_interrupts_and_ends_of_the_controller_stop_in_every_phase(three_feet, tmp_path):
    def robot_on(controller, **more):
        return robot_at(controller.port, **more)

    ends_in_every_phase(Controller, robot_on, one_push(three_feet), tmp_path, 2, 25, "cycles")


@pytest.mark.slow
def test_the_arm_stops_within_25_cycles_when_this_side_is_killed_frozen_or_late_in_every_phase(
    three_feet, tmp_path
):
    plan, late = one_push(three_feet), 4.0
    with (
        Controller("--patience", 0.05) as controller,
        BrokenClient(__name__, controller.port, plan, tmp_path) as client,
    ):
        for how in ("killed", "frozen", "late"):
            for phase in PHASES:
                controller.asked("again")
                client.breaks(phase, how, late)
                seen = controller.until(lambda told: told["stopped"] >= 0)
                # 25 cycles of 4 ms are 100 ms; after them the arm stays where it is.
                assert seen["worst"] == 25, (how, phase)
                if how == "late":
                    assert re.search(r"cycle came \d\.\d+ s late|RAPID is not running", client.said()), phase
                later = controller.until(lambda told, seen=seen: told["cycles"] > seen["stopped"] + 10)
                assert later["farthest"] < 1e-9, (how, phase)


def test_messages_that_have_waited_are_passed_over():
    """A side that stood still goes on from the newest message, and one that stood still for too long stops."""
    with Controller("--patience", 0.001) as controller, robot_at(controller.port) as robot:
        robot.receive()
        robot.stop()
        begun = robot.time
        controller.until(lambda told: told["worst"] >= 20)
        robot.clock.now()
        assert robot.time - begun >= 0.08
        ended = swing(robot, 500, lambda cycle: time.sleep(0.3 * (cycle.time > 0.1)))
    assert "late" in ended.outcome or "RAPID is not running" in ended.outcome


def test_nobody_answers():
    with pytest.raises(RobotFault, match=r"no EGM message from 127.0.0.1 on UDP port \d+ within 0.2 s"):
        robot_at(free_port(), connect=0.2).__enter__()
    with Controller() as controller:
        with pytest.raises(RobotFault, match=r"no EGM message from 10\.0\.0\.1"):
            EgmRobot("10.0.0.1", controller.port, connect=0.5).__enter__()
        port = controller.port
        with robot_at(port), pytest.raises(RobotFault, match=f"UDP port {port} cannot be listened on"):
            robot_at(port).__enter__()


@pytest.mark.slow
def test_it_conforms():
    assert conforms(Controller, lambda one: robot_at(one.port, silence=1.0)) == 10


@pytest.mark.slow
def test_a_plan_ends_in_the_cell_as_without_the_network(three_feet, tmp_path):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", three_feet.outline.nearest([0.0, -0.0175]), 2, 0.018),)
    plan = fp.plan(fp.Scene(three_feet, (-0.02, -0.04, 0.2), pusher=pusher, pushes=pushes))
    plan.save(tmp_path / "plan.json")
    off = (0.0005, -0.0005, 0.01)
    with Controller("--plan", tmp_path / "plan.json", "--start", *off) as controller:
        address = f"egm://127.0.0.1:{controller.port}?silence={SILENCE}&connect={SILENCE}"
        with open_robot(address, plan) as robot:
            ended = run(plan, robot)
            there = np.array(controller.asked()["object"])
    assert ended.outcome == DONE
    with open_robot(f"mujoco://tool?start=0.5,-0.5,{math.degrees(0.01)}", plan) as robot:
        run(plan, robot)
        here = robot.object
    assert np.hypot(*(here - there)[:2]) < 0.0005
    assert abs(here[2] - there[2]) < math.radians(0.3)


def test_an_arm_that_is_named_is_a_limit(three_feet):
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    pushes = (fp.Push("long edge", three_feet.outline.nearest([0.0, -0.0175]), 2, 0.018),)
    plan = fp.plan(fp.Scene(three_feet, (-0.02, -0.04, 0.2), pusher=pusher, pushes=pushes))
    with Controller("--home", 0.42, 0.0, 0.03, 0.5) as controller:
        far = open_robot(f"egm://127.0.0.1:{controller.port}?arm=irb120&tool=120", plan, (0.7, 0.0, 0.0, 0.0))
        with far as robot, pytest.raises(OutOfLimits, match=r"s: it is too far away from the arm"):
            run(plan, robot)
        assert controller.asked()["answered"] <= 1  # stop, which says where the tool is
    for turns in (-1, 0, 1):
        with Controller("--home", 0.42, 0.0, 0.03, 0.5, "--last", 360 * turns - 30) as controller:
            address = f"egm://127.0.0.1:{controller.port}?arm=irb120"
            with open_robot(address, plan, (0.36, 0.0, 0.0, 0.0)) as robot:
                assert robot.state().pose[3] == pytest.approx(0.5 - 2 * math.pi * turns)
    assert far.limits.arm.tool == pytest.approx(0.12)
    for address, rule in (
        ("egm://h?arm=irb99", "no such arm"),
        ("egm://h?arm=irb120&tool=-1", "of at least 0"),
    ):
        with pytest.raises(fp.InputError, match=rule):
            open_robot(address, plan)


SEVEN = """
import sys
sys.path.insert(0, sys.argv[2])
from flatpush.errors import InputError
from flatpush.execution.egm import EgmRobot
from tests.simulated_swing import swing
with EgmRobot("127.0.0.1", int(sys.argv[1]), connect=20, silence=20, robotware=7) as robot:
    ended = swing(robot, 200)
assert not [name for name in sys.modules if name.startswith("abb_robot_client")]
try:
    EgmRobot(robotware=6)
except InputError as error:
    assert "RobotWare 7 was spoken to" in str(error)
    print(ended.outcome, len(ended.cycles), ended.off)
"""


def test_robotware_7_by_its_own_library():
    """In a process of its own: both libraries register the same messages."""
    if find_spec("ABBRobotEGM") is None:
        pytest.skip("ABBRobotEGM is not installed")
    with Controller() as controller:
        told = python("-c", SEVEN, controller.port, SCRIPT.parents[1])
        seen = controller.asked()
    assert told.returncode == 0, told.stderr
    outcome, cycles, off = told.stdout.split()
    assert outcome == DONE
    assert int(cycles) >= 199
    assert float(off) < 0.0005
    assert seen["answered"] >= int(cycles)
    assert seen["stopped"] < 0
