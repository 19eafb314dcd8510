"""The bound on what plans cost lies below every plan: those of dense samples, of searches, and of every kind of car."""

import dataclasses
from itertools import islice

import numpy as np
import pytest

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import rotate
from flatpush.planning.bound import bounded, bounds, check_bound
from flatpush.planning.bound.bound import _chains
from flatpush.planning.bound.boxes import box_bound
from flatpush.planning.bound.chains import SIDES
from flatpush.planning.query import Query
from flatpush.planning.refine import refine
from flatpush.steering.fleet import Fleet
from flatpush.steering.six_words import WORD, chain_cost


def random_fleet(rng, kind, size=3):
    """Cars around an object of some centimetres: Dubins cars, or with unequal centres, leaning ways and any rates."""
    turn = rng.uniform(0, 2 * np.pi, size)
    ahead = np.column_stack([np.cos(turn), np.sin(turn)])
    across = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    middle, radius = rng.normal(size=(size, 2)) * 0.02, rng.uniform(0.02, 0.08, (size, 1))
    rates = np.column_stack([radius[:, 0], np.ones(size), radius[:, 0]])
    if kind == "cone":
        lean = rng.uniform(-0.6, 0.6, (size, 1))
        across = across * np.cos(lean) + ahead * np.sin(lean)
        rates *= rng.uniform(0.6, 1.6, (size, 3))
    none = np.full((size, 3), np.inf)
    switching = np.where(np.eye(size) > 0, 0.0, rng.uniform(0.0, 0.03, (size, size)))
    return Fleet(middle + radius * across, middle - radius * across, ahead, rates, none, none, switching)


def poses_of(chains, chain, ends):
    """Of the object at the start and at the ends of the legs, shape (legs + 1, 3)."""
    poses = [chains.start]
    for leg in range(chains.legs[chain]):
        x, y, angle = ends[3 * leg : 3 * leg + 3]
        c, s = np.cos(angle), np.sin(angle)
        px, py = chains.at[chain, leg]
        poses.append([x - (c * px - s * py), y - (s * px + c * py), angle])
    return np.array(poses)


@pytest.mark.parametrize("kind", ["dubins", "cone"])
@pytest.mark.parametrize("size", [1.0, 0.2, 0.01, 1e-4])
def test_no_sample_of_a_box_is_below_its_bound(kind, size):
    """Boxes of chains of one to three legs, at all places, sampled inside and at their corners."""
    rng = np.random.default_rng(7)
    shares = []
    for _ in range(12):
        fleet = random_fleet(rng, kind)
        start, goal = rng.uniform(-1, 1, (2, 3)) * [0.1, 0.1, np.pi]
        query = Query(fleet, start, goal, slack=np.array([0.01, 0.0, 0.1]) * rng.integers(2))
        chains, cars = _chains(query, 0.4, (1, 2, 3)), fleet.cars
        for chain in rng.integers(len(chains.legs), size=12):
            legs = int(chains.legs[chain])
            half = size * chains.half[chain]
            middle = chains.middle[chain] + rng.uniform(-1, 1, SIDES) * (chains.half[chain] - half)
            least = box_bound(cars, chains, chain, middle, half, np.inf)
            inside = rng.uniform(-1, 1, (50, SIDES))
            inside[:20] = np.sign(inside[:20])
            words = np.zeros(legs, WORD)
            costs = [
                chain_cost(cars, chains.pushes[chain, :legs].copy(), poses_of(chains, chain, ends), words)
                for ends in middle + inside * half
            ]
            best = min(costs) + chains.switching[chain]
            assert least <= best * (1 + 1e-12)
            shares.append(least / best)
    assert np.median(shares) > {1.0: 0.0, 0.2: 0.1, 0.01: 0.9, 1e-4: 0.999}[size]


