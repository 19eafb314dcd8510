"""Strategies of the search where nothing is in the way: the words of each push, and plans of many pushes refined."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiling import clock
from ..geometry.pose import Array
from ..problem import Scene
from ..steering.fleet import Fleet
from ..steering.three_twist import words
from .path import Path
from .query import Query

if TYPE_CHECKING:
    from .refine import Refined

ROUND = 3300  # of the scene's iterations, that a round of the refinement counts as
SEEDS = 4  # of the last paths to the goal, from which those within the tolerance start


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
    """Better and better paths of one or many pushes, within the scene's limits.

    They end at the goal. Where the tolerance is wide, one more follows, which ends within it as it costs least.
    """
    goal, planning, slack = np.nan_to_num(scene.goal_pose), scene.planning, scene.goal_slack
    from .refine import improvements

    query = Query(fleet, scene.start_pose, goal, free=scene.free_angle, robust=planning.robust)
    began = clock()
    rounds = max(1, planning.iterations // ROUND)
    seeds, late = [], False
    for done, refined in enumerate(improvements(query, seed=planning.seed)):
        late = done >= 1 and clock() - began > planning.time_limit
        yield _found(scene, fleet, refined, late and done < rounds)
        seeds.append((refined.pushes, refined.poses))
        if late or done >= rounds:
            break
    if not scene.wide_goal:
        return
    wide = replace(query, free=slack[2] >= np.pi, slack=slack)
    search = improvements(wide, seeds[-SEEDS:], seed=planning.seed)
    refined = list(islice(search, 1 if late else 2))[-1]
    yield _found(scene, fleet, refined, late)


def _found(scene: Scene, fleet: Fleet, refined: "Refined", stopped: bool) -> Found:
    pieces = [
        (int(push), "LSR".index(letter), float(amount))
        for push, word, amounts in zip(refined.pushes, refined.words, refined.amounts, strict=True)
        for letter, amount in zip(word, amounts, strict=True)
    ]
    details: dict[str, Any] = {
        "cost_before_refinement": refined.cost_before,
        "replanning_cost": refined.replanning_cost,
        "rounds": refined.rounds,
    }
    if stopped:
        details["stopped_by"] = "time_limit"
    cost = refined.replanning_cost if scene.planning.robust else refined.cost
    return Found(Path.of(fleet, np.array(scene.start_pose), pieces), cost, details)
