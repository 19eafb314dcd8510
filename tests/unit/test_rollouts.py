"""Many closed-loop runs at once: compiled as plain, plain as the plant with its events."""

from dataclasses import replace

import numpy as np
import pytest
from tests.unit.test_control import NOMINAL, UNIT, run, square_push

import flatpush as fp
from flatpush.control.laws.formulas import AxisGains
from flatpush.control.laws.gains import Gains
from flatpush.control.laws.linearisation import TrackingController
from flatpush.control.laws.many_runs import OUTCOMES, closed_loops
from flatpush.control.laws.path_following import PathController
from flatpush.control.laws.reference import PathReference
from flatpush.control.laws.rollout import Loop, PointPush, rollout
from flatpush.control.loop.closed_loop import limits_used
from flatpush.control.loop.limits import HandLimits, Limits
from flatpush.geometry import transform
from flatpush.steering.time_law import Trapezoid

TILTED = np.array([[1.0719, -0.0177, -0.1782], [-0.0177, 1.0417, 0.1599], [-0.1782, 0.1599, 1.5104]])
TILTED = TILTED / np.outer([1, 1, UNIT], [1, 1, UNIT])


def laws():
    _, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    path = PathReference(
        np.array([[0, 0.04, x, y, heading, 0], [0.04, 0.1, x, y + 0.04, heading, 12.0]]), 0.02
    )
    return TrackingController(model, Gains(4, 4), reference=path), PathController(model, path)


def hand(model, share):
    """Limits of a point finger at a share of what the laws ask for."""
    return Limits(np.zeros((1, 2)), share * 0.02, share * 0.05, share * 0.2, 1.0, 1.0)


@pytest.mark.parametrize("law", [0, 1])
@pytest.mark.parametrize("friction", [1.0, 0.12])
@pytest.mark.parametrize("limited", [False, True])
def test_compiled_runs_are_the_plain_ones(law, friction, limited):
    controller = laws()[law]
    m, A, limits = controller.model, TILTED, hand(controller.model, 0.8) if limited else None
    controller = replace(controller, limits=limits)
    path = controller.reference if law == 0 else controller.path
    starts = np.random.default_rng(5).normal(size=(4, 3)) * [0.002, 0.002, 0.1]
    found = closed_loops(
        controller, [0, 1], starts, A, 4.0, friction=friction, edge=UNIT, record=True, threads=2
    )
    gains = [*controller.gains.kp, *controller.gains.kd] if law == 0 else [*controller.gains, 0, 0]
    push = PointPush(*m.flat_point, m.heading, m.left, m.right, *m.contact, 0.0, 1.0)
    most = HandLimits(0.016, 0.04, 0.16) if limited else HandLimits(np.inf, np.inf, np.inf)
    loop = Loop(law, 0, path.table, path.speed, push, AxisGains(*gains), 60.0, 240, UNIT, most)
    for k, start in enumerate(starts):
        way = np.full((241, 3), np.nan)
        ended = rollout(loop, start, A, np.zeros(2), friction, np.zeros((1, 2)), np.zeros((1, 3)), way)
        np.testing.assert_allclose(found.final[k], [ended.x, ended.y, ended.turn], atol=1e-9)
        np.testing.assert_allclose(found.object[k], way, atol=1e-9)
        assert (found.stuck[k], found.outcome[k]) == (ended.stuck, ended.outcome)
        assert found.worst[k] == pytest.approx(ended.worst, abs=1e-9)
        assert found.slid[k] == pytest.approx(ended.along, abs=1e-9)
    if friction < 1:
        assert np.abs(found.slid).max() > 1e-4


@pytest.mark.parametrize("friction", [1.0, 0.25])
def test_runs_agree_with_the_plant(friction):
    """The plant has events and a fourth-order step; the difference is the tick's second order."""
    plant, _ = square_push(TILTED, friction)
    controller = laws()[1]
    start = np.array([0.001, 0.0, 0.05])
    slow = run(controller, plant, start, 3.0)
    fast = closed_loops(controller, [0, 1], [start], TILTED, 3.0, friction=friction, record=True)
    n = len(slow.object) - 1
    np.testing.assert_allclose(fast.object[0, :n], slow.object[:n], atol=2e-4)


@pytest.mark.parametrize("law", [0, 1])
def test_within_limits_they_agree_with_the_plain_loop_and_keep_them(law):
    """By the differences of where the finger was, which sticks to the object."""
    plant, model = square_push()
    controller = replace(laws()[law], limits=hand(model, 0.8))
    start = np.array([0.0005, 0.0, 0.02])
    slow = run(controller, plant, start, 3.0)
    fast = closed_loops(controller, [0, 1], [start], NOMINAL, 3.0, record=True)
    n = len(slow.object) - 1
    np.testing.assert_allclose(fast.object[0, :n], slow.object[:n], atol=1e-4)
    assert set(slow.contacts[1:]) == {"sticking"}
    shares = limits_used(slow, controller.limits)
    assert max(shares.values()) <= 1.000001
    assert min(shares["speed"], shares["acceleration"]) > 0.99
    tip = transform(fast.object[0], model.contact)
    speed = 60 * np.diff(tip, axis=0)
    assert np.max(np.hypot(*speed.T)) < 1.001 * controller.limits.speed
    assert np.max(np.hypot(*np.diff(speed, axis=0).T)) * 60 < 1.02 * controller.limits.acceleration
    assert np.max(np.abs(np.diff(fast.object[0, :, 2]))) * 60 < 1.001 * controller.limits.turn_rate


def test_a_contact_that_leaves_its_edge_and_bad_numbers():
    controller = laws()[0]
    starts = np.array([[0.0, 0.0, 0.6]])
    found = closed_loops(controller, [0, 1], starts, NOMINAL, 5.0, friction=0.02, edge=1e-3)
    assert OUTCOMES[found.outcome[0]] == "left the edge"
    for change in (
        {"duration": 0.0},
        {"normal": [0, 0]},
        {"surfaces": -NOMINAL},
        {"starts": [[np.nan, 0, 0]]},
    ):
        args = {"normal": [0, 1], "starts": starts, "surfaces": NOMINAL, "duration": 1.0, **change}
        with pytest.raises(fp.InputError):
            closed_loops(controller, **args)
    timed = replace(
        controller.reference,
        laws=(Trapezoid(0.04, 0.02, 0.1, slow=0.001), Trapezoid(0.1, 0.02, 0.1, slow=0.001)),
    )
    with pytest.raises(fp.InputError, match="has time laws"):
        closed_loops(replace(controller, reference=timed), [0, 1], starts, NOMINAL, 1.0)


def test_noise_is_that_of_its_seed():
    controller = laws()[0]
    runs = [
        closed_loops(controller, [0, 1], np.zeros((3, 3)), NOMINAL, 1.0, noise=(1e-4, 1e-3), seed=s)
        for s in (1, 1, 2)
    ]
    np.testing.assert_array_equal(runs[0].final, runs[1].final)
    assert not np.allclose(runs[0].final, runs[2].final)
