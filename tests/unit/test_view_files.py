"""Pictures, animations and pages as files: what they hold, and what is refused."""

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from tests.drawn_plans import (
    LEFT,
    follow,
    make_plan,
)
from tests.waiting import python

import flatpush.view
from flatpush.errors import InputError
from flatpush.geometry import Outline, transform
from flatpush.problem import (
    Object,
    Plan,
    Pusher,
)
from flatpush.view import check_figure, save_figure
from flatpush.view.drawing import Drawing, Text, font, text_width
from flatpush.view.letters import UNITS, WIDTHS
from flatpush.view.page import draw_page
from flatpush.view.picture import encoded
from flatpush.view.raster import PIXELS
from flatpush.view.timeline import Timeline


def svg_of(plan, tmp_path, **options):
    path = tmp_path / "plan.svg"
    save_figure(plan, path, **options)
    return path.read_text()


def page_data(page):
    return json.loads(re.search(r"const plan = (.*);", page)[1])


@pytest.mark.parametrize("pushes", [1, 2, 6])
def test_svg_is_sound_says_what_it_shows_and_is_as_wide_as_its_page(tmp_path, pushes):
    root = ElementTree.fromstring(svg_of(make_plan(pushes=pushes), tmp_path))
    assert root.get("width") == "100%"
    assert root.get("height") is None
    assert "triangle" in root.find("{http://www.w3.org/2000/svg}title").text


def test_the_same_plan_gives_the_same_bytes(tmp_path):
    plan = make_plan()
    for ending in ("svg", "png", "gif", "html"):
        paths = [tmp_path / f"{k}.{ending}" for k in range(2)]
        for path in paths:
            save_figure(plan, path)
        assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_simulated_run_is_drawn_in_red(tmp_path):
    plan = make_plan()
    assert "#d62728" not in svg_of(plan, tmp_path)
    assert "#d62728" in svg_of(plan, tmp_path, rollouts=[follow(plan)])
    save_figure(plan, tmp_path / "run.html", [follow(plan)])
    assert '<path class="simulated"' in (tmp_path / "run.html").read_text()


def test_obstacles_and_bounds_are_drawn(tmp_path):
    square = np.array([[0.1, 0.1], [0.15, 0.1], [0.15, 0.15], [0.1, 0.15]])
    plan = make_plan(bounds=(-0.3, -0.3, 0.3, 0.3), obstacles=(square, Outline.circle(0.03, (-0.2, 0.1))))
    text = svg_of(plan, tmp_path)
    assert "#c1272d" in text
    assert "#3b6fb6" in text
    assert "#c1272d" not in svg_of(make_plan(), tmp_path)


def test_the_box_of_a_text_is_what_its_letters_cover():
    """Measured in the picture itself: dark pixels lie in the box, and reach its ends."""
    for upright in (False, True):
        page = Drawing(300, 300, "")
        text = Text(150.0, 150.0, "Egypt 180", 20.0, anchor="middle", upright=upright)
        page.add(text)
        picture = np.asarray(Image.open(io.BytesIO(encoded(page, ".png"))).convert("L"))
        y, x = (span / PIXELS for span in np.nonzero(picture < 128))
        left, top, right, bottom = text.box
        ends = (x.min(), x.max(), y.min(), y.max())
        assert left - 1 < ends[0] < left + 6
        assert right - 6 < ends[1] < right + 1
        assert top - 1 < ends[2] < top + 6
        assert bottom - 6 < ends[3] < bottom + 1


@pytest.mark.parametrize("bold", [False, True])
def test_letters_are_as_wide_as_those_of_the_font(bold):
    table = WIDTHS[bold]
    assert len(table) > 250
    letters = font(UNITS, bold)
    for letter, width in table.items():
        assert letters.getlength(letter) == pytest.approx(width, abs=1), letter
    line = "Egypt: 180 mm (lifted), α = −3.5°"
    assert text_width(line, 9.0, bold) == pytest.approx(letters.getlength(line) * 9.0 / UNITS, rel=0.02)
    assert text_width("三角", 9.0, bold) == pytest.approx(letters.getlength("三角") * 9.0 / UNITS)


def test_png_is_large_enough_to_read_in_a_readme(tmp_path):
    save_figure(make_plan(), tmp_path / "plan.PNG")
    with Image.open(tmp_path / "plan.PNG") as image:
        assert image.width == 1200
        assert 600 < image.height < 1200


def test_gif_moves_from_the_start_to_the_goal(tmp_path):
    plan = make_plan()
    save_figure(plan, tmp_path / "plan.gif")
    with Image.open(tmp_path / "plan.gif") as film:
        assert 40 <= film.n_frames <= 130
        assert film.info["loop"] == 0
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(film.n_frames - 1)
        last = np.asarray(film.convert("RGB")).astype(int)
    assert np.count_nonzero(np.abs(first - last).sum(axis=-1) > 60) > 500
    assert (first[0, 0] == 255).all()


def test_html_stands_alone_and_plays_the_plan(tmp_path):
    plan = make_plan(pushes=2)
    save_figure(plan, tmp_path / "plan.html")
    page = (tmp_path / "plan.html").read_text(encoding="utf-8")
    assert not re.search(r"(src|href)\s*=|url\(|@import|https?://|fetch\(|XMLHttp", page)
    data, line = page_data(page), Timeline.of(plan)
    np.testing.assert_allclose(data["times"], line.times, atol=1e-6)
    np.testing.assert_allclose(np.array(data["object"]) / [1e3, 1e3, 1], line.object, atol=1e-5)
    assert [s["push"] for s in data["segments"]] == [None, None, "long edge", None] * 2
    assert all(len(s["tips"]) == 2 for s in data["segments"])
    turns = data["segments"][2]["turns"]
    assert [t["turn"] for t in turns] == ["left", "straight", "right"]
    np.testing.assert_allclose(turns[0]["centre"], 1e3 * transform(plan.scene.start_pose, LEFT), atol=1e-3)
    assert turns[-1]["end"] == pytest.approx(line.starts[2] + 9.0)
    assert "$" not in page


