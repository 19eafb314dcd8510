"""Refined plans of many pushes: legs, the descent, seeds, and what holds for every answer."""

from itertools import islice, pairwise, product

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.geometry import compose, exp, pose_error, rotate
from flatpush.planning.query import Query
from flatpush.planning.refine import improvements, refine
from flatpush.planning.refine.pool import arc_seeds, pool_seeds, sample_poses
from flatpush.planning.refine.problem import Sequences
from flatpush.planning.refine.three_arcs import three_arcs
from flatpush.steering import three_twist
from flatpush.steering.fleet import Fleet
from flatpush.steering.six_words import MOST_WORDS, WORD, every_word

GOAL = np.zeros(3)
SENSE = {"L": 0, "S": 1, "R": 2}


def fleet_of(k=3, switching=0.02, tilt=0.0, timed=False) -> Fleet:
    """k cars that push towards the middle from all sides; tilted ones are no Dubins cars."""
    angles = 2 * np.pi * np.arange(k) / k + 0.3
    radius = 0.06 + 0.01 * np.arange(k)
    ahead = rotate(angles, np.array([[1.0, 0.0]] * k))
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]]) * radius[:, None]
    direction = rotate(tilt * (1 + np.arange(k)), ahead)
    rates = np.column_stack([radius, np.ones(k), radius])
    free = np.full((k, 3), np.inf)
    speeds, accelerations = (np.full((k, 3), 0.02), np.full((k, 3), 0.1)) if timed else (free, free)
    matrix = np.where(np.eye(k) > 0, 0.0, switching)
    point = 0.02 * ahead
    return Fleet(point + aside, point - aside, direction, rates, speeds, accelerations, matrix)


KINDS = {
    "dubins": fleet_of(),
    "general": fleet_of(tilt=0.1),
    "time": fleet_of(tilt=0.1, timed=True, switching=1.5),
}


def random_poses(rng, count):
    return rng.uniform(-1, 1, (count, 3)) * [0.12, 0.12, np.pi]


def plain_time(way, v, a):
    """A way at the cost of itself (infinite speed), or from rest to rest: the area under a trapezoid or triangle."""
    if np.isinf(v) or way == 0:
        return way
    return way / v + v / a if way >= v * v / a else 2 * np.sqrt(way / a)


def plain_leg(fleet, push, start, goal):
    """The cheapest word, priced arc by arc; three_twist enumerates the words."""
    words = three_twist.words(fleet.left[push], fleet.right[push], fleet.direction[push], start, goal)

    def cost(letter, amount):
        k = SENSE[letter]
        return plain_time(fleet.rates[push, k] * amount, fleet.speeds[push, k], fleet.accelerations[push, k])

    return min(sum(cost(k, p) for k, p in zip(w.word, w.parameters, strict=True)) for w in words)


def one_arc(fleet, push, start, goal):
    """The cost of the one arc of a push that leads from a pose to another; inf if none does."""
    costs = [np.inf]
    for word in three_twist.words(fleet.left[push], fleet.right[push], fleet.direction[push], start, goal):
        arcs = [(k, p) for k, p in zip(word.word, word.parameters, strict=True) if p > 1e-6]
        if len(arcs) <= 1:
            costs.append(sum(fleet.rates[push, SENSE[k]] * p for k, p in arcs))
    return min(costs)


def plain_cost(fleet, plan):
    legs = (plain_leg(fleet, p, *plan.poses[i : i + 2]) for i, p in enumerate(plan.pushes))
    return sum(legs) + sum(fleet.switching[a, b] for a, b in zip(plan.pushes, plan.pushes[1:], strict=False))


