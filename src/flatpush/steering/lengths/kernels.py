"""Costs of many pairs of poses, in tiles that stay in the first cache; __init__.py is the way in."""

from typing import Any

import numpy as np

from ...geometry.pose import Array
from ..kernels import dubins_between, three_twist_between, timed_between
from ..vectors.kernels import TURN, _heading, _select, _widest_vectors, batch, block

TILE = 504  # frames and lengths stay in the first cache; rows of 4096 bytes would compete for the same lines of it


@batch
def dubins_lengths(starts: Array, goals: Array, radius: float, bounds: Any, lengths: Array) -> bool:
    """Fills rows bounds[0]:bounds[1] and columns bounds[2]:bounds[3] of lengths (n, m) [m].

    starts and goals have shapes (n or 1, m or 1, 3). What a length comes out as does not depend on the bounds. Returns
    whether poses look finite.
    """
    _widest_vectors()
    (a, b, out), axle = _tiles(), np.zeros(5)
    scale = 1.0 / radius
    finite = True
    for begin in range(bounds[2], bounds[3], TILE):
        count = min(TILE, bounds[3] - begin)
        for row in range(bounds[0], bounds[1]):
            finite &= _load(starts, goals, row, row == bounds[0], begin, count, axle, a, b)
            for i in range((count + 7) // 8 * 8):  # whole vectors only
                x, y = (b[0, i] - a[0, i]) * scale, (b[1, i] - a[1, i]) * scale
                out[i] = radius * dubins_between(
                    0.0, 0.0, a[2, i], a[3, i], a[4, i], x, y, b[2, i], b[3, i], b[4, i]
                )
            for i in range(count):
                lengths[row, begin + i] = out[i]
    return finite


@batch
def three_twist_costs(
    starts: Array, goals: Array, axle: Array, car: Array, bounds: Any, costs: Array
) -> bool:
    """As dubins_lengths for a car of three_twist_between, as __init__.axle gives it."""
    _widest_vectors()
    a, b, out = _tiles()
    scale, tilt_c, tilt_s, wl, ws, wr = 1.0 / car[0], car[1], car[2], car[3], car[4], car[5]
    finite = True
    for begin in range(bounds[2], bounds[3], TILE):
        count = min(TILE, bounds[3] - begin)
        for row in range(bounds[0], bounds[1]):
            finite &= _load(starts, goals, row, row == bounds[0], begin, count, axle, a, b)
            for i in range((count + 7) // 8 * 8):
                x, y = (b[0, i] - a[0, i]) * scale, (b[1, i] - a[1, i]) * scale
                out[i] = three_twist_between(
                    0.0, 0.0, a[2, i], a[3, i], a[4, i], x, y, b[2, i], b[3, i], b[4, i],
                    tilt_c, tilt_s, wl, ws, wr,
                )  # fmt: skip
            for i in range(count):
                costs[row, begin + i] = out[i]
    return finite


@batch
def timed_costs(
    starts: Array, goals: Array, axle: Array, car: Array, laws: Any, bounds: Any, costs: Array
) -> bool:
    """As three_twist_costs for timed_between, with the laws of left turn, straight and right turn."""
    _widest_vectors()
    a, b, out = _tiles()
    scale, tilt_c, tilt_s = 1.0 / car[0], car[1], car[2]
    left, straight, right = laws
    finite = True
    for begin in range(bounds[2], bounds[3], TILE):
        count = min(TILE, bounds[3] - begin)
        for row in range(bounds[0], bounds[1]):
            finite &= _load(starts, goals, row, row == bounds[0], begin, count, axle, a, b)
            for i in range((count + 7) // 8 * 8):
                x, y = (b[0, i] - a[0, i]) * scale, (b[1, i] - a[1, i]) * scale
                out[i] = timed_between(
                    0.0, 0.0, a[2, i], a[3, i], a[4, i], x, y, b[2, i], b[3, i], b[4, i],
                    tilt_c, tilt_s, left, straight, right,
                )  # fmt: skip
            for i in range(count):
                costs[row, begin + i] = out[i]
    return finite


@batch
def _tiles() -> tuple[Array, Array, Array]:
    """Frames of starts and goals, shape (5, TILE), and a row of lengths, each row at the begin of a cache line."""
    memory = np.zeros(11 * TILE + 8)
    memory = memory[-(memory.ctypes.data // 8) % 8 :]
    a, b = memory[: 5 * TILE].reshape(5, TILE), memory[5 * TILE : 10 * TILE].reshape(5, TILE)
    return a, b, memory[10 * TILE : 11 * TILE]


@block
def _load(
    starts: Array,
    goals: Array,
    row: int,
    fresh: bool,
    begin: int,
    count: int,
    axle: Array,
    a: Array,
    b: Array,
) -> bool:
    """Frames of the starts and goals of a row, unless the row before has the same."""
    finite = True
    if fresh or starts.shape[0] > 1:
        finite &= _frames(starts, row if starts.shape[0] > 1 else 0, begin, count, axle, a)
    if fresh or goals.shape[0] > 1:
        finite &= _frames(goals, row if goals.shape[0] > 1 else 0, begin, count, axle, b)
    return finite


@batch
def _frames(poses: Array, row: int, begin: int, count: int, axle: Array, tile: Array) -> bool:
    """Fills a tile (5, count) with the frames of the axle, given in the pose's frame; x and y in metres.

    A row of one pose fills the whole tile. Returns whether
    the poses look finite (a sum that overflows does not).
    """
    _widest_vectors()
    alone = poses.shape[1] == 1
    some = poses[row, :1] if alone else poses[row, begin : begin + count]
    for i in range(len(some)):  # apart, because this loop does not vectorise
        tile[0, i], tile[1, i], tile[4, i] = some[i, 0], some[i, 1], some[i, 2]
    strange = 0
    for i in range(len(some)):
        total = (tile[0, i] + tile[1, i]) + tile[4, i]
        strange |= 0 if total - total == 0.0 else 1
    for i in range(len(some)):
        tile[4, i], tile[2, i], tile[3, i] = _heading(tile[4, i])
    ax, ay, ac, as_, turn = axle[0], axle[1], axle[2], axle[3], axle[4]
    if ax != 0.0 or ay != 0.0 or turn != 0.0:
        for i in range(len(some)):
            c, s, heading = tile[2, i], tile[3, i], tile[4, i] + turn
            tile[0, i] += c * ax - s * ay
            tile[1, i] += s * ax + c * ay
            tile[2, i] = c * ac - s * as_
            tile[3, i] = s * ac + c * as_
            tile[4, i] = _select(heading >= TURN, heading - TURN, heading)
    for k in range(5 if alone else 0):
        value = tile[k, 0]
        for i in range(count):
            tile[k, i] = value
    return strange == 0
