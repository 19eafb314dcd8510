"""The first path among six boxes with one push, next to OMPL's RRT: pytest benchmarks/test_obstacles.py -n 0 -s.

OMPL grows its RRT in its Dubins space of the push's flat point, and asks the same compiled clearance test through a
Python callback. Nothing is asserted about time.
"""

import math
import time

import numpy as np
import pytest

from flatpush.geometry import Outline, compose, inverse
from flatpush.geometry.collision import Body, World
from flatpush.planning.obstacles import Search, Task
from flatpush.steering.fleet import Fleet

RADIUS, MIDDLE, AHEAD = 0.0473, np.array([-0.0208, 0.0220]), np.deg2rad(192.1)
CORNERS = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
BOUNDS = (0.0, 0.0, 0.9, 0.6)
BOXES = ((0.2, 0.05, 0.28, 0.25), (0.2, 0.4, 0.28, 0.52), (0.42, 0.2, 0.5, 0.4), (0.62, 0.05, 0.7, 0.2),
         (0.62, 0.36, 0.7, 0.55), (0.38, 0.5, 0.46, 0.56))  # fmt: skip
START, GOAL, SEEDS = np.array([0.1, 0.3, -1.5]), np.array([0.8, 0.3, 2.0]), 11


def task() -> Task:
    ahead = np.array([np.cos(AHEAD), np.sin(AHEAD)])
    left = np.array([-ahead[1], ahead[0]])
    free = np.full((1, 3), np.inf)
    fleet = Fleet(
        (MIDDLE + RADIUS * left)[None], (MIDDLE - RADIUS * left)[None], ahead[None],
        np.array([[RADIUS, 1.0, RADIUS]]), free, free, np.zeros((1, 1)),
    )  # fmt: skip
    body = Body.of(Outline.polygon(CORNERS), [(0.022167, 0.01375), (0.022167, -0.00425)], 0.0025)
    boxes = [np.array([(a, b), (c, b), (c, d), (a, d)]) for a, b, c, d in BOXES]
    return Task(fleet, World.of(BOUNDS, boxes), [body], np.array([[0.002, 0.0]]), START, GOAL, 0.0)


def test_first_path_next_to_ompl():
    ob, og = pytest.importorskip("ompl.base"), pytest.importorskip("ompl.geometric")
    from ompl import util

    from flatpush.geometry.collision.kernels import pose_gap

    util.setLogLevel(util.LOG_NONE)
    asked = task()
    frame = np.array([*MIDDLE, AHEAD])
    (bx, by, turn), pose, checked = (
        inverse(frame).tolist(),
        np.empty(3),
        (asked.world.arrays, *asked.bodies[0].arrays),
    )
    count, spent = [0], [0.0]

    def valid(state):
        began = time.perf_counter()
        x, y, angle = state.getX(), state.getY(), state.getYaw()
        c, s = math.cos(angle), math.sin(angle)
        pose[:] = x + c * bx - s * by, y + s * bx + c * by, angle + turn
        good = pose_gap(*checked, pose, 0.0, 0.0) >= 0.0
        count[0] += 1
        spent[0] += time.perf_counter() - began
        return bool(good)

    def theirs(seed):
        util.RNG.setSeed(seed + 1)
        space = ob.DubinsStateSpace(RADIUS)
        box = ob.RealVectorBounds(2)
        for axis in range(2):
            box.setLow(axis, BOUNDS[axis] - 0.1)
            box.setHigh(axis, BOUNDS[axis + 2] + 0.1)
        space.setBounds(box)
        setup = og.SimpleSetup(space)
        setup.setStateValidityChecker(valid)
        ends = []
        for pose in (START, GOAL):
            x, y, angle = compose(pose, frame)
            state = space.allocState()
            state.setX(float(x))
            state.setY(float(y))
            state.setYaw(float(np.remainder(angle + np.pi, 2 * np.pi) - np.pi))
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(og.RRT(setup.getSpaceInformation()))
        setup.getSpaceInformation().setStateValidityCheckingResolution(0.002)
        began = time.perf_counter()
        setup.solve(2.0)
        return time.perf_counter() - began if setup.haveExactSolutionPath() else np.inf

    def ours(seed):
        search, began = Search(asked, seed), time.perf_counter()
        next(way for way in search.rounds() if way is not None)
        return time.perf_counter() - began

    Search(asked, 0).prepare()
    ours(0)
    a = np.array([ours(seed) for seed in range(SEEDS)])
    b = np.array([theirs(seed) for seed in range(SEEDS)])
    print(
        f"\nours {1e3 * np.median(a):.2f} ms, OMPL {1e3 * np.median(b):.1f} ms to the first path in the median,"
    )
    print(
        f"{np.median(b) / np.median(a):.0f} times; OMPL's callback {1e6 * spent[0] / count[0]:.1f} µs a pose"
    )
    assert np.all(np.isfinite(a))
