"""Costs of many pairs of poses, in tiles that stay in the first cache; __init__.py is the way in."""

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from ...compiled import block, kernel, shared
from ...geometry.pose import Array
from ..kernels import Frame, Timed, Weighted, dubins_between, three_twist_between, timed_between
from ..vectors.kernels import TURN, _heading, _select, _widest_vectors

TILE = 504  # frames and lengths stay in the first cache; rows of 4096 bytes would compete for the same lines of it
X, Y, COS, SIN, HEADING = range(5)  # rows of a tile of frames
HERE = Frame(0.0, 0.0, 1.0, 0.0, 0.0)


class Round(NamedTuple):
    """A Dubins car by its turning radius [m]."""

    radius: float


CarT = TypeVar("CarT", Round, Weighted, Timed)


class Bounds(NamedTuple):
    """Rows and columns of a table that are filled: low to high, left to right, the last ones not included."""

    low: int
    high: int
    left: int
    right: int


class Tiles(NamedTuple):
    """Scratch: frames of starts and of goals, shape (5, TILE), and a row of lengths (TILE,)."""

    starts: Array
    goals: Array
    lengths: Array

    @classmethod
    def new(cls) -> "Tiles":
        """Each row at the begin of a cache line."""
        memory = np.zeros(11 * TILE + 8)
        memory = memory[-(memory.ctypes.data // 8) % 8 :][: 11 * TILE]
        rows = memory.reshape(11, TILE)
        return cls(rows[:5], rows[5:10], rows[10])


@shared(True, np.zeros((1, 1, 3)), 0, 0, 0, HERE, np.zeros((1, 1)), fused=True)
def _frames(poses: Array, row: int, begin: int, count: int, axle: Frame, tile: Array) -> bool:
    """Fills a tile (5, count) with the frames of the axle, given in the pose's frame; x and y in metres.

    A row of one pose fills the whole tile. Returns whether the poses look finite (a sum that overflows does not).
    """
    _widest_vectors()
    alone = poses.shape[1] == 1
    some = poses[row, :1] if alone else poses[row, begin : begin + count]
    for i in range(len(some)):  # apart, because this loop does not vectorise
        tile[X, i], tile[Y, i], tile[HEADING, i] = some[i, 0], some[i, 1], some[i, 2]
    strange = 0
    for i in range(len(some)):
        total = (tile[X, i] + tile[Y, i]) + tile[HEADING, i]
        strange |= 0 if total - total == 0.0 else 1
    for i in range(len(some)):
        tile[HEADING, i], tile[COS, i], tile[SIN, i] = _heading(tile[HEADING, i])
    if axle.x != 0.0 or axle.y != 0.0 or axle.heading != 0.0:
        for i in range(len(some)):
            c, s, heading = tile[COS, i], tile[SIN, i], tile[HEADING, i] + axle.heading
            tile[X, i] += c * axle.x - s * axle.y
            tile[Y, i] += s * axle.x + c * axle.y
            tile[COS, i] = c * axle.c - s * axle.s
            tile[SIN, i] = s * axle.c + c * axle.s
            tile[HEADING, i] = _select(heading >= TURN, heading - TURN, heading)
    for k in range(5 if alone else 0):
        value = tile[k, 0]
        for i in range(count):
            tile[k, i] = value
    return strange == 0


@block
def _load(
    starts: Array,
    goals: Array,
    row: int,
    fresh: bool,
    begin: int,
    count: int,
    axle: Frame,
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


def _filler(cost: Callable[[Frame, Frame, CarT], float]) -> Callable[..., bool]:
    """The kernel that fills a table with what a block costs between a start at the origin and a goal, in radii."""

    @kernel(fused=True, lent=True)
    def fill(
        starts: Array, goals: Array, axle: Frame, car: CarT, bounds: Bounds, tiles: Tiles, out: Array
    ) -> bool:
        """Fills some rows and columns of costs (n, m) of a car with an axle.

        starts and goals have shapes (n or 1, m or 1, 3). What a cost comes out as does not depend on the bounds.
        Returns whether poses look finite.
        """
        _widest_vectors()
        (a, b, row_out), finite = tiles, True
        scale = 1.0 / car.radius
        for begin in range(bounds.left, bounds.right, TILE):
            count = min(TILE, bounds.right - begin)
            for row in range(bounds.low, bounds.high):
                finite &= _load(starts, goals, row, row == bounds.low, begin, count, axle, a, b)
                for i in range((count + 7) // 8 * 8):  # whole vectors only
                    start = Frame(0.0, 0.0, a[COS, i], a[SIN, i], a[HEADING, i])
                    x, y = (b[X, i] - a[X, i]) * scale, (b[Y, i] - a[Y, i]) * scale
                    row_out[i] = cost(start, Frame(x, y, b[COS, i], b[SIN, i], b[HEADING, i]), car)
                for i in range(count):
                    out[row, begin + i] = row_out[i]
        return finite

    return fill


@block
def _dubins(start: Frame, goal: Frame, car: Round) -> float:
    return car.radius * dubins_between(start, goal)


dubins_costs = _filler(_dubins)
three_twist_costs = _filler(three_twist_between)
timed_costs = _filler(timed_between)
