"""The picture of a plan: what stands where."""

import itertools

import numpy as np
import pytest
from tests.drawn_plans import ARCS, LEFT, RIGHT, SPEED, TRIANGLE, boxes_overlap, follow, make_plan

from flatpush.geometry import Outline, inverse, transform
from flatpush.problem import (
    Object,
    Scene,
)
from flatpush.view import palette
from flatpush.view.drawing import Disc, Drawing, Line
from flatpush.view.labels import Labels
from flatpush.view.panel import Panel, frame_for
from flatpush.view.plan_figure import cone_length, draw_plan
from flatpush.view.timeline import Timeline, doing
from flatpush.view.trace import fingertips, rollout_paths, trace_pushes
from flatpush.view.words import STRIP, plan_title


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
    assert plan_title(plan) == f"triangle: 9 pushes, {plan.duration:.0f} s"


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
