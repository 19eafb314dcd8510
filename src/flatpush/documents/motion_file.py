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
from .pairs_file import HEADER, csv_lines
from .reading import read_mapping, read_text
from .robot_log import RAW, load_robot_log
from .rows import BadRow, Unusable, number, refusal

# What is read, and the names that columns have of themselves.
ROLES = ("t", "x", "y", "theta", "px", "py")
GROUP = "push"
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
    if not columns and (RAW[1] in names or _is_number(names[0])):
        return _from_robot(source, skip_bad)
    places, factors = _places(names, columns or {}, length, angle, source)
    parted = (columns or {}).get(GROUP, GROUP)
    if parted != GROUP and parted not in names:
        raise InputError(f"line 1 names no column {parted}", source=source, value=",".join(names))
    group = names.index(parted) if parted in names else None
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


def is_motion_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file is not a table of wrenches and twists, by its ending and its first line."""
    source = os.fspath(path)
    if Path(source).suffix.lower() == ".mcap":
        return True
    first = next(csv_lines(read_text(path, MOST_BYTES), source), (0, []))[1]
    names = {match[1] for cell in first if (match := HEADER.fullmatch(cell))}
    return not names & {"fx", "Fx"}


def own_columns(text: str) -> dict[str, str]:
    """The names of columns in "x=obj_x[mm],theta=yaw[deg]".

    >>> own_columns("x=obj_x[mm], theta=yaw")
    {'x': 'obj_x[mm]', 'theta': 'yaw'}

    Raises:
        InputError: for anything else.
    """
    found: dict[str, str] = {}
    for part in text.split(","):
        role, equals, name = (piece.strip() for piece in part.partition("="))
        if not equals or not name or role not in (*ROLES, GROUP) or role in found:
            raise InputError(
                f"columns are named as role=name, separated by commas; roles are {', '.join((*ROLES, GROUP))}",
                value=part.strip(),
            )
        found[role] = name
    return found


def columns_of_scene(scene: str | os.PathLike[str]) -> tuple[dict[str, str], str, str] | None:
    """Names of columns, and units of length and angle, that a scene file gives for recordings of its object; None if it
    gives none.

    Raises:
        InputError: for a role that there is not.
    """
    logs = read_mapping(scene).get("logs")
    if not isinstance(logs, dict):
        return None
    columns = dict(logs.get("columns") or {})
    for role in columns:
        if role not in (*ROLES, GROUP):
            raise InputError(
                f"columns have the roles {', '.join((*ROLES, GROUP))}",
                source=os.fspath(scene),
                key=f"logs.columns.{role}",
            )
    return columns, str(logs.get("length", "m")), str(logs.get("angle", "rad"))


def _is_number(text: str) -> bool:
    try:
        float(text.split()[0] if text else text)
    except ValueError:
        return False
    return True


def _places(
    names: list[str], own: Mapping[str, str], length: str, angle: str, source: str
) -> tuple[list[int], Array]:
    """Column and factor to SI of each role."""
    plain = [match[1] if (match := HEADER.fullmatch(name)) else name for name in names]
    units = [match[2] if (match := HEADER.fullmatch(name)) else None for name in names]
    places, factors = [], []
    for role in ROLES:
        given = HEADER.fullmatch(own.get(role, role))
        wanted, unit = (given[1], given[2]) if given else (own[role], None)
        if plain.count(wanted) != 1:
            how = "names no column" if wanted not in plain else "names twice the column"
            raise InputError(
                f"line 1 {how} {wanted}",
                source=source,
                value=",".join(names),
                hint=f"{_FORMAT} Names of your own: --columns {role}=NAME.",
            )
        k = plain.index(wanted)
        stated = unit or units[k]
        known = {
            "t": {"s": 1.0, "ms": 1e-3, "ns": 1e-9},
            "theta": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
        }
        scale = known.get(role, {u: 1 / per for u, per in PER_METRE.items()})
        default = {"t": "s", "theta": angle}.get(role, length)
        if (stated or default) not in scale:
            raise InputError(
                f"column {wanted} has a unit among {', '.join(scale)}", source=source, value=stated
            )
        places.append(k)
        factors.append(scale[stated or default])
    return places, np.array(factors)


def _values(cells: Sequence[str], places: Sequence[int], width: int) -> list[float] | None:
    """The numbers of a row; None if the object was not seen."""
    if len(cells) != width:
        raise Unusable(f"it has {len(cells)} of {width} columns")
    if all(not cells[k].strip() or cells[k].strip().lower() == "nan" for k in places[1:4]):
        return None
    return [number(cells[k], role) for role, k in zip(ROLES, places, strict=True)]


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
