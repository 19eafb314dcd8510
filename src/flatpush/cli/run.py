"""flatpush run: a plan on a robot."""

from __future__ import annotations

import math
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ..errors import InputError
from .common import check_latency, error_text, numbers, pose_text, print_json, tell_failed
from .track import CONTROLLERS

if TYPE_CHECKING:
    from ..control import AbstractController, AbstractSensor
    from ..control.tracking.simulated_run import Law
    from ..execution import Cycle, Limits, Robot, Run
    from ..execution.course import Course
    from ..problem import Plan

# A controller ticks about so often [Hz].
RATE = 60.0
COUNTDOWN = 3


def command(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="The plan document (JSON).")],
    robot: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Which robot: sim, dry-run, egm://HOST:PORT or another of docs/robots.md."
        ),
    ],
    scene: Annotated[
        Path | None, typer.Option(metavar="SCENE", help="The scene that you trust; the plan must be for it.")
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Feedback by path, dfl or horizon; by default it goes open loop."),
    ] = None,
    log: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a log of every cycle as .csv or .mcap.")
    ] = None,
    speed: Annotated[
        float, typer.Option(metavar="PART", help="How fast, as a part of the plan's speed, up to 1.")
    ] = 1.0,
    base_frame: Annotated[
        str | None,
        typer.Option(help="Pose of the table in the robot's base frame [m, rad].", metavar="X,Y,Z,YAW"),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the noise of a simulated camera.")] = 0,
    camera: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A camera file: the controller sees the object by its tag."),
    ] = None,
    tag: Annotated[
        str | None,
        typer.Option(metavar="ID,MM,HEIGHT[,X,Y,DEG]", help="The object's tag, as of camera watch."),
    ] = None,
    device: Annotated[int, typer.Option(metavar="N", help="The number of the camera.")] = 0,
    latency: Annotated[
        float, typer.Option(metavar="SECONDS", help="How old a frame of the camera is when it comes.")
    ] = 0.1,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before a robot moves.")] = False,
    figure: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw what was planned against what was done as .svg or .png."),
    ] = None,
    film: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Film the physics cell as .gif, or on a page as .html."),
    ] = None,
    window: Annotated[bool, typer.Option("--window", help="Show the physics cell in a window.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Verify PLAN, compare it with the limits of a robot, and run it there. Ctrl-C and SIGTERM stop the robot."""
    from ..documents import check_outputs, load_plan, load_scene, plan_files, scene_files

    if controller is not None and controller not in CONTROLLERS:
        raise InputError(f"--controller is one of {', '.join(CONTROLLERS)}", value=controller)
    if seed < 0:
        raise InputError("--seed is 0 or more", value=seed)
    check_latency(latency)
    if (camera is None) != (tag is None) or (camera is not None and controller is None):
        raise InputError("--camera, --tag and --controller go together")
    frame = numbers(base_frame, 4, "--base-frame")
    trusted = () if scene is None else scene_files(scene)
    check_outputs([plan, *trusted], [log, figure, film])
    if (film is not None or window) and not robot.startswith("mujoco"):
        raise InputError(
            "--film and --window show the physics cell", value=robot, hint="mujoco://tool, for one."
        )
    loaded = load_plan(plan)
    check_outputs(plan_files(plan, loaded.run), [log, figure, film])
    from ..control import ARRIVED
    from ..control.tracking.plan_controller import goal_error
    from ..execution import DONE, open_robot, run
    from ..execution.log import check_log
    from ..execution.run import to_controller, way
    from ..simulation import verify

    if log is not None:
        check_log(log)
    if film is not None:
        from ..execution.cell.film import check_film

        check_film(film)
    if figure is not None:
        from ..view.picture import check_ending

        check_ending(figure)
    failed = (
        verify(loaded, None if scene is None else load_scene(scene)).failed
        if loaded.status == "solved"
        else ()
    )
    if failed:
        tell_failed(failed)
        typer.echo("the plan fails verification; nothing was moved", err=True)
        return 4
    with _terminated(), open_robot(robot, loaded, frame) as arm, ExitStack() as stack:
        course = (way if controller is None else to_controller)(loaded, arm, speed)
        _show(arm.limits, course, loaded, speed)
        if getattr(arm, "real", True):
            _ask(yes, robot)
        look = None
        if camera is not None:
            look = stack.enter_context(_tag_eyes(loaded, arm, camera, tag or "", device, latency, seed))
        law, eyes = (
            (None, None)
            if controller is None
            else _closed(loaded, arm, cast("Law", controller), speed, seed, look, latency)
        )
        told = [_progress(loaded.duration / speed), *_shown(stack, arm, film, window)]
        ended = run(loaded, arm, law, eyes, log, speed=speed, told=lambda cycle: _tell_all(told, cycle))
    if sys.stderr.isatty():
        sys.stderr.write("\n")
    result = _result(ended, controller)
    good = ended.outcome in (DONE, ARRIVED)
    if ended.object is not None:
        distance, turn = goal_error(loaded, ended.object)
        result |= {"final_pose": [float(v) for v in ended.object], "distance": distance, "turn": turn}
    if figure is not None:
        from ..view.track_figure import track_figure

        track_figure(loaded, ended.as_followed(), figure, f"on {robot}: {ended.outcome}")
        result["figure"] = str(figure)
    if as_json:
        print_json(result)
    else:
        _tell(result, log, film)
    return 0 if good else 3


@contextmanager
def _terminated() -> Iterator[None]:
    """SIGTERM ends a run as Ctrl-C does: the robot is stopped."""

    def interrupted(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupted)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _tag_eyes(
    plan: Plan, robot: Robot, camera: Path, tag: str, device: int, latency: float, seed: int
) -> Iterator[AbstractSensor]:
    """Eyes that see the object's tag: through a camera, or in drawn pictures where the robot is a simulated one."""
    import numpy as np

    from ..documents.camera_file import load_camera
    from ..vision import Device, DrawnEyes, Spoil, SyntheticCamera, TagEyes, Tracker
    from .camera import tag_of

    name = plan.scene.object.name
    tracker = Tracker(load_camera(camera), {name: tag_of(tag, "--tag")})
    if getattr(robot, "object", None) is None:
        with Device(device, latency, tracker.camera.size) as frames:
            yield TagEyes(tracker, frames)
        return
    top = {name: plan.scene.object.outline.polyline()}
    drawn = SyntheticCamera(tracker.camera, tracker.tags, top, spoil=Spoil(noise=4, blur=0.8))
    yield DrawnEyes(tracker, drawn, np.random.default_rng(seed), latency=latency)


def _closed(
    plan: Plan,
    robot: Robot,
    law: Law,
    speed: float,
    seed: int,
    eyes: AbstractSensor | None = None,
    latency: float = 0.1,
) -> tuple[AbstractController[Any], AbstractSensor]:
    """A controller within the robot's limits, and its eyes: else a simulated camera that is late and noisy."""
    import numpy as np

    from ..control import Camera, SimulatedSensor
    from ..control.tracking.simulated_run import TrackedRun
    from ..execution.run import slowed

    if eyes is None and getattr(robot, "object", None) is None:
        raise InputError(
            "a controller needs eyes, and this robot does not see the object",
            hint="Give --camera and --tag, or run() a controller and eyes in Python, or leave --controller out.",
        )
    ticks = max(1, round(1 / (RATE * robot.limits.period)))
    camera = Camera(latency=latency)
    tracked = TrackedRun(law, 1 / (ticks * robot.limits.period), camera=camera)
    eyes = eyes or SimulatedSensor(camera, np.random.default_rng(seed))
    return tracked.law(slowed(plan, robot.limits, speed)), eyes


def _show(limits: Limits, course: Course, plan: Plan, speed: float) -> None:
    """What the robot may do, and where it goes first."""
    a, b, c, d = (1000 * v for v in limits.workspace)
    low, high = (1000 * v for v in limits.heights)
    typer.echo(
        f"limits: x {a:g} to {c:g} mm, y {b:g} to {d:g} mm, height {low:g} to {high:g} mm,"
        f" {1000 * limits.speed:g} mm/s, {1000 * limits.acceleration:g} mm/s²,"
        f" {math.degrees(limits.turn_rate):.0f} °/s, a target every {1000 * limits.period:g} ms",
        err=True,
    )
    last = [k for k, leg in enumerate(course.leg) if course.legs[leg] == course.legs[0]][-1]
    places = [course.poses[0], course.poses[last]]
    here, there = (f"{pose_text(p[[0, 1, 3]])} at {1000 * p[2]:.1f} mm" for p in places)
    seconds = course.times[last] - course.times[0]
    typer.echo(f"first approach: from {here} up, over and down to {there}, {seconds:.1f} s", err=True)
    typer.echo(
        f"then {len(plan.on_table)} push{'es' if len(plan.on_table) > 1 else ''}, {plan.duration / speed:.1f} s",
        err=True,
    )


def _ask(yes: bool, robot: str) -> None:
    """Before anything real moves."""
    if not yes:
        if not sys.stdin.isatty():
            raise InputError(
                "a robot moves only if somebody says so", hint="Answer on a terminal, or give --yes."
            )
        if not typer.confirm(f"move {robot}?", err=True):
            raise typer.Abort
    for left in range(COUNTDOWN, 0, -1):
        typer.echo(f"{left} …", err=True)
        time.sleep(1.0)


def _shown(stack: ExitStack, arm: Robot, film: Path | None, window: bool) -> list[Callable[[Cycle], None]]:
    """What is to be told each cycle to film the physics cell and to show it."""
    found = []
    if film is not None or window:
        from ..execution.cell import film as films
        from ..execution.cell.robot import CellRobot

        cell = cast("CellRobot", arm)
        if film is not None:
            found.append(stack.enter_context(films.film(cell, film)))
        if window:
            found.append(stack.enter_context(films.window(cell)))
    return found


def _tell_all(told: Sequence[Callable[[Cycle], None]], cycle: Cycle) -> None:
    for one in told:
        one(cycle)


def _progress(planned: float) -> Callable[[Cycle], None]:
    """Writes where it is, and how far the tool is from where it should be, four times a second."""
    if not sys.stderr.isatty():
        return lambda cycle: None
    last = -math.inf

    def told(cycle: Cycle) -> None:
        nonlocal last
        if cycle.time - last >= 0.25:
            last = cycle.time
            sys.stderr.write(
                f"\r\033[K{cycle.time:6.1f} s of about {planned:.0f} s: {cycle.leg}, {1000 * cycle.off:.2f} mm off"
            )
            sys.stderr.flush()

    return told


def _result(run: Run, controller: str | None) -> dict[str, Any]:
    return {
        "controller": controller,
        "outcome": run.outcome,
        "cycles": len(run.cycles),
        "time": run.cycles[-1].time if run.cycles else 0.0,
        "tool_off": run.off,
        "latest_cycle": max((cycle.late for cycle in run.cycles), default=0.0),
    }


def _tell(result: dict[str, Any], log: Path | None, film: Path | None) -> None:
    typer.echo(
        f"{result['outcome']} after {result['time']:.2f} s, {result['cycles']} cycles; the tool was at most"
        f" {1000 * result['tool_off']:.2f} mm from where it was sent"
    )
    if "final_pose" in result:
        off = error_text(result["distance"], result["turn"])
        typer.echo(f"the object is at {pose_text(result['final_pose'])}, off the goal by {off}")
    for name in filter(None, (log, film, result.get("figure"))):
        typer.echo(f"wrote {name}")
