"""Receding horizon: the car of the contact, the rest of the path, landings, slip and loss, learning, bad input."""

from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.control import ARRIVED, Camera, Measurement, SimulatedSensor
from flatpush.control.horizon.contact_car import contact_car
from flatpush.control.horizon.controller import HorizonController
from flatpush.control.horizon.landings import next_push
from flatpush.control.horizon.push_knowledge import shared, steering_of
from flatpush.control.laws.rest_of_path import biarc, rest_of_path
from flatpush.control.loop.closed_loop import drive
from flatpush.experiments.feedback import attempt, objects, perturbed, task
from flatpush.friction import Ellipsoid
from flatpush.geometry import compose, cross, exp, pose_error, shift_twist, velocity_at
from flatpush.planning.options import push_option
from flatpush.simulation.plant import Plant
from flatpush.steering.car import Car

PERFECT = Camera(rate=1e6, latency=0, position=0, angle=0)


# The car of the contact -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("along", [0.0, 0.003, -0.004])
@pytest.mark.parametrize("margin", [0.0, 0.4])
def test_on_an_ellipsoid_the_car_of_a_contact_is_the_exact_one(along, margin):
    rho, mu, cof = 2.5e-4, 0.5, np.array([0.002, -0.001])
    point, normal = np.array([along, -0.02]), np.array([0.1, 1.0]) / np.hypot(0.1, 1.0)
    exact = Car.of(
        fp.PointContact(point - cof, normal, mu, hook=True),
        Ellipsoid(np.diag([1.0, 1.0, 1 / rho])),
        cof=cof,
        margin=margin,
    )
    found = contact_car(point, normal, cof, rho, mu, 0.0025, reserve=margin, edge=margin)
    np.testing.assert_allclose(found.centres, [exact.left_centre, exact.right_centre], atol=1e-12)
    np.testing.assert_allclose(found.model.direction, exact.direction, atol=1e-12)
    assert found.radius == pytest.approx(exact.radius)
    # The ratio of the forces at the edge is that of the edge's force, and less within.
    edges = [abs(np.tan(a)) for a in exact.contact.force_angles(exact.forces)]
    assert found.ratio(-1 / exact.radius) == pytest.approx(edges[0])
    assert found.ratio(1 / exact.radius) == pytest.approx(edges[2])


def test_a_contact_that_cannot_turn_both_ways_has_no_car():
    assert contact_car([0.015, -0.02], [0, 1], [0, 0], 2e-4, 0.3, 0.0) is None
    assert contact_car([0.0, 0.0], [0, 1], [0, 0], 2e-4, 0.3, 0.0) is None
    assert contact_car([0.0, -0.02], [0, 1], [0, 0], 2e-4, 0.0, 0.0) is None


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_on_the_exact_surface_it_moves_as_the_exact_contact_does(number):
    """At forces all over the cone: the force that a motion asks for, and the motion of the flat point."""
    scene, compared = task(number).scene, 0
    for push in scene.pushes:
        option = push_option(scene, push)
        if option.car is None:
            continue
        known, mu = steering_of(scene, option), scene.object.friction
        point, normal = option.placement.points[0], option.placement.normals[0]
        found = contact_car(
            point, normal, known.cof, known.rho, mu, 0.0025, reserve=0.4, edge=0.2, turning=known.turning
        )
        exact, model = option.car.contact, found.model
        for share in np.linspace(-0.75, 0.75, 7):
            force = normal + share * mu * np.array([-normal[1], normal[0]])
            V = shift_twist(option.car.surface.twist(exact.wrench(force)), -known.cof)
            v = velocity_at(V, model.flat_point)
            ahead, across = v @ model.direction, cross(model.direction, v)
            asked = found.ratio(V[2] / ahead)
            assert asked <= (abs(share) + 0.02) * mu
            if (
                number == 0
            ):  # on three feet one of them stands still in many motions: which it is, turns do not tell
                continue
            assert asked == pytest.approx(abs(share) * mu, abs=0.02 * mu)
            assert model.across(ahead, V[2]) == pytest.approx(across, abs=0.02 * ahead)
            compared += 1
    assert compared >= 14 or number == 0


