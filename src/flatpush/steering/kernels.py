"""Compiled twins of dubins.py and three_twist.py, which explain them.

The lengths of many Dubins paths are computed without a branch, so that LLVM does several pairs at once: which
word is feasible, and whether an arc needs a full turn more, are decided by signs of cross products and become
selects. The helpers are inlined before LLVM sees the loop; without that it would stop vectorising.
"""

import math
from typing import Any

import numba as nb
import numpy as np
from numba.extending import intrinsic

from ..geometry.pose import Array

TURN = 2 * math.pi
TOLERANCE = 4e-10  # as in dubins.py
NEVER = 1e300
TILE = 512
POSES = nb.types.Array(nb.float64, 3, "A", readonly=True)


@intrinsic
def _widest_vectors(typing: Any) -> Any:
    """Asks LLVM for 512-bit vectors where there are any; left alone it often prefers 256 bits."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(builder.function.attributes, set):
            set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return nb.void(), generate


@nb.njit(inline="always")
def _arctan(y: float, x: float) -> float:
    """The angle of (x, y) in the first quadrant; 0 for (0, 0). Error 1e-16."""
    steep = y > x
    large = y if steep else x
    small = x if steep else y
    far = small > 0.41421356237309503 * large  # beyond π/8: the distance from the diagonal instead
    top = small - large if far else small
    bottom = small + large if far else large
    r = top / (bottom + 1e-300)
    q = r * r
    # Chebyshev interpolant of arctan(√q)/√q on [0, tan²(π/8)], error 7e-17.
    q2 = q * q
    q4 = q2 * q2
    a0 = (-0.33333333333328435 + q * 0.19999999998854434) + q2 * (
        -0.14285714180925005 + q * 0.11111106178547345
    )
    a1 = (-0.09090773034671443 + q * 0.07689952983789837) + q2 * (
        -0.06640229875349955 + q * 0.0568832979330602
    )
    a2 = -0.043480005258692 + q * 0.021134787499439724
    p = a0 + q4 * (a1 + q4 * a2)
    angle = r + r * (q * p)
    angle = angle + 0.7853981633974483 if far else angle
    return 1.5707963267948966 - angle if steep else angle


@nb.njit(inline="always")
def _angle(y: float, x: float) -> float:
    """atan2, in [-π, π]."""
    angle = _arctan(abs(y), abs(x))
    angle = math.pi - angle if x < 0 else angle
    return -angle if y < 0 else angle


@nb.njit(inline="always")
def _sine_cosine(angle: float) -> tuple[float, float]:
    """sin and cos for angles up to 1e6, error 2e-16: reduced by quarters, then Chebyshev interpolants."""
    quarter = np.floor(angle * 0.6366197723675814 + 0.5)
    r = (angle - quarter * 1.5707963267341256) - quarter * 6.077100506506192e-11
    q = r * r
    s = -2.5050718764980743e-08 + q * 1.5894842619472324e-10
    s = 2.7557313387198574e-06 + q * s
    s = -0.00019841269828677267 + q * s
    s = 0.008333333333320385 + q * s
    s = -0.16666666666666616 + q * s
    s = r + r * (q * s)
    c = 2.0875542433268676e-09 - q * 1.1351673645370898e-11
    c = -2.7557312733634936e-07 + q * c
    c = 2.480158728226157e-05 + q * c
    c = -0.0013888888888857495 + q * c
    c = 0.041666666666666415 + q * c
    c = 1.0 - q * 0.5 + q * (q * c)
    quarter = quarter - 4.0 * np.floor(0.25 * quarter)
    odd = (quarter == 1.0) | (quarter == 3.0)
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if quarter >= 2.0 else sine
    cosine = -cosine if (quarter == 1.0) | (quarter == 2.0) else cosine
    return sine, cosine


@nb.njit(inline="always")
def _between(x: float, y: float, c: float, s: float, angle: float, tolerance: float) -> bool:
    """Whether (x, y) points between the headings 0 and `angle` in [0, 2π), of direction (c, s).

    A miss by less than the tolerance, as a length, counts as a hit.
    """
    after = y >= -tolerance
    before = x * s - y * c >= -tolerance
    ahead = x * (1.0 + c) + y * s >= -tolerance  # a sector near zero has no tail
    return (after & before & ahead) if angle < math.pi else (after | before)


@nb.njit(inline="always")
def _left_words(x: float, y: float, c: float, s: float, delta: float) -> float:
    """Shortest of LSL, LRL and LSR from (0, 0, 0) to (x, y, delta), delta in [0, 2π), radius 1."""
    tolerance = TOLERANCE * (1.0 + abs(x) + abs(y))
    dx, dy = x - s, y + c - 1.0
    square = dx * dx + dy * dy
    straight = math.sqrt(square)
    lsl = straight + delta + (0.0 if _between(dx, dy, c, s, delta, tolerance) else TURN)

    # LRL: half the apex has sine straight/4; the first arc is that of D, turned on by π - half.
    up = 0.25 * straight
    rest = 1.0 - square * 0.0625
    across = math.sqrt(rest if rest > 0.0 else 0.0)
    half = _arctan(up, across)
    tx, ty = -(dx * across + dy * up), dx * up - dy * across
    c2, s2 = across * across - up * up, 2.0 * across * up
    ec, es = c * c2 + s * s2, s * c2 - c * s2
    outer = delta - 2.0 * half  # the two outer arcs together, up to a turn
    outer = outer + TURN if outer < 0.0 else outer
    lrl = TURN - 2.0 * half + outer + (0.0 if _between(tx, ty, ec, es, outer, tolerance) else TURN)
    lrl = lrl if rest >= -0.5 * tolerance else NEVER

    dx, dy = x + s, y - c - 1.0
    square = dx * dx + dy * dy - 4.0
    straight = math.sqrt(square if square > 0.0 else 0.0)
    slack = 0.5 * TOLERANCE
    first = _angle(dy * straight + 2.0 * dx, dx * straight - 2.0 * dy)
    first = first + TURN if first < -slack else first
    first = first if first > 0.0 else 0.0
    last = first - delta
    last = last + TURN if last < -slack else last
    last = last if last > 0.0 else 0.0
    lsr = first + straight + last
    lsr = lsr if square >= -4.0 * tolerance else NEVER

    best = lsl if lsl < lrl else lrl
    return best if best < lsr else lsr


@nb.njit(
    nb.void(POSES, POSES, nb.float64, nb.float64[:, ::1]),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def dubins_lengths(starts: Array, goals: Array, radius: float, lengths: Array) -> None:
    """Fills lengths (n, m) for poses of shape (n, m, 3), in tiles that stay in the first cache."""
    _widest_vectors()
    tile = np.empty((5, TILE))
    scale = 1.0 / radius
    rows, columns = lengths.shape
    for row in range(rows):
        for begin in range(0, columns, TILE):
            count = min(TILE, columns - begin)
            for i in range(count):
                tile[0, i] = (goals[row, begin + i, 0] - starts[row, begin + i, 0]) * scale
                tile[1, i] = (goals[row, begin + i, 1] - starts[row, begin + i, 1]) * scale
                tile[2, i] = starts[row, begin + i, 2]
                tile[4, i] = goals[row, begin + i, 2] - starts[row, begin + i, 2]
            out = lengths[row, begin : begin + count]
            for i in range(count):  # the goal in the frame of the start: x, y, cos, sin, heading
                s0, c0 = _sine_cosine(tile[2, i])
                delta = tile[4, i]
                delta = delta - TURN * np.floor(delta * (1.0 / TURN))
                delta = delta if (delta >= 0.0) & (delta < TURN) else 0.0
                s, c = _sine_cosine(delta)
                x = c0 * tile[0, i] + s0 * tile[1, i]
                y = c0 * tile[1, i] - s0 * tile[0, i]
                tile[0, i], tile[1, i], tile[2, i], tile[3, i], tile[4, i] = x, y, c, s, delta
                out[i] = NEVER
            for side in range(2):  # words that begin with L, then their mirror images
                sign = 1.0 - 2.0 * side
                for i in range(count):
                    back = TURN - tile[4, i] if tile[4, i] > 0.0 else 0.0
                    delta = tile[4, i] if sign > 0.0 else back
                    length = radius * _left_words(
                        tile[0, i], sign * tile[1, i], tile[2, i], sign * tile[3, i], delta
                    )
                    out[i] = length if length < out[i] else out[i]


VECTOR = nb.types.Array(nb.float64, 1, "A", readonly=True)


@nb.njit(
    nb.types.Tuple((nb.int64, nb.float64, nb.float64, nb.float64, nb.float64))(*(6 * (VECTOR,))),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def shortest_word(
    c_left: Array, c_right: Array, direction: Array, start: Array, goal: Array, weights: Array
) -> tuple[int, float, float, float, float]:
    """three_twist.shortest_word without its checks: (index in three_twist.WORDS, parameters, cost)."""
    c, s = math.cos(start[2]), math.sin(start[2])
    gx, gy = goal[0] - start[0], goal[1] - start[1]
    x, y = c * gx + s * gy, c * gy - s * gx
    theta = goal[2] - start[2]
    c, s = math.cos(theta), math.sin(theta)
    size = math.hypot(direction[0], direction[1])
    ux, uy = direction[0] / size, direction[1] / size
    span = math.hypot(c_left[0] - c_right[0], c_left[1] - c_right[1])
    tolerance = 1e-10 * (math.hypot(x, y) + span)

    word, first, middle, last, cost = -1, 0.0, 0.0, 0.0, np.inf
    for index in range(6):
        begins_left, ends_left = index % 2 == 0, index == 0 or index == 3 or index == 4
        a = c_left if begins_left else c_right
        b = c_left if ends_left else c_right
        other = c_right if begins_left else c_left
        sense_a, sense_b = 1.0 if begins_left else -1.0, 1.0 if ends_left else -1.0
        wx, wy = x + c * b[0] - s * b[1] - a[0], y + s * b[0] + c * b[1] - a[1]
        length = math.hypot(wx, wy)
        dx, dy = b[0] - a[0], b[1] - a[1]
        along, across = dx * ux + dy * uy, dx * uy - dy * ux
        root = math.sqrt(max(0.0, length * length - across * across))
        apex = 2.0 * math.asin(min(1.0, length / (2.0 * span)))
        for option in range(2):
            if index < 4:
                turned = 0.0
                amount = max(0.0, (root if option == 0 else -root) - along)
                arm_x, arm_y = dx + amount * ux, dy + amount * uy
                price = weights[1] * amount
            else:
                amount = apex if option == 0 else TURN - apex
                turned = -sense_a * amount
                ex, ey = 1.0 - math.cos(turned), -math.sin(turned)
                ox, oy = other[0] - a[0], other[1] - a[1]
                arm_x, arm_y = ox * ex - oy * ey, ox * ey + oy * ex
                price = (weights[2] if begins_left else weights[0]) * amount
            # Cheap refusals: already dearer, or an arm that no turn can lay on w.
            if price >= cost or abs(math.hypot(arm_x, arm_y) - length) > tolerance:
                continue
            exact = math.atan2(wy, wx) - math.atan2(arm_y, arm_x)
            for snap in range(3):
                alpha = exact if snap == 0 else (0.0 if snap == 1 else theta - turned)
                angle_a = (sense_a * alpha) % TURN
                angle_b = (sense_b * (theta - turned - alpha)) % TURN
                total = (
                    price
                    + weights[0 if begins_left else 2] * angle_a
                    + weights[0 if ends_left else 2] * angle_b
                )
                if total < cost:
                    ca, sa = math.cos(alpha), math.sin(alpha)
                    if math.hypot(ca * arm_x - sa * arm_y - wx, sa * arm_x + ca * arm_y - wy) <= tolerance:
                        word, first, middle, last, cost = index, angle_a, amount, angle_b, total
    return word, first, middle, last, cost
