"""Feedback on a sticking push: references, linearisation, path law, and what they do with bad input."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.control import Camera, Measurement, SimulatedSensor
from flatpush.control.laws.gains import HOLDS, Gains, limits
from flatpush.control.laws.linearisation import PostureController, TrackingController
from flatpush.control.laws.path_following import PathController
from flatpush.control.laws.reference import AbstractReference, FlatState, PathReference, check_reference
from flatpush.control.laws.steering_model import SteeringModel
from flatpush.control.learning.belief import SteeringBelief
from flatpush.control.loop.closed_loop import ClosedLoopRun, drive, limits_used
from flatpush.control.loop.limits import Limits
from flatpush.control.tracking.carried import CarriedController, KnownPose, turned
from flatpush.control.tracking.learning_controller import LearningController
from flatpush.control.tracking.touched import touched
from flatpush.control.tracking.touching import TouchingController
from flatpush.friction import Ellipsoid
from flatpush.geometry import compose, exp, pose_error, relative, transform
from flatpush.simulation.plant import Plant

UNIT = 0.02  # the paper's normalising length [m]
NOMINAL = np.diag([1.0537, 1.0537, 1.5087 / UNIT**2])
SQUARE = [(-UNIT, -UNIT), (UNIT, -UNIT), (UNIT, UNIT), (-UNIT, UNIT)]
PERFECT = Camera(rate=1e6, latency=0, position=0, angle=0)


def square_push(surface=NOMINAL, friction=1.0):
    """The paper's square pushed upwards in the middle of its lower side: the model of NOMINAL, the plant of surface."""
    thing = fp.Object(SQUARE, friction=friction, surface=Ellipsoid(surface))
    plant = Plant(thing, [[0.0, 0.0]], 0.0, surface=Ellipsoid(surface), cof=[0.0, 0.0])
    flat = fp.flat_output(fp.PointContact([0, -UNIT], [0, 1], 0.7), Ellipsoid(NOMINAL))
    return plant, SteeringModel.of_flat(flat)


def run(controller, plant, start, duration, camera=PERFECT, seed=0):
    model = controller.model
    sensor = SimulatedSensor(camera, np.random.default_rng(seed))
    return drive(controller, plant, start, compose(start, model.pusher), sensor, duration)


@pytest.mark.parametrize("timed", [False, True])
def test_references_of_a_plan_are_exact(one_finger_plan, timed):
    """z_d agrees with the plan's poses (with its time law also at their times), its derivatives with differences."""
    (segment, *_) = one_finger_plan.pushes
    from flatpush.planning.options import push_option
    from flatpush.problem.mechanics import named

    car = push_option(one_finger_plan.scene, named(one_finger_plan.scene, segment.push)).car
    model = SteeringModel.of_car(car)
    path = PathReference.of_push(segment, model, pusher=one_finger_plan.scene.pusher if timed else None)
    z = transform(segment.object, model.flat_point)
    if timed:
        assert path.duration == pytest.approx(segment.times[-1])
        np.testing.assert_allclose([path.at(t).position for t in segment.times], z, atol=1e-8)
        dt = 1 / 60
        for t in np.linspace(0, 1, 57)[:-1] * path.duration:  # the law by arc length, tick by tick
            (s, _, before), (wanted, _, after) = path.run(t), path.run(t + dt)
            if before == after:
                assert path.speed_from(s, dt) * dt == pytest.approx(wanted - s, rel=1e-6)
    # Every sample lies on the path, and the last at its end.
    ends = [path.at(0).position, path.at(path.duration).position]
    np.testing.assert_allclose(ends, z[[0, -1]], atol=1e-9)
    if timed:  # and it stays there
        np.testing.assert_allclose(path.at(path.duration + 0.1).position, z[-1], atol=1e-9)
    for t in np.linspace(0.01, 0.99, 23) * path.duration:
        h = 1e-5
        before, now, after = path.at(t - h), path.at(t), path.at(t + h)
        if np.allclose(before.acceleration, after.acceleration, atol=1e-3 * path.speed):
            np.testing.assert_allclose((after.position - before.position) / (2 * h), now.velocity, atol=1e-8)
            np.testing.assert_allclose(
                (after.velocity - before.velocity) / (2 * h), now.acceleration, atol=1e-7
            )
    if timed:
        with pytest.raises(fp.InputError, match="vanishes on the way"):
            check_reference(path)
    else:
        check_reference(path)


