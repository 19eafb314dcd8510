"""The compiled moves of the polish; the package's docstring explains them."""

import math
from typing import NamedTuple

import numpy as np

from ....compiled import inner, kernel
from ....geometry.pose import Array
from ....steering.six_words import MOST_WORDS, STRAIGHT, TURN, WORD, Records, drive, price
from ...query_arrays import QueryArrays
from ..kernels import changes, connect, free, lands, put, random, replanned

MOST = 256
LONGEST_SHORTCUT = 48  # legs of a path that one word may replace at first
TRIES = 3  # words of a push that are looked at for one that keeps clear
SMALL, LARGE = 3e-5, 0.2  # shifts, in turning radii and radians
GAIN = 1e-9  # of the cost, that a move must save


@inner
def _normal(state: np.ndarray) -> float:
    return math.sqrt(-2.0 * math.log(1.0 - random(state))) * math.cos(2.0 * math.pi * random(state))


class Legs(NamedTuple):
    """A chain of legs, in arrays with room for MOST.

    Attributes:
        poses: of its knots, shape (MOST + 1, 3); pushes: of its legs, shape (MOST,); words: of them, six_words.WORD,
            shape (MOST,).
    """

    poses: Array
    pushes: np.ndarray
    words: Records


@inner
def total(T: QueryArrays, legs: Legs, n: int) -> float:
    """What a chain of n legs costs."""
    cost = legs.words[0].cost
    for i in range(1, n):
        cost += legs.words[i].cost + T.switching[legs.pushes[i - 1], legs.pushes[i]]
    return cost


@inner
def _worth(T: QueryArrays, legs: Legs, n: int, buffer: Records, off: Array, here: Array) -> float:
    """What a chain is judged by: its cost, or that of replanning. An attempt that is lost costs the chain once more."""
    cost = once = total(T, legs, n)
    if len(T.offsets) > 0:
        for i in range(1, n):
            a = legs.pushes[i]
            if a != legs.pushes[i - 1]:
                again = replanned(T, a, legs.poses[i], legs.poses[i + 1], once, buffer, off, here)
                cost += again - legs.words[i].cost
    return cost


@kernel()
def worth(T: QueryArrays, legs: Legs, n: int) -> float:
    """What a chain of n legs is judged by."""
    return _worth(T, legs, n, np.empty(MOST_WORDS, WORD), np.empty(3), np.empty(3))


@inner
def _copy(legs: Legs, n: int, to: Legs) -> None:
    for i in range(n):
        to.pushes[i] = legs.pushes[i]
        put(legs.poses[i], to.poses[i])
        to.words[i] = legs.words[i]
    put(legs.poses[n], to.poses[n])


@inner
def _split(T: QueryArrays, legs: Legs, n: int, leg: int, share: float) -> int:
    """Puts a knot into a leg, after a share of its length, on the path; returns the number of legs."""
    poses, pushes, words = legs.poses, legs.pushes, legs.words
    a = pushes[leg]
    car, radius = T.cars[a], T.cars[a].radius
    for i in range(n, leg, -1):
        put(poses[i], poses[i + 1])
    for i in range(n - 1, leg - 1, -1):
        pushes[i + 1] = pushes[i]
        words[i + 1] = words[i]
    before, after = words[leg], words[leg + 1]
    length = 0.0
    for piece in range(3):
        length += before.amount[piece] * (1.0 if before.letter[piece] == STRAIGHT else radius)
    left = share * length
    before.cost, after.cost = 0.0, 0.0
    before.flat, after.flat = left, length - left
    put(poses[leg], poses[leg + 1])
    for piece in range(3):
        letter, amount = before.letter[piece], before.amount[piece]
        unit = 1.0 if letter == STRAIGHT else radius
        begin = min(amount, left / unit)
        left = max(0.0, left - begin * unit)
        before.amount[piece], after.amount[piece] = begin, amount - begin
        before.cost += price(car, letter, begin)
        after.cost += price(car, letter, amount - begin)
        drive(car, letter, begin, poses[leg + 1])
    return n + 1


