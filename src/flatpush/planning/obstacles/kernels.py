"""Compiled edges among obstacles: all words of a push from pose to pose, whether they keep clear, where fingers land.

A task comes as a tuple (W, points, balls, tips, hands, backs, cars, laws, switching, numbers), see Task.arrays.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ...geometry.collision.kernels import arc_gap, line_gap, pose_gap
from ...geometry.pose import Array
from ..refine.kernels import price

TURN = 2 * math.pi
TOLERANCE = 5e-11  # as in refine/kernels.py
BOTTOM = 1e-10  # an amount below this is nothing [m, rad]
NEED, ROOM, INSIDE, LAST = (
    0,
    1,
    2,
    3,
)  # places in a task's numbers; from LAST on: whether a push may end at the goal
WORDS, COLUMNS = 12, 7  # most words; cost, then letter and amount of three pieces
inner = nb.njit(error_model="numpy")
outer = nb.njit(cache=True, nogil=True, error_model="numpy")


@inner
def random(state: Any) -> float:
    """Uniform in [0, 1): splitmix64."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return float((z ^ (z >> np.uint64(31))) >> np.uint64(11)) / 9007199254740992.0


@outer
def words(car: Array, law: Array, start: Array, goal: Array, out: Array) -> int:
    """All words of a car from pose to pose, cheapest first; fills rows (cost, letter, amount, …), returns how many.

    Letters: 0 left, 1 straight, 2 right. Derivation and tolerances: steering/three_twist.py.
    """
    c, s = math.cos(start[2]), math.sin(start[2])
    gx, gy = goal[0] - start[0], goal[1] - start[1]
    x, y = c * gx + s * gy, c * gy - s * gx
    theta = goal[2] - start[2]
    c, s = math.cos(theta), math.sin(theta)
    ux, uy = car[4], car[5]
    span = 2.0 * car[6]
    scale = math.hypot(x, y) + span
    tolerance = TOLERANCE * scale
    count = 0
    for index in range(6):
        lefts = index % 2 == 0
        ends_left = index == 0 or index == 3 or index == 4
        ax, ay = (car[0], car[1]) if lefts else (car[2], car[3])
        bx, by = (car[0], car[1]) if ends_left else (car[2], car[3])
        sense_a, sense_b = 1.0 if lefts else -1.0, 1.0 if ends_left else -1.0
        wx, wy = x + c * bx - s * by - ax, y + s * bx + c * by - ay
        square = wx * wx + wy * wy
        length = math.sqrt(square)
        dx, dy = bx - ax, by - ay
        along, across = dx * ux + dy * uy, dx * uy - dy * ux
        for option in range(2):
            if index < 4:
                root = math.sqrt(max(0.0, square - across * across))
                amount = max(0.0, (root if option == 0 else -root) - along)
                if option == 1 and amount == 0.0:
                    continue
                turned, letter = 0.0, 1
                arm_x, arm_y = dx + amount * ux, dy + amount * uy
            else:
                amount = 2.0 * math.asin(min(1.0, length / (2.0 * span)))
                amount = amount if option == 0 else TURN - amount
                turned, letter = -sense_a * amount, 2 if lefts else 0
                ex, ey = 1.0 - math.cos(turned), -math.sin(turned)
                ox, oy = (car[2] - ax, car[3] - ay) if lefts else (car[0] - ax, car[1] - ay)
                arm_x, arm_y = ox * ex - oy * ey, ox * ey + oy * ex
            arm = math.sqrt(arm_x * arm_x + arm_y * arm_y)
            if abs(arm - length) > tolerance:
                continue
            middle = price(law[letter], amount)
            alpha = math.atan2(wy * arm_x - wx * arm_y, wx * arm_x + wy * arm_y)
            rest = theta - turned
            loose = arm < 1e-5 * scale  # then the direction of w says little
            best = np.inf
            first, last = 0.0, 0.0
            for snap in range(3):
                if snap == 1 and not (loose or (sense_a * alpha) % TURN > TURN - 1e-5):
                    continue
                if snap == 2 and not (loose or (sense_b * (rest - alpha)) % TURN > TURN - 1e-5):
                    continue
                a = alpha if snap == 0 else (0.0 if snap == 1 else rest)
                begin = (sense_a * a) % TURN
                end = 0.0 if snap == 2 else (sense_b * (rest - a)) % TURN
                total = middle + price(law[0 if lefts else 2], begin) + price(law[0 if ends_left else 2], end)
                if total < best:
                    ca, sa = math.cos(a), math.sin(a)
                    if math.hypot(ca * arm_x - sa * arm_y - wx, sa * arm_x + ca * arm_y - wy) <= tolerance:
                        best, first, last = total, begin, end
            if best == np.inf:
                continue
            at = count
            while at > 0 and out[at - 1, 0] > best:
                for j in range(COLUMNS):
                    out[at, j] = out[at - 1, j]
                at -= 1
            out[at, 0] = best
            out[at, 1], out[at, 2] = 0.0 if lefts else 2.0, first
            out[at, 3], out[at, 4] = letter, amount
            out[at, 5], out[at, 6] = 0.0 if ends_left else 2.0, last
            count += 1
    return count


