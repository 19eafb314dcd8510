"""The paper's robot experiment in the physics cell: [Zhou2017] Figs. 6-9, four objects, three starts, five runs each.

Two fingers on the paper's arm, an IRB 120, open loop. Every run begins beside its nominal start as the recorded ones
did: their offsets have the standard deviations OFF. A push of two fingers takes out errors of the angle and across the
fingers, not along them. So the last push goes straight to the goal, where late contact costs nothing, and what comes
before it pushes sides at right angles to that one. Not every pair of such plans bears starts that are off: fingers go
over the crests of a curved side. So the contact simulator tries a pair before the cell does. Support and outline are as
stated for the paper's objects; the feet of Fig. 6 are not known.

Then the same starts with one finger under feedback: the horizon controller, learning, on poses that are late and noisy.
"""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from time import process_time

import numpy as np

from ..control import Camera, SimulatedSensor
from ..control.tracking.simulated_run import TrackedRun
from ..errors import InputError
from ..execution import DONE
from ..execution import run as run_on
from ..execution.arms import ARMS
from ..execution.cell.robot import CellRobot
from ..execution.run import Run, slowed
from ..execution.simulated import Unknown
from ..geometry import pose_error, transform
from ..geometry.pose import Array
from ..planning import plan
from ..planning.options import push_option
from ..problem import Plan, Planning, Push, Pusher, Scene
from ..simulation.rollout import roll
from .feedback import objects

# Standard deviations of the start in 41 recorded runs, over both axes [m], and of its angle [rad].
OFF = (0.001, float(np.deg2rad(1.2)))
RUNS, SEED = 5, 0
ARM = "irb120"  # or another of the cell's; "": the tool alone
# Starts with which plans are tried in the contact simulator, so many at once; plans that bring these to more than
# HOPELESS times the tolerance are tried no further.
TRIED, AT_ONCE, HOPELESS = 12, 4, 3.0
# Of one finger: it stops when it believes to be so near the goal, and counts when it is so near [m, rad]. Ticks [Hz].
BELIEVED = (0.0007, float(np.deg2rad(0.7)))
NEAR = (0.001, float(np.deg2rad(1.0)))
RATE = 60.0
# Two fingers land this far before the object, because it may be so far from where it should be [m].
APPROACH = 0.005
# The last push is so long [m]; normals of sides at right angles to it have at most this cosine between them.
LAST, SQUARE = 0.025, 0.6
GOAL = (0.0, 0.0, 0.0)
# The offsets from the goal at which the runs begin (mm, mm, °), and what a change of contact costs [m].
STARTS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "fig6": ((20, -30, 90), (30, 50, 60), (60, 20, 150)),
    "fig7": ((20, -30, 90), (30, 50, 60), (60, 20, 150)),
    "fig8": ((-30, 10, 90), (20, -10, 30), (60, 20, 135)),
    "fig9": ((0, 0, 90), (30, 50, 45), (-50, 20, 180)),
}
# What the paper prints for them: means of x, y [mm] and θ [°], signed, and halves of their 95 % intervals.
PRINTED: dict[str, tuple[tuple[tuple[float, float], ...], ...]] = {
    "fig6": (
        ((0.03, 0.02), (-3.19, 0.29), (0.53, 0.11)),
        ((0.50, 0.13), (-0.96, 0.6), (-0.48, 0.61)),
        ((-0.23, 0.11), (-4.17, 0.87), (-1.29, 0.5)),
    ),
    "fig7": (
        ((-0.26, 0.12), (-3.31, 0.75), (-0.46, 0.19)),
        ((0.42, 0.12), (-1.49, 1.63), (-0.14, 0.27)),
        ((-0.27, 0.21), (-4.56, 0.43), (-0.93, 0.76)),
    ),
    "fig8": (
        ((-0.96, 0.08), (-0.09, 0.73), (0.83, 1.00)),
        ((-0.69, 0.17), (-1.46, 0.06), (4.40, 1.24)),
        ((-0.65, 0.17), (-1.38, 0.07), (5.89, 2.37)),
    ),
    "fig9": (
        ((0.64, 0.05), (1.04, 0.63), (0.11, 0.31)),
        ((0.11, 0.65), (-0.50, 0.30), (-0.42, 0.44)),
        ((2.34, 0.23), (0.12, 0.06), (-1.06, 0.42)),
    ),
}
SWITCH = {"fig6": 0.03, "fig7": 0.03, "fig8": 0.05, "fig9": 0.01}
COLOURS = ("#cc3311", "#882255", "#4477aa")  # of pushes in sequence, as in the paper: red, purple, blue
POINTS = 40  # of the object's way in a push


