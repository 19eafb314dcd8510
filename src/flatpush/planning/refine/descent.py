"""Moving switch poses downhill, compiled: a plan as one chain of arcs with amounts y ≥ 0 [m of the flat paths].

In the switch poses the cost has kinks and jumps. In the arcs it is smooth, for linear costs even linear: what bends is
the end of the chain, which has to stay at the goal. An arc that vanishes is a bound, not a jump.

* A turn about the world point c moves the end P along ±perp(P - c) and turns it; a straight piece moves it along
  itself. These are the columns of the end's Jacobian, and an earlier turn just turns a later column: the second
  derivative ∂²P/∂y_i ∂y_j is κ_i perp(∂P/∂y_j) for i ≤ j, with κ_i the turn per length of arc i.
* Each step solves the optimality conditions of the arcs that are not at zero, with the Hessian of the Lagrangian and a
  damping that grows until the cost falls; it stops at the first arc that vanishes, and is led back to the goal.
* The multipliers λ of the end are the constant covector of the maximum principle. An arc of a motion that is not
  part of the chain pays at a place if its price is less than λ · (its column there): such arcs are taken in, at zero.
* At the end every leg gets its cheapest word; while that pays, the descent is repeated (descend).

Legs must be at least `least` long, which is one more linear condition where it binds.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ...compiled import inner, kernel, shared
from ...geometry.pose import Array
from ...steering.six_words import CAR, LEFT, STRAIGHT, TURN, WORD, Records, cheapest_word
from ...steering.time_law import rest_to_rest

MOST = 48  # arcs of a chain
BOTTOM = 1e-13  # an amount below this is nothing [m]
STIFF = 1e3  # the slope of a cost that starts with a root, in those of full speed
CLOSED = 1e-12  # how closely the chain has to meet the goal, in turning radii
OPEN = 0.5  # how far off it may be to be led back, in turning radii
LONGEST_STEP = 0.7  # the longest step, in turning radii
STILL = 1e-9  # a step below this is none, in turning radii
PAYS = 1e-3  # slope by which an arc at zero must pay to be taken in
SOFT = 1e-12  # damping of the conditions, which keeps the step solvable where few arcs are left, in turning radii
MULTIPLIERS, STEP, CHOICE, CLOSING = 0, 1, 2, 3  # what a step is solved for

# An arc: the leg it belongs to, its letter, its amount [m of the flat path], whether it is held at zero; its turn per
# length [1/m], its centre or direction in the object frame, and what it costs: way per length, speed, acceleration
# (six_words.CAR); the pose before it, the derivative of the end, that of the cost, and the step.
ARC = np.dtype(
    [
        ("leg", np.int64), ("letter", np.int64), ("y", float), ("bound", np.int64),
        ("kappa", float), ("fixed_x", float), ("fixed_y", float),
        ("rate", float), ("speed", float), ("acceleration", float),
        ("x", float), ("y_W", float), ("theta", float),
        ("end_x", float), ("end_y", float), ("gradient", float), ("step", float),
    ]
)  # fmt: skip


class Work(NamedTuple):
    """What descents of a number of legs, one after the other, work on; the arrays are overwritten.

    Attributes:
        now, trial, spare: the chain, the one after a step, one arc; record arrays of ARC.
        words: of the legs, six_words.WORD.
        K: the system of equations of a step. lam: its multipliers: of the end, then of the legs.
        legs: _lengths. short: whether a leg is held at the least length.
        phase: what a step is solved for, of one element.
        goal: with as many turns as the chain makes. least: length of a leg [m]. radius: the unit of length [m].
        free: whether the chain may end with any angle: the condition of the angle and its multiplier are then zero.
    """

    now: Records
    trial: Records
    spare: Records
    words: Records
    K: Array
    lam: Array
    legs: Array
    short: np.ndarray
    phase: np.ndarray
    goal: Array
    least: float
    radius: float
    free: bool

    @classmethod
    def of(cls, count: int, least: float, radius: float, free: bool = False) -> "Work":
        """For plans of so many legs."""
        size = MOST + 3 + count
        return cls(
            np.zeros(MOST + 1, ARC), np.zeros(MOST + 1, ARC), np.zeros(1, ARC), np.zeros(count, WORD),
            np.empty((size, size + 1)), np.zeros(3 + count), np.empty((count, 2)), np.zeros(count, np.bool_),
            np.zeros(1, np.int64), np.zeros(3), least, radius, free,
        )  # fmt: skip


_CARS, _PUSHES, _LAM = np.zeros(1, CAR), np.zeros(1, np.int64), np.zeros(1)
_WORK, _ARCS = Work.of(1, 0.0, 0.0), np.zeros(1, ARC)


@inner
def _lay(arc: Any, car: Any, leg: int, letter: int, y: float) -> None:
    """Makes a record an arc of a leg with a car."""
    arc.leg, arc.letter, arc.bound = leg, letter, 1 if y < BOTTOM else 0
    arc.y = 0.0 if y < BOTTOM else y
    if letter == STRAIGHT:
        arc.kappa, arc.fixed_x, arc.fixed_y = 0.0, car.ahead_x, car.ahead_y
    elif letter == LEFT:
        arc.kappa, arc.fixed_x, arc.fixed_y = 1.0 / car.radius, car.left_x, car.left_y
    else:
        arc.kappa, arc.fixed_x, arc.fixed_y = -1.0 / car.radius, car.right_x, car.right_y
    arc.rate = car.rate[letter] * (1.0 if letter == STRAIGHT else abs(arc.kappa))
    arc.speed, arc.acceleration = car.speed[letter], car.acceleration[letter]


@shared(None, _ARCS, 0)
def _drive(arcs: Records, n: int) -> None:
    """Poses before every arc and at the end (arcs[n]), and the derivatives of the end, from the pose of arcs[0]."""
    for k in range(n):
        arc, after = arcs[k], arcs[k + 1]
        c, s = math.cos(arc.theta), math.sin(arc.theta)
        fx, fy = c * arc.fixed_x - s * arc.fixed_y, s * arc.fixed_x + c * arc.fixed_y
        if arc.kappa == 0.0:
            arc.end_x, arc.end_y = fx, fy
            after.x, after.y_W, after.theta = arc.x + arc.y * fx, arc.y_W + arc.y * fy, arc.theta
        else:
            arc.end_x, arc.end_y = arc.x + fx, arc.y_W + fy  # the centre, for now
            after.theta = arc.theta + arc.kappa * arc.y
            c, s = math.cos(after.theta), math.sin(after.theta)
            after.x = arc.end_x - c * arc.fixed_x + s * arc.fixed_y
            after.y_W = arc.end_y - s * arc.fixed_x - c * arc.fixed_y
    for k in range(n):
        arc = arcs[k]
        if arc.kappa != 0.0:
            x, y = arcs[n].x - arc.end_x, arcs[n].y_W - arc.end_y
            arc.end_x, arc.end_y = -arc.kappa * y, arc.kappa * x


@shared(0.0, _ARCS, 0)
def _cost(arcs: Records, n: int) -> float:
    """Cost of the arcs; their gradients are filled in."""
    total = 0.0
    for k in range(n):
        arc = arcs[k]
        way, speed = arc.rate * arc.y, arc.speed
        if speed == np.inf:
            total += way
            arc.gradient = arc.rate
        else:
            total += rest_to_rest(way, speed, arc.acceleration)
            peak = min(speed, math.sqrt(way * arc.acceleration))
            # The time of a short way begins like a root; its slope is kept within STIFF of that at full speed.
            arc.gradient = arc.rate / max(peak, speed / STIFF)
    return total


@inner
def _lengths(arcs: Records, n: int, legs: Array) -> None:
    """Lengths of the legs, and what the steps of the arcs change of them: columns 0 and 1 of legs (m, 2) [m]."""
    for i in range(len(legs)):
        legs[i, 0] = legs[i, 1] = 0.0
    for k in range(n):
        legs[arcs[k].leg, 0] += arcs[k].y
        legs[arcs[k].leg, 1] += arcs[k].step


@inner
def _eliminate(K: Array, size: int) -> None:
    """Gauss with row pivots on the augmented matrix (size, size + 1); the solution ends up in the last column."""
    for col in range(size):
        pivot = col
        for row in range(col + 1, size):
            if abs(K[row, col]) > abs(K[pivot, col]):
                pivot = row
        for j in range(col, size + 1):
            K[col, j], K[pivot, j] = K[pivot, j], K[col, j]
        inverse = 1.0 / K[col, col] if K[col, col] != 0.0 else 0.0
        for row in range(col + 1, size):
            factor = K[row, col] * inverse
            if factor != 0.0:
                for j in range(col + 1, size + 1):
                    K[row, j] -= factor * K[col, j]
    for col in range(size - 1, -1, -1):
        value = K[col, size]
        for j in range(col + 1, size):
            value -= K[col, j] * K[j, size]
        K[col, size] = value / K[col, col] if K[col, col] != 0.0 else 0.0


@shared(0.0, _WORK, _ARCS, 0, 0.0)
def _solve(work: Work, arcs: Records, n: int, damping: float) -> float:
    """The steps of the arcs and the multipliers: [W + damping/radius, -B'; B, 0] (step, λ) = (-gradient, -miss).

    W is the Hessian of the Lagrangian in the phase STEP, else nothing; when CLOSING, the gradient is nothing as well,
    the steps are the least that close the chain, and the multipliers are left alone. B are the derivatives of the end
    (its angle times the radius) and of the legs held at the least length. Arcs at their bound stay. Returns how far the
    chain is open: |miss| [m].
    """
    K, lam, legs, short, radius, phase = work.K, work.lam, work.legs, work.short, work.radius, work.phase[0]
    end, goal = arcs[n], work.goal
    x, y = goal[0] - end.x, goal[1] - end.y_W
    theta, lever = (0.0, 0.0) if work.free else ((goal[2] - end.theta) * radius, radius)
    off = math.hypot(x, y) + abs(theta)
    _lengths(arcs, n, legs)
    m = 0
    for k in range(n):
        m += 1 - arcs[k].bound
    size = m + 3
    for i in range(len(short)):
        size += short[i]
    for r in range(size):
        for c in range(size + 1):
            K[r, c] = 0.0
        K[r, r] = damping / radius if r < m else SOFT * radius
    K[m, size], K[m + 1, size], K[m + 2, size] = x, y, theta
    a = 0
    for k in range(n):
        arc = arcs[k]
        arc.step = 0.0
        if arc.bound:
            continue
        K[m, a], K[m + 1, a], K[m + 2, a] = arc.end_x, arc.end_y, arc.kappa * lever
        if phase != CLOSING:
            K[a, size] = -arc.gradient
        b = a
        for j in range(k, n if phase == STEP else k):
            if not arcs[j].bound:
                bend = arc.kappa * (lam[0] * arcs[j].end_y - lam[1] * arcs[j].end_x)
                K[a, b] += bend
                if b > a:
                    K[b, a] += bend
                b += 1
        row = m + 3
        for i in range(len(short)):
            if short[i]:
                K[row, a] = 1.0 if arc.leg == i else 0.0
                row += 1
        for r in range(m, size):
            K[a, r] = -K[r, a]
        a += 1
    row = m + 3
    for i in range(len(short)):
        if short[i]:
            K[row, size] = work.least - legs[i, 0]
            off += abs(K[row, size])
            row += 1
    _eliminate(K, size)
    a = 0
    for k in range(n):
        if not arcs[k].bound:
            arcs[k].step = K[a, size]
            a += 1
    if phase != CLOSING:
        lam[0], lam[1], lam[2] = K[m, size], K[m + 1, size], K[m + 2, size] * radius  # per m, m, rad
        row = m + 3
        for i in range(len(short)):
            lam[3 + i] = 0.0
            if short[i]:
                lam[3 + i] = K[row, size]
                row += 1
    return off


@shared(False, _WORK, _ARCS, 0)
def _close(work: Work, arcs: Records, n: int) -> bool:
    """Leads the chain back to the goal with the smallest changes of its free arcs."""
    work.phase[0] = CLOSING
    for _ in range(12):
        _drive(arcs, n)
        off = _solve(work, arcs, n, 1.0)
        if off <= CLOSED * work.radius:
            return True
        if off > OPEN * work.radius:
            return False
        for k in range(n):
            arcs[k].y = max(0.0, arcs[k].y + arcs[k].step)
    return False


@inner
def _release(arcs: Records, n: int, short: np.ndarray, lam: Array) -> bool:
    """Lets go of the arc at zero, or of the shortest leg, that would pay most."""
    worst, which, leg = -PAYS, -1, -1
    for k in range(n):
        arc = arcs[k]
        if arc.bound and arc.gradient < STIFF:
            slope = arc.gradient - lam[3 + arc.leg]
            slope -= lam[0] * arc.end_x + lam[1] * arc.end_y + lam[2] * arc.kappa
            if slope < worst:
                worst, which = slope, k
    for i in range(len(short)):
        if short[i] and lam[3 + i] < worst:
            worst, leg = lam[3 + i], i
    if leg >= 0:
        short[leg] = False
    elif which >= 0:
        arcs[which].bound = 0
    return leg >= 0 or which >= 0


@shared((0, False), _CARS, _PUSHES, _ARCS, 0, _LAM, _ARCS[0])
def _take_in(
    cars: Records, pushes: np.ndarray, arcs: Records, n: int, lam: Array, spare: Any
) -> tuple[int, bool]:
    """Drops the arcs at zero and inserts the one that pays most; (number of arcs, whether there is one)."""
    kept = 0
    for k in range(n + 1):
        if k == n or not arcs[k].bound:
            arcs[kept] = arcs[k]
            kept += 1
    n = kept - 1
    end = arcs[n]
    worst, place, who, what = -PAYS, -1, n, n
    for k in range(n + 1 if n < MOST - 1 else 0):
        here = arcs[k]
        c, s = math.cos(here.theta), math.sin(here.theta)
        for i in range(arcs[k - 1].leg if k > 0 else 0, (here.leg if k < n else len(pushes) - 1) + 1):
            for letter in range(3):
                if (k > 0 and arcs[k - 1].leg == i and arcs[k - 1].letter == letter) or (
                    k < n and here.leg == i and here.letter == letter
                ):
                    continue
                _lay(spare, cars[pushes[i]], i, letter, 0.0)
                if spare.speed != np.inf:
                    continue
                fx, fy = c * spare.fixed_x - s * spare.fixed_y, s * spare.fixed_x + c * spare.fixed_y
                if letter == STRAIGHT:
                    worth = lam[0] * fx + lam[1] * fy
                else:
                    cx, cy = here.x + fx, here.y_W + fy
                    worth = spare.kappa * (lam[1] * (end.x - cx) - lam[0] * (end.y_W - cy) + lam[2])
                slope = spare.rate - worth - lam[3 + i]
                if slope < worst:
                    worst, place, who, what = slope, k, i, letter
    if place < 0:
        return n, False
    for k in range(n, place - 1, -1):
        arcs[k + 1] = arcs[k]
    _lay(arcs[place], cars[pushes[who]], who, what, 0.0)
    arcs[place].bound = 0
    return n + 1, True


@kernel(lent=True)
def descend(
    work: Work,
    cars: Records,
    pushes: np.ndarray,
    poses: Array,
    best: Array,
    ends: Array,
    repeats: int,
    steps: int,
) -> float:
    """Words of the legs and descents from them in turns, while that pays.

    Args:
        poses: X_WO at start, switches and goal, shape (n + 1, 3); overwritten. best: the cheapest found, alike.
        ends: start and goal, shape (2, 3), to which the words between the poses are led; (0, 3): those of the poses.
        repeats: most descents, of so many steps each.

    Returns:
        The cost of the best without switching; inf: none was found in which every leg has the least length.
    """
    words, lowest, last = work.words, np.inf, len(pushes)
    for j in range(3):
        work.lam[j] = 0.0
    for repeat in range(repeats + 1):
        cost, shortest = 0.0, np.inf
        for i in range(len(pushes)):
            cost += cheapest_word(cars[pushes[i]], poses[i], poses[i + 1], words[i])
            shortest = min(shortest, words[i].flat)
        if cost == np.inf:
            break
        if repeat == 0 and len(ends) > 0:  # with the words so far: those from the new ends may jump
            cost = np.inf
            for j in range(3):
                poses[0, j], poses[last, j] = ends[0, j], ends[1, j]
        better = cost < lowest - 1e-7 * cost
        if cost < lowest and shortest >= work.least * (1.0 - 1e-9):
            lowest = cost
            for i in range(last + 1):
                for j in range(3):
                    best[i, j] = poses[i, j]
        if (
            repeat == repeats
            or (lowest < np.inf and not better)
            or not _downhill(work, cars, pushes, poses, steps)
        ):
            break
    return lowest


@inner
def _downhill(work: Work, cars: Records, pushes: np.ndarray, poses: Array, steps: int) -> bool:
    """One descent from the words of the legs; sets the inner poses and a free last angle. False: it cannot end well."""
    words, turned = work.words, 0.0
    for i in range(len(pushes)):
        for j in range(3):
            turned += words[i].amount[j] * (1.0 - words[i].letter[j])
    for j in range(3):
        work.goal[j] = poses[len(pushes), j]
    work.goal[2] += TURN * math.floor((turned + poses[0, 2] - work.goal[2]) / TURN + 0.5)
    now, trial, legs, short, radius = work.now, work.trial, work.legs, work.short, work.radius
    n = 3 * len(pushes)
    for i in range(len(pushes)):
        car = cars[pushes[i]]
        for j in range(3):
            letter = words[i].letter[j]
            _lay(
                now[3 * i + j],
                car,
                i,
                letter,
                words[i].amount[j] * (1.0 if letter == STRAIGHT else car.radius),
            )
    now[0].x, now[0].y_W, now[0].theta = poses[0, 0], poses[0, 1], poses[0, 2]
    _lengths(now, n, legs)
    for i in range(len(short)):
        short[i] = legs[i, 0] < work.least
    if not _close(work, now, n):
        return False
    cost = _cost(now, n)
    damping, quiet, phase = 1e-2, False, MULTIPLIERS
    for _ in range(steps):
        work.phase[0] = phase
        _solve(work, now, n, damping if phase == STEP else 1.0)
        if phase == MULTIPLIERS:
            phase = STEP
            continue
        if phase == CHOICE:
            # Let go of the bound that hinders most, or take in an arc that pays.
            if not _release(now, n, short, work.lam):
                n, taken = _take_in(cars, pushes, now, n, work.lam, work.spare[0])
                if not taken:
                    break
                _drive(now, n)
                cost = _cost(now, n)
            damping, phase = 1e-2, MULTIPLIERS
            continue
        # As far as the first arc or leg allows, and not further than LONGEST_STEP.
        _lengths(now, n, legs)
        most, part, hit, hit_leg = 0.0, 1.0, -1, -1
        for k in range(n):
            most = max(most, abs(now[k].step))
            if now[k].step < 0.0 and -now[k].step * part > now[k].y:
                part, hit = now[k].y / -now[k].step, k
        if most * part > LONGEST_STEP * radius:
            part, hit = LONGEST_STEP * radius / most, -1
        for i in range(len(short)):
            slack, rate = legs[i, 0] - work.least, legs[i, 1]
            if not short[i] and rate < 0.0 and -rate * part > slack:
                part, hit, hit_leg = max(0.0, slack) / -rate, -1, i
        if most * part <= STILL * radius:
            phase = CHOICE
            if hit >= 0 and most > STILL * radius:  # it is at zero and wants to shrink: hold it there
                now[hit].y, now[hit].bound, phase = 0.0, 1, MULTIPLIERS
            elif hit_leg >= 0 and most > STILL * radius:
                short[hit_leg], phase = True, MULTIPLIERS
            continue
        for k in range(n + 1):
            trial[k] = now[k]
            trial[k].y = max(0.0, now[k].y + part * now[k].step)
        if hit >= 0:
            trial[hit].y, trial[hit].bound = 0.0, 1
        if hit_leg >= 0:
            short[hit_leg] = True
        value = _cost(trial, n) if _close(work, trial, n) else np.inf
        if value < cost - 1e-12 * cost:
            quiet = cost - value < 1e-6 * cost
            cost = value
            for k in range(n + 1):
                now[k] = trial[k]
            damping, phase = max(0.1 * damping, 1e-8), CHOICE if quiet else STEP
        else:
            if hit_leg >= 0:
                short[hit_leg] = False
            damping = max(10.0 * damping, 1e-6)
            if damping >= 1e5:
                phase = CHOICE
    k = 0
    for i in range(1, len(pushes)):
        while k < n and now[k].leg < i:
            k += 1
        poses[i, 0], poses[i, 1], poses[i, 2] = now[k].x, now[k].y_W, now[k].theta
    if work.free:
        poses[len(pushes), 2] = now[n].theta
    return True
