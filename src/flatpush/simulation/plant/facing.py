"""Where an outline faces a point, on plain numbers: the nearest place, and in a hollow the next one."""

import math
from typing import NamedTuple

import numpy as np

from ...formulas import formula
from .arrays import OutlineArrays

OVERLAP = 1e-5  # a deeper overlap at the start, by the outline's size, is inside


class Place(NamedTuple):
    """Where an outline faces a point: signed distance, point in O, inward normal, and the feature.

    Features: 2k an edge, 2k + 1 the corner at its start; of a circle 0; -1 where nothing faces it.
    """

    distance: float
    x: float
    y: float
    nx: float
    ny: float
    feature: int


@formula
def nearest(outline: OutlineArrays, x: float, y: float) -> Place:
    """The nearest place of the outline to a point in O."""
    if outline.circle:
        dx, dy = x - outline.x, y - outline.y
        d = math.sqrt(dx * dx + dy * dy)
        ux, uy = (dx / d, dy / d) if d > 0 else (1.0, 0.0)
        R = outline.radius
        return Place(d - R, outline.x + R * ux, outline.y + R * uy, -ux, -uy, 0)
    best, found, corner = np.inf, 0, False
    for i in range(len(outline.edges)):
        edge = outline.edges[i]
        dx, dy = x - edge.x, y - edge.y
        s = dx * edge.ex + dy * edge.ey
        if s < 0:
            square = dx * dx + dy * dy
            if square < best:
                best, found, corner = square, i, True
        elif s <= edge.length:
            d = dx * edge.nx + dy * edge.ny
            if d * d < best:
                best, found, corner = d * d, i, False
    edge = outline.edges[found]
    dx, dy = x - edge.x, y - edge.y
    nx, ny = edge.nx, edge.ny
    if not corner:
        s = dx * edge.ex + dy * edge.ey
        return Place(-(dx * nx + dy * ny), edge.x + s * edge.ex, edge.y + s * edge.ey, nx, ny, 2 * found)
    d = math.sqrt(best)
    sign = 1.0 if edge.convex > 0.5 else -1.0
    if d > 1e-12 * outline.size:
        nx, ny = -sign * dx / d, -sign * dy / d
    return Place(sign * d, edge.x, edge.y, nx, ny, 2 * found + 1)


@formula
def second(outline: OutlineArrays, x: float, y: float, taken: int) -> Place:
    """As nearest, for another edge or corner that faces the point; distance inf if there is none.

    Only an outline that is not convex can meet a round finger twice.
    """
    if outline.convex:
        return Place(np.inf, 0.0, 0.0, 0.0, 0.0, -1)
    best, found, corner = np.inf, -1, False
    count = len(outline.edges)
    least = -OVERLAP * outline.size
    for i in range(count):
        edge = outline.edges[i]
        dx, dy = x - edge.x, y - edge.y
        s = dx * edge.ex + dy * edge.ey
        if s < 0:
            if 2 * i + 1 == taken or edge.convex < 0.5:
                continue
            before = outline.edges[i - 1 if i > 0 else count - 1]
            d = math.sqrt(dx * dx + dy * dy)
            if (x - before.x) * before.ex + (y - before.y) * before.ey > before.length and d < best:
                best, found, corner = d, i, True
        elif s <= edge.length and 2 * i != taken:
            d = -(dx * edge.nx + dy * edge.ny)
            if least < d < best:
                best, found, corner = d, i, False
    if found < 0:
        return Place(np.inf, 0.0, 0.0, 0.0, 0.0, -1)
    edge = outline.edges[found]
    dx, dy = x - edge.x, y - edge.y
    if corner:
        return Place(best, edge.x, edge.y, -dx / best, -dy / best, 2 * found + 1)
    s = dx * edge.ex + dy * edge.ey
    return Place(best, edge.x + s * edge.ex, edge.y + s * edge.ey, edge.nx, edge.ny, 2 * found)
