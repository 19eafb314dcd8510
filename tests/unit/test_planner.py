"""Plans of many pushes from many starts."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.conftest import final_error

import flatpush as fp
from flatpush.errors import InputError
from flatpush.planning.assembly import Leg, assemble, costs, words_of
from flatpush.simulation import certify

STARTS = [(0.06, 0.02, 2.6), (0.02, -0.03, 1.57), (-0.05, 0.04, -2.0)]


@pytest.fixture(scope="module")
def planner(rectangle):
    scene = fp.Scene(rectangle, STARTS[0], pusher=fp.Pusher(fingers=2, spacing=0.018))
    return fp.Planner(scene)


def test_levels_never_get_worse(planner):
    for start in STARTS:
        found = planner.plan(start)
        assert found.scene.start == pytest.approx(start)
        assert found.cost <= found.run["graph_cost"] * (1 + 1e-9)
        assert found.run["graph_cost"] <= found.run["single_cost"] * (1 + 1e-9)
        assert fp.verify(found).ok, fp.verify(found).failed
        distance, turn = final_error(fp.simulate(found), found.scene.goal)
        assert distance < 1e-8
        assert turn < 1e-8


def test_improving_gives_an_answer_at_once_and_then_better_ones(planner):
    costs = [found.cost for found in planner.improving(STARTS[0])]
    assert len(costs) >= 2
    assert all(b < a for a, b in pairwise(costs))
    assert planner.plan(STARTS[0]).cost == costs[-1]


def test_one_start_needs_no_tree_and_ends_up_as_good(planner):
    for start in STARTS:
        alone = fp.plan(replace(planner.scene, start=start))
        assert alone.run["graph_cost"] is None
        assert alone.cost == pytest.approx(planner.plan(start).cost, rel=0.005)


def test_a_batch_is_its_single_plans(planner):
    batch = planner.plans(STARTS[:2])
    assert [found.cost for found in batch] == [planner.plan(start).cost for start in STARTS[:2]]


def test_the_tree_is_kept_in_a_file(planner, tmp_path):
    file = tmp_path / "tree"
    first = fp.Planner(planner.scene, tree=file).plan()
    assert file.exists()
    before = file.read_bytes()
    second = fp.Planner(planner.scene, tree=file).plan(STARTS[1])
    assert file.read_bytes() == before
    assert first.cost == planner.plan(STARTS[0]).cost
    assert second.cost == planner.plan(STARTS[1]).cost
    other = replace(planner.scene, goal=(0.01, 0.0, 0.0))
    with pytest.raises(InputError, match="tree"):
        fp.Planner(other, tree=file).plan()
    file.write_bytes(before[:100])
    with pytest.raises(InputError, match=file.name):
        fp.Planner(planner.scene, tree=file).plan()


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
    planner = fp.Planner(scene, tree=False)
    option = planner.usable[-1]
    legs = []
    here = scene
    for goal in ((0.002, -0.03, 0.1), (0.0, 0.0, 0.0)):
        here = replace(here, goal=goal)
        word = words_of(here, option)[int(np.argmin(costs(here, option)))]
        legs.append(Leg(option, word.word, word.parameters, np.array(goal)))
        here = replace(here, start=goal)
    segments = assemble(planner.scene, planner.transits, legs)
    assert [segment.kind for segment in segments] == ["transit", "push", "push", "transit"]
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
    pushes = fp.Planner(scene, tree=False).scene.pushes
    assert fp.Planner(replace(scene, start=STARTS[1]), tree=False).scene.pushes is pushes
    for other in (fp.Planning(friction_margin=0.5), fp.Planning(cost="pusher")):
        assert fp.Planner(replace(scene, planning=other), tree=False).scene.pushes is not pushes
    twin = fp.Object(triangle.outline, "uniform", triangle.friction)
    again = fp.Planner(replace(scene, object=twin), tree=False).scene.pushes
    assert [p.at.along for p in again] == [p.at.along for p in pushes]


def test_no_automatic_push_at_all_is_no_plan_that_can_be_saved(triangle, tmp_path):
    slippery = fp.Object(triangle.outline, "uniform", friction=0.0)
    found = fp.plan(fp.Scene(slippery, STARTS[0]))
    assert found.status == "no_plan"
    assert "without friction" in found.reason
    found.save(tmp_path / "plan.json")
    assert fp.load_plan(tmp_path / "plan.json").reason == found.reason
