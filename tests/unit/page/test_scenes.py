"""Scenes and messages as the page sends them: in millimetres, without files."""

import json

import numpy as np
import pytest
from tests.live_pages import EXAMPLES, SCENE

from flatpush.documents import mapping_of, parse_scene, scene_document, scene_template
from flatpush.errors import InputError
from flatpush.page.in_mm import refuse_files, scene_in_mm
from flatpush.page.server import checked_message


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
