"""Strategies of the search where nothing is in the way: the words of each push, and plans of many pushes refined."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..compiling import clock
from ..geometry.pose import Array
from ..problem import Scene
from ..steering.fleet import Fleet
from ..steering.three_twist import words
from .path import Path
from .query import Query

ROUND = 3300  # of the scene's iterations, that a round of the refinement counts as


@dataclass(frozen=True, eq=False)
class Found:
    """A path that a strategy found.

    Attributes:
        path: from the start to the goal; cost: that it is judged by, of replanning for robust plans.
        details: what the search tells about it, as in the plan's run entry.
    """

    path: Path
    cost: float
    details: dict[str, Any] = field(default_factory=dict)


def direct_paths(fleet: Fleet, start: Array, endpoints: Array) -> list[Path]:
    """All words of all pushes from the start to where each of them is to end, poses X_WO, cheapest first."""
    found = []
    for push in range(fleet.size):
        for word in words(fleet.left[push], fleet.right[push], fleet.direction[push], start, endpoints[push]):
            pieces = [
                (push, "LSR".index(x), float(p)) for x, p in zip(word.word, word.parameters, strict=True)
            ]
            found.append(Path.of(fleet, start, pieces))
    return sorted(found, key=lambda path: path.cost)


def refined_paths(scene: Scene, fleet: Fleet) -> Iterator[Found]:
    """Better and better paths of one or many pushes, within the scene's limits."""
    goal = np.nan_to_num(scene.goal_pose)
    from .refine import improvements

    planning = scene.planning
    search = improvements(
        Query(fleet, scene.start_pose, goal, free=scene.free_angle, robust=planning.robust),
        seed=planning.seed,
    )
    began = clock()
    rounds = max(1, planning.iterations // ROUND)
    for done, refined in enumerate(search):
        late = done >= 1 and clock() - began > planning.time_limit
        pieces = [
            (int(push), "LSR".index(letter), float(amount))
            for push, word, amounts in zip(refined.pushes, refined.words, refined.amounts, strict=True)
            for letter, amount in zip(word, amounts, strict=True)
        ]
        details: dict[str, Any] = {
            "cost_before_refinement": refined.cost_before,
            "replanning_cost": refined.replanning_cost,
            "rounds": done,
        }
        if late and done < rounds:
            details["stopped_by"] = "time_limit"
        cost = refined.replanning_cost if planning.robust else refined.cost
        yield Found(Path.of(fleet, np.array(scene.start_pose), pieces), cost, details)
        if late or done >= rounds:
            return
