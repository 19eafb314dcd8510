"""A simulated controller of a robot as a process of its own, started by tests."""

import json
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from flatpush.testing import check_robot
from tests.waiting import started, until


class SimulatedController(ExitStack):
    """Runs a script of this folder, which says when it is ready, and then answers every line with what it saw."""

    def __init__(self, script, *options):
        super().__init__()
        words = [sys.executable, str(Path(__file__).with_name(script)), *map(str, options)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.process = self.enter_context(started(words, patience=500, **pipes))
        self.process.stdout.readline()

    def asked(self, word=""):
        """What it saw until now; after the word "again" it is as at the beginning."""
        self.process.stdin.write(f"{word}\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def until(self, seen):
        """What it saw when that became what is waited for."""
        return until(lambda: (told := self.asked()) and seen(told) and told)

    def rests_when_it_goes_on(self, cycles, clock):
        """It was frozen: its tool comes to rest near where it was within so many of its cycles, which it counts as
        `clock`."""
        there = []
        self.process.send_signal(signal.SIGCONT)
        for after in (0, cycles, 2 * cycles):
            count = there[0][clock] + after if there else 0
            there.append(self.until(lambda told, count=count: told[clock] >= count))
        begun, rests, later = (np.array(told["pose"]) for told in there)
        assert np.linalg.norm((rests - begun)[:3]) < 0.003
        assert np.allclose(later, rests, atol=2e-5)


def conforms(controller, robot):
    """How many checks of flatpush.testing a robot passes, with a new controller for each.

    Args:
        controller: makes a SimulatedController. robot: makes the robot of one.
    """
    with ExitStack() as running:
        last = []

        def make():
            running.close()
            last[:] = [running.enter_context(controller())]
            return robot(last[0])

        return len(check_robot(make, kill=lambda _: last[0].process.kill()))
