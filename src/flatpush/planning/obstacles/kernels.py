"""Compiled motions among obstacles: all words of a push from pose to pose, whether they keep clear, where fingers land.

A word stands in a row of COLUMNS numbers: what it costs, then letter and amount of each of its three pieces.
"""

import math
from typing import Protocol

import numpy as np

from ...compiled import inner, kernel, shared
from ...geometry.collision.body import BodyArrays
from ...geometry.collision.kernels import BODY, WORLD, arc_gap, line_gap, still_gap
from ...geometry.pose import Array
from ..path import COLUMNS, NOTHING
from .task import CAR, HULL, LAW, TaskArrays

FULL_TURN = 2 * math.pi
TOLERANCE = (
    5e-11  # of where a word ends, per length of the query: half of what steering/three_twist.py grants
)
NEARLY_ZERO = 1e-5  # an arc this near to a full turn is also tried as none [rad]
LEFT, STRAIGHT, RIGHT = range(3)
SIX, LSL, RSL, LRL = 6, 0, 3, 4  # the words in turn: LSL RSR LSR RSL LRL RLR
WORDS, COST = 12, 0  # most words of a push between two poses, each of six with two middle pieces; a column
_POINTS = BODY.points[None].copy()
_HULLS = np.zeros(1, HULL)
TASK = TaskArrays(
    WORLD, _POINTS, _HULLS, _POINTS, _HULLS, np.zeros((1, 2)), np.zeros(1, CAR), np.zeros((1, 3), LAW),
    np.zeros((1, 1)), np.zeros(1, np.bool_), 0.0, 0.0, False,
)  # fmt: skip
_POSE, _ROW, _ROWS, _STATE = np.zeros(3), np.zeros(COLUMNS), np.zeros((1, COLUMNS)), np.zeros(1, np.uint64)


class Law(Protocol):
    """A row of LAW."""

    rate: float
    speed: float
    acceleration: float


