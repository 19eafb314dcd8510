"""Figures and animations: what is drawn where, in which files, and what is refused."""

import io
import itertools
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import flatpush.view
from flatpush.control.loop.closed_loop import ClosedLoopRun
from flatpush.errors import InputError
from flatpush.friction import Ellipsoid
from flatpush.friction.cross_validation import Judgement
from flatpush.friction.pairs import Pairs
from flatpush.geometry import Outline, compose, exp, inverse, transform
from flatpush.planning.options import push_option
from flatpush.problem import (
    Arc,
    CarCentres,
    Certificate,
    Object,
    Plan,
    Planning,
    Push,
    Pusher,
    PushSegment,
    Rollout,
    Scene,
    TransitSegment,
    Workspace,
)
from flatpush.simulation.study import Noise, Runs
from flatpush.view import PushSketch, check_figure, describe_figure, palette, save_figure, save_snapshots
from flatpush.view.angle_figure import draw_angles
from flatpush.view.drawing import MARKS, Disc, Drawing, Line, Look, Text, font, mark, text_width
from flatpush.view.labels import Labels
from flatpush.view.letters import UNITS, WIDTHS
from flatpush.view.page import draw_page
from flatpush.view.panel import Panel, frame_for
from flatpush.view.plan_figure import cone_length, draw_plan
from flatpush.view.push_figure import draw_sketches, sense
from flatpush.view.raster import PIXELS
from flatpush.view.replay_figure import ReplayRow, draw_replay
from flatpush.view.sketches import _drive
from flatpush.view.snapshots import moments, way_until
from flatpush.view.surface_figure import draw_surfaces
from flatpush.view.timeline import Timeline, doing
from flatpush.view.trace import fingertips, rollout_paths, trace_pushes
from flatpush.view.track_figure import _strip_entries, clearances, draw_track
from flatpush.view.tube import draw_tube, ends_box, tube_across, tube_figure
from flatpush.view.words import STRIP, plan_title, travel

TRIANGLE = 1e-3 * np.array([[19.667, -9.5], [19.667, 19.0], [-39.333, -9.5]])
LEFT, RIGHT = (
    np.array([-0.125, 0.0375]),
    np.array([0.125, 0.0375]),
)  # turning centres of a push along +y, in O
SPEED = 0.02


def about(centre, turn):
    """A body twist in O about a centre; + counter-clockwise; the flat point moves with SPEED."""
    w = turn * SPEED / 0.125
    return np.array([w * centre[1], -w * centre[0], w])


ARCS = {"left": about(LEFT, 1), "right": about(RIGHT, -1), "straight": np.array([0.0, SPEED, 0.0])}


def one_push(start, turns=("left", "straight", "right"), name="long edge"):
    """A push along +y of O that spends three seconds on each turn."""
    times, poses, arcs = [0.0], [np.asarray(start, dtype=float)], []
    for turn in turns:
        arcs.append(Arc(turn, ARCS[turn], 3.0, 3.0 * SPEED))
        begin = poses[-1]
        for s in np.arange(1, 31) / 30:
            times.append(3.0 * (len(arcs) - 1 + s))
            poses.append(compose(begin, exp(3.0 * s * ARCS[turn])))
    objects = np.array(poses)
    pusher = compose(objects, [0.0, -0.012, np.pi / 2])
    tips = np.array([[0.0, 0.009], [0.0, -0.009]])
    word = "".join(turn[0].upper() for turn in turns)
    return PushSegment(name, word, tuple(arcs), np.array(times), objects, pusher, tips)


def transit(start, end, lifted=0.0):
    times = np.array([0.0, 0.5, 1.0])
    return TransitSegment(times, np.array([start, end, end]), np.array([0.0, lifted, 0.0]))


def make_plan(
    turns=("left", "straight", "right"), pushes=1, cars=True, name="triangle", push="long edge", **workspace
):
    thing = Object(Outline.polygon(TRIANGLE), "uniform", 0.3, name=name)
    at = thing.outline.nearest((0.0, -0.0095))
    start = [0.05, -0.15, 0.4]
    segments, pose = [], np.array(start)
    for _ in range(pushes):
        segment = one_push(pose, turns, push)
        before = compose(segment.pusher[0], [-0.01, 0.0, 0.0])
        after = compose(segment.pusher[-1], [-0.01, 0.0, 0.0])
        came = segments[-1].pusher[-1] if segments else before
        segments += [transit(came, before, 0.03 if segments else 0.0), transit(before, segment.pusher[0])]
        segments += [segment, transit(segment.pusher[-1], after)]
        pose = segment.object[-1]
    scene = Scene(
        thing,
        start,
        pose,
        Pusher(fingers=2, spacing=0.018),
        (Push(push, at, 2, 0.018),),
        Workspace(**workspace),
    )
    car = {push: CarCentres(tuple(LEFT), tuple(RIGHT), (0.0, 1.0))}
    duration = float(sum(s.times[-1] for s in segments))
    certificate = Certificate((0.0, 0.0, 0.0), 0.18 * pushes, duration, cars=car if cars else {})
    return Plan("solved", scene, 0.18 * pushes, duration, tuple(segments), certificate)