def driven(rng, fleet, start, legs):
    """Pushes and the ends of their legs, driven from a pose: words of any pieces, many of them of no length."""
    pushes = [int(rng.integers(fleet.size))]
    while len(pushes) < legs:
        pushes.append(int(rng.choice([p for p in range(fleet.size) if p != pushes[-1]])))
    pose, poses = start, []
    for push in pushes:
        first, last = rng.choice([-1.0, 1.0], 2)
        middle = rng.choice([0.0, -first])
        last = last if middle == 0 else first
        for side in (first, middle, last):
            amount = rng.choice([0.0, 1e-3, 1.0], p=[0.35, 0.1, 0.55]) * rng.uniform(0, 1.5)
            amount += np.pi * (amount > 0 and middle != 0 and side == middle and rng.random() < 0.7)
            pose = moved(fleet, push, side, amount, pose)
        poses.append(pose)
    return pushes, np.array(poses)


def moved(fleet, push, side, amount, pose):
    """Along one piece: an angle to the left (1) or right (-1), or a tenth as many metres straight on (0)."""
    if side == 0:
        return pose + np.append(0.1 * amount * rotate(pose[2], fleet.direction[push]), 0.0)
    centre = (fleet.left if side > 0 else fleet.right)[push]
    angle = pose[2] + side * amount
    return np.array([*(pose[:2] + rotate(pose[2], centre) - rotate(angle, centre)), angle])


def box_about(chains, pushes, poses):
    """The chain of these pushes, and where its legs end, shape (SIDES,)."""
    chain = next(i for i, n in enumerate(chains.legs) if list(chains.pushes[i, :n]) == pushes)
    ends = np.zeros(SIDES)
    for leg, pose in enumerate(poses):
        ends[3 * leg : 3 * leg + 3] = [*(pose[:2] + rotate(pose[2], chains.at[chain, leg])), pose[2]]
    return chain, ends


@pytest.mark.parametrize("kind", ["dubins", "cone"])
def test_no_plan_that_is_driven_is_below_the_bound_of_a_box_that_holds_it(kind):
    """Plans with pieces of no length lie where words meet; boxes of all sizes about them, flat ones and odd ones."""
    rng = np.random.default_rng(21)
    for trial in range(600):
        fleet = random_fleet(rng, kind)
        start = rng.uniform(-1, 1, 3) * [0.1, 0.1, np.pi]
        legs, wide = 1 + trial % 3, rng.random() < 0.3
        pushes, poses = driven(rng, fleet, start, legs)
        chains = _chains(
            Query(fleet, start, poses[-1], slack=wide * np.array([0.01, 0.005, 0.1])), 2.0, (legs,)
        )
        chain, ends = box_about(chains, pushes, poses)
        half = np.tile([0.1, 0.1, 1.0], 3) * 10 ** rng.uniform(-6, -0.5) * rng.choice([0.01, 0.1, 1.0], SIDES)
        half[3 * legs - 3 : 3 * legs] *= wide
        half[3 * legs :] = 0.0
        middle = ends + half * rng.uniform(-1, 1, SIDES) * rng.integers(2)
        least = box_bound(fleet.cars, chains, chain, middle, half, np.inf)
        inside = rng.uniform(-1, 1, (12, SIDES))
        inside[:6] = np.sign(inside[:6])
        words, order = np.zeros(legs, WORD), chains.pushes[chain, :legs].copy()
        for at in (ends, *(middle + inside * half)):
            cost = chain_cost(fleet.cars, order, poses_of(chains, chain, at), words)
            assert least <= (cost + chains.switching[chain]) * (1 + 1e-12) + 1e-15, (trial, pushes)


@pytest.mark.parametrize("seed", [3, 4])
def test_legs_that_meet_are_bounded_together_about_the_cheapest_plan(seed):
    """Each alone errs by the size of the box, by 2 % and 0.2 % here; both together by its square."""
    fleet = random_fleet(np.random.default_rng(seed), "dubins")
    start = np.random.default_rng(seed).uniform(-1, 1, 3) * [0.15, 0.15, np.pi]
    query = Query(fleet, start, np.zeros(3))
    best = refine(query, rounds=20, legs=2)
    assert len(best.pushes) == 2
    chains = _chains(query, 1.0, (2,))
    chain, ends = box_about(chains, list(best.pushes), best.poses[1:])
    for size, most in ((1e-2, 1e-3), (1e-3, 1e-5)):
        half = np.array([0.1 * size, 0.1 * size, size, *np.zeros(SIDES - 3)])
        least = box_bound(fleet.cars, chains, chain, ends, half, np.inf)
        assert (1 - most) * best.cost < least <= best.cost


