"""flatpush track: follows a plan in the simulator under feedback."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ..errors import InputError
from .common import error_text, numbers, pose_text, print_json, tell_slow_way, warn_unverified

if TYPE_CHECKING:
    from ..control import ClosedLoopRun, ControllerState
    from ..control.tracking.simulated_run import Law, Timing

CONTROLLERS = ("path", "dfl", "horizon")
TIMINGS = ("even", "plan")
MOST_TOLD, MOST_NOTES = 8, 20


def command(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="The plan document (JSON).")],
    controller: Annotated[
        str, typer.Option(metavar="NAME", help="The controller: path, dfl or horizon.")
    ] = "path",
    rate: Annotated[float, typer.Option(metavar="HZ", help="How often the controller decides.")] = 60.0,
    noise: Annotated[
        str, typer.Option(metavar="MM,DEG", help="Standard deviations of the measured pose.")
    ] = "0.3,0.3",
    camera: Annotated[
        float, typer.Option(metavar="HZ", help="How many frames the camera gives in a second.")
    ] = 30.0,
    latency: Annotated[
        float, typer.Option(metavar="SECONDS", help="How old a frame is when it arrives.")
    ] = 0.1,
    dropped: Annotated[
        float, typer.Option(metavar="PERCENT", help="Share of the frames that never come.")
    ] = 0.0,
    friction: Annotated[
        float | None,
        typer.Option(metavar="MU", help="Friction at the finger in the simulation; by default the scene's."),
    ] = None,
    centre: Annotated[
        str, typer.Option(metavar="DX,DY", help="How far off the centre of friction is [mm].")
    ] = "0,0",
    start: Annotated[
        str, typer.Option(metavar="DX,DY,DEG", help="How far off the start is [mm, deg].")
    ] = "0,0,0",
    timing: Annotated[
        str,
        typer.Option(
            metavar="LAW",
            help="even: it slows down where arcs meet; plan: it goes from rest to rest in each.",
        ),
    ] = "even",
    frequency: Annotated[
        float, typer.Option(metavar="RAD/S", help="Natural frequency of the controller dfl.")
    ] = 2.0,
    damping: Annotated[
        float, typer.Option(metavar="RATIO", help="Damping ratio of the controller dfl.")
    ] = 1.0,
    learn: Annotated[
        bool,
        typer.Option(
            "--learn",
            help="Learn how the object turns while it is pushed. It helps where the table is not what the scene says,"
            " above all a centre of friction that is off (--centre); where all is as told it changes little.",
        ),
    ] = False,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="MM,DEG", help="How near the goal it arrives; by default the scene's goal_tolerance."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(metavar="N", help="Seed of the noise; the same seed gives the same run.")
    ] = 0,
    figure: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the run as .svg or .png.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Follow PLAN under feedback, in the contact simulator with a simulated camera."""
    from ..control import ARRIVED, Camera
    from ..control.tracking.plan_controller import BESIDE, goal_error
    from ..control.tracking.simulated_run import TrackedRun
    from ..documents import check_outputs, load_plan, plan_files

    if controller not in CONTROLLERS:
        raise InputError(f"--controller is one of {', '.join(CONTROLLERS)}", value=controller)
    if timing not in TIMINGS:
        raise InputError(f"--timing is one of {', '.join(TIMINGS)}", value=timing)
    if seed < 0:
        raise InputError("--seed is 0 or more", value=seed)
    if friction is not None and not (math.isfinite(friction) and friction >= 0):
        raise InputError("friction is a finite number, 0 or more", key="--friction", value=friction)
    within = None if tolerance is None else numbers(tolerance, 2, "--tolerance")
    spread, shift, off = (
        numbers(noise, 2, "--noise") or [],
        numbers(centre, 2, "--centre") or [],
        numbers(start, 3, "--start") or [],
    )
    tracked = TrackedRun(
        cast("Law", controller),
        rate,
        cast("Timing", timing),
        learn,
        frequency,
        damping,
        Camera(camera, latency, spread[0] / 1000, math.radians(spread[1]), dropped / 100),
        friction,
        (shift[0] / 1000, shift[1] / 1000),
        (off[0] / 1000, off[1] / 1000, math.radians(off[2])),
        seed,
        None if within is None else (within[0] / 1000, math.radians(within[1])),
    )
    loaded = load_plan(plan)
    if figure is not None:
        from ..view.picture import check_ending

        check_outputs(plan_files(plan, loaded.run), [figure])
        check_ending(figure)
    warn_unverified(loaded)
    tell_slow_way(loaded, rate=rate)
    run = tracked.of(loaded, _progress(loaded.duration, rate) if sys.stderr.isatty() else None)
    if sys.stderr.isatty():
        sys.stderr.write("\n")
    distance, turn = goal_error(loaded, run.object[-1])
    how = "slides" if loaded.slides else controller
    result = {
        "controller": how,
        "outcome": run.outcome,
        "final_pose": [float(x) for x in run.object[-1]],
        "distance": distance,
        "turn": turn,
        "time": float(run.times[-1]),
        "modes": {m: run.modes.count(m) for m in dict.fromkeys(run.modes)},
        "contacts": {m: run.contacts.count(m) for m in dict.fromkeys(run.contacts)},
        "notes": [[t, text] for t, text in run.notes[:MOST_NOTES]],
    }
    if figure is not None:
        from ..view.track_figure import track_figure

        beside = "" if run.outcome.startswith(BESIDE) else f", off the goal by {error_text(distance, turn)}"
        title = f"{how} at {rate:g} Hz: {run.outcome}{beside}"
        track_figure(loaded, run, figure, title)
    if as_json:
        print_json(result)
    else:
        _tell(result, run, figure)
    return 0 if run.outcome == ARRIVED else 3


def _progress(planned: float, rate: float) -> Callable[[float, ControllerState], None]:
    """Writes the time and the mode four times a second."""

    def told(time: float, state: ControllerState) -> None:
        if round(time * rate) % max(1, round(rate / 4)) == 0:
            sys.stderr.write(f"\r{time:7.2f} s of {planned:.1f} s planned: {state.mode:<12}")
            sys.stderr.flush()

    return told


def _tell(result: dict[str, Any], run: ClosedLoopRun, figure: Path | None) -> None:
    typer.echo(
        f"{result['controller']}: {result['outcome']} after {result['time']:.2f} s;"
        f" the object is at {pose_text(result['final_pose'])}"
    )
    typer.echo(f"off the goal by {error_text(result['distance'], result['turn'])}")
    typer.echo("controller: " + ", ".join(f"{m} {n}" for m, n in result["modes"].items()))
    typer.echo("contact: " + ", ".join(f"{m} {n}" for m, n in result["contacts"].items()))
    told = [note for note in run.notes if "friction cone allows" not in note[1]]
    told = [note for note in told if note[1].startswith("landing")] or told
    for time, text in told[:MOST_TOLD]:
        typer.echo(f"  {time:.2f} s: {text}")
    if len(told) > MOST_TOLD:
        typer.echo(f"  and {len(told) - MOST_TOLD} more")
    if figure is not None:
        typer.echo(f"wrote {figure}")
