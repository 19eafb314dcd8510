"""Time of closed-loop runs, and of one step of every controller from Python.

`pytest benchmarks/test_control.py -n 0 -s` prints them; CPU time of one thread, so that other work on the machine does
not count. FLATPUSH_RUNS sets how many runs there are (10,000 of 30 s at 60 Hz by default). Nothing is asserted.
"""

import os
import time
from collections import defaultdict

import numpy as np
import pytest

from flatpush.control import Camera, Measurement, SimulatedSensor
from flatpush.control.horizon.controller import HorizonController
from flatpush.control.laws.gains import Gains
from flatpush.control.laws.linearisation import TrackingController
from flatpush.control.laws.many_runs import closed_loops
from flatpush.control.laws.path_following import PathController
from flatpush.control.laws.reference import PathReference
from flatpush.control.loop.closed_loop import drive
from flatpush.experiments.feedback import PATIENCE, task
from flatpush.experiments.fig4 import NOMINAL, matrix, push_model
from flatpush.geometry import compose
from flatpush.simulation.plant import Plant


def controllers():
    model = push_model()
    x, y, heading = model.flat_of([0, 0, 0])
    path = PathReference(np.array([[0.0, 0.0077 * 31, x, y, heading, 10.0]]), 0.0077)
    return {
        "dfl": TrackingController(model, Gains(4, 4), reference=path),
        "path": PathController(model, path),
    }


@pytest.mark.parametrize("law", ["dfl", "path"])
def test_closed_loop_runs(law):
    count = int(os.environ.get("FLATPUSH_RUNS", "10000"))
    controller = controllers()[law]
    starts = np.random.default_rng(0).normal(size=(count, 3)) * [0.001, 0.001, 0.05]
    closed_loops(controller, [0, 1], starts[:2], matrix(NOMINAL), 1.0)
    spent, waited = [], []
    for _ in range(3):
        begun = time.process_time()
        closed_loops(controller, [0, 1], starts, matrix(NOMINAL), 30.0, threads=1)
        spent.append(time.process_time() - begun)
        begun = time.perf_counter()
        closed_loops(controller, [0, 1], starts, matrix(NOMINAL), 30.0)
        waited.append(time.perf_counter() - begun)
    print(
        f"\n{law}: {count} runs of 30 s at 60 Hz: {min(spent):.2f} s of one core;"
        f" {min(waited):.2f} s by the clock on all cores"
    )


@pytest.mark.parametrize("law", ["dfl", "path"])
def test_control_step(law):
    controller = controllers()[law]
    spent = []
    for _ in range(5):
        state = controller.start()
        begun = time.thread_time()
        for k in range(500):
            frame = (
                Measurement(k / 60, np.array([0, 0.0077 * k / 60, 0]), np.zeros(3)) if k % 2 == 0 else None
            )
            state, _ = controller.step(state, frame, k / 60 + 0.1)
        spent.append((time.thread_time() - begun) / 500)
    print(f"\n{law}: {1e3 * min(spent):.3f} ms a step, 30 Hz camera with 100 ms latency")


class Timed:
    """A controller that notes how long each of its steps took, by what it was doing."""

    def __init__(self, controller):
        self.controller, self.rate = controller, controller.rate
        self.start, self.spent = controller.start, defaultdict(list)

    def step(self, state, measurement, time_):
        begun = time.thread_time()
        after, command = self.controller.step(state, measurement, time_)
        spent = time.thread_time() - begun
        landed = after.landings > state.landings
        self.spent["choosing where to land, the pusher at rest" if landed else state.phase].append(spent)
        return after, command


def test_horizon_step():
    spent = defaultdict(list)
    for number in (-1, *range(12)):
        asked = task(max(number, 0))
        controller = Timed(HorizonController.of(asked.scene))
        hand = compose(asked.scene.start_pose, [-0.1, 0.0, 0.0])
        sensor = SimulatedSensor(Camera(), np.random.default_rng(0))
        plant = Plant(asked.truth, [[0.0, 0.0]], asked.scene.pusher.tip_radius)
        drive(controller, plant, asked.scene.start_pose, hand, sensor, PATIENCE)
        if number >= 0:  # the run before compiles
            for phase, times in controller.spent.items():
                spent[phase] += times
    print()
    for phase, times in spent.items():
        middle, high, most = 1e3 * np.quantile(times, [0.5, 0.99, 1.0])
        print(
            f"horizon, {phase}: {middle:.2f} ms a step, 99 % within {high:.2f}, {most:.2f} at most ({len(times)} steps)"
        )
