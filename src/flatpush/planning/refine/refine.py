"""Plans of many pushes, improved until the cost stops falling.

A local descent is cheap (a tenth of a millisecond) but ends where it began: what matters is to begin with many
different push sequences. Each round draws a pool of poses, takes the best plan of every short sequence over the pool,
shakes and varies the best plans so far, sends them all downhill for a few steps and the better ones to the end.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from ..query import Query
from .pool import arc_seeds, pool_seeds, sample_poses
from .problem import Candidate, Sequences, joined

ROUNDS = 3
POOL = 1600  # poses of a round's pool, for Dubins cars; a third of it for others, whose tables take longer
KEPT = 40  # sequences remembered
FINISHED, SHAKEN = 14, 8  # plans a round sends downhill to the end; plans it shakes
SETTLED = 4  # plans a round of a robust search moves to where replanning costs least
SHAKES = ((0.05, 4), (0.3, 2))  # how far, in radii and radians, and how often
LEAST = 5e-3


@dataclass(frozen=True, eq=False)
class Refined:
    """A plan of one or more pushes.

    Attributes:
        cost: of legs and switching, in the fleet's unit.
        cost_before: the same of the best seed, or of the best single push if that is cheaper or there is none.
        replanning_cost: mean cost when every switch pose is missed by 0.2 mm and 0.2°, over sixteen fixed
            displacements, and the next push is planned again from there to where it was to end. Plans like to sit on
            jumps of the shortest lengths, and there this is much dearer.
        pushes: index of the push of every leg, shape (n,).
        poses: X_WO at the start, at every switch and at the goal, shape (n + 1, 3).
        words: of every leg, such as "LSR" (see steering.three_twist).
        amounts: angle [rad] or length [m] of each piece, shape (n, 3).
        rounds: how many have been searched.
    """

    cost: float
    cost_before: float
    replanning_cost: float
    pushes: np.ndarray
    poses: Array
    words: tuple[str, ...]
    amounts: Array
    rounds: int


def refine(
    query: Query,
    seeds: Iterable[tuple[ArrayLike, ArrayLike]] = (),
    *,
    rounds: int = ROUNDS,
    seed: int = 0,
    least: float = LEAST,
    legs: int = 4,
) -> Refined:
    """The best plan found in a number of rounds; see improvements, whose last answer it is."""
    if rounds < 0:
        raise InputError("the number of rounds is 0 or more", value=rounds)
    found = improvements(query, seeds, seed=seed, least=least, legs=legs)
    return list(islice(found, rounds + 1))[-1]


def improvements(
    query: Query,
    seeds: Iterable[tuple[ArrayLike, ArrayLike]] = (),
    *,
    seed: int = 0,
    least: float = LEAST,
    legs: int = 4,
) -> Iterator[Refined]:
    """The best plan so far, at once from the seeds and then after every round; endless, and never worse than before.

    Args:
        query: start, goal and fleet; a robust one minimises replanning_cost instead of cost. Its world is left out.
        seeds: plans to start from: indices of pushes (n,), and poses at the start, at every switch and at the goal
            (n + 1, 3), the ends being replaced by start and goal. More are found without being asked for.
        seed: of everything random.
        least: shortest flat path of a leg in a plan of several pushes [m]; searches love useless pushes.
        legs: most pushes of the sequences that are tried on their own account, up to 4.

    Raises:
        InputError: for seeds that do not fit the query, or a negative `least`.
    """
    sequences = Sequences.of(query, least)
    candidates = [_seed(sequences, *given) for given in seeds]
    return _search(sequences, candidates, query.robust, np.random.default_rng(seed), min(legs, 4))


def _search(
    sequences: Sequences, seeds: list[Candidate], robust: bool, rng: np.random.Generator, legs: int
) -> Iterator[Refined]:
    direct = sequences.direct()
    before = min([direct, *seeds], key=_cost)
    known: dict[tuple[int, ...], Candidate] = {}
    for found in (direct, *seeds):
        _remember(known, found)
    best = min(known.values(), key=sequences.replanning if robust else _cost)
    settled: set[float] = set()
    done = 0
    while True:
        yield _answer(sequences, best, before.cost, done)
        ranked = sorted(known.values(), key=_cost)
        if sequences.fleet.size > 1 or seeds:
            near = [found.poses[1:-1] for found in ranked[:6] if len(found.pushes) > 1]
            size = POOL if sequences.flat else POOL // 3
            starts = pool_seeds(sequences, sample_poses(sequences, rng, size, near), legs)
            starts += arc_seeds(sequences, rng, done == 0)
            starts += _variations(sequences, ranked, rng)
            if done == 0:
                starts += [shorter for s in seeds for shorter in (s, *_without(sequences, s))]
            _downhill(sequences, starts, known)
        ranked = sorted(known.values(), key=_cost)
        known = {found.key: found for found in ranked[:KEPT]}
        if robust:
            best = _settled(sequences, best, ranked, settled)
        else:
            best = min([best, ranked[0]], key=_cost)
        done += 1


def _settled(
    sequences: Sequences, best: Candidate, ranked: list[Candidate], settled: set[float]
) -> Candidate:
    """The best by the cost of replanning, after some of the cheapest plans have been moved for that."""
    value = sequences.replanning(best)
    count = 0
    for found in ranked:
        if found.cost >= value or count == SETTLED:
            break
        if len(found.pushes) == 1 or found.cost in settled:
            continue
        settled.add(found.cost)
        count += 1
        moved = sequences.settle(found)
        replanned = sequences.replanning(moved)
        if np.isfinite(moved.cost) and replanned < value:
            best, value = moved, replanned
    return best


def _answer(sequences: Sequences, found: Candidate, before: float, rounds: int) -> Refined:
    _, words = sequences.chain(found.pushes, found.poses)
    return Refined(
        found.cost,
        before,
        sequences.replanning(found),
        found.pushes,
        found.poses,
        tuple("".join("LSR"[letter] for letter in word) for word in words["letter"].tolist()),
        words["amount"].copy(),
        rounds,
    )


def _cost(found: Candidate) -> float:
    return found.cost


def _downhill(sequences: Sequences, starts: list[Candidate], known: dict[tuple[int, ...], Candidate]) -> None:
    """A few steps for all, the whole way for the most promising; the best of every sequence is remembered."""
    tried = [sequences.descend(s, 1, 25) for s in starts if len(s.pushes) > 1]
    tried.sort(key=_cost)
    finished, seen = 0, set[int]()
    for found in tried:
        mark = round(found.cost * 1e7) if np.isfinite(found.cost) else 0
        if finished < FINISHED and mark and mark not in seen:
            seen.add(mark)
            found = sequences.descend(found, 6, 80)
            finished += 1
            for shorter in _without(sequences, found):
                _remember(known, sequences.descend(shorter, 2, 40) if len(shorter.pushes) > 1 else shorter)
        _remember(known, found)


def _remember(known: dict[tuple[int, ...], Candidate], found: Candidate) -> None:
    if np.isfinite(found.cost) and (found.key not in known or found.cost < known[found.key].cost):
        known[found.key] = found


def _without(sequences: Sequences, found: Candidate) -> list[Candidate]:
    """The plan without one of its legs, where that is not much dearer; equal neighbours become one leg."""
    shorter = []
    for i in range(len(found.pushes) if len(found.pushes) > 1 else 0):
        pushes = found.pushes[np.arange(len(found.pushes)) != i]
        for gone in {max(i, 1), min(i + 1, len(found.pushes) - 1)}:
            merged = sequences.merged(pushes, found.poses[np.arange(len(found.poses)) != gone])
            if merged.cost < 1.2 * found.cost:
                shorter.append(merged)
    return shorter


def _variations(sequences: Sequences, ranked: list[Candidate], rng: np.random.Generator) -> list[Candidate]:
    """The best plans with their switch poses shaken, one push replaced, or one put in between."""
    fleet, radius = sequences.fleet, float(np.median(sequences.fleet.radius))
    found = []
    for plan in ranked[:SHAKEN]:
        n = len(plan.pushes)
        if n > 1:
            for far, times in SHAKES:
                for _ in range(times):
                    poses = plan.poses.copy()
                    poses[1:-1] += far * np.array([radius, radius, 1.0]) * rng.normal(size=(n - 1, 3))
                    found.append(Candidate(plan.cost, plan.pushes, poses))
        if fleet.size < 2:
            continue
        pushes = plan.pushes.copy()
        pushes[rng.integers(n)] = rng.integers(fleet.size)
        if n > 1:
            found.append(Candidate(np.inf, *joined(pushes, plan.poses)))
        if n < 8:
            i, push = int(rng.integers(n + 1)), int(rng.integers(fleet.size))
            at = plan.poses[i] + 0.15 * np.array([radius, radius, 1.0]) * rng.normal(size=3)
            poses = np.insert(plan.poses, min(max(i, 1), n), at, axis=0)
            found.append(Candidate(np.inf, *joined(np.insert(plan.pushes, i, push), poses)))
    return [plan for plan in found if np.isfinite(sequences.switching(plan.pushes))]


def _seed(sequences: Sequences, pushes: ArrayLike, poses: ArrayLike) -> Candidate:
    sequence, X = np.asarray(pushes), np.array(poses, dtype=float)
    if sequence.ndim != 1 or len(sequence) == 0 or not np.issubdtype(sequence.dtype, np.integer):
        raise InputError("the pushes of a seed are one or more indices", value=pushes)
    if np.any(sequence < 0) or np.any(sequence >= sequences.fleet.size):
        raise InputError(
            f"the pushes of a seed are indices from 0 to {sequences.fleet.size - 1}", value=pushes
        )
    if X.shape != (len(sequence) + 1, 3) or not np.isfinite(X).all():
        raise InputError("a seed of n pushes has n + 1 finite poses", value=poses)
    X[0], X[-1] = sequences.start, sequences.goal
    merged = sequences.merged(sequence.astype(np.int64), X)
    if len(merged.pushes) > 12:
        raise InputError("a seed has at most 12 pushes", value=len(merged.pushes))
    return merged
