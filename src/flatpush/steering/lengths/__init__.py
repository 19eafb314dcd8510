"""Lengths and costs of the cheapest ways between many poses at once, compiled and on all cores."""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from ..checked import checked_radius, finite_poses, shaped_poses
from ..fleet import Fleet

if TYPE_CHECKING:
    from ..kernels import Frame, Timed, Weighted

THREADED = 100_000  # pairs from which threads are worth starting


def dubins_lengths(starts: ArrayLike, goals: ArrayLike, radius: float, threads: int | None = None) -> Array:
    """Lengths of the shortest Dubins paths between many poses [m].

    Args:
        starts, goals: poses of shape (..., 3); leading axes broadcast, so starts[:, None] and goals make a table.
        radius: > 0 [m].
        threads: at most so many; None: all cores for batches over 100 000 pairs. The lengths are the same.

    Returns:
        Array of the broadcast leading shape.

    Raises:
        InputError: for poses of another shape or not finite, or a radius that is not positive and finite.

    >>> dubins_lengths([[0, 0, 0], [1, 0, 0]], [3, 0, 0], 1.0).round(9).tolist()
    [3.0, 2.0]
    """
    from .kernels import HERE, Round, dubins_costs

    car = Round(checked_radius(radius))
    shape, table, X, Y = _pairs(starts, goals)
    lengths = np.empty(table)
    if lengths.size:
        _share(
            lambda bounds, tiles: dubins_costs(X, Y, HERE, car, bounds, tiles, lengths),
            table,
            threads,
            (starts, goals),
        )
    return lengths.reshape(shape)


def fleet_lengths(
    fleet: Fleet, starts: ArrayLike, goals: ArrayLike, threads: int | None = None, flat: bool = False
) -> Array:
    """Costs of the cheapest word of every car of a fleet between many poses of the object.

    Args:
        fleet: its rates, speeds and accelerations say what a cost is.
        starts, goals, threads: as in dubins_lengths; poses of the object frame.
        flat: whether a cost is the length of the way of the flat point instead, of a Dubins car [m].

    Returns:
        Array of shape (k, ...): the cars, then the broadcast leading shape. Switching costs are not in it.

    Raises:
        InputError: for poses of another shape or not finite.
    """
    shape, table, X, Y = _pairs(starts, goals)
    costs = np.empty((fleet.size, *table))
    if not costs.size:
        return costs.reshape(fleet.size, *shape)
    for car in range(fleet.size):
        fill = (_flat_filler if flat else _car_filler)(fleet, car, X, Y, costs[car])
        _share(fill, table, threads, (starts, goals))
    return costs.reshape(fleet.size, *shape)


def axle(fleet: Fleet, car: int) -> tuple["Frame", float, float, float]:
    """The axle of a car and its straight direction.

    Returns:
        The axle in the object frame [m], the heading across the line of the turning centres; half the distance of
        these [m]; and the straight direction seen from the heading, its cosine and its sine.
    """
    from ..kernels import Frame

    span = fleet.left[car] - fleet.right[car]
    radius = 0.5 * float(np.hypot(*span))
    ahead = np.array([span[1], -span[0]]) / (2 * radius)
    side = np.array([-ahead[1], ahead[0]])
    middle = 0.5 * (fleet.left[car] + fleet.right[car])
    tilt = np.array([ahead @ fleet.direction[car], side @ fleet.direction[car]])
    tilt = np.array([1.0, 0.0]) if abs(tilt[1]) <= 1e-15 else tilt / np.hypot(*tilt)
    (x, y), (c, s) = middle.tolist(), ahead.tolist()
    return Frame(x, y, c, s, float(np.arctan2(s, c) % (2 * np.pi))), radius, float(tilt[0]), float(tilt[1])


def weighted_car(fleet: Fleet, car: int) -> tuple["Frame", "Weighted"]:
    """The axle and the car as kernels.three_twist_between takes it, without a time law."""
    from ..kernels import Weighted

    frame, radius, *tilt = axle(fleet, car)
    return frame, Weighted(radius, *tilt, *(fleet.rates[car] * [1.0, radius, 1.0]).tolist())


