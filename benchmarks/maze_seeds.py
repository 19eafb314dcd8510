"""The robot-executed maze B with its stored pushes, many seeds:
FLATPUSH_DATA=… python benchmarks/maze_seeds.py [SEEDS [SECONDS]]."""

import os
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.maze import check_way, stored_query

from flatpush.planning.obstacles import Search


def main(seeds: int, seconds: float) -> None:
    query = stored_query(Path(os.environ["FLATPUSH_DATA"]), need=1.5e-5)
    next(Search(query, 0).rounds())  # compiles
    rows = []
    for seed in range(seeds):
        search, began, clock, first = Search(query, seed), time.thread_time(), time.perf_counter(), None
        for way in search.rounds():
            if way is not None and first is None:
                first = time.perf_counter() - clock
            if time.thread_time() - began > seconds:
                break
        assert search.best is not None
        check_way(query, search.best)
        rows.append((first, search.cost))
    times, costs = np.array(rows).T
    print(f"first path {1e3 * np.median(times):.1f} ms median, {1e3 * times.max():.1f} ms at most")
    for limit in (0.70, 0.62, 0.43):
        print(f"cost <= {limit}: {np.sum(costs <= limit)} of {seeds}; median {np.median(costs):.4f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, float(sys.argv[2]) if len(sys.argv) > 2 else 2.0)
