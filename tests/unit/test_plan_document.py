"""Plan documents, rollouts and exports: exact round trips, strict reading, files whole or not at all."""

import json
import os
import stat
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from flatpush.documents import (
    check_writable,
    export_csv,
    load_plan,
    parse_plan,
    plan_document,
    plan_schema,
    save_plan,
    save_rollouts,
    write_atomically,
)
from flatpush.errors import InputError
from flatpush.geometry import Outline
from flatpush.problem import (
    Arc,
    CarCentres,
    Certificate,
    Object,
    Plan,
    PushSegment,
    Rollout,
    Scene,
    TransitSegment,
)

SCENE = Scene(Object(Outline.circle(0.04), friction=0.3), start=(0.1, 0.2, 1 / 3), goal=(0, 0, 0))


def example(**changes: Any) -> Plan:
    rng = np.random.default_rng(1)
    push = PushSegment(
        push="from the left",
        word="LS",
        arcs=(Arc("left", rng.normal(size=3), 0.1, 1 / 3), Arc("straight", rng.normal(size=3), 0.7, 0.2)),
        times=np.array([0.0, 0.1, 0.8]),
        object=rng.normal(size=(3, 3)),
        pusher=rng.normal(size=(3, 3)),
        fingers=np.array([[0.0, 0.009], [0.0, -0.009]]),
    )
    end = push.pusher[-1]
    transit = TransitSegment(
        np.array([0.0, 0.5, 1.0]), np.array([end, end - 0.01, end - 0.02]), np.array([0, 0, 0.03])
    )
    values: dict[str, Any] = {
        "status": "solved",
        "scene": SCENE,
        "cost": 1 / 7,
        "duration": 1.8,
        "segments": (push, transit),
        "certificate": Certificate(
            (1e-17, -0.0, 2e-16),
            1 / 7,
            1.8,
            friction_margin=0.25,
            clearance=float("inf"),
            cars={"long edge": CarCentres((0.1, 0.0), (-0.1, 1 / 3), (0.0, 1.0))},
            warnings=("look out",),
            others={"n": 3},
        ),
        "run": {"version": "0.1.0", "planning_time": 0.04},
    }
    return Plan(**(values | changes))


def test_a_plan_reads_back_exactly(tmp_path: Path) -> None:
    plan, path = example(), tmp_path / "plan.json"
    plan.save(path)
    again = load_plan(path)
    assert plan_document(again) == plan_document(plan)
    assert (again.status, again.cost, again.duration, again.reason) == ("solved", 1 / 7, 1.8, "")
    for a, b in zip(plan.segments, again.segments, strict=True):
        assert type(a) is type(b)
        for name in ("times", "object", "pusher", "fingers", "height"):
            if hasattr(a, name):
                assert np.array_equal(getattr(a, name), getattr(b, name))
                assert getattr(b, name).dtype == np.float64
    assert [arc.twist.tolist() for arc in again.pushes[0].arcs] == [
        a.twist.tolist() for a in plan.pushes[0].arcs
    ]
    assert again.certificate == replace(plan.certificate, clearance=None)
    assert again.run == plan.run
    save_plan(again, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_the_document_is_the_contracts() -> None:
    document = plan_document(example())
    assert list(document) == [
        "flatpush",
        "status",
        "scene",
        "scene_digest",
        "cost",
        "duration",
        "run",
        "segments",
        "certificate",
    ]
    push, transit = document["segments"]
    assert list(push) == ["kind", "push", "word", "arcs", "times", "object", "pusher", "fingers"]
    assert list(push["arcs"][0]) == ["turn", "twist", "duration", "cost"]
    assert list(transit) == ["kind", "times", "pusher", "height"]
    assert document["flatpush"] == "plan/1"
    assert document["certificate"]["clearance"] is None
    assert document["scene"]["flatpush"] == "scene/1"
    jsonschema.Draft202012Validator(plan_schema()).validate(document)


def test_without_a_plan_the_cost_is_null(tmp_path: Path) -> None:
    plan = Plan("no_plan", SCENE, reason="no push can steer: raise the friction")
    save_plan(plan, tmp_path / "plan.json")
    document = json.loads((tmp_path / "plan.json").read_text())
    assert document["cost"] is None
    assert document["reason"] == plan.reason
    jsonschema.Draft202012Validator(plan_schema()).validate(document)
    again = load_plan(tmp_path / "plan.json")
    assert again.status == "no_plan"
    assert again.reason == plan.reason
    assert np.isnan(again.cost)


@pytest.mark.parametrize("changes", [{"cost": float("nan")}, {"duration": float("inf")}])
def test_numbers_that_are_not_finite_are_not_written(tmp_path: Path, changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(changes))):
        save_plan(example(**changes), tmp_path / "plan.json")
    assert not list(tmp_path.iterdir())


