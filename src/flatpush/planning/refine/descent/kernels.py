"""The compiled descent; the package's docstring explains it, ../kernels.py the arrays."""

import math

import numba as nb
import numpy as np
from numba import boolean as b1
from numba import float64 as f8
from numba import int64 as i8

from ....geometry.pose import Array
from ..kernels import BOTTOM, STIFF, TURN, M, N, T, V, chain_cost, compiled, shortest_flat

B = b1[::1]
MOST = 48  # arcs of a chain
CLOSED = 1e-12  # how closely the chain has to meet the goal, in turning radii
MULTIPLIERS, STEP, CHOICE = 0, 1, 2  # phases of a descent
PAYS = 1e-3  # slope by which an arc at zero must pay to be taken in


@compiled(f8(i8, N, V, i8))
def _length(leg: int, owner: Array, y: Array, n: int) -> float:
    total = 0.0
    for k in range(n):
        if owner[k] == leg:
            total += y[k]
    return total


@compiled(f8(M, T, N, N, N, V, i8, V))
def _cost(
    cars: Array, laws: Array, pushes: Array, owner: Array, letter: Array, y: Array, n: int, gradient: Array
) -> float:
    """Cost of the arcs, and its gradient."""
    total = 0.0
    for k in range(n):
        push = pushes[owner[k]]
        law = laws[push, letter[k]]
        rate = law[0] if letter[k] == 1 else law[0] / cars[push, 6]
        way = rate * y[k]
        if law[1] == np.inf:
            total += way
            gradient[k] = rate
        elif way * law[2] >= law[1] * law[1]:
            total += way / law[1] + law[1] / law[2]
            gradient[k] = rate / law[1]
        else:
            total += 2.0 * math.sqrt(max(0.0, way) / law[2])
            gradient[k] = min(STIFF * rate / law[1], rate / math.sqrt(max(1e-300, way * law[2])))
    return total


@compiled(nb.void(M, N, N, N, V, i8, V, M, M))
def _drive(
    cars: Array, pushes: Array, owner: Array, letter: Array, y: Array, n: int, start: Array, columns: Array, at: Array,
) -> None:  # fmt: skip
    """The poses before every arc and at the end go to `at`, the derivatives of the end by every arc to columns."""
    for j in range(3):
        at[0, j] = start[j]
    for k in range(n):
        car = cars[pushes[owner[k]]]
        px, py, theta = at[k, 0], at[k, 1], at[k, 2]
        c, s = math.cos(theta), math.sin(theta)
        if letter[k] == 1:
            dx, dy = c * car[4] - s * car[5], s * car[4] + c * car[5]
            columns[k, 0], columns[k, 1], columns[k, 2] = dx, dy, 0.0
            at[k + 1, 0], at[k + 1, 1], at[k + 1, 2] = px + y[k] * dx, py + y[k] * dy, theta
        else:
            bx, by = (car[0], car[1]) if letter[k] == 0 else (car[2], car[3])
            kappa = (1.0 if letter[k] == 0 else -1.0) / car[6]
            cx, cy = px + c * bx - s * by, py + s * bx + c * by
            columns[k, 0], columns[k, 1], columns[k, 2] = cx, cy, kappa
            theta += kappa * y[k]
            c, s = math.cos(theta), math.sin(theta)
            at[k + 1, 0], at[k + 1, 1], at[k + 1, 2] = cx - c * bx + s * by, cy - s * bx - c * by, theta
    for k in range(n):
        kappa = columns[k, 2]
        if kappa != 0.0:
            cx, cy = columns[k, 0], columns[k, 1]
            columns[k, 0], columns[k, 1] = -kappa * (at[n, 1] - cy), kappa * (at[n, 0] - cx)


@compiled(nb.void(M, i8))
def _eliminate(K: Array, size: int) -> None:
    """Gauss-Jordan with row pivots on the augmented matrix (size, size + 1); solutions end up in the last column."""
    for col in range(size):
        pivot = col
        for row in range(col + 1, size):
            if abs(K[row, col]) > abs(K[pivot, col]):
                pivot = row
        if abs(K[pivot, col]) < 1e-300:
            for row in range(size):
                K[row, size] = 0.0
            return
        if pivot != col:
            for j in range(col, size + 1):
                K[col, j], K[pivot, j] = K[pivot, j], K[col, j]
        inverse = 1.0 / K[col, col]
        for row in range(col + 1, size):
            factor = K[row, col] * inverse
            if factor != 0.0:
                for j in range(col + 1, size + 1):
                    K[row, j] -= factor * K[col, j]
    for col in range(size - 1, -1, -1):
        value = K[col, size]
        for j in range(col + 1, size):
            value -= K[col, j] * K[j, size]
        K[col, size] = value / K[col, col]


