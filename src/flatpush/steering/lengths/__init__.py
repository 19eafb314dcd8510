"""Lengths and costs of the cheapest ways between many poses at once, compiled and on all cores."""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from ..dubins import _checked_radius, _poses, _shaped_poses
from ..fleet import Fleet

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
    from .kernels import dubins_lengths as fill

    radius = _checked_radius(radius)
    shape, table, X, Y = _pairs(starts, goals)
    lengths = np.empty(table)
    if lengths.size:
        _share(lambda bounds: fill(X, Y, radius, bounds, lengths), table, threads, (starts, goals))
    return lengths.reshape(shape)


def fleet_lengths(fleet: Fleet, starts: ArrayLike, goals: ArrayLike, threads: int | None = None) -> Array:
    """Costs of the cheapest word of every car of a fleet between many poses of the object.

    Args:
        fleet: its rates, speeds and accelerations say what a cost is.
        starts, goals, threads: as in dubins_lengths; poses of the object frame.

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
        _share(_car_filler(fleet, car, X, Y, costs[car]), table, threads, (starts, goals))
    return costs.reshape(fleet.size, *shape)


def axle(fleet: Fleet, car: int) -> tuple[Array, Array]:
    """A car as kernels.three_twist_between takes it.

    Returns:
        The axle (x, y, cosine, sine, heading) in the object frame, the heading across the line of the turning centres,
        in [0, 2π); and (R, tilt_c, tilt_s, wl, ws, wr), the weights without a time law.
    """
    span = fleet.left[car] - fleet.right[car]
    radius = 0.5 * float(np.hypot(*span))
    ahead = np.array([span[1], -span[0]]) / (2 * radius)
    side = np.array([-ahead[1], ahead[0]])
    middle = 0.5 * (fleet.left[car] + fleet.right[car])
    tilt = np.array([ahead @ fleet.direction[car], side @ fleet.direction[car]])
    tilt = np.array([1.0, 0.0]) if abs(tilt[1]) <= 1e-15 else tilt / np.hypot(*tilt)
    return (
        np.array([*middle, *ahead, np.arctan2(ahead[1], ahead[0]) % (2 * np.pi)]),
        np.array([radius, *tilt, *(fleet.rates[car] * [1.0, radius, 1.0])]),
    )


def time_laws(fleet: Fleet, car: int) -> tuple[tuple[float, float, float, float], ...] | None:
    """Laws of left turn, straight and right turn as kernels.timed_between takes them, or None if the cost is linear.

    A way of length w takes w/v + v/a, or 2 √(w/a) where it is shorter than v²/a and the speed v is not reached.
    """
    v, a = fleet.speeds[car], fleet.accelerations[car]
    if np.all(np.isinf(v)):
        return None
    unit = fleet.rates[car] * np.array([1.0, float(fleet.radius[car]), 1.0])
    laws = np.stack([unit / v, v / a, 4 * unit / a, v**2 / (a * unit)], axis=1)
    left, straight, right = (tuple(float(number) for number in law) for law in laws)
    return left, straight, right  # type: ignore[return-value]


def _car_filler(fleet: Fleet, car: int, X: Array, Y: Array, costs: Array) -> Callable[[Any], bool]:
    from .kernels import three_twist_costs, timed_costs

    body, numbers = axle(fleet, car)
    laws = time_laws(fleet, car)
    if laws is None:
        return lambda bounds: three_twist_costs(X, Y, body, numbers, bounds, costs)
    return lambda bounds: timed_costs(X, Y, body, numbers, laws, bounds, costs)


def _share(
    fill: Callable[[Any], bool],
    shape: tuple[int, int],
    threads: int | None,
    poses: tuple[ArrayLike, ArrayLike],
) -> None:
    """Has the threads fill equal parts of the rows, or of the columns where these are more; refuses strange poses."""
    rows, columns = shape
    count = threads or (os.cpu_count() or 1 if rows * columns > THREADED else 1)
    cuts = [max(rows, columns) * i // count for i in range(count + 1)]
    parts = [(a, b) for a, b in pairwise(cuts) if b > a]
    bounds = [(a, b, 0, columns) if rows >= columns else (0, rows, a, b) for a, b in parts]
    if len(bounds) == 1:
        finite = fill(bounds[0])
    else:
        with ThreadPoolExecutor(len(bounds)) as pool:
            finite = all(list(pool.map(fill, bounds)))
    if not finite:
        _poses(poses[0], "starts")
        _poses(poses[1], "goals")


def _pairs(starts: ArrayLike, goals: ArrayLike) -> tuple[tuple[int, ...], tuple[int, int], Array, Array]:
    """The broadcast leading shape, the same as (n, m), and starts and goals as contiguous (n or 1, m or 1, 3)."""
    X, Y = _shaped_poses(starts, "starts"), _shaped_poses(goals, "goals")
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
