"""Times of steering queries, next to OMPL's in the same run: pytest benchmarks/test_steering.py -n 0 -s.

Nothing is asserted about time. Lengths are per pair and include everything from the poses on; OMPL is
asked from Python, one pair at a time, with its states already filled.
"""

import numpy as np
import pytest

from flatpush.steering import dubins, shortest_word

PAIRS = 20_000
rng = np.random.default_rng(0)
STARTS, GOALS = (
    np.concatenate([rng.uniform(-5, 5, (PAIRS, 2)), rng.uniform(0, 6.28, (PAIRS, 1))], 1) for _ in "ab"
)
CAR = tuple(map(np.array, ([0.05, 0.12], [-0.02, -0.2], [0.9, -0.3])))
QUERY = (*CAR, np.array([0.0, 0.0, 0.0]), np.array([0.4, 0.3, 1.0]), np.array([0.2, 1.0, 0.1]))


def tell(benchmark, what, count=1):
    if benchmark.stats is not None:
        best, median = benchmark.stats.stats.min / count, benchmark.stats.stats.median / count
        print(f"\n{what}: {1e9 * best:.4g} ns at best, {1e9 * median:.4g} ns median")


def test_dubins_lengths(benchmark):
    benchmark(dubins.shortest_length, STARTS, GOALS, 1.0)
    tell(benchmark, "shortest_length, per pair", PAIRS)


def test_dubins_table(benchmark):
    benchmark(dubins.shortest_length, STARTS[:150, None], GOALS[None, :150], 1.0)
    tell(benchmark, "shortest_length of a table, per pair", 150 * 150)


def test_dubins_kernel(benchmark):
    from flatpush.steering.kernels import dubins_lengths

    out = np.empty((1, PAIRS))
    benchmark(dubins_lengths, STARTS[None], GOALS[None], 1.0, out)
    tell(benchmark, "dubins_lengths (kernel), per pair", PAIRS)


def test_ompl_distance(benchmark):
    base = pytest.importorskip("ompl.base", reason="OMPL is not installed")
    space = base.DubinsStateSpace(1.0)
    states = []
    for pose in np.stack([STARTS, GOALS], 1)[:200].reshape(-1, 3):
        state = space.allocState()
        state.setXY(float(pose[0]), float(pose[1]))
        state.setYaw(float(pose[2]))
        states.append(state)
    pairs = list(zip(states[::2], states[1::2], strict=True))

    def distances():
        for start, goal in pairs:
            space.distance(start, goal)

    benchmark(distances)
    tell(benchmark, "OMPL distance from Python, per pair", len(pairs))


def test_dubins_path(benchmark):
    benchmark(dubins.shortest_path, STARTS[0], GOALS[0], 1.0)
    tell(benchmark, "shortest_path (plain)")


def test_word(benchmark):
    benchmark(shortest_word, *QUERY)
    tell(benchmark, "three-twist shortest_word (plain)")


def test_compiled_word(benchmark):
    from flatpush.steering import kernels

    benchmark(kernels.shortest_word, *QUERY)
    tell(benchmark, "three-twist shortest_word (compiled)")