def follow(plan):
    """A rollout that does what the plan says."""
    line = Timeline.of(plan)
    modes = ("sticking",) * len(line.times)
    return Rollout(line.object[-1], line.times, line.object, line.pusher, modes, "completed")


def svg_of(plan, tmp_path, **options):
    path = tmp_path / "plan.svg"
    save_figure(plan, path, **options)
    return path.read_text()


def page_data(page):
    return json.loads(re.search(r"const plan = (.*);", page)[1])


# What stands where


def test_the_flat_path_is_smooth_and_as_long_as_the_flat_cost():
    (trace,) = trace_pushes(make_plan())
    steps = np.diff(trace.flat_path, axis=0)
    assert np.sum(np.linalg.norm(steps, axis=1)) == pytest.approx(
        9.0 * SPEED, rel=1e-4
    )  # chords of 2° at most
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    assert np.max(np.abs(np.diff(headings))) < np.deg2rad(2.1)
    np.testing.assert_allclose(
        trace.flat_path[0], transform(trace.marks[0], 0.5 * (LEFT + RIGHT)), atol=1e-12
    )
    np.testing.assert_allclose(
        trace.flat_path[-1], transform(trace.marks[-1], 0.5 * (LEFT + RIGHT)), atol=1e-9
    )


def test_without_a_certificate_the_arcs_tell_the_flat_point_if_they_turn_both_ways():
    (both,) = trace_pushes(make_plan(cars=False))
    np.testing.assert_allclose(both.flat_point, [0.0, 0.0375], atol=1e-12)
    (one_way,) = trace_pushes(make_plan(("left", "straight", "left"), cars=False))
    assert one_way.flat_point is None
    assert one_way.flat_path is None


def test_a_turn_goes_about_its_centre_and_carries_its_sign():
    plan = make_plan()
    (trace,) = trace_pushes(plan)
    (left, plus), (right, minus) = trace.centres
    assert (plus, minus) == (1, -1)
    np.testing.assert_allclose(left, transform(plan.scene.start_pose, LEFT), atol=1e-12)
    objects = plan.pushes[0].object
    np.testing.assert_allclose(transform(objects[60:], RIGHT), np.tile(right, (31, 1)), atol=1e-9)


def test_the_left_edge_of_the_motion_cone_is_to_the_left_and_turns_clockwise():
    (trace,) = trace_pushes(make_plan())
    left, right = trace.motion
    assert left[0] < 0 < right[0]
    # The right turn moves the contact point along the left edge.
    velocity = ARCS["right"][:2] + ARCS["right"][2] * np.array([-trace.contact[1], trace.contact[0]])
    assert np.cross([*left, 0.0], [*velocity, 0.0])[2] == pytest.approx(0.0, abs=1e-12)
    assert left @ velocity > 0


def test_outlines_stand_at_even_travel_from_start_to_end():
    plan = make_plan(pushes=3)
    for trace, push in zip(trace_pushes(plan), plan.pushes, strict=True):
        np.testing.assert_allclose(trace.marks[[0, -1]], push.object[[0, -1]], atol=1e-12)
        reach = 0.5 * plan.scene.object.outline.size
        gaps = np.linalg.norm(np.diff(trace.marks[:, :2], axis=0), axis=1)
        gaps = gaps + reach * np.abs(np.diff(trace.marks[:, 2]))
        assert np.ptp(gaps) < 0.05 * np.mean(gaps)
        assert 2 <= len(trace.marks) <= 36
        tips = fingertips(trace.pushers, push.fingers)
        beside = transform(inverse(trace.marks)[:, None], tips)
        np.testing.assert_allclose(beside[..., 1], -0.012, atol=1e-5)


def test_the_object_rests_while_the_pusher_moves_alone():
    plan = make_plan(pushes=2)
    line = Timeline.of(plan)
    assert line.duration == pytest.approx(plan.duration)
    first_push_ends = line.starts[2] + 9.0
    rest = plan.pushes[0].object[-1]
    for later in (0.3, 1.7, 2.4):
        np.testing.assert_allclose(line.at(first_push_ends + later)[0], rest)
    assert line.at(line.starts[4] + 0.5)[2] == pytest.approx(0.03)
    assert [line.at(start)[3] for start in line.starts] == list(
        range(8)
    )  # where segments meet, the later one
    np.testing.assert_allclose(line.at(-1.0)[0], plan.scene.start_pose)
    np.testing.assert_allclose(line.at(1e9)[0], plan.scene.goal_pose)


def test_words_say_what_goes_on():
    plan = make_plan(pushes=2)
    line = Timeline.of(plan)
    begin = line.starts[2]
    said = [doing(plan, line, begin + t) for t in (1.0, 4.0, 8.0)]
    assert said == [f"push “long edge”, {how}" for how in ("turning left", "straight", "turning right")]
    assert doing(plan, line, 0.2) == "pusher alone"
    assert doing(plan, line, line.starts[4] + 0.5) == "pusher lifted"


