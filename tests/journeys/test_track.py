"""flatpush track, as a user runs it."""

import itertools
import json
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from tests.conftest import RECTANGLE
from tests.unit.test_control import PERFECT

import flatpush as fp
from flatpush.cli.app import app
from flatpush.cli.common import tell_slow_way
from flatpush.control import Camera, Measurement, SimulatedSensor
from flatpush.control.loop.closed_loop import drive, limits_used
from flatpush.control.loop.limits import Limits
from flatpush.control.tracking.plan_controller import PlanController, goal_error
from flatpush.control.tracking.simulated_run import TrackedRun
from flatpush.geometry import compose
from flatpush.simulation.plant import Plant


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    thing = fp.Object(RECTANGLE, friction=0.4, name="rectangle")
    found = fp.plan(fp.Scene(thing, (-0.04, -0.12, 0.5)))
    path = tmp_path_factory.mktemp("track") / "plan.json"
    found.save(path)
    return found, path


def call(*arguments):
    return app([str(a) for a in arguments], standalone_mode=False)


@pytest.mark.parametrize("law", ["path", pytest.param("dfl", marks=pytest.mark.slow)])
def test_a_plan_is_tracked_reported_and_drawn(plan, law, tmp_path, capsys):
    _, path = plan
    figure = tmp_path / "run.svg"
    perfect = ("--rate", 60, "--noise", "0,0", "--latency", 0)
    assert call("track", path, "--controller", law, *perfect, "--figure", figure) == 0
    text = capsys.readouterr().out
    assert "arrived" in text
    assert "sticking" in text
    assert "looking" in text  # counted, but not told again for every frame
    assert "looking at the object" not in text
    assert figure.read_bytes().lstrip().startswith(b"<")
    noisy = ("track", path, "--controller", law, "--friction", 0.35, "--seed", 3, "--json")
    assert call(*noisy, "--tolerance", "1,1") == 0
    first = json.loads(capsys.readouterr().out)
    assert first["outcome"] == "arrived"
    assert first["distance"] < 0.001
    assert first["turn"] < np.deg2rad(1)


@pytest.mark.slow
def test_a_seed_gives_the_same_run_and_ending_beside_the_goal_has_a_status(plan, capsys):
    again = ("track", plan[1], "--controller", "path", "--friction", 0.35, "--seed", 3, "--json")
    assert call(*again, "--tolerance", "1,1") == 0
    first = json.loads(capsys.readouterr().out)
    assert call(*again, "--tolerance", "0.001,0.001") == 3
    beside = json.loads(capsys.readouterr().out)
    assert beside["outcome"].startswith(f"ended beside the goal: {1000 * beside['distance']:.2f} mm")
    assert {**beside, "outcome": "arrived"} == first


def test_what_makes_no_sense_is_refused(plan):
    _, path = plan
    for option, value, rule in (
        ("--rate", "0", "rate is positive"),
        ("--controller", "pid", "path, dfl, horizon"),
        ("--noise", "-1,0", "0 or more"),
        ("--tolerance", "0,1", "both positive"),
        ("--camera", "0", "camera is positive"),
        ("--friction", "-0.1", "0 or more"),
        ("--timing", "late", "even, plan"),
        ("--centre", "100,0", "off the object"),
        ("--figure", "run.gif", "ends in"),
    ):
        with pytest.raises(fp.InputError, match=rule):
            call("track", path, option, value)
    with pytest.raises(fp.InputError, match="frequency: gains are positive"):
        call("track", path, "--controller", "dfl", "--frequency", "0")
    with pytest.raises(fp.InputError, match="at 10 Hz no k_d makes"):
        call("track", path, "--controller", "dfl", "--rate", "10", "--frequency", "30")


def drives(plan, law, start, camera=PERFECT, duration=None, **options):
    controller = PlanController.of(plan, law, **options)
    first = plan.pushes[0]
    plant = Plant(plan.scene.object, first.fingers, plan.scene.pusher.tip_radius)
    hand = first.pusher[0] - np.array([0.0, 0.03, 0.0])
    sensor = SimulatedSensor(camera, np.random.default_rng(0))
    return drive(controller, plant, start, hand, sensor, duration or 3 * plan.duration)