def test_the_law_makes_the_flat_point_accelerate_as_asked_for_any_contact():
    """z̈ = w for an asymmetric contact (c ≠ 0): the mean over a small tick of what the flat point does is w."""
    from flatpush.control.laws.formulas import (
        AFTER,
        AxisGains,
        Bounds,
        FlatPose,
        FlatTarget,
        linearised,
        point_velocity,
    )  # fmt: skip

    flat = fp.flat_output(fp.PointContact([0.006, -0.02], [0.1, 0.995], 0.6), Ellipsoid(NOMINAL))
    assert abs(flat.along) > 1e-3
    model = SteeringModel.of_flat(flat)
    theta, s, dt = 0.4, 0.02, 1e-5
    x, y, heading = model.flat_of([0.1, 0.2, theta])
    w = np.array([0.003, -0.002])
    after, out, omega, scale, bounded = linearised(
        FlatPose(x, y, heading), s, FlatTarget(x, y, s * np.cos(heading), s * np.sin(heading), *w),
        AxisGains(4, 4, 4, 4), Bounds(model.left, model.right, 1e-3, 1), dt, AFTER,
    )  # fmt: skip
    assert scale == 1
    assert not bounded
    h = np.array([np.cos(heading), np.sin(heading)])
    turned = np.array([np.cos(heading + omega * dt), np.sin(heading + omega * dt)])
    np.testing.assert_allclose((after * turned - s * h) / dt, w, rtol=1e-3, atol=1e-7)
    # And the pusher's velocity is that of the contact: the force that it needs lies in V = A Jᵀ f.
    u = point_velocity(heading, out, omega, *model.arm, theta, dt, AFTER)
    c, d = np.cos(theta), np.sin(theta)
    u_O = np.array([c * u[0] + d * u[1], c * u[1] - d * u[0]])
    motion = flat.contact.motion(Ellipsoid(NOMINAL), u_O)
    assert motion.mode == fp.ContactMode.STICKING
    np.testing.assert_allclose(motion.twist, model.twist(out, omega), atol=1e-9)


@pytest.mark.parametrize("rate", [10, 60, pytest.param(1000, marks=pytest.mark.slow)])
def test_the_nominal_push_ends_on_the_reference(rate):
    """The paper's start error, kp = kd = 4: within 0.01 mm and 0.01° after 30 s (6 s at 1 kHz), at any rate."""
    plant, model = square_push()
    bend = 10.0
    x, y, heading = model.flat_of([0, 0, 0])
    speed, T = 0.0077, 30.0 if rate < 1000 else 6.0
    path = PathReference(np.array([[0.0, speed * 31, x, y, heading, bend]]), speed)
    controller = TrackingController(model, Gains(4.0, 4.0), rate, reference=path)
    found = run(controller, plant, np.array([-0.001, -0.0025, np.deg2rad(3.6)]), T)
    assert found.outcome.startswith("out of time")
    assert set(found.contacts[1:]) == {"sticking"}
    state = path.at(float(found.times[-1]))
    off = np.hypot(*(transform(found.object[-1], model.flat_point) - state.position))
    turn = model.flat_of(found.object[-1])[2] - np.arctan2(state.velocity[1], state.velocity[0])
    assert off < 1e-5
    assert abs(np.rad2deg(np.remainder(turn + np.pi, 2 * np.pi) - np.pi)) < 0.01


