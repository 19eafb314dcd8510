"""[Zhou2017] Figs. 6-9 as planned, and as simulated with random friction and starts beside the nominal ones.

The plans begin at the three nominal starts of each figure and end at the goal, by the pushes of the paper's objects.
The physics cell (fig6 to fig9) runs them on a simulated robot; here the contact simulator does, many times.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..planning import plan
from ..problem import Object, Plan, Planning, Push, Pusher, Scene
from ..simulation import Noise, Runs, study
from .feedback import objects
from .finding import Finding, Row, drawn
from .robot_runs import OFF, PRINTED, STARTS, SWITCH

RUNS, QUICK, SEED = 60, 20, 0  # of each start; a run that the compiled plant leaves undecided takes minutes
# Friction is anything between these shares of what the plan assumes. Plans hold from 0.8 of it on.
FRICTION = (0.8, 2.0)


@dataclass(frozen=True, eq=False)
class Case:
    """One start of one figure: its plan, and the disturbed runs of it."""

    figure: str
    start: tuple[float, float, float]
    printed: tuple[tuple[float, float], ...]
    plan: Plan
    runs: Runs


def scene(figure: str, start: tuple[float, float, float]) -> Scene:
    """A start (mm, mm, °) of a figure; two fingers, all sides of its object."""
    thing, places = objects()[list(STARTS).index(figure)]
    pushes = tuple(Push(name, thing.outline.nearest(place), 2, 0.018) for name, place in places.items())
    pose = (start[0] / 1000, start[1] / 1000, float(np.deg2rad(start[2])))
    planning = Planning(switch_cost=SWITCH[figure])
    return Scene(thing, pose, pusher=Pusher(2, 0.018), pushes=pushes, planning=planning)


def noise(thing: Object) -> Noise:
    """Starts off as the recorded ones were, and any friction within FRICTION of the object's."""
    low, high = (share * thing.friction for share in FRICTION)
    return Noise(position=OFF[0], angle=OFF[1], friction_range=(low, high))


def cases(runs: int = RUNS, seed: int = SEED, record: bool = False) -> Iterator[Case]:
    """Every start of every figure, in the order of the paper."""
    for figure, starts in STARTS.items():
        for start, printed in zip(starts, PRINTED[figure], strict=True):
            found = plan(scene(figure, start))
            rolled = study(found, runs, seed, noise=noise(found.scene.object), record=record)
            yield Case(figure, start, printed, found, rolled)


def find(quick: bool = False, data: Path | None = None) -> Finding:
    """Rows of all twelve starts, and a figure of the plan and of the runs of the first start of each figure."""
    found = list(cases(QUICK if quick else RUNS, record=True))
    return Finding(tuple(map(_row, found)), drawn(lambda folder: _draw(found, folder)))


def run(folder: Path | None = None) -> str:
    """The rows; with a folder, also the figures."""
    return find().saved(folder)


def _row(case: Case) -> Row:
    (x, _), (y, _), (turn, _) = case.printed
    off = np.median(case.runs.errors, axis=0)
    far = np.quantile(case.runs.errors, 0.95, axis=0)
    pushes = " – ".join(push.push for push in case.plan.pushes)
    nominal = case.plan.certificate
    assert nominal is not None
    return Row(
        f"Fig. {case.figure[3:]}, start ({', '.join(f'{v:g}' for v in case.start)}°): end off the goal",
        f"robot, mean of five: ({x:g}, {y:g}) mm, {turn:g}°",
        f"{pushes}, {1000 * case.plan.cost:.0f} mm; {len(case.runs)} runs: median {1000 * off[0]:.2f} mm"
        f" {np.degrees(off[1]):.2f}°, 95 % within {1000 * far[0]:.2f} mm {np.degrees(far[1]):.2f}°;"
        f" both fingers stuck in {100 * case.runs.sticking_share:.0f} %",
        "Other sequences than the paper's, because each push may use the whole cone of both fingers; a simulator has"
        " no error of a camera, which makes most of the paper's (see the recorded runs).",
    )


def _draw(found: list[Case], folder: Path) -> None:
    from ..view import save_figure
    from ..view.tube import tube_figure

    for case in found:
        number = STARTS[case.figure].index(case.start)
        save_figure(case.plan, folder / f"{case.figure}_{number + 1}_plan.svg")
        if number == 1:
            tube_figure(case.runs, folder / f"{case.figure}_{number + 1}_runs.svg")
