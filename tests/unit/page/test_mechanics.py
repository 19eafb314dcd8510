"""The mechanics that the page shows of a push, and a step pushed by hand."""

import json

import numpy as np
import pytest

import flatpush as fp
from flatpush.documents import parse_scene
from flatpush.errors import InputError
from flatpush.geometry import shift_twist
from flatpush.page.by_hand import ByHand
from flatpush.page.mechanics import mechanics
from flatpush.problem.mechanics import surface_of


def test_the_wrench_of_an_arc_lies_on_the_limit_surface_where_its_twist_stands_normal(planner, document):
    """Forces are told by the greatest force and moments by the greatest moment; of the ellipsoid of this scene these
    are its half axes, so that on it the shares have the length 1."""
    plan = fp.plan(parse_scene(document))
    push = plan.pushes[0]
    shown = json.loads(json.dumps(mechanics(plan.scene, push.push, push.arcs), allow_nan=False))
    found = surface_of(plan.scene.object, "ellipsoid", np.array([0.0, 1.0]))
    scale = np.abs(np.diag(found.wrench(np.eye(3))))
    assert len(shown["arcs"]) == len(push.arcs)
    for arc, told in zip(push.arcs, shown["arcs"], strict=True):
        wrench = np.array(told["wrench"]) * scale
        assert found.value(wrench) == pytest.approx(1, abs=1e-3)
        V, W = found.twist(wrench), shift_twist(arc.twist, plan.scene.object.cof)
        size = np.array([1, 1, 0.02])
        assert (V * size) @ (W * size) == pytest.approx(
            np.linalg.norm(V * size) * np.linalg.norm(W * size), rel=1e-4
        )
        x, y = (np.array(shown["contact"]) / 1e3 - plan.scene.object.cof).tolist()
        moved = np.array([W[0] - W[2] * y, W[1] + W[2] * x])
        np.testing.assert_allclose(told["u"], moved / np.hypot(*moved), atol=1e-4)
        assert np.degrees(np.arccos(np.dot(told["force"], [0, 1]))) < np.degrees(np.arctan(0.3)) + 0.01
        np.testing.assert_allclose(told["force"], wrench[:2] / np.hypot(*wrench[:2]), atol=1e-3)
    for points in (*shown["mesh"], shown["edge"]):
        np.testing.assert_allclose(found.value(np.array(points) * scale), 1, atol=5e-3)
    for ray, centre in zip(shown["rays"], shown["centres"], strict=True):
        np.testing.assert_allclose(ray["points"][0], centre["at"], atol=1e-6)


def test_the_mechanics_of_a_push_are_those_of_its_contact(planner, document):
    """The friction cone has its half angle about the normal; a turn about each centre moves the contact along an edge
    of the motion cone (one virtual contact, Fig. 2)."""
    shown = json.loads(json.dumps(mechanics(planner.listed(document), "long edge"), allow_nan=False))
    force, motion = (np.array(cone["edges"]) for cone in shown["cones"])
    np.testing.assert_allclose(force @ [0, 1], np.cos(np.arctan(0.3)), atol=1e-4)  # the long edge is along x
    contact = np.array(shown["contact"])
    for centre in shown["centres"]:
        x, y = contact - centre["at"]
        way = np.array([-y, x]) * centre["sign"] / np.hypot(x, y)
        assert np.max(motion @ way) == pytest.approx(1, abs=1e-4)
    flat = np.mean([centre["at"] for centre in shown["centres"]], axis=0)
    np.testing.assert_allclose(shown["flat"], flat, atol=2e-3)
    assert shown["areas"] == []  # the middle of two fingers stands for one
    document["planning"]["two_finger"] = "cone"
    both = mechanics(planner.listed(document), "long edge")["areas"]
    assert {area["colour"] for area in both} == {"#1f5fd0", "#c2189b"}
    with pytest.raises(InputError, match="no push of this name"):
        mechanics(planner.listed(document), "roof")


@pytest.fixture
def square():
    """A step by hand on a square of 40 mm: from where to where, with a friction."""
    hand = ByHand()
    document = {
        "flatpush": "scene/1",
        "units": {"length": "mm", "angle": "deg"},
        "object": {"outline": [[-20, -20], [20, -20], [20, 20], [-20, 20]], "friction": 0.5},
        "pusher": {"tip_radius": 2},
        "start": [0, 0, 0],
        "goal": [0, 0, 0],
    }

    def step(*way, pose=(0, 0, 0), friction=0.5, seconds=0.1):
        thing = {**document["object"], "friction": friction}
        value = {
            "scene": {**document, "object": thing},
            "object": list(pose),
            "way": list(way),
            "seconds": seconds,
        }
        return json.loads(json.dumps(hand.step(value), allow_nan=False))

    return step


def test_a_finger_at_the_middle_of_a_side_pushes_straight_ahead(square):
    answer = square(-22, 0, -17, 0)
    assert (answer["mode"], answer["outcome"]) == ("sticks", "")
    np.testing.assert_allclose(answer["object"], [5, 0, 0], atol=1e-3)
    np.testing.assert_allclose(answer["twist"], [50, 0, 0], atol=0.02)
    np.testing.assert_allclose(answer["force"], [1, 0], atol=1e-4)
    np.testing.assert_allclose(answer["point"], [-15, 0], atol=1e-3)
    assert answer["moment"] == pytest.approx(0, abs=0.01)


def test_a_finger_off_the_middle_turns_the_object_with_its_force_through_the_contact(square):
    """The moment about the middle is that of the force at the contact, and the force lies in the friction cone."""
    answer = square(-22, -10, -21.9, -10)
    assert answer["twist"][2] > 0
    arm, force = np.array(answer["point"]) - answer["object"][:2], np.array(answer["force"])
    assert arm[0] * force[1] - arm[1] * force[0] == pytest.approx(answer["moment"], rel=0.02)
    normal = [np.cos(answer["object"][2]), np.sin(answer["object"][2])]
    assert np.degrees(np.arccos(force @ normal)) <= np.degrees(np.arctan(0.5)) + 0.5
    assert square(-22, 0, -21, 4, friction=0.05)["mode"].startswith("slides")


def test_a_finger_beside_or_on_the_object_moves_nothing(square):
    assert square(-60, 0, -40, 0)["mode"] == "off the object"
    assert square(-60, 0, -40, 0)["object"] == [0, 0, 0]
    inside = square(0, 0, 0, 0)
    assert (inside["outcome"], inside["object"]) == ("starts inside", [0, 0, 0])
    assert "finger" not in inside


@pytest.mark.parametrize(
    "wrong", [{"seconds": 0}, {"seconds": True}, {"pose": (0, 0)}, {"pose": (0, 0, "x")}, {"friction": -1}]
)
def test_a_step_that_is_none_is_refused(square, wrong):
    with pytest.raises(InputError):
        square(-22, 0, -21, 0, **wrong)