@pytest.mark.parametrize("hold", HOLDS)
def test_gains_beyond_the_limit_of_a_rate_are_refused_and_would_diverge(hold):
    for kp in (0.5, 4.0, 100.0):
        low, high = limits(kp, 60.0, hold)
        Gains(kp, 0.5 * (low + high)).check(60.0, hold)
        for kd in (high * 1.001, low * 0.999):
            if kd > 0:
                with pytest.raises(fp.InputError, match="stable with a k_d between"):
                    Gains(kp, kd).check(60.0, hold)
        dt = 1 / 60
        for kd, stable in ((high * 0.99, True), (high * 1.01, False), (max(low * 1.01, 0.01), True)):
            A = {
                "ramp": [[1 - kp * dt**2 / 2, dt - kd * dt**2 / 2], [-kp * dt, 1 - kd * dt]],
                "after": [[1, dt], [-kp * dt, 1 - kd * dt]],
                "before": [[1 - kp * dt**2, dt - kd * dt**2], [-kp * dt, 1 - kd * dt]],
            }[hold]
            assert (np.abs(np.linalg.eigvals(np.array(A))).max() < 1) == stable


@dataclass(frozen=True)
class Swing(AbstractReference):
    """Along y, there and back (or to a rest on the way and on)."""

    back: bool
    duration: float = 10.0

    def at(self, time):
        w = 2 * np.pi / self.duration
        v = np.cos(w * time) if self.back else 1 + np.cos(w * time)
        a = -w * np.sin(w * time)
        z = np.sin(w * time) / w + (0 if self.back else time)
        return FlatState(np.array([0, 0.01 * z]), np.array([0, 0.01 * v]), np.array([0, 0.01 * a]))


def test_references_that_rest_or_reverse_are_refused():
    _, model = square_push()
    for back in (True, False):
        with pytest.raises(fp.InputError, match=r"reverses|vanishes"):
            TrackingController(model, Gains(4, 4), reference=Swing(back))
    tight = PathReference(np.array([[0, 0.1, 0, 0, 0, 2 * model.left]]), 0.02)
    with pytest.raises(fp.InputError, match="friction cone"):
        TrackingController(model, Gains(4, 4), reference=tight)
    for rate in (0.0, -5.0, np.nan):
        with pytest.raises(fp.InputError, match="rate is positive"):
            TrackingController(model, Gains(4, 4), rate, reference=Swing(True))
        with pytest.raises(fp.InputError, match="rate is positive"):
            PathController(model, tight, rate)
    with pytest.raises(fp.InputError, match="positive"):
        PathReference(tight.table, 0.0)
    with pytest.raises(fp.InputError, match="stable with a damping"):
        PathController(model, PathReference(tight.table, 0.5), 5.0)


def controllers():
    _, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    path = PathReference.straight([x, y], heading, 0.1, 0.02)
    return {
        "dfl": TrackingController(model, Gains(4, 4), reference=path, body="square"),
        "path": PathController(model, path, body="square"),
        "posture": PostureController(model, Gains([1, 4], [2, 4]), goal=[0, 0.1, 0], body="square"),
    }


@pytest.mark.parametrize("name", ["dfl", "path", "posture"])
def test_bad_measurements_stop_the_pusher_and_good_ones_start_it_again(name):
    controller = controllers()[name]
    good = [0.0, 0.0, 0.0], [0.0, -0.02, np.pi / 2]
    state, command = controller.step(controller.start(), None, 0.0)
    assert state.mode == "waiting"
    assert not command.velocity.any()
    state, command = controller.step(state, Measurement(0.01, *map(np.array, good)), 0.02)
    assert command.velocity[1] > 0
    bad = {
        "finite": Measurement(0.02, np.array([np.nan, 0, 0]), np.array(good[1])),
        "not finite": Measurement(0.02, np.array(good[0]), np.array([0, np.inf, 0])),
        "no newer": Measurement(0.01, *map(np.array, good)),
        "another object": Measurement(0.02, *map(np.array, good), body="disc"),
        "ahead of now": Measurement(7.0, *map(np.array, good)),
    }
    for reason, frame in bad.items():
        held, command = controller.step(state, frame, 0.03)
        assert held.mode == "held"
        assert reason in held.note
        assert not command.velocity.any()
        again, command = controller.step(held, Measurement(0.04, *map(np.array, good)), 0.04)
        assert again.outcome == ""
        assert command.velocity[1] > 0
    old, command = controller.step(state, None, 5.0)
    assert old.mode == "waiting"
    assert not command.velocity.any()
    odd, command = controller.step(state, None, float("nan"))
    assert odd.mode == "held"
    assert not command.velocity.any()


