"""Reads logs of a robot that pushed while a camera watched: raw text of the public toolbox, or CSV with names."""

import csv
import io
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .reading import read_text
from .rows import BadRow, Unusable, number, refusal

# In the order of a raw row; lengths in mm, angles in rad.
RAW = (
    "t",
    "obj_x_mm",
    "obj_y_mm",
    "obj_theta_rad",
    "pusher_x_mm",
    "pusher_y_mm",
    "pusher_theta_rad",
    "action_id",
)
GROUPS = ("object", "start_id", "run_id")
MOST_BYTES = 100_000_000
MOST_ACTIONS = 1_000_000
_FORMAT = (
    f"A row is {', '.join(RAW)}: raw text of eight numbers, or CSV whose first line names these columns."
)


@dataclass(frozen=True, eq=False)
class RobotRun:
    """One run of the robot; n rows, in SI.

    Attributes:
        object: name of what was pushed. start, run: which start and which run from it.
        times: rising (n,) [s].
        poses: of the object in the camera's table frame, (n, 3); where it was not seen they mean nothing.
        hands: of the pusher (frame E) in the robot's table frame, (n, 3).
        actions: number of the push, as the robot logged it (n,).
        seen: whether the camera saw the object (n,).
        lines: of the file (n,), counted from 1.
    """

    object: str
    start: str
    run: str
    times: Array
    poses: Array
    hands: Array
    actions: np.ndarray
    seen: np.ndarray
    lines: np.ndarray

    @property
    def name(self) -> str:
        return " ".join(part for part in (self.object, self.start, self.run) if part)


@dataclass(frozen=True, eq=False)
class RobotLog:
    """What was read.

    Attributes:
        runs: in the order in which they begin.
        left_out: rows that cannot be used.
        unended: the last line, if no line break ends it: where a file was cut inside a number, that number is wrong.
    """

    runs: tuple[RobotRun, ...]
    left_out: tuple[BadRow, ...] = ()
    unended: int | None = None


def load_robot_log(path: str | os.PathLike[str], *, skip_bad: bool = False) -> RobotLog:
    """The runs in a log.

    A raw log has eight numbers a row, between commas or blanks: time [s], pose of the object and pose of the pusher
    (mm, mm, rad), number of the push. A CSV names these columns (t, obj_x_mm, obj_y_mm, obj_theta_rad, pusher_x_mm,
    pusher_y_mm, pusher_theta_rad, action_id) and may have object, start_id and run_id, which tell runs apart, and
    vision_lost. An object at exactly (0, 0, 0) was not seen.

    Args:
        skip_bad: leave bad rows out instead of refusing the file. They are listed in the result.

    Raises:
        InputError: for a file that is no such log, or, with the numbers of the lines, for rows that are cut off, not
            numbers, not finite, or whose stamp repeats or runs backwards.
    """
    source = os.fspath(path)
    text = read_text(path, MOST_BYTES)
    rows = _rows(text, source)
    first = next(rows, None)
    if first is None:
        raise InputError("the file is empty", source=source, hint=_FORMAT)
    names = [cell.strip() for cell in first[1]]
    named = any(name in RAW for name in names)
    if named:
        columns = _columns(names, source)
    else:
        columns = {name: k for k, name in enumerate(RAW)}
        names = list(RAW)
        rows = _rows(text, source)
    good: dict[tuple[str, ...], list[tuple[int, list[float]]]] = {}
    bad: list[BadRow] = []
    last: dict[tuple[str, ...], tuple[float, int]] = {}
    line = first[0]
    for line, cells in rows:
        try:
            values = _values(cells, columns, len(names))
            key = tuple(cells[columns[name]].strip() if name in columns else "" for name in GROUPS)
            if key in last and values[0] <= last[key][0]:
                how = "repeats that" if values[0] == last[key][0] else "runs back behind that"
                raise Unusable(f"its stamp {cells[columns['t']].strip()} {how} of line {last[key][1]}")
        except Unusable as reason:
            bad.append(BadRow(line, str(reason)))
            continue
        last[key] = (values[0], line)
        good.setdefault(key, []).append((line, values))
    if bad and not skip_bad:
        raise refusal(bad, source, ": load_robot_log(path, skip_bad=True)")
    if not good:
        raise InputError("the log holds no usable row", source=source, hint=_FORMAT)
    stem = Path(source).stem
    runs = tuple(_run(key if any(key) else (stem, "", ""), found) for key, found in good.items())
    return RobotLog(runs, tuple(bad), None if text.endswith(("\n", "\r")) else line)


def _rows(text: str, source: str) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of the lines that are neither empty nor a comment."""
    for line, row in enumerate(io.StringIO(text), start=1):
        if not row.strip() or row.lstrip().startswith("#"):
            continue
        try:
            cells = next(csv.reader([row], strict=True)) if "," in row else row.split()
        except csv.Error as error:
            raise InputError(f"line {line} is not CSV ({error})", source=source, hint=_FORMAT) from None
        if len(cells) > 1 and not cells[-1].strip():
            cells = cells[:-1] if len(cells) == len(RAW) + 1 else cells  # a raw row may end with a comma
        yield line, cells


def _columns(names: Sequence[str], source: str) -> dict[str, int]:
    for name in names:
        if name and names.count(name) > 1:
            raise InputError(
                f"two columns have the name {name!r}", source=source, hint="Keep one of the two."
            )
    missing = [name for name in RAW if name not in names]
    if missing:
        raise InputError(f"line 1 names no column {', '.join(missing)}", source=source, hint=_FORMAT)
    return {name: k for k, name in enumerate(names)}


def _values(cells: Sequence[str], columns: dict[str, int], width: int) -> list[float]:
    """The eight numbers of a raw row, and whether the object was seen."""
    if len(cells) != width:
        raise Unusable(f"it has {len(cells)} of {width} columns")
    values = [number(cells[columns[name]], name) for name in RAW]
    if values[-1] != round(values[-1]) or abs(values[-1]) > MOST_ACTIONS:
        raise Unusable(f"action_id is not the number of a push ({cells[columns['action_id']].strip()})")
    lost = cells[columns["vision_lost"]].strip() if "vision_lost" in columns else "0"
    if lost not in ("0", "1"):
        raise Unusable(f"vision_lost is neither 0 nor 1 ({lost[:20]!r})")
    return [*values, float(lost == "0" and any(values[1:4]))]


def _run(key: tuple[str, ...], rows: Sequence[tuple[int, list[float]]]) -> RobotRun:
    table = np.array([values for _, values in rows])
    scale = np.array([1e-3, 1e-3, 1.0])
    return RobotRun(
        object=key[0],
        start=key[1],
        run=key[2],
        times=table[:, 0] - table[0, 0],
        poses=table[:, 1:4] * scale,
        hands=table[:, 4:7] * scale,
        actions=table[:, 7].astype(int),
        seen=table[:, 8] > 0,
        lines=np.array([line for line, _ in rows]),
    )
