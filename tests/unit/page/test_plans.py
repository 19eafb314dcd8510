"""Plans that follow what is dragged, and what is shown of them."""

import json

import numpy as np
import pytest
from tests.live_pages import CAMERA

import flatpush as fp
from flatpush.documents import parse_plan, parse_scene
from flatpush.errors import InputError
from flatpush.page.feedback import Followed
from flatpush.page.files import saved
from flatpush.page.live import LivePlanner
from flatpush.page.picture import picture


def test_answers_get_better_and_the_last_one_verifies(planner, document):
    plans = [plan for plan, _ in planner.answers(document)]
    assert plans[0].certificate.friction_margin is None  # the first one comes before it is proved
    assert fp.verify(plans[-1]).ok
    costs = [plan.cost for plan in plans]
    assert costs == sorted(costs, reverse=True)
    for plan in plans:
        np.testing.assert_allclose(plan.scene.goal_error(plan.final_pose()), 0, atol=1e-6)
    assert plans[0].cost == pytest.approx(plans[1].cost)  # what is drawn at once is what is proved then


def test_the_last_sequence_of_pushes_follows_the_start(planner, document):
    """While something is dragged the plan does not fall back to a single push that is dearer."""
    *_, (best, _) = planner.answers(document)
    assert len(best.pushes) > 1
    document["start"][0] += 1
    plan, _ = next(planner.answers(document))
    assert [push.push for push in plan.pushes] == [push.push for push in best.pushes]
    assert abs(plan.cost - best.cost) < 0.004
    np.testing.assert_allclose(plan.scene.goal_error(plan.final_pose()), 0, atol=1e-6)


@pytest.mark.parametrize("away", [0.0, 1e5])  # an outline drawn far from its origin is moved there
def test_a_start_and_a_goal_that_are_moved_are_those_of_the_document(document, away):
    document["object"]["outline"] = [[x + away, y] for x, y in document["object"]["outline"]]
    document["pushes"] = [{"name": "long edge", "at": [away, -10]}]
    document["start"], document["goal"] = [-120 - away, 60, 0], [-away, 0, 0]
    planner = LivePlanner()
    planner.listed(document)
    document["start"], document["goal"] = [-100 - away, 50, 20], [-away, 5, 10 if away else "free"]
    moved, read = planner.listed(document), parse_scene(document)
    np.testing.assert_allclose(moved.start, read.start, atol=1e-12)
    np.testing.assert_allclose(moved.goal, read.goal, atol=1e-12)
    assert moved.object.outline.radius_about((0.0, 0.0)) < 1.0
    document["start"] = [0, 0, 1000]
    with pytest.raises(InputError, match="two turns"):
        planner.listed(document)


def test_a_start_on_an_obstacle_is_refused_with_its_place(planner, document):
    document["workspace"]["obstacles"] = [[[-130, 50], [-110, 50], [-110, 70], [-130, 70]]]
    with pytest.raises(InputError, match="start"):
        next(planner.answers(document))


def test_a_picture_holds_the_motion_and_the_words_of_the_plan(planner, document):
    *_, (plan, options) = planner.answers(document)
    shown = json.loads(json.dumps(picture(plan, options), allow_nan=False))
    assert [place["name"] for place in shown["places"]] == ["long edge", "short edge", "hypotenuse"]
    assert len(shown["traces"]) == len(plan.pushes)
    assert shown["motion"]["times"][-1] == pytest.approx(plan.duration, abs=1e-5)
    x, y, turn = shown["motion"]["object"][-1]
    np.testing.assert_allclose([x, y, np.sin(turn)], [0, 0, 0], atol=1e-3)
    assert ["friction margin", "20 % of μ (3.2°)"] in shown["proved"]
    plan_file = saved({"what": "plan"}, plan)
    assert fp.verify(parse_plan(json.loads(plan_file["text"]))).ok
    assert saved({"what": "figure"}, plan)["text"].startswith("<svg")


def test_a_picture_says_for_which_loads_a_plan_is_proved_and_what_gives_way_beyond(planner, document):
    document["object"]["uncertainty"] = {"loads": 0.1}
    *_, (plan, traces) = planner.answers(document)
    certificate = plan.certificate
    rows = dict(picture(plan, traces)["proved"])
    assert rows["loads within 10 %"] == "proved"
    assert rows[f"beyond {100 * certificate.set_loads:.3g} %"] == certificate.set_worst.gives_way


def test_a_picture_shows_slides_by_the_path_of_the_centre(document):
    """A brick without friction at the finger: no push steers it, and it is brought to its goal by slides."""
    document["object"] = {"outline": [[-30, -20], [30, -20], [30, 20], [-30, 20]], "friction": 0}
    document |= {"start": [70, 30, 50], "pushes": "auto"}
    document["pusher"]["fingers"] = 1
    *_, (plan, options) = LivePlanner().answers(document)
    assert plan.slides
    shown = json.loads(json.dumps(picture(plan, options), allow_nan=False))
    for trace, segment in zip(shown["traces"], plan.on_table, strict=True):
        assert trace["slides"]
        np.testing.assert_allclose(trace["flat"], 1e3 * segment.object[:, :2], atol=0.01)  # about its middle
    with pytest.raises(InputError, match="no push to follow"):
        Followed(plan, CAMERA)
