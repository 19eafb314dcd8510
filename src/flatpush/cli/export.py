"""flatpush export: timed pusher poses for a robot."""

from pathlib import Path
from typing import Annotated

import typer

from .common import numbers, print_json, tell_failed


def command(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="The plan document (JSON).")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write: .csv, or .mod (RAPID).")],
    base_frame: Annotated[
        str | None,
        typer.Option(help="Pose of the table in the robot's base frame [m, rad].", metavar="X,Y,Z,YAW"),
    ] = None,
    unverified: Annotated[
        bool, typer.Option("--unverified", help="Write a plan that fails verification; the file says so.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> int:
    """Verify PLAN and write the pusher's timed poses: t [s], x, y, z [m], yaw [rad], segment; or a RAPID module."""
    from ..documents import check_outputs, load_plan, plan_files

    if file.suffix.lower() not in (".csv", ".mod"):
        from ..errors import InputError

        raise InputError("export writes a .csv file, or a .mod file of RAPID for ABB", value=str(file))
    frame = numbers(base_frame, 4, "--base-frame")
    loaded = load_plan(plan)
    check_outputs(plan_files(plan, loaded.run), [file])
    from ..documents import export_csv, export_rapid
    from ..simulation import verify

    failed = verify(loaded).failed if loaded.status == "solved" else ()
    tell_failed(failed)
    if failed and not unverified:
        typer.echo("the plan fails verification; nothing was written (--unverified writes it)", err=True)
        return 4
    why = ", ".join(claim.name for claim in failed)
    write = export_csv if file.suffix.lower() == ".csv" else export_rapid
    rows = write(loaded, file, None if frame is None else tuple(frame), unverified=why)
    if as_json:
        print_json({"file": str(file), "rows": rows, "verified": not failed})
    else:
        typer.echo(f"wrote {file}: {rows} poses")
    return 0
