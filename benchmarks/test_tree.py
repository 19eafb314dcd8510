"""Times of the multi-push tree, next to scipy's Dijkstra in the same run: pytest benchmarks/test_tree.py -n 0 -s.

Nothing is asserted about time. Three pushes at a triangle of 59 × 28.5 mm, as in [Zhou2017] Fig. 9. scipy's time has
two parts, the weights of all edges (with our batch of Dubins lengths) and its Dijkstra on them; it gets the collapsed
graph, one node for each pose and push in hand.
"""

import subprocess
import sys

import numpy as np
import pytest

from flatpush.geometry import compose
from flatpush.planning.graph import build_tree, pose_samples, query
from flatpush.steering import dubins
from flatpush.steering.fleet import Fleet

GOAL = np.zeros(3)
REGION = [-0.206, -0.107, 0.206, 0.107]
MIDDLES = np.array([[0.0, 0.0297], [-0.0328, 0.0782], [0.0140, -0.0290]])
HEADINGS = np.deg2rad([90.0, 192.1, -64.2])
RADII = np.array([0.0990, 0.1119, 0.1075])
KINDS = ("flat", "tilted", "pusher", "time")
STARTS = pose_samples(50, GOAL, 0.1, seed=9)


def fleet_of(kind: str) -> Fleet:
    """Dubins cars with the flat cost; straight directions tilted by 10°; the way of a pusher; and its time."""
    across = np.column_stack([-np.sin(HEADINGS), np.cos(HEADINGS)]) * RADII[:, None]
    ahead = HEADINGS + (np.deg2rad(10) if kind == "tilted" else 0.0)
    rates = np.column_stack([RADII, np.ones(3), RADII])
    if kind in ("pusher", "time"):
        rates[:, [0, 2]] *= 1.15
    free = np.full((3, 3), np.inf)
    return Fleet(
        MIDDLES + across,
        MIDDLES - across,
        np.column_stack([np.cos(ahead), np.sin(ahead)]),
        rates,
        np.full((3, 3), 0.02) if kind == "time" else free,
        np.full((3, 3), 0.1) if kind == "time" else free,
        (2.0 if kind == "time" else 0.01) * (1 - np.eye(3)),
    )


def tell(benchmark, what, unit=1e3, name="ms"):
    if benchmark.stats is not None:
        best, median = benchmark.stats.stats.min, benchmark.stats.stats.median
        print(f"\n{what}: {unit * best:.4g} {name} at best, {unit * median:.4g} {name} median")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [2000, 8000])
def test_tree(benchmark, kind, count):
    fleet, poses = fleet_of(kind), pose_samples(count, GOAL, REGION)
    build_tree(fleet, poses[:10], GOAL)
    benchmark.pedantic(build_tree, (fleet, poses, GOAL), rounds=5 if count == 2000 else 3)
    tell(benchmark, f"tree, {count} poses × 3 pushes, {kind}")


def test_scipy_at_2000_poses(benchmark):
    """The peer of test_tree[2000-flat], with the same costs."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    fleet, poses = fleet_of("flat"), pose_samples(2000, GOAL, REGION)
    k, n = 3, len(poses)

    def costs():
        X = np.vstack([poses, GOAL])
        graph = np.zeros((k * n + 1, k * n + 1))  # turned round: row = where an edge ends
        for a in range(k):
            Z = compose(X, [*MIDDLES[a], HEADINGS[a]])
            lengths = dubins.shortest_length(Z[None], Z[:, None], RADII[a])
            graph[a * n : a * n + n, a * n : a * n + n] = lengths[:n, :n]
            graph[-1, a * n : a * n + n] = lengths[n, :n]
            for b in set(range(k)) - {a}:
                graph[a * n + np.arange(n), b * n + np.arange(n)] = fleet.switching[b, a]
        return dijkstra(csr_array(graph), indices=k * n)[:-1].reshape(k, n)

    W = benchmark.pedantic(costs, rounds=2)
    np.testing.assert_allclose(build_tree(fleet, poses, GOAL).arrived, W, atol=1e-9)
    tell(benchmark, "weights and scipy's Dijkstra, 2000 poses × 3 pushes, flat")


@pytest.mark.parametrize("kind", KINDS)
def test_query(benchmark, kind):
    """The best 30 sequences of pushes, 8000 poses."""
    tree = build_tree(fleet_of(kind), pose_samples(8000, GOAL, REGION), GOAL)
    query(tree, STARTS[0])

    def ask():
        for start in STARTS:
            query(tree, start)

    benchmark.pedantic(ask, rounds=5)
    tell(benchmark, f"query, 8000 poses × 3 pushes, {kind}", 1e3 / len(STARTS))


MEMORY = """
import sys
sys.path.insert(0, "benchmarks")
import test_tree as t
fleet = t.fleet_of("flat")
t.build_tree(fleet, t.pose_samples(10, t.GOAL, t.REGION), t.GOAL)
def most():
    with open("/proc/self/status") as status:
        return next(line.split()[1] for line in status if line.startswith("VmHWM"))
before = most()
tree = t.build_tree(fleet, t.pose_samples(20000, t.GOAL, t.REGION), t.GOAL)
t.query(tree, t.STARTS[0])
print(before, most())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_memory_at_20000_poses(benchmark, request):
    def run():
        ended = subprocess.run(
            [sys.executable, "-c", MEMORY],
            cwd=request.config.rootpath,
            capture_output=True,
            text=True,
            check=True,
        )
        return [int(word) / 1024 for word in ended.stdout.split()]

    before, after = benchmark.pedantic(run, rounds=1)
    print(f"\nmost memory, 20,000 poses × 3 pushes: {after:.0f} MB, {after - before:.0f} more than before")