@pytest.mark.parametrize("kind", KINDS)
def test_a_leg_costs_what_the_plain_words_cost(kind):
    fleet, rng = KINDS[kind], np.random.default_rng(1)
    sequences = Sequences.of(Query(fleet, GOAL, GOAL), 0.0)
    for start, goal in zip(random_poses(rng, 60), random_poses(rng, 60), strict=True):
        push = int(rng.integers(fleet.size))
        cost, (word,) = sequences.chain(np.array([push]), np.array([start, goal]))
        assert cost == word["cost"] == pytest.approx(plain_leg(fleet, push, start, goal), rel=1e-9)
        amounts = dict(zip("LSR", np.zeros(3), strict=True))
        for letter, amount in zip(word["letter"], word["amount"], strict=True):
            amounts["LSR"[letter]] += amount
        flat = amounts["S"] + fleet.radius[push] * (amounts["L"] + amounts["R"])
        assert word["flat"] == pytest.approx(flat, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_every_word_is_found_with_its_price(kind):
    """As three_twist lists them: names, amounts, prices, cheapest first; each ends at the goal when it is driven."""
    fleet, rng = KINDS[kind], np.random.default_rng(9)
    found = np.zeros(MOST_WORDS, WORD)
    for start, goal in zip(random_poses(rng, 30), random_poses(rng, 30), strict=True):
        count = every_word(fleet.cars, 1, start, goal, found)
        plain = three_twist.words(fleet.left[1], fleet.right[1], fleet.direction[1], start, goal)
        assert count == len(plain)
        assert np.all(np.diff(found["cost"][:count]) >= 0)
        left = plain
        for word in found[:count]:
            name = "".join("LSR"[letter] for letter in word["letter"])
            ways = fleet.rates[1, word["letter"]] * word["amount"]
            cost = sum(
                plain_time(w, fleet.speeds[1, k], fleet.accelerations[1, k])
                for w, k in zip(ways, word["letter"], strict=True)
            )
            assert word["cost"] == pytest.approx(cost, rel=1e-12)
            left = [w for w in left if w.word != name or np.abs(w.parameters - word["amount"]).max() >= 1e-8]
        assert not left  # each is found, not one of them twice


def test_a_leg_of_one_arc_has_no_spurious_turn():
    """The ends of good plans' legs are met by fewer arcs than three, and rounding then makes arcs of -1e-17."""
    fleet = KINDS["general"]
    sequences = Sequences.of(Query(fleet, GOAL, GOAL), 0.0)
    rng = np.random.default_rng(0)
    for start in random_poses(rng, 100):
        amount = rng.uniform(0.05, 1.5)
        for motion, centre in ((0, fleet.left[1]), (2, fleet.right[1])):
            sense = 1 - motion
            end = compose(start, exp(sense * amount * np.array([centre[1], -centre[0], 1.0])))
            cost, _ = sequences.chain(np.array([1]), np.array([start, end]))
            assert cost <= amount * fleet.rates[1, motion] + 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_answers_are_what_they_say(kind):
    fleet = KINDS[kind]
    for start in random_poses(np.random.default_rng(2), 3):
        found = refine(Query(fleet, start, GOAL), rounds=1)
        assert found.cost == pytest.approx(plain_cost(fleet, found), rel=1e-7)
        assert found.cost <= min(plain_leg(fleet, k, start, GOAL) for k in range(fleet.size)) * (1 + 1e-9)
        pose = start
        for push, word, amounts in zip(found.pushes, found.words, found.amounts, strict=True):
            driven = three_twist.Word(word, amounts, 0.0)
            pose = three_twist.end_pose(
                driven, fleet.left[push], fleet.right[push], fleet.direction[push], pose
            )
        assert np.abs(pose_error(pose, GOAL)).max() < 1e-9
        assert np.all(found.pushes[1:] != found.pushes[:-1])


@pytest.mark.parametrize("kind", KINDS)
def test_no_small_move_of_a_switch_pose_lowers_the_cost_much(kind):
    """After the descent the plan is a local minimum; a random probe in the plain cost finds nothing better."""
    fleet, rng = KINDS[kind], np.random.default_rng(3)
    found = refine(Query(fleet, [0.05, -0.04, 2.0], GOAL), rounds=2)
    assert len(found.pushes) > 1
    for _ in range(150):
        poses = found.poses.copy()
        poses[1:-1] += 10 ** rng.uniform(-4, -2) * rng.normal(size=(len(poses) - 2, 3)) * [0.1, 0.1, 1]
        legs = sum(plain_leg(fleet, p, *poses[i : i + 2]) for i, p in enumerate(found.pushes))
        moved = legs + sum(fleet.switching[found.pushes[:-1], found.pushes[1:]])
        assert moved > found.cost * (1 - 2e-4)


def test_a_descent_beats_a_general_optimiser():
    """Nelder and Mead's simplex, from the same switch poses, with the plain cost."""
    from scipy.optimize import minimize

    fleet, rng = KINDS["dubins"], np.random.default_rng(4)
    won = 0
    for start in random_poses(rng, 6):
        sequences = Sequences.of(Query(fleet, start, GOAL), 0.0)
        seed = pool_seeds(sequences, sample_poses(sequences, rng, 100, []), 2)[0]
        first, last = seed.pushes.tolist()

        def cost(x, first=first, last=last, start=start):
            return plain_leg(fleet, first, start, x) + plain_leg(fleet, last, x, GOAL) + 0.02

        assert seed.cost == pytest.approx(cost(seed.poses[1]), rel=1e-9)
        other = minimize(cost, seed.poses[1], method="Nelder-Mead", options={"maxfev": 150}).fun
        ours = sequences.descend(seed, 6, 80)
        assert ours.cost < seed.cost
        won += ours.cost <= other + 1e-6
    assert won >= 5


@pytest.mark.parametrize("motions", [(0, 2, 0), (2, 2, 0), (0, 1, 2), (1, 0, 2), (0, 2, 1)])
def test_three_arcs_of_three_pushes_are_found_exactly(motions):
    """Driven backwards from the goal; their cost is met, though none of the three can be moved on its own."""
    fleet, rng = KINDS["general"], np.random.default_rng(5)
    for _ in range(4):
        amounts = rng.uniform(0.2, 0.9, 3) * np.where(np.array(motions) == 1, 0.05, 1.0)
        pose, total = GOAL, 2 * 0.02
        for push in (2, 1, 0):
            motion = motions[push]
            centre = fleet.left[push] if motion == 0 else fleet.right[push]
            turn = (1 - motion) * np.array([centre[1], -centre[0], 1.0])
            twist = np.array([*fleet.direction[push], 0.0]) if motion == 1 else turn
            pose = compose(pose, exp(-amounts[push] * twist))
            total += amounts[push] * fleet.rates[push, motion]
        seeds = arc_seeds(Sequences.of(Query(fleet, pose, GOAL), 0.0), rng, True)
        assert seeds[0].cost <= total * (1 + 1e-9)
        assert refine(Query(fleet, pose, GOAL), rounds=1).cost <= total * (1 + 1e-9)


def test_three_arcs_cost_what_the_plain_words_between_their_poses_cost():
    """Each of the three legs is one arc by the plain words, and costs what that one costs."""
    fleet, rng = KINDS["general"], np.random.default_rng(6)
    starts, goals = random_poses(rng, 40), random_poses(rng, 40)
    sequences = Sequences.of(Query(fleet, GOAL, GOAL), 0.0)
    costs, poses = np.empty((40, 27)), np.empty((40, 27, 2, 3))
    three_arcs(sequences.cars, fleet.switching, starts, goals, costs, poses)
    checked = 0
    for start, goal, cost, between in zip(starts, goals, costs, poses, strict=True):
        for pushes in ((0, 1, 2), (1, 0, 2), (2, 1, 0)):
            triple = (pushes[0] * 3 + pushes[1]) * 3 + pushes[2]
            if np.isfinite(cost[triple]):
                legs = zip(pushes, pairwise([start, *between[triple], goal]), strict=True)
                own = sum(one_arc(fleet, push, *ends) for push, ends in legs)
                assert own + 2 * 0.02 == pytest.approx(cost[triple], rel=1e-6)
                checked += 1
    assert checked > 50


def test_legs_are_as_long_as_asked():
    fleet = fleet_of(switching=0.0)
    for least in (0.005, 0.03):
        found = refine(Query(fleet, [0.03, 0.02, 1.0], GOAL), rounds=2, least=least)
        flat = np.where(
            [[k == "S" for k in w] for w in found.words],
            found.amounts,
            found.amounts * fleet.radius[found.pushes, None],
        )
        assert len(found.pushes) > 1
        assert flat.sum(axis=1).min() >= least * (1 - 1e-6)


def test_answers_improve_and_repeat():
    fleet, start = KINDS["dubins"], [0.06, 0.02, 2.6]
    costs = [found.cost for found in islice(improvements(Query(fleet, start, GOAL)), 5)]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] == pytest.approx(min(plain_leg(fleet, k, start, GOAL) for k in range(3)))
    again, other = (refine(Query(fleet, start, GOAL), rounds=3, seed=seed) for seed in (0, 0))
    np.testing.assert_array_equal(again.poses, other.poses)
    assert again.cost == other.cost


