"""Goals with a free angle against the best of fixed ones: python benchmarks/free_goal.py [N] [FINGERS] [SEED] [ANGLES]

A disc of 80 mm, automatic pushes, random starts. Prints the cost of the free goal, the least of those of 72 angles, and
the CPU time of the search for the free goal in that for one fixed angle (a first start compiles and is left out).
With the word obstacles, between three walls.
"""

import sys
import time
from dataclasses import replace

import numpy as np

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import Outline
from flatpush.planning.empty_table import refined_paths
from flatpush.problem import Planning, Workspace

WALLS = (
    [(-0.1, -0.02), (-0.06, -0.02), (-0.06, 0.1), (-0.1, 0.1)],
    [(0.06, -0.1), (0.1, -0.1), (0.1, 0.03), (0.06, 0.03)],
    [(-0.06, -0.12), (0.02, -0.12), (0.02, -0.08), (-0.06, -0.08)],
)


def main(n: int = 5, fingers: int = 2, seed: int = 0, angles: int = 72, walls: bool = False) -> None:
    rng = np.random.default_rng(seed)
    disc = fp.Object(Outline.circle(0.04), friction=0.3)
    pusher = fp.Pusher(fingers=2, spacing=0.018) if fingers == 2 else fp.Pusher()
    worst, ratios = -np.inf, []
    world = Workspace(obstacles=WALLS) if walls else Workspace()
    for k in range(n + 1):
        planner = _planner(disc, pusher, world, rng)

        def searched(goal: object, planner: fp.Planner = planner) -> tuple[float, float]:
            began, asked = time.process_time(), replace(planner.scene, goal=goal)
            if walls:
                *_, last = fp.Planner(asked).answers()
            else:
                *_, last = refined_paths(asked, planner.fleet)
            return last.cost, time.process_time() - began

        free, own = searched((0, 0, "free"))
        if k == 0:
            continue
        fixed = [searched((0, 0, angle)) for angle in np.arange(angles) * (2 * np.pi / angles)]
        best, typical = min(cost for cost, _ in fixed), float(np.median([spent for _, spent in fixed]))
        worst, ratios = max(worst, free / best - 1), [*ratios, own / typical]
        print(
            f"free {1000 * free:.3f} mm, best of {angles} {1000 * best:.3f} mm, time ratio {ratios[-1]:.2f}",
            flush=True,
        )
    print(
        f"{n} starts: dearest by {100 * worst:.4f} %, time ratio {np.median(ratios):.2f} (at most {max(ratios):.2f})"
    )


def _planner(disc: fp.Object, pusher: fp.Pusher, world: Workspace, rng: np.random.Generator) -> fp.Planner:
    """From a random start at which the disc is clear of the walls."""
    while True:
        start = (*rng.uniform(-0.15, 0.15, 2), rng.uniform(-np.pi, np.pi))
        planning = Planning(time_limit=60.0)
        planner = fp.Planner(
            fp.Scene(disc, start, (0, 0, "free"), pusher, workspace=world, planning=planning)
        )
        try:
            next(planner.answers())
        except InputError:
            continue
        return planner


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word != "obstacles"]
    main(*map(int, given), walls="obstacles" in sys.argv[1:])
