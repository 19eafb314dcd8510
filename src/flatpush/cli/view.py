"""flatpush view: the live page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError

if TYPE_CHECKING:
    from ..page.server import Shown
    from ..problem import Plan, Scene


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
    from ..page.options import Options
    from ..page.server import serve

    options = Options(host, port, browser)
    serve(_shown(file, scene), options, lambda line: typer.echo(line, err=True))
    raise KeyboardInterrupt


def _shown(file: Path | None, of: Path | None) -> Shown:
    """What the page shows first."""
    from ..documents import mapping_of, parse_scene, scene_template
    from ..page.in_mm import scene_in_mm
    from ..page.recorded import LOGS, recorded
    from ..page.server import Shown

    if file is not None and file.suffix.lower() in LOGS:
        if of is None:
            raise InputError(
                "a log does not hold the outline of its object",
                source=str(file),
                hint="Give its scene or its plan: --scene FILE.",
            )
        scene, plan = _read(of)
        return Shown(scene_in_mm(scene), plan, recorded(file, scene, plan))
    if of is not None:
        raise InputError("--scene belongs to a log", value=str(of))
    if file is None:
        return Shown(scene_in_mm(parse_scene(mapping_of(scene_template()))))
    scene, plan = _read(file)
    return Shown(scene_in_mm(scene), plan)


def _read(file: Path) -> tuple[Scene, Plan | None]:
    """A scene, or a plan with its scene."""
    from ..documents import load_plan, load_scene, read_mapping

    kind = read_mapping(file).get("flatpush")
    if isinstance(kind, str) and kind.startswith("plan/"):
        plan = load_plan(file)
        return plan.scene, plan
    return load_scene(file), None