def test_seeds_are_used_and_needless_switches_removed():
    fleet = fleet_of(k=2, switching=0.2)
    start = np.array([-0.15, -0.04, 0.1])
    single = refine(Query(fleet, start, GOAL), rounds=0)
    silly = ([0, 0, 1, 0], [start, [0.1, 0.1, 0.1], [0.0, 0.2, 1.0], [0.1, 0, 0], GOAL])
    found = refine(Query(fleet, start, GOAL), [silly], rounds=1)
    assert len(found.pushes) == 1
    assert found.cost == pytest.approx(single.cost)
    # Without other rounds the seed itself is the first answer where it is better.
    better = refine(Query(fleet_of(), [0.06, 0.02, 2.6], GOAL), rounds=2)
    first = refine(Query(fleet_of(), [0.06, 0.02, 2.6], GOAL), [(better.pushes, better.poses)], rounds=0)
    assert first.cost == pytest.approx(better.cost, rel=1e-9)
    assert first.cost_before == first.cost


def test_another_push_does_not_make_the_answer_worse():
    rng = np.random.default_rng(6)
    for start in random_poses(rng, 4):
        big = fleet_of(k=6)
        many = refine(Query(big, start, GOAL))
        part = Fleet(*(getattr(big, n)[:3] for n in ("left", "right", "direction", "rates", "speeds",
                                                       "accelerations")), big.switching[:3, :3])  # fmt: skip
        few = refine(Query(part, start, GOAL))
        assert many.cost <= 1.005 * few.cost


