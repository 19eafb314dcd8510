"""flatpush experiment: the paper's figures and the project's measurements."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .common import print_json, telling


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
    as_json: Annotated[bool, typer.Option("--json", help="Print the tables as JSON.")] = False,
) -> int:
    """Run experiments NAMES and print their tables."""
    from ..experiments import EXPERIMENTS, experiment

    if not names:
        for name, about in EXPERIMENTS.items():
            typer.echo(f"{name:<12} {about}")
        return 0
    ready = [experiment(name, data, runs, seed, seeds) for name in names]
    if figures is not None and not figures.is_dir():
        raise InputError("the folder for figures does not exist", source=str(figures))
    tables = {}
    for name, run in zip(names, ready, strict=True):
        with telling(f"running {name}"):
            tables[name] = run(figures)
        if not as_json:
            typer.echo(tables[name])
    if as_json:
        print_json(tables)
    return 0
