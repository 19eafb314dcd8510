"""The process that plans: whose request it answers, and what it tells."""

import base64
import json
import pickle
from dataclasses import replace
from multiprocessing import Pipe

import numpy as np
import pytest
from tests.live_pages import answers_of, told
from tests.waiting import heard

from flatpush import compiling
from flatpush.page import worker
from flatpush.page.files import saved
from flatpush.page.live import LivePlanner
from flatpush.page.many_runs import many_runs
from flatpush.simulation import Noise, study


def test_of_the_requests_of_a_client_the_newest_wins(document):
    """Everything is asked for before the worker begins; of each client it answers the last alone."""
    plans = [(client, number, "plan", document) for client, number in ((1, 1), (2, 1), (1, 2), (1, 3))]
    answers = told(
        [*plans, (3, 1, "save", {"what": "plan"})],
        lambda told: sum(answer["kind"] == "done" for _, _, answer in told) == 2,
    )
    answers = [one for one in answers if one[0]]
    assert {(client, number) for client, number, _ in answers} == {(1, 3), (2, 1), (3, 1)}
    plans = [answer for client, _, answer in answers if client == 1 and answer["kind"] == "plan"]
    assert plans[0]["status"] == "solved"
    assert [answer["reason"] for client, _, answer in answers if client == 3] == ["there is no plan to save"]


def test_what_is_dragged_is_answered_by_a_sketch_and_then_by_its_plan(document):
    """The sketch draws what its plan draws: the same outlines, fingers and paths, without a time."""
    sketch, plan, *_ = answers_of([(1, 1, "drag", document)], "done")
    assert sketch["sketch"]
    assert "motion" not in sketch
    assert sketch["cost"] == plan["cost"]
    assert len(sketch["traces"]) == len(plan["traces"])
    for one, other in zip(sketch["traces"], plan["traces"], strict=True):
        assert (one["name"], one["word"]) == (other["name"], other["word"])
        for key in ("ghosts", "tips", "flat"):
            np.testing.assert_allclose(
                one[key], other[key], atol=0.05
            )  # what a plan's samples may be off [mm]
    motion = plan["motion"]
    for end, k in zip(sketch["ends"], (0, -1), strict=True):
        for key in ("object", "pusher"):
            np.testing.assert_allclose(end[key][:2], motion[key][k][:2], atol=1e-4)
            assert np.cos(end[key][2] - motion[key][k][2]) == pytest.approx(1)
        assert end["height"] == motion["height"][k]
        assert end["tips"] == motion["segments"][k]["tips"]
    alone = [k for k, part in enumerate(motion["segments"]) if part["push"] is None]
    for way, number in zip(sketch["transits"], alone, strict=True):
        known = np.array(motion["pusher"])[np.array(motion["segment"]) == number, :2]
        np.testing.assert_allclose([way[0], way[-1]], [known[0], known[-1]], atol=0.2)


def test_what_is_opened_is_told_before_it_is_planned():
    """The server waits for it, and who asks for its plan finds all that it needs imported."""
    here, there = Pipe()
    made = worker._Worker(there)
    made._open({"file": None, "of": None})
    made._silence()
    _, kind, (scene, plan, runs, words) = heard(here)
    assert (kind, plan, runs) == ("opened", None, ())
    assert scene["units"] == {"length": "mm", "angle": "deg"}
    assert words["start"] == "start"
    assert list(made._planner._known)  # its pushes are known


def test_a_stored_plan_is_shown_itself_until_the_scene_is_another(short):
    """A plan that no planner would make: its cost is told to be 1 mm more, which verify finds out."""
    plan, document = short
    dearer = replace(plan, cost=plan.cost + 0.001)
    found = answers_of(
        [(0, 1, "keep", {"document": document, "plan": pickle.dumps(dearer)}), (1, 1, "plan", document)],
        "done",
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
    made = worker._Worker(there)
    assert made._planner
    made._silence()
    told = [json.loads(heard(here)[2]) for _ in range(2)]
    assert [(part["what"], part["done"], part["over"]) for part in told] == [
        ("steering.word", 0, False),
        ("steering.word", 1, True),
    ]


def test_many_runs_are_told_as_they_finish_and_are_those_of_simulate(short):
    plan, document = short
    asked = {"count": 25, "seed": 4, "position": 0.5, "angle": 0.5, "friction": 10}
    requests = [(0, 1, "keep", {"document": document, "plan": pickle.dumps(plan)}), (1, 1, "plan", document)]
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