def timed_car(fleet: Fleet, car: int) -> tuple["Frame", "Timed"]:
    """The axle and the car as kernels.timed_between takes it.

    A way of length w takes w/v + v/a, or 2 √(w/a) where it is shorter than v²/a and the speed v is not reached.
    """
    from ..kernels import Law, Timed

    frame, radius, tilt_c, tilt_s = axle(fleet, car)
    v, a, unit = fleet.speeds[car], fleet.accelerations[car], fleet.rates[car] * [1.0, radius, 1.0]
    laws = np.stack([unit / v, v / a, 4 * unit / a, v**2 / (a * unit)], axis=1)
    left, straight, right = (Law(*law) for law in laws.tolist())
    return frame, Timed(radius, tilt_c, tilt_s, left, straight, right)


def _car_filler(fleet: Fleet, car: int, X: Array, Y: Array, costs: Array) -> Callable[..., bool]:
    from .kernels import three_twist_costs, timed_costs

    if np.all(np.isinf(fleet.speeds[car])):
        body, weighted = weighted_car(fleet, car)
        return lambda bounds, tiles: three_twist_costs(X, Y, body, weighted, bounds, tiles, costs)
    body, timed = timed_car(fleet, car)
    return lambda bounds, tiles: timed_costs(X, Y, body, timed, bounds, tiles, costs)


def _flat_filler(fleet: Fleet, car: int, X: Array, Y: Array, costs: Array) -> Callable[..., bool]:
    from .kernels import Frame, Round, dubins_costs

    (x, y), heading, radius = fleet.flat_point[car].tolist(), float(fleet.heading[car]), fleet.radius[car]
    body = Frame(x, y, math.cos(heading), math.sin(heading), heading % (2 * math.pi))
    return lambda bounds, tiles: dubins_costs(X, Y, body, Round(float(radius)), bounds, tiles, costs)


def _share(
    fill: Callable[..., bool],
    shape: tuple[int, int],
    threads: int | None,
    poses: tuple[ArrayLike, ArrayLike],
) -> None:
    """Has the threads fill equal parts of the rows, or of the columns where these are more; refuses strange poses."""
    from .kernels import Bounds, Tiles

    rows, columns = shape
    count = threads or (os.cpu_count() or 1 if rows * columns > THREADED else 1)
    cuts = [max(rows, columns) * i // count for i in range(count + 1)]
    parts = [(a, b) for a, b in pairwise(cuts) if b > a]
    bounds = [Bounds(a, b, 0, columns) if rows >= columns else Bounds(0, rows, a, b) for a, b in parts]
    tiles = [Tiles.new() for _ in bounds]
    if len(bounds) == 1:
        finite = fill(bounds[0], tiles[0])
    else:
        with ThreadPoolExecutor(len(bounds)) as pool:
            finite = all(list(pool.map(fill, bounds, tiles)))
    if not finite:
        finite_poses(poses[0], "starts")
        finite_poses(poses[1], "goals")


def _pairs(starts: ArrayLike, goals: ArrayLike) -> tuple[tuple[int, ...], tuple[int, int], Array, Array]:
    """The broadcast leading shape, the same as (n, m), and starts and goals as contiguous (n or 1, m or 1, 3)."""
    X, Y = shaped_poses(starts, "starts"), shaped_poses(goals, "goals")
    try:
        shape = np.broadcast_shapes(X.shape[:-1], Y.shape[:-1])
    except ValueError as error:
        raise InputError(
            "the leading axes of starts and goals broadcast", value=(X.shape, Y.shape)
        ) from error
    columns = next((axis for axis in reversed(range(len(shape))) if shape[axis] != 1), 0)
    table = (math.prod(shape[:columns]), math.prod(shape[columns:]))
    return shape, table, _flat(X, shape, columns), _flat(Y, shape, columns)


def _flat(poses: Array, shape: tuple[int, ...], columns: int) -> Array:
    """Rows are the axes before `columns`; an axis along which the poses are all the same is not copied out."""
    own = (1,) * (len(shape) + 1 - poses.ndim) + poses.shape[:-1]
    rows = own[:columns]
    if any(size != 1 for size in rows):
        rows = shape[:columns]
        poses = np.broadcast_to(poses, (*rows, *own[columns:], 3))
    width = own[columns] if shape else 1
    flat = np.ascontiguousarray(poses).reshape(math.prod(rows), width, 3)
    return flat if flat.flags.writeable else flat.copy()
