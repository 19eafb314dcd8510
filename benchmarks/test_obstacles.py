"""The first path of one push next to OMPL's RRT: pytest benchmarks/test_obstacles.py -n 0 -s.

OMPL grows its RRT in its Dubins space of the push's flat point, and asks the same compiled clearance test through a
Python callback, at poses 1 mm apart along every edge; ours decides between them too. Scenes: among boxes, from place
to place; in the robot-executed mazes (FLATPUSH_DATA) likewise; carved at random along a path of one push. Where one of
the two finds nothing within its limit, its time counts as the limit; where both find nothing, there may be no path, and
the pair is left out. Medians are over scenes and seeds. Nothing is asserted about time.
"""

import math
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))
from tests.maze import MAZE_A, MAZE_B, stored_query

from flatpush.geometry import Outline, compose, inverse
from flatpush.geometry.collision import Body, World
from flatpush.planning.obstacles import Search
from flatpush.planning.query import Query
from flatpush.steering.fleet import Fleet

RADIUS, MIDDLE, AHEAD = 0.0473, np.array([-0.0208, 0.0220]), np.deg2rad(192.1)
CORNERS = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
BOUNDS = (0.0, 0.0, 0.9, 0.6)
BOXES = ((0.2, 0.05, 0.28, 0.25), (0.2, 0.4, 0.28, 0.52), (0.42, 0.2, 0.5, 0.4), (0.62, 0.05, 0.7, 0.2),
         (0.62, 0.36, 0.7, 0.55), (0.38, 0.5, 0.46, 0.56))  # fmt: skip
START, GOAL = np.array([0.1, 0.3, -1.5]), np.array([0.8, 0.3, 2.0])
SEEDS, LIMIT, SPACING = 5, 2.0, 1e-3


def boxes() -> Query:
    ahead = np.array([np.cos(AHEAD), np.sin(AHEAD)])
    left = np.array([-ahead[1], ahead[0]])
    free = np.full((1, 3), np.inf)
    fleet = Fleet(
        (MIDDLE + RADIUS * left)[None], (MIDDLE - RADIUS * left)[None], ahead[None],
        np.array([[RADIUS, 1.0, RADIUS]]), free, free, np.zeros((1, 1)),
    )  # fmt: skip
    body = Body.of(Outline.polygon(CORNERS), [(0.022167, 0.01375), (0.022167, -0.00425)], 0.0025)
    solids = [np.array([(a, b), (c, b), (c, d), (a, d)]) for a, b, c, d in BOXES]
    return Query(fleet, START, GOAL, World.of(BOUNDS, solids), [body], np.array([[0.002, 0.0]]))


def drawn(asked: Query, seed: int) -> Query:
    """The same with a start and a goal drawn where the push can begin and end, a third of the box apart at least."""
    rng = np.random.default_rng(seed)
    box = asked.extent
    low, high = np.array([*box[:2], -np.pi]), np.array([*box[2:], np.pi])
    while True:
        start, goal = rng.uniform(low, high), rng.uniform(low, high)
        other = replace(asked, start=start, goal=goal)
        if (
            np.hypot(*(goal - start)[:2]) > min(box.xmax - box.xmin, box.ymax - box.ymin) / 3
            and other.first
            and other.last
        ):
            return other


def only(asked: Query, push: int) -> Query:
    """The same with one push."""
    fleet, one = asked.fleet, slice(push, push + 1)
    fleet = replace(
        fleet,
        **{
            key: getattr(fleet, key)[one]
            for key in ("left", "right", "direction", "rates", "speeds", "accelerations")
        },
        switching=np.zeros((1, 1)),
    )
    return replace(asked, fleet=fleet, bodies=[asked.bodies[push]], backs=asked.backs[one])


def scenes() -> dict[str, list[Query]]:
    found = {"boxes": [boxes(), *(drawn(boxes(), k) for k in range(7))]}
    data = os.environ.get("FLATPUSH_DATA")
    if data:
        mazes = [stored_query(Path(data), name, need=1.5e-5) for name in (MAZE_A, MAZE_B)]
        found["mazes"] = [drawn(only(mazes[k % 2], 1), k) for k in range(8)]
    from carved import carved_query

    found["carved"] = [carved_query(k) for k in range(8)]
    return found


