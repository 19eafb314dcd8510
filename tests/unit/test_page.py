"""The live page without its server: scenes in millimetres, files, messages, and plans that follow."""

import base64
import itertools
import json
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

import flatpush as fp
from flatpush import compiling
from flatpush.cli.view import _shown as shown_first
from flatpush.control import Camera
from flatpush.control.tracking.simulated_run import TrackedRun
from flatpush.documents import mapping_of, parse_plan, parse_scene, scene_document, scene_template
from flatpush.errors import InputError
from flatpush.execution.log import open_log
from flatpush.execution.robot import State, Target
from flatpush.execution.run import Cycle
from flatpush.geometry import shift_twist
from flatpush.page import worker
from flatpush.page.by_hand import ByHand
from flatpush.page.feedback import Followed
from flatpush.page.files import read_dropped, saved
from flatpush.page.in_mm import refuse_files, scene_in_mm
from flatpush.page.live import LivePlanner
from flatpush.page.many_runs import many_runs
from flatpush.page.mechanics import mechanics
from flatpush.page.picture import picture
from flatpush.page.recorded import recorded
from flatpush.page.server import checked_message
from flatpush.problem.mechanics import surface_of
from flatpush.simulation import Noise, study

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
    answer, _ = read_dropped({"name": name, "data": base64.b64encode(content).decode(), **more})
    return answer


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


def answers_of(requests, last):
    """What the worker answers to requests of client 1, until one of a kind has come so often."""
    here, there = Pipe()
    for request in requests:
        here.send(request)

    def run():
        with pytest.raises((EOFError, OSError)):
            worker._Worker(there).run()

    thread = Thread(target=run)
    thread.start()
    found = []
    while not found or found[-1]["kind"] != last:
        assert here.poll(60), "the worker is gone"
        client, number, answer = here.recv()
        if client == 1:
            found.append({**answer, "number": number})
    here.close()
    thread.join(10)
    assert not thread.is_alive()
    return found


@pytest.fixture(scope="module")
def short():
    """A plan of one push with one finger, and the document of its scene."""
    thing = "{name: block, outline: [[-25, -20], [25, -20], [25, 20], [-25, 20]], friction: 0.4}"
    scene = parse_scene(
        mapping_of(
            f"flatpush: scene/1\nunits: {{length: mm, angle: deg}}\nobject: {thing}\n"
            "pusher: {fingers: 1, tip_radius: 3}\npushes: [{name: short side, at: [-25, 0]},"
            " {name: above, at: [0, 20]}, {name: right, at: [25, 0]}, {name: below, at: [0, -20]}]\n"
            "start: [-30, 3, 0]\ngoal: [0, 0, 0]\n"
        )
    )
    plan = fp.plan(scene)
    return plan, json.loads(json.dumps(scene_in_mm(plan.scene)))


def test_a_stored_plan_is_shown_itself_until_the_scene_is_another(short):
    """A plan that no planner would make: its cost is told to be 1 mm more, which verify finds out."""
    plan, document = short
    dearer = replace(plan, cost=plan.cost + 0.001)
    found = answers_of(
        [(0, 1, "keep", {"document": document, "plan": dearer}), (1, 1, "plan", document)], "done"
    )
    assert [answer["kind"] for answer in found] == ["plan", "plan", "done"]
    assert [answer.get("stored") for answer in found[:2]] == ["stored", "stored, fails verification"]
    assert found[0]["cost"].startswith(f"{1e3 * dearer.cost:.1f} mm")
    assert "it does not hold: cost" in found[1]["warnings"]
    known = LivePlanner()
    known.keep(document, dearer)
    assert known.kept(json.loads(json.dumps(document))) is dearer
    assert known.kept({**document, "start": [0, 1, 0]}) is None


def test_a_dropped_plan_is_the_plan_that_is_shown(short):
    plan, document = short
    data = base64.b64encode(saved({"what": "plan"}, plan)["text"].encode()).decode()
    file = (1, 1, "file", {"name": "block.json", "data": data})
    found = answers_of([file, (1, 2, "plan", document)], "done")
    assert found[0]["scene"] == document
    assert found[-2]["stored"] == "stored and verified"


