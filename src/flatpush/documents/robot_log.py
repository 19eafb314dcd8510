"""Reads logs of a robot that pushed while a camera watched: raw text of the public toolbox, or CSV with names."""

import csv
import io
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .context import PER_METRE
from .log_columns import ROLES, RUNS, TURN, bare, column, holds
from .log_columns import columns as columns_of
from .reading import read_text
from .rows import BadRow, Unusable, is_number, number, refusal
from .scene_model import LARGEST

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
        """Object, start and run, for messages."""
        return " ".join(part for part in (self.object, self.start, self.run) if part)


@dataclass(frozen=True, eq=False)
class RobotLog:
    """What was read.

    Attributes:
        runs: in the order in which they begin.
        left_out: rows that cannot be used.
        unended: the last line, if no line break ends it: where a file was cut inside a number, that number is wrong.
        turned: whether the turn of the hand was logged; else it is 0.
    """

    runs: tuple[RobotRun, ...]
    left_out: tuple[BadRow, ...] = ()
    unended: int | None = None
    turned: bool = True


def load_robot_log(
    path: str | os.PathLike[str],
    *,
    columns: Mapping[str, str] | None = None,
    length: str = "m",
    angle: str = "rad",
    skip_bad: bool = False,
) -> RobotLog:
    """The runs in a log.

    A raw log has eight numbers a row, between commas or blanks: time [s], pose of the object and pose of the pusher
    (mm, mm, rad), number of the push. A CSV names these columns (t, obj_x_mm, obj_y_mm, obj_theta_rad, pusher_x_mm,
    pusher_y_mm, pusher_theta_rad, action_id) and may have object, start_id and run_id, which tell runs apart, and
    vision_lost. An object at exactly (0, 0, 0) was not seen. With names of its own a CSV has t, x, y, theta (of the
    object), px, py (of the hand), and may have ptheta (its turn), object, start and run; where the cells of the
    object's pose are empty or nan it was not seen.

    Args:
        columns: the file's own names, {"x": "obj_x[mm]"}; a file in the layout above is read as it is.
        length, angle: units of such columns without one: m, cm or mm, and rad or deg.
        skip_bad: leave bad rows out instead of refusing the file. They are listed in the result.

    Raises:
        InputError: for a file that is no such log, or, with the numbers of the lines, for rows that are cut off, not
            numbers, not finite, or whose stamp repeats or runs backwards.
    """
    source = os.fspath(path)
    if length not in PER_METRE or angle not in ("rad", "deg"):
        raise InputError("units are m, cm or mm and rad or deg", value=f"{length},{angle}")
    text = read_text(path, MOST_BYTES)
    rows = _rows(text, source)
    first = next(rows, None)
    if first is None:
        raise InputError("the file is empty", source=source, hint=_FORMAT)
    layout = _Layout.of(first[1], source, columns, length, angle)
    if layout.raw:
        rows = _rows(text, source)
    good: dict[tuple[str, ...], list[tuple[int, list[float]]]] = {}
    bad: list[BadRow] = []
    last: dict[tuple[str, ...], tuple[float, int]] = {}
    line = first[0]
    for line, cells in rows:
        try:
            values = layout.values(cells)
            key = tuple("" if k is None else cells[k].strip() for k in layout.groups)
            if key in last and values[0] <= last[key][0]:
                how = "repeats that" if values[0] == last[key][0] else "runs back behind that"
                stamp = cells[layout.stamp].strip()
                raise Unusable(f"its stamp {stamp} {how} of line {last[key][1]}")
        except Unusable as reason:
            bad.append(BadRow(line, str(reason)))
            continue
        last[key] = (values[0], line)
        good.setdefault(key, []).append((line, values))
    if bad and not skip_bad:
        raise refusal(bad, source, ": --skip-bad, or load_robot_log(path, skip_bad=True)")
    if not good:
        raise InputError("the log holds no usable row", source=source, hint=_FORMAT)
    stem = Path(source).stem
    runs = tuple(_run(key if any(key) else (stem, "", ""), found) for key, found in good.items())
    unended = None if text.endswith(("\n", "\r")) else line
    return RobotLog(runs, tuple(bad), unended, turned=layout.places[6] is not None)