@inner
def random(state: np.ndarray) -> float:
    """Uniform in [0, 1): splitmix64, the same on every machine."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return float((z ^ (z >> np.uint64(31))) >> np.uint64(11)) / 9007199254740992.0


@inner
def letter_of(row: Array, piece: int) -> int:
    return int(row[1 + 2 * piece])


@inner
def amount_of(row: Array, piece: int) -> float:
    return row[2 + 2 * piece]


@inner
def set_piece(row: Array, piece: int, letter: int, amount: float) -> None:
    row[1 + 2 * piece], row[2 + 2 * piece] = letter, amount


@inner
def put(pose: Array, to: Array) -> None:
    """Copies a pose."""
    for j in range(3):
        to[j] = pose[j]


@inner
def copy(row: Array, to: Array) -> None:
    """Copies a row of a word; a slice would compile texts of errors."""
    for j in range(COLUMNS):
        to[j] = row[j]


@inner
def piece_cost(law: "Law", amount: float) -> float:
    """What an amount (angle [rad] or length [m]) of one motion costs, from rest to rest."""
    way = law.rate * amount
    if law.speed == np.inf:
        return way
    if way <= 0.0:
        return 0.0
    if way * law.acceleration >= law.speed * law.speed:
        return way / law.speed + law.speed / law.acceleration
    return 2.0 * math.sqrt(way / law.acceleration)


@shared(0, TASK, 0, _POSE, _POSE, _ROWS)
def words(T: TaskArrays, a: int, start: Array, goal: Array, out: Array) -> int:
    """All words of push a from pose to pose, cheapest first, into rows of `out`; returns how many.

    Derivation and tolerances: steering/three_twist.py.
    """
    car, law = T.cars[a], T.laws[a]
    c, s = math.cos(start[2]), math.sin(start[2])
    gx, gy = goal[0] - start[0], goal[1] - start[1]
    x, y = c * gx + s * gy, c * gy - s * gx
    theta = goal[2] - start[2]
    c, s = math.cos(theta), math.sin(theta)
    ux, uy = car.ahead_x, car.ahead_y
    span = 2.0 * car.radius
    scale = math.hypot(x, y) + span
    tolerance = TOLERANCE * scale
    count = 0
    for word in range(SIX):
        lefts = word % 2 == 0
        ends_left = word in (LSL, RSL, LRL)
        first_letter, last_letter = LEFT if lefts else RIGHT, LEFT if ends_left else RIGHT
        ax, ay = (car.left_x, car.left_y) if lefts else (car.right_x, car.right_y)
        bx, by = (car.left_x, car.left_y) if ends_left else (car.right_x, car.right_y)
        sense_a, sense_b = 1.0 if lefts else -1.0, 1.0 if ends_left else -1.0
        wx, wy = x + c * bx - s * by - ax, y + s * bx + c * by - ay
        square = wx * wx + wy * wy
        length = math.sqrt(square)
        dx, dy = bx - ax, by - ay
        along, across = dx * ux + dy * uy, dx * uy - dy * ux
        for option in range(2):
            if word < LRL:
                root = math.sqrt(max(0.0, square - across * across))
                amount = max(0.0, (root if option == 0 else -root) - along)
                if option == 1 and amount == 0.0:
                    continue
                turned, letter = 0.0, STRAIGHT
                arm_x, arm_y = dx + amount * ux, dy + amount * uy
            else:
                amount = 2.0 * math.asin(min(1.0, length / (2.0 * span)))
                amount = amount if option == 0 else FULL_TURN - amount
                turned, letter = -sense_a * amount, RIGHT if lefts else LEFT
                ex, ey = 1.0 - math.cos(turned), -math.sin(turned)
                ox, oy = (car.right_x - ax, car.right_y - ay) if lefts else (car.left_x - ax, car.left_y - ay)
                arm_x, arm_y = ox * ex - oy * ey, ox * ey + oy * ex
            arm = math.sqrt(arm_x * arm_x + arm_y * arm_y)
            if abs(arm - length) > tolerance:
                continue
            middle = piece_cost(law[letter], amount)
            alpha = math.atan2(wy * arm_x - wx * arm_y, wx * arm_x + wy * arm_y)
            rest = theta - turned
            loose = arm < NEARLY_ZERO * scale  # then the direction of w says little
            least = np.inf
            first, last = 0.0, 0.0
            for snap in range(3):
                if snap == 1 and not (loose or (sense_a * alpha) % FULL_TURN > FULL_TURN - NEARLY_ZERO):
                    continue
                if snap == 2 and not (
                    loose or (sense_b * (rest - alpha)) % FULL_TURN > FULL_TURN - NEARLY_ZERO
                ):
                    continue
                angle = alpha if snap == 0 else (0.0 if snap == 1 else rest)
                begin = (sense_a * angle) % FULL_TURN
                end = 0.0 if snap == 2 else (sense_b * (rest - angle)) % FULL_TURN
                total = (
                    middle
                    + piece_cost(law[LEFT if lefts else RIGHT], begin)
                    + piece_cost(law[LEFT if ends_left else RIGHT], end)
                )
                if total < least:
                    ca, sa = math.cos(angle), math.sin(angle)
                    if math.hypot(ca * arm_x - sa * arm_y - wx, sa * arm_x + ca * arm_y - wy) <= tolerance:
                        least, first, last = total, begin, end
            if least == np.inf:
                continue
            at = count
            while at > 0 and out[at - 1, COST] > least:
                copy(out[at - 1], out[at])
                at -= 1
            row = out[at]
            row[COST] = least
            set_piece(row, 0, first_letter, first)
            set_piece(row, 1, letter, amount)
            set_piece(row, 2, last_letter, last)
            count += 1
    return count


@inner
def drive(T: TaskArrays, a: int, letter: int, amount: float, pose: Array) -> None:
    """Moves a pose along one piece of push a."""
    car = T.cars[a]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    if letter == STRAIGHT:
        pose[0] += amount * (c * car.ahead_x - s * car.ahead_y)
        pose[1] += amount * (s * car.ahead_x + c * car.ahead_y)
        return
    bx, by = (car.left_x, car.left_y) if letter == LEFT else (car.right_x, car.right_y)
    angle = pose[2] + (amount if letter == LEFT else -amount)
    e, t = math.cos(angle), math.sin(angle)
    pose[0] += c * bx - s * by - (e * bx - t * by)
    pose[1] += s * bx + c * by - (t * bx + e * by)
    pose[2] = angle


@inner
def body(T: TaskArrays, a: int) -> BodyArrays:
    """Object and fingertips of push a."""
    hull = T.hulls[a]
    return BodyArrays(T.points[a], hull.corners, hull.x, hull.y, hull.reach)


@inner
def hand(T: TaskArrays, a: int) -> BodyArrays:
    """The fingertips of push a alone."""
    hull = T.hands[a]
    return BodyArrays(T.tips[a], hull.corners, hull.x, hull.y, hull.reach)


@inner
def piece_clear(T: TaskArrays, a: int, letter: int, amount: float, pose: Array) -> bool:
    """Whether one piece of push a keeps the clearance, from a pose that does."""
    car, need = T.cars[a], T.need
    c, s = math.cos(pose[2]), math.sin(pose[2])
    if letter == STRAIGHT:
        dx, dy = amount * car.ahead_x, amount * car.ahead_y
        return line_gap(T.world, body(T, a), pose[0], pose[1], c, s, dx, dy, need, need) >= need
    bx, by = (car.left_x, car.left_y) if letter == LEFT else (car.right_x, car.right_y)
    angle = amount if letter == LEFT else -amount
    return arc_gap(T.world, body(T, a), pose[0], pose[1], c, s, bx, by, angle, need, need) >= need


@inner
def roomy(T: TaskArrays, a: int, pose: Array, need: float) -> bool:
    """Whether object and fingers of push a keep a clearance at a pose."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return still_gap(T.world, body(T, a), pose[0], pose[1], c, s, need, need) >= need


