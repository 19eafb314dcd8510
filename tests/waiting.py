"""Waits of tests, which all end, and processes, which end with the test that started them."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any, TypeVar

PATIENCE = 120.0  # on a busy machine [s]
T = TypeVar("T")


@contextlib.contextmanager
def started(
    words: list[str], patience: float = PATIENCE, **options: object
) -> Iterator[subprocess.Popen[str]]:
    """A process that is killed, with all that it started, on leaving or after `patience` [s].

    So whatever reads from it or waits for it within the context ends.
    """
    with subprocess.Popen(words, text=True, start_new_session=True, **options) as process:

        def kill():
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)

        limit = threading.Timer(patience, kill)
        limit.start()
        try:
            yield process
        finally:
            limit.cancel()
            kill()


def until(holds: Callable[[], T], patience: float = PATIENCE, pause: float = 0.01) -> T:
    """What `holds` gives as soon as that is true; asked again after each `pause` [s], for `patience` [s] at most."""
    end = time.monotonic() + patience
    while not (found := holds()):
        assert time.monotonic() < end, f"not within {patience:g} s"
        time.sleep(pause)
    return found


def python(*words: object, patience: float = PATIENCE, **options: object) -> subprocess.CompletedProcess[str]:
    """How Python with these arguments ends, in a process of its own."""
    command = [sys.executable, *map(str, words)]
    with started(command, patience, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options) as process:
        said = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, *said)


def heard(line: Connection, patience: float = PATIENCE) -> Any:
    """What comes next through a pipe."""
    assert line.poll(patience), f"nothing within {patience:g} s"
    return line.recv()