@outer
def drive(car: Array, letter: int, amount: float, pose: Array) -> None:
    """Moves a pose along one piece."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    if letter == 1:
        pose[0] += amount * (c * car[4] - s * car[5])
        pose[1] += amount * (s * car[4] + c * car[5])
        return
    bx, by = (car[0], car[1]) if letter == 0 else (car[2], car[3])
    angle = pose[2] + (amount if letter == 0 else -amount)
    e, t = math.cos(angle), math.sin(angle)
    pose[0] += c * bx - s * by - (e * bx - t * by)
    pose[1] += s * bx + c * by - (t * bx + e * by)
    pose[2] = angle


@outer
def piece_gap(T: Any, a: int, letter: int, amount: float, pose: Array, reach: float, need: float) -> float:
    """The least clearance along one piece of push a from a free pose."""
    car, P, ball = T[6][a], T[1][a], T[2][a]
    hull = (int(ball[0]), ball[1], ball[2], ball[3])
    c, s = math.cos(pose[2]), math.sin(pose[2])
    if letter == 1:
        return line_gap(T[0], P, hull, pose[0], pose[1], c, s, amount * car[4], amount * car[5], reach, need)
    bx, by = (car[0], car[1]) if letter == 0 else (car[2], car[3])
    angle = amount if letter == 0 else -amount
    return arc_gap(T[0], P, hull, pose[0], pose[1], c, s, bx, by, angle, reach, need)


@outer
def free(T: Any, a: int, pose: Array) -> bool:
    """Whether object and fingers of push a keep the clearance at a pose."""
    ball, need = T[2][a], T[9][NEED]
    return pose_gap(T[0], T[1][a], (int(ball[0]), ball[1], ball[2], ball[3]), pose, need, need) >= need


@outer
def lands(T: Any, a: int, pose: Array) -> bool:
    """Whether the fingers of push a land and leave clear of obstacles and bounds at a pose that is free with them."""
    back, hand, need = T[5][a], T[4][a], T[9][NEED]
    if back[0] == 0.0 and back[1] == 0.0:
        return True
    c, s = math.cos(pose[2]), math.sin(pose[2])
    tips = (0, hand[1], hand[2], hand[3])
    return line_gap(T[0], T[3][a], tips, pose[0], pose[1], c, s, back[0], back[1], need, need) >= need


@outer
def turns(T: Any, a: int, pose: Array) -> bool:
    """Whether the hand may turn freely within the bounds above where it lands for push a."""
    back, hand, bounds = T[5][a], T[4][a], T[0][2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    px, py, far = hand[1] + back[0], hand[2] + back[1], hand[3] + T[9][NEED]
    x, y = pose[0] + c * px - s * py, pose[1] + s * px + c * py
    return min(min(x - bounds[0], y - bounds[1]), min(bounds[2] - x, bounds[3] - y)) >= far


@outer
def changes(T: Any, a: int, b: int, pose: Array) -> bool:
    """Whether the hand may leave push a and land at push b at a pose that is free with push a."""
    if T[8][a, b] == np.inf or not free(T, b, pose):
        return False
    if T[9][INSIDE] > 0.0 and not (turns(T, a, pose) and turns(T, b, pose)):
        return False
    if T[9][ROOM] > 0.0:
        ball, need = T[2][a], T[9][ROOM]
        room = pose_gap(T[0], T[1][a], (int(ball[0]), ball[1], ball[2], ball[3]), pose, need, need)
        if room < need:
            return False
    return lands(T, a, pose) and lands(T, b, pose)


@outer
def keeps(T: Any, a: int, start: Array, row: Array, here: Array) -> bool:
    """Whether a word of push a keeps the clearance, from a start that is free. `here` ends at its end."""
    car, need = T[6][a], T[9][NEED]
    # A few poses refuse most of what is not free; the last one says that what follows starts free.
    for piece in range(3):
        for j in range(3):
            here[j] = start[j]
        for before in range(piece):
            drive(car, int(row[1 + 2 * before]), row[2 + 2 * before], here)
        if row[2 + 2 * piece] > BOTTOM:
            drive(car, int(row[1 + 2 * piece]), 0.5 * row[2 + 2 * piece], here)
            if not free(T, a, here):
                return False
    for j in range(3):
        here[j] = start[j]
    for piece in range(3):
        letter, amount = int(row[1 + 2 * piece]), row[2 + 2 * piece]
        if amount > BOTTOM:
            if piece_gap(T, a, letter, amount, here, need, need) < need:
                return False
            drive(car, letter, amount, here)
    return True


@outer
def connect(
    T: Any, a: int, start: Array, goal: Array, limit: float, tries: int, rows: Array, here: Array
) -> int:
    """The cheapest word of push a that keeps clear and costs less than a limit, of the first few: its row, or -1.

    The start is free with this push; the goal need not be.
    """
    count = words(T[6][a], T[7][a], start, goal, rows)
    for k in range(min(count, tries)):
        if rows[k, 0] >= limit:
            return -1
        if keeps(T, a, start, rows[k], here):
            return k
    return -1
