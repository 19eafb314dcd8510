"""The compiled moves of the polish; the package's docstring explains them.

A chain is poses (n + 1, 3), pushes (n,) and rows (n, COLUMNS) of words, in arrays with room for MOST legs.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ....geometry.pose import Array
from ...refine.kernels import price
from ..kernels import COLUMNS, LAST, WORDS, changes, connect, drive, random

MOST = 256
FAR = 48  # legs of a path that one word may replace at first
TRIES = 3
SMALL, LARGE = 3e-5, 0.2  # shifts, in turning radii and radians
GAIN = 1e-9  # of the cost, that a move must save
KNOT = 5e-4  # of the cost, that a knot must save: every piece starts and ends at rest
inner = nb.njit(error_model="numpy")
outer = nb.njit(cache=True, nogil=True, error_model="numpy")


@inner
def _normal(state: Any) -> float:
    return math.sqrt(-2.0 * math.log(1.0 - random(state))) * math.cos(2.0 * math.pi * random(state))


@outer
def total(T: Any, pushes: Any, rows: Array, n: int) -> float:
    """What a chain costs."""
    cost = rows[0, 0]
    for i in range(1, n):
        cost += rows[i, 0] + T[8][pushes[i - 1], pushes[i]]
    return cost


@inner
def _copy(
    poses: Array, pushes: Any, rows: Array, n: int, to_poses: Array, to_pushes: Any, to_rows: Array
) -> None:
    for i in range(n):
        to_pushes[i] = pushes[i]
        for j in range(3):
            to_poses[i, j] = poses[i, j]
        for j in range(COLUMNS):
            to_rows[i, j] = rows[i, j]
    for j in range(3):
        to_poses[n, j] = poses[n, j]


@inner
def _split(T: Any, poses: Array, pushes: Any, rows: Array, n: int, leg: int, share: float) -> int:
    """Puts a knot into a leg, after a share of its way, on the path; returns the number of legs."""
    a = pushes[leg]
    car, law = T[6][a], T[7][a]
    for i in range(n, leg, -1):
        for j in range(3):
            poses[i + 1, j] = poses[i, j]
    for i in range(n - 1, leg - 1, -1):
        pushes[i + 1] = pushes[i]
        for j in range(COLUMNS):
            rows[i + 1, j] = rows[i, j]
    way = 0.0
    for piece in range(3):
        way += rows[leg, 2 + 2 * piece] * (1.0 if rows[leg, 1 + 2 * piece] == 1.0 else car[6])
    left = share * way
    rows[leg, 0], rows[leg + 1, 0] = 0.0, 0.0
    for j in range(3):
        poses[leg + 1, j] = poses[leg, j]
    for piece in range(3):
        letter, amount = int(rows[leg, 1 + 2 * piece]), rows[leg, 2 + 2 * piece]
        unit = 1.0 if letter == 1 else car[6]
        begin = min(amount, left / unit)
        left = max(0.0, left - begin * unit)
        rows[leg, 2 + 2 * piece], rows[leg + 1, 2 + 2 * piece] = begin, amount - begin
        rows[leg, 0] += price(law[letter], begin)
        rows[leg + 1, 0] += price(law[letter], amount - begin)
        drive(car, letter, begin, poses[leg + 1])
    return n + 1


@inner
def _replace(
    T: Any,
    poses: Array,
    pushes: Any,
    rows: Array,
    n: int,
    first: int,
    after: int,
    push: int,
    buffer: Array,
    here: Array,
) -> int:
    """One word of a push instead of the legs from `first` up to `after`, not included; legs left, or -1."""
    old = 0.0
    for i in range(max(first, 1), min(after + 1, n)):
        old += T[8][pushes[i - 1], pushes[i]]
    for i in range(first, after):
        old += rows[i, 0]
    if first > 0 and pushes[first - 1] != push:
        old -= T[8][pushes[first - 1], push]
        if old <= 0.0 or not changes(T, pushes[first - 1], push, poses[first]):
            return -1
    if after < n and pushes[after] != push:
        old -= T[8][push, pushes[after]]
    if old <= 0.0:
        return -1
    if first == 0 and pushes[0] != push and not changes(T, pushes[0], push, poses[0]):
        return -1
    if after == n and T[9][LAST + push] == 0.0:
        return -1
    k = connect(T, push, poses[first], poses[after], old, TRIES, buffer, here)
    if k < 0:
        return -1
    if after < n and pushes[after] != push and not changes(T, push, pushes[after], poses[after]):
        return -1
    gone = after - first - 1
    pushes[first] = push
    for j in range(COLUMNS):
        rows[first, j] = buffer[k, j]
    for i in range(first + 1, n - gone):
        pushes[i] = pushes[i + gone]
        for j in range(COLUMNS):
            rows[i, j] = rows[i + gone, j]
    for i in range(first + 1, n - gone + 1):
        for j in range(3):
            poses[i, j] = poses[i + gone, j]
    return n - gone


@inner
def _shift(
    T: Any, poses: Array, pushes: Any, rows: Array, n: int, low: int, high: int, state: Any, spread: float,
    limit: float, buffer: Array, here: Array,
) -> bool:  # fmt: skip
    """Shifts the knots low … high alike and steers the legs about them again; whether they cost less than the limit."""
    radius = T[6][pushes[low], 6]
    dx, dy, turn = radius * spread * _normal(state), radius * spread * _normal(state), spread * _normal(state)
    mx, my = poses[low, 0], poses[low, 1]
    c, s = math.cos(turn), math.sin(turn)
    for i in range(low, high + 1):
        x, y = poses[i, 0] - mx, poses[i, 1] - my
        poses[i, 0], poses[i, 1] = mx + dx + c * x - s * y, my + dy + s * x + c * y
        poses[i, 2] += turn
    cost = 0.0
    for i in range(low - 1, high + 1):
        if i >= low and pushes[i] != pushes[i - 1] and not changes(T, pushes[i - 1], pushes[i], poses[i]):
            return False
        k = connect(T, pushes[i], poses[i], poses[i + 1], limit - cost, TRIES, buffer, here)
        if k < 0:
            return False
        cost += buffer[k, 0]
        for j in range(COLUMNS):
            rows[i, j] = buffer[k, j]
    return cost < limit


@outer
def polish(T: Any, poses: Array, pushes: Any, rows: Array, n: int, state: Any, moves: int) -> int:
    """Tries a number of moves; returns the number of legs that the chain then has."""
    new_poses, new_pushes, new_rows = (
        np.empty((MOST + 1, 3)),
        np.empty(MOST, np.int64),
        np.empty((MOST, COLUMNS)),
    )
    buffer, here = np.empty((WORDS, COLUMNS)), np.empty(3)
    k = len(T[6])
    knot = KNOT * total(T, pushes, rows, n)
    cost = total(T, pushes, rows, n) + knot * n
    for _ in range(moves):
        kind = random(state)
        m = n
        _copy(poses, pushes, rows, n, new_poses, new_pushes, new_rows)
        if kind < 0.55 and (n > 1 or kind > 0.5):
            if (kind > 0.45 or n == 1) and n + 1 < MOST:  # with a new knot
                leg = int(random(state) * n)
                m = _split(T, new_poses, new_pushes, new_rows, n, leg, random(state))
                low = high = leg + 1
            else:
                low = 1 + int(random(state) * (n - 1))
                high = low
                if kind < 0.15:
                    high = min(n - 1, low + int(random(state) * 4))
            spread = math.exp(math.log(SMALL) + random(state) * (math.log(LARGE) - math.log(SMALL)))
            limit = 0.0
            for i in range(low - 1, high + 1):
                limit += new_rows[i, 0]
            limit -= GAIN * cost
            if m > n:
                limit -= total(T, new_pushes, new_rows, m) + knot * m - cost
            if not _shift(
                T, new_poses, new_pushes, new_rows, m, low, high, state, spread, limit, buffer, here
            ):
                continue
        elif kind < 0.6:
            if n == 1:
                continue
            gone = 1 + int(random(state) * (n - 1))
            push = new_pushes[gone - 1] if random(state) < 0.5 else new_pushes[gone]
            m = _replace(T, new_poses, new_pushes, new_rows, n, gone - 1, gone + 1, push, buffer, here)
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
            push = new_pushes[first] if random(state) < 0.4 else new_pushes[last]
            if random(state) < 0.2:
                push = int(random(state) * k)
            if v < 0.9:
                m = _split(T, new_poses, new_pushes, new_rows, m, last, v)
            if u > 0.1:
                share = u / v if first == last and v < 0.9 else u
                m = _split(T, new_poses, new_pushes, new_rows, m, first, share)
                begin, end = first + 1, end + 1
            m = _replace(T, new_poses, new_pushes, new_rows, m, begin, end, push, buffer, here)
        if m <= 0 or m >= MOST:
            continue
        value = total(T, new_pushes, new_rows, m) + knot * m
        if value < cost * (1.0 - GAIN):
            cost, n = value, m
            _copy(new_poses, new_pushes, new_rows, n, poses, pushes, rows)
    return n


@outer
def thread(
    T: Any, knots: Array, arrived: Any, given: Array, n: int, poses: Array, pushes: Any, rows: Array
) -> int:
    """The cheapest chain over some of the knots of a path, in order.

    Leg i of the path leads with push arrived[i] and the word given[i] from knot i to knot i + 1; longer legs are words
    that keep clear, of one of the pushes of the legs that they replace. Returns how many legs the chain has.
    """
    k = len(T[6])
    best = np.full((n + 1, k), np.inf)
    before, by = np.full((n + 1, k), -1, np.int64), np.full((n + 1, k), -1, np.int64)
    words = np.zeros((n + 1, k, COLUMNS))
    buffer, here = np.empty((WORDS, COLUMNS)), np.empty(3)
    for j in range(1, n + 1):
        for i in range(max(0, j - FAR), j):
            for a in range(k):
                used = False
                for q in range(i, j):
                    used = used or arrived[q] == a
                if not used or (j == n and T[9][LAST + a] == 0.0):
                    continue
                cost, source = np.inf, -1
                if i == 0:
                    cost = 0.0 if a == arrived[0] else np.inf
                else:
                    for b in range(k):
                        value = best[i, b] + T[8][b, a]
                        if value < cost and (a == b or changes(T, b, a, knots[i])):
                            cost, source = value, b
                if cost >= best[j, a]:
                    continue
                if i == j - 1 and arrived[i] == a and cost + given[i, 0] < best[j, a]:
                    best[j, a], before[j, a], by[j, a] = cost + given[i, 0], i, source
                    for c in range(COLUMNS):
                        words[j, a, c] = given[i, c]
                found = connect(T, a, knots[i], knots[j], best[j, a] - cost, TRIES, buffer, here)
                if found >= 0:
                    best[j, a], before[j, a], by[j, a] = cost + buffer[found, 0], i, source
                    for c in range(COLUMNS):
                        words[j, a, c] = buffer[found, c]
    a = int(np.argmin(best[n]))
    if best[n, a] == np.inf:
        return 0
    count, j, b = 0, n, a
    while j > 0:
        count += 1
        j, b = before[j, b], by[j, b]
    at, j, b = count, n, a
    while j > 0:
        for c in range(3):
            poses[at, c] = knots[j, c]
        at -= 1
        pushes[at] = b
        for c in range(COLUMNS):
            rows[at, c] = words[j, b, c]
        j, b = before[j, b], by[j, b]
    for c in range(3):
        poses[0, c] = knots[0, c]
    return count
