"""Steering a car with arbitrary turning centres and straight direction from pose to pose, in three pieces.

The car turns left (counter-clockwise) about one body-fixed point, right about another, or slides along a
body-fixed direction. Under any convex limit surface a sticking push is such a car; with an ellipsoid the
direction is perpendicular to the line of the centres and the words are Dubins words. They are closed form
(complex numbers stand for plane vectors, the start is the identity, the goal is X, Θ): the body point c moves
to X + exp(iΘ) c, so

    arc A, straight, arc B:  X + exp(iΘ) c_B - c_A = exp(iα) (c_B - c_A + t d)
    arc A, arc B, arc A:     X + exp(iΘ) c_A - c_A = exp(iα) (c_B - c_A) (1 - exp(iβ))

Lengths give t or β, then arguments give α, and Θ the last arc. As in dubins.py an arc near zero is also tried
as exactly zero, and a candidate is accepted by where it ends.
"""

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import vector
from ..errors import InputError
from ..geometry.pose import Array, compose, exp

TOLERANCE = (
    1e-10  # of the end, per length of the query (distance + distance of the centres); 1e-9 is promised
)
WORDS = ("LSL", "RSR", "LSR", "RSL", "LRL", "RLR")
SENSE = {"L": 1, "S": 0, "R": -1}
Parameters = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Word:
    """Three pieces that lead a car from its start to its goal.

    Attributes:
        word: such as "LSR".
        parameters: shape (3,), none negative: the angle [rad] of an arc, the length [m] of a straight piece.
        cost: their weighted sum, with the weights of shortest_word; in words(), the sum of angles and length.
    """

    word: str
    parameters: Array
    cost: float


class _Car(NamedTuple):
    left: complex
    right: complex
    direction: complex

    def centre(self, letter: str) -> complex:
        return self.left if letter == "L" else self.right


def shortest_word(
    c_left: ArrayLike,
    c_right: ArrayLike,
    direction: ArrayLike,
    start: ArrayLike,
    goal: ArrayLike,
    weights: Sequence[float] = (1.0, 1.0, 1.0),
) -> Word:
    """The cheapest of the words that lead from start to goal.

    Args:
        c_left, c_right: centres of the counter-clockwise and of the clockwise turn in the body frame, shape
        (2,) [m].
        direction: of the straight motion in the body frame, shape (2,); any length.
        start, goal: poses of the body frame, shape (3,) [m, m, rad].
        weights: cost of a radian to the left, a metre straight and a radian to the right, each ≥ 0.

    Returns:
        A Word that ends at the goal within 1e-9 of the lengths involved. Where the direction is perpendicular
        to the line of the centres and the weights are (R, 1, R), R half their distance, it is the Dubins path
        of their midpoint. Otherwise three pieces need not be the best there are ([Furtuna2010]).

    Raises:
        InputError: for values that are not finite, negative weights, or centres of which the left one does
            not lie to the left of the right one as seen along the direction.

    >>> found = shortest_word([0, 1], [0, -1], [1, 0], [0, 0, 0], [3, 0, 0])
    >>> found.parameters.round(9).tolist(), round(found.cost, 9)
    ([0.0, 3.0, 0.0], 3.0)
    """
    costs = np.asarray(weights, dtype=float)
    if costs.shape != (3,) or not np.all(np.isfinite(costs) & (costs >= 0)):
        raise InputError("weights are three finite numbers, 0 or more (left, straight, right)", value=weights)
    price = dict(zip("LSR", costs.tolist(), strict=True))
    found = words(c_left, c_right, direction, start, goal)
    priced = [(sum(price[k] * p for k, p in zip(w.word, w.parameters, strict=True)), w) for w in found]
    cost, best = min(priced, key=lambda item: item[0])
    return Word(best.word, best.parameters, float(cost))


