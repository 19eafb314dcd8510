"""The paper's robot experiment in the physics cell: [Zhou2017] Figs. 6-9, four objects, three starts, five runs each.

Two fingers, open loop. Every run begins beside its nominal start as the recorded ones did: their offsets have the
standard deviations OFF. A push of two fingers takes out errors of the angle and across the fingers, not along them. So
the last push goes straight to the goal, where late contact costs nothing, and what comes before it pushes sides at
right angles to that one. Support and outline are as stated for the paper's objects; the feet of Fig. 6 are not known.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from ..errors import InputError
from ..execution import DONE
from ..execution import run as run_on
from ..execution.cell.robot import CellRobot
from ..execution.simulated import Unknown
from ..geometry import pose_error
from ..geometry.pose import Array
from ..planning import plan
from ..planning.options import push_option
from ..problem import Plan, Planning, Push, Pusher, Scene
from .feedback import objects

# Standard deviations of the start in 41 recorded runs, over both axes [m], and of its angle [rad].
OFF = (0.001, float(np.deg2rad(1.2)))
RUNS, SEED = 5, 0
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
SWITCH = {"fig6": 0.03, "fig7": 0.03, "fig8": 0.05, "fig9": 0.01}
COLOURS = ("#cc3311", "#882255", "#4477aa")  # the starts, as in the paper: red, purple, blue


@dataclass(frozen=True, eq=False)
class Case:
    """The runs from one start.

    Attributes:
        plans: what they run, one after the other. starts, ends: X_WO, shape (n, 3). outcomes: of each run.
        seconds: of simulated time, and cpu: of the machine, for all runs [s].
    """

    plans: tuple[Plan, Plan]
    starts: Array
    ends: Array
    outcomes: tuple[str, ...]
    seconds: float
    cpu: float

    @property
    def errors(self) -> Array:
        """Off the goal (x, y, θ), shape (n, 3) [m, rad]."""
        return np.array([pose_error(end, GOAL) for end in self.ends])

    @property
    def pushes(self) -> list[str]:
        return [push.push for one in self.plans for push in one.pushes]


def plans(figure: str, start: tuple[float, float, float]) -> tuple[Plan, Plan]:
    """The two cheapest plans: to before the goal, and straight to it by another side.

    Raises:
        InputError: if there are none.
    """
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
    if not found:
        raise InputError(f"no plan for {figure} from {start}")
    return min(found, key=lambda both: both[0].cost + both[1].cost)


def cases(figure: str, runs: int = RUNS, seed: int = SEED) -> Iterator[Case]:
    """The runs of a figure, one case for each start."""
    for number, start in enumerate(STARTS[figure]):
        both = plans(figure, start)
        starts, ends, outcomes, seconds, begun = [], [], [], 0.0, process_time()
        for k in range(runs):
            drawn = np.random.SeedSequence([seed, list(STARTS).index(figure), number, k]).generate_state(1)[0]
            with CellRobot(both[0], Unknown(noise=OFF, seed=int(drawn))) as robot:
                starts.append(robot.object)
                done = [run_on(one, robot) for one in both]
                ends.append(robot.object)
                outcomes.append(next((one.outcome for one in done if one.outcome != DONE), DONE))
                seconds += robot.clock.now()
        yield Case(both, np.array(starts), np.array(ends), tuple(outcomes), seconds, process_time() - begun)


def run(
    folder: Path | None = None, figure: str = "fig6", runs: int | None = None, seed: int | None = None
) -> str:
    """The table, and with a folder a figure in it."""
    found = list(cases(figure, runs or RUNS, SEED if seed is None else seed))
    if folder is not None:
        draw(figure, found, folder / f"{figure}.svg")
    return table(figure, found)


def table(figure: str, found: list[Case]) -> str:
    """Signed means with 95 % intervals as the paper prints them, and mean distance and angle off the goal."""
    name = found[0].plans[0].scene.object.name
    lines = [
        f"{figure}: {name}, two fingers open loop in the physics cell; x, y [mm], θ [°]: mean ± 95 % interval.",
        f"{'start':<18}{'pushes':<34}{'runs':>5}{'x':>15}{'y':>15}{'θ':>15}{'off':>10}{'':>9}{'worst':>9}{'':>9}",
    ]
    for start, case in zip(STARTS[figure], found, strict=False):
        e = case.errors * [1000, 1000, 180 / np.pi]
        cells = [f"{m:+.2f} ± {h:.2f}" for m, h in zip(e.mean(axis=0), half_widths(e), strict=True)]
        far, turn = np.hypot(e[:, 0], e[:, 1]), np.abs(e[:, 2])
        lines.append(
            f"{', '.join(f'{v:g}' for v in start):<18}{' - '.join(case.pushes):<34}{len(e):>5}"
            f"{cells[0]:>15}{cells[1]:>15}{cells[2]:>15}"
            f"{far.mean():>7.2f} mm{turn.mean():>8.2f}°{far.max():>6.2f} mm{turn.max():>8.2f}°"
        )
        stopped = [outcome for outcome in case.outcomes if outcome != DONE]
        lines += [f"  ended: {outcome}" for outcome in stopped]
    e = np.concatenate([case.errors for case in found]) * [1000, 1000, 180 / np.pi]
    speed = sum(case.seconds for case in found) / sum(case.cpu for case in found)
    lines.append(
        f"all {len(e)} runs: {np.hypot(e[:, 0], e[:, 1]).mean():.2f} mm and {np.abs(e[:, 2]).mean():.2f}° off on"
        f" average; starts off by {1000 * OFF[0]:g} mm and {np.degrees(OFF[1]):.1f}° (sd); {speed:.1f} times real time"
    )
    return "\n".join(lines)


def half_widths(values: Array) -> Array:
    """Half of the 95 % intervals (Student's t) of the means of columns; nan for a single row."""
    from scipy.stats import t

    n = len(values)
    if n < 2:
        return np.full(values.shape[1], np.nan)
    return np.asarray(t.ppf(0.975, n - 1) * values.std(axis=0, ddof=1) / np.sqrt(n))


def draw(figure: str, found: list[Case], path: Path) -> None:
    """Initial poses in the colours of the paper and final ones in black."""
    from ..view.drawing import INK, PAGE, Drawing, Look
    from ..view.legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
    from ..view.panel import BOTTOM, LEFT, Panel
    from ..view.picture import check_ending, save_picture
    from ..view.table import MM, draw_object, outline_at

    check_ending(path)
    scene = found[0].plans[0].scene
    title = f"{scene.object.name}: {sum(len(case.ends) for case in found)} open-loop runs of two fingers ({figure})"
    corners = np.concatenate(
        [MM * outline_at(scene, pose) for case in found for pose in (*case.starts, *case.ends)]
    )
    low, high = corners.min(axis=0) - 5, corners.max(axis=0) + 5
    entries = [
        *(
            Entry(f"start {', '.join(f'{v:g}' for v in start)}", Look(colour, 1.2))
            for start, colour, _ in zip(STARTS[figure], COLOURS, found, strict=False)
        ),
        Entry("final", Look(INK, 1.0)),
    ]
    top, wide = title_height(title, "") + 6, PAGE - 2 * EDGE - LEFT
    height = float(np.clip(wide * (high[1] - low[1]) / (high[0] - low[0]), 180.0, 360.0))
    below = top + height + BOTTOM
    page = Drawing(PAGE, below + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, "")
    frame = (EDGE + LEFT, top, PAGE - EDGE, top + height)
    panel = Panel(page, frame, (float(low[0]), float(low[1]), float(high[0]), float(high[1])))
    panel.axes()
    for case, colour in zip(found, COLOURS, strict=False):
        for begin, end in zip(case.starts, case.ends, strict=True):
            draw_object(panel, scene, begin, Look(colour, 0.8), 4)
            draw_object(panel, scene, end, Look(INK, 0.6), 5)
    draw_legend(page, entries, EDGE, below, PAGE - 2 * EDGE)
    save_picture(page, path)
