"""What legs that meet in boxes cost at least together, compiled: better where one leg gains what the other loses.

The bounds of single legs (legs.py) add up as if a box were at its best place for each of its two legs at once, so they
err by the size of the box. Here every leg has a costate λ, the price of a metre. Along a piece that
turns about a body point c the object's origin moves by the change of -R(θ) c, so the piece costs λ times its way plus
the change of

    G(θ) = ±rate θ + λ·R(θ) c,          + to the left, - to the right,

and a straight piece of length t costs λ times its way plus t (rate - λ·R(θ) d). All ways of a leg add up to that from
pose to pose: of the places of a box only (λ - λ') times place is left where its legs have λ and λ', and otherwise
headings, each of which occurs in terms of its own of the form

    a + b θ + λ·R(θ) c,

whose least value over an interval is known in closed form. With one λ for both legs, that by which the cheapest plan's
cost grows with the place, the bound errs by the square of the box's size. Any λ gives a bound; those of the words at
their middles are tried.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import inner, shared
from ...formulas import Record
from ...geometry.pose import Array
from ...steering.six_words import CAR, Records
from .chains import MOST_LEGS, NO_CHAINS, SIDES, Chains
from .legs import ANGLE, KEPT, LEFT, MOST_KEPT, RIGHT, ROUNDING, STRAIGHT, TURN, End, end_of, leg_bound


class Term(NamedTuple):
    """slope θ + x cos θ + y sin θ."""

    slope: float
    x: float
    y: float


class Corner(NamedTuple):
    """Where one piece ends and the next begins: its term, and its heading with half the interval [rad]."""

    term: Term
    heading: float
    spread: float


class Scratch(NamedTuple):
    """What a chain's bound writes into, by leg.

    Attributes:
        kept: words, shape (MOST_LEGS, MOST_KEPT); number: of words; chosen: one of them.
        least, other: the bounds of a leg, and of what was not kept; costate: shape (MOST_LEGS, 2).
    """

    kept: Records
    number: NDArray[np.int64]
    chosen: NDArray[np.int64]
    least: Array
    other: Array
    costate: Array


@inner
def scratch() -> Scratch:
    n = MOST_LEGS
    return Scratch(
        np.empty((n, MOST_KEPT), KEPT), np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n), np.empty(n),
        np.empty((n, 2)),
    )  # fmt: skip


@inner
def _next(work: Scratch, legs: int) -> bool:
    """Chooses other words, counting through all choices of one for every leg; whether there was another."""
    for leg in range(legs):
        work.chosen[leg] += 1
        if work.chosen[leg] < work.number[leg]:
            return True
        work.chosen[leg] = 0
    return False


@inner
def _together(
    cars: Records, chains: Chains, chain: int, middle: Array, half: Array, limit: float, work: Scratch
) -> float:
    """The bound of a box for the chosen words, with the costates of each, or with that of one for all."""
    legs = chains.legs[chain]
    best = -np.inf
    for common in range(-1, legs if legs > 1 else 0):
        for leg in range(legs):
            by = leg if common < 0 else common
            work.costate[leg, :] = work.kept[by, work.chosen[by]].costate
        best = max(best, _priced(cars, chains, chain, middle, half, work))
        if best >= limit:
            return limit
    return best


@inner
def _priced(cars: Records, chains: Chains, chain: int, middle: Array, half: Array, work: Scratch) -> float:
    """The bound of a box for the chosen words and costates."""
    legs, costate = chains.legs[chain], (work.costate[0, 0], work.costate[0, 1])
    begins, ends, apart = _leg_terms(cars[chains.pushes[chain, 0]], work.kept[0, work.chosen[0]], costate)
    total = chains.switching[chain] + apart + _value(begins, chains.start[2])
    total -= costate[0] * chains.start[0] + costate[1] * chains.start[1]
    for leg in range(legs):
        term, (px, py) = ends, costate
        if leg + 1 < legs:
            after = leg + 1
            costate = (work.costate[after, 0], work.costate[after, 1])
            car, word = cars[chains.pushes[chain, after]], work.kept[after, work.chosen[after]]
            begins, ends, apart = _leg_terms(car, word, costate)
            total += apart
            term, px, py = _plus(term, begins), px - costate[0], py - costate[1]
        i, at = 3 * leg, chains.at[chain, leg]
        total += px * middle[i] + py * middle[i + 1] - (abs(px) * half[i] + abs(py) * half[i + 1])
        term = _minus(term, _turned(at[0], at[1], (px, py)))
        total += _least_value(Corner(term, middle[i + 2], half[i + 2] + ANGLE))
    return total - ROUNDING * abs(total)


@inner
def _end(chains: Chains, chain: int, leg: int, middle: Array, half: Array) -> End:
    i = 3 * leg
    at = chains.at[chain, leg]
    return end_of(
        middle[i], middle[i + 1], middle[i + 2], (half[i], half[i + 1], half[i + 2]), (at[0], at[1])
    )


@inner
def _leg_terms(car: Record, word: Record, costate: tuple[float, float]) -> tuple[Term, Term, float]:
    """What a word adds to the terms of the box where it begins and of that where it ends, and a cost apart.

    An arc that may be zero bounds the heading of its corner by that of the box: where the cost falls towards it, it is
    taken as zero.
    """
    first, last = _arc(car, word.letter[0], costate), _arc(car, word.letter[2], costate)
    begins, ends, apart = _minus(Term(0.0, 0.0, 0.0), first), last, last.slope * word.wound
    if word.letter[1] == STRAIGHT:
        rate = car.rate[STRAIGHT]
        ahead = _turned(word.short * car.ahead_x, word.short * car.ahead_y, costate)
        corner = Corner(_minus(_minus(first, last), ahead), word.heading[0], word.spread)
        dear = max(
            0.0, math.hypot(costate[0], costate[1]) - rate
        )  # a longer piece may cost less than its way
        apart += word.short * rate - (word.long - word.short) * dear
        if word.opens and _rises(corner, _sense(word.letter[0])):
            return _plus(begins, corner.term), ends, apart
        if word.closes and _rises(corner, -_sense(word.letter[2])):
            return begins, _plus(ends, corner.term), apart + corner.term.slope * word.wound
        return begins, ends, apart + _least_value(corner)
    if (
        word.spread == math.inf
    ):  # a loop, of which the middle arc and as much of the outer ones cost this, anywhere
        rate = car.rate[LEFT] + car.rate[RIGHT] - 2.0 * car.radius * math.hypot(costate[0], costate[1])
        return begins, ends, apart + min(rate * word.short, rate * word.long)
    between = _arc(car, word.letter[1], costate)
    corner = Corner(_minus(first, between), word.heading[0], word.spread)
    if word.opens and _rises(corner, _sense(word.letter[0])):
        begins = _plus(begins, corner.term)
    else:
        apart += _least_value(corner)
    corner = Corner(_minus(between, last), word.heading[1], word.spread)
    if word.closes and _rises(corner, -_sense(word.letter[2])):
        return begins, _plus(ends, corner.term), apart + corner.term.slope * word.wound
    return begins, ends, apart + _least_value(corner)


@inner
def _plus(a: Term, b: Term) -> Term:
    return Term(a.slope + b.slope, a.x + b.x, a.y + b.y)


@inner
def _minus(a: Term, b: Term) -> Term:
    return Term(a.slope - b.slope, a.x - b.x, a.y - b.y)


@inner
def _turned(x: float, y: float, costate: tuple[float, float]) -> Term:
    """λ·R(θ) (x, y)."""
    return Term(0.0, costate[0] * x + costate[1] * y, costate[1] * x - costate[0] * y)


@inner
def _arc(car: Record, letter: int, costate: tuple[float, float]) -> Term:
    """G of an arc."""
    if letter == LEFT:
        return _plus(Term(car.rate[letter], 0.0, 0.0), _turned(car.left_x, car.left_y, costate))
    return _plus(Term(-car.rate[letter], 0.0, 0.0), _turned(car.right_x, car.right_y, costate))


@inner
def _least_value(corner: Corner) -> float:
    """The least value of a term over its interval of headings."""
    term, low, high = corner.term, corner.heading - corner.spread, corner.heading + corner.spread
    best = min(_value(term, low), _value(term, high))
    size = math.hypot(term.x, term.y)
    if abs(term.slope) >= size:
        return best
    bottom = math.atan2(term.y, term.x) + math.pi - math.asin(term.slope / size)
    # Of several the first is the lowest where the term rises from turn to turn, else the last.
    if term.slope >= 0:
        bottom += TURN * math.ceil((low - bottom) / TURN)
    else:
        bottom += TURN * math.floor((high - bottom) / TURN)
    return min(best, _value(term, bottom)) if low < bottom < high else best


@inner
def _value(term: Term, heading: float) -> float:
    return term.slope * heading + term.x * math.cos(heading) + term.y * math.sin(heading)


@inner
def _rises(corner: Corner, sense: float) -> bool:
    """Whether the term rises (sense 1) or falls (-1) over the whole interval."""
    term = corner.term
    slope = term.slope - term.x * math.sin(corner.heading) + term.y * math.cos(corner.heading)
    return sense * slope >= math.hypot(term.x, term.y) * corner.spread


@inner
def _sense(letter: int) -> float:
    return 1.0 if letter == LEFT else -1.0


# Last, because it is compiled when this file is read.
_CARS, _SIDES = np.zeros(1, CAR), np.zeros(SIDES)
_WORK = getattr(scratch, "py_func", scratch)()


@shared(0.0, _CARS, NO_CHAINS, 0, _SIDES, _SIDES, 0.0, 0.0, _WORK)
def chain_bound(
    cars: Records, chains: Chains, chain: int, middle: Array, half: Array, known: float, limit: float,
    work: Scratch,
) -> float:  # fmt: skip
    """The bound of a box of a chain, where it is between one that is known and a limit."""
    legs, total = chains.legs[chain], chains.switching[chain]
    a = end_of(chains.start[0], chains.start[1], chains.start[2], (0.0, 0.0, 0.0), (0.0, 0.0))
    for leg in range(legs):
        b = _end(chains, chain, leg, middle, half)
        found = leg_bound(cars[chains.pushes[chain, leg]], a, b, limit - total, work.kept[leg])
        work.number[leg], work.least[leg], work.other[leg], work.chosen[leg] = (
            found.kept,
            found.least,
            found.other,
            0,
        )
        total += found.least
        if total >= limit:
            return limit
        a = b
    best, one_each = limit, True
    for leg in range(legs):
        best = min(best, total - work.least[leg] + work.other[leg])
        one_each = one_each and work.number[leg] > 0
    while one_each and best > max(known, total):
        alone = chains.switching[chain]
        for leg in range(legs):
            alone += work.kept[leg, work.chosen[leg]].least
        if alone < best:
            best = min(best, max(alone, _together(cars, chains, chain, middle, half, best, work)))
        one_each = _next(work, legs)
    return max(best, total)
