"""Seeds: the best plan of every short push sequence over one pool of poses, as starts for the descent."""

from collections.abc import Callable

import numpy as np

from ...geometry import compose, exp
from ...geometry.pose import Array
from .problem import Candidate, Sequences, joined

MOST_SUMS = 3_000_000  # sums of one table cell and a cost to go, per pool: bounds the size of the table
MOST_CELLS = 10_000  # of the table of cars that are not Dubins cars
TAILS = 16  # pairs of pushes that longer sequences may end with
MOST_TRIPLES = 800  # sequences of three pushes solved per round after a random first arc
ARC_SEEDS = 24
Choice = tuple[float, tuple[int, ...], tuple[int, ...]]  # cost, pushes, poses of the pool
QUOTAS = {2: 16, 3: 20, 4: 14}  # seeds by number of legs


def sample_poses(sequences: Sequences, rng: np.random.Generator, count: int, near: list[Array]) -> Array:
    """Poses where switching may pay, shape (count, 3).

    Half of them around start and goal, the others one or two arcs away from the start or before the goal (good plans
    have few arcs), and some near the switch poses `near` (n, 3) of plans that are good already.
    """
    fleet, start, goal = sequences.fleet, sequences.start, sequences.goal
    reach = 1.6 * float(np.median(fleet.radius))
    local = count // 4 if near else 0
    driven = (count - local) // 2
    low = np.minimum(start, goal)[:2] - reach
    high = np.maximum(start, goal)[:2] + reach
    free = count - local - driven
    parts = [np.column_stack([rng.uniform(low, high, (free, 2)), rng.uniform(-np.pi, np.pi, free)])]
    half = driven // 2
    for origins, sense, size in ((start[None], 1.0, half), (sequences.endpoints, -1.0, driven - half)):
        pushes = rng.integers(fleet.size, size=size)
        poses = origins[np.arange(size) % len(origins)]
        for _ in range(2):
            poses = compose(poses, exp(sense * _arcs(sequences, rng, pushes)))
        parts.append(poses)
    if local:
        centres = np.concatenate(near)[rng.integers(sum(map(len, near)), size=local)]
        spread = np.array([0.2, 0.2, 0.25]) * np.array([np.median(fleet.radius)] * 2 + [1.0])
        parts.append(centres + spread * rng.normal(size=(local, 3)))
    return np.concatenate(parts)


