"""The camera: its model, tags in drawn pictures, the tracker, the filter, and eyes for a controller."""

from dataclasses import replace

import numpy as np
import pytest
from tests.extras import extra

pytest.importorskip("cv2", reason=extra("vision"))
pytest.importorskip("pyapriltags", reason=extra("vision"))

import cv2

from flatpush import InputError
from flatpush.geometry import compose, exp, pose_error, transform
from flatpush.vision.calibrate import Board, Fiducials, calibrate, check_mirrored
from flatpush.vision.eyes import DrawnEyes, Frame, TagEyes
from flatpush.vision.filter import TwistFilter
from flatpush.vision.sighting import Refused, Sighting, sighting
from flatpush.vision.synthetic import Spoil
from flatpush.vision.tags import CORNERS, cells, detect
from flatpush.vision.tracker import Tracker
from flatpush.vision.worn import Tag

from ..drawn_camera import SHEET, SIDES, SIZE, board, over, sheets, watching

POSE = np.array([0.04, -0.03, 0.5])


def test_pixels_and_rays_are_those_of_opencv_and_undo_each_other():
    camera = over(tilt=0.3, turn=0.7)
    points = np.random.default_rng(0).uniform(-0.12, 0.12, (50, 3)) * (1, 1, 0.3)
    K = np.array([[camera.focal[0], 0, camera.centre[0]], [0, camera.focal[1], camera.centre[1]], [0, 0, 1]])
    turn = cv2.Rodrigues(camera.rotation)[0]
    theirs = cv2.projectPoints(points, turn, camera.translation, K, camera.distortion)[0][:, 0]
    assert np.allclose(camera.pixels(points), theirs, atol=1e-6)
    pixels = np.random.default_rng(1).uniform((0, 0), SIZE, (200, 2))
    for height in (0.0, 0.02):
        on = camera.on_plane(pixels, height)
        assert np.allclose(camera.pixels(np.column_stack([on, np.full(len(on), height)])), pixels, atol=1e-5)


def test_what_is_beyond_the_horizon_is_not_on_the_table():
    camera = over(0.3, tilt=1.25)
    assert np.isnan(camera.on_plane([640.0, 0.0])).any() != np.isnan(camera.on_plane([640.0, 959.0])).any()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"distortion": np.array([-3.0, 0, 0, 0, 0])}, "folds"),
        ({"rotation": np.diag([1.0, 1.0, -1.0])}, "rotation"),
        ({"translation": np.array([0, 0, -0.5])}, "above its table"),
        ({"focal": np.array([np.nan, 1.0])}, "finite"),
    ],
)
def test_what_is_no_camera_is_refused(change, says):
    with pytest.raises(InputError, match=says):
        replace(over(), **change)


def test_a_drawn_tag_is_seen_where_it_is_with_its_corners_in_order():
    """Also a check of the half pixel: without it all corners are off by 0.5 px."""
    camera = over(tilt=0.2)
    drawn = watching(camera)
    tag = drawn.tags["object"]
    (seen,) = detect(drawn.picture({"object": POSE}))
    corners = transform(compose(POSE, tag.pose), CORNERS * tag.size)
    there = camera.pixels(np.column_stack([corners, np.full(4, tag.height)]))
    assert seen.id == 3
    assert np.abs(seen.corners - there).max() < 0.08


def test_a_tag_as_it_is_printed_is_read_and_its_rim_is_white():
    white = cells(42)
    assert white[0].all()
    assert not white[1, 1:-1].any()
    picture = np.kron(np.where(white, 230, 20), np.ones((9, 9))).astype(np.uint8)
    (seen,) = detect(np.pad(picture, 40, constant_values=230))
    assert seen.id == 42
    # The lower left corner of the printed tag is the first.
    assert np.allclose(seen.corners[0], [40 + 9 - 0.5, 40 + 81 - 0.5], atol=0.1)
    with pytest.raises(InputError, match="586"):
        cells(587)


