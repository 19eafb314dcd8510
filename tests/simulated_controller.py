"""A simulated controller of a robot as a process of its own, started by tests."""

import json
import os
import subprocess
import sys
from pathlib import Path


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

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()
