"""Recorded runs through the simulator, on runs whose truth is known: made by the simulator, seen by a wrong camera."""

from dataclasses import replace

import numpy as np
import pytest

from flatpush.documents.robot_log import RobotRun
from flatpush.errors import InputError
from flatpush.experiments import experiment
from flatpush.experiments.replay import logged
from flatpush.geometry import Outline, compose, exp, inverse
from flatpush.problem import Object
from flatpush.simulation.calibration import Parameters, Setup, contact_calibration, fit_to_ends
from flatpush.simulation.replay import (
    BELIEVED,
    Recording,
    doubts,
    errors,
    gap_seen,
    replay,
    rigid,
    trajectory_errors,
)

FINGERS, TIP = np.array([[0.0, 0.009], [0.0, -0.009]]), 0.0025
TRUE = Parameters(
    camera=np.array([0.004, -0.006, 0.008, -0.02, 0.0006, -0.0017]),
    tags={"rectangle": np.array([0.0008, -0.0005, 0.012])},
    friction=0.6,
    lag=0.16,
)
TICK = 1 / 30


@pytest.fixture(scope="module")
def given(rectangle) -> Setup:
    return Setup({"rectangle": rectangle}, FINGERS, TIP, np.array([0.0, -0.3]))


def camera_sees(poses, parameters, setup):
    """What the camera reports where the object is: the inverse of Registration.poses."""
    camera = parameters.registration(setup, "rectangle").camera
    tagged = compose(poses, inverse(parameters.tags["rectangle"]))
    seen = tagged.copy()
    seen[:, :2] = (
        np.linalg.solve(camera.matrix, (tagged[:, :2] - camera.pivot - camera.shift).T).T + camera.pivot
    )
    seen[:, 2] -= camera.turn
    return seen


def made(setup, heading, parameters=TRUE, arcs=(0.0, 4.0, -3.0), start="0", run="0") -> RobotRun:
    """Pushes from behind, left and right sides in turn, along arcs, with pauses between; lagging as a camera does."""
    plant = parameters.plant(setup, "rectangle")
    q = np.array([0.02, -0.3, heading])
    times, poses, hands, actions, clock = [], [], [], [], 0.0
    for number, turn in enumerate(arcs):
        side = (0.0, 0.5 * np.pi, np.pi)[number % 3]
        reach = (0.025, 0.0175, 0.025)[number % 3] + TIP + 0.001
        hand = compose(q, np.array([-reach * np.cos(side), -reach * np.sin(side), side]))
        step = np.array([0.0005, 0.0, 0.0005 * turn])
        way = np.array([compose(hand, exp(k * step)) for k in range(130)])
        found = plant.follow(q, way)
        assert found.outcome == ""
        hands.append(way)
        poses.append(found.object)
        times.append(clock + TICK * np.arange(len(way)))
        actions.append(np.full(len(way), number + 1))
        clock = times[-1][-1] + 2.5
        q = found.object[-1]
    late = []
    for t, way in zip(times, poses, strict=True):
        late.append(
            np.column_stack([np.interp(t - parameters.lag, t, c) for c in way.T])
        )  # as a camera sees it
        late[-1][-1] = way[-1]
    actions[0][-1] = 2  # as in the logs: a row too early
    t, seen, hand = (
        np.concatenate(times),
        camera_sees(np.concatenate(late), parameters, setup),
        np.concatenate(hands),
    )
    first = slice(0, 1)
    return RobotRun(
        "rectangle", start, run,
        np.concatenate([[0.0], t + 1.0]),
        np.concatenate([seen[first] + 0.1, seen]), np.concatenate([hand[first] - 0.1, hand]),
        np.concatenate([[1], *actions]), np.ones(len(t) + 1, bool), np.arange(len(t) + 1),
    )  # fmt: skip


@pytest.fixture(scope="module")
def recordings(given) -> list[Recording]:
    return [Recording.of(made(given, h, start=str(k))) for k, h in enumerate((0.0, 1.3, -2.0, 2.6))]


def test_strokes_begin_where_the_hand_jumps_not_where_the_number_changes(recordings):
    one = recordings[0]
    assert one.strokes == ((1, 131), (131, 261), (261, 391))
    np.testing.assert_array_equal(one.first, one.run.poses[1])
    np.testing.assert_array_equal(one.final, one.run.poses[-1])


def test_the_true_parameters_predict_the_run_exactly(given, recordings):
    one = recordings[1]
    predicted = TRUE.replay(given, one)
    registration = TRUE.registration(given, "rectangle")
    assert predicted.outcomes == ("", "", "")
    np.testing.assert_allclose(predicted.final, registration.poses(one.final), atol=1e-9)
    whole = trajectory_errors(one, predicted, registration, TRUE.lag)
    assert whole.shape == (390, 2)
    # The last row of a stroke is made to be the end, as where the hand waits.
    assert np.quantile(whole, 0.98, axis=0) == pytest.approx([0.0, 0.0], abs=1e-4)


