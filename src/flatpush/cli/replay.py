"""flatpush replay: recorded runs through the simulator."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .common import print_json, telling
from .recordings import COLUMNS, SKIP_BAD, UNITS, read_recordings


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
    calibration: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What calibrate wrote; without it nothing is corrected."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.csv", help="Write one row for each run.")
    ] = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE.svg", help="Draw every run as a dot.")] = None,
    no_landings: Annotated[
        bool,
        typer.Option(
            "--no-landings",
            help="Use only each run's first pose of what the camera saw, nothing around its landings.",
        ),
    ] = False,
    columns: Annotated[str, typer.Option(metavar="NAMES", help=COLUMNS)] = "",
    units: Annotated[str, typer.Option(metavar="UNITS", help=UNITS)] = "",
    skip_bad: Annotated[bool, typer.Option("--skip-bad", help=SKIP_BAD)] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Move the simulated fingers as in LOGS and compare where the object ends with where the camera saw it."""
    import numpy as np

    from ..documents import check_outputs, write_atomically
    from ..documents.calibration_file import load_calibration
    from ..simulation.calibration import Parameters
    from ..simulation.replay import doubts, errors, gap_seen, trajectory_errors

    check_outputs([*logs, *scene, *([] if calibration is None else [calibration])], [output, figure])
    if output is not None and output.suffix.lower() != ".csv":
        raise InputError("the table of runs is a CSV file", source=str(output))
    if figure is not None:
        from ..view.figure import check_ending

        check_ending(figure, (".svg", ".png"))
    p, pivot = Parameters(lag=0.0), None
    carried: Mapping[str, str] = {}
    if calibration is not None:
        kept = load_calibration(calibration)
        p = Parameters(kept.camera, kept.tags, kept.inset, kept.friction, kept.lag)
        carried, pivot = kept.carried, kept.pivot
    recordings, setup = read_recordings(
        logs, scene, {}, pivot, columns=columns, units=units, skip_bad=skip_bad
    )
    setup = type(setup)(setup.objects, setup.fingers, setup.tip_radius, setup.pivot, carried)
    unknown = [n for n in setup.objects if p.tags and setup.tag(n) not in p.tags]
    if unknown:
        raise InputError(
            "the calibration holds no tag of this object", source=str(calibration), value=", ".join(unknown)
        )
    final, way, outcomes, gaps = [], [], [], []
    with telling("replaying"):
        for one in recordings:
            registration = p.registration(setup, one.run.object)
            predicted = p.replay(setup, one, landings=calibration is not None and not no_landings)
            final.append(errors(predicted.final, registration.poses(one.final)))
            way.append(trajectory_errors(one, predicted, registration, p.lag).mean(axis=0))
            outcomes.append(", ".join(word for word in predicted.outcomes if word))
            plant = p.plant(setup, one.run.object)
            gaps.append(gap_seen(one, plant, setup.fingers, registration, p.lag))
    ends, ways = np.array(final), np.array(way)
    runs = [one.run for one in recordings]
    for name in setup.objects:
        mine = np.array([run.object == name for run in runs])
        for doubt in (
            doubts(name, ends[mine], np.array(gaps)[mine], calibration is not None) if mine.any() else ()
        ):
            typer.echo(f"warning: {doubt}", err=True)
    if output is not None:
        lines = ["object,start,run,final_distance[m],final_angle[rad],way_distance[m],way_angle[rad],outcome"]
        for run, a, b, said in zip(runs, ends.tolist(), ways.tolist(), outcomes, strict=True):
            named = ",".join(part.replace(",", " ") for part in (run.object, run.start, run.run))
            lines.append(f"{named},{a[0]!r},{a[1]!r},{b[0]!r},{b[1]!r},{said.replace(',', ';')}")
        write_atomically(output, "\n".join(lines) + "\n")
    if figure is not None:
        from ..view.replay_figure import ReplayRow, replay_figure

        title = "calibrated" if calibration is not None else "nothing corrected"
        row = ReplayRow(title, tuple(run.object for run in runs), np.column_stack([ends, ways[:, 0]]))
        replay_figure(
            [row],
            tuple(setup.objects),
            figure,
            title="Recorded runs: predicted against measured",
            subtitle="A dot is a run.",
        )
    if as_json:
        print_json(
            [
                {"object": r.object, "start": r.start, "run": r.run, "final": a, "way": b, "outcome": said}
                for r, a, b, said in zip(runs, ends.tolist(), ways.tolist(), outcomes, strict=True)
            ]
        )
        return 0
    for run, a, b, said in zip(runs, ends, ways, outcomes, strict=True):
        typer.echo(
            f"{run.name}: ends {1000 * a[0]:.2f} mm and {math.degrees(a[1]):.2f}° off, {1000 * b[0]:.2f} mm and"
            f" {math.degrees(b[1]):.2f}° on the way{f' ({said})' if said else ''}"
        )
    typer.echo(
        f"{len(runs)} runs: {1000 * ends[:, 0].mean():.2f} mm and {math.degrees(ends[:, 1].mean()):.2f}° in the mean,"
        f" {1000 * ends[:, 0].max():.2f} mm and {math.degrees(ends[:, 1].max()):.2f}° at worst"
    )
    for path in (output, figure):
        if path is not None:
            typer.echo(f"wrote {path}")
    return 0
