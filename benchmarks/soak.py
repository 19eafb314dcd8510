"""Many plans and simulations in one process: does memory stay flat, and does any fail?

    python benchmarks/soak.py [--plans N] [--warm W] [--iterations I]

Plans N different random scenes (`random_scenes.py`; one in ten keeps its walls, which cost most), verifies and
simulates each plan, and prints failures, the memory of the process along the way, and the slope of a line through it
after the first W scenes. The exit status is 1 if there is a failure.
"""

import argparse
import gc
import sys
import traceback
from pathlib import Path

import numpy as np

import flatpush as fp
from flatpush.documents import parse_scene

sys.path.insert(0, str(Path(__file__).parent))
from random_scenes import scene


def memory() -> float:
    """What this process holds in memory [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def fails(seed: int, iterations: int) -> str:
    """Why a scene counts as failed; empty if it does not."""
    try:
        document = scene(seed, iterations)
        if seed % 10:
            document.pop("workspace", None)
        plan = fp.plan(parse_scene(document))
        if plan.status != "solved":
            return "" if plan.reason else "no plan, and no reason"
        failed = fp.verify(plan).failed
        end = fp.simulate(plan, seed=None)
        if failed or not np.all(np.isfinite(end.final_pose)):
            return f"{[claim.name for claim in failed]}, ends at {end.final_pose}"
    except Exception:  # whatever it is, it is a failure
        return traceback.format_exc()
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--plans", type=int, default=2000)
    parser.add_argument("--warm", type=int, default=200)
    parser.add_argument("--iterations", type=int, default=20)
    arguments = parser.parse_args()
    held, failures = np.zeros(arguments.plans), 0
    for seed in range(arguments.plans):
        why = fails(seed, arguments.iterations)
        failures += bool(why)
        if why:
            print(f"scene {seed}: {why}", flush=True)
        held[seed] = memory()
        if (seed + 1) % 100 == 0:
            gc.collect()
            print(f"{seed + 1} plans: {memory():.1f} MB", flush=True)
    after = held[arguments.warm :]
    slope = 1e3 * np.polyfit(np.arange(len(after)), after, 1)[0] if len(after) > 1 else float("nan")
    print(f"{arguments.plans} plans and simulations: {failures} failures,", end=" ")
    print(f"{held[-1]:.1f} MB at the end, {slope:+.2f} kB a plan after the first {arguments.warm}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
