"""Two fingers that land again: tasks with and without things in the way, slips in the hand, what stops a push."""

from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.control import ARRIVED, Camera, SimulatedSensor
from flatpush.control.loop.closed_loop import drive
from flatpush.control.tracking.replanning_controller import ReplanningController
from flatpush.control.tracking.simulated_run import TrackedRun
from flatpush.experiments.feedback_among import attempt_among, carried_task, crowded_task, least_room
from flatpush.geometry import compose, transform
from flatpush.problem import Workspace
from flatpush.simulation.plant import Plant


@pytest.mark.slow
def test_a_task_with_two_fingers_ends_at_its_goal():
    ended, run = attempt_among(carried_task(2), ReplanningController)
    assert ended.outcome == ARRIVED
    assert ended.good
    assert ended.landings == 1
    off = np.abs(run.object[-1] - carried_task(2).scene.goal_pose)
    assert np.hypot(*off[:2]) < 0.001


@pytest.mark.slow
def test_two_fingers_among_things_end_at_their_goals_and_touch_nothing():
    """`python benchmarks/feedback_among.py 200 0 2` runs more."""
    asked = crowded_task(1, fingers=2)
    ended, run = attempt_among(asked, ReplanningController)
    assert ended.good
    assert least_room(asked.scene, run, np.array([[0.0, 0.0075], [0.0, -0.0075]])) > 0


class Slippery(Plant):
    """A plant in which the object jumps by 5 mm along the fingers once, after so many ticks of contact."""

    def __init__(self, *given, after):
        super().__init__(*given)
        self.left = after

    def step(self, state, velocity, dt):
        if state.modes[0] not in ("separation", "rest"):
            self.left -= 1
            if self.left == 0:
                aside = 0.005 * np.array([-np.sin(state.hand[2]), np.cos(state.hand[2]), 0.0])
                state = self.start(state.object + aside, state.hand)
        return super().step(state, velocity, dt)


def run_of(controller, scene, plant):
    place = controller.planner.usable[0].placement.pose
    hand = compose(scene.start_pose, compose(place, [-scene.pusher.approach, 0.0, 0.0]))
    sensor = SimulatedSensor(Camera(), np.random.default_rng(0))
    return drive(controller, plant, scene.start_pose, hand, sensor, 120.0)


def test_an_object_that_slips_in_the_hand_is_landed_at_again():
    scene = replace(carried_task(1).scene, start=(-0.07, 0.005, 0.1))
    controller = ReplanningController.of(scene)
    plant = Slippery(scene.object, controller.limits.tips, scene.pusher.tip_radius, after=60)
    run = run_of(controller, scene, plant)
    notes = [note for _, note in run.notes]
    assert "the object slipped in the hand" in notes
    assert any(note.startswith("landing 2") for note in notes)
    assert run.outcome == ARRIVED


@pytest.mark.slow
def test_what_comes_into_the_way_stops_the_push_before_it_is_touched():
    wall = [(-0.11, -0.05), (-0.095, -0.05), (-0.095, 0.05), (-0.11, 0.05)]
    empty = replace(
        carried_task(1).scene, start=(-0.2, 0.0, 0.1), workspace=Workspace((-0.3, -0.2, 0.15, 0.2), ())
    )
    scene = replace(empty, workspace=Workspace(empty.workspace.bounds, [wall]))
    blind = ReplanningController.of(empty)

    class Surprised(ReplanningController):
        """Sees the wall from when the object is on its way."""

        def _ways(self, pose, seed):
            return blind._ways(pose, seed) if seed == 0 else super()._ways(pose, seed)

    controller = Surprised.of(scene)
    run = run_of(controller, scene, Plant(scene.object, controller.limits.tips, scene.pusher.tip_radius))
    assert "the push would come too near to something" in [note for _, note in run.notes]
    assert run.outcome == ARRIVED
    assert least_room(scene, run, controller.limits.tips) > 0


def test_where_there_is_no_plan_it_looks_again_and_says_why():
    walls = [[(x - 0.06, y - 0.005), (x + 0.06, y - 0.005), (x + 0.06, y + 0.005), (x - 0.06, y + 0.005)]
             for x, y in ((0.0, 0.045), (0.0, -0.045))]  # fmt: skip
    ends = [
        [(x - 0.005, -0.05), (x + 0.005, -0.05), (x + 0.005, 0.05), (x - 0.005, 0.05)]
        for x in (-0.055, 0.055)
    ]
    scene = replace(carried_task(1).scene, start=(-0.2, 0.0, 0.1), workspace=Workspace(None, walls + ends))
    controller = ReplanningController.of(scene)
    run = run_of(controller, scene, Plant(scene.object, controller.limits.tips, scene.pusher.tip_radius))
    assert run.outcome.startswith("stopped, 199.9")
    assert "no path" in run.outcome or "no push can" in run.outcome
    assert np.ptp(run.object, axis=0).max() == 0
    assert run.times[-1] < 5


def test_track_lands_again_with_two_fingers():
    """A plan of two fingers is followed by its controller, and what makes no sense is refused."""
    plan = fp.plan(carried_task(1).scene)
    assert isinstance(TrackedRun("horizon").law(plan), ReplanningController)
    one = fp.load_scene("examples/triangle_one_finger.yaml")
    with pytest.raises(fp.InputError, match="two fingers"):
        ReplanningController.of(one)
    with pytest.raises(fp.InputError, match="both positive"):
        ReplanningController.of(plan, tolerance=(0.0, 1.0))
    planar = replace(
        plan.scene,
        pusher=replace(plan.scene.pusher, transit="planar"),
        workspace=Workspace((-1, -1, 1, 1), ()),
    )
    with pytest.raises(fp.InputError, match="lifts the fingers"):
        ReplanningController.of(planar)
    slippery = replace(plan.scene, object=fp.Object(plan.scene.object.outline, friction=0.0))
    with pytest.raises(fp.InputError, match="no push of this scene can be steered"):
        ReplanningController.of(slippery)
    with pytest.raises(fp.InputError, match="time is finite"):
        ReplanningController.of(plan).start(np.nan)
    # Its fingertips are those of the plan.
    tips = ReplanningController.of(plan).limits.tips
    np.testing.assert_allclose(tips, plan.pushes[0].fingers, atol=1e-12)
    assert transform([0, 0, 0], tips).shape == (2, 2)