def test_what_is_compiled_while_the_planner_starts_is_told(monkeypatch):
    """It was not: the worker listened after its imports, and on a fresh machine the page said nothing for minutes."""

    def starts(_):
        compiling.begin("steering.word", 1)
        compiling.end()

    monkeypatch.setattr(LivePlanner, "__init__", starts)
    here, there = Pipe()
    worker._Worker(there)._silence()
    told = [here.recv()[2] for _ in range(2)]
    assert [(part["what"], part["done"], part["over"]) for part in told] == [
        ("steering.word", 0, False),
        ("steering.word", 1, True),
    ]


CAMERA = {"controller": "path", "delay": 0.1, "frames": 30, "noise": [0.3, 0.3], "learn": False, "seed": 3}


def test_a_run_under_feedback_is_that_of_track_however_it_is_cut_up(short):
    plan, _ = short
    whole = TrackedRun(camera=Camera(30, 0.1, 0.0003, np.radians(0.3)), seed=3).of(plan)
    followed, rows, answer = Followed(plan, CAMERA), [], {"outcome": ""}
    for seconds in itertools.cycle((0.017, 0.3, 2.0)):
        answer = json.loads(json.dumps(followed.on({"seconds": seconds}), allow_nan=False))
        rows += answer["rows"][bool(rows) :]
        if answer["outcome"]:
            break
    assert answer["outcome"] == whole.outcome
    told = np.array(rows)
    np.testing.assert_allclose(told[:, 0], whole.times, atol=1e-4)
    np.testing.assert_allclose(told[:, 1:4], whole.object * [1e3, 1e3, 1], atol=1e-3)
    np.testing.assert_allclose(told[:, 4:7], whole.pusher * [1e3, 1e3, 1], atol=1e-3)
    np.testing.assert_allclose(told[:, 7], 1e3 * whole.heights, atol=0.01)
    assert (answer["mode"], answer["landings"]) == ("done", 0)


def test_an_object_that_is_moved_by_hand_is_where_it_was_put_and_the_horizon_lands_again(short):
    plan, _ = short
    followed = Followed(plan, {**CAMERA, "controller": "horizon"})
    answer = followed.on({"seconds": 0.1})
    while answer["contact"] != "sticks":
        answer = followed.on({"seconds": 0.1})
    x, y, turn = answer["rows"][-1][1:4]
    answer = followed.on({"seconds": 0.017, "moved": [x - 8, y + 40, turn]})
    assert answer["contact"] == "off the object"
    np.testing.assert_allclose(answer["rows"][-1][1:4], [x - 8, y + 40, turn], atol=1e-3)
    landings = answer["landings"]
    while not answer["outcome"]:
        answer = followed.on({"seconds": 1})
    assert answer["outcome"] == "arrived"
    assert answer["landings"] > landings
    assert np.hypot(*answer["rows"][-1][1:3]) < 2


@pytest.mark.parametrize(
    "wrong",
    [
        {"controller": "luck"},
        {"delay": -1},
        {"delay": 3},
        {"frames": 0},
        {"noise": [1]},
        {"learn": 1},
        {"seed": -1},
        {"seed": True},
    ],
)
def test_a_run_that_is_none_is_refused(short, wrong):
    with pytest.raises(InputError):
        Followed(short[0], {**CAMERA, **wrong})