@pytest.mark.parametrize("name", ["dfl", "path", "posture"])
def test_commands_are_finite_wherever_the_object_is(name):
    controller = controllers()[name]
    rng = np.random.default_rng(3)
    for _ in range(200):
        pose = rng.normal(size=3) * [1e3, 1e3, 10] * 10 ** rng.uniform(-6, 0)
        frame = Measurement(0.0, pose, compose(pose, controller.model.pusher))
        _, command = controller.step(controller.start(), frame, 0.0)
        assert np.all(np.isfinite(command.velocity))


@pytest.mark.parametrize("law", ["dfl", "path"])
def test_a_late_camera_is_made_up_for_by_prediction(law):
    """100 ms of latency, no noise, exact model: as good as without latency, within a part of the start error."""
    plant, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    path = PathReference.straight([x, y], heading, 0.15, 0.02)
    for latency in (0.0, 0.1):
        controller = (
            TrackingController(model, Gains(4, 4), reference=path)
            if law == "dfl"
            else PathController(model, path)
        )
        camera = Camera(rate=30, latency=latency, position=0, angle=0)
        found = run(controller, plant, np.array([-0.001, 0.0, 0.02]), 20, camera)
        assert found.outcome == "arrived"
        error = pose_error(found.object[-1], [0, 0.15, 0])
        assert np.hypot(error[0], error[1]) < 2e-4
        assert abs(error[2]) < 0.02


def test_the_clock_of_a_reference_waits_for_a_hand_that_its_limits_hold_back():
    """Half as fast the object goes the same way in twice the time, and is on its reference all the while."""
    plant, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    path = PathReference(np.array([[0.0, 0.1, x, y, heading, 8.0]]), 0.02)
    ways, clocks = {}, {}
    for share in (1.0, 0.5):
        limits = Limits(np.zeros((1, 2)), share * 0.9 * path.speed, 1.0, np.pi, 1.0, 1.0)
        controller = TrackingController(model, Gains(4, 4), reference=path, limits=limits)
        states = []
        start = np.array([-0.001, 0.0, 0.02])
        sensor = SimulatedSensor(PERFECT, np.random.default_rng(0))
        hand = compose(start, model.pusher)
        found = drive(
            controller,
            plant,
            start,
            hand,
            sensor,
            4 / share,
            told=lambda _, state: states.append(state),  # noqa: B023
        )
        z = transform(found.object, model.flat_point)
        ways[share], clocks[share] = z, states[-1].clock
    # Where the slow one was at twice the times.
    np.testing.assert_allclose(ways[0.5][::2], ways[1.0], atol=5e-5)
    assert clocks[0.5] == pytest.approx(clocks[1.0], rel=2e-3)
    assert clocks[1.0] < 0.95 * 4


def test_nonsense_that_was_learned_is_not_believed():
    """Centres of rotation on the wrong side of the centre of friction: no table does that, a finger that slips may."""
    _, model = square_push()
    contact = model.contact
    prior = SteeringBelief.prior([0.0, 0.0], 4e-4, 0.002, 1e-4)
    wild = prior
    for y in (-0.03, 0.03):
        turn = 0.2 * np.sign(y)
        q = 0.5 * contact + [y * contact[1], -y * contact[0]] / np.hypot(*contact)
        wild = wild.observed(contact, [turn * q[1], -turn * q[0], turn], np.diag([1e-14] * 3))
    assert not wild.estimate().believable(prior.estimate())
    assert wild.better_than_prior(contact)
    path = PathReference.straight(
        model.flat_of([0.0, 0.0, 0.0])[:2], model.flat_of([0.0, 0.0, 0.0])[2], 0.1, 0.01
    )
    controller = LearningController(PathController(model, path), prior)
    state = replace(controller.start(), belief=wild)
    for k, way in enumerate((0.0, 0.005)):
        pose = np.array([*(way * model.direction), 0.0])
        frame = Measurement(0.1 * k, pose, compose(pose, model.pusher))
        state, command = controller.step(state, frame, 0.1 * k)
    assert state.belief.count > wild.count
    assert state.controller.model is model
    assert np.all(np.isfinite(command.velocity))