def test_what_is_learned_of_the_centre_does_not_tighten_the_turns_of_a_surface_that_is_no_ellipsoid():
    """A triangle on its face, pushed at its hypotenuse: 1.1 mm beside the centre of friction the object turns to the
    right about a point 37 mm away, and to the left hardly. With a fixed share of what the ellipsoid would do that
    point was taken to be 26 mm away: the finger slid wherever it turned so, and learned that it has no friction."""
    scene = task(3).scene
    (option,) = (push_option(scene, push) for push in scene.pushes if push.name == "hypotenuse")
    known, moved = steering_of(scene, option), np.array([-0.00114, -0.00017])
    moved_feet = scene.object.support.translated(moved)
    truth = replace(scene, object=fp.Object(scene.object.outline, moved_feet, scene.object.friction))
    exact = push_option(truth, option.push, margin=0.2).car
    place = option.placement
    found = contact_car(
        place.points[0], place.normals[0], moved, known.rho, scene.object.friction, 0.0025,
        reserve=0.2, edge=0.2, turning=known.turning,
    )  # fmt: skip
    right = np.hypot(*(exact.right_centre - moved))
    assert np.hypot(*(found.centres[1] - moved)) == pytest.approx(right, rel=0.12)


# The rest of the path -------------------------------------------------------------------------------------------------


def test_two_arcs_lead_from_pose_to_pose():
    rng = np.random.default_rng(3)
    for _ in range(200):
        start = (*rng.uniform(-1, 1, 2), rng.uniform(-np.pi, np.pi))
        goal = compose(start, [rng.uniform(0.5, 2), rng.uniform(-0.6, 0.6), rng.uniform(-1.2, 1.2)])
        first, second, length = biarc(start, tuple(goal))
        # Where the second arc begins is not told: it is where its end comes out right.
        turn = float(pose_error(goal, np.asarray(start))[2])
        share = length * 0.5 if abs(first - second) < 1e-9 else (turn - second * length) / (first - second)
        end = compose(
            compose(start, exp(np.array([1.0, 0.0, first]) * share)),
            exp(np.array([1.0, 0.0, second]) * (length - share)),
        )
        assert 0 < share < length
        np.testing.assert_allclose(pose_error(end, goal), 0, atol=1e-9)


def test_the_rest_of_a_path_is_what_is_left_of_it():
    """A flat point that follows what it is told tick by tick ends at the goal, from near and far."""
    radius, left, right = 0.04, 30.0, 30.0
    rng = np.random.default_rng(5)
    for _ in range(4):
        pose = np.array([rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-np.pi, np.pi)])
        before, how = np.inf, "planned"
        for _ in range(4000):
            rest = rest_of_path(tuple(pose), (0.0, 0.0, 0.0), radius, left, right, before, 0.0004)
            if rest.how == "past":
                break
            how = rest.how
            assert -right <= rest.curvature <= left
            step = min(0.0004, rest.length)
            pose = compose(pose, exp(step * np.array([1.0, 0.0, rest.curvature])))
            before = rest.due(before) - step
        assert how != "past"
        error = pose_error(pose, [0, 0, 0])
        assert np.hypot(*error[:2]) < 0.0005
        assert abs(np.rad2deg(error[2])) < 0.5


def test_a_loop_that_grows_with_the_radius_is_not_cut_short():
    """From beside the goal, where only a loop leads to it: a contact that is seen a little nearer to the centre makes
    the loop some millimetres longer, and what seemed to be left, closed at once, would be far from the heading."""
    pose, goal = (0.002, 0.004, 0.3), (0.0, 0.0, 0.0)
    for first, now in ((0.057, 0.058), (0.057, 0.065)):
        before = rest_of_path(pose, goal, first, 1 / first, 1 / first, np.inf).length
        rest = rest_of_path(pose, goal, now, 1 / now, 1 / now, before)
        assert (rest.how, rest.length > before > 6 * first) == ("planned", True)