def test_a_pusher_that_moves_alone_shows_the_fingers_of_the_push_it_goes_to():
    plan = make_plan(pushes=2)
    single = replace(plan.pushes[1], fingers=np.zeros((1, 2)))
    segments = tuple(single if s is plan.pushes[1] else s for s in plan.segments)
    data = page_data(draw_page(replace(plan, segments=segments)))
    assert [len(s["tips"]) for s in data["segments"]] == [2, 2, 2, 1, 1, 1, 1, 1]


def test_names_cannot_break_out_of_the_page_or_the_picture(tmp_path):
    evil = '</script><img onerror="x"> $x^$ & “ 三角'
    plan = make_plan(name=evil, push=evil)
    save_figure(plan, tmp_path / "plan.html")
    page = (tmp_path / "plan.html").read_text(encoding="utf-8")
    assert page.count("</script>") == 1
    assert "<img" not in page
    assert page_data(page)["segments"][2]["push"] == evil
    ElementTree.fromstring(svg_of(plan, tmp_path))


@pytest.mark.parametrize("ending", ["svg", "png", "gif", "html"])
def test_a_plan_without_segments_and_no_plan_are_drawn_too(tmp_path, ending):
    scene = make_plan().scene
    nothing = Plan("solved", replace(scene, goal=scene.start), 0.0)
    failed = Plan("no_plan", scene, reason="no listed push can steer; " * 12)
    for plan in (nothing, failed):
        save_figure(plan, tmp_path / f"plan.{ending}")
        assert (tmp_path / f"plan.{ending}").stat().st_size > 1000


def test_a_circle_with_one_finger_and_pushes_without_a_list(tmp_path):
    plan = make_plan()
    disc = Object(Outline.circle(0.02), "uniform", 0.3, name="disc")
    push = replace(plan.pushes[0], fingers=np.zeros((1, 2)))
    segments = tuple(push if s.kind == "push" else s for s in plan.segments)
    scene = replace(plan.scene, object=disc, pushes="auto", pusher=Pusher())
    for ending in ("svg", "gif", "html"):
        save_figure(replace(plan, scene=scene, segments=segments), tmp_path / f"disc.{ending}")
    page = page_data((tmp_path / "disc.html").read_text(encoding="utf-8"))
    assert all(segment["tips"] == [[0, 0]] for segment in page["segments"] if segment["push"])
    two = svg_of(plan, tmp_path).count("<circle")
    assert two > (tmp_path / "disc.svg").read_text(encoding="utf-8").count("<circle") > 0


@pytest.mark.parametrize("name", ["plan.pdf", "plan", "plan.svg.txt", ".svg"])
def test_another_ending_is_refused_and_the_four_are_named(tmp_path, name):
    with pytest.raises(InputError, match=r"\.svg, \.png, \.gif or \.html"):
        save_figure(make_plan(), tmp_path / name)
    with pytest.raises(InputError, match=r"\.html"):
        check_figure(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_and_a_folder_are_refused(tmp_path):
    (tmp_path / "folder.svg").mkdir()
    for path in (tmp_path / "missing" / "plan.svg", tmp_path / "folder.svg"):
        with pytest.raises(InputError, match=re.escape(str(path))):
            save_figure(make_plan(), path)
        with pytest.raises(InputError, match=re.escape(str(path))):
            check_figure(path)
    check_figure(tmp_path / "plan.svg")
    assert [p.name for p in tmp_path.rglob("*")] == ["folder.svg"]


def test_importing_the_package_imports_neither_matplotlib_nor_pillow():
    code = "import sys, flatpush.view; print([m for m in ('matplotlib', 'PIL') if m in sys.modules])"
    done = python("-c", code)
    assert done.stdout.strip() == "[]", done.stderr


def test_a_picture_in_svg_needs_no_font(tmp_path):
    """Loading one takes longer than drawing."""
    plan = make_plan(pushes=2)
    plan.save(tmp_path / "plan.json")
    code = (
        "import sys; from flatpush.documents import load_plan; from flatpush.view import save_figure;"
        f"save_figure(load_plan({str(tmp_path / 'plan.json')!r}), {str(tmp_path / 'plan.svg')!r});"
        "print([m for m in ('matplotlib', 'PIL', 'html', 'colorsys') if m in sys.modules])"
    )
    done = python("-c", code)
    assert done.stdout.strip() == "[]", done.stderr


def test_nothing_is_drawn_with_matplotlib():
    """It lends its letters only: importing it takes half a second."""
    root = Path(flatpush.view.__file__).parents[1]
    users = [
        path.name for path in root.rglob("*.py") if re.search(r"(import|from) matplotlib", path.read_text())
    ]
    assert users == []


def test_the_search_tree_is_drawn_faintly_beneath(tmp_path):
    plan = make_plan()
    edges = np.cumsum(np.full((1500, 7, 2), 1e-3), axis=1)
    save_figure(plan, tmp_path / "plain.svg")
    save_figure(plan, tmp_path / "tree.svg", explored=edges)
    save_figure(plan, tmp_path / "none.svg", explored=edges[:0])
    plain, tree, none = (
        (tmp_path / f"{n}.svg").read_text(encoding="utf-8") for n in ("plain", "tree", "none")
    )
    assert plain == none
    # Every second edge of 1500: more than 900 could not be told apart.
    assert plain.count("#8a93a0") == 0
    assert tree.count("#8a93a0") == 750 + 1  # and the legend
