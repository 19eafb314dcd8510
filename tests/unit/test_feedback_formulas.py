"""The signs, limits and thresholds of the feedback laws, each where a mistake would not show in a closed loop."""

from dataclasses import replace

import numpy as np
import pytest

from flatpush.control.horizon.controller import HorizonController
from flatpush.control.laws.formulas import AxisGains, Bounds, FlatPose, FlatTarget, along_path, linearised
from flatpush.control.learning.belief import Place, SteeringBelief, _signal
from flatpush.control.loop.limits import Limits, braking
from flatpush.control.loop.measurement import STOP, Command, Measurement
from flatpush.experiments.feedback import task
from flatpush.geometry import transform, velocity_at


@pytest.mark.parametrize("bend", [10.0, -10.0])
def test_beside_a_bent_path_the_turn_is_that_of_a_parallel_curve(bend):
    """A curve a distance e to the left of one with radius 1/κ has the radius 1/κ - e."""
    e = 0.02
    kappa, bounded = along_path(e, 0.0, bend, 1e-12, 1e-12, 100.0, 100.0)
    assert not bounded
    assert kappa == pytest.approx(1 / (1 / bend - e))


def test_the_linearisation_turns_left_as_far_as_left_allows_and_right_as_far_as_right():
    turns = [
        linearised(
            FlatPose(0, 0, 0), 0.02, FlatTarget(0, aside, 0.02, 0, 0, 0), AxisGains(400, 400, 40, 40),
            Bounds(30.0, 10.0, 0.002, 0.06), 1e-9, 0,
        )
        for aside in (1.0, -1.0)
    ]  # fmt: skip
    assert [omega / 0.02 for _, _, omega, _, _ in turns] == pytest.approx([30.0, -10.0])
    assert all(0 < scale < 1 for _, _, _, scale, _ in turns)


def test_braking_ends_at_the_end_with_no_more_than_the_deceleration():
    length, a, dt, speeds = 0.01, 0.1, 1 / 60, []
    while length > 0 and len(speeds) < 200:
        speeds.append(braking(length, a, dt))
        length -= speeds[-1] * dt
    assert length == pytest.approx(0.0, abs=1e-12)
    assert np.max(-np.diff([*speeds, 0.0])) <= a * dt * (1 + 1e-9)


def test_whatever_is_wanted_the_limits_hold():
    limits = Limits(np.array([[0.0, 0.009], [0.0, -0.009]]), 0.02, 0.1, np.pi / 2, 0.1, 0.5)
    rng, dt, yaw, last, before = np.random.default_rng(0), 1 / 60, 0.0, STOP, np.zeros((2, 2))
    for k in range(300):
        # Anything, and turning on the spot for a while, which the turn rate bounds before the fingertips do.
        spinning = Command(np.array([0.0, 0.0, 9.0]))
        wanted = Command(rng.normal(size=3) * [0.05, 0.05, 3.0]) if k % 100 < 50 else spinning
        last = limits.kept(last, 0.0, wanted, yaw, dt)
        arms = transform([0.0, 0.0, yaw], limits.tips)
        tips = velocity_at(last.velocity, arms)
        assert np.max(np.hypot(*tips.T)) <= 0.02
        assert np.max(np.hypot(*(tips - before).T)) <= 0.1 * dt
        assert abs(last.velocity[2]) <= np.pi / 2
        yaw, before = yaw + last.velocity[2] * dt, tips


def test_a_lifted_hand_has_the_limits_of_travel_and_one_on_the_table_those_of_pushing():
    """A straight wish that is too fast, from rest: it gets to the speed that it may have, evenly."""
    limits = Limits(np.zeros((1, 2)), 0.02, 0.1, np.pi / 2, 0.1, 0.5)
    for height, speed, acceleration in ((0.0, 0.02, 0.1), (0.03, 0.1, 0.5)):
        last, dt = Command(np.zeros(3), height), 1 / 60
        speeds = [0.0]
        for _ in range(60):
            last = limits.kept(last, 0.0, Command(np.array([1.0, 0.0, 0.0]), height), 0.3, dt)
            speeds.append(float(last.velocity[0]))
        assert speeds[-1] == pytest.approx(speed, rel=2e-3)
        assert np.max(np.diff(speeds)) / dt == pytest.approx(acceleration, rel=2e-3)


@pytest.mark.parametrize(("gap", "phase"), [(0.0005, "push"), (0.001, "resume"), (0.005, "resume")])
def test_a_finger_more_than_seven_tenths_of_a_millimetre_off_the_edge_has_lost_it(gap, phase):
    scene = replace(task(1).scene, start=(-0.12, 0.0, 0.0))
    controller = HorizonController.of(scene)
    (k,) = (k for k, option in enumerate(controller.planner.usable) if option.push.name == "left")
    tip = controller.planner.usable[k].placement.tips[0]
    pose = np.asarray(scene.start_pose, dtype=float)
    hand = np.array([*(pose[:2] + tip), 0.0])
    frame = Measurement(1.0, pose, hand)
    state = replace(controller.start(), push=k, tip=tip, landings=1)
    car = controller.observer.car(state, k, tip)
    state = replace(
        state, phase="push", car=car, landed=car.radius, target=np.zeros(3), rest=0.12, allowed=0.2,
        believed=frame, gap=gap, seen=replace(state.seen, frame=frame),
    )  # fmt: skip
    after, _ = controller.act(state, 1.01)
    assert after.phase == phase


def test_of_the_moments_the_signal_is_what_is_left_when_the_noise_is_taken_off():
    """Signals and noise along four directions, mixed by a matrix: a direction of nothing but noise carries none."""
    mix = np.random.default_rng(4).normal(size=(4, 4))
    signal, noise = np.diag([4.0, 2.0, 0.5, 0.0]), np.diag([1.0, 0.9, 0.25, 1.0])
    found, taken = _signal(mix @ (signal + noise) @ mix.T, mix @ noise @ mix.T, 1e6)
    np.testing.assert_allclose(found, mix @ signal @ mix.T, atol=1e-9)
    np.testing.assert_allclose(taken, mix @ np.diag([1.0, 0.9, 0.25, 0.0]) @ mix.T, atol=1e-9)


def test_what_is_learned_is_as_uncertain_as_signal_and_noise_make_it():
    """Moments whose null vector is (c_x, c_y, m, 1), almost no prior: the estimate is that vector, and with the weight
    w the covariance S⁻¹ (S + T) S⁻¹ / w, where T is the noise along the directions that carry a signal."""
    mix = np.random.default_rng(4).normal(size=(4, 4))
    signal, noise = np.diag([4.0, 2.0, 0.5, 0.0]), np.diag([1.0, 0.9, 0.25, 1.0])
    null = np.linalg.solve(mix.T, [0.0, 0.0, 0.0, 1.0])
    null = null / null[3]
    S, N = mix @ signal @ mix.T, mix @ noise @ mix.T
    belief = SteeringBelief((Place(np.zeros(2), S + N, N, 1e6),), 1e-9 * np.eye(3), null[:3], 1)
    found = belief.estimate()
    np.testing.assert_allclose([*found.cof, found.moment], null[:3], rtol=1e-6)
    T = (mix @ np.diag([1.0, 0.9, 0.25, 0.0]) @ mix.T)[:3, :3]
    inverse = np.linalg.inv(S[:3, :3])
    w = 1e6 / (null @ N @ null)
    np.testing.assert_allclose(found.covariance, inverse @ (S[:3, :3] + T) @ inverse / w, rtol=1e-6)
