"""Pictures of moments, of many runs, and of runs under feedback."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from tests.drawn_plans import TRIANGLE, make_plan

from flatpush.control.loop.closed_loop import ClosedLoopRun
from flatpush.errors import InputError
from flatpush.geometry import compose, exp, transform
from flatpush.simulation.study import Noise, Runs
from flatpush.view import save_snapshots
from flatpush.view.drawing import Line
from flatpush.view.snapshots import moments, way_until
from flatpush.view.timeline import Timeline
from flatpush.view.track_figure import _strip_entries, clearances, draw_track
from flatpush.view.tube import draw_tube, ends_box, tube_across, tube_figure


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
    assert {"mean and 95 % ellipse", "end of a push"} <= said
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


def made_run(modes=("path", "saturated"), obstacle=((0.2, -0.2), (0.3, -0.2), (0.3, 0.3), (0.2, 0.3))):
    plan = make_plan(obstacles=([list(corner) for corner in obstacle],))
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
    assert f"least {1e3 * gaps.min():.1f} mm" in said


def test_names_at_a_low_figure_of_a_run_do_not_collide():
    """The names of the two axes ran into each other and into "contact", and 0.04 mm of clearance read 0.0."""
    plan, run = made_run()
    right = transform(run.object[:, None], TRIANGLE[None])[..., 0].max() + 4e-5
    plan, run = made_run(obstacle=((right, -0.2), (right + 0.8, -0.2), (right + 0.8, 0.1), (right, 0.1)))
    texts = draw_track(plan, run).texts()
    assert "least 0.04 mm" in {t.text for t in texts}
    for k, one in enumerate(texts):
        for other in texts[k + 1 :]:
            apart = (one.box[0] >= other.box[2], one.box[2] <= other.box[0])
            apart += (one.box[1] >= other.box[3], one.box[3] <= other.box[1])
            assert any(apart), (one.text, other.text)


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
