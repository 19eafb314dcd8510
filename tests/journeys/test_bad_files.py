"""What is no document at all, or too much of one, is refused in one message; an output never takes an input's place."""

import json
import os
from pathlib import Path

import pytest
from tests.journeys.test_bad_input import GOOD, NAN, refusal

from flatpush.documents import check_outputs, load_pairs
from flatpush.documents.calibration_file import load_calibration
from flatpush.documents.camera_file import load_camera
from flatpush.documents.surface_file import load_surface
from flatpush.errors import InputError

TEXTS: list[tuple[str, str, bytes, list[str]]] = [
    ("empty", "s.yaml", b"", ["the file is empty", "flatpush init"]),
    ("blank", "s.json", b" \n", ["the file is empty", "flatpush init"]),
    ("only a comment", "s.yaml", b"# nothing\n", ["the file is empty"]),
    ("binary", "s.yaml", bytes(range(256)), ["not text in UTF-8", "binary"]),
    ("zeros", "s.json", b"\0" * 100, ["not text in UTF-8"]),
    ("other encoding", "s.yaml", "flatpush: scene/1".encode("utf-16"), ["not text in UTF-8"]),
    ("a list", "s.yaml", b"- 1\n- 2\n", ["a mapping of keys to values, got [1, 2]"]),
    ("a word", "s.yaml", b"hello", ["a mapping of keys to values, got 'hello'"]),
    ("cut off YAML", "s.yaml", b"flatpush: scene/1\nstart: [1, 2", ["not YAML: line ", "complete"]),
    (
        "cut off JSON",
        "s.json",
        b'{"flatpush": "scene/1", "start": [1, 2',
        ["not JSON: line 1, column ", "complete"],
    ),
    ("JSON by its content", "scene", b'{"flatpush": "scene/1", ', ["not JSON"]),
    ("tabs", "s.yaml", b"object:\n\tname: x\n", ["not YAML: line 2"]),
    ("two documents", "s.yaml", b"a: 1\n---\nb: 2\n", ["one document"]),
    (
        "twice in YAML",
        "s.yaml",
        b"object: {x: [1, {name: a, name: b}]}",
        ["object.x[1].name: this key stands twice"],
    ),
    ("twice in JSON", "s.json", b'{"a": [{"b": 1, "b": 2}]}', ["a[0].b: this key stands twice", "Keep one"]),
    ("twice at the top", "s.yaml", b"start: [1]\nstart: [2]\n", ["start: this key stands twice"]),
    ("twice, quoted", "s.yaml", b"start: [1]\n'start': [2]\n", ["start: this key stands twice"]),
    ("aliases", "s.yaml", b"a: &x [1]\nb: [*x, *x]\n", ["b[0]: aliases", "got '*x'", "Write it out"]),
    ("code", "s.yaml", b"a: !!python/object/apply:os.system [ls]\n", ["a: tags", "python/object"]),
    ("deep YAML", "s.yaml", b"[" * 100000, ["at most 60 levels"]),
    ("deep JSON", "s.json", b"[" * 100000, ["at most 60 levels"]),
    ("rather deep JSON", "s.json", b'{"a":' * 200 + b"1" + b"}" * 200, ["at most 60 levels"]),
    ("a list as key", "s.yaml", b"? [1, 2]\n: 3\n", ["a key is a word"]),
    (
        "crowded",
        "s.yaml",
        b"a: [" + (b"[" + b"1," * 1000 + b"],") * 330 + b"]",
        ["at most 320000 keys, values and"],
    ),
    ("large", "s.yaml", b"#" * 2_000_001, ["at most 2 MB"]),
    (
        "NaN in JSON",
        "s.json",
        json.dumps({**GOOD, "start": [1, NAN, 2]}).encode(),
        ["start[1]: a finite number"],
    ),
    ("endless digits", "s.json", b'{"flatpush": "scene/1", "start": [%b]}' % (b"1" * 5000), ["s.json: "]),
]


@pytest.mark.parametrize(
    ("name", "content", "words"), [case[1:] for case in TEXTS], ids=[case[0] for case in TEXTS]
)
def test_file_is_refused(tmp_path: Path, name: str, content: bytes, words: list[str]) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    error = refusal(path)
    assert str(error).startswith(f"{path}: ")
    for word in words:
        assert word in str(error)
    assert len(str(error)) < 600


@pytest.mark.parametrize("load", [load_camera, load_calibration, load_surface])
def test_a_document_of_another_kind_is_told_before_its_keys(tmp_path: Path, load) -> None:
    path = tmp_path / "plan.json"
    path.write_text('{"status": "solved", "flatpush": "plan/1"}')
    with pytest.raises(
        InputError, match=r"this flatpush reads \w+/1 here, got 'plan/1'. Is it the right file"
    ):
        load(path)


def test_paths_that_cannot_be_read(tmp_path: Path) -> None:
    assert "no such file" in str(refusal(tmp_path / "none.yaml"))
    assert "There is no folder" in str(refusal(tmp_path / "none" / "scene.yaml"))
    assert "directory" in str(refusal(tmp_path))
    assert "cannot be read" in str(refusal(Path("a\0b")))
    if os.geteuid() != 0:  # the superuser may read everything
        locked = tmp_path / "locked.yaml"
        locked.write_text("flatpush: scene/1")
        locked.chmod(0)
        assert "permission denied" in str(refusal(locked))


@pytest.mark.parametrize("kind", ["json", "yaml"])
def test_the_first_entry_too_many_of_a_file_ends_its_reading(tmp_path, kind):
    """10 MB of numbers took three seconds as JSON and fifteen as YAML: all of them were read first."""
    file = tmp_path / f"scene.{kind}"
    text = '{"flatpush": "scene/1", "object": {"outline": [' + "1.5," * 200_000 + "1.5]}}"
    file.write_text(text)
    error = refusal(file)
    assert "a list has at most 100000 entries" in str(error)
    assert error.key == "object.outline"
    file.write_text("[" + "1.5," * 200_000 + "1.5]")
    assert len(str(refusal(file))) < 400


def test_measured_numbers_beyond_all_measure_are_bad_rows(tmp_path):
    """1e308 ended in a singular value decomposition that did not converge."""
    rows = ["fx,fy,tau,vx,vy,omega", *["1,0.2,0.01,0.02,0.003,0.1"] * 3, ",".join(["1e308"] * 6)]
    file = tmp_path / "pairs.csv"
    file.write_text("\n".join(rows) + "\n")
    with pytest.raises(InputError, match="beyond 1e\\+09"):
        load_pairs(file)


@pytest.mark.parametrize("link", [False, True])
def test_an_output_does_not_take_the_place_of_an_input(tmp_path, link):
    scene, output = tmp_path / "scene.yaml", tmp_path / "scene.yaml"
    scene.write_text("what the user had")
    if link:
        output = tmp_path / "figure.svg"
        output.symlink_to(scene)
    with pytest.raises(InputError, match="an input of this command"):
        check_outputs([scene], [output])
    same = tmp_path / "same.svg"
    with pytest.raises(InputError, match="another output"):
        check_outputs([scene], [same, None, tmp_path / "." / "same.svg"])
    check_outputs([scene], [same, tmp_path / "other.svg"])
    assert scene.read_text() == "what the user had"
