"""Every drawing of tests/data/drawings gives its outline, or its refusal by name and place."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from flatpush.documents import load_scene
from flatpush.errors import InputError
from flatpush.geometry import Outline

FOLDER = Path(__file__).parents[1] / "data" / "drawings"
CASES = yaml.safe_load((FOLDER / "cases.yaml").read_text(encoding="utf-8"))
# Of the size, twice: curves are polygons within this of what is drawn.
FLATNESS = 1e-4


def scene(folder: Path, case: dict[str, Any]) -> Path:
    if case["file"].endswith(".dxf"):
        pytest.importorskip("ezdxf")
    outline = {"file": str(FOLDER / case["file"]), **case.get("choice", {})}
    path = folder / "scene.yaml"
    document = {
        "flatpush": "scene/1",
        "units": {"length": "mm", "angle": "deg"},
        "object": {"outline": outline, "friction": 0.3},
        "start": [0, 0, 0],
        "goal": [50, 0, 0],
    }
    path.write_text(yaml.safe_dump(document))
    return path


def area(outline: Outline) -> float:
    x, y = outline.vertices.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


@pytest.mark.parametrize("case", CASES, ids=[case["file"] for case in CASES])
def test_drawing(tmp_path: Path, case: dict[str, Any]) -> None:
    from flatpush.documents import outline_note

    path = scene(tmp_path, case)
    if "refusal" in case:
        with pytest.raises(InputError) as caught:
            load_scene(path)
        assert caught.value.hint
        for word in (case["file"], *case["refusal"]):
            assert word in str(caught.value)
        return
    outline = load_scene(path).object.outline
    mm = 1000 * outline.vertices
    size = float(np.max(np.ptp(mm, axis=0)))
    found = [*mm.min(axis=0), *mm.max(axis=0)]
    np.testing.assert_allclose(found, case["bounds"], atol=2 * FLATNESS * size)
    assert 1e6 * area(outline) == pytest.approx(case["area"], rel=8 * FLATNESS)
    note = outline_note(path)
    assert note is not None
    told = "\n".join(note.lines)
    for word in case.get("left_out", []):
        assert word in told


def test_there_are_enough() -> None:
    on_disk = {path.name for path in FOLDER.iterdir()} - {"cases.yaml"}
    assert on_disk >= {case["file"] for case in CASES}
    assert len(CASES) >= 60
