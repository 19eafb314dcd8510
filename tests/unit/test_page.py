"""The live page without its server: scenes in millimetres, files, messages, and plans that follow."""

import base64
import json
from multiprocessing import Pipe
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

import flatpush as fp
from flatpush.documents import mapping_of, parse_plan, parse_scene, scene_document, scene_template
from flatpush.errors import InputError
from flatpush.page import worker
from flatpush.page.by_hand import ByHand
from flatpush.page.files import read_dropped, saved
from flatpush.page.in_mm import refuse_files, scene_in_mm
from flatpush.page.live import LivePlanner
from flatpush.page.mechanics import mechanics
from flatpush.page.picture import picture
from flatpush.page.server import checked_message

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE = """
flatpush: scene/1
units: {length: mm, angle: deg}
object: {outline: [[20, -10], [20, 19], [-39, -10]], friction: 0.3}
pusher: {fingers: 2, spacing: 18}
pushes:
  - {name: long edge, at: [0, -10]}
  - {name: short edge, at: [20, 4.75]}
  - {name: hypotenuse, edge: 1, along: 0.42}
start: [-120, 60, -60]
goal: [0, 0, 0]
planning: {model: ellipsoid, two_finger: middle, switch_cost: 2, iterations: 1}
"""


@pytest.fixture
def document():
    return scene_in_mm(parse_scene(mapping_of(SCENE)))


@pytest.fixture(scope="module")
def planner():
    return LivePlanner()


def numbers(value):
    """Every number of a document, in order."""
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    found = [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []
    return found + [x for item in items for x in numbers(item)]


@pytest.mark.parametrize(
    "text",
    [
        scene_template(),
        (EXAMPLES / "disc.yaml").read_text(encoding="utf-8"),
        (EXAMPLES / "rectangle_three_feet.yaml").read_text(encoding="utf-8"),
        (EXAMPLES / "maze.yaml").read_text(encoding="utf-8"),
        SCENE.replace("friction: 0.3", "friction: 0.3, uncertainty: {loads: 0.1, offset: 0.5}"),
        SCENE.replace("switch_cost: 2", "cost: time, switch_cost: 2").replace("[0, 0, 0]", "[0, 0, free]"),
    ],
)
def test_a_scene_in_mm_is_the_same_scene(text):
    scene = parse_scene(mapping_of(text))
    document = scene_in_mm(scene)
    assert document["units"] == {"length": "mm", "angle": "deg"}
    again = parse_scene(document)
    np.testing.assert_allclose(numbers(scene_document(again)), numbers(scene_document(scene)), rtol=1e-9)
    assert json.loads(json.dumps(document)) == document


def test_pushes_with_the_fingers_of_all_follow_the_pusher(document):
    assert [set(push) for push in document["pushes"]] == [{"name", "at"}] * 3
    document["pusher"]["spacing"] = 22
    assert [push.spacing for push in parse_scene(document).pushes] == [0.022] * 3


def test_a_page_reads_no_files_of_this_machine(document):
    document["object"]["outline"] = {"file": "secret.svg"}
    with pytest.raises(InputError, match=r"object\.outline\.file.*names no files.*secret\.svg"):
        refuse_files(document)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        "[" * 100_000,
        '{"number": 1, "kind": "plan"}',
        '{"number": 1, "kind": "plan", "value": {}, "more": 1}',
        '{"number": 0, "kind": "plan", "value": {}}',
        '{"number": true, "kind": "plan", "value": {}}',
        '{"number": 1.5, "kind": "plan", "value": {}}',
        '{"number": 1, "kind": "left", "value": {}}',
        '{"number": 1, "kind": "plan", "value": []}',
        '{"number": 1, "kind": "plan", "value": {"x": NaN}}',
        '{"number": 1, "kind": "plan", "value": {"x": ' + 30 * "[" + 30 * "]" + "}}",
    ],
)
def test_what_is_no_message_is_refused(text):
    with pytest.raises(InputError):
        checked_message(text)


def test_a_message_is_taken_apart():
    assert checked_message('{"number": 7, "kind": "save", "value": {"what": "plan"}}') == (
        7,
        "save",
        {"what": "plan"},
    )


def dropped(name, content, **more):
    return read_dropped({"name": name, "data": base64.b64encode(content).decode(), **more})


def test_a_drawing_is_dropped_as_an_outline_about_its_centroid():
    drawing = b'<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">'
    drawing += b'<rect x="10" y="5" width="40" height="30"/></svg>'
    outline = dropped("part.svg", drawing)["outline"]
    assert sorted(outline) == [[-20, -15], [-20, 15], [20, -15], [20, 15]]


def test_a_bitmap_is_dropped_with_the_size_of_its_pixels():
    from io import BytesIO

    from PIL import Image

    picture = np.full((120, 160), 255, np.uint8)
    picture[30:90, 30:130] = 0
    file = BytesIO()
    Image.fromarray(picture).save(file, "png")
    outline = np.array(dropped("mask.png", file.getvalue(), pixel=0.5)["outline"])
    np.testing.assert_allclose(np.ptp(outline, axis=0), [50, 30], atol=0.5)
    with pytest.raises(InputError, match="pixel"):
        dropped("mask.png", file.getvalue(), pixel=-1)


def test_a_scene_is_dropped_and_saved_again(document):
    scene = dropped("scene.yaml", SCENE.encode())["scene"]
    assert scene == document
    file = saved({"what": "scene", "scene": scene}, None)
    assert file["name"] == "object.yaml"
    assert scene_in_mm(parse_scene(mapping_of(file["text"]))) == document


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("scene.exe", b"", "no kind of file"),
        ("scene.yaml", b"flatpush: scene/1\nobject: {outline: {file: /etc/passwd}}", "names no files"),
        ("scene.yaml", b"\x00\x01", "not text"),
        ("part.svg", b"<svg", "part.svg"),
        ("plan.json", b'{"flatpush": "scene/1"}', "plan.json: object"),
    ],
)
def test_a_file_that_is_nothing_for_the_page_is_refused_by_name(name, content, words):
    with pytest.raises(InputError, match=words):
        dropped(name, content)


@pytest.mark.parametrize("value", [{}, {"name": "a.svg", "data": "§"}, {"name": 1, "data": ""}])
def test_a_drop_that_is_no_file_is_refused(value):
    with pytest.raises(InputError):
        read_dropped(value)


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


def test_of_the_requests_of_a_client_the_newest_wins(document):
    """Everything is asked for before the worker begins; of each client it answers the last alone."""
    here, there = Pipe()
    for client, number in ((1, 1), (2, 1), (1, 2), (1, 3)):
        here.send((client, number, "plan", document))
    here.send((3, 1, "save", {"what": "plan"}))

    def run():
        with pytest.raises((EOFError, OSError)):
            worker._Worker(there).run()

    thread = Thread(target=run)
    thread.start()
    answers = []
    while sum(answer["kind"] == "done" for _, _, answer in answers) < 2:
        assert here.poll(60), "the worker is gone"
        client, number, answer = here.recv()
        if client:
            answers.append((client, number, answer))
    here.close()
    thread.join(10)
    assert not thread.is_alive()
    assert {(client, number) for client, number, _ in answers} == {(1, 3), (2, 1), (3, 1)}
    plans = [answer for client, _, answer in answers if client == 1 and answer["kind"] == "plan"]
    assert plans[0]["status"] == "solved"
    assert [answer["reason"] for client, _, answer in answers if client == 3] == ["there is no plan to save"]


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
