"""The simulated camera: when frames come, what is on them, and what is refused."""

import numpy as np
import pytest

from flatpush import InputError
from flatpush.control import Camera, SimulatedSensor

POSE, HAND = np.array([0.1, -0.2, 0.7]), np.array([0.08, -0.2, 0.7])


def watched(camera, seconds, rate=1000, seed=0):
    """All frames of a resting object, with the times at which they came."""
    sensor = SimulatedSensor(camera, np.random.default_rng(seed))
    state, found = sensor.start(), []
    for k in range(round(seconds * rate) + 1):
        state = sensor.expose(state, k / rate, POSE, HAND)
        state, frames = sensor.arrived(state, k / rate)
        found += [(k / rate, frame) for frame in frames]
    return found


def test_frames_come_at_the_rate_late_and_in_order():
    found = watched(Camera(rate=25, latency=0.12), 2.0)
    exposed = np.array([frame.time for _, frame in found])
    assert np.allclose(exposed, np.arange(len(exposed)) / 25, atol=1e-9)
    assert np.allclose([came - frame.time for came, frame in found], 0.12, atol=1e-9)
    assert len(found) == 48  # those exposed by 1.88 s


def test_noise_has_the_stated_spread_and_no_bias_and_the_pusher_has_none():
    camera = Camera(rate=100, latency=0.0, position=0.0004, angle=0.01)
    noise = np.array([frame.object - POSE for _, frame in watched(camera, 40.0, rate=100)])
    sd = np.array([0.0004, 0.0004, 0.01])
    n = len(noise)
    assert np.all(np.abs(noise.mean(axis=0)) < 4 * sd / np.sqrt(n))
    assert np.all(np.abs(noise.std(axis=0) / sd - 1) < 4 / np.sqrt(2 * n))
    assert np.abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 4 / np.sqrt(n)
    assert np.allclose(np.cov(noise.T), camera.covariance, atol=4 * 1e-4 / np.sqrt(n))
    assert all(np.array_equal(frame.pusher, HAND) for _, frame in watched(camera, 0.1, rate=100))


def test_dropped_frames_are_the_stated_share():
    n = 4001
    found = watched(Camera(rate=100, latency=0.0, dropped=0.3), 40.0, rate=100)
    assert abs(len(found) / n - 0.7) < 4 * np.sqrt(0.21 / n)


def test_instants_that_nobody_showed_are_not_made_up():
    sensor = SimulatedSensor(Camera(rate=10, latency=0.0, position=0, angle=0), np.random.default_rng(0))
    state = sensor.expose(sensor.start(), 0.0, POSE, HAND)
    state = sensor.expose(state, 0.57, POSE + 1.0, HAND)
    state, frames = sensor.arrived(state, 0.57)
    assert [frame.time for frame in frames] == [0.0, 0.57]
    assert np.array_equal(frames[1].object, POSE + 1.0)
    assert sensor.arrived(sensor.expose(state, 0.59, POSE, HAND), 0.59)[1] == ()
    assert len(sensor.arrived(sensor.expose(state, 0.6, POSE, HAND), 0.6)[1]) == 1


def test_the_same_generator_gives_the_same_frames():
    first, second = (watched(Camera(dropped=0.2), 1.0, seed=5) for _ in range(2))
    assert [frame.object.tolist() for _, frame in first] == [frame.object.tolist() for _, frame in second]


@pytest.mark.parametrize(
    "wrong", [{"rate": 0}, {"latency": -1}, {"position": np.nan}, {"dropped": 1.0}, {"rate": np.inf}]
)
def test_cameras_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong)) if wrong != {"dropped": 1.0} else "nothing"):
        Camera(**wrong)
