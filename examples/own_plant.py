"""A loop of your own: a plant and a sensor that are yours, and a controller of flatpush that keeps the push on its way.

    python examples/own_plant.py

The plant is a box on a table with a known ellipsoidal limit surface, moved by a finger of a robot that is told a
velocity 50 times a second. The sensor is a tracker that sees the box every 40 ms to a tenth of a millimetre and
degree, and tells one tick later. In a laboratory both would be drivers of hardware, and the loop below is the same.
"""

from dataclasses import dataclass

import numpy as np

import flatpush as fp
from flatpush.control import (
    ARRIVED,
    AbstractSensor,
    Limits,
    Measurement,
    PathController,
    PathReference,
    SensorState,
    SteeringModel,
    drive,
    limits_used,
)
from flatpush.geometry import compose, exp, pose_error, rotate

RATE = 50.0
CONTACT = fp.PointContact([0.0, -0.02], [0.0, 1.0], 0.5)
SURFACE = fp.Ellipsoid(np.diag([1.0, 1.0, 2500.0]))


@dataclass(frozen=True)
class BoxAndFinger:
    """Where the box and the hand are: X_WO and X_WE."""

    object: np.ndarray
    hand: np.ndarray
    modes: tuple[str, ...] = ("rest",)
    outcome: str = ""


class Table:
    """The plant: the finger sticks or slides at one place of the box, as the mechanics of flatpush has it."""

    def start(self, object_, hand):
        return BoxAndFinger(np.array(object_, dtype=float), np.array(hand, dtype=float))

    def step(self, state, velocity, dt):
        u = rotate(-state.object[2], velocity[:2])
        motion = CONTACT.motion(SURFACE, u)
        box = compose(state.object, exp(dt * motion.twist))
        return BoxAndFinger(box, state.hand + dt * np.asarray(velocity), (motion.mode.name.lower(),))


@dataclass(frozen=True)
class Seen(SensorState):
    """What the tracker has seen and not told yet, and when it looks next [s]."""

    kept: Measurement | None = None
    due: float = 0.0


class Tracker(AbstractSensor):
    """The sensor. A real one asks its driver in `arrived`; this one is shown the box by `expose`."""

    def start(self):
        return Seen()

    def expose(self, state, time, object, pusher):
        if time < state.due - 1e-9:
            return state
        rounded = np.round(object, 4) * [1, 1, 0] + [0, 0, np.deg2rad(np.round(np.rad2deg(object[2]), 1))]
        return Seen(kept=Measurement(time, rounded, np.asarray(pusher)), due=state.due + 0.04)

    def arrived(self, state, time):
        if state.kept is None or state.kept.time > time - 0.9 / RATE:
            return state, ()
        return Seen(due=state.due), (state.kept,)


def main():
    model = SteeringModel.of_flat(fp.flat_output(CONTACT, SURFACE))
    x, y, heading = model.flat_of([0.0, 0.0, 0.0])
    # 60 mm straight on, then 60 mm on an arc to the left.
    path = PathReference(
        np.array([[0.0, 0.06, x, y, heading, 0.0], [0.06, 0.06, x, y + 0.06, heading, 12.0]]), speed=0.02
    )
    limits = Limits(np.zeros((1, 2)), 0.03, 0.2, np.deg2rad(90), 0.1, 0.5)
    controller = PathController(model, path, RATE, deceleration=0.1, limits=limits)

    start = np.array([0.001, -0.001, np.deg2rad(2.0)])  # it stands a little off
    run = drive(controller, Table(), start, compose(start, model.pusher), Tracker(), duration=20.0)

    goal = compose(exp(np.array([0.0, 0.06, 0.0])), exp(model.twist(1.0, 12.0) * 0.06))
    off = pose_error(run.object[-1], goal)
    place, turn = 1000 * np.hypot(*off[:2]), np.rad2deg(off[2])
    print(f"{run.outcome} after {run.times[-1]:.1f} s, {place:.2f} mm and {turn:.2f}° off")
    used = (f"{name} {100 * share:.0f} %" for name, share in limits_used(run, limits).items())
    print("limits used: " + ", ".join(used))
    return run, off


if __name__ == "__main__":
    run, _ = main()
    raise SystemExit(0 if run.outcome == ARRIVED else 1)
