"""The compiled tree against its plain twin, scipy's Dijkstra, and all paths of tiny graphs."""

from itertools import groupby, product

import numpy as np
import pytest

from flatpush.geometry import compose
from flatpush.planning.graph import build_tree, leg_cost, pose_samples, query
from flatpush.planning.graph.plain import edge_cost, edge_table, plain_tree
from flatpush.steering.fleet import Fleet

GOAL = np.array([0.02, -0.01, 0.4])
EXACT = 3e-9  # [m, s] two codes of the same formulas, which accept words within 4e-10 of the goal


def fleet_of(k: int, kind: str, seed: int = 0, switching: float | np.ndarray = 0.03) -> Fleet:
    """Random cars: "dubins", "tilted" centres with the flat cost, "pusher" rates, or "time"."""
    rng = np.random.default_rng(seed)
    middle, turn = rng.uniform(-0.05, 0.05, (k, 2)), rng.uniform(-np.pi, np.pi, k)
    R = rng.uniform(0.02, 0.1, k)
    across = np.column_stack([-np.sin(turn), np.cos(turn)])
    tilt = np.zeros(k) if kind == "dubins" else rng.uniform(-0.5, 0.5, k)
    direction = np.column_stack([np.cos(turn + tilt), np.sin(turn + tilt)])
    rates = np.column_stack([R, np.ones(k), R])
    if kind in ("pusher", "time"):
        rates = np.column_stack([R * rng.uniform(0.8, 1.6, k), np.ones(k), R * rng.uniform(1.0, 1.7, k)])
    speeds = rng.uniform(0.015, 0.02, (k, 3)) if kind == "time" else np.full((k, 3), np.inf)
    accelerations = rng.uniform(0.05, 0.1, (k, 3)) if kind == "time" else np.full((k, 3), np.inf)
    cost = np.asarray(switching, dtype=float) * (0.05 / 0.003 if kind == "time" else 1.0)
    matrix = np.where(np.eye(k) > 0, 0.0, cost) if cost.ndim == 0 else cost
    return Fleet(
        middle + R[:, None] * across,
        middle - R[:, None] * across,
        direction,
        rates,
        speeds,
        accelerations,
        matrix,
    )


def random_costs(k: int, seed: int) -> np.ndarray:
    costs = np.random.default_rng(seed).uniform(0.0, 0.1, (k, k))
    np.fill_diagonal(costs, 0.0)
    return costs


@pytest.mark.parametrize(
    ("kind", "count", "seed"),
    [("dubins", 500, 0), ("dubins", 120, 1), ("tilted", 26, 0), ("pusher", 26, 1), ("time", 26, 2)],
)
def test_the_tree_is_its_plain_twins(kind, count, seed):
    fleet = fleet_of(3, kind, seed)
    poses = pose_samples(count, GOAL, 0.2, seed)
    tree = build_tree(fleet, poses, GOAL)
    table = edge_table(fleet, poses, GOAL)
    V, W = plain_tree(table, fleet.switching)
    np.testing.assert_allclose(tree.arrived, W, atol=EXACT)
    # A Dubins tree leaves out pushes that come back to where they began, in 2π R or more (Fenchel).
    loop = (W + 2 * np.pi * fleet.radius[:, None] < V) if kind == "dubins" else np.zeros(V.shape, dtype=bool)
    assert not loop.all()
    np.testing.assert_allclose(np.where(loop, 0, tree.costs), np.where(loop, 0, V), atol=EXACT)


@pytest.mark.parametrize("kind", ["dubins", "pusher"])
@pytest.mark.parametrize("seed", range(5))
def test_switching_costs_without_triangle_inequality(kind, seed):
    """A dear switch may be made by way of a third push, even on a loop; then every copy has to be relaxed."""
    costs = np.array([[0.0, 50.0, 0.01], [50.0, 0.0, 0.01], [0.01, 0.01, 0.0]])
    fleet = fleet_of(3, kind, seed, costs)
    poses = pose_samples(4, GOAL, 0.2, seed)
    tree = build_tree(fleet, poses, GOAL)
    V, W = plain_tree(edge_table(fleet, poses, GOAL), costs)
    np.testing.assert_allclose(tree.costs, V, atol=EXACT)
    np.testing.assert_allclose(tree.arrived, W, atol=EXACT)


