"""flatpush simulate: rolls a plan out, perturbed if asked."""

import math
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .common import error_text, numbers, pose_text, print_json, tell_slow_way, telling, warn_unverified


def command(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="The plan document (JSON).")],
    runs: Annotated[
        int, typer.Option(metavar="N", help="How many runs; more than one disturbs start and friction.")
    ] = 1,
    seed: Annotated[
        int, typer.Option(metavar="N", help="Seed of the disturbances; the same seed gives the same runs.")
    ] = 0,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write every run here (JSON; many runs also .csv)."
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw one run as .svg, .png, .gif or .html, or the tube of many as .svg or .png.",
        ),
    ] = None,
    model: Annotated[
        str,
        typer.Option(metavar="MODEL", help="Limit surface of the table: exact, ellipsoid, local or quartic."),
    ] = "exact",
    source: Annotated[
        str, typer.Option(metavar="KIND", help="What the pusher follows: the plan's arcs or its samples.")
    ] = "arcs",
    position: Annotated[
        float, typer.Option(metavar="MM", help="Standard deviation of the start along each axis.")
    ] = 0.5,
    angle: Annotated[
        float, typer.Option(metavar="DEG", help="Standard deviation of the angle at the start.")
    ] = 0.5,
    friction: Annotated[
        float, typer.Option(metavar="PERCENT", help="Standard deviation of the friction at the fingers.")
    ] = 10.0,
    friction_range: Annotated[
        str | None,
        typer.Option(metavar="LOW,HIGH", help="Friction at the fingers, evenly between these, instead."),
    ] = None,
    df: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            help="Degrees of freedom of random limit surfaces (Wishart): 50 by default for ellipsoid and quartic;"
            " 0 keeps the surface as it is.",
        ),
    ] = None,
    centre: Annotated[
        float,
        typer.Option(metavar="MM", help="Standard deviation of the centre of friction along each axis."),
    ] = 0.0,
    loads: Annotated[
        float, typer.Option(metavar="PERCENT", help="How much the load of each foot may differ, either way.")
    ] = 0.0,
    on_cluster: Annotated[
        bool, typer.Option("--cluster", help="Spread the runs over a local Dask cluster.")
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Spread the runs over the Dask cluster at this address."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Roll PLAN out in the quasi-static contact simulator."""
    from ..documents import check_outputs, load_plan, plan_files

    if runs < 1:
        raise InputError("--runs is at least 1", value=runs)
    if seed < 0:
        raise InputError("--seed is 0 or more", value=seed)
    if source not in ("arcs", "samples"):
        raise InputError("--source is arcs or samples", value=source)
    from .cluster import check_address

    check_address(scheduler)
    loaded = load_plan(plan)
    loaded.check_motion()
    from ..problem.scene import MODELS

    if model not in MODELS:
        raise InputError(f"--model is one of {', '.join(MODELS)}", value=model)
    noise = _noise(position, angle, friction, friction_range, df, centre, loads, model)
    check_outputs(plan_files(plan, loaded.run), [output, figure])
    warn_unverified(loaded)
    if loaded.status == "solved" and model == "exact":
        tell_slow_way(loaded, runs)
    if figure is not None:
        from ..view.figure import ENDINGS
        from ..view.picture import ENDINGS as PICTURES
        from ..view.picture import check_ending

        check_ending(figure, ENDINGS if runs == 1 else PICTURES)
    if runs == 1:
        return _one(loaded, model, source, output, figure, as_json)
    return _many(loaded, runs, seed, noise, model, source, output, figure, on_cluster, scheduler, as_json)


def _noise(
    position: float,
    angle: float,
    friction: float,
    friction_range: str | None,
    df: float | None,
    centre: float,
    loads: float,
    model: str,
) -> Any:
    from ..simulation import Noise

    given = {
        "--position": position,
        "--angle": angle,
        "--friction": friction,
        "--centre": centre,
        "--loads": loads,
    }
    for option, value in given.items():
        if not (math.isfinite(value) and value >= 0):
            raise InputError("noise is a finite number, 0 or more", key=option, value=value)
    if loads >= 100:
        raise InputError("the loads of feet vary by less than 100 %", key="--loads", value=loads)
    between = numbers(friction_range, 2, "--friction-range")
    if between is not None and not 0 <= between[0] <= between[1]:
        raise InputError("it takes two numbers, 0 ≤ LOW ≤ HIGH", key="--friction-range", value=friction_range)
    if df is None:
        df = 50.0 if model in ("ellipsoid", "quartic") else 0.0
    least = 9 if model == "quartic" else 3
    if df != 0 and not (math.isfinite(df) and df >= least):
        raise InputError(f"it is at least {least} here, or 0 for none", key="--df", value=df)
    return Noise(
        position=position / 1000,
        angle=math.radians(angle),
        friction=friction / 100,
        friction_range=None if between is None else (between[0], between[1]),
        df=df or None,
        centre=centre / 1000,
        loads=loads / 100,
    )


def _one(plan: Any, model: Any, source: Any, output: Path | None, figure: Path | None, as_json: bool) -> int:
    from ..documents import save_rollouts
    from ..simulation import simulate

    with telling("simulating 1 run"):
        rollout = simulate(plan, model=model, source=source)
    if output is not None:
        save_rollouts([rollout], output)
    if figure is not None:
        from ..view import save_figure

        with telling("drawing"):
            save_figure(plan, figure, rollouts=(rollout,))
    r = _result(plan, rollout)
    if as_json:
        print_json({"runs": [r], "summary": {"outcomes": {r["outcome"]: 1}}})
        return 0
    typer.echo(f"{r['outcome']}: the object ends at {pose_text(r['final_pose'])}")
    typer.echo(f"off the goal by {error_text(r['distance'], r['turn'])}")
    typer.echo("modes: " + ", ".join(f"{name} {count}" for name, count in r["modes"].items()))
    _wrote(output, figure)
    return 0


def _many(
    plan: Any,
    runs: int,
    seed: int,
    noise: Any,
    model: Any,
    source: Any,
    output: Path | None,
    figure: Path | None,
    on_cluster: bool,
    scheduler: str | None,
    as_json: bool,
) -> int:
    from ..documents import save_runs
    from ..simulation import study

    where: Any = nullcontext(map)
    if on_cluster or scheduler is not None:
        from .cluster import cluster

        where = cluster(scheduler)
    with telling(f"simulating {runs} runs"), where as spread:
        found = study(
            plan,
            runs,
            seed,
            noise=noise,
            model=model,
            source=source,
            record=figure is not None,
            spread=spread,
        )
    if output is not None:
        save_runs(found, output)
    if figure is not None:
        from ..view.tube import tube_figure

        with telling("drawing"):
            tube_figure(found, figure)
    if as_json:
        print_json(_document(found))
        return 0
    _tell(found)
    _wrote(output, figure)
    return 0


def _wrote(*paths: Path | None) -> None:
    for path in paths:
        if path is not None:
            typer.echo(f"wrote {path}")


def _result(plan: Any, rollout: Any) -> dict[str, Any]:
    error = plan.scene.goal_error(rollout.final_pose)
    return {
        "final_pose": [float(x) for x in rollout.final_pose],
        "outcome": rollout.outcome,
        "distance": float(math.hypot(error[0], error[1])),
        "turn": abs(float(error[2])),
        "modes": {mode: rollout.modes.count(mode) for mode in dict.fromkeys(rollout.modes)},
        "seed": rollout.seed,
    }


def _document(found: Any) -> dict[str, Any]:
    from ..simulation.study import QUANTILES

    errors = found.errors
    quantiles = {name: values.tolist() for name, values in found.quantiles().items()}
    return {
        "runs": [
            {
                "final_pose": found.final[k].tolist(),
                "outcome": found.outcomes[k],
                "sticking": bool(found.sticking[k]),
                "distance": float(errors[k, 0]),
                "turn": float(errors[k, 1]),
            }
            for k in range(len(found))
        ],
        "summary": {
            "seed": found.seed,
            "outcomes": _outcomes(found),
            "sticking_share": found.sticking_share,
            "mean": found.mean.tolist(),
            "covariance": found.covariance.tolist(),
            "quantiles": {"shares": list(QUANTILES), **quantiles},
            **{f"median_{name}": quantiles[name][2] for name in ("distance", "turn")},
            **{f"worst_{name}": float(errors[:, k].max()) for k, name in enumerate(("distance", "turn"))},
        },
    }


def _outcomes(found: Any) -> dict[str, int]:
    return {name: found.outcomes.count(name) for name in dict.fromkeys(found.outcomes)}


def _tell(found: Any) -> None:
    import numpy as np

    errors, deviations = found.errors, np.sqrt(np.diag(found.covariance))
    typer.echo(
        f"{len(found)} runs: " + ", ".join(f"{count} {name}" for name, count in _outcomes(found).items())
    )
    typer.echo(
        f"off the goal: median {error_text(*np.median(errors, axis=0))}, worst {error_text(*np.max(errors, axis=0))}"
    )
    if found.plan.pushes:  # slides never stick
        typer.echo(f"stayed sticking: {100 * found.sticking_share:.1f} %")
    typer.echo(f"mean final pose {pose_text(found.mean)}")
    typer.echo(
        f"standard deviations {1000 * deviations[0]:.3f} mm, {1000 * deviations[1]:.3f} mm,"
        f" {math.degrees(deviations[2]):.3f}°; correlations"
        + "".join(f" {a}{b} {value:+.2f}" for a, b, value in _correlations(found.covariance, deviations))
    )
    scale = {"x": 1000.0, "y": 1000.0, "distance": 1000.0, "angle": 180 / math.pi, "turn": 180 / math.pi}
    typer.echo(
        f"{'quantiles':<24}" + "".join(f"{share:>10}" for share in ("5 %", "25 %", "50 %", "75 %", "95 %"))
    )
    words = {
        "x": "x [mm]",
        "y": "y [mm]",
        "angle": "angle [°]",
        "distance": "distance to goal [mm]",
        "turn": "turn to goal [°]",
    }
    for name, values in found.quantiles().items():
        numbers = (round(scale[name] * value, 3) + 0.0 for value in values)  # no -0.000
        typer.echo(f"{words[name]:<24}" + "".join(f"{number:>10.3f}" for number in numbers))


def _correlations(covariance: Any, deviations: Any) -> list[tuple[str, str, float]]:
    names = "xyθ"
    found = []
    for i, j in ((0, 1), (0, 2), (1, 2)):
        size = float(deviations[i] * deviations[j])
        found.append((names[i], names[j], float(covariance[i, j]) / size if size > 0 else 0.0))
    return found