def test_samples_that_are_not_finite_are_not_written() -> None:
    bad = TransitSegment(np.array([0.0]), np.array([[0.0, np.nan, 0.0]]), np.array([0.0]))
    with pytest.raises(InputError, match=r"segments\[0\]\.pusher"):
        plan_document(example(segments=(bad,)))


def put(document: Any, path: list[Any], value: Any) -> Any:
    place = document
    for step in path[:-1]:
        place = place[step]
    if value is None:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return document


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["flatpush"], None, ["flatpush: this flatpush reads plan/1"]),
        (["flatpush"], "scene/1", ["got 'scene/1'", "This is a scene"]),
        (["status"], "done", ["status: 'solved' or 'no_plan' is needed, got 'done'"]),
        (["status"], "no_plan", ["cost: without a plan there is no cost"]),
        (["scene"], None, ["scene: this key is missing"]),
        (["scene", "object", "friction"], -1, ["scene.object.friction: a number of at least 0", "got -1"]),
        (["scene", "start"], [0, 0, 90], ["scene.start[2]: an angle", "got 90"]),
        (["cost"], "1", ["cost: a number is needed, got '1'"]),
        (["duration"], -1, ["duration: a number of at least 0"]),
        (["segment"], [], ["segment: unknown key", "Did you mean 'segments'?"]),
        (["segments", 0, "kind"], "pull", ["segments[0].kind: 'push' is needed, got 'pull'"]),
        (["segments", 0], 3, ["segments[0]: a mapping"]),
        (["segments", 0, "arcs", 1, "turn"], "up", ["segments[0].arcs[1].turn:", "got 'up'"]),
        (["segments", 0, "arcs", 0, "twist"], [1, 2], ["segments[0].arcs[0].twist: at least 3 entries"]),
        (["segments", 0, "object", 1, 2], float("nan"), ["segments[0].object[1][2]: a finite number"]),
        (
            ["segments", 0, "times"],
            [0.0, 0.1],
            ["segments[0].object: there is one entry for each of the 2 times"],
        ),
        (["segments", 0, "times"], [0.1, 0.2, 0.3], ["segments[0].times: times start at 0"]),
        (
            ["segments", 0, "times"],
            [0.0, 0.2, 0.1],
            ["segments[0].times: times start at 0 and never go back"],
        ),
        (
            ["segments", 1, "height"],
            [0.0],
            ["segments[1].height: there is one entry for each of the 3 times"],
        ),
        (["segments", 0, "fingers"], [], ["segments[0].fingers: at least 1"]),
    ],
)
def test_an_edited_plan_is_refused(path: list[Any], value: Any, words: list[str], tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(put(plan_document(example()), path, value)))
    with pytest.raises(InputError) as caught:
        load_plan(file)
    assert str(caught.value).startswith(f"{file}: ")
    for word in words:
        assert word in str(caught.value)


def test_parse_plan_takes_the_document() -> None:
    assert plan_document(parse_plan(plan_document(example()))) == plan_document(example())


