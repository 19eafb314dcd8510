"""An object on an unknown table, one finger, closed loop, simulated: python benchmarks/unknown_table.py N [FIRST].

N tasks: four outlines in turn, random starts, goals and tables (face, rim, three to eight feet; finger friction 0.2 to
0.6), a camera of 0.1 mm and 0.1° at 30 Hz, 0.1 s late, which is more noise than the drawn camera of
benchmarks/camera.py has. Printed: where the object ends after six first pushes and the horizon controller.
"""

import sys
import time

import numpy as np

from flatpush.control import Camera
from flatpush.control.tracking.unknown_table import drawn_table, run_unknown
from flatpush.problem import Object, Pusher, Scene, Workspace

ANGLES = np.arange(5) * 2 * np.pi / 5
OUTLINES = {
    "rectangle": [(0.03, -0.0225), (0.03, 0.0225), (-0.03, 0.0225), (-0.03, -0.0225)],
    "triangle": [(0.0393, -0.019), (0.0393, 0.038), (-0.0787, -0.019)],
    "L": [(0.0, 0.0), (0.06, 0.0), (0.06, 0.02), (0.02, 0.02), (0.02, 0.06), (0.0, 0.06)],
    "pentagon": [(0.04 * np.cos(a), 0.04 * np.sin(a)) for a in ANGLES],
}
ROOM = Workspace((-0.3, -0.3, 0.3, 0.3), ())
WITHIN = (0.001, float(np.deg2rad(1.0)))


def task(seed: int) -> Scene:
    name = list(OUTLINES)[seed % len(OUTLINES)]
    rng = np.random.default_rng(seed)
    start = (*rng.uniform(-0.12, 0.12, 2), rng.uniform(-3, 3))
    thing = Object(OUTLINES[name], friction=0.35, name=name)
    return Scene(thing, start, (0.0, 0.0, 0.0), Pusher(fingers=1, tip_radius=0.0025), workspace=ROOM)


def main(count: int, first: int) -> None:
    camera = Camera(position=1e-4, angle=float(np.deg2rad(0.1)))
    near, ends = 0, []
    for seed in range(first, first + count):
        scene, began = task(seed), time.process_time()
        thing = drawn_table(scene.object.outline, seed)
        done = run_unknown(scene, thing, camera, seed=seed, tolerance=WITHIN)
        error = scene.goal_error(done.run.object[-1])
        ends.append((float(np.hypot(*error[:2])), abs(float(error[2]))))
        good = ends[-1][0] <= WITHIN[0] and ends[-1][1] <= WITHIN[1]
        near += good
        kind = thing.support_word or f"{len(thing.support.feet[0])} feet"
        print(
            f"{seed} {scene.object.name} on {kind}, μ {thing.friction:.2f}: {done.run.outcome},"
            f" {1000 * ends[-1][0]:.2f} mm and {np.rad2deg(ends[-1][1]):.2f}°, taught after {done.taught:.0f} s,"
            f" {done.run.times[-1]:.0f} s in all; CPU {time.process_time() - began:.0f} s", flush=True,
        )  # fmt: skip
    table = np.array(ends)
    print(
        f"{near} of {count} within 1 mm and 1°; median {1000 * np.median(table[:, 0]):.2f} mm and"
        f" {np.rad2deg(np.median(table[:, 1])):.2f}°"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
