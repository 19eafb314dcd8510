"""Compiled motions among obstacles: whether the words of a push keep clear, and where fingers land and leave."""

import math

import numpy as np

from ...compiled import inner, kernel, shared
from ...formulas import Record
from ...geometry.collision.body import BodyArrays
from ...geometry.collision.kernels import BODY, WORLD, arc_gap, line_gap, still_gap
from ...geometry.pose import Array
from ...steering.six_words import CAR, LEFT, MOST_WORDS, STRAIGHT, WORD, Records, all_words, drive
from ..path import NOTHING
from ..query_arrays import HULL, QueryArrays

_POINTS, _HULLS, _NO_OFFSETS = BODY.points[None].copy(), np.zeros(1, HULL), np.zeros((0, 3))
QUERY = QueryArrays(
    WORLD, _POINTS, _HULLS, _POINTS, _HULLS, np.zeros((1, 2)), np.zeros(1, CAR), np.zeros((1, 1)),
    np.zeros(1, np.bool_), _NO_OFFSETS, np.zeros(3), np.zeros(3), 0.0, 0.0, False,
)  # fmt: skip
_POSE, _WORDS = np.zeros(3), np.zeros(1, WORD)


@inner
def random(state: np.ndarray) -> float:
    """Uniform in [0, 1): splitmix64, the same on every machine."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return float((z ^ (z >> np.uint64(31))) >> np.uint64(11)) / 9007199254740992.0


@inner
def put(pose: Array, to: Array) -> None:
    """Copies a pose."""
    for j in range(3):
        to[j] = pose[j]


@inner
def body(T: QueryArrays, a: int) -> BodyArrays:
    """Object and fingertips of push a."""
    hull = T.hulls[a]
    return BodyArrays(T.points[a], hull.corners, hull.x, hull.y, hull.reach)


@inner
def hand(T: QueryArrays, a: int) -> BodyArrays:
    """The fingertips of push a alone."""
    hull = T.hands[a]
    return BodyArrays(T.tips[a], hull.corners, hull.x, hull.y, hull.reach)


@inner
def piece_clear(T: QueryArrays, a: int, letter: int, amount: float, pose: Array) -> bool:
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
def roomy(T: QueryArrays, a: int, pose: Array, need: float) -> bool:
    """Whether object and fingers of push a keep a clearance at a pose."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return still_gap(T.world, body(T, a), pose[0], pose[1], c, s, need, need) >= need


@inner
def free(T: QueryArrays, a: int, pose: Array) -> bool:
    """Whether object and fingers of push a keep the query's clearance at a pose."""
    return roomy(T, a, pose, T.need)


@inner
def lands(T: QueryArrays, a: int, pose: Array) -> bool:
    """Whether the fingers of push a land and leave clear of obstacles and bounds at a pose that is free with them."""
    back = T.backs[a]
    if back[0] == 0.0 and back[1] == 0.0:
        return True
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return line_gap(T.world, hand(T, a), pose[0], pose[1], c, s, back[0], back[1], T.need, T.need) >= T.need


@inner
def turns(T: QueryArrays, a: int, pose: Array) -> bool:
    """Whether the hand may turn freely within the bounds above where it lands for push a."""
    back, hull, bounds = T.backs[a], T.hands[a], T.world.bounds
    c, s = math.cos(pose[2]), math.sin(pose[2])
    px, py, far = hull.x + back[0], hull.y + back[1], hull.reach + T.need
    x, y = pose[0] + c * px - s * py, pose[1] + s * px + c * py
    return min(min(x - bounds.xmin, y - bounds.ymin), min(bounds.xmax - x, bounds.ymax - y)) >= far


@shared(False, QUERY, 0, 0, _POSE)
def changes(T: QueryArrays, a: int, b: int, pose: Array) -> bool:
    """Whether the hand may leave push a and land at push b at a pose that is free with push a."""
    if T.switching[a, b] == np.inf or not free(T, b, pose):
        return False
    if T.inside and not (turns(T, a, pose) and turns(T, b, pose)):
        return False
    if T.room > 0.0 and not roomy(T, a, pose, T.room):
        return False
    return lands(T, a, pose) and lands(T, b, pose)


@shared(False, QUERY, 0, _POSE, _WORDS[0], _POSE)
def keeps(T: QueryArrays, a: int, start: Array, word: Record, here: Array) -> bool:
    """Whether a word of push a keeps the clearance, from a start that is free. `here` ends at its end."""
    # The middles of its pieces refuse most of what is not free.
    put(start, here)
    for piece in range(3):
        letter, half = word.letter[piece], 0.5 * word.amount[piece]
        if word.amount[piece] > NOTHING:
            drive(T.cars[a], letter, half, here)
            if not free(T, a, here):
                return False
            drive(T.cars[a], letter, half, here)
    put(start, here)
    for piece in range(3):
        letter, amount = word.letter[piece], word.amount[piece]
        if amount > NOTHING:
            if not piece_clear(T, a, letter, amount, here):
                return False
            drive(T.cars[a], letter, amount, here)
    return True


@shared(0, QUERY, 0, _POSE, _POSE, 0.0, 0, _WORDS, _POSE)
def connect(
    T: QueryArrays, a: int, start: Array, goal: Array, limit: float, tries: int, found: Records, here: Array
) -> int:
    """The cheapest word of push a that keeps clear and costs less than a limit, of the first few: its index, or -1.

    The start is free with this push; the goal need not be. `found` has room for MOST_WORDS.
    """
    count = all_words(T.cars[a], start, goal, found)
    for k in range(min(count, tries)):
        if found[k].cost >= limit:
            return -1
        if keeps(T, a, start, found[k], here):
            return k
    return -1


@inner
def replanned(
    T: QueryArrays, a: int, start: Array, goal: Array, lost: float, words: Records, off: Array, here: Array
) -> float:
    """What push a costs from a switch pose to a goal in the mean when the pose is missed by each of the offsets.

    Where the push cannot land there or none of its words keeps clear, the attempt is lost, which costs `lost`.
    """
    cost = 0.0
    for i in range(len(T.offsets)):
        for j in range(3):
            off[j] = start[j] + T.offsets[i, j]
        best = lost
        if free(T, a, off) and lands(T, a, off):
            k = connect(T, a, off, goal, lost, MOST_WORDS, words, here)
            if k >= 0:
                best = words[k].cost
        cost += best / len(T.offsets)
    return cost


@kernel()
def cost_replanned(T: QueryArrays, a: int, start: Array, goal: Array, lost: float) -> float:
    """As replanned."""
    return replanned(T, a, start, goal, lost, np.empty(MOST_WORDS, WORD), np.empty(3), np.empty(3))


@kernel()
def stands(T: QueryArrays, a: int, pose: Array) -> bool:
    """Whether push a may begin or end at a pose: object and fingers are free, and the fingers land."""
    return free(T, a, pose) and lands(T, a, pose)


@kernel()
def word_clear(T: QueryArrays, a: int, start: Array, words: Records, index: int) -> bool:
    """Whether a word of push a keeps the clearance, its start included."""
    return free(T, a, start) and keeps(T, a, start, words[index], np.empty(3))


@kernel()
def path_clear(T: QueryArrays, start: Array, pushes: np.ndarray, letters: np.ndarray, amounts: Array) -> bool:
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
        drive(T.cars[a], letters[i], amounts[i], pose)
        if not free(T, a, pose):
            return False
    return lands(T, pushes[last], pose)
