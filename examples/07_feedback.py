"""Feedback with a plant of my own: a plan, its controller, a camera, and a table that is not as believed."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import flatpush as fp
from flatpush.control import Camera, PlanController, SimulatedSensor, drive
from flatpush.geometry import compose, exp, rotate


@dataclass(frozen=True)
class State:  # what a plant tells the loop; a robot fills it from its joints and its camera
    object: np.ndarray  # X_WO
    hand: np.ndarray  # X_WE, the fingertip
    modes: tuple = ("rest",)
    outcome: str = ""


class MyPlant:  # on hardware: `step` sends the velocity of the hand and waits for the next tick
    def start(self, object, hand):
        return State(np.array(object, float), np.array(hand, float))

    def step(self, state, velocity, dt):
        local = rotate(-state.object[2], state.hand[:2] - state.object[:2])
        at, u = DISC.outline.nearest(local), rotate(-state.object[2], velocity[:2])
        moved = np.zeros(3)
        if (at.point - local) @ at.normal < 0.0025 + 1e-5 and u @ at.normal > 0:  # it touches, and pushes
            moved = exp(dt * fp.PointContact(at.point, at.normal, 0.35).motion(TABLE, u).twist)
        return State(compose(state.object, moved), state.hand + dt * np.asarray(velocity))


scene = fp.load_scene(Path(__file__).parent / "disc.yaml")
DISC, TABLE, plan = scene.object, fp.Ellipsoid(np.diag([1.0, 1.0, 1900.0])), fp.plan(scene)
sensor = SimulatedSensor(Camera(), np.random.default_rng(0))
hand = plan.segments[0].pusher[0]
run = drive(PlanController.of(plan, "path", 60.0), MyPlant(), scene.start_pose, hand, sensor, duration=60.0)
print(run.outcome, f"{1000 * np.hypot(*(run.object[-1] - scene.goal_pose)[:2]):.2f} mm off the goal")
assert np.hypot(*(run.object[-1] - scene.goal_pose)[:2]) < 2e-3
