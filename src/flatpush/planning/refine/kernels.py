"""Compiled parts of the refinement; problem.py and descent/__init__.py say what for.

A fleet comes as two arrays: `cars` (k, 7) holds the left and the right turning centre, the unit vector straight on and
the radius of the flat point; `laws` (k, 3, 3) holds rate, speed and acceleration of left turn, straight and right turn.
"""

import math
from typing import Any

import numba as nb
import numpy as np
from numba import float64 as f8
from numba import int64 as i8

from ...geometry.pose import Array

TURN = 2 * math.pi
# Half of what three_twist.py grants, so that whatever is accepted here is accepted there.
TOLERANCE = 5e-11
BOTTOM = 1e-13  # an amount below this is nothing [m of the flat path]
STIFF = 1e3  # the slope of a cost that starts with a root

V, M, T, N = f8[::1], f8[:, ::1], f8[:, :, ::1], i8[::1]


def compiled(signature: Any = None) -> Any:
    """Compiles when the module is loaded (from the cache, if it is there), or without a signature when called."""
    return nb.njit(signature, cache=True, nogil=True, error_model="numpy")


@compiled(f8(V, f8))
def price(law: Array, amount: float) -> float:
    """What an amount (angle [rad] or length [m]) of one motion costs."""
    way = law[0] * amount
    if law[1] == np.inf:
        return way
    if way <= 0.0:
        return 0.0
    if way * law[2] >= law[1] * law[1]:
        return way / law[1] + law[1] / law[2]
    return 2.0 * math.sqrt(way / law[2])