@compiled(nb.void(M, N, N, N, V, B, B, i8, M, V, V, f8, f8, V, b1, f8, V))
def _solve(
    cars: Array, pushes: Array, owner: Array, letter: Array, y: Array, bound: Array, short: Array, n: int,
    columns: Array, gradient: Array, lam: Array, damping: float, scale: float, miss: Array, curved: bool,
    least: float, change: Array,
) -> None:  # fmt: skip
    """The step and the multipliers: [W + damping/scale, -B'; B, 0] (change, λ) = (-gradient, -miss).

    W is the Hessian of the Lagrangian if `curved`, else nothing; B the derivatives of the end (its angle times the
    scale) and of the legs held at the least length. Arcs at their bound stay.
    """
    free = np.empty(n, np.int64)
    m = 0
    for k in range(n):
        change[k] = 0.0
        if not bound[k]:
            free[m] = k
            m += 1
    held = np.empty(len(pushes), np.int64)
    h = 0
    for i in range(len(pushes)):
        if short[i]:
            held[h] = i
            h += 1
    size = m + 3 + h
    K = np.zeros((size, size + 1))
    for a in range(m):
        k = free[a]
        K[a, a] = damping / scale
        K[a, size] = -gradient[k]
        for r in range(3):
            value = columns[k, r] * (scale if r == 2 else 1.0)
            K[m + r, a], K[a, m + r] = value, -value
        for r in range(h):
            if owner[k] == held[r]:
                K[m + 3 + r, a], K[a, m + 3 + r] = 1.0, -1.0
    for r in range(3):
        K[m + r, m + r] = 1e-12 * scale  # keeps it solvable where few arcs are left
        K[m + r, size] = -miss[r] * (scale if r == 2 else 1.0)
    for r in range(h):
        K[m + 3 + r, m + 3 + r] = 1e-12 * scale
        K[m + 3 + r, size] = least - _length(held[r], owner, y, n)
    if curved:
        for a in range(m):
            i = free[a]
            kappa = 0.0
            if letter[i] != 1:
                kappa = (1.0 if letter[i] == 0 else -1.0) / cars[pushes[owner[i]], 6]
            for b in range(a, m):
                j = free[b]
                value = -kappa * (-lam[0] * columns[j, 1] + lam[1] * columns[j, 0])
                K[a, b] += value
                if b > a:
                    K[b, a] += value
    _eliminate(K, size)
    for a in range(m):
        change[free[a]] = K[a, size]
    for r in range(len(lam)):
        lam[r] = 0.0
    for r in range(3):
        lam[r] = K[m + r, size]
    for r in range(h):
        lam[3 + held[r]] = K[m + 3 + r, size]
    lam[2] *= scale  # now per radian, so that a column's worth is its plain scalar product with λ


@compiled(b1(M, N, N, N, V, B, B, i8, V, V, f8, f8, M, V))
def _close(
    cars: Array, pushes: Array, owner: Array, letter: Array, y: Array, bound: Array,
    short: Array, n: int, start: Array, aim: Array, least: float, scale: float, columns: Array, miss: Array,
) -> bool:  # fmt: skip
    """Leads the chain back to the goal with the smallest changes of its free arcs; fills columns and miss."""
    change, lam, none = np.zeros(n), np.zeros(3 + len(pushes)), np.zeros(n)
    at = np.empty((MOST + 1, 3))
    for _ in range(12):
        _drive(cars, pushes, owner, letter, y, n, start, columns, at)
        for j in range(3):
            miss[j] = at[n, j] - aim[j]
        off = math.hypot(miss[0], miss[1]) + scale * abs(miss[2])
        for i in range(len(pushes)):
            if short[i]:
                off += abs(_length(i, owner, y, n) - least)
        if off <= CLOSED * scale:
            return True
        if off > 0.5 * scale:
            return False
        _solve(
            cars, pushes, owner, letter, y, bound, short, n, columns, none, lam, 1.0, scale, miss,
            False, least, change,
        )  # fmt: skip
        for k in range(n):
            y[k] = max(0.0, y[k] + change[k])
    return False


@compiled(b1(N, B, B, i8, M, V, V, i8))
def _release(
    owner: Array, bound: Array, short: Array, n: int, columns: Array, gradient: Array, lam: Array, count: int
) -> bool:
    """Lets go of the arc at zero, or of the shortest leg, that would pay most."""
    worst, which = -PAYS, -1
    for k in range(n):
        if bound[k] and gradient[k] < STIFF:
            slope = gradient[k] - lam[3 + owner[k]]
            for j in range(3):
                slope -= lam[j] * columns[k, j]
            if slope < worst:
                worst, which = slope, k
    for i in range(count):
        if short[i] and lam[3 + i] < worst:
            worst, which = lam[3 + i], -1 - i - 1
    if which >= 0:
        bound[which] = False
    elif which < -1:
        short[-which - 2] = False
    return which != -1


