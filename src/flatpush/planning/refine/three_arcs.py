"""Plans of three arcs with one push each, in closed form, compiled.

Three amounts against three equations: as for the words of one car (steering/three_twist.py, [Furtuna2010]), with a
body-fixed centre or direction of another push for every arc.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ...compiled import inner, kernel
from ...geometry.pose import Array
from ...steering.six_words import CARS, LEFT, STRAIGHT, TURN, Records, drive, price

NOTHING = 1e-12  # centres closer than this are one [m²]


@inner
def _fixed(car: Any, letter: int) -> tuple[float, float]:
    """The centre of a turn, or the direction straight on."""
    if letter == STRAIGHT:
        return car.ahead_x, car.ahead_y
    return (car.left_x, car.left_y) if letter == LEFT else (car.right_x, car.right_y)


@inner
def _length(wx: float, wy: float, ux: float, uy: float, dx: float, dy: float, second: bool) -> float:
    """A length t with |w - t u| = |d|, u a unit vector; nan where there is none."""
    along = wx * ux + wy * uy
    square = along * along + dx * dx + dy * dy - wx * wx - wy * wy
    if square < 0.0:
        return np.nan
    return along + (-math.sqrt(square) if second else math.sqrt(square))


@inner
def _bearing(wx: float, wy: float, ux: float, uy: float, dx: float, dy: float, t: float) -> float:
    """The angle from d to w - t u."""
    x, y = wx - t * ux, wy - t * uy
    return math.atan2(y * dx - x * dy, x * dx + y * dy)


@inner
def _amount(letter: int, value: float) -> float:
    """A turn in [0, 2π) of the sense of the letter; a length as it is."""
    if letter == STRAIGHT:
        return value
    return (value if letter == LEFT else -value) % TURN


@inner
def _three_arcs(
    cars: Records, switching: Array, start: Array, goal: Array, costs: Array, poses: Array
) -> None:
    """From one start to one goal: costs (k³,), poses (k³, 2, 3)."""
    k = len(cars)
    c, s = math.cos(start[2]), math.sin(start[2])
    gx, gy, theta = goal[0] - start[0], goal[1] - start[1], goal[2] - start[2]
    X, Y = c * gx + s * gy, c * gy - s * gx  # the goal in the frame of the start
    c, s = math.cos(theta), math.sin(theta)
    for triple in range(k * k * k):
        i, j, h = triple // (k * k), triple // k % k, triple % k
        costs[triple] = np.inf
        fixed = switching[i, j] + switching[j, h]
        for choice in range(54):
            second, d, e, f = choice % 2 == 1, choice // 18, choice // 6 % 3, choice // 2 % 3  # letters
            straight = (d == STRAIGHT) + (e == STRAIGHT) + (f == STRAIGHT)
            if (i == j and d == e) or (j == h and e == f) or straight > 1:
                continue
            px, py = _fixed(cars[i], d)
            qx, qy = _fixed(cars[j], e)
            rx, ry = _fixed(cars[h], f)
            ex, ey = c * rx - s * ry, s * rx + c * ry
            # A length, or the middle turn, first: most that cannot be cheaper ends there, before the other angles.
            if e == STRAIGHT:  # X + end r - p = exp(ix) (r - p + y q)
                y = _length(rx - px, ry - py, -qx, -qy, X + ex - px, Y + ey - py, second)
                if not (y >= 0.0 and fixed + price(cars[j], e, y) < costs[triple]):
                    continue
                x = -_bearing(rx - px, ry - py, -qx, -qy, X + ex - px, Y + ey - py, y)
                z = theta - x
            elif d == STRAIGHT:  # X + end r - q = x p + exp(iy) (r - q)
                x = _length(X + ex - qx, Y + ey - qy, px, py, rx - qx, ry - qy, second)
                if not (x >= 0.0 and fixed + price(cars[i], d, x) < costs[triple]):
                    continue
                y = _bearing(X + ex - qx, Y + ey - qy, px, py, rx - qx, ry - qy, x)
                z = theta - y
            elif f == STRAIGHT:  # X + end q - p = exp(ix) (q - p) + z end r
                ox, oy = c * qx - s * qy, s * qx + c * qy
                z = _length(X + ox - px, Y + oy - py, ex, ey, qx - px, qy - py, second)
                if not (z >= 0.0 and fixed + price(cars[h], f, z) < costs[triple]):
                    continue
                x = _bearing(X + ox - px, Y + oy - py, ex, ey, qx - px, qy - py, z)
                y = theta - x
            else:  # X + end r - p = exp(ix) ((q - p) + exp(iy) (r - q)): a triangle of three known sides
                wx, wy, ax, ay, bx, by = X + ex - px, Y + ey - py, qx - px, qy - py, rx - qx, ry - qy
                sides = math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
                cosine = wx * wx + wy * wy - ax * ax - ay * ay - bx * bx - by * by
                if sides < NOTHING or abs(cosine) > 2.0 * sides:
                    continue
                bend = math.acos(cosine / (2.0 * sides))
                y = (-bend if second else bend) + math.atan2(ay * bx - ax * by, ax * bx + ay * by)
                if not fixed + price(cars[j], e, _amount(e, y)) < costs[triple]:
                    continue
                cy, sy = math.cos(y), math.sin(y)
                vx, vy = ax + cy * bx - sy * by, ay + sy * bx + cy * by
                x = math.atan2(wy * vx - wx * vy, wx * vx + wy * vy)
                z = theta - x - y
            x, y, z = _amount(d, x), _amount(e, y), _amount(f, z)
            cost = fixed + price(cars[i], d, x) + price(cars[j], e, y) + price(cars[h], f, z)
            if cost < costs[triple]:
                costs[triple] = cost
                for n in range(3):
                    poses[triple, 0, n] = start[n]
                drive(cars[i], d, x, poses[triple, 0])
                for n in range(3):
                    poses[triple, 1, n] = poses[triple, 0, n]
                drive(cars[j], e, y, poses[triple, 1])


@kernel(
    nb.void(
        CARS,
        nb.float64[:, ::1],
        nb.float64[:, ::1],
        nb.float64[:, ::1],
        nb.float64[:, ::1],
        nb.float64[:, :, :, ::1],
    )
)
def three_arcs(
    cars: Records, switching: Array, starts: Array, goals: Array, costs: Array, poses: Array
) -> None:
    """The cheapest plan of one arc each for every three of k pushes i, j, h, from n starts (n, 3) to as many goals.

    Fills costs (n, k³) and poses (n, k³, 2, 3) in between; the triple is number (i k + j) k + h.
    """
    for n in range(len(starts)):
        _three_arcs(cars, switching, starts[n], goals[n], costs[n], poses[n])
