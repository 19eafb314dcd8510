"""What must hold for every car and every pair of poses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flatpush.geometry import compose, pose_error, relative
from flatpush.steering import dubins, shortest_word, words
from flatpush.steering.fleet import Fleet
from flatpush.steering.six_words import WORD, chain_cost
from flatpush.steering.three_twist import WORDS, Word, end_pose

CARS = 3_000
COMPARED = 1_000
END = 1e-9  # [m], [rad] for cars and distances of the order of a metre
SAME = 1e-9

angle = st.one_of(st.floats(-7, 7), st.sampled_from([0.0, np.pi, -np.pi, np.pi / 2, 2 * np.pi]))
position = st.one_of(st.floats(-6, 6), st.integers(-4, 4).map(float))
pose = st.tuples(position, position, angle).map(np.array)


def random_car(rng):
    """Unequal centres, the straight direction up to 75° away from their perpendicular."""
    c_left, c_right = rng.uniform(-1, 1, (2, 2))
    across = c_left - c_right
    tilt = rng.uniform(-1.3, 1.3)
    d = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]) @ np.array(
        [across[1], -across[0]]
    )
    return c_left, c_right, d / np.hypot(*d)


def random_pose(rng, reach=2.0):
    return np.array([*rng.uniform(-reach, reach, 2), rng.uniform(-7, 7)])


def compiled_word(left, right, direction, start, goal, weights):
    """Index in WORDS, parameters and cost of the cheapest word of the compiled kernel."""
    ahead, free = direction / np.hypot(*direction), np.full((1, 3), np.inf)
    fleet = Fleet(left[None], right[None], ahead[None], np.array([weights]), free, free, np.zeros((1, 1)))
    found = np.zeros(1, WORD)
    cost = chain_cost(fleet.cars, np.zeros(1, np.int64), np.array([start, goal]), found)
    name = "".join("LSR"[letter] for letter in found["letter"][0])
    return WORDS.index(name), *found["amount"][0], cost


def test_words_end_at_the_goal():
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(CARS):
        car, start, goal = random_car(rng), random_pose(rng), random_pose(rng)
        weights = rng.uniform(0.1, 2, 3)
        index, *parameters, cost = compiled_word(*car, start, goal, weights)
        best = Word(WORDS[index], np.array(parameters), cost)
        seen.add(best.word)
        assert np.all(best.parameters >= 0)
        assert np.max(np.abs(pose_error(end_pose(best, *car, start), goal))) <= END
    assert seen == set(WORDS)


def test_plain_and_compiled_words_agree_and_all_words_end_at_the_goal():
    rng = np.random.default_rng(6)
    for _ in range(COMPARED):
        car, start, goal = random_car(rng), random_pose(rng), random_pose(rng)
        weights = rng.uniform(0.1, 2, 3)
        found = words(*car, start, goal)
        for word in found:
            assert np.all(word.parameters >= 0)
            assert np.max(np.abs(pose_error(end_pose(word, *car, start), goal))) <= END
        best = shortest_word(*car, start, goal, weights)
        index, *parameters, cost = compiled_word(*car, start, goal, weights)
        assert WORDS[index] == best.word
        assert cost == pytest.approx(best.cost, rel=SAME)
        np.testing.assert_allclose(parameters, best.parameters, atol=1e-7)


def test_a_driven_word_is_found_again():
    """No word is missing: what was driven is among the candidates, whatever the tilt."""
    rng = np.random.default_rng(8)
    for _ in range(COMPARED):
        car, start = random_car(rng), random_pose(rng)
        name = WORDS[rng.integers(6)]
        driven = Word(name, rng.uniform(0.05, 3.0, 3) * np.where(np.array(list(name)) == "S", 1, 2), 0.0)
        goal = end_pose(driven, *car, start)
        parameters = [w.parameters for w in words(*car, start, goal) if w.word == name]
        assert min(np.max(np.abs(p - driven.parameters)) for p in parameters) <= 1e-6


def test_words_with_vanishing_pieces_make_no_spurious_turn():
    """One or two pieces, whole angles and tangent circles: never dearer than what was driven."""
    rng = np.random.default_rng(10)
    weights = np.ones(3)
    for _ in range(COMPARED):
        car, start = random_car(rng), random_pose(rng)
        name = WORDS[rng.integers(6)]
        driven = rng.choice([np.pi / 2, np.pi, 0.3, rng.uniform(0.1, 5)], 3) * (
            rng.permutation(3) < rng.integers(3)
        )
        goal = end_pose(Word(name, driven, 0.0), *car, start)
        goal[2] += rng.choice([-1, 0, 1]) * 2 * np.pi
        best = shortest_word(*car, start, goal, weights)
        assert best.cost <= np.sum(driven) + 1e-8
        assert np.max(np.abs(pose_error(end_pose(best, *car, start), goal))) <= END
        assert compiled_word(*car, start, goal, weights)[4] <= np.sum(driven) + 1e-8


@settings(deadline=None, max_examples=300, derandomize=True)
@given(pose, pose, st.floats(0.1, 3.0), position, position, angle)
def test_perpendicular_cars_are_dubins_cars(start, goal, radius, x, y, heading):
    mid = np.array([x, y, heading])  # pose of the car's axle in the body frame
    left, right = (compose(mid, [0, side * radius, 0])[:2] for side in (1, -1))
    direction = [np.cos(heading), np.sin(heading)]
    found = shortest_word(left, right, direction, start, goal, weights=(radius, 1, radius))
    path = dubins.shortest_path(compose(start, mid), compose(goal, mid), radius)
    assert found.cost == pytest.approx(path.length, rel=SAME, abs=1e-7 * radius)


@settings(deadline=None, max_examples=300, derandomize=True)
@given(pose, pose, st.floats(0.1, 3.0))
def test_paths_arrive(start, goal, radius):
    path = dubins.shortest_path(start, goal, radius)
    distance = np.hypot(*(goal - start)[:2])
    assert np.all(path.lengths >= 0)
    assert path.length >= distance - END * (radius + distance)
    assert np.hypot(*(path.end - goal)[:2]) <= END * (radius + distance)
    assert abs(pose_error(path.end, goal)[2]) <= END
    compiled = dubins.shortest_length(start[None], goal, radius)[0]
    assert compiled == pytest.approx(path.length, rel=SAME, abs=1e-7 * radius)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(pose, pose, pose, st.floats(0.1, 3.0))
def test_triangle_inequality_and_invariance(a, b, c, radius):
    def length(x, y):
        return dubins.shortest_path(x, y, radius).length

    slack = 1e-6 * radius  # what the accepting tolerance and rounded poses near a jump can make
    assert length(a, c) <= length(a, b) + length(b, c) + slack
    mirror = np.array([1, -1, -1])
    assert length(a * mirror, b * mirror) == pytest.approx(length(a, b), rel=SAME, abs=slack)
    reverse = [x + np.array([0, 0, np.pi]) for x in (b, a)]
    assert length(*reverse) == pytest.approx(length(a, b), rel=SAME, abs=slack)
    scaled = [x * [1e3, 1e3, 1] for x in (a, b)]
    assert dubins.shortest_path(*scaled, 1e3 * radius).length == pytest.approx(
        1e3 * length(a, b), rel=SAME, abs=1e3 * slack
    )
    moved = [relative(c, x) for x in (a, b)]
    assert length(*moved) == pytest.approx(length(a, b), rel=SAME, abs=slack)