def test_the_posture_law_arrives_along_the_goal():
    plant, model = square_push()
    controller = PostureController(
        model, Gains([0.5, 2.0], [1.6, 3.0]), goal=[0.0, 0.1, 0.0], tolerance=(0.002, np.deg2rad(3))
    )
    found = run(controller, plant, np.array([-0.002, 0.0, 0.05]), 60)
    assert found.outcome == "arrived"


def test_a_loop_of_one_s_own_runs_with_a_plant_and_a_sensor_of_one_s_own(capsys, monkeypatch):
    monkeypatch.syspath_prepend("examples")
    import own_plant

    run, off = own_plant.main()
    assert run.outcome == "arrived"
    assert np.hypot(*off[:2]) < 0.0002
    assert abs(np.rad2deg(off[2])) < 0.2
    assert set(run.contacts) <= {"rest", "sticking"}
    limits = Limits(np.zeros((1, 2)), 0.03, 0.2, np.pi / 2, 0.1, 0.5)
    assert max(limits_used(run, limits).values()) <= 1.000001
    assert "0.04 mm" in capsys.readouterr().out


def carried(friction=0.3):
    """Two fingers that hold the paper's square at its lower side."""
    _, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    law = PathController(model, PathReference.straight([x, y], heading, 0.1, 0.02))
    tips = np.array([[0.0, 0.005], [0.0, -0.005]])
    return CarriedController(law, fp.Object(SQUARE).outline, tips, 0.0, friction)


NOISE = np.array([3e-4, 3e-4, np.deg2rad(0.3)])


def test_noise_is_not_steered_by():
    """What two fingers hold where it was planned is steered with a part of what the mean of frames wanders by; a place
    that is 0.3 mm off along the edge is taken up, less one standard deviation of the mean at most."""
    controller = carried()
    planned, hand = relative(controller.model.pusher, np.zeros(3)), np.array([0.0, -0.02, np.pi / 2])
    rng, ways = np.random.default_rng(1), []
    for off in (*8 * [0.0], 0.0003):
        state = controller.landed(0.0, np.diag(NOISE**2) / 10)
        place, way = compose(hand, planned + np.array([0.0, off, 0.0])), []
        for k in range(50):
            frame = Measurement((k + 1) / 30, place + rng.standard_normal(3) * NOISE, hand)
            state = controller.noticed(state, frame)
            way.append((state.touching[1], state.held[1]))
        # Both fingers touch: the camera has no say in what they leave no freedom to.
        np.testing.assert_allclose(state.held[[0, 2]], planned[[0, 2]], atol=1e-7)
        sd = NOISE[0] / np.sqrt(state.count)
        assert abs(state.touching[1] - state.held[1]) <= sd * (1 + 1e-6)
        ways.append(np.abs(np.diff(way, axis=0)).sum(axis=0))
    assert abs(state.held[1] - planned[1] - 0.0003) < 3 * sd
    seen, steered = np.sum(ways[:-1], axis=0)
    assert steered < 0.2 * seen


def test_what_is_known_at_a_landing_weighs_as_many_frames_as_would_know_it():
    """Fingers at a flat side leave the place along it to the camera. Ten frames of a look are ten frames of that, less
    what it may slip while the gap is closed; known to a tenth of a frame's noise it counts as a hundred."""
    controller = carried(friction=0.0)
    assert controller.landed(0.0, np.diag(NOISE**2) / 10).count == pytest.approx(10)
    along = np.diag([0.0, (0.1 * NOISE[0]) ** 2, 0.0])
    assert controller.landed(0.0, along).count == pytest.approx(100)
    gap = np.diag([NOISE[0] ** 2 / 10, NOISE[0] ** 2 / 10, 0.0])
    assert carried(0.5).landed(0.0, gap).count == pytest.approx(10 / 1.25)
    # After 30 frames it is known to 1/√40 of a frame's along the side, which runs along x of W, and exactly else.
    state = replace(controller.landed(0.0, np.diag(NOISE**2) / 10), count=40.0)
    known = controller.known(state, np.array([0.0, -0.02, np.pi / 2]))
    np.testing.assert_allclose(known.covariance, np.diag([NOISE[0] ** 2 / 40, 0.0, 0.0]), atol=1e-18)
    np.testing.assert_allclose(known.pose, np.zeros(3), atol=1e-12)
    np.testing.assert_allclose(turned(along, np.pi / 2), np.diag([along[1, 1], 0.0, 0.0]), atol=1e-20)