def pool_seeds(sequences: Sequences, poses: Array, legs: int) -> list[Candidate]:
    """The best sequences of two to `legs` pushes, at most four, whose switch poses are in the pool; cheapest first."""
    fleet = sequences.fleet
    k, sigma = fleet.size, fleet.switching
    if k < 2 or legs < 2:
        return []
    first = sequences.table(sequences.start[None], poses)[:, 0, :]  # (k, m)
    every = sequences.table(poses, sequences.endpoints)  # (k, m, e)
    nearest = np.argmin(every, axis=2)  # the end that each push best goes to
    last = np.take_along_axis(every, nearest[..., None], axis=2)[..., 0]
    pairs = np.array([(i, j) for i in range(k) for j in range(k) if i != j and np.isfinite(sigma[i, j])])
    pairs = pairs.reshape(-1, 2)
    a, b = pairs.T
    ends, sums = _least(first[a] + last[b])
    chosen = _keep(sums + sigma[a, b], lambda t: (tuple(pairs[t].tolist()), (int(ends[t]),)), 2)
    if legs > 2:
        inner = _promising(first.min(axis=0), last.min(axis=0), k, sequences.flat)
        first, last = first[:, inner], last[:, inner]
        table = sequences.table(poses[inner], poses[inner])
        # Of tails (a, b): the cost from each pose, and the pose where a ends.
        ends, to_go = np.empty((len(pairs), len(inner)), dtype=int), np.empty((len(pairs), len(inner)))
        for t, (one, two) in enumerate(pairs.tolist()):
            ends[t], to_go[t] = _least(table[one] + last[two])
        to_go += sigma[a, b][:, None]
        order = np.argsort(np.min(to_go + first.min(axis=0), axis=1), kind="stable")[:TAILS]
        pairs, ends, to_go = pairs[order], ends[order], to_go[order]
        before = np.where(np.eye(k) > 0, np.inf, sigma)[
            :, pairs[:, 0]
        ].T  # of a push and a tail, shape (t, k)
        at, three = _least(first + to_go[:, None])

        def of_three(n: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
            t, j = divmod(n, k)
            m = at[t, j]
            return (j, *pairs[t].tolist()), (int(inner[m]), int(inner[ends[t, m]]))

        chosen += _keep((three + before).ravel(), of_three, 3)
        if legs > 3:
            nexts, longer = (
                np.empty((len(pairs), k, len(inner)), dtype=int),
                np.empty((len(pairs), k, len(inner))),
            )
            sums = np.empty_like(table)
            for t in range(len(pairs)):
                nexts[t], longer[t] = _least(np.add(table, to_go[t], out=sums))
            longer += before[:, :, None]
            start, four = _least(first[:, None] + longer[:, None])  # (t, i, j)
            switch = np.where(np.eye(k) > 0, np.inf, sigma)

            def of_four(n: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
                t, i, j = n // (k * k), n // k % k, n % k
                m = start[t, i, j]
                then = nexts[t, j, m]
                via = (int(inner[m]), int(inner[then]), int(inner[ends[t, then]]))
                return (i, j, *pairs[t].tolist()), via

            chosen += _keep((four + switch).ravel(), of_four, 4)
    seeds = [
        Candidate(
            cost,
            np.array(pushes),
            np.concatenate(
                [[sequences.start], poses[list(via)], sequences.endpoints[[nearest[pushes[-1], via[-1]]]]]
            ),
        )
        for cost, pushes, via in chosen
    ]
    return sorted(seeds, key=lambda seed: seed.cost)


def arc_seeds(sequences: Sequences, rng: np.random.Generator, plain: bool) -> list[Candidate]:
    """Plans of three arcs, of one push each (if `plain`: they are always the same), and such plans after a random first
    arc; the cheapest of each sequence.

    Where the best plan has as few arcs as there are equations it is isolated, and a descent hardly finds it.
    """
    from .three_arcs import three_arcs

    fleet, k = sequences.fleet, sequences.fleet.size
    switching = np.ascontiguousarray(fleet.switching, dtype=float)
    count = max(0 if plain else 1, MOST_TRIPLES // k**3)
    pushes = rng.integers(k, size=count)
    starts = compose(sequences.start, exp(_arcs(sequences, rng, pushes)))
    ends = sequences.endpoints
    ends = ends[np.zeros(count, int) if len(ends) == 1 else rng.integers(len(ends), size=count)]
    if plain:  # first of all those without an arc before
        starts, ends = (
            np.concatenate([x[None], y])
            for x, y in ((sequences.start, starts), (sequences.endpoints[0], ends))
        )
    costs, poses = np.empty((len(starts), k**3)), np.empty((len(starts), k**3, 2, 3))
    three_arcs(sequences.cars, switching, starts, ends, costs, poses)
    found: list[tuple[float, int, int]] = []
    for n, order in enumerate(np.argsort(costs, axis=1)):
        first = n - int(plain)
        begun, switched = 0.0, np.zeros(k)
        if first >= 0:
            begun = sequences.chain(pushes[[first]], np.array([sequences.start, starts[n]]))[0]
            switched = switching[pushes[first]]
        best = order[: ARC_SEEDS if first < 0 else 4]
        cost = begun + costs[n, best] + switched[best // (k * k)]
        found += zip(cost.tolist(), [n] * len(best), best.tolist(), strict=True)
    found.sort(key=lambda plan: plan[0])
    seeds: dict[tuple[int, ...], Candidate] = {}
    for cost, n, triple in found[: 2 * ARC_SEEDS]:
        via = (sequences.start, *poses[n, triple], ends[n])
        sequence = [triple // (k * k), triple // k % k, triple % k]
        if n >= int(plain):
            via, sequence = (sequences.start, starts[n], *via[1:]), [int(pushes[n - int(plain)]), *sequence]
        seed = Candidate(cost, *joined(np.array(sequence), np.array(via)))
        if np.isfinite(cost) and seed.key not in seeds:
            seeds[seed.key] = seed
        if len(seeds) == ARC_SEEDS:
            break
    return list(seeds.values())


def _arcs(sequences: Sequences, rng: np.random.Generator, pushes: np.ndarray) -> Array:
    """One random arc of each push, as a body displacement's logarithm, shape (n, 3)."""
    fleet, n = sequences.fleet, len(pushes)
    motion = rng.integers(3, size=n)
    turn = np.where(motion == 0, 1.0, -1.0) * rng.exponential(0.6, n)
    centre = np.where((motion == 0)[:, None], fleet.left[pushes], fleet.right[pushes])
    about = np.column_stack([turn * centre[:, 1], -turn * centre[:, 0], turn])
    way = rng.exponential(0.7, n) * fleet.radius[pushes]
    along = np.column_stack([way[:, None] * fleet.direction[pushes], np.zeros(n)])
    return np.where((motion == 1)[:, None], along, about)


def _least(sums: Array) -> tuple[np.ndarray, Array]:
    """Where along the last axis it is least, the first of equal ones, and the least."""
    at = np.argmin(sums, axis=-1)
    return at, np.take_along_axis(sums, at[..., None], axis=-1)[..., 0]


def _promising(first: Array, last: Array, k: int, flat: bool) -> np.ndarray:
    """Indices of poses that lie well between start and goal, or near either."""
    size = int(min(len(first), np.sqrt(MOST_SUMS / (k * (k + TAILS)))))
    size = min(size, 260 if flat else int(np.sqrt(MOST_CELLS / k)))
    if size >= len(first):
        return np.arange(len(first))
    order = [
        np.argsort(first + last, kind="stable"),
        np.argsort(first, kind="stable"),
        np.argsort(last, kind="stable"),
    ]
    picked = np.concatenate([order[0][: size // 2], order[1][: size // 4], order[2][: size // 4]])
    return np.unique(picked)


def _keep(
    costs: Array, choice: Callable[[int], tuple[tuple[int, ...], tuple[int, ...]]], legs: int
) -> list[Choice]:
    """The cheapest, with the pushes and the poses of the pool that a choice is made of."""
    count = min(QUOTAS[legs], int(np.count_nonzero(np.isfinite(costs))))
    if count == 0:
        return []
    most = np.partition(costs, count - 1)[count - 1]
    found = [(float(costs[n]), *choice(n)) for n in np.flatnonzero(costs <= most).tolist()]
    return sorted(found)[:count]