@compiled(nb.types.Tuple((i8, b1))(M, T, N, N, N, V, B, i8, M, V, V, M))
def _take_in(
    cars: Array, laws: Array, pushes: Array, owner: Array, letter: Array, y: Array, bound: Array, n: int,
    columns: Array, lam: Array, start: Array, at: Array,
) -> tuple[int, bool]:  # fmt: skip
    """Drops the arcs at zero and inserts the one that pays most; (number of arcs, whether there is one)."""
    kept = 0
    for k in range(n):
        if not bound[k]:
            owner[kept], letter[kept], y[kept], bound[kept] = owner[k], letter[k], y[k], False
            kept += 1
    n = kept
    _drive(cars, pushes, owner, letter, y, n, start, columns, at)
    worst, place, who, what = -PAYS, -1, 0, 0
    for k in range(n + 1 if n < MOST - 1 else 0):
        px, py, c, s = at[k, 0], at[k, 1], math.cos(at[k, 2]), math.sin(at[k, 2])
        for i in range(owner[k - 1] if k > 0 else 0, (owner[k] if k < n else len(pushes) - 1) + 1):
            car = cars[pushes[i]]
            for motion in range(3):
                law = laws[pushes[i], motion]
                beside = (k > 0 and owner[k - 1] == i and letter[k - 1] == motion) or (
                    k < n and owner[k] == i and letter[k] == motion
                )
                if beside or law[1] != np.inf:
                    continue
                if motion == 1:
                    worth = lam[0] * (c * car[4] - s * car[5]) + lam[1] * (s * car[4] + c * car[5])
                    slope = law[0] - worth - lam[3 + i]
                else:
                    bx, by = (car[0], car[1]) if motion == 0 else (car[2], car[3])
                    kappa = (1.0 if motion == 0 else -1.0) / car[6]
                    cx, cy = px + c * bx - s * by, py + s * bx + c * by
                    worth = kappa * (lam[1] * (at[n, 0] - cx) - lam[0] * (at[n, 1] - cy) + lam[2])
                    slope = law[0] / car[6] - worth - lam[3 + i]
                if slope < worst:
                    worst, place, who, what = slope, k, i, motion
    if place < 0:
        return n, False
    for k in range(n, place, -1):
        owner[k], letter[k], y[k] = owner[k - 1], letter[k - 1], y[k - 1]
    owner[place], letter[place], y[place], bound[n] = who, what, 0.0, False
    return n + 1, True