def test_a_look_corrects_only_what_is_not_known_and_is_all_where_the_object_was_moved():
    """By draws: the mean by both covariances is as uncertain as it says."""
    rng, look = np.random.default_rng(0), np.diag(NOISE**2) / 10
    before = np.array([[4e-9, 1e-9, 0.0], [1e-9, 2e-9, 0.0], [0.0, 0.0, 0.0]])
    root, errors = np.array([[2.0, 0.0, 0.0], [0.5, np.sqrt(1.75), 0.0], [0.0, 0.0, 0.0]]) * 10**-4.5, []
    np.testing.assert_allclose(root @ root.T, before)
    for draw in rng.standard_normal((3000, 6)):
        found = KnownPose(root @ draw[:3], before).seen(KnownPose(np.sqrt(look) @ draw[3:], look))
        errors.append(found.pose)
    np.testing.assert_allclose(np.cov(np.array(errors).T), found.covariance, atol=2e-10)
    assert np.all(np.array(errors)[:, 2] == 0)
    moved = KnownPose(np.zeros(3), before).seen(KnownPose(np.array([0.002, 0.0, 0.0]), look))
    np.testing.assert_array_equal(moved.pose, [0.002, 0.0, 0.0])
    np.testing.assert_array_equal(moved.covariance, look)
    frames = [np.array([0.0, 0.0, a]) for a in (0.1, 0.3)]
    seen = KnownPose.of_look(frames, (3e-4, 0.01))
    np.testing.assert_allclose(seen.pose, [0.0, 0.0, 0.2])
    np.testing.assert_allclose(np.diag(seen.covariance), [4.5e-8, 4.5e-8, 5e-5])


def test_an_object_that_slips_in_the_hand_is_found_again_and_noise_is_averaged():
    """The place in the hand is the mean of all frames; after a slip of 2 mm it is that of the frames since."""
    controller = carried()
    planned = relative(controller.model.pusher, np.zeros(3))
    rng, state = np.random.default_rng(2), controller.start()
    hand = np.array([0.0, -0.02, np.pi / 2])
    for k in range(600):
        slipped = np.array([0.0, 0.002 if k >= 450 else 0.0, 0.0])
        noise = rng.standard_normal(3) * [0.0003, 0.0003, np.deg2rad(0.3)]
        frame = Measurement(k / 30, compose(hand, planned + slipped) + noise, hand)
        state = controller.noticed(replace(state, seen=replace(state.seen, frame=frame)), frame)
        if k == 449:
            # 450 frames, four standard deviations of their mean.
            assert np.all(np.abs(pose_error(state.grasp, planned)) < 4 / np.sqrt(450) * NOISE)
        if k == 479:  # a second later it is known, more or less
            assert abs(pose_error(state.grasp, planned + slipped)[1]) < 0.0013
    assert np.all(np.abs(pose_error(state.grasp, planned + slipped)) < [3e-4, 3e-4, 0.003])


def test_a_law_that_closes_leaves_nothing_of_a_landing_on_a_short_push():
    """Off by 0.5 mm and 1.7° at the start of 8 mm: a law that only comes nearer to the path is still off at its end."""
    plant, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    law = PathController(model, PathReference.straight([x, y], heading, 0.008, 0.02))
    goal, start = np.array([0.0, 0.008, 0.0]), np.array([0.0005, 0.0, 0.03])
    off = []
    for one in (law, replace(law, closing=(0.0005, np.deg2rad(0.5)))):
        error = np.abs(pose_error(run(one, plant, start, 10).object[-1], goal))
        off.append(max(np.hypot(*error[:2]) / 0.0005, error[2] / np.deg2rad(0.5)))
    assert off[1] < 0.1
    assert off[0] > 0.4


