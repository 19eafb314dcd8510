"""Names and units of the columns of recordings: their own, or as a scene or an option gives them."""

import math
import os
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .context import PER_METRE
from .pairs_file import HEADER
from .reading import read_mapping

# What is read of every row, and the names that columns have of themselves; the hand's turn, for two fingers; number or
# name of the push; what tells runs apart.
ROLES = ("t", "x", "y", "theta", "px", "py")
TURN, GROUP = "ptheta", "push"
RUNS = ("object", "start", "run")
_ALL = (*ROLES, TURN, GROUP, *RUNS)
_SECONDS = {"s": 1.0, "ms": 1e-3, "ns": 1e-9}
_RADIANS = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
_METRES = {unit: 1 / per for unit, per in PER_METRE.items()}


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
        if not equals or not name or role not in _ALL or role in found:
            raise InputError(
                f"columns are named as role=name, separated by commas; roles are {', '.join(_ALL)}",
                value=part.strip(),
            )
        found[role] = name
    return found


def columns_of_scene(scene: str | os.PathLike[str]) -> tuple[dict[str, str], str, str] | None:
    """Names of columns, and units of length and angle, that a scene file gives for recordings of its object; None if it
    gives none.

    Raises:
        InputError: for a role that there is not, or a name that is no text.
    """
    logs = read_mapping(scene).get("logs")
    if not isinstance(logs, dict):
        return None
    columns = logs.get("columns") or {}
    if not isinstance(columns, dict):
        raise InputError("columns are named as role: name", source=os.fspath(scene), key="logs.columns")
    for role, name in columns.items():
        if not isinstance(name, str):
            raise InputError(
                "the name of a column is a text",
                source=os.fspath(scene),
                key=f"logs.columns.{role}",
                value=name,
            )
        if role not in _ALL:
            raise InputError(
                f"columns have the roles {', '.join(_ALL)}",
                source=os.fspath(scene),
                key=f"logs.columns.{role}",
            )
    return dict(columns), str(logs.get("length", "m")), str(logs.get("angle", "rad"))


def bare(name: str) -> str:
    """A column's name without the unit in brackets."""
    return match[1] if (match := HEADER.fullmatch(name)) else name.strip()


def holds(names: Sequence[str], own: Mapping[str, str]) -> bool:
    """Whether a first line has a column for everything that is read of every row, under names of one's own."""
    return {bare(own.get(role, role)) for role in ROLES} <= {bare(name) for name in names}


def column(names: Sequence[str], role: str, own: Mapping[str, str], source: str) -> tuple[int, str | None]:
    """Place and stated unit of the column of a role.

    Raises:
        InputError: if the first line does not name it exactly once.
    """
    given = own.get(role, role)
    wanted = bare(given)
    plain = [bare(name) for name in names]
    if plain.count(wanted) != 1:
        how = "names no column" if wanted not in plain else "names twice the column"
        raise InputError(
            f"line 1 {how} {wanted}",
            source=source,
            value=",".join(names),
            hint=f"It has columns {', '.join(ROLES)}: time, pose of the object, centre of the fingertip."
            f" Names of your own: --columns {role}=NAME.",
        )
    k = plain.index(wanted)
    units = (match[2] if (match := HEADER.fullmatch(text)) else None for text in (given, names[k]))
    return k, next((unit for unit in units if unit), None)


def columns(
    names: Sequence[str], roles: Collection[str], own: Mapping[str, str], length: str, angle: str, source: str
) -> tuple[list[int], Array]:
    """Column and factor to SI of each role.

    Args:
        names: cells of the first line. own: the file's own names. length, angle: units of columns without one.

    Raises:
        InputError: for a column that is missing or twice there, or of an unknown unit.
    """
    places: list[int] = []
    factors: list[float] = []
    for role in roles:
        k, stated = column(names, role, own, source)
        scale = {"t": _SECONDS, "theta": _RADIANS, TURN: _RADIANS}.get(role, _METRES)
        unit = stated or {"t": "s", "theta": angle, TURN: angle}.get(role, length)
        if unit not in scale:
            raise InputError(
                f"column {bare(names[k])} has a unit among {', '.join(scale)}", source=source, value=stated
            )
        if k in places:
            raise InputError(
                f"column {bare(names[k])} stands for two things, {list(roles)[places.index(k)]} and {role}",
                source=source,
            )
        places.append(k)
        factors.append(scale[unit])
    return places, np.array(factors)
