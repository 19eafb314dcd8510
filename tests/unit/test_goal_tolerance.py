"""A goal that is met within a wide tolerance need not be met exactly: where plans then end, and what that saves."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import flatpush as fp
from flatpush.planning.empty_table import direct_paths, refined_paths
from flatpush.problem import Planning
from flatpush.problem.scene import GOAL_TOLERANCE

EXAMPLES = Path(__file__).parents[2] / "examples"
WIDE = (0.003, 0.002, np.deg2rad(4.0))
SLACK = np.subtract(WIDE, GOAL_TOLERANCE)


def _with(scene: fp.Scene, tolerance: tuple[float, float, float]) -> fp.Scene:
    return replace(scene, planning=replace(scene.planning, goal_tolerance=tolerance))


@pytest.fixture(scope="module")
def triangle() -> fp.Planner:
    return fp.Planner(fp.load_scene(EXAMPLES / "triangle.yaml"))


def test_the_default_is_left_for_the_execution():
    scene = fp.load_scene(EXAMPLES / "triangle.yaml")
    assert scene.goal_slack.tolist() == [0, 0, 0]
    assert _with(scene, (1e-4, 1e-4, 1e-3)).goal_slack.tolist() == [0, 0, 0]
    np.testing.assert_allclose(_with(scene, WIDE).goal_slack, [0.0025, 0.0015, np.deg2rad(3.5)])
    assert _with(scene, (0.001, 0.001, np.pi)).goal_slack[2] == np.pi
    assert replace(scene, goal=(0, 0, "free")).goal_slack[2] == np.pi


def test_a_narrow_tolerance_changes_nothing(triangle):
    exact = triangle.plan()
    narrow = fp.plan(_with(triangle.scene, (1e-5, 1e-5, 1e-5)))
    assert (narrow.cost, len(narrow.segments)) == (exact.cost, len(exact.segments))
    for a, b in zip(narrow.segments, exact.segments, strict=True):
        np.testing.assert_array_equal(a.pusher, b.pusher)
    assert np.abs(exact.certificate.goal_error).max() < 1e-9


def test_one_push_ends_where_no_other_place_is_cheaper():
    """Against every one of 9 × 9 × 9 ends within the slack."""
    thing = fp.Object([(0.03, -0.01), (0.03, 0.02), (-0.02, 0.02), (-0.03, -0.01)], friction=0.3)
    push = fp.Push("below", thing.outline.nearest([0.0, -0.01]), 2, 0.012)
    pusher = fp.Pusher(fingers=2, spacing=0.012)
    scene = fp.Scene(
        thing, (0.05, 0.02, 2.0), (0, 0, 0), pusher, (push,), planning=Planning(goal_tolerance=WIDE)
    )
    planner = fp.Planner(scene)
    *_, last = planner.answers()
    shares = np.linspace(-1, 1, 9)
    ends = [SLACK * offset for offset in product(shares, shares, shares)]
    costs = [direct_paths(planner.fleet, scene.start_pose, np.array([end]))[0].cost for end in ends]
    exact = costs[len(costs) // 2]
    assert last.cost <= min(costs) + 1e-9
    assert exact - last.cost > 0.0015  # the slack is 2.5 mm by 1.5 mm
    plan = last.plan()
    assert fp.verify(plan).ok
    assert np.all(np.abs(plan.certificate.goal_error) <= SLACK + 1e-12)
    reached = fp.simulate(plan).final_pose
    assert np.all(np.abs(reached) <= WIDE)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["triangle", "rectangle_boundary"])
def test_many_pushes_end_as_cheap_as_at_the_best_corner(name):
    """Against a whole search to every corner of the box and to its middle."""
    planner = fp.Planner(fp.load_scene(EXAMPLES / f"{name}.yaml"))
    scene = _with(planner.scene, WIDE)

    def cost(asked: fp.Scene) -> float:
        return list(refined_paths(asked, planner.fleet))[-1].cost

    goals = [np.asarray(scene.goal) + SLACK * offset for offset in product((-1, 1), repeat=3)]
    corners = [cost(replace(planner.scene, goal=tuple(goal))) for goal in goals]
    plan = fp.plan(scene)
    assert plan.cost <= min(corners) * (1 + 1e-6)
    assert plan.cost < 0.99 * cost(planner.scene)
    assert fp.verify(plan).ok


def test_a_free_angle_and_a_wide_place_go_together(triangle):
    scene = replace(_with(triangle.scene, (0.004, 0.004, 1.0)), goal=(0, 0, "free"))
    free = fp.plan(replace(scene, planning=triangle.scene.planning))
    wide = fp.plan(scene)
    assert wide.cost < free.cost - 0.002
    assert np.abs(wide.certificate.goal_error[:2]).max() == pytest.approx(0.0035, abs=1e-9)
    assert fp.verify(wide).ok


@pytest.mark.slow
def test_among_obstacles_the_end_moves_within_the_tolerance():
    """The maze in one round: the wide plan is cheaper, ends in the box, and its clearance holds."""
    scene = fp.load_scene(EXAMPLES / "maze_first.yaml")
    scene = replace(scene, planning=replace(scene.planning, iterations=400, time_limit=60.0))
    exact, wide = fp.plan(scene), fp.plan(_with(scene, (0.01, 0.01, 0.3)))
    assert np.abs(exact.certificate.goal_error).max() < 1e-9
    assert wide.cost < exact.cost - 0.003
    error = np.abs(wide.certificate.goal_error)
    assert 0.001 < error[:2].max() <= 0.0095 + 1e-9
    assert fp.verify(wide).ok
