"""flatpush track: follows a plan in the simulator under feedback."""

import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .common import error_text, numbers, pose_text, print_json

CONTROLLERS = ("path", "dfl", "horizon")
TIMINGS = ("even", "plan")
MOST_TOLD = 8


def command(
    plan: Annotated[Path, typer.Argument(help="Plan document (JSON).")],
    controller: Annotated[str, typer.Option(help="path, dfl or horizon.")] = "path",
    rate: Annotated[float, typer.Option(help="Of the controller [Hz].")] = 60.0,
    noise: Annotated[str, typer.Option(help="Of the measured pose, standard deviations MM,DEG.")] = "0.3,0.3",
    camera: Annotated[float, typer.Option(help="Frames per second [Hz].")] = 30.0,
    latency: Annotated[float, typer.Option(help="Of a frame [s].")] = 0.1,
    dropped: Annotated[float, typer.Option(help="Share of frames that never come [%].")] = 0.0,
    friction: Annotated[
        float | None, typer.Option(help="At the finger in the simulation; default: the scene's.")
    ] = None,
    centre: Annotated[str, typer.Option(help="The centre of friction is off by DX,DY [mm].")] = "0,0",
    start: Annotated[str, typer.Option(help="The start is off by DX,DY,DEG [mm, deg].")] = "0,0,0",
    timing: Annotated[
        str, typer.Option(help="path: at an even speed, or with the time law of the plan: even, plan.")
    ] = "even",
    frequency: Annotated[float, typer.Option(help="dfl: natural frequency [rad/s].")] = 2.0,
    damping: Annotated[float, typer.Option(help="dfl: damping ratio.")] = 1.0,
    learn: Annotated[bool, typer.Option("--learn", help="Learn the steering while pushing.")] = False,
    seed: Annotated[int, typer.Option(help="Of the noise.")] = 0,
    figure: Annotated[Path | None, typer.Option(help="Draw the run: .svg or .png.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Follow PLAN under feedback, in the contact simulator with a simulated camera."""
    from ..documents import check_writable, load_plan

    if controller not in CONTROLLERS:
        raise InputError(f"--controller is one of {', '.join(CONTROLLERS)}", value=controller)
    if timing not in TIMINGS:
        raise InputError(f"--timing is one of {', '.join(TIMINGS)}", value=timing)
    if seed < 0:
        raise InputError("--seed is 0 or more", value=seed)
    if friction is not None and not (math.isfinite(friction) and friction >= 0):
        raise InputError("friction is a finite number, 0 or more", key="--friction", value=friction)
    spread, shift, off = (
        numbers(noise, 2, "--noise") or [],
        numbers(centre, 2, "--centre") or [],
        numbers(start, 3, "--start") or [],
    )
    loaded = load_plan(plan)
    if figure is not None:
        from ..view.figure import check_ending

        check_writable(figure)
        check_ending(figure, (".svg", ".png"))
    run = _run(
        loaded, controller, rate, spread, camera, latency, dropped, friction, shift, off, timing, frequency,
        damping, learn, seed,
    )  # fmt: skip
    result = _result(loaded, run, controller)
    if figure is not None:
        from ..view.track_figure import track_figure

        off_text = error_text(result["distance"], result["turn"])
        track_figure(
            loaded, run, figure, f"{controller} at {rate:g} Hz: {run.outcome}, off the goal by {off_text}"
        )
    if as_json:
        print_json(result)
        return 0
    _tell(result, run, figure)
    return 0


def _run(
    plan: Any, name: Any, rate: float, spread: list[float], camera: float, latency: float, dropped: float,
    friction: float | None, shift: list[float], off: list[float], timing: Any, frequency: float, damping: float,
    learn: bool, seed: int,
) -> Any:  # fmt: skip
    import numpy as np
    from shapely import MultiPoint, Point

    from ..control import Camera, SimulatedSensor
    from ..control.closed_loop import drive
    from ..control.gains import Gains
    from ..control.plan_controller import PlanController
    from ..simulation.plant import Plant

    eye = Camera(camera, latency, spread[0] / 1000, math.radians(spread[1]), dropped / 100)
    if not (math.isfinite(rate) and rate > 0):
        raise InputError("a rate is positive", key="--rate", value=rate)
    if name == "horizon":
        from ..control.horizon import HorizonController

        law: Any = HorizonController.of(plan, rate=rate, latency=latency, learn=learn)
    else:
        sd = (max(eye.position, 1e-5), max(eye.angle, 1e-4))
        gains = Gains.of(frequency, damping)
        law = PlanController.of(
            plan, name, rate, gains=gains, timing=timing, learn=learn, sd=sd, stale=0.5 + latency
        )
    scene, first = plan.scene, plan.pushes[0]
    if any(not np.allclose(p.fingers.shape, first.fingers.shape) for p in plan.pushes):
        raise InputError("every push of a tracked plan has as many fingers as the first")
    cof = scene.object.cof + np.array(shift) / 1000
    if not MultiPoint(scene.object.outline.polyline()).convex_hull.covers(Point(cof)):
        raise InputError("--centre takes the centre of friction off the object", value=shift)
    plant = Plant(scene.object, first.fingers, scene.pusher.tip_radius, friction=friction, cof=cof)
    # The horizon controller looks, and lands again, as often as it takes.
    patience = 3 * plan.duration + (200 if name == "horizon" else 10)
    error = np.array([off[0] / 1000, off[1] / 1000, math.radians(off[2])])
    live = sys.stderr.isatty()

    def told(time: float, state: Any) -> None:
        if live and round(time * rate) % max(1, round(rate / 4)) == 0:
            sys.stderr.write(f"\r{time:7.2f} s of {plan.duration:.1f} s planned: {state.mode:<12}")
            sys.stderr.flush()

    run = drive(
        law, plant, scene.start_pose + error, _landing(plan, first),
        SimulatedSensor(eye, np.random.default_rng(seed)), patience, told=told,
    )  # fmt: skip
    if live:
        sys.stderr.write("\n")
    return run


def _landing(plan: Any, first: Any) -> Any:
    """Where the pusher waits: twice the approach distance behind the first contact, as planned."""
    from ..geometry import compose

    return compose(first.pusher[0], [-2 * plan.scene.pusher.approach, 0.0, 0.0])


def _result(plan: Any, run: Any, name: str) -> dict[str, Any]:
    from ..control.plan_controller import goal_error

    distance, turn = goal_error(plan, run.object[-1])
    return {
        "controller": name,
        "outcome": run.outcome,
        "final_pose": [float(x) for x in run.object[-1]],
        "distance": distance,
        "turn": turn,
        "time": float(run.times[-1]),
        "modes": {m: run.modes.count(m) for m in dict.fromkeys(run.modes)},
        "contacts": {m: run.contacts.count(m) for m in dict.fromkeys(run.contacts)},
        "notes": [[t, text] for t, text in run.notes[:20]],
    }


def _tell(result: dict[str, Any], run: Any, figure: Path | None) -> None:
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