def test_a_run_that_follows_the_plan_lies_on_its_flat_path():
    plan = make_plan(pushes=2)
    traces = trace_pushes(plan)
    for path, trace in zip(rollout_paths(follow(plan), plan, traces), traces, strict=True):
        np.testing.assert_allclose(path[0], trace.flat_path[0], atol=1e-9)
        np.testing.assert_allclose(path[-1], trace.flat_path[-1], atol=1e-9)


# Files


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


def boxes_overlap(a, b):
    return min(a[2], b[2]) > max(a[0], b[0]) and min(a[3], b[3]) > max(a[1], b[1])


@pytest.mark.parametrize("turns", [("left", "straight", "right"), ("left",)])
def test_no_two_labels_of_many_pushes_overlap_and_all_are_on_the_page(turns):
    """Nine numbers on the table used to hide each other; with ("left",) the pushes start close together."""
    page = draw_plan(make_plan(turns, pushes=9))
    texts = page.texts()
    assert {str(n) for n in range(1, 10)} <= {t.text for t in texts}
    assert {"start", "goal"} <= {t.text for t in texts}
    for i, text in enumerate(texts):
        left, top, right, bottom = text.box
        assert left >= 0
        assert top >= 0
        assert right <= page.width
        assert bottom <= page.height
        for other in texts[:i]:
            assert not boxes_overlap(text.box, other.box), (text.text, other.text)


def test_a_label_gives_way_to_one_that_is_there_and_to_what_is_drawn():
    panel = Panel(Drawing(200, 200, ""), (0.0, 0.0, 200.0, 200.0), (0.0, 0.0, 200.0, 200.0))
    labels = Labels(panel, np.array([[100.0, 60.0]]))
    offered = [np.array([100.0, y]) for y in (100.0, 104.0, 140.0, 180.0)]
    np.testing.assert_array_equal(labels.place(20, 10, offered), offered[0])
    # 104 lies on the first label, 140 (60 mm from below) on what is drawn.
    np.testing.assert_array_equal(labels.place(20, 10, offered), offered[3])
    np.testing.assert_array_equal(labels.place(20, 10, offered, free=True), offered[2])


def test_the_box_of_a_text_is_what_its_letters_cover():
    """Measured in the picture itself: dark pixels lie in the box, and reach its ends."""
    for upright in (False, True):
        page = Drawing(300, 300, "")
        text = Text(150.0, 150.0, "Egypt 180", 20.0, anchor="middle", upright=upright)
        page.add(text)
        picture = np.asarray(Image.open(io.BytesIO(page.encode(".png"))).convert("L"))
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


@pytest.mark.parametrize("edge", [0.06, 0.3])
def test_the_goal_and_start_labels_lie_on_no_line(edge):
    """Bounds are lines too; at 0.06 they run where the label of the goal would be liked best."""
    plan = make_plan(pushes=2)
    top = float(np.max(transform(plan.scene.goal_pose, TRIANGLE)[:, 1])) + 0.004
    plan = make_plan(pushes=2, bounds=(-0.6, -0.4, 0.6, top if edge < 0.1 else edge + top))
    page = draw_plan(plan)
    lines = [item.points for _, item in page.items() if isinstance(item, Line) and item.look.width >= 1.4]
    for name in ("start", "goal"):
        (label,) = (t for t in page.texts() if t.text == name)
        left, top, right, bottom = label.box
        for points in lines:
            dense = np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(points)])
            inside = (dense > [left, top]) & (dense < [right, bottom])
            assert not np.any(inside.all(axis=1)), name


@pytest.mark.parametrize(("pushes", "beside"), [(1, True), (9, False)])
def test_the_strip_stands_beside_the_axes_where_it_finds_room_and_on_the_page(pushes, beside):
    """One push once had the whole width of the page for its strip, under a picture with an empty margin."""
    page = draw_plan(make_plan(("left", "straight", "left"), pushes=pushes))
    texts = page.texts()
    (head,) = (t for t in texts if t.text == STRIP)
    (axis,) = (t for t in texts if t.text == "x [mm]")
    assert (head.y < axis.y) == beside
    names = [t for t in texts if t.text == "long edge"]
    assert len(names) == pushes
    assert all(t.box[2] <= page.width and t.box[3] <= page.height for t in texts)


@pytest.mark.parametrize(("turns", "seen"), [(("left", "straight", "right"), True), (("left",), False)])
def test_turning_centres_outside_the_picture_are_neither_drawn_nor_explained(turns, seen):
    """Half a sign once stood at the edge."""
    page = draw_plan(make_plan(turns))
    signs = [item for _, item in page.items() if isinstance(item, Disc) and item.radius == 3.6]
    assert len(signs) == (1 if seen else 0)
    assert ("turning centre (+ left, − right)" in {t.text for t in page.texts()}) == seen