def words(
    c_left: ArrayLike, c_right: ArrayLike, direction: ArrayLike, start: ArrayLike, goal: ArrayLike
) -> list[Word]:
    """All the words that lead from start to goal: both middle arcs of LRL and RLR, every straight length ≥ 0.

    Arguments and errors as in shortest_word.
    """
    car = _checked_car(c_left, c_right, direction)
    X, theta = _relative(start, goal)
    found = []
    for name in WORDS:
        for middle in _middles(car, name, X, theta):
            accepted = list(_accepted(car, name, middle, X, theta))
            if accepted:
                best = min(accepted, key=sum)
                found.append(Word(name, np.array(best), float(sum(best))))
    return found


def end_pose(
    word: Word, c_left: ArrayLike, c_right: ArrayLike, direction: ArrayLike, start: ArrayLike
) -> Array:
    """Where the body frame ends when a word is driven from a start, shape (3,); the angle is not wrapped."""
    car = _checked_car(c_left, c_right, direction)
    pose = _vector(start, 3, "the start")
    for letter, amount in zip(word.word, word.parameters, strict=True):
        if letter == "S":
            twist = np.array([car.direction.real, car.direction.imag, 0.0])
        else:
            centre, sense = car.centre(letter), SENSE[letter]
            twist = sense * np.array([centre.imag, -centre.real, 1.0])
        pose = compose(pose, exp(amount * twist))
    return pose


def _middles(car: _Car, name: str, X: complex, theta: float) -> Iterator[float]:
    """The middle parameters that the lengths allow; a negative one counts as zero, judged by its end."""
    first, last = car.centre(name[0]), car.centre(name[2])
    w = X + cmath.exp(1j * theta) * last - first
    if name[1] == "S":
        D = (last - first) * car.direction.conjugate()  # along and across the direction
        root = math.sqrt(max(0.0, abs(w) ** 2 - D.imag**2))
        longer, shorter = max(0.0, root - D.real), max(0.0, -root - D.real)
        yield from (longer, shorter) if shorter < longer else (longer,)
    else:
        apex = 2 * math.asin(min(1.0, abs(w) / (2 * abs(car.left - car.right))))
        yield from (apex, math.tau - apex)


def _accepted(car: _Car, name: str, middle: float, X: complex, theta: float) -> Iterator[Parameters]:
    """Parameters that end at the goal: the first arc as computed, or the first or the last arc zero."""
    first, last = car.centre(name[0]), car.centre(name[2])
    w = X + cmath.exp(1j * theta) * last - first
    if name[1] == "S":
        turned, arm = 0.0, (last - first) + middle * car.direction
    else:
        turned = SENSE[name[1]] * middle
        arm = (car.centre(name[1]) - first) * (1 - cmath.exp(1j * turned))
    scale = abs(X) + abs(car.left - car.right)
    for alpha in (cmath.phase(w) - cmath.phase(arm), 0.0, theta - turned):
        if abs(cmath.exp(1j * alpha) * arm - w) <= TOLERANCE * scale:
            yield (
                SENSE[name[0]] * alpha % math.tau,
                middle,
                SENSE[name[2]] * (theta - turned - alpha) % math.tau,
            )


def _relative(start: ArrayLike, goal: ArrayLike) -> tuple[complex, float]:
    X, Y = _vector(start, 3, "the start"), _vector(goal, 3, "the goal")
    return complex(*(Y[:2] - X[:2])) * cmath.exp(-1j * X[2]), float(Y[2] - X[2])


def _checked_car(c_left: ArrayLike, c_right: ArrayLike, direction: ArrayLike) -> _Car:
    left, right, d = (
        complex(*_vector(v, 2, name))
        for v, name in ((c_left, "c_left"), (c_right, "c_right"), (direction, "the direction"))
    )
    if d == 0:
        raise InputError("the direction is not zero", value=direction)
    d /= abs(d)
    if ((left - right) * d.conjugate()).imag <= 0:
        raise InputError(
            "the centre of the left turn lies to the left of the right turn's, as seen along the direction",
            value=(c_left, c_right, direction),
            hint="Swap the centres or turn the direction round.",
        )
    return _Car(left, right, d)


def _vector(value: ArrayLike, size: int, name: str) -> Array:
    return vector(value, size, f"{name} is {size} finite numbers")