def _rows(text: str, source: str) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of the lines that are neither empty nor a comment."""
    for line, row in enumerate(io.StringIO(text), start=1):
        if not row.strip() or row.lstrip().startswith("#"):
            continue
        try:
            cells = next(csv.reader([row], strict=True)) if "," in row else row.split()
        except csv.Error as error:
            raise InputError(f"line {line} is not CSV ({error})", source=source, hint=_FORMAT) from None
        yield line, cells


@dataclass(frozen=True)
class _Layout:
    """Where a row has what.

    Attributes:
        names: cells of the first line. places, factors: column of each of RAW, and the factor of its number to the unit
            there; None: not in the file, and 0. groups: columns that tell runs apart. lost: column of vision_lost.
        raw: whether there is no line of names, and rows may end with a comma. own: whether the names are.
    """

    names: tuple[str, ...]
    places: tuple[int | None, ...]
    factors: tuple[float, ...] = (1.0,) * len(RAW)
    groups: tuple[int | None, ...] = (None,) * len(GROUPS)
    lost: int | None = None
    raw: bool = False
    own: bool = False

    @classmethod
    def of(
        cls, cells: Sequence[str], source: str, own: Mapping[str, str] | None, length: str, angle: str
    ) -> "_Layout":
        """By the first line."""
        names = tuple(cell.strip() for cell in cells)
        if any(name in RAW[1:] for name in names) and not holds(names, own or {}):
            return cls._named(names, source)
        if (own and not is_number(names[0])) or holds(names, {}):
            return cls._own(names, source, own or {}, length, angle)
        return cls(RAW, tuple(range(len(RAW))), raw=True)

    @classmethod
    def _named(cls, names: tuple[str, ...], source: str) -> "_Layout":
        for name in names:
            if name and names.count(name) > 1:
                raise InputError(
                    f"two columns have the name {name!r}", source=source, hint="Keep one of the two."
                )
        missing = [name for name in RAW if name not in names]
        if missing:
            raise InputError(f"line 1 names no column {', '.join(missing)}", source=source, hint=_FORMAT)
        at = {name: k for k, name in enumerate(names)}
        return cls(
            names,
            tuple(at[name] for name in RAW),
            groups=tuple(at.get(name) for name in GROUPS),
            lost=at.get("vision_lost"),
        )

    @classmethod
    def _own(
        cls, names: tuple[str, ...], source: str, own: Mapping[str, str], length: str, angle: str
    ) -> "_Layout":
        if not holds(names, own) and holds(names, {}):
            own = {}  # one of our own logs, in spite of the scene's names
        plain = {bare(name) for name in names}
        turned = [TURN] if TURN in own or TURN in plain else []
        places, factors = columns_of(names, [*ROLES, *turned], own, length, angle, source)
        groups = [
            column(names, role, own, source)[0] if role in own or role in plain else None for role in RUNS
        ]
        scale = [1.0, 1e3, 1e3, 1.0, 1e3, 1e3, 1.0]
        return cls(
            names,
            (*places, *[None] * (2 - len(turned))),
            (*(float(a * b) for a, b in zip(factors, scale, strict=False)), *[1.0] * (2 - len(turned))),
            tuple(groups),
            own=True,
        )

    @property
    def stamp(self) -> int:
        """The column of the time."""
        return self.places[0] or 0

    def values(self, cells: Sequence[str]) -> list[float]:
        """The eight numbers of a raw row, and whether the object was seen."""
        if self.raw and len(cells) == len(RAW) + 1 and not cells[-1].strip():
            cells = cells[:-1]
        if len(cells) != len(self.names):
            raise Unusable(f"it has {len(cells)} of {len(self.names)} columns")
        pose = [cells[k].strip().lower() for k in self.places[1:4] if k is not None]
        unseen = self.own and all(text in ("", "nan") for text in pose)
        values = [
            0.0
            if k is None or (unseen and 1 <= j <= 3)
            else factor * number(cells[k], bare(self.names[k]), LARGEST if 1 <= j <= 6 else math.inf)
            for j, (k, factor) in enumerate(zip(self.places, self.factors, strict=True))
        ]
        action = self.places[-1]
        if action is not None and (values[-1] != round(values[-1]) or abs(values[-1]) > MOST_ACTIONS):
            raise Unusable(f"{self.names[action]} is not the number of a push ({cells[action].strip()})")
        lost = cells[self.lost].strip() if self.lost is not None else "0"
        if lost not in ("0", "1"):
            raise Unusable(f"vision_lost is neither 0 nor 1 ({lost[:20]!r})")
        return [*values, float(lost == "0" and not unseen and (self.own or any(values[1:4])))]


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