def test_noise_does_not_use_up_the_reserve():
    """A disc of 80 mm to its goal: what a look made shorter counted as a promise, so that ever tighter turns were taken
    until none was left; the push ended 2 to 4° off its heading, and a loop led back, which ended no better."""
    radius, limit, rng = 0.0611, 1 / 0.0487, np.random.default_rng(0)
    ends = []
    for _ in range(8):
        pose, before = np.array([-0.1485, 0.0545, np.deg2rad(-30)]), np.inf
        for _ in range(1000):
            seen = pose + rng.normal(size=3) * (0.0003, 0.0003, 0.006)
            rest = rest_of_path(tuple(seen), (0, 0, 0), radius, limit, limit, before, 0.00033)
            if rest.how == "past":
                break
            step = min(0.00033, rest.length)
            pose = compose(pose, exp(step * np.array([1.0, 0.0, rest.curvature])))
            before = rest.due(before) - step
        ends.append(np.hypot(*pose[:2]))
    assert np.median(ends) < 0.0002


def test_near_the_end_the_tolerance_says_which_error_counts():
    """2 mm to the side and 10 mm to go cannot be met: the turn that is chosen is better than any other."""
    tolerance, lever, d = (0.002, np.deg2rad(2)), 0.01, 0.008
    rest = rest_of_path((-d, 0.002, 0.1), (0, 0, 0), 0.04, 30, 30, d, 0.0004, lever, tolerance)
    assert rest.how == "closing"

    def miss(kappa):
        skew = 0.1 + kappa * d
        off = 0.002 + 0.1 * d + kappa * d * d / 2 - lever * skew
        return (off / tolerance[0]) ** 2 + (skew / tolerance[1]) ** 2

    assert all(miss(rest.curvature) <= miss(kappa) + 1e-12 for kappa in np.linspace(-30, 30, 601))


def test_the_next_push_is_the_first_of_the_best_way():
    scene = task(1).scene
    cars = [
        contact_car(o.placement.points[0], o.placement.normals[0], [0, 0], 2.5e-4, 0.3, 0.0025)
        for o in (push_option(scene, push) for push in scene.pushes)
    ]
    names = [push.name for push in scene.pushes]
    k, target, length, _ = next_push(cars, np.array([-0.1, 0.0, 0.0]), np.zeros(3), 0.03)
    assert names[k] == "left"
    np.testing.assert_allclose(target, 0, atol=1e-9)
    assert length == pytest.approx(0.1)
    others = [car if name == "top" else None for car, name in zip(cars, names, strict=True)]
    assert names[next_push(others, np.array([-0.1, 0.0, 0.0]), np.zeros(3), 0.03)[0]] == "top"
    assert next_push([None, None], np.zeros(3), np.zeros(3), 0.03) is None


# The whole loop -------------------------------------------------------------------------------------------------------


def run(scene, truth=None, camera=None, duration=60.0, seed=0, **options):
    controller = HorizonController.of(scene, **options)
    plant = Plant(truth or scene.object, [[0.0, 0.0]], scene.pusher.tip_radius)
    sensor = SimulatedSensor(camera or Camera(), np.random.default_rng(seed))
    hand = compose(scene.start_pose, [-0.1, 0.0, 0.0])
    return drive(controller, plant, scene.start_pose, hand, sensor, duration)


def off_goal(result, scene):
    error = pose_error(result.object[-1], scene.goal)
    return 1000 * float(np.hypot(*error[:2])), abs(float(np.rad2deg(error[2])))