@dataclass(frozen=True, eq=False)
class Case:
    """The runs from one start.

    Attributes:
        plans: what they run, one after the other. starts, ends: X_WO, shape (n, 3). outcomes: of each run.
        seconds: of simulated time, and cpu: of the machine, for all runs [s].
        ways: X_WO in each push of each run, arrays of shape (m, 3).
    """

    plans: tuple[Plan, Plan]
    starts: Array
    ends: Array
    outcomes: tuple[str, ...]
    seconds: float
    cpu: float
    ways: tuple[tuple[Array, ...], ...] = ()

    @property
    def errors(self) -> Array:
        """Off the goal (x, y, θ), shape (n, 3) [m, rad]."""
        return np.array([pose_error(end, GOAL) for end in self.ends])

    @property
    def pushes(self) -> list[str]:
        return [push.push for one in self.plans for push in one.pushes]


def plans(figure: str, start: tuple[float, float, float]) -> tuple[Plan, Plan]:
    """Two plans: to before the goal, and straight to it by another side.

    The cheapest that bring starts that are off to within the goal's tolerance on average, in the contact simulator;
    where none do, those that come nearest.

    Raises:
        InputError: if there are none.
    """
    found = pairs(figure, start)
    if not found:
        raise InputError(f"no plan for {figure} from {start}")
    best, least = found[0], np.inf
    for both in found:
        far = expected(both)
        if far <= 1:
            return both
        if far < least:
            best, least = both, far
    return best


@lru_cache(maxsize=len(STARTS))
def pairs(figure: str, start: tuple[float, float, float]) -> tuple[tuple[Plan, Plan], ...]:
    """Plans to before the goal and straight to it, by every side that can, cheapest first."""
    thing, places = objects()[list(STARTS).index(figure)]
    pushes = {name: Push(name, thing.outline.nearest(place), 2, 0.018) for name, place in places.items()}
    pose = (start[0] / 1000, start[1] / 1000, float(np.deg2rad(start[2])))
    pusher = Pusher(fingers=2, spacing=0.018, approach=APPROACH)
    planning = Planning(switch_cost=SWITCH[figure])
    found: list[tuple[Plan, Plan]] = []
    for push in pushes.values():
        normal = push.at.normal
        across = tuple(other for other in pushes.values() if abs(float(other.at.normal @ normal)) < SQUARE)
        if not across:
            continue
        car = push_option(Scene(thing, pose, GOAL, pusher, (push,), planning=planning), push).car
        if car is None:
            continue
        before = tuple(float(v) for v in -LAST * car.straight)
        first = plan(Scene(thing, pose, before, pusher, across, planning=planning))
        last = plan(Scene(thing, before, GOAL, pusher, (push,), planning=planning))
        if first.status == last.status == "solved":
            found.append((first, last))
    return tuple(sorted(found, key=lambda both: both[0].cost + both[1].cost))


def expected(both: tuple[Plan, ...], runs: int = TRIED, seed: int = SEED) -> float:
    """How far off the goal starts that are off end on average in the contact simulator, in parts of the tolerance."""
    noise = np.array([OFF[0], OFF[0], OFF[1]])
    starts = both[0].scene.start_pose + noise * np.random.default_rng(seed).standard_normal((runs, 3))
    errors = np.zeros((0, 3))
    mean = 0.0
    for k in range(0, runs, AT_ONCE):
        poses = starts[k : k + AT_ONCE]
        for one in both:
            poses = roll(
                one, [replace(one.scene, start=tuple(pose)) for pose in poses], "exact", "arcs"
            ).final
        errors = np.concatenate([errors, [pose_error(pose, GOAL) for pose in poses]])
        off = np.column_stack([np.hypot(errors[:, 0], errors[:, 1]), np.abs(errors[:, 2])])
        mean = float(np.max(off.mean(axis=0) / both[-1].scene.planning.goal_tolerance[1:]))
        if mean > HOPELESS:
            break
    return mean