def test_robust_plans_are_cheaper_to_replan():
    fleet, start = KINDS["dubins"], [0.06, 0.02, 2.6]
    cheap, robust = (refine(Query(fleet, start, GOAL, robust=robust)) for robust in (False, True))
    assert robust.replanning_cost <= cheap.replanning_cost
    assert robust.replanning_cost < 1.05 * cheap.cost
    assert cheap.cost <= robust.cost


def test_forbidden_changes_are_not_made():
    fleet = fleet_of()
    fleet.switching[0, 1] = fleet.switching[1, 0] = np.inf
    for start in random_poses(np.random.default_rng(7), 3):
        found = refine(Query(fleet, start, GOAL), rounds=2)
        assert np.isfinite(found.cost)
        assert not {(0, 1), (1, 0)} & set(zip(found.pushes[:-1], found.pushes[1:], strict=True))


def test_one_push_alone_and_start_at_the_goal():
    fleet = fleet_of(k=1)
    found = refine(Query(fleet, [0.1, 0.0, 0.5], GOAL))
    assert found.cost == pytest.approx(plain_leg(fleet, 0, [0.1, 0.0, 0.5], GOAL))
    assert refine(Query(fleet_of(), GOAL, GOAL), rounds=1).cost == 0.0


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"start": [0, 0]}, "the start"),
        ({"goal": [0, 0, np.nan]}, "the goal"),
        ({"seeds": [([7], [GOAL, GOAL])]}, "indices from 0 to 2"),
        ({"seeds": [([0.5], [GOAL, GOAL])]}, "indices"),
        ({"seeds": [([0, 1], [GOAL, GOAL])]}, "n \\+ 1"),
        ({"least": -1.0}, "least length"),
        ({"rounds": -1}, "rounds"),
    ],
)
def test_bad_input(change, text):
    def asked(start=(0.1, 0, 0), goal=GOAL, **how):
        return refine(Query(fleet_of(), start, goal), **how)

    with pytest.raises(InputError, match=text):
        asked(**change)


