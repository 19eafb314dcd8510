"""Reads recordings of a finger that pushes an object: CSV with named columns, logs of our own, MCAP bags."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..errors import InputError, MissingExtra
from ..geometry.pose import Array, wrap_angle
from .context import PER_METRE
from .log_columns import GROUP, ROLES, bare, column, holds
from .log_columns import columns as columns_of
from .pairs_file import PLAIN, RECORDED, csv_lines
from .reading import read_text
from .robot_log import RAW, load_robot_log
from .rows import BadRow, Unusable, is_number, number, refusal
from .scene_model import LARGEST

MOST_BYTES = 100_000_000
# A recording ends where rows are missing for so long, or the finger is suddenly elsewhere [s, m].
GAP, ELSEWHERE = 1.0, 0.009
TOPICS = ("/flatpush/object", "/flatpush/tool")
_FORMAT = f"It has columns {', '.join(ROLES)}: time, pose of the object, centre of the fingertip."


@dataclass(frozen=True, eq=False)
class Motion:
    """One recording without gaps; n frames, in SI.

    Attributes:
        name: for messages. times: rising (n,) [s]. poses: X_WO as measured, (n, 3). tips: centre of the fingertip in W,
            (n, 2). lines: where in its file each frame stands (n,).
    """

    name: str
    times: Array
    poses: Array
    tips: Array
    lines: np.ndarray


@dataclass(frozen=True, eq=False)
class MotionFile:
    """What was read.

    Attributes:
        motions: in their order. left_out: rows that cannot be used.
        of_hand: whether the file holds poses of the hand (frame E): the fingertip's only where there is one finger.
    """

    motions: tuple[Motion, ...]
    left_out: tuple[BadRow, ...] = ()
    of_hand: bool = False


def load_motions(
    path: str | os.PathLike[str],
    *,
    columns: Mapping[str, str] | None = None,
    length: str = "m",
    angle: str = "rad",
    skip_bad: bool = False,
) -> MotionFile:
    """The recordings in a file.

    A CSV has the columns t, x, y, theta (of the object), px, py (centre of the fingertip), in any order; a unit may
    follow a name in brackets: "x [mm]". A column `push` tells recordings apart; so does a gap of a second, or a finger
    that is suddenly elsewhere. An empty pose was not seen. The layout of `run --log` and of recorded robot runs is read
    as it is, and so is its .mcap (extra "export").

    Args:
        columns: the file's own names, {"x": "obj_pos_x"}, a unit in brackets included.
        length, angle: units of columns without one: m, cm or mm, and rad or deg.
        skip_bad: leave bad rows out instead of refusing the file. They are listed in the result.

    Raises:
        InputError: for a file that is no such recording, or, with the numbers of the lines, for rows that are cut off,
            not numbers, or whose stamp repeats or runs backwards.
        MissingExtra: for .mcap without its library.
    """
    source = os.fspath(path)
    if length not in PER_METRE or angle not in ("rad", "deg"):
        raise InputError("units are m, cm or mm and rad or deg", value=f"{length},{angle}")
    if Path(source).suffix.lower() == ".mcap":
        return _from_bag(source)
    lines = csv_lines(read_text(path, MOST_BYTES), source)
    header = next(lines, None)
    if header is None:
        raise InputError("the file is empty", source=source, hint=_FORMAT)
    names = [cell.strip() for cell in header[1]]
    own = columns or {}
    if (RAW[1] in names or is_number(names[0])) and not holds(names, own):
        return _from_robot(source, skip_bad)
    places, factors = columns_of(names, ROLES, own, length, angle, source)
    there = GROUP in own or GROUP in (bare(name) for name in names)
    group = column(names, GROUP, own, source)[0] if there else None
    rows: dict[str, list[tuple[int, list[float]]]] = {}
    bad: list[BadRow] = []
    for line, cells in lines:
        key = cells[group].strip() if group is not None and group < len(cells) else ""
        try:
            values = _values(cells, places, len(names))
            if values is None:
                continue
            kept = rows.setdefault(key, [])
            if kept and values[0] <= kept[-1][1][0]:
                how = "repeats that" if values[0] == kept[-1][1][0] else "runs back behind that"
                raise Unusable(f"its stamp {values[0]:g} {how} of line {kept[-1][0]}")
            kept.append((line, values))
        except Unusable as reason:
            bad.append(BadRow(line, str(reason)))
    if bad and not skip_bad:
        raise refusal(bad, source, ": --skip-bad")
    motions = [
        part
        for key, found in rows.items()
        for part in _parts(
            f"{Path(source).name}{f', push {key}' if key else ''}",
            np.array([values for _, values in found]) * factors,
            np.array([line for line, _ in found]),
        )
    ]
    if not motions:
        raise InputError("the file holds no usable row", source=source, hint=_FORMAT)
    return MotionFile(tuple(motions), tuple(bad))


def own_or_plain(path: str | os.PathLike[str], own: Mapping[str, str] | None) -> Mapping[str, str] | None:
    """The names that a scene gives for columns, unless a file has the plain ones instead: one of our own logs."""
    if not own or Path(path).suffix.lower() == ".mcap":
        return None
    first = next(csv_lines(read_text(path, MOST_BYTES), os.fspath(path)), (0, []))[1]
    return None if holds(first, {}) and not holds(first, own) else own


def is_motion_file(path: str | os.PathLike[str], own: Mapping[str, str] | None = None) -> bool:
    """Whether a file is a recording of motion, not a table of wrenches and twists: by its ending and its first line.

    A column fx alone makes no wrench: it may be a finger's.

    Args:
        own: the file's own names of columns.
    """
    source = os.fspath(path)
    if Path(source).suffix.lower() == ".mcap":
        return True
    first = next(csv_lines(read_text(path, MOST_BYTES), source), (0, []))[1]
    names = {bare(cell) for cell in first}
    if own and holds(first, own):
        return True
    if names >= set(PLAIN) or names >= set(RECORDED):
        return False
    return bool(own) or names >= {"x", "y", "theta"} or not names & {"fx", "Fx"}


def _values(cells: Sequence[str], places: Sequence[int], width: int) -> list[float] | None:
    """The numbers of a row; None if the object was not seen."""
    if len(cells) != width:
        raise Unusable(f"it has {len(cells)} of {width} columns")
    if all(not cells[k].strip() or cells[k].strip().lower() == "nan" for k in places[1:4]):
        return None
    return [
        number(cells[k], role, math.inf if role == "t" else LARGEST)
        for role, k in zip(ROLES, places, strict=True)
    ]


def _parts(name: str, table: Array, lines: np.ndarray) -> list[Motion]:
    """Rows t, x, y, θ, px, py in SI, cut where rows are missing or the finger is elsewhere."""
    cut = np.diff(table[:, 0]) > GAP
    cut |= np.hypot(*np.diff(table[:, 4:6], axis=0).T) > ELSEWHERE
    edges = [0, *(np.flatnonzero(cut) + 1).tolist(), len(table)]
    return [
        Motion(name, table[a:b, 0], _wrapped(table[a:b, 1:4]), table[a:b, 4:6], lines[a:b])
        for a, b in pairwise(edges)
    ]


def _wrapped(poses: Array) -> Array:
    return np.column_stack([poses[:, :2], wrap_angle(poses[:, 2])])


def _from_robot(source: str, skip_bad: bool) -> MotionFile:
    log = load_robot_log(source, skip_bad=skip_bad)
    motions = []
    for run in log.runs:
        table = np.column_stack([run.times, run.poses, run.hands[:, :2]])[run.seen]
        if len(table):
            motions += _parts(f"{Path(source).name}, {run.name}", table, run.lines[run.seen])
    return MotionFile(tuple(motions), log.left_out, of_hand=True)


def bag_messages(source: str, topics: Sequence[str]) -> Iterator[tuple[str, float, list[float], str]]:
    """Topic and time [s] of the messages of an MCAP bag, with the pose (x, y, turn about z, z) or the text of each.

    Raises:
        MissingExtra: without the libraries.
        InputError: for what is no such bag.
    """
    try:
        from mcap.reader import make_reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise MissingExtra(
            'a recording in .mcap needs mcap and rosbags: pip install "flatpush[export]"'
        ) from None
    store = get_typestore(Stores.ROS2_HUMBLE)
    try:
        with open(source, "rb") as file:
            for schema, channel, raw in make_reader(file).iter_messages(topics=list(topics)):
                message = store.deserialize_cdr(raw.data, schema.name if schema else "")
                if hasattr(message, "pose"):
                    place, way = message.pose.position, message.pose.orientation
                    pose, text = [place.x, place.y, 2 * math.atan2(way.z, way.w), place.z], ""
                else:
                    pose, text = [], str(message.data)
                yield channel.topic, 1e-9 * raw.log_time, pose, text
    except OSError as error:
        raise InputError(f"it cannot be read ({error.strerror})", source=source) from None
    except Exception as error:  # whatever a damaged bag makes its reader raise
        raise InputError(f"this is not a bag of poses ({type(error).__name__})", source=source) from None


def _from_bag(source: str) -> MotionFile:
    """The poses on the two topics, the finger's interpolated at the times of the object's."""
    found: dict[str, list[list[float]]] = {topic: [] for topic in TOPICS}
    for topic, stamp, pose, _ in bag_messages(source, TOPICS):
        x, y, turn, z = pose
        found[topic].append([stamp, x, y, turn, z])
    seen, tool = (np.array(found[topic]) for topic in TOPICS)
    if len(seen) < 2 or len(tool) < 2:
        raise InputError(f"the bag holds no poses on {' and '.join(TOPICS)}", source=source)
    fresh = np.concatenate([[True], np.diff(seen[:, 0]) > 0])
    seen = seen[fresh]
    tips = [np.interp(seen[:, 0], tool[:, 0], tool[:, k]) for k in (1, 2)]
    low = np.interp(seen[:, 0], tool[:, 0], tool[:, 4]) < 1e-3  # a lifted finger pushes nothing
    table = np.column_stack([seen[:, :4], *tips])[low]
    if not len(table):
        raise InputError("the tool is never on the table in this bag", source=source)
    return MotionFile(tuple(_parts(Path(source).name, table, np.flatnonzero(low) + 1)), of_hand=True)
