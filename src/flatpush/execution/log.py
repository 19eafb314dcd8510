"""Writes what a robot did, row by row as it happens: a run that is broken off leaves a log that can be read."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TextIO

import numpy as np

from ..control import ClosedLoopRun
from ..documents import check_writable, write_atomically
from ..documents.robot_log import GROUPS, RAW
from ..errors import InputError
from ..geometry.pose import Array

if TYPE_CHECKING:
    from .run import Cycle

# Rows come at most so often [s]; recorded runs have 25 to 30 a second.
STEP = 0.02
# A tool lower than this is on the table [m].
ON_TABLE = 0.0005
COLUMNS = (*GROUPS, *RAW, "vision_lost")


class Log(Protocol):
    """Takes cycles as they happen."""

    def write(self, cycle: "Cycle") -> None: ...

    def end(self, outcome: str) -> None:
        """The last word."""
        ...


class NoLog:
    """Keeps nothing."""

    def write(self, cycle: "Cycle") -> None:
        pass

    def end(self, outcome: str) -> None:
        pass


class CsvLog:
    """The layout of recorded runs, which `documents.load_robot_log` and replay read; a row is a time on the table.

    Lengths in mm, angles in rad. Every row is written at once; what the tool does is told in comments.
    """

    def __init__(self, file: TextIO, name: str) -> None:
        self._file, self._name = file, name.replace(",", " ").replace('"', " ").replace("\n", " ")
        self._last, self._push, self._leg = -np.inf, 0, ""
        file.write(",".join(COLUMNS) + "\n")

    def write(self, cycle: "Cycle") -> None:
        if cycle.leg != self._leg:
            self._leg = cycle.leg
            self._file.write(f"# {cycle.time:.3f} s: {cycle.leg}\n")
        if cycle.push >= 0:
            self._push = cycle.push
        self.row(cycle.time, cycle.object, cycle.state.pose)

    def row(self, time: float, object_: Array | None, tool: Array) -> None:
        """X_WO (3,), or None where it was not seen, and the tool (x, y, height, yaw) at a time [s]."""
        if tool[2] > ON_TABLE or time - self._last < STEP - 1e-9:
            return
        self._last = time
        pose, lost = (np.zeros(3), 1) if object_ is None else (object_, 0)
        x, y, _, yaw = tool
        rows = [1000 * pose[0], 1000 * pose[1], pose[2], 1000 * x, 1000 * y, yaw]
        cells = ",".join(f"{value:.6f}" for value in rows)
        self._file.write(f"{self._name},,,{time:.6f},{cells},{self._push},{lost}\n")

    def next_push(self) -> None:
        """The rows that follow are of the next push."""
        self._push += 1

    def end(self, outcome: str) -> None:
        self._file.write(f"# ended: {' '.join(outcome.split())}\n")


def save_followed(run: ClosedLoopRun, name: str, path: str | os.PathLike[str]) -> None:
    """Writes a simulated run under feedback as the log of a robot's, each landing as a push of its own.

    Args:
        name: of the object. path: a file ending in .csv.

    Raises:
        InputError: for another ending, or a place that cannot be written to.
    """
    if Path(path).suffix.lower() != ".csv":
        raise InputError("the log of a simulated run ends in .csv", source=os.fspath(path))
    text = io.StringIO()
    book, lifted = CsvLog(text, name), True
    for k, time in enumerate(run.times):
        # Heights are those at the end of each tick.
        height = run.heights[k - 1] if k else 0.0
        if lifted and height <= ON_TABLE:
            book.next_push()
        lifted = height > ON_TABLE
        x, y, yaw = run.pusher[k]
        book.row(float(time), run.object[k], np.array([x, y, height, yaw]))
    book.end(run.outcome)
    write_atomically(path, text.getvalue())


@contextmanager
def open_log(path: str | os.PathLike[str] | None, name: str) -> Iterator[Log]:
    """The log that a file name asks for.

    Raises:
        InputError: for another ending than .csv and .mcap, or a place that cannot be written to.
        MissingExtra: for .mcap without its library.
    """
    if path is None:
        yield NoLog()
        return
    check_log(path)
    if Path(path).suffix.lower() == ".mcap":
        from .bag import McapLog

        with McapLog(path, name) as bag:
            yield bag
        return
    with open(path, "w", encoding="utf-8", buffering=1, newline="\n") as file:
        yield CsvLog(file, name)


def check_log(path: str | os.PathLike[str]) -> None:
    """Refuses a log that could not be written.

    Raises:
        InputError: as open_log.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".csv", ".mcap"):
        raise InputError("a log ends in .csv or .mcap", source=os.fspath(path))
    check_writable(path)
    if ending == ".mcap":
        from .bag import load

        load()