@pytest.mark.parametrize("rate", [20, 60])
def test_what_is_believed_and_seen_exactly_takes_one_landing(rate):
    scene = replace(task(1).scene, start=(-0.12, 0.01, 0.1))
    result = run(scene, camera=PERFECT, rate=rate)
    distance, angle = off_goal(result, scene)
    assert result.outcome == ARRIVED
    assert distance < 0.5
    assert angle < 0.5
    assert sum(note.startswith("landing") for _, note in result.notes) == 1
    assert list(dict.fromkeys(result.modes)) == ["look", "transit", "push", "retreat", "done"]


@pytest.mark.parametrize("number", [2, pytest.param(7, marks=pytest.mark.slow)])
def test_tasks_end_within_the_tolerance_whatever_the_table(number):
    ended, result = attempt(task(number))
    assert ended.outcome == ARRIVED
    assert ended.good
    assert result.outcome == ARRIVED


@pytest.mark.parametrize("kind", ["displaced", "lost"])
def test_a_displaced_finger_and_a_lost_contact_are_recovered_from(kind):
    asked = task(1, 1, near=0.1)
    ended, result = attempt(asked, "horizon", True, kind)
    assert ended.good
    if kind == "lost":
        assert "resume" in result.modes
        assert any("from the edge" in note for _, note in result.notes)


@pytest.mark.slow
@pytest.mark.parametrize("goal", [(0.0, 0.0, np.pi / 6), (0.0, 0.0, "free")])
def test_a_disc_ends_at_its_goal_with_and_without_an_angle(goal):
    """It looks the same from all sides, its turning centres differ by where it is touched, and what is left over is an
    angle that takes a loop; see also test_noise_does_not_use_up_the_reserve."""
    scene = replace(fp.load_scene("examples/disc.yaml"), goal=goal)
    result = run(scene, tolerance=(0.0005, np.deg2rad(0.5)), seed=3)
    error = scene.goal_error(result.object[-1])
    assert result.outcome == ARRIVED
    assert np.hypot(*error[:2]) <= 0.0005
    assert abs(error[2]) <= np.deg2rad(0.5)
    assert sum(note.startswith("landing") for _, note in result.notes) <= 2


def test_a_landing_costs_something_even_where_the_scene_says_that_it_costs_nothing():
    """Each landing begins with the errors of a look, so ways of many short pushes are not worth their shorter way."""
    scene = task(0).scene
    chosen = []
    for cost in (0.0, 0.03, 0.3):
        controller = HorizonController.of(replace(scene, planning=replace(scene.planning, switch_cost=cost)))
        state = controller.start()
        for k in range(12):
            frame = Measurement(k / 30, np.asarray(scene.start_pose), np.array([-0.2, 0.0, 0.0]))
            state, _ = controller.step(state, frame, k / 30)
        chosen.append((state.push, *state.target))
    np.testing.assert_allclose(chosen[0], chosen[1])
    assert not np.allclose(chosen[1], chosen[2])


def test_it_gives_up_after_its_landings_and_says_how_far_off_it_is():
    asked = task(1)
    result = run(asked.scene, asked.truth, landings=1, tolerance=(1e-5, 1e-4))
    assert result.outcome.startswith("still ")
    assert "after 1 landings" in result.outcome


def test_a_pusher_on_the_table_goes_around_the_object():
    scene = task(1).scene
    scene = replace(scene, start=(-0.05, 0.03, 0.4), pusher=replace(scene.pusher, transit="planar"))
    result = run(scene)
    assert result.outcome == ARRIVED
    assert set(result.contacts) >= {"separation", "sticking"}


# Learning -------------------------------------------------------------------------------------------------------------


