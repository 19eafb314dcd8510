"""What is dropped on the page, what it saves, and recorded runs that it plays."""

import json

import numpy as np
import pytest
from tests.extras import extra
from tests.live_pages import EXAMPLES, SCENE, dropped

from flatpush.documents import mapping_of, parse_scene
from flatpush.errors import InputError
from flatpush.execution.log import open_log
from flatpush.execution.robot import State, Target
from flatpush.execution.run import Cycle
from flatpush.page.files import read_dropped, saved
from flatpush.page.in_mm import scene_in_mm
from flatpush.page.opened import opened
from flatpush.page.recorded import recorded


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


@pytest.mark.parametrize("ending", [".csv", ".mcap"])
def test_a_log_of_a_run_is_played_as_it_was(short, tmp_path, ending):
    if ending == ".mcap":
        pytest.importorskip("mcap", reason=extra("export"))
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
            opened(file, of)