def test_colours_of_pushes_never_repeat():
    colours = [palette.push_colour(k) for k in range(60)]
    assert len(set(colours)) == 60
    assert not set(colours) & {palette.START, palette.GOAL, palette.SIMULATED, palette.OBSTACLE}
    rgb = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours[:12]])
    gaps = np.linalg.norm(rgb[:, None] - rgb[None], axis=-1) + 1e3 * np.eye(12)
    assert gaps.min() > 40  # of 441 from black to white


@pytest.mark.parametrize("size", [(0.3, 0.1), (0.1, 0.1), (0.1, 0.4)])
def test_axes_show_what_they_must_without_wide_margins(size):
    frame = frame_for((0.0, 0.0, *size), 40.0, 20.0, 500.0, 110.0, 330.0)
    panel = Panel(Drawing(576, 500, ""), frame, (0.0, 0.0, *size))
    low, high = np.array(panel.box[:2]), np.array(panel.box[2:])
    assert np.all(low <= 1e-12)
    assert np.all(high >= np.array(size) - 1e-12)
    assert np.prod(high - low) < 1.9 * np.prod(size)


def test_the_title_says_what_happens():
    plan = make_plan(pushes=9)
    line = transform(np.concatenate([push.object for push in plan.pushes]), plan.scene.object.cof)
    way = np.sum(np.linalg.norm(np.diff(line, axis=0), axis=1))
    assert plan_title(plan) == f"triangle: 9 pushes, {way:.2f} m, {plan.duration:.0f} s"
    assert travel(plan) == pytest.approx(way, rel=1e-3)  # chords of a sampled path
    # The same pushes of an object whose drawing has its origin elsewhere.
    aside = replace(
        plan.scene.object, outline=Outline.polygon(TRIANGLE + np.array([0.05, 0.02])), support="uniform"
    )
    moved = replace(plan, scene=replace(plan.scene, object=aside, pushes="auto"))
    line = transform(np.concatenate([push.object for push in plan.pushes]), aside.cof)
    way_aside = np.sum(np.linalg.norm(np.diff(line, axis=0), axis=1))
    assert travel(moved) == pytest.approx(way_aside, rel=1e-3)
    assert abs(way_aside - way) > 0.01 * way  # far more than the tolerance


def test_cones_stay_inside_the_object():
    """A flat object's cone used to be drawn far through its other side."""
    bar = 1e-3 * np.array([[-50.0, 0.0], [50.0, 0.0], [50.0, 10.0], [-50.0, 10.0]])
    scene = Scene(Object(Outline.polygon(bar), "uniform", 0.3), (0, 0, 0))
    up = np.pi / 2
    assert cone_length(scene, np.zeros(2), [up]) == pytest.approx(0.010)
    assert cone_length(scene, np.zeros(2), [up - 0.3, up + 0.3]) == pytest.approx(0.010 / np.cos(0.3))
    deep = Scene(Object(Outline.polygon(bar * [1, 10]), "uniform", 0.3), (0, 0, 0))
    assert cone_length(deep, np.zeros(2), [up]) == pytest.approx(0.4 * deep.object.outline.size)


def test_the_strip_shows_where_the_fingers_land():
    """The strip is where the operator looks: tips at (±9, −12) mm beside the long edge, which is 59 mm long."""
    plan = make_plan(pushes=9)
    page = draw_plan(plan)
    (top,) = (t.y for t in page.texts() if t.text == STRIP)
    below = [item for _, item in page.items() if isinstance(item, Disc) and item.centre[1] > top]
    tips = [item for item in below if item.look.fill == palette.PUSHER]
    assert len(tips) == 18
    outlines = [i for _, i in page.items() if isinstance(i, Line) and i.closed and len(i.points) == 3]
    outlines = [i for i in outlines if i.points[:, 1].min() > top and i.look.fill_opacity == 0.12]
    assert [o.look.fill for o in outlines] == [palette.push_colour(k) for k in range(9)]
    for outline, pair in zip(outlines, zip(tips[::2], tips[1::2], strict=True), strict=True):
        scale = np.ptp(outline.points[:, 0]) / 59.0
        corner = outline.points[np.argmin(outline.points[:, 0])]  # (−39.333, −9.5) mm
        found = sorted(
            tuple(((tip.centre - corner) / scale * [1, -1] + [-39.333, -9.5]).round(2)) for tip in pair
        )
        np.testing.assert_allclose(found, [(-9.0, -12.0), (9.0, -12.0)], atol=0.05)


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