@inner
def _replace(
    T: QueryArrays,
    legs: Legs,
    n: int,
    first: int,
    after: int,
    push: int,
    spare: float,
    buffer: Records,
    here: Array,
) -> int:
    """One word of a push instead of the legs from `first` up to `after`, not included; legs left, or -1.

    It may cost more than these by less than `spare`.
    """
    poses, pushes, words = legs.poses, legs.pushes, legs.words
    old = spare
    for i in range(max(first, 1), min(after + 1, n)):
        old += T.switching[pushes[i - 1], pushes[i]]
    for i in range(first, after):
        old += words[i].cost
    if first > 0 and pushes[first - 1] != push:
        old -= T.switching[pushes[first - 1], push]
        if old <= 0.0 or not changes(T, pushes[first - 1], push, poses[first]):
            return -1
    if after < n and pushes[after] != push:
        old -= T.switching[push, pushes[after]]
    if old <= 0.0:
        return -1
    if first == 0 and pushes[0] != push and not changes(T, pushes[0], push, poses[0]):
        return -1
    if after == n and not T.last[push]:
        return -1
    k = connect(T, push, poses[first], poses[after], old, TRIES, buffer, here)
    if k < 0:
        return -1
    if after < n and pushes[after] != push and not changes(T, push, pushes[after], poses[after]):
        return -1
    gone = after - first - 1
    pushes[first] = push
    words[first] = buffer[k]
    for i in range(first + 1, n - gone):
        pushes[i] = pushes[i + gone]
        words[i] = words[i + gone]
    for i in range(first + 1, n - gone + 1):
        put(poses[i + gone], poses[i])
    return n - gone


@inner
def _shift(
    T: QueryArrays, legs: Legs, n: int, low: int, high: int, state: np.ndarray, spread: float, limit: float,
    buffer: Records, here: Array,
) -> bool:  # fmt: skip
    """Shifts the knots low … high alike and steers the legs about them again; whether they cost less than the limit.

    The last knot stays within the slack of the goal.
    """
    poses, pushes, words = legs.poses, legs.pushes, legs.words
    radius = T.cars[pushes[min(low, n - 1)]].radius
    dx, dy, turn = radius * spread * _normal(state), radius * spread * _normal(state), spread * _normal(state)
    mx, my = poses[low, 0], poses[low, 1]
    c, s = math.cos(turn), math.sin(turn)
    for i in range(low, high + 1):
        x, y = poses[i, 0] - mx, poses[i, 1] - my
        poses[i, 0], poses[i, 1] = mx + dx + c * x - s * y, my + dy + s * x + c * y
        poses[i, 2] += turn
    if high == n:
        end = poses[n]
        for j in range(3):
            off = end[j] - T.goal[j]
            if j == 2:
                off -= TURN * math.floor(off / TURN + 0.5)
            end[j] = T.goal[j] + min(max(off, -T.slack[j]), T.slack[j])
        if not (free(T, pushes[n - 1], end) and lands(T, pushes[n - 1], end)):
            return False
    cost = 0.0
    for i in range(low - 1, min(high + 1, n)):
        if i >= low and pushes[i] != pushes[i - 1] and not changes(T, pushes[i - 1], pushes[i], poses[i]):
            return False
        k = connect(T, pushes[i], poses[i], poses[i + 1], limit - cost, TRIES, buffer, here)
        if k < 0:
            return False
        cost += buffer[k].cost
        words[i] = buffer[k]
    return cost < limit


