"""What a wide goal tolerance saves: python benchmarks/goal_tolerance.py [STARTS]

Plans of many pushes from random starts with tolerances of 1, 2, 5 and 10 mm and as many degrees, against those that
end at the goal. Prints the part of the cost that is saved (mean, least, most), its length, and the CPU
time of the search.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import flatpush as fp
from flatpush.planning.empty_table import refined_paths
from flatpush.problem.scene import GOAL_TOLERANCE

EXAMPLES = Path(__file__).parents[1] / "examples"
WIDE = (1, 2, 5, 10)


def main(starts: int = 12) -> None:
    for name in ("triangle", "rectangle_boundary"):
        planner, rng = fp.Planner(fp.load_scene(EXAMPLES / f"{name}.yaml")), np.random.default_rng(1)

        def searched(
            start: tuple[float, ...], wide: float, planner: fp.Planner = planner
        ) -> tuple[float, float]:
            tolerance = (wide / 1000, wide / 1000, np.deg2rad(wide)) if wide else GOAL_TOLERANCE
            planning = replace(planner.scene.planning, goal_tolerance=tolerance)
            began = time.process_time()
            *_, last = refined_paths(replace(planner.scene, start=start, planning=planning), planner.fleet)
            return last.cost, time.process_time() - began

        searched(planner.scene.start, WIDE[0])  # what compiles
        found = []
        for _ in range(starts):
            start = (*rng.uniform(-0.1, 0.1, 2), rng.uniform(-np.pi, np.pi))
            found.append([searched(start, wide) for wide in (0, *WIDE)])
        costs, times = np.moveaxis(np.array(found), 2, 0)
        for k, wide in enumerate(WIDE, 1):
            dearer = times[:, k].sum() / times[:, 0].sum()
            saved = 100 * (1 - costs[:, k] / costs[:, 0])
            print(
                f"{name}, {wide} mm and {wide}°: {saved.mean():.1f} % saved ({saved.min():.1f}–{saved.max():.1f}),"
                f" {1000 * (costs[:, 0] - costs[:, k]).mean():.1f} mm; time × {dearer:.2f}"
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
