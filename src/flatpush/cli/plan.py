"""flatpush plan: plans, verifies, writes."""

import math
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .common import cost_text, error_text, goal_values, growth_text, numbers, pose_text, print_json, telling

LINES = 3  # of the reason why there is no plan


def command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="The scene document, YAML or JSON.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="PLAN", help="Write the plan here (JSON).")
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the plan as .svg, .png, .gif or .html.")
    ] = None,
    snapshots: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw moments of the plan side by side as .svg or .png."),
    ] = None,
    start: Annotated[
        str | None, typer.Option(metavar="X,Y,θ", help="Start here instead, in the scene's units.")
    ] = None,
    goal: Annotated[
        str | None,
        typer.Option(metavar="X,Y,θ", help="Go here instead, in the scene's units; X,Y,free for any angle."),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL", help="Plan with this model of friction: exact, ellipsoid, local or quartic."
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(metavar="N", help="Seed the random search with this number.")
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(metavar="N", help="Stop the search after so many iterations.")
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Cut the search short after this time.")
    ] = None,
    bound: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Search so long for a lower bound on the cost, and for a cheaper plan on the way.",
        ),
    ] = None,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="If there is no plan, tell why for each push, one line each.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the plan document.")] = False,
) -> int:
    """Plan a push for SCENE, check the plan, and write it."""
    from ..documents import as_read, check_outputs, load_scene, scene_files

    overrides: dict[str, Any] = {
        "start": numbers(start, 3, "--start"),
        "goal": goal_values(goal),
        "planning": {
            key: value
            for key, value in {
                "model": model,
                "seed": seed,
                "iterations": iterations,
                "time_limit": time_limit,
            }.items()
            if value is not None
        },
    }
    loaded = load_scene(scene, {key: value for key, value in overrides.items() if value})
    check_outputs(scene_files(scene), [output, figure, snapshots])
    from ..documents import plan_document, save_plan
    from ..simulation import verify

    if bound is not None:
        from ..planning.bound import check_bound

        if not 0 < bound < math.inf:
            raise InputError("a bound takes a positive number of seconds", key="--bound", value=bound)
        check_bound(loaded)
    if figure is not None:
        from ..view import check_figure

        check_figure(figure)
    if snapshots is not None:
        from ..view import check_snapshots

        check_snapshots(snapshots)
    found, explored = _planned(loaded, bound)
    if found.status != "solved":
        if as_json:
            print_json(plan_document(found))
        typer.echo("\n".join(reason_lines(found.reason, verbose)), err=True)
        return 3
    report = verify(found)
    if not report.ok:
        for claim in report.failed:
            typer.echo(
                f"claim {claim.name}: stated {claim.stated}, found {claim.recomputed} ({claim.rule})",
                err=True,
            )
        typer.echo("the plan fails its own verification; nothing was written", err=True)
        return 4
    if output is not None:
        save_plan(replace(found, run={**found.run, "read": as_read(scene, output)}), output)
    if figure is not None:
        from ..view import save_figure

        with telling("drawing"):
            save_figure(found, figure, explored=explored)
    if snapshots is not None:
        from ..view import save_snapshots

        with telling("drawing"):
            save_snapshots(found, snapshots)
    if as_json:
        print_json(plan_document(found))
        return 0
    _tell(found, (output, figure, snapshots))
    return 0


def reason_lines(reason: str, verbose: bool) -> list[str]:
    """Why there is no plan: three lines at most, or with verbose one for each push."""
    first, *others = [part for part in re.split(r" · |\n", reason) if part]
    lines = [f"no plan: {first}", *(f"  {other}" for other in others)]
    if verbose or len(lines) <= LINES:
        return lines
    return [*lines[: LINES - 1], f"  and {len(lines) - LINES + 1} more, which --verbose or --json tells"]


def _planned(scene: Any, seconds: float | None) -> tuple[Any, Any]:
    """The best plan found, and the edges of the search tree or None; its bound is sought for some seconds.

    Ctrl-C ends the search; what has been found by then is kept. Among obstacles a line on a
    terminal shows how far the search is.
    """
    from ..planning import Planner

    live, shown, best = sys.stderr.isatty(), 0.0, None

    def progress(cost: float, clock: float, poses: int) -> None:
        nonlocal shown
        if clock - shown < 0.2:
            return
        shown = clock
        so_far = "no way yet" if math.isinf(cost) else f"best so far {cost_text(cost, scene.planning.cost)}"
        sys.stderr.write(f"\r{clock:5.1f} s: {so_far}, {poses} poses searched" + 12 * " ")
        sys.stderr.flush()

    try:
        with telling("planning"):
            planner = Planner(scene, progress if live else None)
            for answer in planner.answers():
                best = answer
    except KeyboardInterrupt:
        if best is None or math.isinf(best.cost):
            raise
        typer.echo("stopped: this is the best plan found so far", err=True)
    finally:
        if shown > 0:
            sys.stderr.write("\n")
    assert best is not None  # there is always an answer
    plan = best.plan()
    if seconds is not None and plan.segments:
        plan = _bounded(planner, plan, seconds)
    return plan, planner.explored


def _bounded(planner: Any, plan: Any, seconds: float) -> Any:
    """The plan or a cheaper one, with what is known about the least cost after some seconds or Ctrl-C."""
    from ..compiling import clock
    from ..planning.bound import bounded

    with telling("looking for a bound"):
        began = clock()
        try:
            for found in bounded(planner, plan):
                plan = found
                if clock() - began > seconds:
                    break
        except KeyboardInterrupt:
            typer.echo("stopped: this is the best bound found so far", err=True)
    return plan