@pytest.mark.parametrize("spoil", [Spoil(), Spoil(noise=6, blur=1.0)], ids=["clean", "noise and blur"])
def test_poses_are_within_their_stated_spread(spoil):
    camera, rng = over(tilt=0.15), np.random.default_rng(4)
    drawn, tag = watching(camera, spoil=spoil), watching(camera).tags["object"]
    distances = []
    for _ in range(10):
        pose = np.array([*rng.uniform(-0.12, 0.12, 2) * (1, 0.7), rng.uniform(-3, 3)])
        (one,) = detect(drawn.picture({"object": pose}, rng))
        found = sighting(camera, tag, one, 0.0)
        assert isinstance(found, Sighting)
        off = pose_error(found.pose, pose)
        assert np.hypot(*off[:2]) < 1e-4
        distances.append(off @ np.linalg.solve(found.covariance, off) / 3)
    assert np.mean(distances) < 2.0


def test_the_covariance_of_an_object_is_that_of_its_tag_carried_to_its_origin():
    """By many draws of the corners' noise."""
    camera, tag = over(), Tag(3, 0.03, 0.02, np.array([0.05, 0.0, 0.4]))
    X = compose(POSE, tag.pose)
    corners = camera.pixels(np.column_stack([transform(X, CORNERS * tag.size), np.full(4, tag.height)]))
    rng, found = np.random.default_rng(0), []
    (one,) = detect(watching(camera, {"object": tag}).picture({"object": POSE}))
    for _ in range(500):
        noisy = corners + rng.normal(size=(4, 2)) * 0.1 + rng.normal(size=2) * 0.05
        seen = sighting(camera, tag, replace(one, corners=noisy), 0.0)
        assert isinstance(seen, Sighting)
        found.append([*pose_error(seen.pose, POSE), *np.sqrt(np.diag(seen.covariance))])
    table = np.array(found)
    said = np.median(table[:, 3:], axis=0)
    assert np.all(np.abs(said / table[:, :3].std(axis=0) - 1) < 0.25)


def test_a_tag_of_another_size_or_that_is_no_square_is_named():
    camera = over()
    drawn = watching(camera)
    (one,) = detect(drawn.picture({"object": POSE}))
    wrong = sighting(camera, replace(drawn.tags["object"], size=0.028), one, 0.0)
    assert isinstance(wrong, Refused)
    assert "looks 30.0" in wrong.why
    assert wrong.size
    bent = replace(one, corners=one.corners + np.array([[3, 0], [0, 0], [0, 0], [0, 0]]))
    cut = sighting(camera, drawn.tags["object"], bent, 0.0)
    assert isinstance(cut, Refused)
    assert "miss a square" in cut.why


def tracked(drawn, poses, tracker=None, rng=None, rate=30.0):
    """What a tracker saw of a block at poses."""
    tracker = tracker or Tracker(drawn.camera, drawn.tags)
    state, found = tracker.start(), []
    for k, pose in enumerate(poses):
        state, seen = tracker.step(state, drawn.picture({"object": pose}, rng), k / rate)
        found.append(seen)
    return found, state


def test_a_block_that_moves_is_followed_in_windows_and_found_again(monkeypatch):
    from flatpush.vision import tracker as module

    whole = []
    monkeypatch.setattr(module, "detect", lambda p, w=None: whole.append(w is None) or detect(p, w))
    drawn = watching(over())
    poses = [compose(POSE, exp(k / 30 * np.array([0.03, 0.01, 0.4]))) for k in range(6)]
    moved = np.array([-0.1, 0.05, -2.0])
    seen, state = tracked(drawn, [*poses, *[moved] * 4])
    assert whole[:11] == [True] + [False] * 10  # its window, and a part of the picture for a second one
    for one, pose in zip(seen[:6], poses, strict=True):
        assert np.hypot(*pose_error(one.sightings["object"].pose, pose)[:2]) < 3e-5
    # Elsewhere at once: not believed before it has been seen there thrice.
    assert ["jumped" in one.notes.get("object", "") for one in seen[6:]] == [True, True, False, False]
    assert np.allclose(seen[-1].sightings["object"].pose, moved, atol=(5e-5, 5e-5, 1e-3))
    assert np.allclose(state.objects["object"].track.twist, 0, atol=2e-3)