@compiled(b1(M, T, N, T, M, f8, i8))
def _descend_arcs(
    cars: Array,
    laws: Array,
    pushes: Array,
    legs: Array,
    poses: Array,
    least: float,
    steps: int,
) -> bool:
    """One descent from the words of the legs; sets the inner poses. False if the goal or the lengths cannot be met."""
    count = len(pushes)
    start, goal = poses[0], poses[count]
    owner, letter = np.zeros(MOST, np.int64), np.zeros(MOST, np.int64)
    y, bound = np.zeros(MOST), np.zeros(MOST, np.bool_)
    n = 0
    turn = 0.0
    for i in range(count):
        for j in range(3):
            owner[n], letter[n] = i, int(legs[i, j, 0])
            size = legs[i, j, 1]
            if letter[n] == 1:
                y[n] = size
            else:
                y[n] = size * cars[pushes[i], 6]
                turn += size if letter[n] == 0 else -size
            if y[n] < BOTTOM:
                y[n] = 0.0
                bound[n] = True
            n += 1
    scale = cars[pushes[0], 6]
    aim = goal.copy()
    aim[2] += TURN * np.floor((turn + start[2] - goal[2]) / TURN + 0.5)

    columns, trial_columns = np.zeros((MOST, 3)), np.zeros((MOST, 3))
    at = np.empty((MOST + 1, 3))
    short = np.zeros(count, np.bool_)  # legs held at the least length
    for i in range(count):
        short[i] = _length(i, owner, y, n) < least
    trial, change = y.copy(), np.zeros(MOST)
    gradient, trial_gradient = np.zeros(MOST), np.zeros(MOST)
    lam = np.zeros(3 + count)
    miss = np.zeros(3)
    closed = _close(cars, pushes, owner, letter, y, bound, short, n, start, aim, least, scale, columns, miss)
    if not closed:
        return False
    cost = _cost(cars, laws, pushes, owner, letter, y, n, gradient)
    damping, quiet, phase = 1e-2, False, MULTIPLIERS
    for _ in range(steps):
        curved = phase == STEP
        _solve(
            cars, pushes, owner, letter, y, bound, short, n, columns, gradient, lam,
            damping if curved else 1.0, scale, miss, curved, least, change,
        )  # fmt: skip
        if phase == MULTIPLIERS:
            phase = STEP
            continue
        if phase == CHOICE:
            # Let go of the bound that hinders most, or take in an arc that pays.
            freed = _release(owner, bound, short, n, columns, gradient, lam, count)
            if not freed:
                n, freed = _take_in(cars, laws, pushes, owner, letter, y, bound, n, columns, lam, start, at)
                if not freed:
                    break
                _drive(cars, pushes, owner, letter, y, n, start, columns, at)
                cost = _cost(cars, laws, pushes, owner, letter, y, n, gradient)
            damping, phase = 1e-2, MULTIPLIERS
            continue
        # As far as the first arc or leg allows, and not further than 0.7 radii.
        most, part, hit, hit_leg = 0.0, 1.0, -1, -1
        for k in range(n):
            most = max(most, abs(change[k]))
            if change[k] < 0.0 and -change[k] * part > y[k]:
                part, hit = y[k] / -change[k], k
        if most * part > 0.7 * scale:
            part, hit = 0.7 * scale / most, -1
        for i in range(count):
            if not short[i]:
                slack, rate = _length(i, owner, y, n) - least, _length(i, owner, change, n)
                if rate < 0.0 and -rate * part > slack:
                    part, hit, hit_leg = max(0.0, slack) / -rate, -1, i
        if most * part <= 1e-9 * scale:
            if hit >= 0 and most > 1e-9 * scale:  # it is at zero and wants to shrink: hold it there
                y[hit] = 0.0
                bound[hit] = True
                phase = MULTIPLIERS
            elif hit_leg >= 0 and most > 1e-9 * scale:
                short[hit_leg] = True
                phase = MULTIPLIERS
            else:
                phase = CHOICE
            continue
        for k in range(n):
            trial[k] = max(0.0, y[k] + part * change[k])
        if hit >= 0:
            trial[hit] = 0.0
            bound[hit] = True
        if hit_leg >= 0:
            short[hit_leg] = True
        accepted = False
        closed = _close(
            cars, pushes, owner, letter, trial, bound, short, n, start, aim, least, scale,
            trial_columns, miss,
        )  # fmt: skip
        if closed:
            value = _cost(cars, laws, pushes, owner, letter, trial, n, trial_gradient)
            if value < cost - 1e-12 * cost:
                accepted = True
                quiet = cost - value < 1e-6 * cost
                cost = value
                for k in range(n):
                    y[k], gradient[k] = trial[k], trial_gradient[k]
                    for j in range(3):
                        columns[k, j] = trial_columns[k, j]
        if accepted:
            damping = max(0.1 * damping, 1e-8)
            phase = CHOICE if quiet else STEP
        else:
            for j in range(3):
                miss[j] = 0.0
            if hit >= 0 and y[hit] > 0.0:
                bound[hit] = False
            if hit_leg >= 0:
                short[hit_leg] = False
            damping = max(10.0 * damping, 1e-6)
            if damping >= 1e5:
                phase = CHOICE
    _drive(cars, pushes, owner, letter, y, n, start, columns, at)
    k = 0
    for i in range(1, count):
        while k < n and owner[k] < i:
            k += 1
        for j in range(3):
            poses[i, j] = at[k, j]
    return True


@compiled(f8(M, T, N, M, f8, i8, i8))
def descend(
    cars: Array,
    laws: Array,
    pushes: Array,
    poses: Array,
    least: float,
    repeats: int,
    steps: int,
) -> float:
    """Lowers the cost of a plan without switching; poses (n + 1, 3) are moved in place, both ends stay.

    Returns inf, with the poses as they were, if a leg stays shorter than `least` (a single leg may).
    """
    legs = np.empty((len(pushes), 3, 2))
    here = poses.copy()
    best = np.inf
    if len(pushes) == 1:
        return chain_cost(cars, laws, pushes, poses, legs)
    for repeat in range(repeats + 1):
        cost = chain_cost(cars, laws, pushes, here, legs)
        if cost == np.inf:
            break
        valid = shortest_flat(cars, pushes, legs) >= least * (1.0 - 1e-9)
        better = cost < best - 1e-7 * cost
        if valid and cost < best:
            best = cost
            for i in range(1, len(pushes)):
                for j in range(3):
                    poses[i, j] = here[i, j]
        if repeat == repeats or (best < np.inf and not better):
            break
        if not _descend_arcs(cars, laws, pushes, legs, here, least, steps):
            break
    return best