def test_what_sticks_is_predicted_rigidly_too(given, recordings):
    one = recordings[0]
    plant, registration = TRUE.plant(given, "rectangle"), TRUE.registration(given, "rectangle")
    a, b = replay(one, plant, registration), rigid(one, plant, registration)
    assert b.outcomes == ("", "", "")
    assert errors(b.final, a.final) == pytest.approx([0.0, 0.0], abs=3e-4)


def test_a_hand_that_passes_by_is_an_outcome(given, recordings):
    run = recordings[0].run
    away = Recording.of(replace(run, hands=run.hands + np.array([0.5, 0.0, 0.0])))
    for way in (replay, rigid):
        predicted = way(away, TRUE.plant(given, "rectangle"), TRUE.registration(given, "rectangle"))
        assert predicted.outcomes == ("not touched",) * 3
        np.testing.assert_allclose(predicted.final, TRUE.registration(given, "rectangle").poses(away.first))


def test_a_slide_at_a_landing_is_taken_from_the_camera_on_a_straight_edge_only(given):
    """The object slides 1.6 mm along the fingers as they land, which nothing in the hand's motion tells."""
    slip, parameters = 0.0016, replace(TRUE, tags={"rectangle": np.zeros(3)})
    run = made(given, 0.4, parameters, arcs=(0.0, 0.0))
    one = Recording.of(run)
    plant, registration = parameters.plant(given, "rectangle"), parameters.registration(given, "rectangle")
    (a, b), hand = one.strokes[1], one.hands[1]
    q = replay(one, plant, registration).poses[0][-1]
    slid = plant.follow(q + slip * np.array([-np.sin(hand[0, 2]), np.cos(hand[0, 2]), 0.0]), hand).object
    slid[:3] = q  # the hand comes from a millimetre away
    late = np.column_stack([np.interp(run.times[a:b] - TRUE.lag, run.times[a:b], c) for c in slid.T])
    late[-1] = slid[-1]
    poses = run.poses.copy()
    poses[a:b] = camera_sees(late, parameters, given)
    seen = Recording.of(replace(run, poses=poses))
    true = registration.poses(seen.final)
    alone, corrected = (
        errors(parameters.replay(given, seen, landings).final, true) for landings in (False, True)
    )
    assert alone[0] == pytest.approx(slip, abs=1e-4)
    assert corrected[0] == pytest.approx((1 - BELIEVED) * slip, abs=1e-4)
    assert replay(seen, plant, registration, TRUE.lag).poses[0] == pytest.approx(
        parameters.replay(given, seen).poses[0]
    )
    round_ = replace(given, objects={"rectangle": Object(Outline.circle(0.0175))})
    both = [parameters.replay(round_, seen, landings).final for landings in (False, True)]
    assert both[0] == pytest.approx(both[1], abs=0)


def spoilt(run, how):
    """The run with one thing wrong."""
    poses, hands = run.poses.copy(), run.hands
    if how == "still":
        poses[:] = poses[1]
    if how == "leaps":
        poses[200:220, 0] += 0.05
    if how == "mirrored":
        poses[:, 1:] *= -1
    if how == "scaled":
        poses[:, :2] *= 1.3
    return replace(run, poses=poses, hands=hands)


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ("still", "the object is not pushed: it moves by 0.0 mm at most"),
        ("leaps", "line 200: the object jumps by 50 mm between two frames"),
        ("mirrored", r"line 40: the object was moved by \d+ mm, and the nearest finger is \d+\.\d mm"),
        (
            "scaled",
            r"line [4-9]\d: the object was moved by \d+ mm, and the nearest finger is \d+\.\d mm from touching",
        ),
    ],
)
def test_what_cannot_be_a_run_of_this_object_is_named(given, recordings, how, says):
    """calibrate and replay fitted and printed numbers for all of these."""
    thing = given.objects["rectangle"]
    recordings[0].check(thing, FINGERS, TIP)
    with pytest.raises(InputError, match=says):
        Recording.of(spoilt(recordings[0].run, how)).check(thing, FINGERS, TIP)
    with pytest.raises(InputError, match="scene of another object"):
        recordings[0].check(Object(Outline.circle(0.06)), FINGERS, TIP)


