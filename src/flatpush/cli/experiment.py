"""flatpush experiment: the paper's figures and the project's measurements."""

import os
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .common import print_json, telling

ALL, REPORT = "all", "index.html"


def command(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME…", help="Which experiments; without a name they are listed."),
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Draw figures into this folder.")
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where the recorded data are, for experiments that read them."),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="How many runs, for experiments with random ones; by default their own."
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed of random runs.")] = None,
    seeds: Annotated[
        str | None, typer.Option(metavar="FIRST:END", help="Range of seeds, END not included, for push-t.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Where `all` writes its report, index.html."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="For `all`: fewer random runs, no fits.")] = False,
    on_cluster: Annotated[
        bool, typer.Option("--cluster", help="Spread `all` over a local Dask cluster.")
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Spread `all` over the Dask cluster at this address."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the tables as JSON.")] = False,
) -> int:
    """Run experiments NAMES and print their tables; `all` writes the whole paper as one page."""
    from ..experiments import EXPERIMENTS, experiment

    if not names:
        for name, about in {**EXPERIMENTS, ALL: "the whole paper as one page: -o FOLDER, --quick"}.items():
            typer.echo(f"{name:<13} {about}")
        return 0
    if ALL in names:
        _refuse(
            {
                "other experiments": len(names) > 1,
                "--figures": figures is not None,
                "--runs": runs is not None,
                "--seed": seed is not None,
                "--seeds": seeds is not None,
            },
            "all",
        )
        return _all(output, quick, data, on_cluster, scheduler, as_json)
    if output is not None:
        raise InputError(f"-o is for `all`; figures of {', '.join(names)} go where --figures FOLDER says")
    _refuse(
        {"--quick": quick, "--cluster": on_cluster, "--scheduler": bool(scheduler)},
        ", ".join(names),
    )
    ready = [experiment(name, data, runs, seed, seeds) for name in names]
    if figures is not None:
        _folder(figures)
    tables = {}
    for name, run in zip(names, ready, strict=True):
        with telling(f"running {name}"):
            tables[name] = run(figures)
        if not as_json:
            typer.echo(tables[name])
    if as_json:
        print_json(tables)
    return 0


def _refuse(given: dict[str, bool], names: str) -> None:
    """Refuses options that these experiments do not take."""
    for option, there in given.items():
        if there:
            raise InputError(f"flatpush experiment {names} does not go with {option}")


def _folder(path: Path) -> None:
    """Makes a folder that is not there yet."""
    from ..documents.atomic import check_writable

    if not path.is_dir():
        check_writable(path)
        path.mkdir()


def _all(
    output: Path | None,
    quick: bool,
    data: Path | None,
    on_cluster: bool,
    scheduler: str | None,
    as_json: bool,
) -> int:
    from .cluster import check_address

    check_address(scheduler)
    from dataclasses import asdict

    from ..documents.atomic import check_writable, write_atomically
    from ..experiments.everything import SECTIONS, Done, everything, in_processes
    from ..experiments.report import page

    if output is None and not as_json:
        raise InputError("flatpush experiment all needs a folder for its report", hint="-o report")
    folder = data or (Path(os.environ["FLATPUSH_DATA"]) if os.environ.get("FLATPUSH_DATA") else None)
    if folder is not None and not folder.is_dir():
        raise InputError("the folder of recorded data does not exist", source=str(folder))
    if output is not None:
        _folder(output)
        check_writable(output / REPORT)
    done: dict[str, Done] = {}
    count = os.cpu_count() or 1
    where = "on the cluster" if on_cluster or scheduler else f"in {count} processes"
    typer.echo(
        f"{len(SECTIONS)} experiments {where}, the longest first; each is told when it is done", err=True
    )

    def told(one: Done) -> None:
        done[one.job.name] = one
        if output is not None:  # what is done stays, whatever becomes of the rest
            write_atomically(output / REPORT, page(done, _machine(), quick))
        word = f"{one.cpu:.0f} s of CPU"
        if one.finding.missing or one.finding.failed:
            word = (
                f"left out: {one.finding.missing}" if one.finding.missing else f"failed: {one.finding.failed}"
            )
        typer.echo(f"{len(done)} of {len(SECTIONS)}: {one.job.name} ({word})", err=True)

    if on_cluster or scheduler is not None:
        from .cluster import cluster

        with cluster(scheduler) as spread:
            found = everything(quick, folder, spread, told)
    else:
        found = everything(quick, folder, in_processes(count), told)
    if as_json:
        print_json(
            {
                section.name: {
                    "rows": [asdict(row) for row in one.finding.rows],
                    "missing": one.finding.missing or None,
                    "failed": one.finding.failed or None,
                }
                for section, one in found
            }
        )
    else:
        typer.echo(f"wrote {output / REPORT}" if output is not None else "")
    return 1 if any(one.finding.failed for _, one in found) else 0


def _machine() -> str:
    import platform

    from .. import __version__

    return (
        f"flatpush {__version__}, Python {platform.python_version()}, {platform.system()} on {platform.machine()},"
        f" {os.cpu_count()} processors"
    )
