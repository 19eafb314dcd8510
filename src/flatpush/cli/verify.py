"""flatpush verify: recomputes every claim of a plan."""

from pathlib import Path
from typing import Annotated, Any

import typer

from .common import print_json, telling


def command(
    plan: Annotated[Path, typer.Argument(help="Plan document (JSON).")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> int:
    """Recompute every claim of PLAN from its scene; exit with 4 if one does not hold."""
    from ..documents import load_plan
    from ..simulation import verify

    loaded = load_plan(plan)
    with telling("verifying"):
        report = verify(loaded)
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
        for claim in report.failed:
            typer.echo(
                f"✗ {claim.name}: stated {claim.stated}, found {claim.recomputed} ({claim.rule})", err=True
            )
        good = len(report.claims) - len(report.failed)
        typer.echo(
            f"{good} of {len(report.claims)} claims hold: " + ("verified" if report.ok else "NOT verified")
        )
    return 0 if report.ok else 4


def _finite(value: Any) -> Any:
    if isinstance(value, float) and value in (float("inf"), float("-inf")):
        return str(value)
    return value