def test_two_objects_with_one_tag_are_named():
    tag = Tag(3, 0.03, 0.02)
    drawn = watching(over(), {"object": tag, "other": tag})
    picture = drawn.picture({"object": POSE, "other": -POSE})
    tracker = Tracker(drawn.camera, {"object": tag})
    with pytest.raises(InputError, match="picture 1 twice"):
        tracker.step(tracker.start(), picture, 0.0)
    with pytest.raises(InputError, match="two objects have one tag"):
        Tracker(drawn.camera, drawn.tags)


@pytest.mark.parametrize("where", [(-0.17, -0.12), (0.13, 0.1), (-0.03, -0.11)])
def test_a_second_object_that_comes_with_the_tag_of_one_that_is_followed_is_named(where):
    """Only the window around the first was looked at: when that was covered, the second took its name."""
    tag = Tag(3, 0.03, 0.02)
    both = watching(over(), {"object": tag, "other": tag})
    alone, other = watching(over(), {"object": tag}), np.array([*where, 1.0])
    tracker = Tracker(alone.camera, alone.tags)
    state, first = tracker.start(), alone.picture({"object": POSE})
    second = both.picture({"object": POSE, "other": other})
    for k in range(50):
        state, seen = tracker.step(state, first, k / 30)
        assert not seen.notes
    said = ""
    for k in range(50, 98):
        try:
            state, _ = tracker.step(state, second, k / 30)
        except InputError as error:
            said = str(error)
            break
    assert "tag 3 is in picture" in said
    assert "two objects wear it" in said


def test_pictures_out_of_order_of_another_size_or_with_a_wrong_tag_are_named():
    drawn = watching(over())
    picture = drawn.picture({"object": POSE})
    tracker = Tracker(drawn.camera, drawn.tags)
    state, _ = tracker.step(tracker.start(), picture, 1.0)
    with pytest.raises(InputError, match="picture 2 was taken before picture 1"):
        tracker.step(state, picture, 0.9)
    with pytest.raises(InputError, match="1280 × 480 pixels"):
        tracker.step(state, picture[::2], 1.1)
    small = Tracker(drawn.camera, {"object": replace(drawn.tags["object"], size=0.025)})
    with pytest.raises(InputError, match="picture 1: tag 3 looks 30"):
        small.step(small.start(), picture, 0.0)


def test_a_mirrored_picture_is_named():
    drawn = watching(over())
    picture = drawn.picture({"object": POSE})
    check_mirrored(picture, [3])
    with pytest.raises(InputError, match="mirrored"):
        check_mirrored(np.ascontiguousarray(picture[:, ::-1]), [3])
    with pytest.raises(InputError, match="mirrored"):
        Fiducials([Tag(3, 0.03)]).points(np.ascontiguousarray(picture[:, ::-1]))


def test_the_filter_finds_a_constant_twist_and_makes_up_for_latency():
    law, twist = TwistFilter(), np.array([0.02, -0.01, 0.5])
    noise, rng = np.diag([1e-4, 1e-4, 2e-3]), np.random.default_rng(0)
    at = lambda t: compose(POSE, exp(t * twist))  # noqa: E731
    track, distances = law.begin(0.0, POSE, noise**2), []
    for k in range(1, 200):
        t = k / 30
        z = at(t) + rng.normal(size=3) @ noise
        track = law.at(track, t)
        distances.append(law.distance(track, z, noise**2))
        track = law.after(track, z, noise**2)
    assert np.allclose(track.twist, twist, atol=(0.004, 0.004, 0.06))
    ahead = law.at(track, track.stamp + 0.15)
    off = pose_error(ahead.pose, at(track.stamp + 0.15))
    assert np.hypot(*off[:2]) < 1.5e-3  # of 3.4 mm on its way
    assert off @ np.linalg.solve(ahead.pose_covariance, off) < 12
    assert 0.4 < np.mean(distances) / 3 < 1.1  # the filter allows for accelerations that there are not
    assert np.all(np.linalg.eigvalsh(track.covariance) > 0)


