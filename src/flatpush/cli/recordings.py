"""What calibrate and replay read: logs of runs, and the scenes of their objects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..errors import InputError

if TYPE_CHECKING:
    from ..documents.rows import BadRow
    from ..geometry.pose import Array
    from ..simulation.calibration import Setup
    from ..simulation.replay import Recording

COLUMNS = (
    "Your own names of columns: x=obj_x[mm],theta=yaw; by default those that the scene gives for its logs."
)
SKIP_BAD = "Leave unusable rows out, and list them."
UNITS = "Units of columns that do not name them: m, cm or mm, and rad or deg; by default the scene's logs, or m,rad."


def read_recordings(
    logs: Sequence[Path],
    scenes: Sequence[Path],
    carried: Mapping[str, str],
    pivot: "Array | None" = None,
    *,
    columns: str = "",
    units: str = "",
    skip_bad: bool = False,
) -> "tuple[tuple[Recording, ...], Setup]":
    """The runs in logs, and objects, fingers and tags.

    One scene stands for all runs of a log that names no object, and for those of its name.

    Args:
        logs: files. scenes: one for each object, of one pusher.
        carried: which tag an object carries, where several share one.
        pivot: of the camera's map (2,) [m]; default: amid the runs.
        columns, units, skip_bad: the options of these names; by default what the scenes say of their logs.

    Raises:
        InputError: for a log or a scene that is none, scenes of different pushers or of one name, and runs that cannot
            be of such an object.
    """
    from ..documents import load_scene

    read = [(path, load_scene(path)) for path in scenes]
    import numpy as np

    from ..documents import load_robot_log
    from ..simulation.calibration import Setup
    from ..simulation.replay import Recording

    names = [scene.object.name for _, scene in read]
    if len(set(names)) < len(names):
        raise InputError("each scene has an object of a name of its own", key="object.name", value=names)
    for path, scene in read[1:]:
        if scene.pusher != read[0][1].pusher:
            raise InputError("all scenes have the same pusher", source=str(path), key="pusher")
    own, length, angle = layout_of(scenes, columns, units)
    recordings = []
    for log in logs:
        file = load_robot_log(log, columns=own, length=length, angle=angle, skip_bad=skip_bad)
        tell_left_out(log, file.left_out)
        if not file.turned and read[0][1].pusher.fingers == 2:
            raise InputError(
                "the turn of a hand with two fingers is not in this log",
                source=str(log),
                hint="It has a column ptheta, or one of your own: --columns ptheta=NAME.",
            )
        found = file.runs
        for run in found:
            alone = len(read) == 1 and run.object not in names and len({r.object for r in found}) == 1
            recordings.append(Recording.of(replace(run, object=names[0]) if alone else run))
    for one in recordings:
        if one.run.object not in names:
            raise InputError(
                "a run is of an object that no scene describes",
                value=one.run.object,
                hint=f"Objects of the scenes: {', '.join(names)}. Give one --scene for each.",
            )
    for name in carried:
        if name not in names:
            raise InputError("--tag is of an object that no scene describes", value=name)
    pusher = read[0][1].pusher
    half = pusher.spacing / 2
    fingers = np.array([[0.0, half], [0.0, -half]]) if pusher.fingers == 2 else np.zeros((1, 2))
    middle = np.mean([one.final[:2] for one in recordings], axis=0) if pivot is None else pivot
    objects = {scene.object.name: scene.object for _, scene in read}
    for one in recordings:
        one.check(objects[one.run.object], fingers, pusher.tip_radius)
    return tuple(recordings), Setup(objects, fingers, pusher.tip_radius, middle, dict(carried))


def tell_left_out(path: Path, rows: "Sequence[BadRow]") -> None:
    """Lists the rows of a file that were left out."""
    for row in rows:
        typer.echo(f"{path}: line {row.line} left out: {row.reason}", err=True)


def layout_of(scenes: Sequence[Path], columns: str, units: str) -> tuple[dict[str, str], str, str]:
    """Names of columns, and units of length and angle, by the options --columns and --units, else by what the scenes
    say of their logs.

    Raises:
        InputError: for options that are none, or scenes that say different things.
    """
    from ..documents import columns_of_scene, own_columns

    told = [one for path in scenes if (one := columns_of_scene(path)) is not None]
    if not columns and any(one != told[0] for one in told):
        raise InputError(
            "the scenes name the columns of their logs differently",
            key="logs",
            hint="Give the names of these logs by --columns and --units.",
        )
    own, length, angle = told[0] if told else ({}, "m", "rad")
    if columns:
        own = own_columns(columns)
    return (own, *units_of(units)) if units else (own, length, angle)


def units_of(text: str) -> tuple[str, str]:
    """Length and angle of --units."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise InputError("--units takes a length and an angle, such as mm,deg", value=text)
    return parts[0], parts[1]


def carried_of(texts: Sequence[str] | None) -> dict[str, str]:
    """OBJECT=TAG, as often as given."""
    found = {}
    for text in texts or ():
        name, equals, tag = (part.strip() for part in text.partition("="))
        if not (name and equals and tag):
            raise InputError("--tag takes OBJECT=TAG", value=text)
        found[name] = tag
    return found
