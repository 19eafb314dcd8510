"""A goal that leaves the angle open: as a document, as a plan, as a claim and as a picture."""

import re
from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.control.horizon.controller import HorizonController
from flatpush.control.loop.closed_loop import drive
from flatpush.control.loop.sensor import Camera, SimulatedSensor
from flatpush.documents import parse_scene, scene_document
from flatpush.documents.scene_digest import scene_differences, scene_digest
from flatpush.errors import InputError
from flatpush.geometry import compose
from flatpush.planning.empty_table import direct_paths, refined_paths
from flatpush.planning.obstacles import Search, query_of
from flatpush.planning.query import Query
from flatpush.planning.refine.problem import Sequences
from flatpush.problem import Planning, Workspace
from flatpush.simulation.plant import Plant
from flatpush.view import save_figure

CUP = {
    "flatpush": "scene/1",
    "units": {"length": "mm", "angle": "deg"},
    "object": {"outline": {"circle": 40}, "friction": 0.3},
    "start": [60, 20, 135],
    "goal": [1, 2, "free"],
}


def _cup(**changes) -> fp.Scene:
    return replace(parse_scene(CUP), **changes)


@pytest.fixture(scope="module")
def cup_plan() -> fp.Plan:
    """With two fingers; its scene lists the pushes."""
    return fp.plan(_cup(pusher=fp.Pusher(fingers=2, spacing=0.018)))


def test_a_document_says_free():
    scene = parse_scene(CUP)
    assert scene.free_angle
    assert scene.goal_pose[:2].tolist() == [0.001, 0.002]
    assert scene.goal_error((0.001, 0.002, 5.0)).tolist() == [0, 0, 0]
    document = scene_document(scene)
    assert document["goal"] == [0.001, 0.002, "free"]
    again = parse_scene(document)
    assert scene_digest(again) == scene_digest(scene)
    assert scene_digest(_cup(goal=(0.001, 0.002, "free"))) == scene_digest(scene)
    fixed = replace(scene, goal=(0.001, 0.002, 0.0))
    assert [d.key for d in scene_differences(scene, fixed)] == ["goal[2]"]


@pytest.mark.parametrize(
    ("goal", "rule"),
    [
        (["free", 0, 0], "only the angle of a goal can be free"),
        ([0, 0, "any"], "goal"),
        ([0, 0, float("nan")], "goal"),
        ([0, 0], "goal"),
    ],
)
def test_other_words_are_refused(goal, rule):
    with pytest.raises(InputError, match=rule):
        parse_scene({**CUP, "goal": goal})


def test_a_start_is_never_free():
    with pytest.raises(InputError, match="start"):
        parse_scene({**CUP, "start": [0, 0, "free"]})
    with pytest.raises(InputError, match="three finite numbers"):
        _cup(start=(0, 0, float("nan")))


def test_the_angle_about_a_far_origin_is_not_left_open():
    thing = fp.Object([(10, 10), (10.05, 10), (10.05, 10.04), (10, 10.04)])
    with pytest.raises(InputError, match="the drawing's origin, and that is"):
        fp.plan(fp.Scene(thing, (0, 0, 0), (0.1, 0, "free")))


@pytest.mark.parametrize("fingers", [1, 2])
@pytest.mark.parametrize("cost", ["flat", "pusher", "time"])
def test_one_push_is_never_dearer_than_with_a_fixed_angle(fingers, cost):
    thing = fp.Object([(0.03, -0.01), (0.03, 0.02), (-0.02, 0.02), (-0.03, -0.01)], friction=0.3)
    pusher = fp.Pusher(fingers=fingers, spacing=0.012) if fingers == 2 else fp.Pusher()
    place = thing.outline.nearest([0.0, -0.01])
    push = fp.Push("below", place, fingers, 0.012 if fingers == 2 else 0.0)
    scene = fp.Scene(thing, (0.05, 0.02, 2.0), (0, 0, "free"), pusher, (push,), planning=Planning(cost=cost))
    planner = fp.Planner(scene)
    (answer,) = planner.answers()
    found = answer.plan()
    angles = np.linspace(-np.pi, np.pi, 73)[:-1]
    fixed = [direct_paths(planner.fleet, scene.start_pose, np.array([[0, 0, a]]))[0].cost for a in angles]
    assert answer.cost <= min(fixed) + 1e-9
    assert answer.cost > 0.8 * min(fixed)  # and it is a path of the same kind, not a cost of nothing
    assert fp.verify(found).ok
    x, y, angle = found.certificate.goal_error
    assert np.hypot(x, y) < 1e-9
    assert angle == 0.0
    assert fp.simulate(found).final_pose[:2] == pytest.approx([0, 0], abs=1e-4 if fingers == 2 else 2e-3)


