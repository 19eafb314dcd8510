"""Part of `flatpush experiment feedback`: one controller or one disturbance, with landings, times and limits used.

    python benchmarks/feedback_study.py [RUNS] [CONTROLLER] ["" | displaced | lost] [FIRST]

RUNS (default 400) tasks from number FIRST (0) on of the controller horizon (default; it learns), path or dfl, in one
process; with a disturbance, which moves the hand itself, those of seed 1, as in the experiment. Prints every run that
fails as it comes, then the table's row, the median, 95 % and longest time, and the greatest share of each limit.
"""

import sys

import numpy as np

from flatpush.control.loop.closed_loop import limits_used
from flatpush.control.loop.limits import Limits
from flatpush.experiments.feedback import attempt, line, task


def main(runs: int, law: str, kind: str, first: int) -> None:
    ends, shares = [], {}
    for number in range(first, first + runs):
        asked = task(number, 1, near=0.1) if kind else task(number)
        if not asked.steerable:
            continue
        ended, run = attempt(asked, law, law == "horizon", kind)
        ends.append(ended)
        if not ended.good:
            off = f"{1000 * ended.distance:.2f} mm, {np.rad2deg(ended.angle):.2f}°"
            print(f"task {number}, {asked.scene.object.name}: {ended.outcome} ({off})", flush=True)
        if run is not None and not kind:
            for key, share in limits_used(run, Limits.of(asked.scene.pusher, np.zeros((1, 2)))).items():
                shares[key] = max(shares.get(key, 0.0), share)
        if len(ends) % 50 == 0:
            print(line(f"first {len(ends)}", ends), flush=True)
    print(line(f"{law} {kind}", ends))
    times = np.quantile([end.time for end in ends], [0.5, 0.95, 1.0])
    print("time, median, 95 %, longest: " + ", ".join(f"{t:.1f} s" for t in times))
    print("most of each limit: " + ", ".join(f"{key} {share:.7f}" for key, share in shares.items()))


if __name__ == "__main__":
    given = sys.argv[1:] + ["400", "horizon", "", "0"][len(sys.argv) - 1 :]
    main(int(given[0]), given[1], given[2], int(given[3]))
