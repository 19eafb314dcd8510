"""A table of which nothing is known: what is refused, first pushes that are safe, and the way to the goal."""

from dataclasses import replace

import numpy as np
import pytest

from flatpush import InputError, load_scene, plan
from flatpush.cli.app import app
from flatpush.control import Camera, SimulatedSensor
from flatpush.control.horizon.controller import HorizonController
from flatpush.control.loop.closed_loop import drive
from flatpush.control.loop.frames import Seen
from flatpush.control.tracking.first_pushes import FirstPushes, TeachState, filmed, imagined, next_push
from flatpush.control.tracking.unknown_table import BoundedPlant, drawn_table, run_unknown, same_outline
from flatpush.documents import parse_scene
from flatpush.geometry import rotate, transform
from flatpush.problem import Object, Pusher, Scene, Workspace
from flatpush.simulation.plant import Plant

from ..conftest import RECTANGLE, TRIANGLE

TEXT = """flatpush: scene/1
units: {length: mm, angle: deg}
object: {outline: [[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]], support: unknown, friction: 0.3}
pusher: {fingers: 1}
start: [60, 20, 135]
goal: [0, 0, 0]
"""


def scene(bounds=None, outline=RECTANGLE, **pusher) -> Scene:
    return Scene(
        Object(outline, "unknown"), (0.05, 0.02, 0.7), (0.0, 0.0, 0.0), Pusher(fingers=1, **pusher),
        workspace=Workspace(bounds, ()),
    )  # fmt: skip


