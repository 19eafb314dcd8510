"""flatpush init: a commented scene to start from."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .common import print_json


def command(
    file: Annotated[Path, typer.Argument(metavar="[SCENE]", help="The scene document to write.")] = Path(
        "scene.yaml"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> int:
    """Write a commented scene."""
    from ..documents import scene_template, write_atomically

    if file.exists():
        raise InputError(
            "this file exists already and is not overwritten", source=str(file), hint="Name another one."
        )
    write_atomically(file, scene_template())
    if as_json:
        print_json({"file": str(file)})
    else:
        typer.echo(f"wrote {file}; next: flatpush plan {file} --figure plan.svg")
    return 0
