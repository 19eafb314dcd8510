"""flatpush calibrate: camera, tags, fingers and friction from a laboratory's own runs."""

import math
from pathlib import Path
from typing import Annotated

import typer

from .common import print_json, telling
from .recordings import COLUMNS, SKIP_BAD, UNITS, carried_of, read_recordings


def command(
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOGS…", help="Logs of runs, as run --log writes them, or CSV with names of your own."
        ),
    ],
    scene: Annotated[
        list[Path], typer.Option(metavar="SCENE", help="The scene of the object; once for each object.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the calibration (JSON).")
    ] = None,
    tag: Annotated[
        list[str] | None,
        typer.Option(metavar="OBJECT=TAG", help="Objects that carry one tag; as often as needed."),
    ] = None,
    columns: Annotated[str, typer.Option(metavar="NAMES", help=COLUMNS)] = "",
    units: Annotated[str, typer.Option(metavar="UNITS", help=UNITS)] = "",
    skip_bad: Annotated[bool, typer.Option("--skip-bad", help=SKIP_BAD)] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Fit camera map, tag offsets, finger inset, lag and friction to LOGS, judged on starts that were left out."""
    from ..documents import check_outputs

    check_outputs([*logs, *scene], [output])
    carried = carried_of(tag)
    recordings, setup = read_recordings(logs, scene, carried, columns=columns, units=units, skip_bad=skip_bad)
    import numpy as np

    from ..documents.calibration_file import CalibrationFile, save_calibration
    from ..simulation.joint_calibration import calibrate

    with telling("calibrating"):
        found = calibrate(recordings, setup)
    p, left = found.parameters, found.left_out
    if p.doubt:
        typer.echo(f"warning: {p.doubt}", err=True)
    judged = (
        np.array([left[:, 0].mean(), left[:, 0].max(), left[:, 1].mean(), left[:, 1].max()])
        if len(left)
        else left
    )
    kept = CalibrationFile(
        p.camera,
        setup.pivot,
        p.tags,
        carried,
        p.inset,
        p.friction or 0.0,
        p.lag,
        judged.ravel(),
        len(recordings),
    )
    if output is not None:
        save_calibration(kept, output)
    starts = sorted(set(found.starts))
    if as_json:
        print_json(
            {
                "runs": len(recordings), "starts": len(starts), "camera": p.camera.tolist(),
                "tags": {name: pose.tolist() for name, pose in p.tags.items()}, "inset": p.inset,
                "friction": p.friction, "lag": p.lag, "sd": found.sd.tolist(), "left_out": left.tolist(),
                "first_pose": found.first_pose.tolist(),
            }
        )  # fmt: skip
        return 0
    typer.echo(f"{len(recordings)} runs from {len(starts)} starts; the camera lags by {p.lag:.2f} s")
    m, sd = p.camera, found.sd
    typer.echo(
        f"camera map: scale {1 + m[0]:.4f} ± {sd[0]:.4f}, {1 + m[3]:.4f} ± {sd[3]:.4f};"
        f" shear {m[1]:.4f} ± {sd[1]:.4f}, {m[2]:.4f} ± {sd[2]:.4f};"
        f" shift {1000 * m[4]:.2f} ± {1000 * sd[4]:.2f}, {1000 * m[5]:.2f} ± {1000 * sd[5]:.2f} mm"
    )
    for k, (name, pose) in enumerate(p.tags.items()):
        own = sd[6 + 3 * k : 9 + 3 * k]
        typer.echo(
            f"tag {name}: {1000 * pose[0]:.2f} ± {1000 * own[0]:.2f} mm, {1000 * pose[1]:.2f} ± {1000 * own[1]:.2f} mm,"
            f" {math.degrees(pose[2]):.2f} ± {math.degrees(own[2]):.2f}°"
        )
    typer.echo(
        f"fingers: inset {1000 * p.inset:.2f} ± {1000 * sd[-2]:.2f} mm, μ {p.friction:.2f} ± {sd[-1]:.2f}"
    )
    if len(left):
        typer.echo(
            f"starts left out: {1000 * judged[0]:.2f} mm and {math.degrees(judged[2]):.2f}° in the mean,"
            f" {1000 * judged[1]:.2f} mm and {math.degrees(judged[3]):.2f}° at worst"
        )
        far, turn = found.first_pose.mean(axis=0)
        typer.echo(
            f"  without what the camera saw around landings: {1000 * far:.2f} mm and {math.degrees(turn):.2f}° in the"
            " mean"
        )
    else:
        typer.echo("all runs begin at one start: how well others are predicted is not known")
    if output is not None:
        typer.echo(f"wrote {output}")
    return 0