def _bound_text(plan: Any) -> str:
    """How far the plan is from the cheapest one, at most, by how many changes of contact that has."""
    known = plan.run["bound"]

    def above(key: str) -> str:
        return f"{max(math.ceil(1000 * (plan.cost / known[key] - 1) - 1e-3), 0) / 10:.1f} %"

    text = f"at most {above('least')} above the least possible with these pushes"
    for key, which in (("least_two_changes", "two changes"), ("least_one_change", "one change")):
        if above(key) != above("least"):
            text += f", {above(key)} above that with at most {which} of contact"
    return text + (" (no room for a closer look)" if known["full"] else "")


def _tell(plan: Any, written: Sequence[Path | None]) -> None:
    scene, certificate = plan.scene, plan.certificate
    typer.echo(f"{scene.object.name}: {pose_text(scene.start)} → {pose_text(scene.goal)}")
    if not plan.segments:
        typer.echo("already there: the start is within the goal tolerance, nothing to push")
    for segment in plan.on_table:
        if segment.kind == "slide":
            way = math.dist(segment.pusher[0, :2], segment.pusher[-1, :2])
            typer.echo(f"push {segment.push}: slides ({1000 * way:.1f} mm)")
            continue
        arcs = ", ".join(f"{a.turn} {cost_text(a.cost, scene.planning.cost)}" for a in segment.arcs)
        typer.echo(f"push {segment.push}: {segment.word} ({arcs})")
    typer.echo(
        f"cost {cost_text(plan.cost, scene.planning.cost)} ({scene.planning.cost}), {plan.duration:.1f} s,"
        f" planned in {plan.run['planning_time']:.2f} s with the {scene.planning.model} model"
    )
    if plan.run.get("stopped_by") == "time_limit":
        typer.echo(
            f"stopped by time_limit ({scene.planning.time_limit:g} s) before {scene.planning.iterations} iterations:"
            " with --time-limit it would go on for cheaper plans"
        )
    if "bound" in plan.run:
        typer.echo(_bound_text(plan))
    single, before = plan.run.get("single_cost"), plan.run.get("cost_before_refinement")
    if single is not None and before is not None:
        kind = scene.planning.cost
        replanning = cost_text(plan.run["replanning_cost"], kind)
        typer.echo(
            f"best single push {cost_text(single, kind)}, before refinement {cost_text(before, kind)};"
            f" replanned with switches off by 0.2 mm and 0.2°: {replanning} on average"
        )
    if plan.segments:
        x, y, angle = certificate.goal_error
        typer.echo(
            f"certificate: goal met within {error_text(math.hypot(x, y), None if scene.free_angle else angle)}"
            + _margins(certificate)
            + (
                f", clearance {1000 * certificate.clearance:.2f} mm"
                if certificate.clearance is not None
                else ""
            )
        )
    if certificate.set_worst is not None:
        typer.echo(_set_text(certificate))
    if certificate.tube:
        known = scene.object.uncertainty
        region, (dx, dy) = known.start, certificate.set_end
        typer.echo(
            f"from every start within {1000 * region.position:.4g} mm and {math.degrees(region.angle):.4g}°: ends"
            f" within ± {1000 * dx:.3f} mm in x and ± {1000 * dy:.3f} mm in y of that"
            + (
                f", clearance {1000 * certificate.set_clearance:.2f} mm"
                if certificate.clearance is not None
                else ""
            )
        )
    for warning in certificate.warnings:
        typer.echo(f"warning: {warning}", err=True)
    for path in written:
        if path is not None:
            typer.echo(f"wrote {path}")


def _set_text(certificate: Any) -> str:
    """For which set of tables a plan is proved, or not, and what breaks it first."""
    bounds, worst, unique = certificate.set_bounds, certificate.set_worst, certificate.set_uniqueness
    x, y = (
        1000 * sum(w * at for w, at in zip(worst.loads, places, strict=True))
        for places in zip(*worst.points, strict=True)
    )
    said = ""
    if unique is not None:
        said = f"; sticking is {'' if unique > 0 else 'not shown to be '}all that can happen"
    return (
        f"{'proved' if certificate.set_margin >= 0 else 'not proved'} for loads within {100 * bounds.loads:.3g} %,"
        f" friction from {bounds.friction:.3g} up and offsets up to {1000 * bounds.offset:.3g} mm: margin"
        f" {certificate.set_margin:.3f}, it holds up to {100 * certificate.set_loads:.3g} % of the loads{said}\n"
        f"worst table: push {worst.push}, arc {worst.arc + 1}, its centre of friction at ({x:.2f}, {y:.2f}) mm; beyond"
        f" it {worst.gives_way}"
    )


def _margins(certificate: Any) -> str:
    """What a plan has in reserve; of slides, how far the end moves."""
    told = ""
    if certificate.friction_margin is not None:
        told += f", friction margin {100 * certificate.friction_margin:.0f} % of μ"
        told += f" ({certificate.friction_margin_degrees:.1f}°)"
    if certificate.composite_margin is not None:
        told += f", both contacts keep {100 * certificate.composite_margin:.0f} % of μ in reserve"
    elif certificate.growth is not None:
        told += f", a small error grows {growth_text(certificate.growth)}"
    if certificate.sensitivity is not None:
        off = certificate.sensitivity
        told += (
            f"; the end moves by up to {off['place']:.1f} mm for each mm that the start is off,"
            f" {1000 * math.radians(off['turn']):.2f} mm for each degree, {10 * off['friction']:.2f} mm for 0.01 of"
            f" friction, {off['centre']:.1f} mm for each mm of the centre of friction"
        )
    return told
