"""A pressure divided into patches with stated sizes, for bounds that must hold at every point of it."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..geometry.pose import Array
from .pressure import Edges, Feet, Pressure, Round


class Patches(NamedTuple):
    """A pressure about its centre, in patches; arrays are read-only.

    Attributes:
        points: the centroid of each, shape (n, 2) [m].
        loads: shape (n,), of sum 1.
        reach: a distance from the centroid that no point of the patch exceeds, shape (n,) [m]; 0 of feet.
        along: unit vectors along the patches that are straight pieces of a line, zero of others, shape (n, 2).
    """

    points: Array
    loads: Array
    reach: Array
    along: Array


@lru_cache(maxsize=64)
def patches(pressure: Pressure, count: int) -> Patches:
    """About so many patches of a pressure; of feet one each.

    Raises:
        TypeError: for a kind of pressure that has no patches.
    """
    found = _divided(pressure, count)
    for values in found:
        values.setflags(write=False)
    return found


def _divided(pressure: Pressure, count: int) -> Patches:
    if isinstance(pressure, Feet):
        none = np.zeros_like(pressure.points)
        return Patches(pressure.points, pressure.weights, none[:, 0], none)
    if isinstance(pressure, Round):
        return _of_round(pressure.radius, pressure.filled, count)
    if not isinstance(pressure, Edges):
        raise TypeError(f"no patches are known of a {type(pressure).__name__}")
    return _of_inside(pressure.vertices, count) if pressure.filled else _of_edges(pressure.vertices, count)


def _of_edges(vertices: Array, count: int) -> Patches:
    ends = np.roll(vertices, -1, axis=0)
    lengths = np.linalg.norm(ends - vertices, axis=1)
    pieces = np.maximum(1, np.round(count * lengths / lengths.sum())).astype(int)
    points = [
        a + np.outer((np.arange(n) + 0.5) / n, b - a) for a, b, n in zip(vertices, ends, pieces, strict=True)
    ]
    each = np.repeat(lengths / pieces, pieces)
    along = np.repeat((ends - vertices) / lengths[:, None], pieces, axis=0)
    return Patches(np.concatenate(points), each / each.sum(), 0.5 * each, along)


def _of_inside(vertices: Array, count: int) -> Patches:
    """Square cells, cut where they lie across the outline."""
    import shapely

    solid = shapely.Polygon(vertices)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    side = float(np.sqrt(solid.area / count))
    number = np.maximum(1, np.ceil((high - low) / side)).astype(int)
    step = (high - low) / number
    i, j = (k.ravel() for k in np.meshgrid(*map(np.arange, number), indexing="ij"))
    corner = low + np.stack([i, j], axis=1) * step
    cells = shapely.intersection(shapely.box(*corner.T, *(corner + step).T), solid)
    pieces = shapely.get_parts(cells)
    pieces = pieces[shapely.area(pieces) > 0]
    areas, middles = shapely.area(pieces), shapely.centroid(pieces)
    points = np.stack([shapely.get_x(middles), shapely.get_y(middles)], axis=1)
    corners, which = shapely.get_coordinates(pieces, return_index=True)
    reach = np.zeros(len(pieces))
    np.maximum.at(reach, which, np.linalg.norm(corners - points[which], axis=1))
    return Patches(points, areas / areas.sum(), reach, np.zeros_like(points))


def _of_round(radius: float, filled: bool, count: int) -> Patches:
    rings = max(1, round(np.sqrt(count / np.pi))) if filled else 1
    found = []
    for k in range(rings):
        inner, outer = (radius * k / rings, radius * (k + 1) / rings) if filled else (radius, radius)
        number = max(6, round(count * (outer**2 - inner**2) / radius**2)) if filled else count
        angles, half = 2 * np.pi * (np.arange(number) + 0.5) / number, np.pi / number
        # The centroid of a sector's arcs, each with its length; the points farthest from it are corners.
        mean = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2) if filled else radius
        middle = mean * np.sin(half) / half
        reach = max(float(np.hypot(r * np.cos(half) - middle, r * np.sin(half))) for r in (inner, outer))
        load = (outer**2 - inner**2) / number if filled else 1.0
        found.append(
            np.column_stack(
                [middle * np.cos(angles), middle * np.sin(angles), np.full((number, 2), [load, reach])]
            )
        )
    x, y, loads, reach_of = np.concatenate(found).T
    points = np.stack([x, y], axis=1)
    return Patches(points, loads / loads.sum(), reach_of, np.zeros_like(points))
