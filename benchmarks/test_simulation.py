"""Times of the compiled plant, next to MuJoCo's in the same run: pytest benchmarks/test_simulation.py -n 0 -s.

With FLATPUSH_OLD, a checkout, the single steps of both are measured turn by turn, in CPU time.

Ten thousand open-loop runs of a push of ten seconds, each from its own start and with its own friction, on an ellipsoid
and on the exact surface of three feet, with one finger and with two. Nothing is asserted about time.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import flatpush as fp
from flatpush.simulation.plant import Plant

RUNS, SECONDS, SPEED, RADIUS = 10_000, 10.0, 0.01, 0.0025
CORNERS = [(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)]
FEET = [(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)]


def setting(model: str, fingers: int) -> tuple[Plant, np.ndarray]:
    """A plant, and a way of ten seconds at the rate of a camera: straight on, with a bend to the left."""
    thing = fp.Object(CORNERS, fp.Support.points(FEET), 0.4)
    tips = [[0.0, 0.0]] if fingers == 1 else [[0.0, 0.009], [0.0, -0.009]]
    plant = Plant(thing, tips, RADIUS, model=model)
    way = [np.array([0.0, -0.0175 - RADIUS, np.pi / 2])]
    for _ in range(int(30 * SECONDS)):
        x, y, a = way[-1]
        way.append(np.array([x + SPEED / 30 * np.cos(a), y + SPEED / 30 * np.sin(a), a + SPEED / 30 / 0.3]))
    return plant, np.array(way)


STEPS = """
import json, time
from benchmarks.test_simulation import setting
took = {}
for model in ("ellipsoid", "exact"):
    for fingers in (1, 2):
        plant, way = setting(model, fingers)
        plant.many([[0.0, 0.0, 0.0]] * 100, way)  # compiles, in every version
        begun, best = plant.start([0, 0, 0], way[0]), float("inf")
        for _ in range(10):
            state, since = begun, time.process_time()
            for _ in range(400):
                state = plant.step(state, [0.0, 0.01, 0.02], 0.002)
            best = min(best, (time.process_time() - since) / 400)
        took[f"{model}, {fingers} finger(s)"] = 1e6 * best
print(json.dumps(took))
"""


def test_single_steps():
    """One step of 20 µm of a held object: the time from Python to Python."""
    new = Path(__file__).parents[1]
    checkouts = {"this": new} | (
        {"old": Path(os.environ["FLATPUSH_OLD"])} if "FLATPUSH_OLD" in os.environ else {}
    )
    took = {}
    for _ in range(3):
        for name, checkout in checkouts.items():
            environment = os.environ | {"PYTHONPATH": f"{checkout / 'src'}{os.pathsep}{new}"}
            command = [sys.executable, "-c", STEPS]
            ran = subprocess.run(
                command, env=environment, cwd="/", capture_output=True, text=True, check=True
            )
            for case, micros in json.loads(ran.stdout).items():
                took.setdefault(case, {}).setdefault(name, []).append(micros)
    for case, times in took.items():
        text = ", ".join(f"{name} {min(values):.1f} µs" for name, values in times.items())
        ratio = f", ratio {min(times['this']) / min(times['old']):.2f}" if "old" in times else ""
        print(f"\nPlant.step, {case}: {text}{ratio}", end="")
    assert took


def disturbed() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    starts = rng.normal(size=(RUNS, 3)) * [0.0005, 0.0005, np.deg2rad(0.5)]
    return starts, rng.uniform(0.3, 0.5, RUNS)


@pytest.mark.parametrize("fingers", [1, 2])
@pytest.mark.parametrize("model", ["ellipsoid", "exact"])
def test_ten_thousand_runs(model, fingers):
    plant, way = setting(model, fingers)
    starts, friction = disturbed()
    plant.many(starts[:4], way, friction=friction[:4])  # compiles
    times = []
    for _ in range(3):
        begun = time.perf_counter()
        runs = plant.many(starts, way, friction=friction)
        times.append(time.perf_counter() - begun)
    assert np.isfinite(runs.final).all()
    print(f"\n{RUNS} runs of {SECONDS:g} s, {model}, {fingers} finger(s): {min(times):.1f} s", end="")
    print(f" (to {max(times):.1f}), {100 * np.mean(runs.stuck):.0f} % stuck throughout")


def test_mujoco_beside_it(monkeypatch):
    """One push of 50 mm at 10 mm/s with the accuracy that the reference needs, in both."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1])
    from tests.oracles.mujoco_reference import push

    thing = fp.Object(CORNERS, fp.Support.points(FEET), 0.4)
    tip = np.array([[0.003, -0.0175 - RADIUS]])
    box = [(-0.025, -0.0175, 0.025, 0.0175)]
    begun = time.perf_counter()
    push(thing, np.zeros(3), tip, RADIUS, length=0.05, angle=np.pi / 2, boxes=box)
    theirs = time.perf_counter() - begun
    plant = Plant(thing, [[0.0, 0.0]], RADIUS)
    way = np.array([[*tip[0], 0.0], [*(tip[0] + [0.0, 0.05]), 0.0]])
    plant.follow([0, 0, 0], way)
    begun = time.perf_counter()
    plant.follow([0, 0, 0], way)
    ours = time.perf_counter() - begun
    print(f"\none push of 50 mm: MuJoCo {theirs:.2f} s, plant {1e3 * ours:.2f} ms")
