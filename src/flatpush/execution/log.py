"""Writes what a robot did, row by row as it happens: a run that is broken off leaves a log that can be read."""

import io
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np

from ..control import ClosedLoopRun
from ..documents import check_writable, write_atomically
from ..documents.robot_log import GROUPS, RAW
from ..errors import FlatpushError, InputError
from ..geometry.pose import Array

if TYPE_CHECKING:
    from .bag import McapLog
    from .run import Cycle

# Rows come at most so often [s]; recorded runs have 25 to 30 a second.
STEP = 0.02
# A tool lower than this is on the table [m].
ON_TABLE = 0.0005
COLUMNS = (*GROUPS, *RAW, "vision_lost")


class LogFault(FlatpushError):
    """A log that cannot be written any more, as on a full disk; what it holds can be read."""


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


class Text(Protocol):
    """What takes text."""

    def write(self, text: str, /) -> object: ...


class WholeRows:
    """A file of text in which all that is written at once stands, or none of it: a full disk cuts no row."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = Path(path).open("wb", buffering=0)  # noqa: SIM115  # closed by __exit__

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()

    def write(self, text: str) -> None:
        begun, left = self._file.tell(), text.encode()
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            with suppress(OSError):  # a device has no length
                self._file.truncate(begun)
                self._file.seek(begun)
            raise


class CsvLog:
    """The layout of recorded runs, which `documents.load_robot_log` and replay read; a row is a time on the table.

    Lengths in mm, angles in rad. Every row is written at once; what the tool does is told in comments.
    """

    def __init__(self, file: Text, name: str) -> None:
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
    with ExitStack() as open_:
        try:
            if Path(path).suffix.lower() == ".mcap":
                from .bag import McapLog

                bag = McapLog(path, name)
                open_.callback(_close, bag)
                book: Log = bag
            else:
                book = CsvLog(open_.enter_context(WholeRows(path)), name)
        except OSError as error:
            raise InputError(f"this log cannot be written ({_why(error)})", source=os.fspath(path)) from error
        yield _Told(book, path)


class _Told:
    """A log that names itself where it cannot be written."""

    def __init__(self, book: Log, path: str | os.PathLike[str]) -> None:
        self._book, self._path = book, path

    def write(self, cycle: "Cycle") -> None:
        try:
            self._book.write(cycle)
        except OSError as error:
            raise LogFault(
                f"{os.fspath(self._path)}: this log cannot be written any more ({_why(error)})"
            ) from error

    def end(self, outcome: str) -> None:
        with suppress(OSError):
            self._book.end(outcome)


def _close(bag: "McapLog") -> None:
    with suppress(OSError):  # without the summary at its end it can be read as well
        bag.__exit__(None, None, None)


def _why(error: OSError) -> str:
    return (error.strerror or str(error)).lower()


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
