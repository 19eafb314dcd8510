"""The check of tests/fuzz.py sees what is wrong, and finds nothing in random scenes."""

import json

import numpy as np
import pytest

import flatpush as fp

from ..fuzz import check, exported, faults, main


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    """A plan with a wall beside its way, and its exported rows."""
    thing = fp.Object([(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)], friction=0.4)
    wall = [(0.06, -0.2), (0.07, -0.2), (0.07, 0.2), (0.06, 0.2)]
    scene = fp.Scene(
        thing,
        (0.01, -0.12, 0.3),
        pusher=fp.Pusher(fingers=2, spacing=0.015),
        workspace=fp.Workspace((-0.3, -0.3, 0.3, 0.3), [wall]),
        planning=fp.Planning(iterations=300, time_limit=1000, clearance=0.002),
    )
    return exported(fp.plan(scene), tmp_path_factory.mktemp("fuzz"))


def test_an_honest_file_has_no_fault(honest):
    assert list(check(*honest)) == []


BLOCK = [[-25, -17.5], [25, -17.5], [25, 17.5], [-25, 17.5]]
TWO = {"fingers": 2, "spacing": 15}
KINDS = {
    "one finger": {},
    "two fingers": {"pusher": TWO},
    "a finger that rolls": {"pusher": {"turns": False}},
    "a disc": {"object": {"outline": {"circle": 25}}, "pusher": TWO},
    "free angle": {"goal": [0, 0, "free"]},
    "robust": {"planning": {"robust": True}},
    "set of tables": {"object": {"uncertainty": {"loads": 0.1}}, "pusher": TWO},
    "many pushes, on the table": {"start": [20, 15, 150], "pusher": TWO | {"transit": "planar"}},
    "obstacles": {
        "pusher": TWO,
        "workspace": {
            "bounds": [-300, -300, 300, 300],
            "obstacles": [[[60, -200], [70, -200], [70, 200], [60, 200]]],
        },
        "planning": {"margin": {"clearance": 2}},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_honest_plans_of_every_kind_are_accepted_and_exported_without_a_fault(tmp_path, kind):
    document = {
        "flatpush": "scene/1",
        "units": {"length": "mm", "angle": "deg"},
        "object": {"name": "block", "outline": BLOCK, "friction": 0.4},
        "start": [10, -120, 17],
        "goal": [0, 0, 0],
        "planning": {"iterations": 30, "time_limit": 1000},
    }
    for key, value in KINDS[kind].items():
        document[key] = {**document.get(key, {}), **value} if isinstance(value, dict) else value
    outcome, found = faults(document, tmp_path)
    assert (outcome, found) == ("solved", [])
    plan = json.loads((tmp_path / "plan.json").read_text())
    pushes = sum(segment["kind"] == "push" for segment in plan["segments"])
    assert pushes >= (2 if kind.startswith("many") else 1)


def shift(column, amount, part):
    def edit(rows):
        rows[part, column] += amount

    return edit


def slower(rows):
    rows[:, 0] *= 0.99


# Rows in the first transit, in the push, and all of them.
LANDING, PUSH, ALL = slice(5, 8), slice(-40, -39), slice(None)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (shift(0, -5.0, LANDING), "times"),
        (slower, "times"),
        (shift(1, 1e-3, PUSH), "fingertip speed"),
        (shift(1, 1e-4, PUSH), "fingertip acceleration"),
        (shift(4, 0.2, PUSH), "turn rate"),
        (shift(4, 2 * np.pi, slice(-30, None)), "turn rate"),
        (shift(3, -1e-3, PUSH), "heights"),
        (shift(3, 0.1, slice(0, 1)), "heights"),
        (shift(1, 1e-3, LANDING), "on the way up or down"),
        (shift(2, -2e-4, ALL), "off the object"),
        (shift(2, 2e-4, ALL), "in the object"),
        (shift(1, 0.05, ALL), "a fingertip has"),
    ],
)
def test_what_is_wrong_with_a_file_is_seen(honest, edit, words):
    plan, rows = honest
    rows = rows.copy()
    edit(rows)
    assert any(words in fault for fault in check(plan, rows)), list(check(plan, rows))


def test_an_object_too_near_to_a_wall_and_beside_its_goal_is_seen(honest):
    plan, rows = honest
    near = plan["scene"] | {"planning": {**plan["scene"]["planning"], "margin": {"clearance": 0.03}}}
    assert any("the object has" in fault for fault in check(plan | {"scene": near}, rows))
    far = plan["scene"] | {"goal": [0.0006, 0.0, 0.0]}
    assert any("from the goal" in fault for fault in check(plan | {"scene": far}, rows))


def test_the_certificate_knows_the_clearance_that_dense_samples_have(honest):
    """Within 0.15 mm: a clearance as certified is kept at every 0.1 mm, and one that is a little more is not."""
    plan, rows = honest
    known = plan["certificate"]["clearance"]
    for more, kept in ((0.0, True), (1.5e-4, False)):
        margin = {**plan["scene"]["planning"]["margin"], "clearance": known + more}
        scene = plan["scene"] | {"planning": {**plan["scene"]["planning"], "margin": margin}}
        assert (list(check(plan | {"scene": scene}, rows)) == []) == kept


@pytest.mark.slow
def test_random_scenes_have_no_fault(capsys):
    assert main(20, 5000) == 0, capsys.readouterr().out