def test_runs_of_another_object_or_with_a_wrong_size_of_the_tag_are_told(given, recordings):
    """They were replayed with differences of millimetres and status 0, without a word."""

    corners = given.objects["rectangle"].outline.vertices

    def gap(run, size=1.0, scale=1.0):
        plant = TRUE.plant(replace(given, objects={"rectangle": Object(size * corners)}), "rectangle")
        poses = run.run.poses * [scale, scale, 1.0]
        run = Recording.of(replace(run.run, poses=poses))
        return gap_seen(run, plant, FINGERS, TRUE.registration(given, "rectangle"), TRUE.lag)

    for one in recordings:
        assert gap(one) < 2e-4
        assert gap(one, 1.1) == pytest.approx(0.1 * abs(corners).min(), abs=8e-4)
        assert gap(one, 1.0, 1.1) > 2e-3
    ends = np.array([[0.001, 0.02], [0.004, 0.06]])
    assert not doubts("block", ends, np.full(2, 0.003), False)
    assert not doubts("block", ends, np.full(2, 0.001), True)
    (aside,) = doubts("block", ends, np.array([0.001, 0.003]), True)
    assert "block was seen 2.0 mm from the finger that pushed it, in the mean of 2" in aside
    (far,) = doubts("block", 10 * ends, np.full(2, 0.003), False)
    assert "runs of block end 25 mm and 23° from where they are predicted" in far
    assert "a wrong size or place of the tag" in far


def test_a_camera_map_that_cannot_be_right_is_told():
    """A size of the tag that is wrong by 30 % was made up for by the map, without a word."""
    assert not TRUE.doubt
    assert (
        "a scale of 0.77: a wrong size of the tag" in Parameters(np.array([-0.23, 0, 0, -0.23, 0, 0])).doubt
    )
    assert "mirrors" in Parameters(np.array([0, 0, 0, -2, 0, 0])).doubt


def test_contacts_tell_the_camera_and_the_tag_without_an_end(given, recordings):
    found = contact_calibration(recordings, given)
    assert found.lag == pytest.approx(TRUE.lag, abs=0.01)
    assert found.friction is None
    before, after, true = (p.registration(given, "rectangle") for p in (Parameters(), found, TRUE))
    rows = np.concatenate([one.run.poses[1:] for one in recordings])
    at_first = errors(before.poses(rows), true.poses(rows))
    at_last = errors(after.poses(rows), true.poses(rows))
    assert at_first[:, 0].mean() > 1.5e-3
    assert at_last[:, 0].mean() < 0.4e-3
    assert np.degrees(at_last[:, 1].mean()) < 0.25


def test_ends_tell_the_rest(given, recordings):
    start = contact_calibration(recordings[:3], given)
    found = fit_to_ends(recordings[:3], given, start)
    unseen = recordings[3]

    def off(p):
        return errors(p.replay(given, unseen).final, p.registration(given, "rectangle").poses(unseen.final))

    assert off(Parameters())[0] > 0.5e-3
    assert off(found)[0] < 0.15e-3
    assert np.degrees(off(found)[1]) < 0.1
    assert abs(found.inset) < 1e-4
    assert found.friction > 0.4  # above, fingers stick: how much there is does not show


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda run: replace(run, seen=np.arange(len(run.times)) < 2), "fewer than two rows"),
        (
            lambda run: replace(run, seen=np.arange(len(run.times)) < 300),
            r"no final pose: .* 15\.87 s of 18\.90 s",
        ),
    ],
)
def test_a_run_without_a_measured_start_or_end_is_refused(recordings, change, said):
    with pytest.raises(InputError, match=said):
        Recording.of(change(recordings[0].run))


def test_runs_too_short_tell_nothing_of_the_contact(given, recordings):
    run = recordings[0].run
    short = replace(
        run, **{n: getattr(run, n)[:20] for n in ("times", "poses", "hands", "actions", "seen", "lines")}
    )
    with pytest.raises(InputError, match="long enough"):
        contact_calibration([Recording.of(short)], given)


def test_the_experiment_names_what_is_missing_and_reads_raw_logs(tmp_path, recordings):
    with pytest.raises(InputError, match=r"log_tri\.csv, plan_graph/shape_butterfly\.csv"):
        experiment("replay", tmp_path)(None)
    run = recordings[0].run
    place = tmp_path / "robot_exp_logs" / "tri" / "start1"
    place.mkdir(parents=True)
    rows = np.column_stack([run.times, run.poses * [1e3, 1e3, 1], run.hands * [1e3, 1e3, 1], run.actions])
    np.savetxt(place / "log1.txt", rows, fmt="%.9f", delimiter=", ")
    (read,) = logged(tmp_path / "robot_exp_logs", "tri")
    assert (read.object, read.start, read.run) == ("tri", "start1", "log1")
    np.testing.assert_allclose(read.poses, run.poses, atol=1e-9)
    with pytest.raises(InputError, match=r"log_butter\.csv, plan_graph/shape_butterfly\.csv"):
        experiment("replay", tmp_path)(None)
