"""The pusher alone: over the object and around it."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

import flatpush as fp
from flatpush.errors import FlatpushError
from flatpush.geometry import transform
from flatpush.planning.transits import PusherPath, Transits
from flatpush.problem.mechanics import placement_of

L_SHAPE = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.02), (0.02, 0.02), (0.02, 0.06), (0.0, 0.06)]


def scene_of(outline, fingers=1, transit="planar", **pusher):
    spacing = {"fingers": 2, "spacing": 0.012} if fingers == 2 else {}
    thing = fp.Object(outline, friction=0.4)
    return fp.Scene(thing, (0.1, 0, 0), pusher=fp.Pusher(transit=transit, **spacing, **pusher))


def placements(scene):
    pushes = [
        fp.Push(f"edge {k}", scene.object.outline.at(k, 0.4), scene.pusher.fingers, scene.pusher.spacing)
        for k in range(len(scene.object.outline.vertices))
    ]
    return [placement_of(scene, push) for push in pushes]


def gaps(scene, way, fingers):
    """Distances of the fingertips from the outline, densely along a way."""
    found = []
    for a, b in zip(way.poses[:-1], way.poses[1:], strict=True):
        for f in np.linspace(0, 1, 15):
            for tip in transform(a + f * (b - a), fingers):
                found.append(scene.object.outline.nearest(tip).distance - scene.pusher.tip_radius)
    return np.array(found)


@pytest.mark.parametrize("fingers", [1, 2])
def test_around_a_concave_object_without_touching_it(fingers):
    scene = scene_of(L_SHAPE, fingers)
    transits, places = Transits(scene), placements(scene)
    tips = np.zeros((1, 2)) if fingers == 1 else np.array([[0, 0.006], [0, -0.006]])
    for a, b in list(permutations(places, 2))[::2]:
        way = transits.between(a, b)
        assert way.poses[0] == pytest.approx(a.pose)
        assert way.poses[-1][:2] == pytest.approx(b.pose[:2])
        assert np.cos(way.poses[-1][2] - b.pose[2]) == pytest.approx(1)
        distance = gaps(scene, way, tips)
        assert distance.min() > -1e-8
        inner = replace_ends(way)
        assert gaps(scene, inner, tips).min() > 0.9e-3


def test_around_the_object_the_fingers_keep_the_clearance_of_the_scene():
    """The scene's clearance of 5 mm, not only the least gap of 1 mm; a little more, since corners are chords."""
    scene = scene_of(L_SHAPE)
    scene = replace(scene, planning=fp.Planning(clearance=0.005))
    first, second, *_ = placements(scene)
    inner = replace_ends(Transits(scene).between(first, second))
    assert 0.0049 < gaps(scene, inner, np.zeros((1, 2))).min() < 0.0052


def replace_ends(way):
    """Without the straight stretches that leave and reach the contacts."""
    return replace(way, poses=way.poses[1:-1], heights=way.heights[1:-1])


def test_the_way_around_is_the_shortest():
    """Around a square's corner: tangent to the quarter circle, compared with its closed form."""
    square = [(-0.02, -0.02), (0.02, -0.02), (0.02, 0.02), (-0.02, 0.02)]
    scene = scene_of(square, tip_radius=0.004, approach=0.002)
    transits = Transits(scene)
    a, b = (placement_of(scene, fp.Push("p", scene.object.outline.at(k, 0.5))) for k in (0, 1))
    way = transits.between(a, b)
    radius = 0.004 + 0.001
    # Each end stands at the offset's distance; two tangents and a quarter circle about the corner.
    expected = 2 * (0.001 + 0.02) + radius * np.pi / 2
    assert way.pusher_length == pytest.approx(expected, rel=0.02)
    assert way.pusher_length >= expected - 1e-4


def test_over_the_object():
    scene = scene_of(L_SHAPE, 2, "lift")
    places = placements(scene)
    way = Transits(scene).between(places[0], places[3])
    lifted = way.heights.max()
    assert lifted == scene.pusher.lift
    # Nothing moves sideways unless it is up or on the contact's own line.
    for (p, h), (q, g) in zip(
        zip(way.poses[1:-2], way.heights[1:-2], strict=True),
        zip(way.poses[2:-1], way.heights[2:-1], strict=True),
        strict=True,
    ):
        assert (h == g == lifted) or np.allclose(p, q)


