"""The second robot-executed maze under every friction model: python benchmarks/maze_models.py [SECONDS [SEEDS]].

The pushes are those of examples/maze.yaml, made by us instead of stored; margins are 0 as in maze_seeds.py.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import flatpush as fp

MODELS = "exact", "ellipsoid", "local", "quartic"
FINGERS = "cone", "middle"


def main(seconds: float, seeds: int) -> None:
    scene = fp.load_scene(Path(__file__).parents[1] / "examples" / "maze.yaml")
    print("model      fingers  first path (median, most)   cost (best, median, worst)   least clearance")
    for fingers in FINGERS:
        for model in MODELS:
            firsts, costs, gaps = [], [], []
            for seed in range(-1, seeds):
                planning = replace(
                    scene.planning, model=model, two_finger=fingers, friction_margin=0.0, clearance=0.0,
                    time_limit=seconds, seed=max(seed, 0), iterations=10**9,
                )  # fmt: skip
                planner = fp.Planner(replace(scene, planning=planning))
                began, best = time.perf_counter(), None
                for answer in planner.answers():
                    best = answer
                    if time.perf_counter() - began > seconds:
                        break
                assert best is not None
                plan = best.plan()
                if seed < 0:
                    continue  # this one compiled
                if plan.status != "solved":
                    costs.append(np.inf)
                    continue
                firsts.append(plan.run["first_path_time"])
                costs.append(plan.cost)
                gaps.append(plan.certificate.clearance)
            first = 1e3 * np.quantile(firsts, [0.5, 1.0]) if firsts else [np.nan, np.nan]
            cost = np.quantile(costs, [0.0, 0.5, 1.0], method="nearest")
            print(
                f"{model:<10} {fingers:<8} {first[0]:8.1f} ms {first[1]:8.1f} ms {cost[0]:11.4f} {cost[1]:8.4f}"
                f" {cost[2]:8.4f} {1e3 * min(gaps, default=np.nan):12.4f} mm",
                flush=True,
            )


if __name__ == "__main__":
    given = [*sys.argv[1:], *("2", "3")[len(sys.argv) - 1 :]]
    main(float(given[0]), int(given[1]))
