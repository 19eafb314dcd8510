"""Open loop against feedback: the same single-finger tasks of `feedback`, on the same tables other than believed.

The open loop runs the plan as it stands, in the simulator; the loops see the object with the study's camera.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..planning import Planner
from ..simulation.rollout import roll
from .feedback import WITHIN, Task, attempt, task
from .finding import Finding, Row

TASKS, QUICK = 40, 2
LAWS = {"path law": "path", "feedback linearisation": "dfl", "receding horizon": "horizon"}


def open_loop(given: Task) -> tuple[float, float] | None:
    """Distance [m] and angle [rad] off the goal when the plan is run blindly; None without a plan."""
    plan = Planner(given.scene).plan()
    if plan.status != "solved":
        return None
    rolled = roll(plan, [replace(given.scene, object=given.truth)], "exact", "arcs")
    off = given.scene.goal_error(rolled.final[0])
    return float(np.hypot(*off[:2])), abs(float(off[2]))


def tasks(count: int) -> list[Task]:
    """The first tasks of the study that can be steered on their true table and planned on the believed one."""
    found: list[Task] = []
    number = 0
    while len(found) < count:
        given = task(number)
        number += 1
        if given.steerable:
            found.append(given)
    return found


def find(quick: bool = False, data: Path | None = None) -> Finding:
    """A row for the open loop and one for each law."""
    given = tasks(QUICK if quick else TASKS)
    ends: dict[str, list[tuple[float, float]]] = {}
    for one in given:
        off = open_loop(one)
        if off is None:
            continue
        ends.setdefault("open loop", []).append(off)
        for name, law in LAWS.items():
            ended, _ = attempt(one, law)  # type: ignore[arg-type]
            ends.setdefault(name, []).append((ended.distance, ended.angle))
    why = {
        "open loop": "One finger amplifies every error; the paper therefore pushes with two.",
        "path law": "It keeps the path as long as the finger sticks where it landed.",
        "feedback linearisation": "The paper's law, with the same limits; it needs a contact that sticks.",
        "receding horizon": "It sees slip and lands again where it must: the paper's future work.",
    }
    rows = []
    for name, found in ends.items():
        errors = np.array(found)
        good = int(np.sum((errors[:, 0] <= WITHIN[0]) & (errors[:, 1] <= WITHIN[1])))
        median = np.median(errors, axis=0)
        rows.append(
            Row(
                f"{name}: ends within 2 mm and 2° of the goal, random tasks up to 300 mm away",
                "",
                f"{good} of {len(errors)}; median {1000 * median[0]:.2f} mm {np.degrees(median[1]):.2f}°",
                why[name],
            )
        )
    return Finding(tuple(rows))


def run(folder: Path | None = None) -> str:
    """The rows; there is no figure."""
    return find().saved(folder)
