"""Every drawing of tests/data/drawings gives its outline, or its refusal by name and place."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from tests.extras import extra
from tests.listed import listed

from flatpush.documents import load_scene
from flatpush.errors import InputError
from flatpush.geometry import Outline, cross

FOLDER = Path(__file__).parents[1] / "data" / "drawings"
CASES = listed(FOLDER / "cases.yaml")
# Of the size, twice: curves are polygons within this of what is drawn.
FLATNESS = 1e-4


def scene(folder: Path, case: dict[str, Any]) -> Path:
    if case["file"].endswith(".dxf"):
        pytest.importorskip("ezdxf", reason=extra("shapes"))
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


@pytest.mark.parametrize(
    ("name", "area", "sides"),
    [
        # An L of 60 × 20 and 20 × 20 with two corners rounded by 5, turned by 90° by its group.
        ("bracket", 1600 - 2 * (1 - np.pi / 4) * 25, (40, 60)),
        # A plate of 80 × 50 without a triangle of 60 × 20, three corners rounded by 10.
        ("workshop", 4000 - 600 - 3 * (1 - np.pi / 4) * 100, (80, 50)),
    ],
)
def test_newcomers_need_six_lines(name: str, area: float, sides: tuple[float, float]) -> None:
    """A bracket on an A4 page with layers, and a workshop drawing with centre lines, dimension and title block.

    That each of them gets a plan is tested by command, with all examples.
    """
    path = Path(__file__).parents[2] / "examples" / f"{name}.yaml"
    if name == "workshop":
        pytest.importorskip("ezdxf", reason=extra("shapes"))
    said = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert len(said) <= 6
    outline = load_scene(path).object.outline
    assert 1e6 * outline.area == pytest.approx(area, rel=8 * FLATNESS)
    np.testing.assert_allclose(1e3 * np.ptp(outline.vertices, axis=0), sides, rtol=4 * FLATNESS)
    np.testing.assert_allclose(outline.centroid, 0.0, atol=1e-15)


def ellipse(tilt: float, rows: int = 300, columns: int = 340) -> np.ndarray:
    """A mask of a tilted ellipse with half axes of 100 and 60 pixels, about the middle of the picture."""
    y, x = np.mgrid[:rows, :columns] + 0.5
    x, y = x - columns / 2, rows / 2 - y
    u, v = x * np.cos(tilt) + y * np.sin(tilt), y * np.cos(tilt) - x * np.sin(tilt)
    return (u / 100) ** 2 + (v / 60) ** 2 <= 1


def off_ellipse(points: np.ndarray, tilt: float) -> float:
    """The largest distance of points from that ellipse about the origin, to first order [pixels]."""
    x, y = points.T
    u, v = x * np.cos(tilt) + y * np.sin(tilt), y * np.cos(tilt) - x * np.sin(tilt)
    value = (u / 100) ** 2 + (v / 60) ** 2 - 1
    return float(np.max(np.abs(value) / (2 * np.hypot(u / 100**2, v / 60**2))))


def bitmap_scene(folder: Path, pixels: np.ndarray, **outline: Any) -> Path:
    from PIL import Image

    Image.fromarray(pixels).save(folder / "mask.png")
    path = scene(folder, {"file": "mask.png"})
    document = yaml.safe_load(path.read_text())
    document["object"]["outline"] = {"file": "mask.png", "pixel": 0.5, **outline}
    path.write_text(yaml.safe_dump(document))
    return path


@pytest.mark.parametrize("kind", ["mask", "photograph", "transparent", "sixteen bits"])
def test_a_bitmap_gives_the_smooth_shape(tmp_path: Path, kind: str) -> None:
    tilt = 0.4
    inside = ellipse(tilt)
    if kind == "mask":
        pixels = np.where(inside, 255, 0).astype(np.uint8)
    elif kind == "photograph":  # dark on light, uneven, with a speck of dirt and a bright spot on the object
        rng = np.random.default_rng(1)
        pixels = (np.where(inside, 60, 200) + rng.normal(0, 4, inside.shape)).astype(np.uint8)
        pixels[20:23, 20:23] = 60
        pixels[145:155, 160:175] = 200
    elif kind == "sixteen bits":  # both above 255, to which they were cut off
        pixels = np.where(inside, 40_000, 500).astype(np.uint16)
    else:
        pixels = np.zeros((*inside.shape, 4), dtype=np.uint8)
        pixels[..., 3] = np.where(inside, 255, 0)
    path = bitmap_scene(tmp_path, pixels, origin=[85, -75])
    outline = load_scene(path).object.outline
    assert len(outline.vertices) < 150
    assert off_ellipse(outline.vertices / 0.5e-3, tilt) < 1.0
    assert outline.area == pytest.approx(np.pi * 100 * 60 * 0.5e-3**2, rel=5e-3)
    from flatpush.documents import outline_note

    note = outline_note(path)
    assert note is not None
    assert "within 0.5 mm" in note.lines[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("two", "2 objects, not one"),
        ("edge", "touches the edge"),
        ("empty", "shows no object"),
        ("uneven", "background of the bitmap is not plain"),
        ("neck", "thinner than three pixels"),
        ("point", "thinner than three pixels"),
        ("shadow", "may be a shadow"),
    ],
)
def test_bad_bitmaps(tmp_path: Path, change: str, words: str) -> None:
    pixels = np.where(ellipse(0.0), 255, 0).astype(np.uint8)
    if change == "two":
        pixels[:40, 10:40] = pixels[250:290, 10:40] = 0
        pixels[10:40, 10:40] = 255
    elif change == "edge":
        pixels[:160, 160] = 255
    elif change == "empty":
        pixels[:] = 0
    elif change == "neck":  # two squares that touch at a corner: the larger one became the object
        pixels[:] = 0
        pixels[20:100, 20:120] = pixels[100:200, 120:220] = 255
    elif change == "point":  # was a traceback
        pixels[:] = 0
        pixels[100, 100] = 255
    elif change == "shadow":  # half as dark as the object: a part of it was taken for the object
        soft = np.mean([np.roll(pixels, (k, k), (0, 1)) for k in range(4, 24)], axis=0)
        pixels = (200 - 0.28 * soft * (pixels == 0) - 0.55 * pixels).astype(np.uint8)
    else:
        pixels[:, :] = np.linspace(0, 255, pixels.shape[1]).astype(np.uint8)
    with pytest.raises(InputError, match=words) as caught:
        load_scene(bitmap_scene(tmp_path, pixels))
    assert "mask.png" in str(caught.value)


def test_a_photograph_is_read_as_it_is_seen(tmp_path: Path) -> None:
    """A camera stores how it was held; the outline was turned by 90° against the picture on the screen."""
    from PIL import Image

    path = bitmap_scene(tmp_path, np.where(ellipse(0.0), 255, 0).astype(np.uint8), origin="centroid")
    lying = load_scene(path).object.outline
    with Image.open(tmp_path / "mask.png") as image:
        held = Image.Exif()
        held[0x0112] = 6  # turn it by 90° to see it upright
        image.save(tmp_path / "mask.png", exif=held)
    standing = load_scene(path).object.outline
    np.testing.assert_allclose(
        np.ptp(standing.vertices, axis=0), np.ptp(lying.vertices, axis=0)[::-1], atol=1e-4
    )


def test_what_is_no_bitmap_and_a_missing_pixel_are_refused(tmp_path: Path) -> None:
    path = bitmap_scene(tmp_path, np.where(ellipse(0.0), 255, 0).astype(np.uint8))
    (tmp_path / "mask.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"no picture")
    with pytest.raises(InputError, match="not a bitmap"):
        load_scene(path)
    path.write_text(path.read_text().replace("pixel: 0.5", "turn: 0"))
    with pytest.raises(InputError, match="needs the side of a pixel"):
        load_scene(path)


def steps(mask: np.ndarray) -> np.ndarray:
    """The outline of a mask along the sides of its pixels: a walk with the inside to its left."""
    padded = np.pad(mask, 1).astype(int)
    ends: dict[tuple[int, int], tuple[int, int]] = {}
    for r, c in np.argwhere(padded):
        x, y = int(c), -int(r)  # the upper left corner of the pixel, y up
        for (dr, dc), start, end in (
            ((1, 0), (x, y - 1), (x + 1, y - 1)),
            ((0, 1), (x + 1, y - 1), (x + 1, y)),
            ((-1, 0), (x + 1, y), (x, y)),
            ((0, -1), (x, y), (x, y - 1)),
        ):
            if not padded[r + dr, c + dc]:
                ends[start] = end
    first = here = next(iter(ends))
    walk = []
    while True:
        walk.append(here)
        here = ends[here]
        if here == first:
            break
    corners = np.array(walk)
    turns = cross(np.roll(corners, -1, axis=0) - corners, corners - np.roll(corners, 1, axis=0))
    return corners[turns != 0]


def test_an_outline_of_pixel_steps_is_made_smooth(tmp_path: Path) -> None:
    """Hundreds of steps took 86 s and then had no push; now they are the ellipse that they were drawn from."""
    from flatpush.documents import outline_note

    tilt = 0.4
    corners = 0.5 * steps(ellipse(tilt))
    assert len(corners) > 300
    path = scene(tmp_path, {"file": "none.svg"})
    document = yaml.safe_load(path.read_text())
    document["object"]["outline"] = corners.tolist()
    path.write_text(yaml.safe_dump(document))
    outline = load_scene(path).object.outline
    assert len(outline.vertices) < 150
    assert off_ellipse((outline.vertices - outline.centroid) / 0.5e-3, tilt) < 1.0
    note = outline_note(path)
    assert note is not None
    assert "corners of pixels, made smooth within 0.5 mm" in note.lines[0]


@pytest.mark.slow
def test_the_steps_of_a_mask_have_the_pushes_of_the_smooth_shape() -> None:
    """The flat parts of the ellipse kept their long steps: eight pushes at them, and plans 20 % cheaper than true."""
    import flatpush as fp
    from flatpush.documents.bitmap import without_steps

    tilt, pixel = 0.3, 0.2e-3
    y, x = pixel * (np.mgrid[-300:300, -300:300] + 0.5)
    u, v = x * np.cos(tilt) - y * np.sin(tilt), y * np.cos(tilt) + x * np.sin(tilt)
    corners = pixel * steps((u / 0.054) ** 2 + (v / 0.032) ** 2 <= 1)
    assert len(corners) > 900
    found = without_steps(corners - (corners.max(axis=0) + corners.min(axis=0)) / 2)
    assert found is not None
    t = 2 * np.pi * np.arange(300) / 300
    axes = np.array([(np.cos(tilt), np.sin(tilt)), (-np.sin(tilt), np.cos(tilt))])
    true = np.column_stack([0.054 * np.cos(t), 0.032 * np.sin(t)]) @ axes
    costs, counts = [], []
    for outline in (found[0], true):
        thing = fp.Object(Outline.polygon(outline))
        planner = fp.Planner(fp.Scene(thing, (0.1, 0.05, 1), pusher=fp.Pusher(2, spacing=0.018)))
        counts.append(len(planner.scene.pushes))
        starts = [(0.1, 0.05, 1.0), (-0.1, 0.05, 2.0), (0.15, -0.1, -2.0)]
        costs.append([fp.plan(replace(planner.scene, start=start)).cost for start in starts])
    assert counts == [4, 4]
    np.testing.assert_allclose(costs[0], costs[1], rtol=0.02)


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.7])
def test_straight_sides_of_a_mask_meet_in_their_corners(turn: float) -> None:
    """The blur that takes away the steps rounded them by more than a pixel, and pushes stood there."""
    from flatpush.documents.bitmap import smooth_outline

    y, x = np.mgrid[-150:150, -150:150] + 0.5
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    found = smooth_outline((np.abs(u) < 90) & (np.abs(v) < 60))
    assert found is not None
    x, y = (found - 150).T
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    assert len(found) < 9
    for corner in ((90, 60), (90, -60), (-90, 60), (-90, -60)):
        assert np.hypot(u - corner[0], v - corner[1]).min() < 0.5


def test_corners_within_a_straight_side_of_pixels_do_not_matter() -> None:
    """A tracer that lists the corners of every pixel: its outline was taken with all the steps."""
    from flatpush.documents.bitmap import without_steps

    rows = np.arange(-40, 40)
    widths = np.floor(70 * np.sqrt(1 - ((rows + 0.5) / 40) ** 2))
    right = [(w, float(r + side)) for w, r in zip(widths, rows, strict=True) for side in (0, 1)]
    every = np.array([*right, *((-x, y) for x, y in reversed(right))])
    found = without_steps(every)
    assert found is not None
    smooth, tolerance = found
    x, y = smooth.T
    assert tolerance == 1.0
    assert abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2 == pytest.approx(2 * widths.sum(), rel=0.01)
    sides = np.roll(smooth, -1, axis=0) - smooth
    turns = np.abs(np.diff(np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))))
    assert turns.max() < np.deg2rad(60)  # steps turn by 90°


def test_a_rack_is_not_an_outline_of_pixels() -> None:
    """Teeth run along the axes in equal steps too, but turn twice the same way."""
    from flatpush.documents.bitmap import without_steps

    teeth = [(x, y) for k in range(50) for x, y in ((2 * k, 0), (2 * k, 1), (2 * k + 1, 1), (2 * k + 1, 0))]
    assert without_steps(np.array([*teeth, (99.0, -5.0), (0.0, -5.0)])) is None


def test_a_scene_tells_which_files_it_refers_to(tmp_path: Path) -> None:
    from flatpush.documents import scene_files

    path = scene(tmp_path, {"file": "use.svg"})
    document = yaml.safe_load(path.read_text())
    document["object"]["surface"] = {"file": "surface.json"}
    path.write_text(yaml.safe_dump(document))
    assert scene_files(path) == (path, FOLDER / "use.svg", tmp_path / "surface.json")
    from flatpush.documents import as_read, plan_files

    (tmp_path / "plans").mkdir()
    plan = tmp_path / "plans" / "plan.json"
    run = {"read": as_read(path, plan)}
    assert run["read"][2] == "../surface.json"
    assert [file.resolve() for file in plan_files(plan, run)] == [plan, *map(Path.resolve, scene_files(path))]
    assert plan_files(plan, {}) == plan_files(plan, {"read": "scene.yaml"}) == (plan,)


@pytest.mark.parametrize("target", ["part.svg", "scene.yaml", "again.svg"])
@pytest.mark.parametrize(
    ("command", "output"),
    [
        ("plan", "output"), ("plan", "figure"), ("plan", "snapshots"), ("describe", "figure"),
        ("identify", "output"), ("identify", "figure"), ("run", "log"), ("run", "figure"),
    ],
)  # fmt: skip
def test_no_output_takes_the_place_of_what_a_scene_refers_to(
    tmp_path: Path, command: str, output: str, target: str
) -> None:
    """`identify --scene` and `run --scene` did; again.svg is another name of the drawing."""
    from importlib import import_module

    (tmp_path / "part.svg").write_bytes((FOLDER / "use.svg").read_bytes())
    (tmp_path / "again.svg").hardlink_to(tmp_path / "part.svg")
    path = scene(tmp_path, {"file": str(tmp_path / "part.svg")})
    for name in ("plan.json", "pairs.csv"):
        (tmp_path / name).write_text("{}")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    inputs = {
        "plan": {"scene": path},
        "describe": {"scene": path},
        "identify": {"data": [tmp_path / "pairs.csv"], "scene": path},
        "run": {"plan": tmp_path / "plan.json", "robot": "sim", "scene": path},
    }[command]
    with pytest.raises(InputError, match="an input of this command"):
        import_module(f"flatpush.cli.{command}").command(**inputs, **{output: tmp_path / target})
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_how_wide_the_line_of_a_hole_is_is_not_told(tmp_path: Path) -> None:
    """The hole is left out whole, so that its line takes nothing from the outline."""
    from flatpush.documents import outline_note

    case = next(case for case in CASES if case["file"] == "wide_hole.svg")
    note = outline_note(scene(tmp_path, case))
    assert note is not None
    assert not any("of the width" in line for line in note.lines)