def test_a_start_at_the_place_is_there_already(cup_plan):
    plan = fp.plan(replace(cup_plan.scene, start=(0.001, 0.002, 3.0)))
    assert (plan.status, plan.cost, plan.segments) == ("solved", 0.0, ())


def test_a_plan_that_misses_the_place_fails(cup_plan):
    """The claim of the goal is recomputed for x and y: moving the goal by 1 mm must be noticed."""
    assert fp.verify(cup_plan).ok
    moved = replace(cup_plan, scene=replace(cup_plan.scene, goal=(0.002, 0.002, "free")))
    assert {"goal_error", "reaches the goal"} <= {claim.name for claim in fp.verify(moved).failed}


@pytest.mark.slow
def test_among_obstacles_the_object_ends_as_it_fits():
    """A slot that is 30 mm wide takes a bar of 80 × 20 mm only lengthwise; the goal leaves that to the planner."""
    bar = fp.Object([(0.04, -0.01), (0.04, 0.01), (-0.04, 0.01), (-0.04, -0.01)], friction=0.4, name="bar")
    walls = [
        [(-0.05, y0), (0.05, y0), (0.05, y1), (-0.05, y1)] for y0, y1 in ((0.015, 0.03), (-0.03, -0.015))
    ]
    scene = fp.Scene(
        bar,
        (-0.2, 0.02, 0.3),
        (0, 0, "free"),
        fp.Pusher(fingers=2, spacing=0.01),
        workspace=Workspace(obstacles=walls),
    )
    plan = fp.plan(scene)
    assert plan.status == "solved", plan.reason
    assert fp.verify(plan).ok
    end = plan.final_pose()
    assert abs(np.sin(end[2])) < 0.2
    assert end[:2] == pytest.approx([0, 0], abs=1e-9)
    nearer = [np.array(wall) - [0, 0.01 * side] for wall, side in zip(walls, (1, -1), strict=True)]
    tight = replace(scene, workspace=Workspace(obstacles=nearer))
    with pytest.raises(InputError, match=r"at the goal the object .* fits at no other angle"):
        fp.plan(tight)


def test_the_goal_is_drawn_without_a_heading(cup_plan, tmp_path):
    """A fixed goal has a mark of how it is turned; a free one has one line less, and the same outlines."""
    fixed = replace(cup_plan, scene=replace(cup_plan.scene, goal=cup_plan.goal_pose))
    strokes = []
    for shown, name in ((cup_plan, "free.svg"), (fixed, "fixed.svg")):
        save_figure(shown, tmp_path / name)
        strokes.append(len(re.findall(r"<(?:path|polyline|line)\b", (tmp_path / name).read_text())))
    assert strokes[0] == strokes[1] - 1


@pytest.mark.slow
@pytest.mark.parametrize("start", [(0.09, -0.05, 0.4), (-0.02, 0.12, 2.2)])
def test_many_pushes_are_never_dearer_than_with_a_fixed_angle(start):
    """A cup with the automatic pushes of two fingers; benchmarks/free_goal.py does the same for random starts."""
    scene = _cup(start=start, pusher=fp.Pusher(fingers=2, spacing=0.018))
    planner = fp.Planner(scene)

    def cost(goal):
        return list(refined_paths(replace(planner.scene, goal=goal), planner.fleet))[-1].cost

    free = cost(scene.goal)
    assert free <= min(cost((0.001, 0.002, angle)) for angle in np.arange(24) * (np.pi / 12)) + 1e-9
    found = planner.plan()
    assert found.cost == pytest.approx(free, abs=1e-9)
    assert fp.verify(found).ok


