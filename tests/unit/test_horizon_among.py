"""The horizon controller among things: ways and their law, what is free, runs that touch nothing, what stops it."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

import flatpush as fp
from flatpush.control import ARRIVED, Camera, SimulatedSensor
from flatpush.control.horizon.controller import HorizonController
from flatpush.control.horizon.landings import fleet_of_contacts
from flatpush.control.horizon.push_path import PushPath
from flatpush.control.horizon.surroundings import MARGINS
from flatpush.control.loop.closed_loop import drive
from flatpush.experiments.feedback import task
from flatpush.experiments.feedback_among import attempt_among, crowded_task, least_room
from flatpush.geometry import compose, exp, transform
from flatpush.planning.path import Path
from flatpush.problem import Workspace
from flatpush.simulation.plant import Plant

TIPS = np.zeros((1, 2))


def box(x, y, half_x, half_y):
    return [
        (x - half_x, y - half_y),
        (x + half_x, y - half_y),
        (x + half_x, y + half_y),
        (x - half_x, y + half_y),
    ]


def among(obstacles, bounds=(-0.3, -0.2, 0.15, 0.2), start=(-0.2, 0.0, 0.3)):
    """The rectangle on its edge, from the left to the origin."""
    return replace(task(1).scene, start=start, workspace=Workspace(bounds, obstacles))


WALL = box(-0.1, -0.03, 0.008, 0.06)


# The way --------------------------------------------------------------------------------------------------------------


def way_of(controller, pieces, start=(0.0, 0.0, 0.4)):
    state = controller.start()
    cars = [
        controller.observer.car(state, k, o.placement.tips[0])
        for k, o in enumerate(controller.planner.usable)
    ]
    path = Path.of(fleet_of_contacts(cars, 0.03), np.array(start), pieces)
    return PushPath.of(path, 0.003), cars[pieces[0][0]], path


def test_a_way_is_the_path_of_the_first_push():
    controller = HorizonController.of(task(1).scene)
    way, car, path = way_of(controller, [(0, 0, 0.7), (0, 1, 0.03), (1, 2, 0.5)])
    np.testing.assert_allclose(way.poses[-1], path.poses[2], atol=1e-12)
    assert way.left[0] == pytest.approx(0.7 * car.radius + 0.03)
    assert way.left[-1] == 0.0
    assert not way.last
    steps = np.linalg.norm(np.diff(transform(way.poses, car.model.flat_point), axis=0), axis=1)
    np.testing.assert_allclose(-np.diff(way.left), steps, rtol=1e-3)
    assert way_of(controller, [(0, 0, 0.7)])[0].last


def test_a_place_on_a_way_and_beside_it():
    controller = HorizonController.of(task(1).scene)
    way, car, _ = way_of(controller, [(0, 0, 0.7), (0, 1, 0.03)])
    m, k = car.model, 7
    on = way.progress(m, way.poses[k], 0)
    assert on.passed in (k - 1, k)
    assert on.left == pytest.approx(way.left[k], abs=1e-6)
    assert (on.off, on.skew) == pytest.approx((0, 0), abs=1e-6)
    assert on.turn == pytest.approx(1 / car.radius, rel=1e-3)
    assert on.curvature(car.radius) == pytest.approx(1 / car.radius, rel=1e-2)
    # Two millimetres to the left, and turned by a tenth to the left: both call for a turn to the right.
    heading = m.flat_of(way.poses[-5])[2]
    aside = way.poses[-5] + [-0.002 * np.sin(heading), 0.002 * np.cos(heading), 0.0]
    there = way.progress(m, aside, 0)
    assert there.off == pytest.approx(0.002, rel=1e-6)
    assert there.turn == pytest.approx(0, abs=1e-9)
    assert there.curvature(0.03) == pytest.approx(-((2 / 0.03) ** 2) * 0.002)
    turned = compose(way.poses[-5], exp(0.1 * np.array([m.flat_point[1], -m.flat_point[0], 1.0])))
    assert way.progress(m, turned, 0).skew == pytest.approx(0.1)
    assert way.progress(m, turned, 0).curvature(0.03) == pytest.approx(-4 / 0.03 * np.sin(0.1))
    # Beyond its end nothing is left.
    assert way.progress(m, compose(way.poses[-1], [*(0.004 * m.direction), 0.0]), 0).left == pytest.approx(
        -0.004
    )


def test_the_law_comes_back_to_the_way():
    """A car that is 3 mm and 6° off drives the way by the law: in the end it is on it."""
    controller = HorizonController.of(task(1).scene)
    way, car, _ = way_of(controller, [(0, 0, 0.8), (0, 1, 0.5)])
    m, passed = car.model, 0
    car_, pose = replace(m, drift=None), way.poses[0] + [0.0, 0.003, 0.1]
    while True:
        place = way.progress(m, pose, passed)
        passed = place.passed
        if place.left <= 0:
            break
        kappa = min(max(place.curvature(car.radius), -m.right), m.left)
        pose = compose(pose, exp(0.001 * car_.twist(1.0, kappa)))
    assert abs(place.off) < 2e-5
    assert abs(place.skew) < 1e-3


# What is free ---------------------------------------------------------------------------------------------------------


def test_the_way_of_the_next_push_keeps_the_clearance_and_the_most_room():
    scene = among([WALL])
    controller = HorizonController.of(scene)
    state = controller.start()
    cars = [
        controller.observer.car(state, k, o.placement.tips[0])
        for k, o in enumerate(controller.planner.usable)
    ]
    *_, found = controller.surroundings.next_push(cars, np.array(scene.start), np.zeros(3), 0.03, 0)
    assert found.path.margin == MARGINS[0]
    place = controller.planner.usable[found.push].placement
    wall, corners = shapely.Polygon(WALL), scene.object.outline.vertices
    tip = transform(found.path.poses, place.tips[0])
    assert (
        shapely.distance(wall, shapely.polygons(transform(found.path.poses[:, None], corners))).min()
        > 0.00299
    )
    assert shapely.distance(wall, shapely.points(tip)).min() - scene.pusher.tip_radius > 0.00299
    # Without the wall the way is another one, straight through where the wall stood.
    *_, open_ = HorizonController.of(among([])).surroundings.next_push(
        cars, np.array(scene.start), np.zeros(3), 0.03, 0
    )
    assert shapely.distance(wall, shapely.polygons(transform(open_.path.poses[:, None], corners))).min() == 0


def test_less_room_is_kept_where_there_is_no_more():
    controller = HorizonController.of(among([box(-0.2, 0.0271 + 0.02, 0.05, 0.02)], start=(-0.2, 0.0, 0.0)))
    state = controller.start()
    cars = [
        controller.observer.car(state, k, o.placement.tips[0])
        for k, o in enumerate(controller.planner.usable)
    ]
    gap = 0.0271 - 0.0175
    for pose, margin in (((-0.2, gap - 0.0025, 0.0), 0.002), ((-0.2, gap - 0.0007, 0.0), 0.0005)):
        *_, found = controller.surroundings.next_push(cars, np.array(pose), np.zeros(3), 0.03, 0)
        assert found.path.margin == margin
    *_, why = controller.surroundings.next_push(
        cars, np.array((-0.2, gap - 0.0001, 0.0)), np.zeros(3), 0.03, 0
    )
    assert "at the start" in why


def test_a_motion_is_free_as_shapely_says():
    scene = among([WALL, box(0.05, 0.05, 0.02, 0.01)])
    around = HorizonController.of(scene).surroundings
    things = shapely.union_all([shapely.Polygon(o.vertices) for o in scene.workspace.obstacles])
    rng, answers = np.random.default_rng(3), []
    tip = np.array([-0.0275, 0.004])
    for _ in range(300):
        pose = rng.uniform([-0.2, -0.12, -3], [0.1, 0.12, 3])
        twist = rng.normal(size=3) * [0.004, 0.004, 0.1]
        way = compose(pose, exp(np.linspace(0, 1, 40)[:, None] * twist))
        objects = shapely.polygons(transform(way[:, None], scene.object.outline.vertices))
        room = min(
            shapely.distance(things, objects).min(),
            shapely.distance(things, shapely.points(transform(way, tip))).min() - scene.pusher.tip_radius,
        )
        if abs(room - 0.001) > 2e-4 and shapely.distance(things, objects[0]) > 0.0012:
            answers.append(around.free(tip[None], pose, twist, 0.001))
            assert answers[-1] == (room > 0.001)
    assert 0 < sum(answers) < len(answers)
    # Nearer than it should be already, it may go away but not nearer.
    near = np.array([-0.1 + 0.008 + 0.0175 + 0.0005, -0.03, np.pi / 2])
    tip = np.array([0.0, -0.02])
    assert around.free(tip[None], near, np.array([0.0, -0.002, 0.0]), 0.001)
    assert not around.free(tip[None], near, np.array([0.0, 0.0003, 0.0]), 0.001)


def test_a_finger_leaves_as_far_as_is_free():
    scene = among([box(0.0, 0.0, 0.01, 0.01)])
    around, r = HorizonController.of(scene).surroundings, scene.pusher.tip_radius
    approach = scene.pusher.approach
    for room, share in (
        (2 * approach, 1.0),
        (0.6 * approach, 0.5),
        (0.3 * approach, 0.25),
        (0.1 * approach, 0.0),
    ):
        hand = np.array([0.01 + r + room, 0.0, 0.7])
        np.testing.assert_allclose(around.back(hand, 0.0), hand - [share * approach, 0, 0], atol=1e-12)


# Whole runs -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [2])
def test_a_task_among_things_ends_at_its_goal_and_touches_nothing(number):
    asked = crowded_task(number)
    assert 5 <= len(asked.scene.workspace.obstacles) <= 12
    ended, run = attempt_among(asked)
    assert ended.good
    assert ended.outcome == ARRIVED
    assert least_room(asked.scene, run, TIPS) > 0


@pytest.mark.slow
def test_a_goal_of_any_angle_among_things_is_reached_with_one_that_fits():
    """The block fits into the slot at the goal only lengthwise; it was refused."""
    slot = [box(0.0, y, 0.03, 0.005) for y in (-0.031, 0.031)]
    scene = replace(among(slot), goal=(0.0, 0.0, np.nan))
    run = run_of(HorizonController.of(scene), scene, 120)
    assert run.outcome == ARRIVED
    x, y, turn = run.object[-1]
    assert np.hypot(x, y) < 0.002
    assert abs(np.sin(turn)) < np.sin(np.deg2rad(30))
    assert least_room(scene, run, TIPS) > -1e-4


@pytest.mark.slow
def test_tasks_among_things_end_at_their_goals_and_touch_nothing():
    """`python benchmarks/feedback_among.py` runs more."""
    numbers = [k for k in range(8, 11) if crowded_task(k).steerable]
    ends = []
    for number in numbers:
        ended, run = attempt_among(crowded_task(number))
        ends.append(ended)
        assert least_room(crowded_task(number).scene, run, TIPS) > -1e-4
        assert not ended.touched
    assert all(end.good for end in ends)


def run_of(controller, scene, seconds, told=None):
    plant = Plant(scene.object, [[0.0, 0.0]], scene.pusher.tip_radius)
    hand = compose(scene.start_pose, [-0.04, 0.0, 0.0])
    sensor = SimulatedSensor(Camera(), np.random.default_rng(0))
    return drive(controller, plant, scene.start_pose, hand, sensor, seconds, told=told)


@pytest.mark.slow
def test_what_comes_into_the_way_stops_the_push_before_it_is_touched():
    """The way is known without the wall; the wall appears in mid-push. The push ends with a word, and it goes round."""
    scene = among([WALL])
    controller, blind = HorizonController.of(scene), HorizonController.of(among([]))

    class Surprised:
        """Sees the wall from when the object is on its way."""

        world = controller.surroundings.world

        def __getattr__(self, name):
            return getattr(controller.surroundings, name)

        def next_push(self, cars, pose, goal, switching, seed):
            eyes = blind if seed == 0 else controller
            return eyes.surroundings.next_push(cars, pose, goal, switching, seed)

    run = run_of(replace(controller, surroundings=Surprised()), scene, 200.0)
    assert any("too near to something" in note for _, note in run.notes)
    assert run.outcome == ARRIVED
    assert least_room(scene, run, TIPS) > 0


def test_where_there_is_no_way_it_looks_again_and_says_why():
    walls = [
        box(0, 0.045, 0.06, 0.005),
        box(0, -0.045, 0.06, 0.005),
        box(0.055, 0, 0.005, 0.05),
        box(-0.055, 0, 0.005, 0.05),
    ]
    scene = among(walls)
    times = []
    run = run_of(
        HorizonController.of(scene), scene, 60.0, lambda time, state: times.append((time, state.stuck))
    )
    assert "stopped" in run.outcome
    assert "no path" in run.outcome or "no push can" in run.outcome
    assert max(stuck for _, stuck in times) == 2
    assert run.times[-1] < 5
    assert np.ptp(run.object, axis=0).max() == 0
    with pytest.raises(fp.InputError, match="no push"):
        HorizonController.of(replace(scene, object=fp.Object(scene.object.outline, friction=0.0)))