def test_one_push_teaches_the_others_the_centre_of_friction():
    scene = task(1).scene
    options = [push_option(scene, push) for push in scene.pushes]
    known = [steering_of(scene, option) for option in options]
    true = np.array([0.0004, 0.001])
    for k in (0, 2):  # from the left and from below
        p, rho = known[k].point, known[k].rho
        b = np.array([p[1] - true[1], true[0] - p[0], rho + true @ true - p @ true])
        for turn in (0.2, -0.2):
            # A motion with b · V = 0 that turns by so much, 10 mm along.
            h = true - p
            h = h / np.hypot(*h)
            side = -(b[:2] @ h * 0.01 + b[2] * turn) / float(cross(h, b[:2]))
            Y = np.array([*(0.01 * h + side * np.array([-h[1], h[0]])), turn])
            assert abs(b @ Y) < 1e-12
            known[k] = known[k].observed(p, Y, np.diag([1e-10, 1e-10, 1e-6]))
    told = shared(known)
    for push in told:
        np.testing.assert_allclose(push.cof, true, atol=2e-4)
    # Nonsense is not believed.
    wild = [known[0].observed(known[0].point, [0.01, 0.02, 0.0], np.diag([1e-10] * 3)), *known[1:]]
    np.testing.assert_allclose(shared(wild)[0].cof, known[0].prior.cof)


def test_while_pushing_the_centre_of_friction_of_a_perturbed_support_is_found():
    """After the first long push the controller knows the axle better than the prior, and all its pushes use that."""
    thing, _ = objects()[1]
    asked = task(1)
    scene = replace(asked.scene, start=(-0.25, 0.02, 0.2))
    support = perturbed(thing, np.random.default_rng(4))
    support = support.translated([0.0, 0.0012] - support.centre)
    truth = fp.Object(thing.outline, support, 0.3)
    controller = HorizonController.of(scene)
    plant = Plant(truth, [[0.0, 0.0]], scene.pusher.tip_radius)
    states = []
    sensor = SimulatedSensor(Camera(), np.random.default_rng(1))
    hand = compose(scene.start_pose, [-0.1, 0.0, 0.0])
    drive(
        controller, plant, scene.start_pose, hand, sensor, 60.0, told=lambda time, state: states.append(state)
    )
    left = states[-1].steering[0]
    assert left.belief.count > 5
    assert abs(left.cof[1] - 0.0012) < 0.0004
    still = HorizonController.of(scene, learn=False)
    assert still.start().steering[0].cof[1] == pytest.approx(0.0, abs=1e-12)


def test_slip_bounds_the_friction_from_above_and_sticking_from_below():
    controller = HorizonController.of(task(1).scene)
    state = controller.start()
    from flatpush.control.horizon.state import LearningWindow

    state = replace(state, push=0)
    tip = controller.planner.usable[0].placement.tips[0]
    window = LearningWindow(0.0, 0.001, tip, np.array([0.02, 0.0]), (0.2, 0.22))
    pose = np.zeros(3)
    stuck = controller.observer.learned(state, window, pose, 0.001, tip).bounds
    assert stuck.low == pytest.approx(0.11)
    assert stuck.high == np.inf
    slid = controller.observer.learned(state, window, pose, 0.001, tip + np.array([0.0, 0.003])).bounds
    assert slid.low == 0
    assert slid.high == pytest.approx(0.32)
    # What is then believed narrows the cone of the cars.
    narrow = replace(state, bounds=replace(slid, high=0.25))
    assert controller.observer.car(narrow, 0, tip).radius > controller.observer.car(state, 0, tip).radius


# Bad input ------------------------------------------------------------------------------------------------------------


def pushing():
    """A controller in mid-push, its state, and the time."""
    scene = replace(task(1).scene, start=(-0.12, 0.0, 0.0))
    controller = HorizonController.of(scene, body="box")
    plant = Plant(scene.object, [[0.0, 0.0]], scene.pusher.tip_radius)
    kept = {}

    def told(time, state):
        if state.mode == "push" and time > 3 and not kept:
            kept.update(time=time, state=state)

    hand = compose(scene.start_pose, [-0.1, 0.0, 0.0])
    drive(
        controller, plant, scene.start_pose, hand, SimulatedSensor(Camera(), np.random.default_rng(0)), 5.0, told=told
    )  # fmt: skip
    return controller, kept["state"], kept["time"]