def test_the_descent_turns_the_end_to_where_nothing_is_gained(cup_plan):
    """The best plan of many pushes, its end turned by a little either way, costs more: the angle is stationary."""
    scene = cup_plan.scene
    planner = fp.Planner(scene)
    best = list(refined_paths(scene, planner.fleet))[-1]
    assert len(best.path.pushes) > 1
    end = best.path.poses[-1]
    assert end[:2] == pytest.approx(scene.goal_pose[:2], abs=1e-12)
    sequences = Sequences.of(Query(planner.fleet, scene.start_pose, end), 5e-3)
    stretches = best.path.stretches
    pushes = np.array([push for push, *_ in stretches])
    for turn in (-1e-3, 1e-3):
        poses = np.array(
            [scene.start_pose, *(pose for *_, pose in stretches[:-1]), end + np.array([0, 0, turn])]
        )
        beside = sequences.descend(sequences.candidate(pushes, poses), 6, 80)
        assert beside.cost > best.cost - 1e-9


@pytest.mark.slow
def test_the_horizon_controller_takes_it():
    scene = _cup(start=(0.05, 0.0, 1.0), goal=(0.0, 0.0, "free"))
    controller = HorizonController.of(scene)
    plant = Plant(scene.object, [[0.0, 0.0]], scene.pusher.tip_radius)
    hand = compose(scene.start_pose, [-0.1, 0.0, 0.0])
    run = drive(
        controller, plant, scene.start_pose, hand, SimulatedSensor(Camera(), np.random.default_rng(0)), 90.0
    )
    assert run.outcome.startswith("arrived"), run.outcome
    assert np.hypot(*run.object[-1][:2]) < 0.002


WALLS = (
    [(-0.1, -0.02), (-0.06, -0.02), (-0.06, 0.1), (-0.1, 0.1)],
    [(0.06, -0.1), (0.1, -0.1), (0.1, 0.03), (0.06, 0.03)],
    [(-0.06, -0.12), (0.02, -0.12), (0.02, -0.08), (-0.06, -0.08)],
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "angles"),
    [
        # Four angles were searched for that are cheap for one push; the best, with two, was at none: 17 % dearer.
        ((0.032, 0.0688, 0.274), (0.26, 1.05, 4.97)),
        # The first path, of one push, bounded the lattices so that one of two pushes was not found: 3.4 % dearer.
        ((0.10722128, -0.13992433, 1.44296773), (4.71238898,)),
    ],
)
def test_among_obstacles_a_free_angle_is_no_dearer_than_fixed_ones(start, angles):
    cup = replace(_cup().object, name="cup")
    scene = fp.Scene(
        cup, start, (0, 0, "free"), fp.Pusher(fingers=2, spacing=0.018),
        workspace=Workspace(obstacles=WALLS), planning=Planning(time_limit=60.0),
    )  # fmt: skip
    planner = fp.Planner(scene)
    free = planner.plan()
    assert fp.verify(free).ok
    fixed = [list(planner.moved(scene.start, (0, 0, angle)).answers())[-1].cost for angle in angles]
    assert free.cost <= min(fixed) + 1e-9


def test_a_search_ends_at_whichever_of_several_goals_is_cheapest():
    planner = fp.Planner(_cup(goal=(-0.2, -0.2, 2.0), workspace=Workspace((-0.4, -0.4, 0.4, 0.4))))
    query = query_of(planner.scene, planner.usable, planner.fleet)
    near = planner.usable[0].car
    assert near is not None
    ahead = compose(planner.scene.start_pose, [*(0.05 * near.direction), 0.0])
    search = Search(replace(query, other_goals=ahead[None]), 0)
    for _ in search.rounds():
        if search.work > 3000:
            break
    assert search.best is not None
    assert search.best.poses[-1] == pytest.approx(ahead, abs=1e-9)
    assert search.cost < 0.06
