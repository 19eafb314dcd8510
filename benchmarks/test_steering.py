"""Times of steering queries, next to OMPL's in the same run: pytest benchmarks/test_steering.py -n 0 -s.

Nothing is asserted about time. The table of lengths is CPU time of one thread per pair, everything from the poses on
included, the best of many rounds that take turns; OMPL is asked from Python, one pair at a time, with its states
already filled. Wall times tell what the cores give together, and what the first call costs with and without a cache.
"""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from flatpush.steering import dubins, shortest_word
from flatpush.steering.fleet import Fleet
from flatpush.steering.lengths import dubins_lengths, fleet_lengths
from flatpush.steering.six_words import WORD, chain_cost

PAIRS, ROWS, COLUMNS, ROUNDS, ASKED = 20_000, 40, 500, 100, 300
rng = np.random.default_rng(0)
STARTS, GOALS = (
    np.concatenate([rng.uniform(-5, 5, (PAIRS, 2)), rng.uniform(0, 6.28, (PAIRS, 1))], 1) for _ in "ab"
)
CAR = tuple(map(np.array, ([0.05, 0.92], [-0.12, -1.2], [0.9, -0.3])))
QUERY = (*CAR, np.array([0.0, 0.0, 0.0]), np.array([0.4, 0.3, 1.0]), np.array([0.2, 1.0, 0.1]))


def fleet(timed=False):
    speeds, accelerations = (np.full((1, 3), value if timed else np.inf) for value in (0.02, 0.1))
    ahead = CAR[2] / np.hypot(*CAR[2])
    rates = np.array([[0.7, 1.0, 1.2]])
    return Fleet(CAR[0][None], CAR[1][None], ahead[None], rates, speeds, accelerations, np.zeros((1, 1)))


def ompl_distances():
    """Asks OMPL for some of the distances."""
    base = pytest.importorskip("ompl.base", reason="OMPL is not installed")
    space = base.DubinsStateSpace(1.0)
    states = []
    for pose in np.stack([STARTS, GOALS], 1)[:ASKED].reshape(-1, 3):
        state = space.allocState()
        state.setXY(float(pose[0]), float(pose[1]))
        state.setYaw(float(pose[2]))
        states.append(state)
    pairs = list(zip(states[::2], states[1::2], strict=True))

    def distances():
        for start, goal in pairs:
            space.distance(start, goal)

    return distances


def table_of_lengths():
    """Name, function and number of pairs, OMPL's first."""
    pairs, table = (STARTS, GOALS), (STARTS[:ROWS, None], GOALS[:COLUMNS])
    linear, timed = fleet(), fleet(timed=True)
    return [
        ("OMPL DubinsStateSpace.distance", ompl_distances(), ASKED),
        ("dubins_lengths, pairs", lambda: dubins_lengths(*pairs, 1.0, threads=1), PAIRS),
        ("dubins_lengths, table", lambda: dubins_lengths(*table, 1.0, threads=1), ROWS * COLUMNS),
        ("fleet_lengths, pairs", lambda: fleet_lengths(linear, *pairs, threads=1), PAIRS),
        ("fleet_lengths, table", lambda: fleet_lengths(linear, *table, threads=1), ROWS * COLUMNS),
        (
            "fleet_lengths with a time law, table",
            lambda: fleet_lengths(timed, *table, threads=1),
            ROWS * COLUMNS,
        ),
    ]


def test_lengths():
    rows = table_of_lengths()
    best = dict.fromkeys((name for name, _, _ in rows), np.inf)
    for _ in range(ROUNDS):
        for name, ask, count in rows:
            begun = time.thread_time_ns()
            ask()
            best[name] = min(best[name], (time.thread_time_ns() - begun) / count)
    peer = best[rows[0][0]]
    print(f"\n{'one thread, CPU time':<38}{'ns a pair':>10}{'rate / OMPL':>13}")
    for name, nanoseconds in best.items():
        print(f"{name:<38}{nanoseconds:>10.1f}{peer / nanoseconds:>13.1f}")


def test_lengths_on_all_cores():
    starts, goals = STARTS[:2000, None], GOALS[:1000]
    best = {}
    for _ in range(5):
        for threads in (1, os.cpu_count()):
            begun = time.perf_counter()
            dubins_lengths(starts, goals, 1.0, threads=threads)
            best[threads] = min(best.get(threads, np.inf), time.perf_counter() - begun)
    print(f"\n{'2 000 000 pairs, wall time':<38}{'ns a pair':>10}")
    for threads, seconds in best.items():
        print(f"{f'{threads} thread(s)':<38}{seconds / 2e-3:>10.1f}")


def test_first_call(tmp_path):
    """In a process of its own: importing, and compiling or loading, for one batch of each kind."""
    code = (
        "import time; a = time.perf_counter(); import numpy as np; from flatpush.steering import lengths, fleet;"
        "import numba; b = time.perf_counter(); one = np.ones((1, 2)); three = np.ones((1, 3));"
        "poses = np.zeros((3, 3)); lengths.dubins_lengths(poses, poses, 1.0); c = time.perf_counter();"
        "cars = [fleet.Fleet(one, -one, one * [1, -1], three, f, f, 0) for f in (three * np.inf, three)];"
        "[lengths.fleet_lengths(f, poses, poses) for f in cars]; d = time.perf_counter();"
        "print(f'{b - a:>10.2f}{c - b:>10.2f}{d - c:>10.2f}')"
    )
    print(f"\n{'first call [s]':<38}{'imports':>10}{'Dubins':>10}{'fleets':>10}")
    for name in ("no cache", "from the cache"):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
        ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr
        print(f"{name:<38}{ended.stdout.rstrip()}")


def tell(benchmark, what):
    if benchmark.stats is not None:
        best, median = benchmark.stats.stats.min, benchmark.stats.stats.median
        print(f"\n{what}: {1e6 * best:.4g} µs at best, {1e6 * median:.4g} µs median")


def test_dubins_path(benchmark):
    benchmark(dubins.shortest_path, STARTS[0], GOALS[0], 1.0)
    tell(benchmark, "shortest_path (plain)")


def test_word(benchmark):
    benchmark(shortest_word, *QUERY)
    tell(benchmark, "three-twist shortest_word (plain)")


def test_compiled_word(benchmark):
    car, ends, found = fleet().cars, np.array(QUERY[3:5]), np.zeros(1, WORD)
    benchmark(chain_cost, car, np.zeros(1, np.int64), ends, found)
    tell(benchmark, "three-twist shortest_word (compiled)")