def slower(controller, before, command):
    """Whether a command brakes as hard as the pusher may, or stands."""
    speeds = [np.hypot(*u.velocity[:2]) for u in (before, command)]
    step = controller.scene.pusher.acceleration / controller.rate
    return speeds[1] == 0 or speeds[1] <= speeds[0] - 0.99 * step


def test_what_was_not_measured_well_stops_the_pusher():
    controller, state, now = pushing()
    good, dt = state.seen.frame, 1 / controller.rate
    bad = {
        "not finite": replace(good, time=now, object=np.array([0.0, np.nan, 0.0])),
        "another object": replace(good, time=now, body="cup"),
        "no newer": replace(good, time=good.time),
        "ahead of now": replace(good, time=now + 1.0),
        "an outlier: the object": replace(good, time=now, object=good.object + np.array([0.03, 0.0, 0.0])),
        "an outlier: the hand": replace(good, time=now, pusher=good.pusher + np.array([0.0, 0.03, 0.0])),
    }
    for why, frame in bad.items():
        held, command = controller.step(state, frame, now + dt)
        assert held.mode == "held"
        assert why in held.note
        assert slower(controller, state.seen.last, command)
        # The next good frame takes it on.
        on, command = controller.step(held, Measurement(now, good.object, good.pusher), now + 2 * dt)
        assert on.mode == "push"
        assert command.velocity.any()
    late, command = controller.step(state, None, now + 2.0)
    assert late.mode == "waiting"
    assert slower(controller, state.seen.last, command)
    old, command = controller.step(state, replace(good, time=now + 0.1), now + 2.0)
    assert old.mode == "held"
    assert slower(controller, state.seen.last, command)
    lost, command = controller.step(state, None, np.nan)
    assert lost.mode == "held"
    for _ in range(30):
        assert slower(controller, state.seen.last, command) or not command.velocity.any()
        lost, command = controller.step(lost, None, np.nan)
    assert not command.velocity.any()


def test_commands_are_finite_wherever_the_object_jumps_to():
    controller, state, now = pushing()
    rng = np.random.default_rng(0)
    for k in range(300):
        jump = Measurement(now + k / 60, rng.normal(size=3) * [0.2, 0.2, 2], rng.normal(size=3) * 0.2)
        state, command = controller.step(state, jump, now + k / 60)
        assert np.all(np.isfinite(command.velocity))
        assert np.hypot(*command.velocity[:2]) <= controller.scene.pusher.travel_speed * (1 + 1e-6)


def test_what_makes_no_sense_is_refused():
    scene = task(1).scene
    for options, rule in (
        ({"rate": 0.0}, "positive, finite"),
        ({"latency": -1.0}, "latency is 0 or more"),
        ({"landings": 0}, "at least one landing"),
        ({"tolerance": (0.0, 1.0)}, "both positive"),
        ({"stale": np.inf}, "positive, finite"),
    ):
        with pytest.raises(fp.InputError, match=rule):
            HorizonController.of(scene, **options)
    with pytest.raises(fp.InputError, match="one finger"):
        HorizonController.of(fp.load_scene("examples/rectangle_boundary.yaml"))
    walls = replace(scene, workspace=fp.Workspace((-1, -1, 1, 1), ()))
    around = replace(walls, pusher=replace(scene.pusher, transit="planar"))
    with pytest.raises(fp.InputError, match="lifts the finger"):
        HorizonController.of(around)
    slippery = replace(scene, object=fp.Object(scene.object.outline, friction=0.0))
    with pytest.raises(fp.InputError, match="no push of this scene can be steered"):
        HorizonController.of(slippery)
    with pytest.raises(fp.InputError, match="time is finite"):
        HorizonController.of(scene).start(np.nan)