def test_an_unknown_table_is_read_only_where_it_can_be_learned(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(TEXT)
    with pytest.raises(InputError, match=r"object.support.*flatpush identify.*track SCENE --learn"):
        load_scene(path)
    read = load_scene(path, unknown=True)
    assert read.object.support_word == "unknown"
    assert np.allclose(read.object.support.covariance, Object(RECTANGLE).support.covariance)
    with pytest.raises(InputError, match="nothing is planned"):
        plan(read)
    with pytest.raises(InputError, match="unknown"):
        parse_scene({"flatpush": "scene/1", "object": {"outline": {"circle": 1}, "support": "unknown", "friction": 0.3},
                     "start": [0, 0, 0], "goal": [1, 0, 0]})  # fmt: skip


def test_a_controller_that_an_unknown_table_does_not_take_is_refused(tmp_path):
    """It was passed over without a word."""
    path = tmp_path / "scene.yaml"
    path.write_text(TEXT)
    with pytest.raises(InputError, match="by the controller horizon"):
        app(["track", str(path), "--learn", "--controller", "path"], standalone_mode=False)


def test_first_pushes_take_one_finger_and_no_obstacles():
    with pytest.raises(InputError, match="one finger"):
        FirstPushes.of(Scene(Object(RECTANGLE), (0.1, 0, 0), pusher=Pusher(fingers=2, spacing=0.018)))
    square = Object(RECTANGLE).outline
    with pytest.raises(InputError, match="without obstacles"):
        FirstPushes.of(Scene(Object(RECTANGLE), (0.3, 0, 0), workspace=Workspace(None, (square,))))


@pytest.mark.parametrize("seed", range(2))
def test_first_pushes_stay_inside_the_bounds_on_tables_that_were_not_imagined(seed):
    asked = scene((-0.08, -0.075, 0.11, 0.09))
    tables = imagined(asked.object, 0.0025)
    pose = asked.start_pose
    chosen = next_push(asked, tables, pose, ())
    assert chosen is not None
    at, direction, length = chosen
    thing = drawn_table(asked.object.outline, seed)
    tips = transform(
        pose,
        at.point - 0.0025 * at.normal + np.outer(np.linspace(0, length, 40), rotate(direction, at.normal)),
    )
    tip = asked.pusher.tip_radius
    run = Plant(thing, [[0, 0]], tip).follow(pose, np.column_stack([tips, np.zeros(40)]))
    corners = transform(run.object[:, None, :], thing.outline.vertices).reshape(-1, 2)
    for points in (corners, tips):
        assert np.all(points > (-0.08, -0.075))
        assert np.all(points < (0.11, 0.09))
    other = next_push(asked, tables, pose, (at.point,))
    assert other is not None
    assert np.hypot(*(other[0].point - at.point)) > 0.5 * thing.outline.size


def test_no_room_means_no_push(monkeypatch):
    monkeypatch.setattr("flatpush.control.tracking.first_pushes.LENGTHS", (0.03,))
    # A block of 50 × 35 mm at 40° fits into 62 mm, and a finger beside it does not.
    tight = scene((0.019, -0.011, 0.081, 0.051))
    assert next_push(tight, imagined(tight.object, 0.0025), tight.start_pose, ()) is None


def test_a_film_is_cut_by_the_times_at_which_frames_were_exposed():
    rows = tuple((0.1 * k, np.full(3, k), np.full(3, -k)) for k in range(30))
    state = TeachState(seen=Seen(), legs=((0.45, 1.0), (2.0, 2.5)), film=rows)
    first, second = filmed(state)
    assert first.times.tolist() == pytest.approx([0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
    assert second.poses[0].tolist() == [20, 20, 20]
    assert second.tips.shape == (6, 2)


def test_tables_by_chance_are_the_same_for_a_seed_and_stand():
    outline = Object(TRIANGLE).outline
    kinds = {drawn_table(outline, k).support_word for k in range(12)}
    assert kinds == {"uniform", "outline", ""}
    for k in range(12):
        one, again = drawn_table(outline, k), drawn_table(outline, k)
        assert np.array_equal(one.cof, again.cof)
        assert 0.2 <= one.friction <= 0.6
    assert same_outline(outline, Object(TRIANGLE).outline)
    assert not same_outline(outline, Object(RECTANGLE).outline)


def test_first_pushes_stop_before_the_object_leaves_the_bounds_on_a_table_that_nobody_imagined():
    asked = scene((0.0, -0.03, 0.1, 0.07))
    law = replace(FirstPushes.of(asked, stale=0.6), tables=())  # any push is held for safe
    law = replace(law, scene=replace(asked, object=drawn_table(asked.object.outline, 4)))
    eyes = SimulatedSensor(Camera(latency=0.1, position=1e-4, angle=2e-3), np.random.default_rng(0))
    run = drive(law, BoundedPlant(law.scene.object, asked), asked.start_pose, [-0.02, 0.02, 0], eyes, 100)
    assert run.outcome.startswith("stopped before the object left the bounds"), run.outcome
    assert run.modes.count("teaching") > 20


def test_after_the_first_pushes_the_bounds_are_kept_as_by_any_horizon_controller():
    """They were left out of the scene that it learned, and kept by a second, blinder rule: paths led out of them."""
    bounds = (-0.1, -0.06, 0.1, 0.1)
    thing = drawn_table(Object(RECTANGLE).outline, 1)
    asked = Scene(thing, (0.05, 0.02, 0.7), (-0.03, 0.02, 0.0), Pusher(fingers=1, tip_radius=0.0025))
    walls = replace(asked, workspace=Workspace(bounds))
    law = HorizonController.of(walls, 60, 0.1, landings=1)
    eyes = SimulatedSensor(Camera(latency=0.1, position=1e-4, angle=2e-3), np.random.default_rng(0))
    run = drive(law, BoundedPlant(thing, walls), asked.start_pose, [0.0, 0.02, 0], eyes, 100)
    assert run.outcome != "the object left the bounds"
    assert "push" in run.modes
    table = run.heights == 0
    low, high = np.array(bounds[:2]) + 0.0025, np.array(bounds[2:]) - 0.0025
    assert np.all((run.pusher[table, :2] >= low) & (run.pusher[table, :2] <= high))
    tight = Workspace((-0.06, -0.012, 0.08, 0.055))
    no_room = HorizonController.of(replace(asked, workspace=tight), 60, 0.1)
    eyes = SimulatedSensor(Camera(), np.random.default_rng(0))
    run = drive(no_room, Plant(thing, [[0, 0]], 0.0025), asked.start_pose, [0.0, 0.02, 0], eyes, 20)
    assert run.outcome.startswith("stopped")
    assert "at the start" in run.outcome


@pytest.mark.slow
def test_an_object_on_an_unknown_table_comes_to_its_goal():
    asked = scene((-0.2, -0.2, 0.2, 0.2), tip_radius=0.0025)
    thing = drawn_table(asked.object.outline, 5)
    within = (0.001, float(np.deg2rad(1.0)))
    done = run_unknown(asked, thing, Camera(position=1e-4, angle=np.deg2rad(0.1)), seed=1, tolerance=within)
    assert done.run.outcome == "arrived"
    error = asked.goal_error(done.run.object[-1])
    assert np.hypot(*error[:2]) < within[0]
    assert abs(error[2]) < within[1]
    assert done.fit is not None
    assert np.hypot(*(done.fit.thing.cof - thing.cof)) < 0.002
    assert np.all(np.diff(done.run.times) > 0)
    assert "teaching" in done.run.modes
    corners = transform(done.run.object[:, None, :], thing.outline.vertices)
    assert np.abs(corners).max() < 0.2