def test_what_the_path_law_follows_exactly_ends_at_the_goal(plan):
    """On the exact surface of the support, where flatness is not exact: the drift of the flat point is made up for."""
    run = drives(plan[0], "path", plan[0].scene.start_pose)
    distance, turn = goal_error(plan[0], run.object[-1])
    assert run.outcome == "arrived"
    assert distance < 5e-5
    assert np.rad2deg(turn) < 0.05


@pytest.mark.parametrize("law", ["path", "dfl"])
def test_with_the_plan_s_time_law_the_pusher_keeps_to_the_plan(plan, law):
    """From rest to rest in each arc, within the pusher's speed and acceleration, and in the plan's time."""
    run = drives(plan[0], law, plan[0].scene.start_pose, timing="plan")
    distance, turn = goal_error(plan[0], run.object[-1])
    assert run.outcome == "arrived"
    assert distance < 5e-5
    assert np.rad2deg(turn) < 0.05
    pushing = [k for k, mode in enumerate(run.modes) if mode in ("path", "saturated", "tracking")]
    assert (pushing[-1] - pushing[0]) / 60 == pytest.approx(plan[0].pushes[0].times[-1], rel=0.02)
    assert all(share <= 1.000001 for share in used(plan[0], run).values())


def test_feedback_brings_back_what_grows_without_it(plan):
    start = plan[0].scene.start_pose + np.array([0.0005, -0.0005, np.deg2rad(0.5)])
    run = drives(plan[0], "path", start)
    assert run.outcome == "arrived"
    distance, turn = goal_error(plan[0], run.object[-1])
    assert distance < 0.002
    assert np.rad2deg(turn) < 2


def test_a_finger_that_has_lost_the_object_stops(plan):
    """Where the table is quite another and the finger slides off, it says so and does not push on into the air."""
    thing = plan[0].scene.object
    scene = plan[0].scene
    controller = PlanController.of(plan[0], "path")
    plant = Plant(thing, [[0.0, 0.0]], scene.pusher.tip_radius, friction=0.05, cof=[-0.02, 0.0])
    hand = compose(plan[0].pushes[0].pusher[0], [-0.02, 0, 0])
    sensor = SimulatedSensor(PERFECT, np.random.default_rng(0))
    run = drive(controller, plant, scene.start_pose, hand, sensor, 120.0)
    assert run.outcome == "the finger lost the object"
    assert run.times[-1] < 30


def test_frames_of_before_the_pusher_went_on_are_no_news(plan):
    controller = PlanController.of(plan[0], "path")
    frame = Measurement(0.0, np.asarray(plan[0].scene.start_pose), np.array([-0.1, 0.0, 0.0]))
    state, _ = controller.step(controller.start(0.05), frame, 0.1)
    assert state.phase.poses == ()
    state, _ = controller.step(state, replace(frame, time=0.06), 0.11)
    np.testing.assert_allclose(state.phase.poses, [frame.object])


@pytest.mark.parametrize(
    ("frames", "noise"),
    [(60, 0.3), *(pytest.param(*of, marks=pytest.mark.slow) for of in ((15, 0.3), (120, 1.0)))],
)
def test_it_lands_whatever_the_camera(plan, frames, noise):
    """The place to land at is the mean of what was seen at rest, so that it does not run away with the noise."""
    camera = Camera(rate=frames, position=noise / 1000, angle=np.deg2rad(noise))
    run = TrackedRun(camera=camera, seed=1).of(plan[0])
    assert "path" in run.modes
    assert not run.outcome.startswith("out of time")


def test_out_of_time_says_what_it_was_doing(plan):
    run = drives(plan[0], "path", plan[0].scene.start_pose, camera=Camera(rate=2.0), duration=3.0)
    assert run.outcome.startswith("out of time after 3.0 s, looking: looking at the object")


def test_a_push_of_one_sample_is_refused(plan):
    (push,) = plan[0].pushes
    still = replace(push, times=push.times[:1], object=push.object[:1], pusher=push.pusher[:1], arcs=())
    segments = tuple(still if s is push else s for s in plan[0].segments)
    damaged = replace(plan[0], segments=segments)
    for follow in (PlanController.of, fp.simulate, partial(fp.study, runs=2)):
        with pytest.raises(fp.InputError, match="has no motion") as refused:
            follow(damaged)
        assert refused.value.key == f"segments[{[s is still for s in segments].index(True)}]"


