"""Runs of a plan that are broken off in each of its phases: by an interrupt, or by the end of what a robot talks to."""

import signal
import subprocess
import sys
from contextlib import ExitStack
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import flatpush as fp
from flatpush.documents import load_robot_log
from flatpush.execution import DONE, run
from tests.waiting import started

PHASES = ("travel", "landing", "push", "lift")


def phase_of(cycle):
    """What the tool does in a cycle, by its target."""
    if "push" in cycle.leg:
        return "push"
    climb = float(cycle.target.twist[2])
    return "lift" if climb > 0 else "landing" if climb < 0 else "travel"


def one_push(thing):
    """A plan of one push of two fingers."""
    pushes = (fp.Push("south", thing.outline.nearest([0.0, -0.0175]), 2, 0.018),)
    return fp.plan(fp.Scene(thing, (0.0, -0.03, 0.1), pusher=fp.Pusher(2, 0.018), pushes=pushes))


def in_phase(phase, act):
    """What is to be told each cycle, so that something happens once, in the fifth cycle of a phase; and those told."""
    cycles, there = [], []

    def told(cycle):
        cycles.append(cycle)
        if phase_of(cycle) == phase:
            there.append(len(cycles))
            if len(there) == 5:
                act()

    return told, cycles, there


def interrupts(robot, plan, folder, rest):
    """Ctrl-C in every phase, on one robot that is entered: nothing more is sent, the tool rests, the log can be read.

    The phases in which it was interrupted.

    Args:
        rest: within this distance of where it was when it was stopped [m].
    """

    def interrupt():
        raise KeyboardInterrupt

    found = []
    for phase in PHASES:
        log = folder / f"{phase}.csv"
        told, cycles, _ = in_phase(phase, interrupt)
        sent = []
        send = robot.send
        robot.send = lambda target, sent=sent, send=send: (sent.append(target), send(target))[1]
        try:
            with pytest.raises(KeyboardInterrupt):
                run(plan, robot, log=log, told=told)
        finally:
            del robot.send
        found.append(phase_of(cycles[-1]))
        assert len(sent) == len(cycles)
        there = robot.state().pose
        robot.clock.wait(robot.clock.now() + robot.limits.age)
        rests = robot.state()
        assert np.linalg.norm((rests.pose - there)[:3]) < rest
        robot.clock.wait(robot.clock.now() + 10 * robot.limits.period)
        assert np.allclose(robot.state().pose, rests.pose, atol=2e-5)
        read(log, phase, "interrupted")
    return tuple(found)


def ends(robot, plan, folder, phase, kill):
    """What a robot talks to ends in a phase; how many cycles the run goes on, and its outcome."""
    log = folder / f"{phase}.csv"
    told, _, there = in_phase(phase, kill)
    ended = run(plan, robot, log=log, told=told)
    assert ended.outcome != DONE
    read(log, phase, ended.outcome)
    return len(ended.cycles) - there[4], ended.outcome


def ends_in_every_phase(controlled, robot_on, plan, folder, most, cycles, name):
    """Ctrl-C on this side, and the controller killed or frozen, in every phase of a plan.

    Args:
        controlled: a controller of given options, and robot_on: a robot on it, to be entered.
        most: cycles that a run goes on without its controller. cycles, name: after which the arm of one that was frozen
            rests, by the counter of that name.
    """
    with controlled() as controller, robot_on(controller) as robot:
        assert interrupts(robot, plan, folder, 0.003) == PHASES
    for phase, how in product(PHASES, (signal.SIGKILL, signal.SIGSTOP)):
        with controlled("--patience", 0.05) as controller, robot_on(controller, silence=0.5) as robot:
            act = partial(controller.process.send_signal, how)
            more, outcome = ends(robot, plan, folder, phase, act)
            assert 0 <= more <= most, outcome
            if how == signal.SIGSTOP:
                controller.rests_when_it_goes_on(cycles, name)


class BrokenClient(ExitStack):
    """Runs of a plan by a process of its own that is killed, frozen or late, as often as it is told to be.

    Args:
        module: the robot's tests, with its robot_at. where: its address. plan, folder: it is written there.
        base: pose of the table in the robot's base.
    """

    def __init__(self, module, where, plan, folder, base=None):
        super().__init__()
        plan.save(folder / "plan.json")
        script = Path(__file__).with_name("broken_client.py")
        words = [
            sys.executable,
            script,
            module,
            where,
            folder / "plan.json",
            script.parents[1],
            *(base or ()),
        ]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.process = self.enter_context(started([*map(str, words)], patience=300, **pipes))

    def breaks(self, phase, how, late=0.0):
        """Begins a run, and returns when it is broken off in a phase.

        Args:
            how: "killed", "frozen" or "late". late: by so much [s].
        """
        self.process.stdin.write(f"{phase} {how} {late}\n")
        self.process.stdin.flush()
        assert self.said() == phase

    def said(self):
        """The next line, such as the outcome of a run that was late."""
        return self.process.stdout.readline().strip()


def read(log, phase, outcome):
    """A log has rows from the landing on, and says how its run ended."""
    text = log.read_text()
    assert text.endswith(f"# ended: {outcome}\n")
    assert "# 0.0" in text
    if phase in ("push", "lift"):
        assert len(load_robot_log(log).runs[0].times) > 0
