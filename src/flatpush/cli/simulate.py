"""flatpush simulate: rolls a plan out, perturbed if asked."""

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .common import error_text, pose_text, print_json, telling


def command(
    plan: Annotated[Path, typer.Argument(help="Plan document (JSON).")],
    runs: Annotated[int, typer.Option(help="How many; more than one perturbs start and friction.")] = 1,
    seed: Annotated[int, typer.Option(help="Of the perturbations.")] = 0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write every run here (JSON).")
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Draw plan and runs: .svg, .png, .gif or .html.")
    ] = None,
    model: Annotated[str, typer.Option(help="Limit surface: exact, ellipsoid, local or quartic.")] = "exact",
    source: Annotated[str, typer.Option(help="The pusher follows the plan's arcs or its samples.")] = "arcs",
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Roll PLAN out in the quasi-static contact simulator."""
    from ..documents import check_writable, load_plan, save_rollouts
    from ..problem.scene import MODELS
    from ..simulation import Perturbation, simulate

    if runs < 1:
        raise InputError("--runs is at least 1", value=runs)
    if model not in MODELS:
        raise InputError(f"--model is one of {', '.join(MODELS)}", value=model)
    if source not in ("arcs", "samples"):
        raise InputError("--source is arcs or samples", value=source)
    loaded = load_plan(plan)
    for path in (output, figure):
        if path is not None:
            check_writable(path)
    if figure is not None:
        from ..view import check_figure

        check_figure(figure)
    rollouts = []
    with telling(f"simulating {runs} run{'s' if runs > 1 else ''}"):
        for k in range(runs):
            noise = Perturbation() if runs > 1 else None
            rollouts.append(simulate(loaded, seed + k, model=model, source=source, perturbation=noise))  # type: ignore[arg-type]
    if output is not None:
        save_rollouts(rollouts, output)
    if figure is not None:
        from ..view import save_figure

        with telling("drawing"):
            save_figure(loaded, figure, rollouts=tuple(rollouts))
    results = [_result(loaded, rollout) for rollout in rollouts]
    if as_json:
        print_json({"runs": results, "summary": _summary(results)})
        return 0
    if runs == 1:
        r = results[0]
        typer.echo(f"{r['outcome']}: the object ends at {pose_text(r['final_pose'])}")
        typer.echo(f"off the goal by {error_text(r['distance'], r['turn'])}")
        typer.echo("modes: " + ", ".join(f"{name} {count}" for name, count in r["modes"].items()))
    else:
        s = _summary(results)
        typer.echo(f"{runs} runs: " + ", ".join(f"{count} {name}" for name, count in s["outcomes"].items()))
        typer.echo(
            f"off the goal: median {error_text(s['median_distance'], s['median_turn'])},"
            f" worst {error_text(s['worst_distance'], s['worst_turn'])}"
        )
    for path in (output, figure):
        if path is not None:
            typer.echo(f"wrote {path}")
    return 0


def _result(plan: Any, rollout: Any) -> dict[str, Any]:
    from ..geometry import pose_error

    error = pose_error(rollout.final_pose, plan.scene.goal)
    return {
        "final_pose": [float(x) for x in rollout.final_pose],
        "outcome": rollout.outcome,
        "distance": float(math.hypot(error[0], error[1])),
        "turn": abs(float(error[2])),
        "modes": {mode: rollout.modes.count(mode) for mode in dict.fromkeys(rollout.modes)},
        "seed": rollout.seed,
    }


def _summary(results: list[dict[str, Any]]) -> dict[str, Any]:
    from statistics import median

    outcomes = [r["outcome"] for r in results]
    return {
        "outcomes": {name: outcomes.count(name) for name in dict.fromkeys(outcomes)},
        **{f"median_{key}": median(r[key] for r in results) for key in ("distance", "turn")},
        **{f"worst_{key}": max(r[key] for r in results) for key in ("distance", "turn")},
    }