@compiled(f8(V, M, V, V, M))
def leg(car: Array, law: Array, start: Array, goal: Array, arcs: Array) -> float:
    """Cost of the cheapest word of a car from pose to pose; its arcs, rows (letter, amount), are filled in (3, 2).

    Letters: 0 left, 1 straight, 2 right. The words and their derivation are those of steering/three_twist.py; the
    price may follow a time law. An arc that comes out within 1e-5 of a full turn is tried as zero, and accepted so if
    the end is met.
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
    best = np.inf
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
                if option == 1 and amount == 0.0 and root - along <= 0.0:
                    continue
                turned = 0.0
                arm_x, arm_y = dx + amount * ux, dy + amount * uy
                middle = price(law[1], amount)
                letter = 1
            else:
                amount = 2.0 * math.asin(min(1.0, length / (2.0 * span)))
                amount = amount if option == 0 else TURN - amount
                turned = -sense_a * amount
                letter = 2 if lefts else 0
                ex, ey = 1.0 - math.cos(turned), -math.sin(turned)
                ox, oy = (car[2] - ax, car[3] - ay) if lefts else (car[0] - ax, car[1] - ay)
                arm_x, arm_y = ox * ex - oy * ey, ox * ey + oy * ex
                middle = price(law[letter], amount)
            arm = math.sqrt(arm_x * arm_x + arm_y * arm_y)
            if middle >= best or abs(arm - length) > tolerance:
                continue
            alpha = math.atan2(wy * arm_x - wx * arm_y, wx * arm_x + wy * arm_y)
            rest = theta - turned
            loose = arm < 1e-5 * scale  # then the direction of w says little
            for snap in range(3):
                if snap == 1:
                    near = (sense_a * alpha) % TURN
                    if not (loose or near > TURN - 1e-5):
                        continue
                    a = 0.0
                elif snap == 2:
                    near = (sense_b * (rest - alpha)) % TURN
                    if not (loose or near > TURN - 1e-5):
                        continue
                    a = rest
                else:
                    a = alpha
                first = (sense_a * a) % TURN
                last = 0.0 if snap == 2 else (sense_b * (rest - a)) % TURN
                total = (
                    middle + price(law[0 if lefts else 2], first) + price(law[0 if ends_left else 2], last)
                )
                if total < best:
                    ca, sa = math.cos(a), math.sin(a)
                    if math.hypot(ca * arm_x - sa * arm_y - wx, sa * arm_x + ca * arm_y - wy) <= tolerance:
                        best = total
                        arcs[0, 0], arcs[0, 1] = 0.0 if lefts else 2.0, first
                        arcs[1, 0], arcs[1, 1] = letter, amount
                        arcs[2, 0], arcs[2, 1] = 0.0 if ends_left else 2.0, last
    return best


@compiled()
def leg_table(cars: Array, laws: Array, starts: Array, goals: Array, costs: Array) -> None:
    """Costs (k, n, m) of every car from each start (n, 3) to each goal (m, 3)."""
    arcs = np.empty((3, 2))
    for push in range(len(cars)):
        for i in range(len(starts)):
            for j in range(len(goals)):
                costs[push, i, j] = leg(cars[push], laws[push], starts[i], goals[j], arcs)


@compiled(f8(M, T, N, M, T))
def chain_cost(cars: Array, laws: Array, pushes: Array, poses: Array, legs: Array) -> float:
    """Cost of the legs between poses (n + 1, 3) without switching; fills the arcs (n, 3, 2)."""
    total = 0.0
    for i in range(len(pushes)):
        total += leg(cars[pushes[i]], laws[pushes[i]], poses[i], poses[i + 1], legs[i])
    return total


@compiled(f8(M, N, T))
def shortest_flat(cars: Array, pushes: Array, legs: Array) -> float:
    """The flat length of the shortest leg [m]."""
    least = np.inf
    for i in range(len(pushes)):
        length = 0.0
        for j in range(3):
            length += legs[i, j, 1] * (1.0 if legs[i, j, 0] == 1.0 else cars[pushes[i], 6])
        least = min(least, length)
    return least


@compiled()
def offsets_cost(cars: Array, laws: Array, pushes: Array, poses: Array, offsets: Array) -> float:
    """Mean cost of the legs when each but the first starts from where an offset, of (m, 3) in W, puts it."""
    arcs, here = np.empty((3, 2)), np.empty(3)
    total = leg(cars[pushes[0]], laws[pushes[0]], poses[0], poses[1], arcs)
    count = len(offsets)
    for i in range(1, len(pushes)):
        for d in range(count):
            for j in range(3):
                here[j] = poses[i, j] + offsets[d, j]
            total += leg(cars[pushes[i]], laws[pushes[i]], here, poses[i + 1], arcs) / count
    return total


@compiled()
def settle(
    cars: Array, laws: Array, pushes: Array, poses: Array, offsets: Array, least: float, steps: Array
) -> float:
    """Moves the switch poses to lower offsets_cost, by trying steps of falling size along fixed directions."""
    n = len(poses)
    legs = np.empty((len(pushes), 3, 2))
    best = offsets_cost(cars, laws, pushes, poses, offsets)
    scale = cars[pushes[0], 6]
    for step in steps:
        for _ in range(12):
            improved = False
            for i in range(1, n - 1):
                for direction in range(26):
                    trit = direction if direction < 13 else direction + 1  # all of {-1, 0, 1}³ but the middle
                    x, y, theta = poses[i, 0], poses[i, 1], poses[i, 2]
                    poses[i, 0] = x + step * (trit % 3 - 1)
                    poses[i, 1] = y + step * (trit // 3 % 3 - 1)
                    poses[i, 2] = theta + step / scale * (trit // 9 - 1)
                    value = offsets_cost(cars, laws, pushes, poses, offsets)
                    if value < best - 1e-9 * best:
                        chain_cost(cars, laws, pushes, poses, legs)
                        if shortest_flat(cars, pushes, legs) >= least:
                            best = value
                            improved = True
                            continue
                    poses[i, 0], poses[i, 1], poses[i, 2] = x, y, theta
            if not improved:
                break
    return best


@compiled()
def three_arcs(
    cars: Array, laws: Array, switching: Array, start: Array, goal: Array, costs: Array, poses: Array
) -> None:
    """For every three pushes, the cheapest plan of one arc each: costs (k, k, k), poses (k, k, k, 2, 3) in between.

    Three amounts against three equations: closed forms, as for the words of one car, with a body-fixed centre or
    direction of another push for every arc. Complex numbers are plane vectors in the frame of the start.
    """
    k = len(cars)
    frame = complex(math.cos(start[2]), math.sin(start[2]))
    X = complex(goal[0] - start[0], goal[1] - start[1]) * frame.conjugate()
    theta = goal[2] - start[2]
    end = complex(math.cos(theta), math.sin(theta))
    at = np.empty((3, 3))
    for triple in range(k * k * k):
        i, j, h = triple // (k * k), triple // k % k, triple % k
        costs[i, j, h] = np.inf
        fixed = switching[i, j] + switching[j, h]
        for motions in range(27):
            a, b, c = motions // 9, motions // 3 % 3, motions % 3
            if (i == j and a == b) or (j == h and b == c) or (a == 1) + (b == 1) + (c == 1) > 1:
                continue
            p, q, r = _fixed(cars[i], a), _fixed(cars[j], b), _fixed(cars[h], c)
            for option in range(2):
                x, y, z = 0.0, 0.0, 0.0
                if b == 1:  # turn, straight, turn
                    w, D = X + end * r - p, r - p
                    t = _reach(D, q, w, option)
                    x = _phase(w, D + t * q)
                    y, z = t, theta - x
                elif a == 1:  # X + end r - q = t p + exp(iy) (r - q)
                    w, D = X + end * r - q, r - q
                    x = _reach(w, -p, D, option)
                    y = _phase(w - x * p, D)
                    z = theta - y
                elif c == 1:  # X + end q - p = exp(ix) (q - p) + t end r
                    w, D = X + end * q - p, q - p
                    z = _reach(w, -end * r, D, option)
                    x = _phase(w - z * end * r, D)
                    y = theta - x
                else:  # X + end r - p = exp(ix) ((q - p) + exp(iy) (r - q))
                    w, D, E = X + end * r - p, q - p, r - q
                    de = abs(D) * abs(E)
                    if de < 1e-12:
                        continue
                    cosine = (abs(w) ** 2 - abs(D) ** 2 - abs(E) ** 2) / (2.0 * de)
                    if abs(cosine) > 1.0:
                        continue
                    bend = math.acos(cosine) * (1.0 if option == 0 else -1.0)
                    y = bend + _phase(D, E)
                    x = _phase(w, D + complex(math.cos(y), math.sin(y)) * E)
                    z = theta - x - y
                if not (x == x and y == y and z == z):
                    continue
                x, y, z = _amount(a, x), _amount(b, y), _amount(c, z)
                if min(x, y, z) < 0.0:
                    continue
                cost = fixed + price(laws[i, a], x) + price(laws[j, b], y) + price(laws[h, c], z)
                if cost >= costs[i, j, h]:
                    continue
                for column in range(3):
                    at[0, column] = start[column]
                _advance(at, 0, a, p, x)
                _advance(at, 1, b, q, y)
                costs[i, j, h] = cost
                for step in range(2):
                    for column in range(3):
                        poses[i, j, h, step, column] = at[step + 1, column]


@compiled()
def _fixed(car: Array, motion: int) -> complex:
    """The centre of a turn, or the direction straight on."""
    at = 0 if motion == 0 else 4 if motion == 1 else 2
    return complex(car[at], car[at + 1])


@compiled()
def _reach(D: complex, d: complex, w: complex, option: int) -> float:
    """t with |D + t d| = |w|, d a unit vector; nan where there is none."""
    along = (D * d.conjugate()).real
    square = along * along + abs(w) ** 2 - abs(D) ** 2
    if square < 0.0:
        return np.nan
    return (math.sqrt(square) if option == 0 else -math.sqrt(square)) - along


@compiled()
def _phase(a: complex, b: complex) -> float:
    """The angle from b to a."""
    c = a * b.conjugate()
    return math.atan2(c.imag, c.real)


@compiled()
def _amount(motion: int, value: float) -> float:
    """A turn in [0, 2π) of the sense of the motion; a length as it is."""
    if motion == 1:
        return value
    return (value if motion == 0 else -value) % TURN


@compiled()
def _advance(at: Array, step: int, motion: int, fixed: complex, amount: float) -> None:
    """Drives one arc from at[step] to at[step + 1]."""
    theta = at[step, 2]
    before = complex(math.cos(theta), math.sin(theta))
    here = complex(at[step, 0], at[step, 1])
    if motion == 1:
        here += amount * before * fixed
    else:
        theta += amount if motion == 0 else -amount
        here += (before - complex(math.cos(theta), math.sin(theta))) * fixed
    at[step + 1, 0], at[step + 1, 1], at[step + 1, 2] = here.real, here.imag, theta
