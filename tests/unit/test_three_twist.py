"""Named cases of the three-twist words, and what is refused."""

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.steering import shortest_word, words
from flatpush.steering.three_twist import end_pose

TILTED = ([0.05, 0.12], [-0.02, -0.2], [0.9, -0.3])  # c_left, c_right, direction [m]


def driven(car, letter, amount, start=(0.3, -0.2, 1.0)):
    from flatpush.steering import Word

    word = Word({"L": "LSL", "R": "RSR", "S": "LSL"}[letter], np.zeros(3), 0.0)
    word.parameters[1 if letter == "S" else 0] = amount
    return np.array(start), end_pose(word, *car, start)


def test_start_is_goal():
    found = shortest_word(*TILTED, [1, 2, 3], [1, 2, 3])
    np.testing.assert_array_equal(found.parameters, 0.0)
    assert found.cost == 0.0


@pytest.mark.parametrize("turns", [-1, 0, 1])
@pytest.mark.parametrize(
    ("letter", "amount"), [("S", 0.7), ("L", 1.2), ("R", 1.2), ("L", 3.5), ("R", np.pi), ("L", 1e-6)]
)
def test_one_piece_makes_no_spurious_turn(letter, amount, turns):
    start, goal = driven(TILTED, letter, amount)
    goal[2] += 2 * np.pi * turns
    found = shortest_word(*TILTED, start, goal)
    assert found.cost == pytest.approx(amount, abs=1e-8)


def test_both_middle_arcs_are_listed():
    found = [w for w in words([0, 1], [0, -1], [1, 0], [0, 0, 0], [0.3, 0.2, 0.4]) if w.word == "LRL"]
    assert len(found) == 2
    assert sum(w.parameters[1] for w in found) == pytest.approx(2 * np.pi)


def test_both_straight_lengths_are_listed():
    """A direction that leans far back meets the circle of the other centre twice."""
    car = ([0.5, 0.2], [-2.0, -0.2], [1.0, 0.0])
    goal = end_pose(_word("LSR", [0.4, 1.5, 0.6]), *car, [0, 0, 0])
    lengths = sorted(w.parameters[1] for w in words(*car, [0, 0, 0], goal) if w.word == "RSL")
    lengths_other = sorted(w.parameters[1] for w in words(*car, [0, 0, 0], goal) if w.word == "LSR")
    assert any(abs(t - 1.5) < 1e-9 for t in lengths_other)
    assert len(lengths_other) == 2
    assert len(lengths) <= 1


def test_weights_choose():
    """Dear left turns are avoided where a right turn leads to the same pose."""
    goal = [0.0, 0.0, np.pi]
    car = ([0, 1], [0, -1], [1, 0])
    dear_left = shortest_word(*car, [0, 0, 0], goal, weights=(100, 1, 1))
    dear_right = shortest_word(*car, [0, 0, 0], goal, weights=(1, 1, 100))
    left, right = (
        sum(p for k, p in zip(w.word, w.parameters, strict=True) if k == "L") for w in (dear_left, dear_right)
    )
    assert left < right


@pytest.mark.parametrize(
    "arguments",
    [
        ([0, -1], [0, 1], [1, 0], [0, 0, 0], [1, 0, 0]),  # centres swapped
        ([1, 0], [-1, 0], [1, 0], [0, 0, 0], [1, 0, 0]),  # direction along the line of centres
        ([0, 1], [0, 1], [1, 0], [0, 0, 0], [1, 0, 0]),
        ([0, 1], [0, -1], [0, 0], [0, 0, 0], [1, 0, 0]),
        ([0, np.nan], [0, -1], [1, 0], [0, 0, 0], [1, 0, 0]),
        ([0, 1], [0, -1], [1, 0], [0, 0], [1, 0, 0]),
        ([0, 1], [0, -1], [1, 0], [0, 0, 0], [1, 0, np.inf]),
        ([0, 1], [0, -1], [1, 0], [0, 0, 0], [1, 0, 0], (1, -1, 1)),
        ([0, 1], [0, -1], [1, 0], [0, 0, 0], [1, 0, 0], (1, 1)),
    ],
)
def test_refused(arguments):
    with pytest.raises(InputError):
        shortest_word(*arguments)


def _word(name, parameters):
    from flatpush.steering import Word

    return Word(name, np.array(parameters, dtype=float), 0.0)