def test_jumps_of_the_length_are_inside_the_bounds():
    """Poses beside a jump of a full turn: a box over it has the lower branch, one beside it the right one."""
    rng = np.random.default_rng(3)
    fleet = random_fleet(rng, "dubins", 1)
    cars, (radius,) = fleet.cars, fleet.radius
    turn = 0.5  # a goal at the end of a left turn: nearer to the centre the first word needs a turn more
    c, s = np.cos(turn), np.sin(turn)
    place = fleet.left[0] - np.array([[c, -s], [s, c]]) @ fleet.left[0]
    words, push = np.zeros(1, WORD), np.zeros(1, np.int64)
    chains = _chains(Query(fleet, np.zeros(3), np.array([*place, turn])), 10.0, (1,))
    for shift in (-1e-3, 0.0, 1e-3):
        goal = np.array([*(place + shift), turn])
        cost = chain_cost(cars, push, np.array([np.zeros(3), goal]), words)
        point = np.array([*goal, *np.zeros(SIDES - 3)])
        assert box_bound(cars, chains, 0, point, np.zeros(SIDES), np.inf) == pytest.approx(cost, rel=1e-6)
        half = np.array([2e-3, 2e-3, 1e-3, *np.zeros(SIDES - 3)])
        assert box_bound(cars, chains, 0, point, half, np.inf) < radius * turn


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["dubins", "cone"])
def test_no_plan_of_a_search_is_below_the_bound_which_comes_near(kind):
    rng = np.random.default_rng(11)
    gaps = []
    for _ in range(3):
        fleet = random_fleet(rng, kind)
        start = rng.uniform(-1, 1, 3) * [0.15, 0.15, np.pi]
        query = Query(fleet, start, np.zeros(3))
        quick = refine(query, rounds=1, legs=2)
        found = list(islice(bounds(query, quick.cost), 4))[-1]
        best = min(quick.cost, np.inf if found.found is None else found.found.cost)
        sought = refine(query, rounds=6)
        assert found.least_of_all <= sought.cost * (1 + 1e-9)
        for changes in (1, 2):
            if len(sought.pushes) <= changes + 1:
                assert found.least[changes - 1] <= sought.cost * (1 + 1e-9)
        gaps.append(best / found.least[0] - 1)
    assert np.median(gaps) < 0.04


@pytest.mark.slow
def test_bounds_rise_and_end_where_nothing_is_left():
    rng = np.random.default_rng(5)
    fleet = random_fleet(rng, "dubins", 2)
    query = Query(fleet, rng.uniform(-0.1, 0.1, 3), np.zeros(3))
    cost = refine(query, rounds=1, legs=2).cost
    every = [found.least[0] for found in islice(bounds(query, cost), 4)]
    assert every == sorted(every)
    assert every[-1] > every[0]
    # A plan far dearer than need be is improved upon; one that is the only way is proved at once.
    single = refine(query, rounds=0).cost
    worse = list(islice(bounds(query, 1.5 * single), 3))[-1]
    assert worse.found is not None
    assert worse.found.cost <= single * (1 + 1e-9)
    alone = Query(random_fleet(rng, "cone", 1), np.array([0.1, 0.05, 1.0]), np.zeros(3))
    cost = refine(alone, rounds=0).cost
    *_, last = bounds(alone, cost)
    assert last.complete
    assert last.least == pytest.approx((cost, cost), rel=1e-6)
    assert last.least_of_all == last.least[1]


def test_a_plan_that_ends_in_a_corner_of_the_goal_stays_within_it():
    """The box about the corner was halved without end, its counter ran over, and plans ended beyond the goal."""
    fleet = random_fleet(np.random.default_rng(5), "dubins", 1)
    slack = np.array([0.0045, 0.0045, 0.08])
    query = Query(fleet, np.array([0.1, 0.05, 1.0]), np.zeros(3), slack=slack)
    cost = refine(query, rounds=1).cost
    *_, last = islice(bounds(query, cost), 50)
    assert last.complete
    assert last.least[0] == pytest.approx(cost, rel=1e-6)
    assert last.found is None or np.all(np.abs(last.found.poses[-1]) <= slack * (1 + 1e-9))


