"""[Zhou2017] Figs. 10 and 11: the triangle among obstacles, in the second maze of the authors' robot.

Once as they planned it (virtual middle contact, no margin, no clearance), and once as flatpush does by itself.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..geometry import Outline
from ..planning import plan
from ..problem import Object, Plan, Planning, Push, Pusher, Scene, Workspace
from ..simulation import study, verify
from .cone import STILL
from .finding import Finding, Row, drawn

TRIANGLE = ((0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095))
PLACES = {"long edge": (0.0, -0.0095), "short edge": (0.019667, 0.00475), "hypotenuse": (-0.00372, 0.0077)}
BOUNDS = (0.0, 0.0, 0.3235, 0.24975)
WALL = (
    (0.0, 0.24975), (0.2114, 0.24975), (0.2114, 0.0885), (0.169825, 0.0885),
    (0.169825, 0.2065), (0.041575, 0.2065), (0.041575, 0.0885), (0.0, 0.0885),
)  # fmt: skip
START, GOAL = (0.2845, 0.1904, -1.5707963267948966), (0.1057, 0.1577, -1.5707963267948966)
SWITCH = 0.2
STORED = 0.862  # cost of the authors' plan: 462 mm of path and two changes of push [m]
ITERATIONS, QUICK = 3000, 300


def scene(iterations: int = ITERATIONS) -> Scene:
    """The maze as flatpush plans it by default, with a clearance of 1 mm; iterations end the search."""
    thing = Object(TRIANGLE, "uniform", 0.45, name="triangle in a maze")
    pushes = tuple(Push(name, thing.outline.nearest(place), 2, 0.018) for name, place in PLACES.items())
    planning = Planning(switch_cost=SWITCH, clearance=0.001, iterations=iterations, time_limit=1e4)
    return Scene(
        thing, START, GOAL, Pusher(2, 0.018), pushes, Workspace(BOUNDS, (Outline.polygon(WALL),)), planning
    )


def as_the_paper(given: Scene) -> Scene:
    """The same with the paper's model of two fingers, and as near to everything as it went."""
    planning = replace(given.planning, two_finger="middle", model="local", friction_margin=0.0, clearance=0.0)
    return replace(given, planning=planning)


def find(quick: bool = False, data: Path | None = None) -> Finding:
    """Both plans; figures of ours, as in Fig. 10, and of its moments, as in Fig. 11."""
    ours = scene(QUICK if quick else ITERATIONS)
    found = {"as the paper plans": plan(as_the_paper(ours)), "as flatpush plans": plan(ours)}
    rows = [
        Row(
            f"Fig. 10, {name}: path of the flat point and {1000 * SWITCH:.0f} mm for each change of push",
            f"{1000 * STORED:.0f} mm (stored plan, true length)",
            _words(one),
            why,
        )
        for (name, one), why in zip(
            found.items(),
            (
                "The same problem: the authors stop at the first path, and their search had few parents to grow from.",
                "Here fingers and object keep 1 mm from every wall and 20 % of friction in reserve, and two fingers"
                " turn tighter than a contact in their middle.",
            ),
            strict=True,
        )
    ]
    return Finding(tuple(rows), drawn(lambda folder: _draw(found["as flatpush plans"], folder)))


def run(folder: Path | None = None) -> str:
    """The rows; with a folder, also fig10.svg and fig11.svg."""
    return find().saved(folder)


def _words(found: Plan) -> str:
    if found.status != "solved":
        return f"no plan: {found.reason}"
    pushes = " – ".join(push.push for push in found.pushes)
    held = "verified" if verify(found).ok else "fails verification"
    ended = study(found, 1, noise=STILL)
    off = ended.errors[0]
    return (
        f"{1000 * found.cost:.0f} mm: {pushes}; {held}; simulated: {ended.outcomes[0]},"
        f" {1000 * off[0]:.2f} mm {np.degrees(off[1]):.2f}° off"
    )


def _draw(found: Plan, folder: Path) -> None:
    from ..view import save_figure, save_snapshots

    if found.status == "solved":
        save_figure(found, folder / "fig10.svg")
        save_snapshots(found, folder / "fig11.svg")
