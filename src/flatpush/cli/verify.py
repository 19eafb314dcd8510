"""flatpush verify: recomputes every claim of a plan and checks what a robot will execute."""

from pathlib import Path
from typing import Annotated, Any

import typer

from .common import print_json, tell_failed, telling


def command(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="The plan document (JSON).")],
    scene: Annotated[
        Path | None,
        typer.Option(metavar="SCENE", help="Name every difference from this scene, which you trust."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> int:
    """Recompute every claim of PLAN from its scene; exit with 4 if one does not hold."""
    from ..documents import load_plan, load_scene

    loaded = load_plan(plan)
    trusted = None if scene is None else load_scene(scene)
    from ..simulation import verify

    with telling("verifying"):
        report = verify(loaded, trusted)
    if as_json:
        print_json(
            {
                "ok": report.ok,
                "claims": [
                    {
                        "name": c.name,
                        "stated": c.stated,
                        "recomputed": _finite(c.recomputed),
                        "tolerance": c.tolerance,
                        "ok": c.ok,
                        "rule": c.rule,
                    }
                    for c in report.claims
                ],
            }
        )
    else:
        tell_failed(report.failed)
        good = len(report.claims) - len(report.failed)
        typer.echo(
            f"{good} of {len(report.claims)} claims hold: " + ("verified" if report.ok else "NOT verified")
        )
    return 0 if report.ok else 4


def _finite(value: Any) -> Any:
    if isinstance(value, float) and value in (float("inf"), float("-inf")):
        return str(value)
    return value