@pytest.mark.slow
def test_a_goal_that_leaves_room_costs_less():
    rng = np.random.default_rng(9)
    fleet, start = random_fleet(rng, "dubins", 2), np.array([0.1, 0.05, 1.0])
    least = []
    for query in (
        Query(fleet, start, np.zeros(3)),
        Query(fleet, start, np.zeros(3), slack=np.array([0.005, 0.005, 0.1])),
        Query(fleet, start, np.zeros(3), free=True),
    ):
        plan = refine(query, rounds=2, legs=2)
        found = list(islice(bounds(query, plan.cost), 4))[-1]
        assert found.least[1] <= plan.cost * (1 + 1e-9)
        least.append(found.least[0])
    assert least == sorted(least, reverse=True)
    assert least[2] < 0.95 * least[0]


def test_where_there_is_no_room_for_more_boxes_the_bound_stands():
    rng = np.random.default_rng(13)
    query = Query(random_fleet(rng, "dubins"), np.array([0.1, 0.05, 1.0]), np.zeros(3))
    cost = refine(query, rounds=1).cost
    *_, last = bounds(query, cost, most=500)
    assert last.full
    assert not last.complete
    assert 0 < last.least[1] <= last.least[0] < cost
    assert last.open <= 500


def test_numbers_out_of_range():
    query = Query(random_fleet(np.random.default_rng(1), "dubins"), np.zeros(3), np.ones(3))
    with pytest.raises(InputError, match="room"):
        next(bounds(query, 1.0, most=10))
    timed = random_fleet(np.random.default_rng(1), "dubins")
    timed = Fleet(*(getattr(timed, n) for n in ("left", "right", "direction", "rates")), np.ones((3, 3)),
                  np.ones((3, 3)), timed.switching)  # fmt: skip
    with pytest.raises(InputError, match="lengths"):
        next(bounds(Query(timed, np.zeros(3), np.ones(3)), 1.0))


def scene_of(**planning):
    """A rectangle on feet, pushed at two sides."""
    outline = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]
    feet = fp.Support.points([(-0.02, -0.01), (0.02, -0.01), (0.0, 0.012)])
    thing = fp.Object(outline, feet, friction=0.4)
    pushes = tuple(
        fp.Push(name, thing.outline.nearest(at), 2, 0.018)
        for name, at in (("long", (0.0, -0.0175)), ("short", (0.025, 0.0)))
    )
    return fp.Scene(
        thing, (0.1, -0.06, 1.2), pusher=fp.Pusher(fingers=2, spacing=0.018), pushes=pushes,
        planning=fp.Planning(**planning),
    )  # fmt: skip


@pytest.mark.parametrize("cost", ["flat", "pusher"])
def test_a_cheaper_plan_that_is_found_is_used_and_verified(cost):
    """The plan that is given makes do with one push; the bound's has both, and costs what the bound allows."""
    scene = scene_of(cost=cost, switch_cost=0.005)
    single = fp.plan(fp.Scene(scene.object, scene.start, pusher=scene.pusher, pushes=scene.pushes[1:],
                              planning=scene.planning))  # fmt: skip
    planner = fp.Planner(scene)
    single = dataclasses.replace(single, scene=planner.scene)
    *_, found = islice(bounded(planner, single), 5)
    assert found.cost < 0.99 * single.cost
    assert fp.verify(found).ok
    known, best = found.run["bound"], planner.plan()
    assert known["least"] <= known["least_two_changes"] <= known["least_one_change"] <= found.cost
    assert known["least"] <= best.cost * (1 + 1e-9)
    assert known["above"] == pytest.approx(found.cost / known["least"] - 1)


def test_scenes_of_which_no_bound_is_known():
    scene = scene_of()
    walled = dataclasses.replace(scene, workspace=fp.Workspace((-1, -1, 1, 1)))
    for wrong, key in ((walled, "workspace"), (scene_of(cost="time"), "planning.cost")):
        with pytest.raises(InputError) as error:
            check_bound(wrong)
        assert error.value.key == key
    rolling = dataclasses.replace(scene, pusher=fp.Pusher(turns=False), pushes="auto")
    with pytest.raises(InputError, match="turns with"):
        check_bound(rolling)
    check_bound(scene)
