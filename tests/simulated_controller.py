"""A simulated controller of a robot as a process of its own, started by tests."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from flatpush.testing import check_robot


class SimulatedController:
    """Runs a script of this folder, which says when it is ready, and then answers every line with what it saw."""

    def __init__(self, script, *options):
        words = [sys.executable, str(Path(__file__).with_name(script)), *map(str, options)]
        self.process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=dict(os.environ)
        )
        self.process.stdout.readline()

    def asked(self):
        """What it saw until now."""
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def until(self, seen, patience=60.0):
        """What it saw when that became what is waited for; an error after some time [s]."""
        due = time.monotonic() + patience
        while not seen(told := self.asked()):
            assert time.monotonic() < due, f"waited for {patience} s; the controller saw {told}"
            time.sleep(0.01)
        return told

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


def conforms(controller, robot):
    """How many checks of flatpush.testing a robot passes, with a new controller for each.

    Args:
        controller: makes a SimulatedController. robot: makes the robot of one.
    """
    running = []

    def make():
        while running:
            running.pop().__exit__()
        running.append(controller())
        return robot(running[-1])

    try:
        return len(check_robot(make, kill=lambda _: running[-1].process.kill()))
    finally:
        while running:
            running.pop().__exit__()
