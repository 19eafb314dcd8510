"""The time law keeps speed and acceleration and covers the length."""

import numpy as np
import pytest

import flatpush as fp
from flatpush.geometry import compose, exp, pose_error, transform
from flatpush.steering.time_law import Trapezoid


@pytest.mark.parametrize("length", [1e-6, 1e-3, 0.3])
@pytest.mark.parametrize("radius", [0.005, 0.1, np.inf])
def test_trapezoid(length, radius):
    law = Trapezoid.along(length, radius, 0.02, 0.1)
    t = np.linspace(0, law.duration, 20001)
    s = law.travelled(t)
    assert s[0] == 0
    assert s[-1] == pytest.approx(length)
    speed = np.gradient(s, t)
    assert np.max(speed) <= 0.02 * (1 + 1e-9)
    assert speed[0] <= 0.1 * t[1]
    tangential = np.abs(np.gradient(speed, t))[2:-2]
    assert np.max(np.hypot(tangential, speed[2:-2] ** 2 / radius)) <= 0.1 * (1 + 1e-3)
    times, fractions = law.samples(0.04, 7)
    assert fractions[0] == 0
    assert fractions[-1] == 1
    assert times[-1] == pytest.approx(law.duration)
    assert fractions == pytest.approx(law.travelled(times) / length)
    assert np.max(np.diff(fractions)) <= (1 + 1e-9) / 7


def test_samples_are_dense_enough_for_straight_interpolation(one_finger_plan, two_finger_plan):
    """Within 0.05 mm and 0.05° in pose and time, of the object frame, the pusher and the whole outline (contract)."""
    for plan in (one_finger_plan, two_finger_plan):
        scene, push = plan.scene, plan.pushes[0]
        X, clock = push.object[0], 0.0
        option = next(o for o in fp.describe(scene) if o.push.name == push.push).option
        tips = transform(option.placement.pose, push.fingers)
        for arc in push.arcs:
            turn = abs(arc.twist[2]) * arc.duration
            centre = np.array([-arc.twist[1], arc.twist[0]]) / arc.twist[2] if turn else None
            radius = np.max(np.linalg.norm(tips - centre, axis=1)) if turn else np.inf
            length = turn * radius if turn else np.hypot(*arc.twist[:2]) * arc.duration
            law = Trapezoid.along(length, radius, scene.pusher.speed, scene.pusher.acceleration)
            assert law.duration == pytest.approx(arc.duration)
            t = np.linspace(0, arc.duration, 4001)
            true = compose(X, exp((law.travelled(t) / length)[:, None] * arc.twist * arc.duration))
            straight = np.column_stack(
                [np.interp(clock + t, push.times, push.object[:, k]) for k in range(3)]
            )
            error = np.abs(pose_error(straight, true))
            assert np.max(np.hypot(error[:, 0], error[:, 1])) < 5e-5
            assert np.max(error[:, 2]) < np.deg2rad(0.05)
            for corner in scene.object.outline.vertices:
                moved = [transform(poses[::40], corner) for poses in (straight, true)]
                assert np.max(np.linalg.norm(moved[0] - moved[1], axis=1)) < 5e-5
            X, clock = compose(X, exp(arc.twist * arc.duration)), clock + arc.duration


def test_a_hand_that_turns_with_the_object_turns_no_faster_than_it_may():
    """On a circle of 5 mm a tip at 20 mm/s would turn by 4 rad/s; the hand may turn by 1."""
    law = Trapezoid.along(0.1, 0.005, 0.02, 1.0, turn_rate=1.0)
    t = np.linspace(0, law.duration, 20001)
    assert np.max(np.gradient(law.travelled(t), t)) / 0.005 == pytest.approx(1.0)


@pytest.mark.parametrize("length", [1e-4, 5e-3, 0.3])
def test_a_law_that_is_slow_at_its_ends_moves_as_it_says(length):
    """Speed and length are integrals of what is below them, from `slow` to `slow`; motion and travelled agree."""
    law = Trapezoid(length, 0.02, 0.1, slow=0.004)
    t = np.linspace(0, law.duration, 4001)
    s, v, a = np.array([law.motion(x) for x in t]).T
    assert (v[0], v[-1]) == pytest.approx((0.004, 0.004))
    assert np.max(v) == pytest.approx(law.top)
    assert s == pytest.approx(law.travelled(t), abs=1e-15)
    assert s[-1] == pytest.approx(length)
    middles = 0.5 * (v[1:] + v[:-1])
    assert np.diff(s) == pytest.approx(middles * np.diff(t), abs=0.1 * t[1] ** 2)
    assert np.diff(v) == pytest.approx(0.5 * (a[1:] + a[:-1]) * np.diff(t), abs=0.1 * t[1])
