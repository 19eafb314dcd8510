"""The server of the live page in a process of its own."""

import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import ExitStack
from pathlib import Path

from tests.waiting import started

EXAMPLES = Path(__file__).parents[1] / "examples"
COMMAND = [sys.executable, "-c", "from flatpush.cli import main; main()", "view", "--no-browser"]
PATIENCE = 60  # for an answer on a busy machine [s]
LONGEST = 1500.0  # that a server lives, for all tests of a file [s]


class Served(ExitStack):
    """A server in a process of its own, and what it has said."""

    def __init__(self, *arguments):
        super().__init__()
        pipes = {"stderr": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.process = self.enter_context(started([*COMMAND, *arguments], LONGEST, **pipes))
        self.said = ""
        while "token=" not in self.said:
            line = self.process.stderr.readline()
            assert line, self.said
            self.said += line
        self.link = re.search(r"http://\S+", self.said)[0]
        self.host = self.link.split("/")[2]
        self.token = self.link.split("token=")[1]

    def get(self, path, **headers):
        """Status and headers of an answer."""
        request = urllib.request.Request(f"http://{self.host}{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.headers, error.read()

    def stop(self):
        """Ends it by Ctrl-C; its status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(PATIENCE)