@kernel()
def polish(T: QueryArrays, legs: Legs, n: int, state: np.ndarray, moves: int, worth: float) -> int:
    """Tries a number of moves; returns the number of legs that the chain then has.

    T.last is for where the chain ends; where that moves, it is renewed.
    """
    new = Legs(np.empty((MOST + 1, 3)), np.empty(MOST, np.int64), np.empty(MOST, WORD))
    buffer, off, here = np.empty(MOST_WORDS, WORD), np.empty(3), np.empty(3)
    k, cost = len(T.cars), total(T, legs, n)
    loose = (
        1 if T.slack[0] > 0.0 or T.slack[1] > 0.0 or T.slack[2] > 0.0 else 0
    )  # whether the last knot moves, too
    knot = worth * cost
    # What replanning costs more, or 0: a better chain may itself cost so much more, if replanning it costs less.
    spare = max(0.0, _worth(T, legs, n, buffer, off, here) - cost)
    cost += spare + knot * n
    for _ in range(moves):
        kind = random(state)
        m = n
        _copy(legs, n, new)
        if kind < 0.55 and (n + loose > 1 or kind > 0.5):
            if (kind > 0.45 or n + loose == 1) and n + 1 < MOST:  # with a new knot
                leg = int(random(state) * n)
                m = _split(T, new, n, leg, random(state))
                low = high = leg + 1
            else:
                low = 1 + int(random(state) * (n - 1 + loose))
                high = low
                if kind < 0.15:
                    high = min(n - 1 + loose, low + int(random(state) * 4))
            spread = math.exp(math.log(SMALL) + random(state) * (math.log(LARGE) - math.log(SMALL)))
            limit = 0.0
            for i in range(low - 1, min(high + 1, m)):
                limit += new.words[i].cost
            limit += spare - GAIN * cost
            if m > n:
                limit -= total(T, new, m) + knot * m + spare - cost
            if not _shift(T, new, m, low, high, state, spread, limit, buffer, here):
                continue
        elif kind < 0.6:
            if n == 1:
                continue
            gone = 1 + int(random(state) * (n - 1))
            push = new.pushes[gone - 1] if random(state) < 0.5 else new.pushes[gone]
            m = _replace(T, new, n, gone - 1, gone + 1, push, spare, buffer, here)
        else:
            if n + 2 >= MOST:
                continue
            first, last = int(random(state) * n), int(random(state) * n)
            if first > last:
                first, last = last, first
            if random(state) < 0.5:
                last = min(last, first + 1 + int(random(state) * 2))
            u, v = random(state), random(state)
            begin, end = first, last + 1
            if first == last and u > v:
                u, v = v, u
            push = new.pushes[first] if random(state) < 0.4 else new.pushes[last]
            if random(state) < 0.2:
                push = int(random(state) * k)
            if v < 0.9:
                m = _split(T, new, m, last, v)
            if u > 0.1:
                share = u / v if first == last and v < 0.9 else u
                m = _split(T, new, m, first, share)
                begin, end = first + 1, end + 1
            m = _replace(T, new, m, begin, end, push, spare, buffer, here)
        if m <= 0 or m >= MOST:
            continue
        value = total(T, new, m) + knot * m
        if value >= cost * (1.0 - GAIN):
            continue
        more = max(0.0, _worth(T, new, m, buffer, off, here) + knot * m - value)
        if value + more < cost * (1.0 - GAIN):
            cost, spare, n = value + more, more, m
            _copy(new, n, legs)
            for a in range(k if loose else 0):
                T.last[a] = free(T, a, legs.poses[n]) and lands(T, a, legs.poses[n])
    return n


@kernel()
def thread(T: QueryArrays, knots: Array, arrived: np.ndarray, given: Records, n: int, legs: Legs) -> int:
    """The cheapest chain over some of the knots of a path, in order.

    Leg i of the path leads with push arrived[i] and the word given[i] from knot i to knot i + 1; longer legs are words
    that keep clear, of one of the pushes of the legs that they replace. Returns how many legs the chain has.
    """
    k = len(T.cars)
    best, words = np.empty((n + 1, k)), np.empty((n + 1, k), WORD)
    before, by = np.empty((n + 1, k), np.int64), np.empty((n + 1, k), np.int64)
    for j in range(n + 1):
        for a in range(k):
            best[j, a], before[j, a], by[j, a] = np.inf, -1, -1
    buffer, here = np.empty(MOST_WORDS, WORD), np.empty(3)
    for j in range(1, n + 1):
        for i in range(max(0, j - LONGEST_SHORTCUT), j):
            for a in range(k):
                used = False
                for q in range(i, j):
                    used = used or arrived[q] == a
                if not used or (j == n and not T.last[a]):
                    continue
                cost, source = np.inf, -1
                if i == 0:
                    cost = 0.0 if a == arrived[0] else np.inf
                else:
                    for b in range(k):
                        value = best[i, b] + T.switching[b, a]
                        if value < cost and (a == b or changes(T, b, a, knots[i])):
                            cost, source = value, b
                if cost >= best[j, a]:
                    continue
                if i == j - 1 and arrived[i] == a and cost + given[i].cost < best[j, a]:
                    best[j, a], before[j, a], by[j, a] = cost + given[i].cost, i, source
                    words[j, a] = given[i]
                found = connect(T, a, knots[i], knots[j], best[j, a] - cost, TRIES, buffer, here)
                if found >= 0:
                    best[j, a], before[j, a], by[j, a] = cost + buffer[found].cost, i, source
                    words[j, a] = buffer[found]
    a = 0
    for b in range(k):
        a = b if best[n, b] < best[n, a] else a
    if best[n, a] == np.inf:
        return 0
    count, j, b = 0, n, a
    while j > 0:
        count += 1
        j, b = before[j, b], by[j, b]
    at, j, b = count, n, a
    while j > 0:
        put(knots[j], legs.poses[at])
        at -= 1
        legs.pushes[at] = b
        legs.words[at] = words[j, b]
        j, b = before[j, b], by[j, b]
    put(knots[0], legs.poses[0])
    return count