def cases(figure: str, runs: int = RUNS, seed: int = SEED, arm: str = ARM) -> Iterator[Case]:
    """The runs of a figure, one case for each start."""
    for number, start in enumerate(STARTS[figure]):
        both = plans(figure, start)
        starts, ends, ways, outcomes, seconds, begun = [], [], [], [], 0.0, process_time()
        for k in range(runs):
            with _robot(both[0], beside(figure, number, k, seed), arm) as robot:
                starts.append(robot.object)
                done = [run_on(one, robot) for one in both]
                ends.append(robot.object)
                ways.append(way_of(done))
                outcomes.append(next((one.outcome for one in done if one.outcome != DONE), DONE))
                seconds += robot.clock.now()
        cpu = process_time() - begun
        yield Case(both, np.array(starts), np.array(ends), tuple(outcomes), seconds, cpu, tuple(ways))


def _robot(one: Plan, unknown: Unknown, arm: str) -> CellRobot:
    """The cell for a plan, with an arm that stands where it usually does."""
    return CellRobot(one, unknown, arm=ARMS[arm].placed() if arm else None)


def way_of(done: Sequence[Run]) -> tuple[Array, ...]:
    """X_WO in each push of plans that were run one after the other, each of some POINTS rows."""
    found = []
    for one in done:
        for leg, cycles in groupby(one.cycles, key=lambda cycle: cycle.leg):
            poses = [cycle.object for cycle in cycles if cycle.object is not None]
            if "(push " in leg and poses:
                found.append(np.array([*poses[:: 1 + len(poses) // POINTS], poses[-1]]))
    return tuple(found)


def beside(figure: str, number: int, k: int, seed: int) -> Unknown:
    """Where run k from a start of a figure begins: the same for two fingers and for one."""
    drawn = np.random.SeedSequence([seed, list(STARTS).index(figure), number, k]).generate_state(1)[0]
    return Unknown(noise=OFF, seed=int(drawn))


def fed_back(
    figure: str, runs: int = RUNS, seed: int = SEED, arm: str = ARM
) -> Iterator[tuple[Array, Array]]:
    """For each start the same runs with one finger: errors (x, y, θ) [m, rad], (n, 3), and times (n,) [s]."""
    thing, places = objects()[list(STARTS).index(figure)]
    pushes = tuple(Push(name, thing.outline.nearest(place)) for name, place in places.items())
    planning = Planning(friction_margin=0.4, iterations=1)
    for number, (x, y, degrees) in enumerate(STARTS[figure]):
        pose = (x / 1000, y / 1000, float(np.deg2rad(degrees)))
        one = plan(Scene(thing, pose, GOAL, Pusher(), pushes, planning=planning))
        errors, times = [], []
        for k in range(runs):
            with _robot(one, unknown := beside(figure, number, k, seed), arm) as robot:
                period, camera = robot.limits.period, Camera()
                ticks = max(1, round(1 / (RATE * period)))
                law = TrackedRun(
                    "horizon", 1 / (ticks * period), learn=True, camera=camera, tolerance=BELIEVED
                )
                eyes = SimulatedSensor(camera, np.random.default_rng(unknown.seed))
                run_on(one, robot, law.law(slowed(one, robot.limits)), eyes)
                errors.append(pose_error(robot.object, GOAL))
                times.append(robot.clock.now())
        yield np.array(errors), np.array(times)


def table_of_one(figure: str, found: Sequence[tuple[Array, Array]]) -> str:
    """Mean distance and angle off the goal of each start, and how many are near it."""
    lines = [f"{figure}, one finger, horizon controller on noisy poses, off the goal:"]
    for start, (errors, times) in zip(STARTS[figure], found, strict=False):
        far, turn = 1000 * np.hypot(*errors[:, :2].T), np.degrees(np.abs(errors[:, 2]))
        name = ", ".join(f"{v:g}" for v in start)
        lines.append(
            f"{name:<18}{len(errors)} runs {far.mean():7.2f} mm{turn.mean():8.2f}°, at worst {far.max():.2f} mm"
            f" {turn.max():.2f}°, {times.mean():.0f} s"
        )
    e = np.abs(np.concatenate([errors for errors, _ in found]))
    good = np.count_nonzero((np.hypot(e[:, 0], e[:, 1]) <= NEAR[0]) & (e[:, 2] <= NEAR[1]))
    lines.append(f"{good} of {len(e)} within {1000 * NEAR[0]:g} mm and {np.degrees(NEAR[1]):g}°")
    return "\n".join(lines)


def run(
    folder: Path | None = None,
    figure: str = "fig6",
    runs: int | None = None,
    seed: int | None = None,
    data: Path | None = None,
) -> str:
    """The tables of two fingers and of one, recorded runs beside ours where their folder is given, and with a folder a
    figure in it."""
    asked = figure, runs or RUNS, SEED if seed is None else seed
    found = list(cases(*asked))
    if folder is not None:
        draw(figure, found, folder / f"{figure}.svg")
    two = table(figure, found, recorded(data, figure) if data is not None else {})
    return f"{two}\n{table_of_one(figure, list(fed_back(*asked)))}"


def recorded(data: Path, figure: str) -> dict[tuple[float, ...], Array]:
    """Errors (x, y, θ) [mm, °] of the paper's recorded runs, shape (n, 3), by their start (mm, mm, °)."""
    path = data / "robot_exp_logs" / "summary_runs.csv"
    if not path.is_file():
        return {}
    found: dict[tuple[float, ...], list[list[float]]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["figure"].lower() == figure:
                start = tuple(float(row[f"nominal_{name}"]) for name in ("dx_mm", "dy_mm", "dtheta_deg"))
                found.setdefault(start, []).append(
                    [float(row[f"err_{name}"]) for name in ("x_mm", "y_mm", "theta_deg")]
                )
    return {start: np.array(errors) for start, errors in found.items()}


def table(figure: str, found: list[Case], robot: dict[tuple[float, ...], Array] | None = None) -> str:
    """Signed means with 95 % intervals as the paper prints them, and mean distance and angle off the goal.

    Below each case stands what the paper prints for it, and its robot's recorded runs where they are given.
    """
    name = found[0].plans[0].scene.object.name
    lines = [
        f"{figure}: {name}, two fingers open loop in the physics cell; x, y [mm], θ [°]: mean ± 95 % interval.",
        f"{'start':<18}{'pushes':<34}{'runs':>5}{'x':>15}{'y':>15}{'θ':>15}{'off':>10}{'':>9}{'worst':>9}{'':>9}",
    ]
    for start, case, printed in zip(STARTS[figure], found, PRINTED[figure], strict=False):
        name = ", ".join(f"{v:g}" for v in start)
        lines.append(_row(name, " - ".join(case.pushes), case.errors * [1000, 1000, 180 / np.pi]))
        cells = "".join(f"{f'{m:+.2f} ± {h:.2f}':>15}" for m, h in printed)
        lines.append(f"{'':<18}{'  as the paper prints':<34}{5:>5}{cells}")
        errors = (robot or {}).get(tuple(float(v) for v in start))
        if errors is not None:
            lines.append(_row("", "  its recorded runs", errors))
        stopped = [outcome for outcome in case.outcomes if outcome != DONE]
        lines += [f"  ended: {outcome}" for outcome in stopped]
    e = np.concatenate([case.errors for case in found]) * [1000, 1000, 180 / np.pi]
    speed = sum(case.seconds for case in found) / sum(case.cpu for case in found)
    lines.append(
        f"all {len(e)} runs: {np.hypot(e[:, 0], e[:, 1]).mean():.2f} mm and {np.abs(e[:, 2]).mean():.2f}° off on"
        f" average; starts off by {1000 * OFF[0]:g} mm and {np.degrees(OFF[1]):.1f}° (sd); {speed:.1f} times real time"
    )
    return "\n".join(lines)


def _row(start: str, what: str, e: Array) -> str:
    """Of errors in mm and degrees, shape (n, 3)."""
    cells = "".join(
        f"{f'{m:+.2f} ± {h:.2f}':>15}" for m, h in zip(e.mean(axis=0), half_widths(e), strict=True)
    )
    far, turn = np.hypot(e[:, 0], e[:, 1]), np.abs(e[:, 2])
    ends = f"{far.mean():>7.2f} mm{turn.mean():>8.2f}°{far.max():>6.2f} mm{turn.max():>8.2f}°"
    return f"{start:<18}{what:<34}{len(e):>5}{cells}{ends}"


def half_widths(values: Array) -> Array:
    """Half of the 95 % intervals (Student's t) of the means of columns; nan for a single row."""
    from scipy.stats import t

    n = len(values)
    if n < 2:
        return np.full(values.shape[1], np.nan)
    return np.asarray(t.ppf(0.975, n - 1) * values.std(axis=0, ddof=1) / np.sqrt(n))


def draw(figure: str, found: list[Case], path: Path) -> None:
    """As the paper draws them: for each start a panel, the object when each push begins, and its end in black."""
    from ..view.drawing import INK, PAGE, SOFT, Drawing, Look, Text, shortened
    from ..view.legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
    from ..view.panel import BOTTOM, LEFT, Panel
    from ..view.picture import check_ending, save_picture
    from ..view.table import MM, draw_object, outline_at

    check_ending(path)
    scene = found[0].plans[0].scene
    title = f"{scene.object.name}: {sum(len(case.ends) for case in found)} open-loop runs of two fingers ({figure})"
    subtitle = (
        "the object at the beginning of each push and at the end; lines: the way of its centre of friction"
    )
    most = max(len(way) for case in found for way in case.ways)
    entries = [
        Entry(
            f"push {k + 1} begins",
            Look(COLOURS[k % len(COLOURS)], 0.8, fill=COLOURS[k % len(COLOURS)]),
            "box",
        )
        for k in range(most)
    ]
    entries.append(Entry("end", Look(INK, 0.8, fill=INK), "box"))
    corners = [
        MM * np.concatenate([outline_at(scene, pose) for way in case.ways for part in way for pose in part])
        for case in found
    ]
    middles = [(points.min(axis=0) + points.max(axis=0)) / 2 for points in corners]
    half = np.max([np.ptp(points, axis=0) for points in corners], axis=0) / 2 + 4
    top, above, gap = title_height(title, subtitle), 24.0, 22.0
    width = (PAGE - 2 * EDGE - LEFT + gap) / len(found) - gap
    height = width * float(half[1] / half[0])
    below = top + above + height + BOTTOM
    page = Drawing(PAGE, below + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, below, PAGE - 2 * EDGE)
    for k, (start, case, middle) in enumerate(zip(STARTS[figure], found, middles, strict=False)):
        left, high = EDGE + LEFT + k * (width + gap), top + above
        box = (*(middle - half).tolist(), *(middle + half).tolist())
        panel = Panel(page, (left, high, left + width, high + height), box)
        panel.axes("x [mm]", "y [mm]" if k == 0 else "")
        name = f"start {', '.join(f'{v:g}' for v in start)}°: {len(case.ends)} runs"
        page.add(Text(left, high - 13, name, 7.5, INK, bold=True), 20)
        page.add(Text(left, high - 4, shortened(" – ".join(case.pushes), 7.0, width), 7.0, SOFT), 20)
        for way in case.ways:
            for number, part in enumerate(way):
                colour = COLOURS[number % len(COLOURS)]
                draw_object(panel, scene, part[0], Look(colour, 0.8, fill=colour, fill_opacity=0.12), 4)
                panel.line(MM * transform(part, scene.object.cof), Look(colour, 0.8), 6)
            draw_object(panel, scene, way[-1][-1], Look(INK, 0.6, fill=INK, fill_opacity=0.25), 5)
    save_picture(page, path)