def test_fingers_far_away_are_refused_before_anything_is_simulated(plan):
    (push,) = plan[0].pushes
    far = replace(push, fingers=np.array([[0.0, 1e9]]))
    damaged = replace(plan[0], segments=tuple(far if s is push else s for s in plan[0].segments))
    with pytest.raises(fp.InputError, match="1000 times the object's size") as refused:
        damaged.check_motion()
    assert refused.value.key == f"segments[{[s is far for s in damaged.segments].index(True)}].fingers"


def test_the_slow_way_is_told_with_the_time_that_it_takes(plan, monkeypatch, capsys):
    """Feet on one line are not compiled; by a clock on which a step takes half a second."""
    found, (push,) = plan[0], plan[0].pushes
    clock = SimpleNamespace(perf_counter=itertools.count(0.0, 0.5).__next__)
    monkeypatch.setattr("flatpush.cli.common.time", clock)
    tell_slow_way(found)
    assert capsys.readouterr().err == ""
    with pytest.warns(fp.friction.CollinearSupportWarning):
        feet = fp.Support.points([(-0.02, 0.0), (0.0, 0.0), (0.02, 0.0)], [1.0, 1.0, 1.0])
    slow = replace(found, scene=replace(found.scene, object=fp.Object(RECTANGLE, feet, friction=0.4)))
    for asked, steps in (({"runs": 10}, 10 * len(push.times)), ({"rate": 60.0}, 60 * push.times[-1])):
        tell_slow_way(slow, **asked)
        assert f"on one line); this takes about {0.5 * steps:.0f} s" in capsys.readouterr().err


@pytest.mark.parametrize("law", ["path", "dfl", "horizon"])
def test_a_plan_without_pushes_is_refused(plan, law):
    with pytest.raises(fp.InputError, match="no push to follow"):
        TrackedRun(law).of(replace(plan[0], segments=()))


def used(plan, run):
    return limits_used(run, Limits.of(plan.scene.pusher, plan.pushes[0].fingers))


@pytest.mark.parametrize("law", ["path", "dfl", "horizon"])
def test_every_limit_is_kept_with_noise(plan, law):
    """By the differences of where the fingertips were at the ticks."""
    run = TrackedRun(law, start=(0.0005, 0.0, 0.01), seed=2).of(plan[0])
    shares = used(plan[0], run)
    assert all(share <= 1.000001 for share in shares.values()), shares
    assert min(shares["speed"], shares["travel_speed"]) > 0.9  # and they are used


@pytest.mark.parametrize("law", ["path", pytest.param("dfl", marks=pytest.mark.slow)])
def test_two_fingers_carry_the_object_without_sliding(two_finger_plan, law):
    run = TrackedRun(law, camera=PERFECT).of(two_finger_plan)
    assert run.outcome == "arrived"
    assert not any(mode.startswith("sliding") for mode in run.contacts)
    distance, turn = goal_error(two_finger_plan, run.object[-1])
    assert distance < 5e-5
    assert np.rad2deg(turn) < 0.05
    assert all(share <= 1.000001 for share in used(two_finger_plan, run).values())


@pytest.mark.slow
def test_two_fingers_are_not_worse_than_the_open_loop_for_noise_of_the_camera():
    """Its three sides square the triangle up in the open loop: from a start 0.5 mm and 0.5° off it ends exactly at the
    goal in the median. Feedback steered by every look's noise and left 0.02 mm and 0.09°."""
    plan, ends = fp.plan(fp.load_scene("examples/triangle.yaml")), []
    for seed, (x, y, turn) in enumerate([(0.3, 0.4, 0.5), (-0.5, 0.0, -0.5), (0.0, -0.5, 0.5)]):
        off = 0.001 * x, 0.001 * y, float(np.deg2rad(turn))
        run = TrackedRun("path", start=off, seed=seed).of(plan)
        assert run.outcome == "arrived"
        assert max(used(plan, run).values()) <= 1.000001
        ends.append(goal_error(plan, run.object[-1]))
    distance, turn = np.median(ends, axis=0)
    assert distance < 1e-5
    assert np.rad2deg(turn) < 0.01


def test_a_bad_frame_on_the_way_to_the_object_stops_the_pusher(plan):
    controller = PlanController.of(plan[0], "path")
    state = controller.start()
    frame = Measurement(0.0, np.array([np.nan, 0, 0]), np.zeros(3))
    held, command = controller.step(state, frame, 0.0)
    assert held.mode == "held"
    assert not command.velocity.any()
    with pytest.raises(fp.InputError, match="no push to follow"):
        PlanController.of(fp.Plan("no_plan", plan[0].scene))