@pytest.mark.parametrize("rate", [15, 120])
def test_of_an_object_that_one_finger_touches_only_the_angle_has_to_be_seen(rate):
    """The place is known to a third of a frame's noise and the angle to a half of it; a slip of 2 mm is known after two
    seconds."""
    _, model = square_push()
    x, y, heading = model.flat_of([0, 0, 0])
    law = PathController(model, PathReference.straight([x, y], heading, 0.1, 0.02))
    controller = TouchingController(law, fp.Object(SQUARE).outline, 0.0)
    rng, state, off = np.random.default_rng(2), controller.start(), []
    twist, slip = model.twist(0.02, 0.2), np.zeros(3)
    for k in range(8 * rate + 1):
        pose = exp(k / rate * twist)
        if k == 6 * rate:
            slip = np.array([0.0, 0.002, 0.0])
        hand = compose(pose, model.pusher + slip[[1, 0, 2]])
        seen = pose + rng.standard_normal(3) * [0.0003, 0.0003, np.deg2rad(0.3)]
        frame = Measurement(k / rate, seen, hand)
        state = replace(state, seen=replace(state.seen, frame=frame))
        state = controller.noticed(state, frame) if k else controller.act(state, 0.0)[0]
        if rate < k < 6 * rate:
            off.append(pose_error(state.believed.object, pose))
    spread = np.sqrt(np.mean(np.square(off), axis=0))
    assert np.all(spread[:2] < 0.0001)
    assert spread[2] < np.deg2rad(0.15)
    np.testing.assert_allclose(state.place, [0.002, -UNIT], atol=0.0003)


def test_the_time_law_of_a_path_keeps_the_turn_rate(one_finger_plan):
    from flatpush.planning.options import push_option
    from flatpush.problem.mechanics import named

    scene, segment = one_finger_plan.scene, one_finger_plan.pushes[0]
    model = SteeringModel.of_car(push_option(scene, named(scene, segment.push)).car)
    for most in (0.05, 0.02):
        path = PathReference.of_push(segment, model, pusher=replace(scene.pusher, turn_rate=most))
        rates = []
        for k, arc in enumerate(segment.arcs):
            length, top = path.table[k, 1], path.laws[k].top
            rates.append(abs(arc.twist[2]) * arc.duration / length * top)
        assert max(rates) == pytest.approx(most)


def test_a_run_that_touches_what_is_in_the_way_says_so(one_finger_plan):
    """The plant knows no obstacles: what counts is when object or fingertip on the table are 0.1 mm deep in one."""
    scene, n = one_finger_plan.scene, 300
    corners, radius = scene.object.outline.vertices, scene.pusher.tip_radius
    times = np.arange(n) / 60
    x = 0.02 * times
    still = np.zeros((n, 2))
    object_, hand = np.column_stack([x, still]), np.column_stack([x - 0.1, still])
    done = ClosedLoopRun(times, object_, hand, np.zeros(n), ("path",) * n, ("sticking",) * n, "arrived")
    ahead, behind = corners[:, 0].max() + 0.05, -0.05
    assert corners[:, 0].min() > behind + 0.001
    wall = [(ahead, -1.0), (ahead + 0.01, -1.0), (ahead + 0.01, 1.0), (ahead, 1.0)]
    peg = [(behind, -0.001), (behind + 0.001, -0.001), (behind + 0.001, 0.001), (behind, 0.001)]
    for obstacles, bounds, what, reached in (
        ([peg, wall], None, "a fingertip touched obstacle 0", 0.05 - radius),
        ([wall], None, "the object touched obstacle 0", 0.05),
        ([], (-1, -1, ahead, 1), "the object went over the bounds", 0.05),
        ([], (behind - 0.06, -1, 1, 1), "", np.inf),
    ):
        plan = replace(one_finger_plan, scene=replace(scene, workspace=fp.Workspace(bounds, obstacles)))
        first = times[np.argmax(x > reached + 1e-4)]
        tips = plan.on_table[0].fingers
        assert touched(plan.scene, tips, done) == (f"{what} after {first:.2f} s" if what else "")
        # Lifted, and with the object at rest, nothing is touched.
        assert touched(plan.scene, tips, replace(done, object=0 * object_, heights=np.ones(n))) == ""