@inner
def free(T: TaskArrays, a: int, pose: Array) -> bool:
    """Whether object and fingers of push a keep the task's clearance at a pose."""
    return roomy(T, a, pose, T.need)


@inner
def lands(T: TaskArrays, a: int, pose: Array) -> bool:
    """Whether the fingers of push a land and leave clear of obstacles and bounds at a pose that is free with them."""
    back = T.backs[a]
    if back[0] == 0.0 and back[1] == 0.0:
        return True
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return line_gap(T.world, hand(T, a), pose[0], pose[1], c, s, back[0], back[1], T.need, T.need) >= T.need


@inner
def turns(T: TaskArrays, a: int, pose: Array) -> bool:
    """Whether the hand may turn freely within the bounds above where it lands for push a."""
    back, hull, bounds = T.backs[a], T.hands[a], T.world.bounds
    c, s = math.cos(pose[2]), math.sin(pose[2])
    px, py, far = hull.x + back[0], hull.y + back[1], hull.reach + T.need
    x, y = pose[0] + c * px - s * py, pose[1] + s * px + c * py
    return min(min(x - bounds.xmin, y - bounds.ymin), min(bounds.xmax - x, bounds.ymax - y)) >= far


@shared(False, TASK, 0, 0, _POSE)
def changes(T: TaskArrays, a: int, b: int, pose: Array) -> bool:
    """Whether the hand may leave push a and land at push b at a pose that is free with push a."""
    if T.switching[a, b] == np.inf or not free(T, b, pose):
        return False
    if T.inside and not (turns(T, a, pose) and turns(T, b, pose)):
        return False
    if T.room > 0.0 and not roomy(T, a, pose, T.room):
        return False
    return lands(T, a, pose) and lands(T, b, pose)


@shared(False, TASK, 0, _POSE, _ROW, _POSE)
def keeps(T: TaskArrays, a: int, start: Array, row: Array, here: Array) -> bool:
    """Whether a word of push a keeps the clearance, from a start that is free. `here` ends at its end."""
    # The middles of its pieces refuse most of what is not free.
    put(start, here)
    for piece in range(3):
        letter, half = letter_of(row, piece), 0.5 * amount_of(row, piece)
        if amount_of(row, piece) > NOTHING:
            drive(T, a, letter, half, here)
            if not free(T, a, here):
                return False
            drive(T, a, letter, half, here)
    put(start, here)
    for piece in range(3):
        letter, amount = letter_of(row, piece), amount_of(row, piece)
        if amount > NOTHING:
            if not piece_clear(T, a, letter, amount, here):
                return False
            drive(T, a, letter, amount, here)
    return True


@inner
def connect(
    T: TaskArrays, a: int, start: Array, goal: Array, limit: float, tries: int, rows: Array, here: Array
) -> int:
    """The cheapest word of push a that keeps clear and costs less than a limit, of the first few: its row, or -1.

    The start is free with this push; the goal need not be.
    """
    count = words(T, a, start, goal, rows)
    for k in range(min(count, tries)):
        if rows[k, COST] >= limit:
            return -1
        if keeps(T, a, start, rows[k], here):
            return k
    return -1


@kernel()
def stands(T: TaskArrays, a: int, pose: Array) -> bool:
    """Whether push a may begin or end at a pose: object and fingers are free, and the fingers land."""
    return free(T, a, pose) and lands(T, a, pose)


@kernel()
def words_between(T: TaskArrays, a: int, start: Array, goal: Array, out: Array) -> int:
    """All words of push a from pose to pose, as `words`."""
    return words(T, a, start, goal, out)


@kernel()
def word_clear(T: TaskArrays, a: int, start: Array, row: Array) -> bool:
    """Whether a word of push a keeps the clearance, its start included."""
    return free(T, a, start) and keeps(T, a, start, row, np.empty(3))


@kernel()
def path_clear(T: TaskArrays, start: Array, pushes: np.ndarray, letters: np.ndarray, amounts: Array) -> bool:
    """Whether a path keeps the clearance: where it begins and ends, its pieces, and its changes of push."""
    pose, last = start.copy(), len(pushes) - 1
    if not (free(T, pushes[0], pose) and lands(T, pushes[0], pose)):
        return False
    for i in range(len(pushes)):
        a = pushes[i]
        if i > 0 and a != pushes[i - 1] and not changes(T, pushes[i - 1], a, pose):
            return False
        if not piece_clear(T, a, letters[i], amounts[i], pose):
            return False
        drive(T, a, letters[i], amounts[i], pose)
        if not free(T, a, pose):
            return False
    return lands(T, pushes[last], pose)