def ours(asked: Query, seed: int) -> float:
    search, began = Search(asked, seed), time.perf_counter()
    for way in search.rounds():
        spent = time.perf_counter() - began
        if way is not None:
            return spent
        if spent > LIMIT:
            break
    return np.inf


class Ompl:
    """RRT of one push's flat point in a Dubins space; counts the poses that it asks about."""

    def __init__(self, asked: Query, spacing: float) -> None:
        from ompl import base, geometric

        from flatpush.geometry.collision.kernels import pose_gap

        fleet = asked.fleet
        middle = 0.5 * (fleet.left[0] + fleet.right[0])
        self.frame = np.array([*middle, np.arctan2(*fleet.direction[0][::-1])])
        back = inverse(self.frame).tolist()
        pose = np.empty(3)
        checked = asked.world.arrays, asked.bodies[0].arrays
        need = asked.clearance
        self.count, self.spent = 0, 0.0

        def valid(state):
            began = time.perf_counter()
            x, y, angle = state.getX(), state.getY(), state.getYaw()
            c, s = math.cos(angle), math.sin(angle)
            pose[:] = x + c * back[0] - s * back[1], y + s * back[0] + c * back[1], angle + back[2]
            good = pose_gap(*checked, pose, need, need) >= need
            self.count += 1
            self.spent += time.perf_counter() - began
            return bool(good)

        self.space = base.DubinsStateSpace(float(fleet.radius[0]))
        reach = float(np.hypot(*middle))
        box = base.RealVectorBounds(2)
        for axis in range(2):
            box.setLow(axis, float(asked.extent[axis]) - reach)
            box.setHigh(axis, float(asked.extent[axis + 2]) + reach)
        self.space.setBounds(box)
        self.setup = geometric.SimpleSetup(self.space)
        self.setup.setStateValidityChecker(valid)
        self.setup.setStartAndGoalStates(self._state(asked.start), self._state(asked.goal))
        information = self.setup.getSpaceInformation()
        information.setStateValidityCheckingResolution(spacing / self.space.getMaximumExtent())
        self.setup.setPlanner(geometric.RRT(information))
        self.setup.setup()

    def _state(self, pose):
        x, y, angle = compose(pose, self.frame)
        state = self.space.allocState()
        state.setX(float(x))
        state.setY(float(y))
        state.setYaw(float(np.remainder(angle + np.pi, 2 * np.pi) - np.pi))
        return state

    def first(self) -> float:
        began = time.perf_counter()
        self.setup.solve(LIMIT)
        return time.perf_counter() - began if self.setup.haveExactSolutionPath() else np.inf


def test_first_path_next_to_ompl():
    pytest.importorskip("ompl.base")
    from ompl import util

    util.setLogLevel(util.LOG_NONE)
    every = scenes()
    ours(boxes(), 0)
    a_all, b_all, count, spent = [], [], 0, 0.0
    print()
    for name, tasks in every.items():
        a, b = [], []
        for asked in tasks:
            for seed in range(SEEDS):
                # Nothing of one run serves the next, but the arrays, as OMPL's set-up is not timed either.
                afresh = replace(asked)
                afresh.arrays  # noqa: B018
                a.append(ours(afresh, seed))
                util.RNG.setSeed(seed + 1)
                theirs = Ompl(asked, SPACING)
                b.append(theirs.first())
                count, spent = count + theirs.count, spent + theirs.spent
        a_all += a
        b_all += b
        print(_line(name, np.array(a), np.array(b)))
    print(_line("all", np.array(a_all), np.array(b_all)))
    print(f"OMPL's callback {1e6 * spent / count:.1f} µs a pose")
    assert np.isfinite(np.median(a_all))


def _line(name, a, b):
    solved = f"solved {np.sum(np.isfinite(a))} and {np.sum(np.isfinite(b))} of {len(a)}"
    either = np.isfinite(a) | np.isfinite(b)
    a, b = np.minimum(a, LIMIT)[either], np.minimum(b, LIMIT)[either]
    return (
        f"{name}: ours {1e3 * np.median(a):.2f} ms, OMPL {1e3 * np.median(b):.1f} ms to the first path in the median,"
        f" {np.median(b) / np.median(a):.0f} times; pair by pair {np.median(b / a):.0f} times; {solved}"
    )
