"""flatpush view: the live page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SCENE|PLAN|LOG]", help="A scene, a plan or the log of a run; a triangle if left out."
        ),
    ] = None,
    scene: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The scene of a log, or the plan that was run."),
    ] = None,
    port: Annotated[
        int, typer.Option(metavar="N", help="The port; the next free one if it is taken.")
    ] = 8642,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Listen there; others than this machine may then connect.")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option(help="Open a browser.")] = True,
) -> int:
    """Serve a page on which the scene is moved by hand and the plan follows. Ctrl-C ends it."""
    from ..documents.reading import check_readable

    for given in (file, scene):
        if given is not None:
            check_readable(given)
    from ..page.options import Options
    from ..page.server import Asked, serve

    options = Options(host, port, browser)
    serve(Asked(file, scene), options, lambda line: typer.echo(line, err=True))
    raise KeyboardInterrupt
