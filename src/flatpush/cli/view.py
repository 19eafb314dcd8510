"""flatpush view: the live page."""

from pathlib import Path
from typing import Annotated

import typer


def command(
    file: Annotated[
        Path | None,
        typer.Argument(metavar="[SCENE|PLAN]", help="A scene or a plan; a triangle if left out."),
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
    from ..page.options import Options
    from ..page.server import serve

    options = Options(host, port, browser)
    serve(_scene(file), options, lambda line: typer.echo(line, err=True))
    raise KeyboardInterrupt


def _scene(file: Path | None) -> dict[str, object]:
    """What the page shows first."""
    from ..documents import load_plan, load_scene, mapping_of, parse_scene, read_mapping, scene_template
    from ..page.in_mm import scene_in_mm

    if file is None:
        return scene_in_mm(parse_scene(mapping_of(scene_template())))
    kind = read_mapping(file).get("flatpush")
    if isinstance(kind, str) and kind.startswith("plan/"):
        return scene_in_mm(load_plan(file).scene)
    return scene_in_mm(load_scene(file))