@pytest.mark.parametrize("kind", ["dubins", "general"])
def test_pool_seeds_are_the_best_over_their_poses(kind):
    """Brute force over all sequences and all switch poses of a small pool."""
    fleet = KINDS[kind]
    start = np.array([0.06, 0.02, 2.6])
    sequences = Sequences.of(Query(fleet, start, GOAL), 0.0)
    poses = sample_poses(sequences, np.random.default_rng(8), 12, [])
    first, last = sequences.table(start[None], poses)[:, 0], sequences.table(poses, GOAL[None])[:, :, 0]
    inner = sequences.table(poses, poses)
    best = {}
    for i, j in product(range(3), repeat=2):
        if i != j:
            best[i, j] = np.min(first[i] + last[j]) + 0.02
            for h in set(range(3)) - {j}:
                best[i, j, h] = np.min(first[i][:, None] + inner[j] + last[h]) + 0.04
                for g in set(range(3)) - {h}:
                    tail = np.min(inner[j][:, :, None] + inner[h][None] + last[g], axis=(1, 2))
                    best[i, j, h, g] = np.min(first[i] + tail) + 0.06
    seeds = pool_seeds(sequences, poses, 4)
    assert [s.cost for s in seeds] == sorted(s.cost for s in seeds)
    assert len({s.key for s in seeds}) == len(seeds)
    for seed in seeds:
        if len(seed.pushes) < 4:  # of longer ones only promising tails are looked at
            assert seed.cost == pytest.approx(best[seed.key], rel=1e-9)
        assert seed.cost >= best[seed.key] * (1 - 1e-9)
        assert sequences.candidate(seed.pushes, seed.poses).cost <= seed.cost * (1 + 1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_replanning_costs_what_the_plain_words_cost(kind):
    """Mean over the sixteen displacements; the first leg starts where it starts."""
    fleet = KINDS[kind]
    sequences = Sequences.of(Query(fleet, np.array([0.06, 0.02, 2.6]), GOAL), 0.0)
    switch = np.array([0.05, -0.03, 0.4])
    found = sequences.candidate(np.array([0, 1]), np.array([sequences.start, switch, GOAL]))
    turn = np.deg2rad(0.2)
    displaced = [
        switch + np.array([2e-4 * np.cos(a), 2e-4 * np.sin(a), sign * turn])
        for a in np.arange(8) * np.pi / 4
        for sign in (1, -1)
    ]
    second = np.mean([plain_leg(fleet, 1, pose, GOAL) for pose in displaced])
    first = plain_leg(fleet, 0, sequences.start, switch)
    assert sequences.replanning(found) == pytest.approx(first + second + fleet.switching[0, 1], rel=1e-9)


def test_the_descent_ends_at_the_minimum():
    """Going on for thousands of steps gains less than 1e-9; without the curvature of the chain in the Hessian 4e-8."""
    fleet, rng = KINDS["general"], np.random.default_rng(10)
    for start in random_poses(rng, 10):
        sequences = Sequences.of(Query(fleet, start, GOAL), 0.0)
        seed = pool_seeds(sequences, sample_poses(sequences, rng, 200, []), 3)[0]
        found = sequences.descend(seed, 6, 80)
        longer = min(sequences.descend(found, 6, 4000).cost, sequences.descend(seed, 12, 4000).cost)
        assert found.cost <= longer * (1 + 1e-9)