# What is refused


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
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_picture_in_svg_needs_no_font(tmp_path):
    """Loading one takes longer than drawing."""
    plan = make_plan(pushes=2)
    plan.save(tmp_path / "plan.json")
    code = (
        "import sys; from flatpush.documents import load_plan; from flatpush.view import save_figure;"
        f"save_figure(load_plan({str(tmp_path / 'plan.json')!r}), {str(tmp_path / 'plan.svg')!r});"
        "print([m for m in ('matplotlib', 'PIL', 'html', 'colorsys') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_nothing_is_drawn_with_matplotlib():
    """It lends its letters only: importing it takes half a second."""
    root = Path(flatpush.view.__file__).parents[1]
    users = [
        path.name for path in root.rglob("*.py") if re.search(r"(import|from) matplotlib", path.read_text())
    ]
    assert users == []


# Sketches


def sketch(refusal="", **changes):
    nan = np.full(2, np.nan)
    centres = {
        "left_centre": LEFT,
        "right_centre": RIGHT,
        "flat_point": np.array([0, 0.0375]),
        "straight": np.array([0, 1.0]),
    }
    if refusal:
        centres = dict.fromkeys(centres, nan)
    values = {
        "name": "long edge",
        "contact_points": np.array([[-0.009, -0.0095], [0.009, -0.0095]]),
        "normal": np.array([0.0, 1.0]),
        "fingertips": np.array([[-0.009, -0.012], [0.009, -0.012]]),
        "tip_radius": 0.0025,
        "friction": 0.3,
        "cof": np.zeros(2),
        "force_left": np.array([-0.3, 1.0]),
        "force_right": np.array([0.3, 1.0]),
        "motion_left": np.array([-0.4, 1.0]),
        "motion_right": np.array([0.4, 1.0]),
        **centres,
        "refusal": refusal,
    }
    return PushSketch(**{**values, **changes})


def drawn(sketches, tmp_path):
    path = tmp_path / "pushes.svg"
    describe_figure(make_plan().scene, sketches, path)
    return path.read_text()


def test_a_sketch_shows_both_rays_and_the_flat_point(tmp_path):
    text = drawn([sketch()], tmp_path)
    ElementTree.fromstring(text)
    assert "#c2189b" in text  # clockwise ray
    assert "#e3000f" in text  # flat point
    assert text == drawn([sketch()], tmp_path)


def test_a_refused_push_shows_its_reason_instead(tmp_path):
    text = drawn([sketch(refusal="off by 4.1 deg")], tmp_path)
    assert "#c2189b" not in text
    assert "off by 4.1 deg" in re.sub(r"<[^!].*?>", "", text)  # glyphs carry their text as a comment


def test_every_number_of_pushes_fits(tmp_path):
    path = tmp_path / "pushes.png"
    heights = []
    for count in (1, 3):
        describe_figure(make_plan().scene, [sketch()] * count, path)
        with Image.open(path) as image:
            heights.append(image.size[1])
    assert heights[1] > 2 * heights[0]


def test_far_and_single_contacts_are_drawn(tmp_path):
    far = sketch(left_centre=1e2 * LEFT, right_centre=1e2 * RIGHT)
    single = sketch(contact_points=np.array([[0.0, -0.0095]]), fingertips=np.array([[0.0, -0.012]]))
    ElementTree.fromstring(drawn([far, single], tmp_path))
    discs = drawn([sketch()], tmp_path).count("<circle")
    assert drawn([far], tmp_path).count("<circle") == discs - 2  # its turning centres lie off the page
    assert (
        drawn([single], tmp_path).count("<circle") == discs - 4
    )  # a fingertip and its contact, in two panels


def test_the_drawing_of_an_outline_is_shown_with_what_was_left_out(tmp_path):
    from flatpush.documents import load_scene, outline_note

    (tmp_path / "part.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
        '<rect x="10" y="10" width="60" height="40"/><circle cx="30" cy="30" r="5"/>'
        '<path d="M 0 90 H 90" stroke="#000"/></svg>'
    )
    (tmp_path / "scene.yaml").write_text(
        "flatpush: scene/1\nunits: {length: mm, angle: deg}\nobject: {outline: {file: part.svg,"
        " origin: centroid}, friction: 0.3}\nstart: [0, 0, 0]\ngoal: [50, 0, 0]\n"
    )
    scene, note = load_scene(tmp_path / "scene.yaml"), outline_note(tmp_path / "scene.yaml")
    page = draw_sketches(scene, [sketch(refusal="off")], note)
    said = " ".join(t.text for t in page.texts())
    for words in (
        "the drawing",
        "x of O",
        "inside the outline (a hole)",
        "an open line",
        "unit of the drawing",
    ):
        assert words in said
    grey = [
        item.points for _, item in page.items() if isinstance(item, Line) and item.look.stroke == "#9a9a9a"
    ]
    assert sorted(len(points) > 2 for points in grey) == [False, True]  # the open line, the hole
    plain = draw_sketches(scene, [sketch(refusal="off")])
    assert plain.height < page.height
    assert "the drawing" not in {t.text for t in plain.texts()}


def test_a_cone_in_a_notch_is_as_long_as_the_object_is_deep():
    """The middle of two contacts in the notch of an L lies off the object; its cone was drawn 5 mm long."""
    corners = 1e-3 * np.array([(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)])
    scene = Scene(Object(Outline.polygon(corners), friction=0.3), (0, 0, 0))
    length = cone_length(scene, np.array([0.025, 0.025]), [1.3 * np.pi])
    assert length == pytest.approx(
        min(0.4 * scene.object.outline.size, 0.025 / np.sin(0.3 * np.pi)), rel=1e-6
    )
    assert cone_length(scene, np.array([0.03, 0.0]), [np.pi / 2]) == pytest.approx(0.02)


def test_centres_of_a_curve_are_told_apart_by_theirsense():
    """A centre to the left of a push along +y is of a counter-clockwise turn."""
    centres = np.array([[-0.2, 0.03], [-9.0, 0.03], [np.nan, np.nan], [9.0, 0.03], [0.2, 0.03]])
    assert sense(sketch(centres=centres)).tolist() == [1.0, 1.0, 0.0, -1.0, -1.0]


def test_the_pushing_direction_stands_upright_on_the_arm_from_its_rotation_centre():
    """Fig. 1: u lies in the motion cone; half as tight a turn of a Dubins car is about a centre twice as far away."""
    thing = Object(Outline.polygon(TRIANGLE), "uniform", 0.3)
    push = Push("long edge", thing.outline.nearest((0.0, -0.0095)))
    scene = Scene(thing, (0, 0, 0), pushes=(push,), planning=Planning(model="ellipsoid"))
    car = push_option(scene, push, margin=0.0).car
    u, centre = _drive(car, push.at.point)
    assert u @ (centre - push.at.point) == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(centre - car.flat_point) == pytest.approx(2 * car.radius, rel=1e-6)
    assert (centre - car.flat_point) @ (car.left_centre - car.flat_point) > 0
    left, right = car.contact.motion_cone(car.surface)
    assert np.cross([*right, 0], [*u, 0])[2] > 0 > np.cross([*left, 0], [*u, 0])[2]


def test_a_sketch_names_u_and_its_texts_do_not_overlap():
    drive = sketch(drive=np.array([0.2, 1.0]), drive_centre=np.array([-0.06, 0.0]))
    page = draw_sketches(make_plan().scene, [drive, sketch(refusal="off by 4.1 deg")])
    texts = page.texts()
    assert [t.text for t in texts].count("u") == 1
    assert "u: a push to the left" in {t.text for t in texts}
    assert "darker: whatever the pressure" not in {t.text for t in texts}  # nothing of that kind is drawn
    for one, other in itertools.combinations(texts, 2):
        assert not boxes_overlap(one.box, other.box), (one.text, other.text)


def test_sketches_are_refused_in_other_formats_and_without_a_push(tmp_path):
    with pytest.raises(InputError, match=r"\.svg or \.png"):
        describe_figure(make_plan().scene, [sketch()], tmp_path / "pushes.gif")
    with pytest.raises(InputError, match="at least one push"):
        describe_figure(make_plan().scene, [], tmp_path / "pushes.svg")


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


@pytest.mark.parametrize("ending", [".svg", ".png"])
def test_snapshots_show_moments_from_start_to_end(tmp_path, ending):
    plan = make_plan(pushes=2)
    path = tmp_path / f"moments{ending}"
    save_snapshots(plan, path, count=6)
    if ending == ".svg":
        drawn = path.read_text(encoding="utf-8")
        assert len(re.findall(r">\d+\.\d s</text>", drawn)) == 6
    else:
        with Image.open(path) as image:
            assert image.width == 1200
    with pytest.raises(InputError, match="start and the end"):
        save_snapshots(plan, path, count=1)
    with pytest.raises(InputError, match="ends in"):
        save_snapshots(plan, tmp_path / "moments.gif")


def test_moments_share_the_way_evenly():
    timeline = Timeline.of(make_plan(pushes=2))
    times = moments(timeline, 5)
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(timeline.duration)
    assert np.all(np.diff(times) > 0)


def test_the_way_of_a_snapshot_ends_at_the_object():
    """It used to end at the last stored sample, up to 45 mm behind: straights have few samples."""
    dense = make_plan()
    push = dense.pushes[0]
    few = np.array([k for k in range(91) if not 30 < k < 60])  # none within the straight
    sparse = replace(push, times=push.times[few], object=push.object[few], pusher=push.pusher[few])
    plan = replace(dense, segments=tuple(sparse if s.kind == "push" else s for s in dense.segments))
    timeline = Timeline.of(plan)
    begin = timeline.starts[2]
    for time in (1.0, 3.7, 5.9, 8.2):
        pose, left = plan.scene.start_pose, time
        for arc in push.arcs:
            pose = compose(pose, exp(min(left, 3.0) * arc.twist))
            left = max(left - 3.0, 0.0)
        ((number, way),) = way_until(plan, timeline, begin + time)
        assert number == 0
        np.testing.assert_allclose(way[-1], transform(pose, plan.scene.object.cof), atol=5e-5)
    assert way_until(plan, timeline, 0.1) == []


# Many runs, and runs under feedback


def made_runs(spread, count=40):
    """Runs that follow the plan, each aside by its own offset from the start."""
    plan = make_plan()
    line = Timeline.of(plan).object
    aside = spread * np.random.default_rng(1).standard_normal((count, 2))
    poses = np.repeat(line[None], count, axis=0)
    poses[..., :2] += aside[:, None]
    none = np.zeros(count)
    return Runs(
        plan, 1, Noise(), poses[:, 0], none, np.zeros((count, 2)), poses[:, -1],
        ("completed",) * count, np.ones(count, dtype=bool), poses,
    )  # fmt: skip


def test_the_bands_of_a_tube_hold_the_runs_that_they_say():
    paths = np.zeros((200, 30, 2))
    paths[..., 0] = np.linspace(0, 100, 30)
    paths[..., 1] = np.linspace(-1, 1, 200)[:, None]
    middle, across, bands = tube_across(paths)
    np.testing.assert_allclose(middle[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(across, np.tile([0.0, 1.0], (30, 1)))
    for (low, high, _), share in zip(bands, (0.95, 0.5), strict=True):
        np.testing.assert_allclose(low, -share, atol=1e-9)
        np.testing.assert_allclose(high, share, atol=1e-9)


def test_every_end_is_shown_and_an_ellipse_only_where_there_is_one(tmp_path):
    runs, still = made_runs(0.002), made_runs(0.0)
    box = np.array(ends_box(runs))
    assert np.all((1e3 * runs.final[:, :2] > box[:2]) & (1e3 * runs.final[:, :2] < box[2:]))
    said = {t.text for t in draw_tube(runs).texts()}
    assert "mean and 95 % ellipse" in said
    assert "end of a run that slipped" not in said
    assert "mean and 95 % ellipse" not in {t.text for t in draw_tube(still).texts()}
    tube_figure(runs, tmp_path / "tube.png")
    with Image.open(tmp_path / "tube.png") as image:
        assert image.width == 1200


def test_the_ellipse_of_the_ends_is_shown_whole_and_a_line_has_none():
    runs, line = made_runs(0.002), made_runs(0.002)
    half = np.sqrt(5.991 * np.diag(runs.covariance)[:2])
    box = np.array(ends_box(runs))
    assert np.all(1e3 * (runs.mean[:2] - half) > box[:2])
    assert np.all(1e3 * (runs.mean[:2] + half) < box[2:])
    line.final[:, 1] = line.final[0, 1] + 1e-3 * (line.final[:, 0] - line.final[0, 0])
    assert "mean (+)" in {t.text for t in draw_tube(line).texts()}


def test_ends_far_off_are_counted_where_they_are_not_shown():
    runs = made_runs(0.002)
    runs.final[0, 0] += 1.0
    assert "1 ends further off" in {t.text for t in draw_tube(runs).texts()}


def made_run(modes=("path", "saturated")):
    plan = make_plan(obstacles=([[0.2, -0.2], [0.3, -0.2], [0.3, 0.3], [0.2, 0.3]],))
    push = plan.pushes[0]
    n = len(push.times)
    contacts = tuple("sticking" if k < n // 2 else "sliding_left" for k in range(n))
    moved = push.object + np.array([0.001, 0.0, 0.0])
    words = tuple(modes[k * len(modes) // n] for k in range(n))
    return plan, ClosedLoopRun(push.times, moved, push.pusher, np.zeros(n), words, contacts, "arrived")


def test_a_run_under_feedback_shows_tolerance_contact_and_clearance():
    plan, run = made_run()
    page = draw_track(plan, run, "path at 100 Hz")
    said = {t.text for t in page.texts()}
    assert {
        "goal tolerance",
        "sticks",
        "slides to the left",
        "path",
        "saturated",
        "clearance of the object",
    } <= said
    assert "off the object" not in said  # it never was
    gaps = clearances(plan.scene, run.object)
    corners = transform(run.object[:, None], TRIANGLE[None])
    np.testing.assert_allclose(gaps, 0.2 - corners[..., 0].max(axis=1), atol=1e-12)
    assert f"least clearance {1e3 * gaps.min():.1f} mm" in said


def test_what_is_too_short_to_be_seen_is_not_in_the_legend():
    plan, run = made_run()
    contacts = ("rest", *run.contacts[1:])
    stretched = replace(run, contacts=contacts)
    assert "at rest" in {t.text for t in draw_track(plan, stretched).texts()}
    many = ClosedLoopRun(
        np.linspace(0, 9, 2000), np.repeat(run.object[:1], 2000, 0), np.repeat(run.pusher[:1], 2000, 0),
        np.zeros(2000), ("path",) * 2000, ("rest", *("sticking",) * 1999), "arrived",
    )  # fmt: skip
    assert "at rest" not in {t.text for t in draw_track(plan, many).texts()}


def test_modes_of_a_controller_have_a_colour_each():
    modes = ("path", "waiting", "transit", "saturated", "done", "one of your own", "another")
    plan, run = made_run(modes)
    colours = [item.look.fill for _, item in draw_track(plan, run).items() if isinstance(item, Line)]
    _, entries = _strip_entries(run)
    assert len({entry.look.fill for entry in entries}) == len(modes)
    assert all(colours.count(entry.look.fill) >= 2 for entry in entries)  # in the strip and in the legend


# Figures of data


def test_a_section_of_a_surface_is_its_curve_and_holds_the_data_near_it():
    """The ellipse of an ellipsoid in the plane without torque, drawn in newtons, and a pair on each axis."""
    matrix = np.diag([1 / 4.0, 1.0, 1 / (3 * 0.02) ** 2])  # half axes 2 N, 1 N, 3 N times the length
    wrenches = np.array([[2.0, 0, 0], [0, 1.0, 0], [0, 0, 0.06]])
    pairs = Pairs(wrenches, Ellipsoid(matrix).twist(wrenches), "made")
    page = draw_surfaces({"ellipsoid": (Ellipsoid(matrix), 1.0)}, pairs, 0.02, "surfaces", "")
    curves = [
        i for _, i in page.items() if isinstance(i, Line) and i.look.width == 1.6 and len(i.points) > 100
    ]
    assert len(curves) == 3
    ratios = [np.ptp(curve.points[:, 0]) / np.ptp(curve.points[:, 1]) for curve in curves]
    np.testing.assert_allclose(ratios, [2 / 1, 2 / 3, 1 / 3], rtol=1e-3)
    dots = [item for _, item in page.items() if isinstance(item, Disc) and item.look.fill == "#1a1a1a"]
    assert len(dots) == 2 * 3 + 1  # two of the three pairs in each section, and the legend
    said = {text.text for text in page.texts()}
    assert {"section without torque", "fx [N]", "30° or more", "ellipsoid"} <= said


@pytest.mark.parametrize("kind", list(MARKS))
def test_a_mark_lies_about_its_middle(kind):
    item = mark(kind, np.array([10.0, 20.0]), 3.0, Look(fill="#111111"))
    if isinstance(item, Disc):
        assert item.radius == 3.0
        return
    np.testing.assert_allclose(item.points.mean(axis=0), [10.0, 20.0], atol=1e-9)
    reach = np.linalg.norm(item.points - [10.0, 20.0], axis=1).max()
    assert 3.0 <= reach <= 4.0


def test_every_recorded_run_is_a_mark_and_the_bar_is_their_mean():
    errors = np.array([[0.001, 0.1, 0.002], [0.003, 0.3, 0.004], [0.005, 0.2, 0.003]])
    rows = [
        ReplayRow("one\nfitted: nothing", ("disc", "disc", "bar"), errors),
        ReplayRow("two", ("bar",), errors[:1]),
    ]
    page = draw_replay(rows, ["disc", "bar"], "replay")
    fills = [palette.push_colour(k) for k in range(2)]
    marks = [i for _, i in page.items() if not isinstance(i, Text) and i.look.fill in fills]
    assert len(marks) == 3 * 4 + 2  # and the legend
    bars = [i for _, i in page.items() if isinstance(i, Line) and i.look.width == 1.6]
    discs = [i for _, i in page.items() if isinstance(i, Disc) and i.radius == 2.0]
    squares = [i for _, i in page.items() if isinstance(i, Line) and i.look.fill == fills[1]]
    first = [*(d.centre[0] for d in discs[:2]), squares[0].points[:, 0].mean()]
    assert bars[0].points[0, 0] == pytest.approx(np.mean(first))
    assert {"one", "fitted: nothing", "two", "angle at the end [°]"} <= {text.text for text in page.texts()}


def test_means_and_intervals_of_models_stand_where_they_are():
    """Two models, one always off by 0.1 rad, the other by 0.2 and 0.4: its interval lies about 17.2°."""
    rng = np.random.default_rng(1)
    spread = np.where(rng.random((1, 60)) < 0.5, 0.2, 0.4)
    twists = np.ones((60, 3))
    judged = {
        "wood": {
            "quartic": Judgement("quartic", twists, np.full((1, 60), 0.1), 0.02),
            "ellipsoid": Judgement("ellipsoid", twists, spread, 0.02),
        }
    }
    page = draw_angles(judged, "angles")
    (disc,) = (i for _, i in page.items() if isinstance(i, Disc) and i.radius == 2.6)
    (square,) = (
        i
        for _, i in page.items()
        if isinstance(i, Line) and i.look == Look("#ffffff", 0.5, fill=palette.GOAL)
    )
    (spreads,) = (
        i for _, i in page.items()
        if isinstance(i, Line) and i.look == Look(palette.GOAL, 1.4) and np.ptp(i.points[:, 0]) > 25
    )  # fmt: skip
    zero = next(t for t in page.texts() if t.text == "0").x
    scale = (disc.centre[0] - zero) / np.degrees(0.1)
    place = square.points[:, 0].mean()
    assert (place - zero) / scale == pytest.approx(np.degrees(spread.mean()), rel=1e-6)
    low, high = spreads.points[:, 0]
    half = 1.96 * np.degrees(spread.std()) / np.sqrt(60)
    assert low < place < high
    assert (high - low) / scale == pytest.approx(2 * half, rel=0.2)
