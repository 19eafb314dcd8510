"""The six words of a car, compiled: the one kernel that refinement, obstacles and control call.

three_twist.py derives the words ([Dubins1957] for one radius, [Furtuna2010]) and is the plain twin. A fleet comes as a
record array (k,) of CAR, which Fleet.cars makes; a word is a record of WORD. Kernels call, on one car and poses X_WO of
shape (3,):

    cost = cheapest_word(cars[push], start, goal, found)     # fills the record found, e.g. words[0]
    count = all_words(cars[push], start, goal, found)        # fills the first records of an array (MOST_WORDS,)
    drive(cars[push], letter, amount, pose)                  # moves the pose along one piece, in place
    price(cars[push], letter, amount)                        # what one piece costs

From Python call chain_cost (one leg or several) and every_word.
"""

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from ..compiled import inner, kernel, shared
from ..formulas import Record
from ..geometry.pose import Array
from .time_law import rest_to_rest

TURN = 2 * math.pi  # a full turn [rad]
# How far a word may end from the goal, per length of the query; half of what three_twist.py grants, so that whatever
# is accepted here is accepted there.
TOLERANCE = 5e-11
# An angle that falls short of a full turn by less than this [rad] may be a zero that rounding spoilt; so may be any
# where an arm is shorter than this part of the query, because its direction says little.
SNAP = 1e-5
LEFT, STRAIGHT, RIGHT = 0, 1, 2  # letters of a piece
MOST_WORDS = 12  # both middle arcs of LRL and RLR, both lengths of the four others

# Turning centres in the object frame [m], the unit vector straight on, half the distance of the centres [m]; then for
# left, straight and right the way of what is paid for per radian or metre, and the time law along that way: a speed
# [m/s], infinite where the cost is the way itself, and an acceleration [m/s²] (Fleet).
CAR = np.dtype(
    [
        ("left_x", float), ("left_y", float), ("right_x", float), ("right_y", float),
        ("ahead_x", float), ("ahead_y", float), ("radius", float),
        ("rate", float, 3), ("speed", float, 3), ("acceleration", float, 3),
    ]
)  # fmt: skip
# The cost of a word, its length along the path of the flat point [m], and letter and amount (angle [rad] or length [m])
# of its three pieces.
WORD = np.dtype([("cost", float), ("flat", float), ("letter", np.int64, 3), ("amount", float, 3)])
Records = NDArray[np.void]  # a record array
CARS, WORDS = nb.from_dtype(CAR)[::1], nb.from_dtype(WORD)[::1]


class _Goal(NamedTuple):
    """The goal seen from the start: position [m], angle [rad] with cosine and sine, and the length of the query [m]."""

    x: float
    y: float
    theta: float
    c: float
    s: float
    scale: float