def test_many_runs_are_told_as_they_finish_and_are_those_of_simulate(short):
    plan, document = short
    asked = {"count": 25, "seed": 4, "position": 0.5, "angle": 0.5, "friction": 10}
    requests = [(0, 1, "keep", {"document": document, "plan": plan}), (1, 1, "plan", document)]
    found = answers_of([*requests, (1, 2, "runs", asked), (1, 3, "on", {})], "refused")
    assert found[-1]["reason"] == "nothing is followed"
    assert all(answer.get("done") != 25 for answer in found)  # what was asked for later was not kept waiting
    told = list(many_runs(plan, asked))
    assert [part["done"] for part in told] == [10, 25]
    whole = study(plan, 25, 4, noise=Noise(0.0005, np.radians(0.5), 0.1), record=True)
    np.testing.assert_allclose(told[-1]["ends"], whole.final * [1e3, 1e3, 1], atol=1e-3)
    errors = np.sort(np.hypot(*np.array(told[-1]["ends"])[:, :2].T))  # the goal is the origin
    half, _, worst = told[-1]["errors"]
    assert half["distance"] == pytest.approx(errors[12], abs=1e-3)
    assert worst["distance"] == pytest.approx(errors[-1], abs=1e-3)
    assert told[-1]["sticking"] == pytest.approx(np.mean(told[-1]["stuck"]))
    widest = max((np.ptp(np.array(band["ring"])[:, 1]) for band in told[-1]["bands"]), default=0)
    assert 1 < widest < 40


@pytest.mark.parametrize("ending", [".csv", ".mcap"])
def test_a_log_of_a_run_is_played_as_it_was(short, tmp_path, ending):
    if ending == ".mcap":
        pytest.importorskip("mcap", reason="bags are in the extra `export`")
    plan, document = short
    path = tmp_path / f"run{ending}"
    poses = np.linspace([-0.04, 0.005, 3.1], [0, 0, 3.3], 11)  # the angle goes on beyond π
    hands = np.linspace([-0.068, 0.005, 0.03, 0], [-0.028, 0, 0, 0], 11)
    hands[3:, 2] = 0
    with open_log(path, "block") as log:
        for k, (pose, hand) in enumerate(zip(poses, hands, strict=True)):
            pose[2] = np.arctan2(np.sin(pose[2]), np.cos(pose[2]))
            seen = None if k == 5 else pose
            leg = "segment 1 (push short side)" if k > 2 else "segment 0 (transit)"
            target, state = Target(k / 10, hand, np.zeros(4)), State(hand, np.zeros(4), k / 10)
            log.write(Cycle(k / 10, target, state, seen, leg, 1, "plan", 0.0, 0.0))
        log.end("done")
    (run,) = recorded(path, plan.scene, plan)
    motion = json.loads(json.dumps(run["motion"], allow_nan=False))
    assert run["outcome"] == "done"
    first = 0 if ending == ".mcap" else 3  # a CSV holds what was done on the table
    assert len(motion["times"]) == 11 - first
    assert motion["times"][-1] == pytest.approx(1 - first / 10)
    x, y, turn = np.array(motion["object"]).T
    np.testing.assert_allclose([x[-1], y[-1], np.cos(turn[-1])], [0, 0, np.cos(3.3)], atol=1e-3)
    assert np.max(np.diff(turn)) < 0.05
    np.testing.assert_allclose(
        motion["object"][5 - first], motion["object"][4 - first], atol=1e-9
    )  # not seen
    np.testing.assert_allclose(motion["pusher"][-1], [-28, 0, 0], atol=1e-3)
    last = motion["segments"][motion["segment"][-1]]
    assert (last["push"], last["number"]) == ("short side", 1)
    np.testing.assert_allclose(last["tips"], 1e3 * plan.pushes[0].fingers, atol=1e-3)
    if ending == ".mcap":
        assert motion["segments"][0]["push"] is None
    shown = dropped(f"run{ending}", path.read_bytes(), scene=document)
    assert shown["runs"][0]["motion"]["object"] == motion["object"]


def test_a_log_needs_the_scene_of_its_object(tmp_path):
    log, scene = tmp_path / "run.csv", EXAMPLES / "triangle.yaml"
    log.write_text("t,obj_y_mm\n", encoding="utf-8")
    for file, of, said in (
        (log, None, "Give its scene or its plan: --scene FILE"),
        (log, scene, "line 1 names no column obj_x_mm"),
        (scene, log, "--scene belongs to a log"),
    ):
        with pytest.raises(InputError, match=said):
            shown_first(file, of)


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