def test_the_filter_carries_covariance_as_many_draws_do():
    law = TwistFilter(acceleration=1e-9, turning=1e-9, speed=0.03, spin=0.1)
    start = law.begin(0.0, POSE, np.diag([1e-3, 2e-3, 0.02]) ** 2)
    start = replace(start, twist=np.array([0.4, 0.1, 0.5]))
    ahead = law.at(start, 0.4)
    errors = np.random.default_rng(1).multivariate_normal(np.zeros(6), start.covariance, 20000)
    poses = compose(compose(start.pose, exp(errors[:, :3])), exp(0.4 * (start.twist + errors[:, 3:])))
    white = np.linalg.solve(np.linalg.cholesky(ahead.pose_covariance), pose_error(poses, ahead.pose).T)
    assert np.allclose(np.cov(white), np.eye(3), atol=0.05)


def test_a_lens_and_a_table_are_found_from_a_sheet_of_tags():
    target = Fiducials([Tag(number, size, 0.0, pose) for number, size, pose in SHEET])
    pictures = [(str(k), p) for k, p in enumerate(sheets())]
    found = calibrate(pictures, target, 0, np.zeros(3))
    true = over(SIDES[0][0])
    grid = np.array([(x, y) for x in (-0.15, 0, 0.15) for y in (-0.1, 0, 0.1)])
    for height in (0.0, 0.02):
        there = true.pixels(np.column_stack([grid, np.full(len(grid), height)]))
        assert np.linalg.norm(found.camera.on_plane(there, height) - grid, axis=1).max() < 6e-5
    assert found.rms < 0.1
    assert abs(found.camera.focal[0] / 1400 - 1) < 0.003
    assert found.focal_sd < 0.003
    with pytest.raises(InputError, match="3 or more are needed"):
        calibrate(pictures[:2], target, 0, np.zeros(3))


def test_the_frame_of_a_board_has_x_to_the_right_and_z_up():
    camera = over(lens=(0.0,) * 5, turn=0.2)
    picture = board(camera, 6, 4, 0.02)
    for shown in (picture, np.ascontiguousarray(picture[::-1, ::-1])):  # the board turned by half a turn
        pixels, places = Board(6, 4, 0.02).points(shown)
        assert places.max(axis=0).tolist() == pytest.approx([0.1, 0.06])
        x, y = pixels[5] - pixels[0], pixels[-1] - pixels[5]
        assert x[0] * y[1] - x[1] * y[0] < 0  # seen from above, v down
        assert x[0] > abs(x[1])  # to the right
    assert Board(7, 4, 0.02).points(np.full((480, 640), 128, np.uint8)) is None


def test_drawn_eyes_see_late_and_where_the_object_is():
    drawn = watching(over(), spoil=Spoil(noise=4, blur=0.7))
    eyes = DrawnEyes(Tracker(drawn.camera, drawn.tags), drawn, np.random.default_rng(0), 20.0, 0.1)
    state, came = eyes.start(), []
    hand = np.array([0.0, 0.0, 0.1])
    for k in range(31):
        time = k / 100
        state = eyes.expose(state, time, POSE + np.array([0.02 * time, 0, 0]), hand)
        state, frames = eyes.arrived(state, time)
        came += [(time, frame) for frame in frames]
    assert [round(frame.time, 3) for _, frame in came] == [0.0, 0.05, 0.1, 0.15, 0.2]
    for time, frame in came:
        assert time - frame.time == pytest.approx(0.1)
        assert np.allclose(frame.object, POSE + np.array([0.02 * frame.time, 0, 0]), atol=(1e-4, 1e-4, 4e-3))
        assert np.array_equal(frame.pusher, hand)


def test_eyes_take_the_frames_of_a_source_and_leave_the_pusher_open():
    drawn = watching(over())
    picture = drawn.picture({"object": POSE})

    class Two:
        def taken(self, until):
            return iter([Frame(until - 0.05, picture), Frame(until - 0.02, picture)])

    eyes = TagEyes(Tracker(drawn.camera, drawn.tags), Two())
    _, frames = eyes.arrived(eyes.start(), 1.0)
    assert [frame.time for frame in frames] == [0.95, 0.98]
    assert np.allclose(frames[1].object, POSE, atol=2e-4)
    assert np.isnan(frames[1].pusher).all()
