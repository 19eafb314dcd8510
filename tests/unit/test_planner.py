"""Plans of many pushes from many starts."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.conftest import final_error

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import pose_error
from flatpush.planning.assembly import assemble
from flatpush.planning.empty_table import direct_paths
from flatpush.planning.path import Path
from flatpush.simulation import certify

STARTS = [(0.06, 0.02, 2.6), (0.02, -0.03, 1.57), (-0.05, 0.04, -2.0)]


@pytest.fixture(scope="module")
def planner(rectangle):
    scene = fp.Scene(rectangle, STARTS[0], pusher=fp.Pusher(fingers=2, spacing=0.018))
    return fp.Planner(scene)


@pytest.mark.slow
def test_levels_never_get_worse(planner):
    for start in STARTS:
        found = planner.plan(start)
        assert found.scene.start == pytest.approx(start)
        assert found.cost <= found.run["single_cost"] * (1 + 1e-9)
        assert fp.verify(found).ok, fp.verify(found).failed
        distance, turn = final_error(fp.simulate(found), found.scene.goal)
        assert distance < 1e-8
        assert turn < 1e-8


def test_improving_gives_an_answer_at_once_and_then_better_ones(planner):
    costs = [answer.plan().cost for answer in planner.answers(STARTS[0])]
    assert len(costs) >= 2
    assert all(b < a for a, b in pairwise(costs))
    assert planner.plan(STARTS[0]).cost == costs[-1]


def test_a_batch_is_as_good_as_its_single_plans(planner):
    """One round each instead of three; the settings of the plans say so, and those of the planner stay."""
    batch = planner.plans(STARTS[:2])
    for found, start in zip(batch, STARTS[:2], strict=True):
        alone = planner.plan(start)
        assert found.cost == pytest.approx(alone.cost, rel=0.005)
        assert found.scene.planning.iterations == 3300
        assert found.run["rounds"] <= 1
        assert alone.scene.planning == planner.scene.planning
        assert fp.verify(found).ok


def test_robust_plans_cost_little_more_and_replan_cheaply(planner):
    robust = fp.Planner(replace(planner.scene, planning=replace(planner.scene.planning, robust=True)))
    for start in STARTS[:2]:
        nominal, careful = planner.plan(start), robust.plan(start)
        assert careful.run["replanning_cost"] <= nominal.run["replanning_cost"] * (1 + 1e-9)
        assert careful.cost <= 1.1 * nominal.cost


def test_every_refused_push_has_its_reason(triangle):
    pushes = tuple(fp.Push(f"off {k}", triangle.outline.at(2, x)) for k, x in enumerate((0.1, 0.95)))
    found = fp.plan(fp.Scene(triangle, STARTS[0], pushes=pushes))
    assert found.status == "no_plan"
    for push in pushes:
        assert f"{push.name}: the friction cone does not strictly contain" in found.reason


@pytest.mark.parametrize("fingers", [1, 2])
def test_a_push_that_follows_itself_does_not_let_go(rectangle, fingers):
    """Words of general cars may be cheaper in two legs of one push; there is no transit and no cost between them."""
    pusher = fp.Pusher(fingers=2, spacing=0.018) if fingers == 2 else fp.Pusher()
    scene = fp.Scene(rectangle, (0.0, -0.06, 0.2), pusher=pusher)
    planner = fp.Planner(scene)
    last, here, pieces = planner.fleet.size - 1, np.array(scene.start_pose), []
    for goal in ((0.002, -0.03, 0.1), (0.0, 0.0, 0.0)):
        words = direct_paths(planner.fleet, here, np.tile(goal, (planner.fleet.size, 1)))
        pieces += next(path.pieces for path in words if path.pushes == (last,))
        here = np.array(goal)
    path = Path.of(planner.fleet, scene.start_pose, pieces)
    segments = assemble(planner.scene, planner.transits, planner.usable, path)
    assert [segment.kind for segment in segments] == ["transit", "push", "transit"]
    assert pose_error(segments[1].object[-1], [0.0, 0.0, 0.0]) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    certificate = certify(planner.scene, segments)
    found = fp.Plan(
        "solved",
        planner.scene,
        certificate.cost,
        certificate.duration,
        segments,
        certificate,
    )
    assert fp.verify(found).ok, fp.verify(found).failed
    assert certificate.cost == pytest.approx(sum(arc.cost for push in found.pushes for arc in push.arcs))
    rollout = fp.simulate(found)
    assert rollout.outcome == "completed"
    distance, turn = final_error(rollout, scene.goal)
    assert distance < 5e-5
    assert turn < 1e-3


def test_lists_of_pushes_are_checked(triangle):
    push = fp.Push("below", triangle.outline.at(2, 0.6))
    with pytest.raises(InputError, match="at least one push"):
        fp.Scene(triangle, STARTS[0], pushes=())
    with pytest.raises(InputError, match="name of its own"):
        fp.Scene(triangle, STARTS[0], pushes=(push, push))


def test_automatic_pushes_are_sought_once_for_an_object(triangle):
    """What is asked for decides: other poses share them, another friction margin or cost does not."""
    scene = fp.Scene(triangle, STARTS[0])
    pushes = fp.Planner(scene).scene.pushes
    assert fp.Planner(replace(scene, start=STARTS[1])).scene.pushes is pushes
    for other in (fp.Planning(friction_margin=0.5), fp.Planning(cost="pusher")):
        assert fp.Planner(replace(scene, planning=other)).scene.pushes is not pushes
    twin = fp.Object(triangle.outline, "uniform", triangle.friction)
    again = fp.Planner(replace(scene, object=twin)).scene.pushes
    assert [p.at.along for p in again] == [p.at.along for p in pushes]


def test_no_automatic_push_at_all_is_no_plan_that_can_be_saved(triangle, tmp_path):
    slippery = fp.Object(triangle.outline, "uniform", friction=0.0)
    found = fp.plan(fp.Scene(slippery, STARTS[0], planning=fp.Planning(slides="never")))
    assert found.status == "no_plan"
    assert "without friction" in found.reason
    found.save(tmp_path / "plan.json")
    assert fp.load_plan(tmp_path / "plan.json").reason == found.reason
