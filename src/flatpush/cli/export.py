"""flatpush export: timed pusher poses for a robot."""

from pathlib import Path
from typing import Annotated

import typer

from .common import numbers, print_json


def command(
    plan: Annotated[Path, typer.Argument(help="Plan document (JSON).")],
    file: Annotated[Path, typer.Argument(help="CSV file to write.")],
    base_frame: Annotated[
        str | None,
        typer.Option(help="Pose of the table in the robot's base frame [m, rad].", metavar="X,Y,Z,YAW"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> int:
    """Write the pusher's timed poses of PLAN as CSV: t [s], x, y, z [m], yaw [rad], segment."""
    from ..documents import export_csv, load_plan

    if file.suffix.lower() != ".csv":
        from ..errors import InputError

        raise InputError("export writes a .csv file", value=str(file))
    frame = numbers(base_frame, 4, "--base-frame")
    rows = export_csv(load_plan(plan), file, None if frame is None else tuple(frame))
    if as_json:
        print_json({"file": str(file), "rows": rows})
    else:
        typer.echo(f"wrote {file}: {rows} poses")
    return 0
