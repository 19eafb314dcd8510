"""Reads pairs of wrench and twist from CSV files with named columns."""

import csv
import io
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..friction.pairs import Pairs
from .context import PER_METRE
from .reading import read_text
from .rows import BadRow, Unusable, number, refusal
from .scene_model import LARGEST

# Two ways to name the six numbers: our plain one, and that of the recorded force pushes.
PLAIN = ("fx", "fy", "tau", "vx", "vy", "omega")
RECORDED = ("Fx", "Fy", "tau", "dx_body", "dy_body", "dtheta")
STAMPS = ("t", "time", "stamp")
GROUPS = ("experiment", "surface", "pressure")
MOST_BYTES = 100_000_000
HEADER = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:[\[(]([^\])]*)[\])])?\s*")


@dataclass(frozen=True, eq=False)
class PairsFile:
    """What was read.

    Attributes:
        experiments: their pairs, in the order in which they begin.
        left_out: rows that hold no usable pair.
        unended: the last line, if no line break ends it: where a file was cut inside a number, that number is wrong.
    """

    experiments: tuple[Pairs, ...]
    left_out: tuple[BadRow, ...] = ()
    unended: int | None = None


def load_pairs(
    path: str | os.PathLike[str], *, length: str = "m", angle: str = "rad", skip_bad: bool = False
) -> PairsFile:
    """The pairs in a CSV file: a header of names, then one pair a row.

    Columns fx, fy, tau, vx, vy, omega, or those of the recorded force pushes (Fx, Fy, tau, dx_body, dy_body,
    dtheta); others are not read, except t, time or stamp (must rise within an experiment) and experiment, surface
    and pressure (tell experiments apart). A unit may follow a name in brackets: "tau [N mm]", "vx [mm/s]",
    "omega [deg/s]". The size of a twist, and so its unit of time, does not matter.

    Args:
        length, angle: units of columns without one: m, cm or mm, and rad or deg.
        skip_bad: leave bad rows out instead of refusing the file. They are listed in the result.

    Raises:
        InputError: for a file that is no such table, or, with the numbers of the lines, for rows that are cut off,
            not numbers, not finite, at rest, or whose stamp repeats or runs backwards.
    """
    source = os.fspath(path)
    if length not in PER_METRE or angle not in ("rad", "deg"):
        raise InputError("units are m, cm or mm and rad or deg", value=f"{length},{angle}")
    text = read_text(path, MOST_BYTES)
    lines = csv_lines(text, source)
    header = next(lines, None)
    if header is None:
        raise InputError("the file is empty", source=source, hint=_FORMAT)
    columns = _columns(header[1], source)
    factors = _factors(columns, length, angle, source)
    good: dict[str, list[tuple[int, np.ndarray]]] = {}
    bad: list[BadRow] = []
    last: dict[str, tuple[float, int]] = {}
    line = header[0]
    for line, cells in lines:
        try:
            name = _experiment(cells, columns) if len(cells) == columns.width else ""
            values = _values(cells, columns)
            if columns.stamp is not None:
                _rising(cells[columns.stamp], line, name, last)
        except Unusable as reason:
            bad.append(BadRow(line, str(reason)))
            continue
        good.setdefault(name, []).append((line, values * factors))
    if bad and not skip_bad:
        raise refusal(bad, source, " with --skip-bad")
    if not good:
        raise InputError("the file holds no usable pair", source=source, hint=_FORMAT)
    stem = Path(source).stem
    experiments = [_pairs(name or stem, rows) for name, rows in good.items()]
    return PairsFile(tuple(experiments), tuple(bad), None if text.endswith(("\n", "\r")) else line)


_FORMAT = f"It has columns {', '.join(PLAIN)} (or {', '.join(RECORDED)}), one pair a row."


@dataclass(frozen=True)
class _Columns:
    width: int
    places: tuple[int, ...]  # of the six numbers
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    stamp: int | None
    groups: tuple[int, ...]


def csv_lines(text: str, source: str) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of the lines that are neither empty nor a comment."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    while True:
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise InputError(
                f"line {reader.line_num} is not CSV ({error})", source=source, hint="Is the file complete?"
            ) from None
        if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#"):
            yield reader.line_num, cells


def _columns(cells: Sequence[str], source: str) -> _Columns:
    found = [HEADER.fullmatch(cell) for cell in cells]
    names = [match[1] if match else cell.strip() for match, cell in zip(found, cells, strict=True)]
    for name in names:
        if name and names.count(name) > 1:
            raise InputError(
                f"two columns have the name {name!r}", source=source, hint="Keep one of the two."
            )
    wanted = RECORDED if "Fx" in names or "dx_body" in names else PLAIN
    missing = [name for name in wanted if name not in names]
    if missing:
        raise InputError(
            f"line 1 names no column {', '.join(missing)}", source=source, value=",".join(names), hint=_FORMAT
        )
    places = tuple(names.index(name) for name in wanted)
    matches = [found[place] for place in places]
    stamps = [names.index(name) for name in STAMPS if name in names]
    return _Columns(
        len(cells),
        places,
        wanted,
        tuple(match[2] if match else None for match in matches),
        stamps[0] if stamps else None,
        tuple(names.index(name) for name in GROUPS if name in names),
    )


def _factors(columns: _Columns, length: str, angle: str, source: str) -> np.ndarray:
    """From the units of the columns to N, N m, m and rad (per any time)."""
    factors = []
    for k, (name, unit) in enumerate(zip(columns.names, columns.units, strict=True)):
        given = (unit or "").replace("·", " ").replace("*", " ").split("/")[0].split()
        if k < 2:
            known = {"N": 1.0, "kN": 1e3, "mN": 1e-3}
            key = "".join(given) or "N"
        elif k == 2:
            known = {f"N{u}": 1 / per for u, per in PER_METRE.items()}
            key = "".join(given) or f"N{length}"
        elif k < 5:
            known = {u: 1 / per for u, per in PER_METRE.items()}
            key = "".join(given) or length
        else:
            known = {"rad": 1.0, "deg": math.pi / 180}
            key = "".join(given) or angle
        if key not in known:
            raise InputError(
                f"the unit of column {name} is not known",
                source=source,
                value=unit,
                hint=f"Known: {', '.join(known)}.",
            )
        factors.append(known[key])
    return np.array(factors)


def _values(cells: Sequence[str], columns: _Columns) -> np.ndarray:
    if len(cells) != columns.width:
        raise Unusable(f"it has {len(cells)} of {columns.width} columns")
    values = np.empty(6)
    for k, (name, place) in enumerate(zip(columns.names, columns.places, strict=True)):
        values[k] = _number(cells[place], name)
    if not np.any(values[:3]):
        raise Unusable("the wrench is zero")
    if not np.any(values[3:]):
        raise Unusable("the object does not move")
    return values


def _number(cell: str, name: str) -> float:
    return number(cell, name, LARGEST)


def _rising(cell: str, line: int, name: str, last: dict[str, tuple[float, int]]) -> None:
    stamp = _number(cell, "the stamp")
    if name in last and stamp <= last[name][0]:
        how = "repeats that" if stamp == last[name][0] else "runs back behind that"
        raise Unusable(f"its stamp {cell.strip()} {how} of line {last[name][1]}")
    last[name] = (stamp, line)


def _experiment(cells: Sequence[str], columns: _Columns) -> str:
    return " ".join(cells[place].strip() for place in columns.groups)


def _pairs(name: str, rows: Sequence[tuple[int, np.ndarray]]) -> Pairs:
    table = np.array([values for _, values in rows])
    return Pairs(table[:, :3], table[:, 3:], name, tuple(line for line, _ in rows))
