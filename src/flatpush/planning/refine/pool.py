"""Seeds: the best plan of every short push sequence over one pool of poses, as starts for the descent."""

import numpy as np

from ...geometry import compose, exp
from ...geometry.pose import Array
from .problem import Candidate, Sequences

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
    found: list[Choice] = []
    pairs = _pairs(sigma)
    for i, j in pairs:
        sums = first[i] + last[j]
        m = int(np.argmin(sums))
        found.append((float(sums[m]) + sigma[i, j], (i, j), (m,)))
    chosen = _keep(found, 2)
    if legs > 2:
        inner = _promising(first.min(axis=0), last.min(axis=0), k, sequences.flat)
        first, last = first[:, inner], last[:, inner]
        table = sequences.table(poses[inner], poses[inner])
        to_go = []  # of tails (l, n): cost from each pose, and the pose where l ends
        for a, b in pairs:
            sums = table[a] + last[b]
            ends = np.argmin(sums, axis=1)
            to_go.append(((a, b), np.take_along_axis(sums, ends[:, None], 1)[:, 0] + sigma[a, b], ends))
        to_go.sort(key=lambda tail: float(np.min(tail[1] + first.min(axis=0))))
        three: list[Choice] = []
        four: list[Choice] = []
        for (a, b), cost, ends in to_go[:TAILS]:
            for j in range(k):
                if j == a or not np.isfinite(sigma[j, a]):
                    continue
                sums = table[j] + cost
                nexts = np.argmin(sums, axis=1)
                longer = np.take_along_axis(sums, nexts[:, None], 1)[:, 0] + sigma[j, a]
                both = first[j] + cost
                m = int(np.argmin(both))
                three.append((float(both[m]) + sigma[j, a], (j, a, b), (inner[m], inner[ends[m]])))
                for i in range(k if legs > 3 else 0):
                    if i == j or not np.isfinite(sigma[i, j]):
                        continue
                    both = first[i] + longer
                    m = int(np.argmin(both))
                    via = (inner[m], inner[nexts[m]], inner[ends[nexts[m]]])
                    four.append((float(both[m]) + sigma[i, j], (i, j, a, b), via))
        chosen += _keep(three, 3) + _keep(four, 4)
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
    prefixes = max(0 if plain else 1, MOST_TRIPLES // k**3)
    pushes = rng.integers(k, size=prefixes)
    starts = compose(sequences.start, exp(_arcs(sequences, rng, pushes)))
    ends = sequences.endpoints[
        np.zeros(prefixes, int)
        if len(sequences.endpoints) == 1
        else rng.integers(len(sequences.endpoints), size=prefixes)
    ]
    found: list[tuple[float, tuple[int, ...], Array]] = []
    costs, poses = np.empty(k**3), np.empty((k**3, 2, 3))
    for prefix in range(-1 if plain else 0, prefixes):
        first: tuple[int, ...] = () if prefix < 0 else (int(pushes[prefix]),)
        start = sequences.start if prefix < 0 else starts[prefix]
        before = (
            0.0
            if prefix < 0
            else sequences.candidate(pushes[[prefix]], np.array([sequences.start, start])).cost
        )
        end = sequences.endpoints[0] if prefix < 0 else ends[prefix]
        three_arcs(sequences.cars, switching, start, end, costs, poses)
        for triple in np.argsort(costs)[: ARC_SEEDS if prefix < 0 else 4]:
            i, j, h = triple // (k * k), triple // k % k, triple % k
            cost = before + costs[triple] + (fleet.switching[first[0], i] if first else 0.0)
            if np.isfinite(cost):
                via = np.concatenate([starts[[prefix]] if first else starts[:0], poses[triple], [end]])
                found.append((float(cost), (*first, int(i), int(j), int(h)), via))
    found.sort(key=lambda plan: plan[0])
    seeds: dict[tuple[int, ...], Candidate] = {}
    for _, sequence, via in found[: 2 * ARC_SEEDS]:
        seed = sequences.merged(np.array(sequence), np.concatenate([[sequences.start], via]))
        if seed.key not in seeds:
            seeds[seed.key] = seed
    return list(seeds.values())[:ARC_SEEDS]


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


def _pairs(sigma: Array) -> list[tuple[int, int]]:
    k = len(sigma)
    return [(i, j) for i in range(k) for j in range(k) if i != j and np.isfinite(sigma[i, j])]


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


def _keep(found: list[Choice], legs: int) -> list[Choice]:
    return sorted(found)[: QUOTAS[legs]]