@pytest.mark.parametrize("kind", ["dubins", "tilted", "pusher", "time"])
def test_followers_add_up_to_the_costs(kind):
    fleet = fleet_of(3, kind, 7)
    poses = pose_samples(20, GOAL, 0.2, 7)
    tree = build_tree(fleet, poses, GOAL)
    for a, j in product(range(3), range(20)):
        push, at, total = a, j, 0.0
        for _ in range(60):
            after = int(tree.follow[push, at])
            total += edge_cost(fleet, push, poses[at], poses[after] if after >= 0 else GOAL)
            if after < 0:
                break
            then = int(tree.take[push, after])
            total += fleet.switching[push, then]
            push, at = then, after
        assert total == pytest.approx(tree.costs[a, j], abs=EXACT)


@pytest.mark.parametrize("constant", [True, False])
def test_scipy_finds_the_same_costs(constant):
    """Copies (a, j) as nodes, edges turned round, one Dijkstra from the goal."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    k, n = 3, 60
    # Least costs from push to push obey the triangle inequality.
    costs = 0.02 * (1 - np.eye(k)) if constant else dijkstra(0.02 + random_costs(k, 1) - 0.02 * np.eye(k))
    fleet = fleet_of(k, "dubins", 2, costs)
    poses = pose_samples(n, GOAL, 0.2, 2)
    tree = build_tree(fleet, poses, GOAL)
    table = edge_table(fleet, poses, GOAL)
    rows, columns, weights = [], [], []

    def edge(start, end, weight):  # of the graph turned round
        rows.append(start)
        columns.append(end)
        weights.append(weight)

    for a, j in product(range(k), range(n)):
        edge(k * n, a * n + j, table[a, j, n])
        for b in range(k):
            for i in range(n):
                if i != j:
                    edge(b * n + i, a * n + j, table[a, j, i] + costs[a, b])
    graph = coo_array((weights, (rows, columns)), shape=(k * n + 1, k * n + 1)).tocsr()
    V = dijkstra(graph, indices=k * n)[: k * n].reshape(k, n)
    np.testing.assert_allclose(tree.arrived, np.min(V[None] + costs[:, :, None], axis=1), atol=EXACT)


@pytest.mark.parametrize("kind", ["dubins", "tilted", "time"])
@pytest.mark.parametrize("seed", range(3))
def test_all_paths_of_a_tiny_graph(kind, seed):
    """The answer to a query is the cheapest of all ways through three poses with all pushes."""
    k, n = 2, 3
    costs = random_costs(k, seed) * (10 if kind == "time" else 1)
    fleet = fleet_of(k, kind, seed, costs)
    poses = pose_samples(n, GOAL, 0.1, seed)
    tree = build_tree(fleet, poses, GOAL)
    for start in pose_samples(4, GOAL, 0.2, 100 + seed):
        X = np.vstack([start, poses, GOAL])
        edge = np.array([[[edge_cost(fleet, a, x, y) for y in X] for x in X] for a in range(k)])
        least = {}

        def walk(at, pushes, cost, seen, edge=edge, least=least):
            for a in range(k):
                more = cost + (costs[pushes[-1], a] if pushes else 0.0)
                sequence = pushes if pushes and pushes[-1] == a else (*pushes, a)
                total = more + edge[a, at, n + 1]
                least[sequence] = min(least.get(sequence, np.inf), total)
                for i in set(range(1, n + 1)) - seen:
                    walk(i, sequence, more + edge[a, at, i], seen | {i})

        walk(0, (), 0.0, set())
        ways = query(tree, start)
        assert ways[0].cost == pytest.approx(min(least.values()), abs=EXACT)
        for way in ways:  # each is a way through the graph, none better than the best of its sequence
            merged = tuple(
                p for p, before in zip(way.pushes, (None, *way.pushes[:-1]), strict=True) if p != before
            )
            assert way.cost >= least.get(merged, 0.0) - EXACT


@pytest.mark.parametrize("kind", ["dubins", "tilted", "pusher", "time"])
def test_no_bound_exceeds_a_cost(kind):
    """A bound that is too high would drop an edge without anybody noticing."""
    from flatpush.planning.graph.cars import axle_frames, car_table
    from flatpush.planning.graph.plain import edge_cost as cost_of

    for seed in range(30):
        fleet = fleet_of(1, kind, seed)
        table = car_table(fleet)[0]  # √ of a time that is rounding is about 1e-6 s
        poses = np.vstack(
            [
                pose_samples(12, GOAL, 0.3, seed),
                GOAL,
                GOAL + np.array([0.05, 0, 0]),
                GOAL + np.array([0, 0, np.pi]),
                compose(GOAL, [*(0.3 * fleet.direction[0]), 0]),
            ]
        )
        poses = np.vstack([poses, GOAL + 0.001 * (poses[:6] - GOAL), poses[0] + np.array([1e-14, 0, 0])])
        frames = axle_frames(fleet, poses)[0].T
        for i, j in product(range(len(poses)), repeat=2):
            bound = plain_bound(frames[i], frames[j], table)
            assert bound <= cost_of(fleet, 0, poses[i], poses[j]) + (1e-5 if kind == "time" else EXACT)


def plain_bound(start, goal, car):
    """As kernels._bound, which it calls compiled."""
    from flatpush.planning.graph import cars, kernels

    constants = [
        car[c]
        for c in (cars.WAY, cars.OFFSET, cars.TURNING, cars.SIGMA, cars.TILT, cars.FALL, cars.SIDE, cars.RISE)
    ]
    return kernels.delayed_bound(*start, *goal, *constants, car[cars.LATE])


@pytest.mark.parametrize("kind", ["dubins", "tilted", "pusher", "time"])
def test_leg_costs_are_those_of_the_words(kind):
    fleet = fleet_of(2, kind, 11)
    poses = pose_samples(12, GOAL, 0.2, 11)
    for X, Y in product(poses, poses):
        assert leg_cost(fleet, 1, X, Y) == pytest.approx(
            edge_cost(fleet, 1, X, Y), abs=1e-6 if kind == "time" else EXACT
        )


@pytest.mark.parametrize("kind", ["dubins", "tilted", "pusher", "time"])
def test_a_query_finds_the_best_of_every_sequence(kind):
    """All ways by one pose and then along the tree, sorted by their sequences of pushes."""
    k, n = 3, 16
    fleet = fleet_of(k, kind, 4, 0.3 * random_costs(k, 4))
    poses = pose_samples(n, GOAL, 0.2, 4)
    tree = build_tree(fleet, poses, GOAL)
    for start in pose_samples(6, GOAL, 0.2, 40):
        edge = np.array([[edge_cost(fleet, a, start, X) for X in (*poses, GOAL)] for a in range(k)])
        least = {(a,): edge[a, n] for a in range(k)}
        for i, b, j in product(range(k), range(k), range(n)):
            sequence = tree.sequence(tree.keys[i, b, j])
            cost = edge[i, j] + fleet.switching[i, b] + tree.costs[b, j]
            least[sequence] = min(least.get(sequence, np.inf), cost)
        ways = query(tree, start, 1000)
        found = {tuple(a for a, _ in groupby(way.pushes)): way for way in ways}
        assert found.keys() == least.keys()
        for sequence, way in found.items():
            assert way.cost <= least[sequence] + EXACT  # less where two legs with one push were joined
            legs = [
                edge_cost(fleet, *leg) for leg in zip(way.pushes, way.poses[:-1], way.poses[1:], strict=True)
            ]
            np.testing.assert_allclose(way.legs, legs, atol=EXACT)
        for count in (4, 12):
            assert [w.cost for w in query(tree, start, count)][:-1] == [w.cost for w in ways][: count - 1]