def test_a_transit_keeps_the_limits():
    limits = {"speed": 0.05, "acceleration": 0.2, "travel_speed": 0.08, "travel_acceleration": 0.4}
    scene = scene_of(L_SHAPE, 2, "lift", **limits)
    places = placements(scene)
    segment = Transits(scene).between(places[0], places[1]).segment(scene.pusher, np.array([0.1, 0.2, 1.0]))
    tips = np.array([transform(X, np.array([[0, 0.006], [0, -0.006]])) for X in segment.pusher])
    heights = np.broadcast_to(segment.height[:, None, None], (*tips.shape[:2], 1))
    way = np.concatenate([tips, heights], axis=2)
    speed = np.linalg.norm(np.diff(way, axis=0), axis=2).max(axis=1) / np.diff(segment.times)
    lifted = np.maximum(segment.height[:-1], segment.height[1:]) > 0
    assert 0.05 < speed[lifted].max() <= 0.08 * (1 + 1e-9)
    assert speed[~lifted].max() <= 0.05 * (1 + 1e-9)
    assert np.max(
        np.abs(np.diff(segment.pusher[:, 2])) / np.diff(segment.times)
    ) <= scene.pusher.turn_rate * (1 + 1e-9)
    assert segment.times[-1] == pytest.approx(
        Transits(scene).between(places[0], places[1]).duration(scene.pusher)
    )


def test_a_long_way_on_the_table_is_driven_at_the_speed_of_the_table():
    pusher = fp.Pusher(speed=0.05, acceleration=0.2, travel_speed=0.08, travel_acceleration=0.4)
    poses = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    assert PusherPath(poses, np.zeros(2), 0.0).duration(pusher) == pytest.approx(0.3 / 0.05 + 0.05 / 0.2)
    assert PusherPath(poses, np.full(2, 0.03), 0.0).duration(pusher) == pytest.approx(0.3 / 0.08 + 0.08 / 0.4)


def test_a_finger_in_a_slot_backs_straight_out_or_not_at_all():
    slot = [
        (0, 0),
        (0.06, 0),
        (0.06, 0.04),
        (0.035, 0.04),
        (0.035, 0.015),
        (0.028, 0.015),
        (0.028, 0.04),
        (0, 0.04),
    ]
    scene = scene_of(slot, tip_radius=0.003, approach=0.0005)
    outline = scene.object.outline
    floor, wall, outside = (placement_of(scene, fp.Push("p", outline.at(k, 0.5))) for k in (4, 5, 7))
    assert gaps(scene, Transits(scene).between(floor, outside), np.zeros((1, 2))).min() > -1e-8
    with pytest.raises(FlatpushError, match="in the fingers' way"):
        Transits(scene).between(wall, outside)


def test_a_finger_that_rolled_along_leaves_square_to_the_outline():
    """It left against its direction, through the object that had turned under it (scene 39 of tests/fuzz.py)."""
    square = [(-0.02, -0.02), (0.02, -0.02), (0.02, 0.02), (-0.02, 0.02)]
    for transit in ("planar", "lift"):
        scene = scene_of(square, transit=transit, turns=False)
        below = placement_of(scene, fp.Push("p", scene.object.outline.at(0, 0.5)))
        turned = np.array([0.0, 0.0, np.deg2rad(110)])
        way = Transits(scene).landing(replace(below, pose=below.pose + turned)).reversed()
        assert way.poses[1] == pytest.approx(below.pose + turned - [0.0, 0.002, 0.0])
        assert gaps(scene, way, np.zeros((1, 2))).min() > -1e-12


def test_a_finger_that_rolled_into_a_notch_does_not_leave_through_its_wall():
    notch = [(0, 0), (0.06, 0), (0.06, 0.04), (0.04, 0.04), (0.03, 0.02), (0.029, 0.04), (0, 0.04)]
    scene = scene_of(notch, turns=False, tip_radius=0.001, approach=0.006)
    wall = placement_of(scene, fp.Push("p", scene.object.outline.at(3, 0.5)))
    with pytest.raises(FlatpushError, match="in the fingers' way"):
        Transits(scene).landing(wall)
