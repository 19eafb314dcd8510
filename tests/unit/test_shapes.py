"""Outlines from drawings: SVG and DXF."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from tests.extras import extra

from flatpush.documents import load_scene
from flatpush.documents.contours import outer_contour
from flatpush.documents.drawing import Curve, Drawing
from flatpush.documents.shapes import load_drawing
from flatpush.errors import InputError, MissingExtra

MM = 1e-3


def load_outline(path, unit):
    return load_drawing(path, unit).outline


def svg(folder: Path, body: str, attributes: str = "") -> Path:
    path = folder / "part.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {attributes}>{body}</svg>')
    return path


def corners(outline: np.ndarray) -> list[tuple[float, float]]:
    return sorted((round(float(x) * 1e6) / 1e3, round(float(y) * 1e6) / 1e3) for x, y in outline)


TRIANGLE = '<polygon points="0,0 59,0 59,-28.5"/>'


def test_y_points_up_and_a_unit_is_the_scenes(tmp_path: Path) -> None:
    outline = load_outline(svg(tmp_path, TRIANGLE), MM)
    assert corners(outline.vertices) == [(0, 0), (59, 0), (59, 28.5)]
    assert outline.area == pytest.approx(59 * 28.5 / 2 * MM**2)
    px = load_outline(svg(tmp_path, TRIANGLE, 'width="590px" height="285px" viewBox="0 0 59 28.5"'), MM)
    assert np.array_equal(px.vertices, outline.vertices)


def test_a_drawing_with_a_real_size_has_it(tmp_path: Path) -> None:
    path = svg(tmp_path, TRIANGLE, 'width="118mm" height="5.7cm" viewBox="0 0 59 28.5"')
    assert corners(load_outline(path, 1.0).vertices) == [(0, 0), (118, 0), (118, 57)]


def test_a_stretched_drawing_is_refused(tmp_path: Path) -> None:
    path = svg(tmp_path, TRIANGLE, 'width="59mm" height="59mm" viewBox="0 0 59 28.5"')
    with pytest.raises(InputError, match="same proportions") as caught:
        load_outline(path, MM)
    assert str(path) in str(caught.value)


def test_transforms_are_applied(tmp_path: Path) -> None:
    body = '<g transform="translate(10,5)"><rect width="20" height="10" transform="scale(2)"/></g>'
    assert corners(load_outline(svg(tmp_path, body), MM).vertices) == [
        (10, -25),
        (10, -5),
        (50, -25),
        (50, -5),
    ]


@pytest.mark.parametrize(
    "body",
    [
        '<circle cx="3" cy="-4" r="20"/>',
        '<path d="M 23 -4 A 20 20 0 0 1 -17 -4 A 20 20 0 0 1 23 -4 Z"/>',
        '<path d="M 23 -4 A 20 20 0 0 1 -17 -4"/><path d="M 23 -4 A 20 20 0 0 0 -17 -4"/>',
    ],
)
def test_curves_keep_within_their_flatness(tmp_path: Path, body: str) -> None:
    outline = load_outline(svg(tmp_path, body), MM)
    radii = np.hypot(*(outline.vertices - [3 * MM, 4 * MM]).T)
    np.testing.assert_allclose(radii, 20 * MM, rtol=1e-6)
    middles = (outline.vertices + np.roll(outline.vertices, 1, axis=0)) / 2
    sag = 20 * MM - np.hypot(*(middles - [3 * MM, 4 * MM]).T)
    assert np.max(sag) <= 1e-4 * 40 * MM
    assert len(outline.vertices) < 400


def test_bezier_curves(tmp_path: Path) -> None:
    """A quadratic arch over a base of 20: area 2/3 of base times height."""
    outline = load_outline(svg(tmp_path, '<path d="M 0 0 Q 10 -20 20 0 Z"/>'), MM)
    assert outline.area == pytest.approx(2 / 3 * 20 * 10 * MM**2, rel=1e-3)


def test_holes_are_left_out(tmp_path: Path) -> None:
    body = '<rect width="20" height="10"/><circle cx="5" cy="5" r="2"/>'
    assert len(load_outline(svg(tmp_path, body), MM).vertices) == 4


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("", "no lines"),
        ('<text x="1" y="1">hello</text>', "no lines"),
        ('<path d="M 0 0 L 10 0 L 10 10" fill="none" stroke="black"/>', "not closed"),
        (
            '<circle cx="4" cy="4" r="2"/><path d="M 0 0 H 9 V 9 H 0 V 1" fill="none" stroke="black"/>',
            "not closed",
        ),
        ('<rect width="9" height="9"/><rect x="20" width="9" height="9"/>', "2 outer contours"),
        ('<rect width="9" height="9"/><rect x="4" y="4" width="9" height="4"/>', "2 outer contours"),
        ('<path d="M 0 0 L 10 10 L 10 0 L 0 8 Z"/>', "cross"),
        ('<path d="M 0 0 L 10"/>', "part.svg: "),
        ("<rect", "not a drawing in SVG"),
        ('<rect width="9" height="9" transform="wobble(3)"/>', "<rect> in line 1: its transform"),
    ],
)
def test_bad_svg(tmp_path: Path, body: str, words: str) -> None:
    path = svg(tmp_path, body)
    with pytest.raises(InputError, match=words) as caught:
        load_outline(path, MM)
    assert str(path) in str(caught.value)
    assert caught.value.hint


def test_entities_and_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.svg"
    path.write_text('<!DOCTYPE svg [<!ENTITY a "aaaa">]><svg xmlns="http://www.w3.org/2000/svg">&a;</svg>')
    with pytest.raises(InputError, match="entities"):
        load_outline(path, MM)
    for name, content in (("a.svg", bytes(range(256))), ("a.dxf", bytes(range(256))), ("b.dxf", b"hello\n")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=name):
            load_outline(tmp_path / name, MM)
    with pytest.raises(InputError, match=r"svg or \.dxf"):
        load_outline(tmp_path / "part.stl", MM)
    with pytest.raises(InputError, match="cannot be read"):
        load_outline(tmp_path / "none.dxf", MM)


def test_a_scene_finds_its_drawing_beside_it(tmp_path: Path) -> None:
    svg(tmp_path, TRIANGLE)
    scene = tmp_path / "scene.yaml"
    text = "flatpush: scene/1\nunits: {length: cm}\nobject: {outline: {file: part.svg}, friction: 0.3}\n"
    scene.write_text(text + "start: [1, 2, 0]\ngoal: [0, 0, 0]\n")
    outline = load_scene(scene).object.outline
    assert np.max(outline.vertices, axis=0).tolist() == pytest.approx([0.59, 0.285])
    svg(tmp_path, "")
    with pytest.raises(
        InputError, match=r"scene\.yaml: object\.outline\.file: .*part\.svg: the drawing has no lines"
    ):
        load_scene(scene)


def test_a_missing_extra_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    (tmp_path / "part.dxf").write_text("0\nEOF\n")
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingExtra, match=r'pip install "flatpush\[shapes\]"'):
        load_outline(tmp_path / "part.dxf", MM)


def dxf(folder: Path, units: int, *draw: tuple[str, tuple[object, ...], dict[str, object]]) -> Path:
    ezdxf = pytest.importorskip("ezdxf", reason=extra("shapes"))
    drawing = ezdxf.new(units=units)
    space = drawing.modelspace()
    for method, arguments, options in draw:
        getattr(space, method)(*arguments, **options)
    path = folder / "part.dxf"
    drawing.saveas(path)
    return path


BOX = [(0, 0), (50, 0), (50, 35), (0, 35)]


@pytest.mark.parametrize(("units", "unit"), [(0, MM), (4, MM), (5, 1e-2), (1, 0.0254), (6, 1.0)])
def test_dxf_units(tmp_path: Path, units: int, unit: float) -> None:
    path = dxf(tmp_path, units, ("add_lwpolyline", (BOX,), {"close": True}))
    outline = load_outline(path, MM)
    np.testing.assert_allclose(np.ptp(outline.vertices, axis=0), [50 * unit, 35 * unit])
    assert len(outline.vertices) == 4


def test_dxf_lines_are_joined(tmp_path: Path) -> None:
    """In any order and either direction; text and points do not count."""
    path = dxf(
        tmp_path,
        4,
        ("add_line", ((0, 0), (50, 0)), {}),
        ("add_line", ((0, 35), (50, 35)), {}),
        ("add_line", ((0, 35), (0, 0)), {}),
        ("add_arc", ((50, 17.5), 17.5, -90, 90), {}),
        ("add_text", ("part 7",), {}),
        ("add_point", ((200, 200),), {}),
    )
    outline = load_outline(path, MM)
    assert outline.area == pytest.approx((50 * 35 + np.pi * 17.5**2 / 2) * MM**2, rel=1e-3)


@pytest.mark.parametrize(
    ("draw", "area"),
    [
        (("add_circle", ((1, 2), 20), {}), np.pi * 400),
        (("add_ellipse", ((0, 0), (20, 0), 0.5), {}), np.pi * 200),
        (("add_lwpolyline", ([(0, 0, 0, 0, 1), (40, 0, 0, 0, 1)],), {"close": True}), np.pi * 400),
    ],
)
def test_dxf_curves(
    tmp_path: Path, draw: tuple[str, tuple[object, ...], dict[str, object]], area: float
) -> None:
    outline = load_outline(dxf(tmp_path, 4, draw), MM)
    assert outline.area == pytest.approx(area * MM**2, rel=1e-3)


def test_dxf_splines_and_blocks(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason=extra("shapes"))
    drawing = ezdxf.new(units=4)
    block = drawing.blocks.new("part")
    block.add_spline([(0, 0), (20, -5), (40, 0), (20, 25), (0, 0)])
    drawing.modelspace().add_blockref("part", (100, 50))
    drawing.saveas(tmp_path / "part.dxf")
    outline = load_outline(tmp_path / "part.dxf", 1.0)
    assert np.min(outline.vertices, axis=0)[0] == pytest.approx(0.1, abs=5e-3)
    assert outline.size == pytest.approx(0.045, abs=0.01)


def test_bad_dxf(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no lines"):
        load_outline(dxf(tmp_path, 4), MM)
    with pytest.raises(InputError, match="not closed"):
        load_outline(dxf(tmp_path, 4, ("add_lwpolyline", (BOX,), {})), MM)
    path = dxf(tmp_path, 4, ("add_lwpolyline", (BOX,), {"close": True}))
    path.write_text(path.read_text()[:3000])
    with pytest.raises(InputError, match=r"part\.dxf"):
        load_outline(path, MM)


def drawing(*lines: ArrayLike) -> Drawing:
    def curve(k: int, line: ArrayLike) -> Curve:
        points = np.array(line, dtype=float)
        return Curve(lambda _: points, f"line {k}")

    return Drawing(curves=[curve(k, line) for k, line in enumerate(lines)])


def test_contours_from_lines() -> None:
    square = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
    contour, outer, left = outer_contour(drawing(square[:3], square[2:], [(0.2, 0.2), (0.4, 0.4)]), "")
    assert contour.shape == (4, 2)
    assert outer.place == "line 0 and 1 more"
    assert [(part.place, part.reason) for part in left] == [("line 2", "an open line")]
    with pytest.raises(InputError, match="no lines"):
        outer_contour(drawing(np.zeros((3, 2))), "")


def test_a_line_far_away_does_not_blur_the_outline() -> None:
    """The tolerance of joining is that of the outline, not of the whole drawing: a stroke 1000 km away once made all
    ends one."""
    square = [(0, 0), (0.06, 0), (0.06, 0.04), (0, 0.04), (0, 0)]
    lines = [square[k : k + 2] for k in range(4)]
    contour, _, left = outer_contour(drawing(*lines, [(1e6, 1e6), (1e6 + 0.01, 1e6)]), "")
    np.testing.assert_allclose(np.ptp(contour, axis=0), [0.06, 0.04])
    assert len(left) == 1


def test_lines_that_branch_are_refused_where_they_do() -> None:
    square = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
    with pytest.raises(InputError, match=r"either way at \[[01], [01]\], where 3 lines meet"):
        outer_contour(drawing(square[:3], square[2:], [(0, 0), (1, 1)]), "")
