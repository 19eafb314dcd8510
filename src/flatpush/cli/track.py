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
    from ..control.tracking.simulated_run import Law, Timing, TrackedRun
    from ..problem import Scene

CONTROLLERS = ("path", "dfl", "horizon")
TIMINGS = ("even", "plan")
MOST_TOLD, MOST_NOTES = 8, 20
# What the modes that are counted tell as well: saturated and looking.
UNTOLD = ("friction cone allows", "looking at the object")


def command(
    plan: Annotated[
        Path,
        typer.Argument(metavar="PLAN", help="The plan document (JSON), or a scene whose support is unknown."),
    ],
    controller: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The controller: path (the default), dfl or horizon."),
    ] = None,
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
    table: Annotated[
        Path | None,
        typer.Option(
            metavar="SCENE",
            help="The object as it truly stands, for a scene whose support is unknown; by default drawn by the seed.",
        ),
    ] = None,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="MM,DEG", help="How near the goal it arrives; by default the scene's goal_tolerance."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(metavar="N", help="Seed of the noise; the same seed gives the same run.")
    ] = 0,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write the run as .csv, which identify, calibrate and replay read."
        ),
    ] = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the run as .svg or .png.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Follow PLAN under feedback, in the contact simulator with a simulated camera.

    With --learn, PLAN may be a scene with support: unknown. Then the finger first makes short pushes that teach where
    the object presses on the table, and then brings it to its goal.
    """
    from ..documents import check_outputs, load_plan, plan_files

    if controller is not None and controller not in CONTROLLERS:
        raise InputError(f"--controller is one of {', '.join(CONTROLLERS)}", value=controller)
    if timing not in TIMINGS:
        raise InputError(f"--timing is one of {', '.join(TIMINGS)}", value=timing)
    if seed < 0:
        raise InputError("--seed is 0 or more", value=seed)
    if friction is not None and not (math.isfinite(friction) and friction >= 0):
        raise InputError("friction is a finite number, 0 or more", key="--friction", value=friction)
    within = None if tolerance is None else numbers(tolerance, 2, "--tolerance")
    if within is not None and min(within) <= 0:
        raise InputError(
            "a tolerance is a distance and an angle, both positive", key="--tolerance", value=tolerance
        )
    spread, shift, off = (
        numbers(noise, 2, "--noise") or [],
        numbers(centre, 2, "--centre") or [],
        numbers(start, 3, "--start") or [],
    )
    if log is not None:
        check_outputs([plan, table], [log, figure])
        if log.suffix.lower() != ".csv":
            raise InputError("the log of a simulated run ends in .csv", source=str(log))
    given = _unknown(plan) or load_plan(plan)
    from ..problem import Scene

    if not isinstance(given, Scene) and given.status == "solved":
        given.check_motion()
    from ..control import ARRIVED, Camera
    from ..control.tracking.plan_controller import BESIDE, goal_error
    from ..control.tracking.simulated_run import TrackedRun

    tracked = TrackedRun(
        cast("Law", controller or "path"),
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
    if isinstance(given, Scene):
        if not learn:
            raise InputError(
                "this scene does not know where its object presses on the table", source=str(plan),
                hint="Add --learn: it is learned by first pushes.",
            )  # fmt: skip
        if controller not in (None, "horizon"):
            raise InputError(
                "an unknown table is learned on the way by the controller horizon", value=controller
            )
        if figure is not None:
            raise InputError("--figure draws a run beside its plan, and here is none", value=str(figure))
        return _learned(tracked, given, table, log, as_json)
    if table is not None:
        raise InputError("--table goes with a scene whose support is unknown", value=str(table))
    if figure is not None:
        from ..view.picture import check_ending

        check_outputs(plan_files(plan, given.run), [figure])
        check_ending(figure)
    warn_unverified(given)
    tell_slow_way(given, rate=rate)
    run = tracked.of(given, _progress(given.duration, rate) if sys.stderr.isatty() else None)
    if sys.stderr.isatty():
        sys.stderr.write("\n")
    if log is not None:
        from ..execution.log import save_followed

        save_followed(run, given.scene.object.name, log)
    distance, turn = goal_error(given, run.object[-1])
    how = "slides" if given.slides else tracked.controller
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
        track_figure(given, run, figure, title)
    if as_json:
        print_json(result)
    else:
        _tell(result, run, figure)
    return 0 if run.outcome == ARRIVED else 3


def _unknown(path: Path) -> Scene | None:
    """The scene in a file, if it is one; else None.

    Raises:
        InputError: for a scene whose support is known: it is planned first.
    """
    from ..documents import load_scene, read_mapping
    from ..documents.reading import MOST_BYTES_OF_SCENE as MOST

    kind = read_mapping(path, MOST).get("flatpush") if path.suffix.lower() in (".yaml", ".yml") else None
    if not str(kind).startswith("scene/"):
        return None
    scene = load_scene(path, unknown=True)
    if scene.object.support_word != "unknown":
        raise InputError(
            "this is a scene, and track follows a plan", source=str(path),
            hint="flatpush plan SCENE -o PLAN makes one; a scene is tracked if it says support: unknown.",
        )  # fmt: skip
    return scene


def _learned(tracked: TrackedRun, scene: Scene, table: Path | None, log: Path | None, as_json: bool) -> int:
    """First pushes that teach, and then to the goal."""
    from ..control import ARRIVED
    from ..control.tracking.unknown_table import drawn_table, run_unknown, same_outline
    from ..documents import load_scene
    from ..execution.log import save_followed

    if table is None:
        thing = drawn_table(scene.object.outline, tracked.seed)
    else:
        thing = load_scene(table).object
        if not same_outline(thing.outline, scene.object.outline):
            raise InputError(
                "--table is a scene of the same outline", source=str(table), key="object.outline"
            )
    done = run_unknown(
        scene, thing, tracked.camera, seed=tracked.seed, rate=tracked.rate, tolerance=tracked.tolerance
    )
    if log is not None:
        save_followed(done.run, scene.object.name, log)
    run, error = done.run, scene.goal_error(done.run.object[-1])
    distance, turn = math.hypot(error[0], error[1]), abs(float(error[2]))
    learned = None
    if done.fit is not None:
        found = done.fit.thing
        learned = {
            "family": done.fit.pressure.name, "friction": found.friction, "centre": found.cof.tolist(),
            "support": [[*p, w] for p, w in zip(*(part.tolist() for part in found.support.feet), strict=True)],
        }  # fmt: skip
    if as_json:
        print_json(
            {
                "outcome": run.outcome, "final_pose": run.object[-1].tolist(), "distance": distance, "turn": turn,
                "time": float(run.times[-1]), "taught": done.taught, "learned": learned,
            }
        )  # fmt: skip
        return 0 if run.outcome == ARRIVED else 3
    if done.fit is not None:
        cof = 1000 * done.fit.thing.cof
        typer.echo(
            f"first pushes for {done.taught:.1f} s tell: {done.fit.pressure.name}, centre of friction"
            f" ({cof[0]:.2f} mm, {cof[1]:.2f} mm), μ {done.fit.thing.friction:.2f}"
        )
    typer.echo(
        f"{run.outcome} after {run.times[-1]:.2f} s; the object is at {pose_text(run.object[-1])}, off the goal by"
        f" {error_text(distance, turn)}"
    )
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
    told = [note for note in run.notes if not any(words in note[1] for words in UNTOLD)]
    told = [note for note in told if note[1].startswith("landing")] or told
    for time, text in told[:MOST_TOLD]:
        typer.echo(f"  {time:.2f} s: {text}")
    if len(told) > MOST_TOLD:
        typer.echo(f"  and {len(told) - MOST_TOLD} more")
    if figure is not None:
        typer.echo(f"wrote {figure}")
