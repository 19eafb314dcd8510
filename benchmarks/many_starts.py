"""A thousand starts through one Planner: CPU time of each and what the plans cost more than single ones.

python benchmarks/many_starts.py [STARTS]    (default 1000; every tenth is also planned alone)

Prints for some scenes the time of a start [ms], the same planned alone, and the ratio of the costs: median and 95th
percentile. Compiled kernels are loaded before the clock runs.
"""

import sys
import time
from dataclasses import replace

import numpy as np

import flatpush as fp

RECTANGLE = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]
TWO = fp.Pusher(fingers=2, spacing=0.018)
SCENES = {
    "rectangle": fp.Scene(fp.Object(RECTANGLE, "outline"), (0.06, 0.02, 2.6), pusher=TWO),
    "rectangle, one finger, ellipsoid": fp.Scene(
        fp.Object(RECTANGLE, "uniform"), (0.06, 0.02, 2.6), planning=fp.Planning(model="ellipsoid")
    ),
    "rectangle, time": fp.Scene(
        fp.Object(RECTANGLE, "outline"), (0.06, 0.02, 2.6), pusher=TWO, planning=fp.Planning(cost="time")
    ),
}


def main(count: int) -> None:
    print(f"{'CPU time [ms]':34}{'of many':>9}{'alone':>9}{'ratio':>7}   cost of many / alone: median, 95 %")
    for name, scene in SCENES.items():
        rng = np.random.default_rng(0)
        starts = rng.uniform(-1, 1, (count, 3)) * [0.15, 0.15, np.pi]
        planner = fp.Planner(scene)
        planner.plan()
        begun = time.process_time()
        many = planner.plans(starts)
        each = (time.process_time() - begun) / count
        begun = time.process_time()
        alone = [fp.plan(replace(planner.scene, start=tuple(start))) for start in starts[::10]]
        single = (time.process_time() - begun) / len(alone)
        ratios = [a.cost / b.cost for a, b in zip(many[::10], alone, strict=True) if b.cost]
        middle, far = np.percentile(ratios, (50, 95))
        print(
            f"{name:34}{1e3 * each:9.1f}{1e3 * single:9.1f}{each / single:7.2f}   {middle:.6f}, {far:.6f}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