_CAR, _WORD, _GOAL = np.zeros(1, CAR)[0], np.zeros(1, WORD)[0], _Goal(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inner
def cheapest_word(car: Record, start: Array, goal: Array, found: Record) -> float:
    """Cost of the cheapest word of a car from pose to pose (inf: none), which is filled in."""
    seen = _seen(car, start, goal)
    best = np.inf
    for option in range(MOST_WORDS):
        best = min(best, _word(car, seen, option, best, found))
    return best


@inner
def all_words(car: Record, start: Array, goal: Array, found: Records) -> int:
    """How many words of a car lead from pose to pose; they are filled in, cheapest first."""
    seen = _seen(car, start, goal)
    count = 0
    for option in range(MOST_WORDS):
        cost = _word(car, seen, option, np.inf, found[count])
        if cost == np.inf:
            continue
        for at in range(count, 0, -1):
            if found[at - 1].cost <= found[at].cost:
                break
            _swap(found[at - 1], found[at])
        count += 1
    return count


@inner
def _swap(a: Record, b: Record) -> None:
    a.cost, b.cost = b.cost, a.cost
    a.flat, b.flat = b.flat, a.flat
    for j in range(3):
        a.letter[j], b.letter[j] = b.letter[j], a.letter[j]
        a.amount[j], b.amount[j] = b.amount[j], a.amount[j]


@inner
def price(car: Record, letter: int, amount: float) -> float:
    """What an amount (angle [rad] or length [m]) of one piece costs: its way, or the time from rest to rest."""
    way, speed = car.rate[letter] * amount, car.speed[letter]
    if speed == np.inf:
        return way
    return rest_to_rest(way, speed, car.acceleration[letter])


@inner
def drive(car: Record, letter: int, amount: float, pose: Array) -> None:
    """Moves a pose X_WO along one piece."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    if letter == STRAIGHT:
        pose[0] += amount * (c * car.ahead_x - s * car.ahead_y)
        pose[1] += amount * (s * car.ahead_x + c * car.ahead_y)
        return
    bx, by, sense = (car.left_x, car.left_y, 1.0) if letter == LEFT else (car.right_x, car.right_y, -1.0)
    angle = pose[2] + sense * amount
    e, t = math.cos(angle), math.sin(angle)
    pose[0] += c * bx - s * by - (e * bx - t * by)
    pose[1] += s * bx + c * by - (t * bx + e * by)
    pose[2] = angle


@inner
def _seen(car: Record, start: Array, goal: Array) -> _Goal:
    c, s = math.cos(start[2]), math.sin(start[2])
    gx, gy, theta = goal[0] - start[0], goal[1] - start[1], goal[2] - start[2]
    x, y = c * gx + s * gy, c * gy - s * gx
    return _Goal(x, y, theta, math.cos(theta), math.sin(theta), math.hypot(x, y) + 2.0 * car.radius)


@shared(0.0, _CAR, _GOAL, 0, 0.0, _WORD)
def _word(car: Record, goal: _Goal, option: int, limit: float, found: Record) -> float:
    """Cost of one of the twelve words, filled in if it leads to the goal for less than a limit; else inf.

    As in three_twist.py the body point of the last centre moves by w, seen from the first: an arm, turned by the first
    arc, has to lie on w. A first or last arc near a full turn is also tried as zero, and accepted by where it ends.
    """
    index, second = option // 2, option % 2 == 1
    lefts, ends_left = index % 2 == 0, index == 0 or index == 3 or index == 4  # LSL RSR LSR RSL LRL RLR
    ax, ay = (car.left_x, car.left_y) if lefts else (car.right_x, car.right_y)
    bx, by = (car.left_x, car.left_y) if ends_left else (car.right_x, car.right_y)
    sense_a, sense_b = 1.0 if lefts else -1.0, 1.0 if ends_left else -1.0
    wx, wy = goal.x + goal.c * bx - goal.s * by - ax, goal.y + goal.s * bx + goal.c * by - ay
    length = math.sqrt(wx * wx + wy * wy)
    tolerance = TOLERANCE * goal.scale
    turned, letter = 0.0, STRAIGHT
    if index < 4:
        dx, dy = bx - ax, by - ay
        along, across = dx * car.ahead_x + dy * car.ahead_y, dx * car.ahead_y - dy * car.ahead_x
        root = math.sqrt(max(0.0, length * length - across * across))
        amount = max(0.0, (-root if second else root) - along)
        if second and amount == 0.0 and root - along <= 0.0:
            return np.inf  # that is the first one
        arm_x, arm_y = dx + amount * car.ahead_x, dy + amount * car.ahead_y
    else:
        amount = 2.0 * math.asin(min(1.0, length / (4.0 * car.radius)))
        amount = TURN - amount if second else amount
        turned, letter = -sense_a * amount, RIGHT if lefts else LEFT
        ex, ey = 1.0 - math.cos(turned), -math.sin(turned)
        ox, oy = sense_a * (car.right_x - car.left_x), sense_a * (car.right_y - car.left_y)
        arm_x, arm_y = ox * ex - oy * ey, ox * ey + oy * ex
    middle = price(car, letter, amount)
    arm = math.sqrt(arm_x * arm_x + arm_y * arm_y)
    if middle >= limit or abs(arm - length) > tolerance:
        return np.inf
    letter_a, letter_b = LEFT if lefts else RIGHT, LEFT if ends_left else RIGHT
    alpha = math.atan2(wy * arm_x - wx * arm_y, wx * arm_x + wy * arm_y)
    rest = goal.theta - turned
    short = TURN if arm < SNAP * goal.scale else SNAP
    best = np.inf
    for zero in range(3):  # none, the first arc, the last arc
        if (zero == 1 and (sense_a * alpha) % TURN <= TURN - short) or (
            zero == 2 and (sense_b * (rest - alpha)) % TURN <= TURN - short
        ):
            continue
        a = alpha if zero == 0 else (0.0 if zero == 1 else rest)
        first = (sense_a * a) % TURN
        last = 0.0 if zero == 2 else (sense_b * (rest - a)) % TURN
        total = middle + price(car, letter_a, first) + price(car, letter_b, last)
        if total >= limit:
            continue
        ca, sa = math.cos(a), math.sin(a)
        if math.hypot(ca * arm_x - sa * arm_y - wx, sa * arm_x + ca * arm_y - wy) <= tolerance:
            limit = best = found.cost = total
            found.letter[0], found.letter[1], found.letter[2] = letter_a, letter, letter_b
            found.amount[0], found.amount[1], found.amount[2] = first, amount, last
            found.flat = car.radius * (first + last) + amount * (1.0 if letter == STRAIGHT else car.radius)
    return best


@kernel(nb.float64(CARS, nb.int64[::1], nb.float64[:, ::1], WORDS))
def chain_cost(cars: Records, pushes: Array, poses: Array, words: Records) -> float:
    """Cost of the cheapest words (n,) of pushes (n,) between poses (n + 1, 3), which are filled in; no switching."""
    total = 0.0
    for i in range(len(pushes)):
        total += cheapest_word(cars[pushes[i]], poses[i], poses[i + 1], words[i])
    return total


@kernel()
def every_word(cars: Records, push: int, start: Array, goal: Array, found: Records) -> int:
    """How many words of a push lead from pose to pose; found (MOST_WORDS,) is filled, cheapest first."""
    return all_words(cars[push], start, goal, found)