def test_rollouts(tmp_path: Path) -> None:
    rollout = Rollout(
        np.zeros(3), np.array([0.0]), np.zeros((1, 3)), np.ones((1, 3)), ("rest",), "completed", 3
    )
    save_rollouts([rollout, rollout], tmp_path / "runs.json")
    document = json.loads((tmp_path / "runs.json").read_text())
    assert document["flatpush"] == "rollouts/1"
    assert document["rollouts"][1] == {
        "outcome": "completed",
        "seed": 3,
        "final_pose": [0.0, 0.0, 0.0],
        "times": [0.0],
        "object": [[0.0, 0.0, 0.0]],
        "pusher": [[1.0, 1.0, 1.0]],
        "modes": ["rest"],
    }


def test_csv_times_run_on_and_poses_are_those_of_the_base_frame(tmp_path: Path) -> None:
    plan = example()
    assert export_csv(plan, tmp_path / "a.csv") == 5
    assert export_csv(plan, tmp_path / "b.csv", base_frame=(1.0, 2.0, 0.5, np.pi / 2)) == 5
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == "t [s],x [m],y [m],z [m],yaw [rad],segment"
    a, b = (np.loadtxt(tmp_path / name, delimiter=",", skiprows=1) for name in ("a.csv", "b.csv"))
    np.testing.assert_allclose(a[:, 0], [0, 0.1, 0.8, 1.3, 1.8], atol=1e-9)
    np.testing.assert_allclose(a[:3, [1, 2, 4]], plan.pushes[0].pusher, atol=1e-9)
    assert a[:, 3].tolist() == [0, 0, 0, 0, 0.03]
    assert a[:, 5].tolist() == [0, 0, 0, 1, 1]
    # A quarter turn takes x to y and y to -x.
    np.testing.assert_allclose(b[:, 1], 1 - a[:, 2], atol=2e-9)
    np.testing.assert_allclose(b[:, 2], 2 + a[:, 1], atol=2e-9)
    np.testing.assert_allclose(b[:, 3], 0.5 + a[:, 3], atol=2e-9)
    np.testing.assert_allclose(b[:, 4], a[:, 4] + np.pi / 2, atol=2e-9)


def test_csv_of_no_plan_or_a_bad_frame_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="only a solved plan"):
        export_csv(Plan("no_plan", SCENE, reason="why"), tmp_path / "a.csv")
    for frame in ((1, 2, 3), (1, 2, 3, float("nan"))):
        with pytest.raises(InputError, match="four finite numbers"):
            export_csv(example(), tmp_path / "a.csv", frame)
    assert export_csv(example(segments=()), tmp_path / "empty.csv") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["empty.csv"]


def test_a_failure_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk and Ctrl-C, before and after the data are written."""
    path = tmp_path / "plan.json"
    path.write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    for name in ("fsync", "replace"):
        with monkeypatch.context() as patch:
            patch.setattr(os, name, full)
            with pytest.raises(InputError, match=r"plan\.json: this file cannot be written \(no space left"):
                write_atomically(path, "new")
            patch.setattr(os, name, interrupt)
            with pytest.raises(KeyboardInterrupt):
                write_atomically(path, "new")
        assert [p.name for p in tmp_path.iterdir()] == ["plan.json"]
        assert path.read_text() == "old"
    write_atomically(path, "new")
    assert path.read_text() == "new"
    write_atomically(path, b"\x00\x01")
    assert path.read_bytes() == b"\x00\x01"


def test_mode_and_links_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    write_atomically(link, "new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_devices_are_written_to_directly() -> None:
    write_atomically("/dev/null", "text")
    assert Path("/dev/null").is_char_device()
    with pytest.raises(InputError, match="no space left"):
        write_atomically("/dev/full", "text")


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    for act in (check_writable, lambda path: write_atomically(path, "")):
        with pytest.raises(InputError, match="it is a directory"):
            act(tmp_path)
        with pytest.raises(InputError, match="There is no folder"):
            act(tmp_path / "none" / "plan.json")
    check_writable(tmp_path / "plan.json")
    assert not list(tmp_path.iterdir())
