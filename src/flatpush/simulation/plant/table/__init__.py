"""Limit surfaces and outlines as plain arrays, for the compiled simulation."""

import numpy as np

from ....errors import FlatpushError
from ....friction import Ellipsoid, Exact, LimitSurface, Quartic
from ....friction.pressure import Edges, Feet, Round
from ....geometry import Outline
from ....geometry.pose import Array

ELLIPSOID, FEET, QUARTIC, EDGES, ROUND = 0, 1, 2, 3, 4
_COLUMNS = 15


def compilable(surface: LimitSurface) -> bool:
    """Whether the compiled simulation knows the surface: all but collinear feet and surfaces of a user's own."""
    return isinstance(surface, Ellipsoid | Quartic) or (
        isinstance(surface, Exact) and not surface.support.collinear
    )


def surface_table(surface: LimitSurface) -> tuple[int, Array]:
    """A limit surface about the centre of friction as (kind, table) for the kernels, table of shape (rows, 15).

    Row 0: the unit of length ℓ [m], then, of a support, its radius, whether it is filled, its size and how many edges
    follow; all lengths from here on are in ℓ. Ellipsoid: A and its inverse. Quartic: its balanced coefficients. Feet:
    x, y, weight, and of the rotation about the foot the dissipation and the others' wrench. Edges: direction, ends,
    distance, then, like a round pressure, the points that stand for it from far away.

    Raises:
        FlatpushError: if the kernels do not know the surface (see compilable).
    """
    if isinstance(surface, Ellipsoid):
        A = surface.matrix
        ell = float(np.sqrt(np.trace(A[:2, :2]) / 2 / A[2, 2]))
        units = np.array([1.0, 1.0, ell])
        A = A * np.outer(units, units)
        A = A / (np.trace(A) / 3)
        return ELLIPSOID, _rows([[ell], *A, *np.linalg.inv(A)])
    if isinstance(surface, Quartic):
        units = surface._units
        x, y, z = units[0], units[1], units[2]
        powers = [(4, 0, 0), (0, 4, 0), (0, 0, 4), (3, 1, 0), (3, 0, 1), (1, 3, 0), (0, 3, 1), (1, 0, 3)]
        powers += [(0, 1, 3), (2, 2, 0), (2, 0, 2), (0, 2, 2), (2, 1, 1), (1, 2, 1), (1, 1, 2)]
        scale = np.array([x**a * y**b * z**c for a, b, c in powers])
        return QUARTIC, _rows([[z / x], surface.coefficients * scale])
    if not compilable(surface):
        raise FlatpushError("the compiled simulation does not know this limit surface")
    assert isinstance(surface, Exact)
    support = surface.support
    ell = float(np.sqrt(np.trace(support.covariance)))
    pressure, centre = support.pressure.scaled(1 / ell), support.centre / ell
    if isinstance(pressure, Feet):
        points, weights = pressure.points, pressure.weights
        turns = np.stack([points[:, 1], -points[:, 0], np.ones(len(points))], axis=1)
        near = Feet(points, weights)  # the foot itself rests
        h, W, _ = near.resist(turns)
        W[:, 2] += centre[0] * W[:, 1] - centre[1] * W[:, 0]
        rows = np.column_stack([points + centre, weights, h, W])
        return FEET, _rows([[ell, pressure.radius], *rows])
    nodes, weights = pressure.nodes
    far = np.column_stack([nodes + centre, weights])
    if isinstance(pressure, Round):
        return ROUND, _rows([[ell, pressure.radius, float(pressure.filled), 0.0, 0.0, *centre], *far])
    assert isinstance(pressure, Edges)
    start = pressure.vertices
    step = np.roll(start, -1, axis=0) - start
    length = np.hypot(step[:, 0], step[:, 1])
    e = step / length[:, None]
    t0, d = np.sum(start * e, axis=1), start[:, 0] * e[:, 1] - start[:, 1] * e[:, 0]
    size = float(np.sum(d * length) / 2 if pressure.filled else np.sum(length))
    shift, across = e @ centre, e[:, 1] * centre[0] - e[:, 0] * centre[1]
    rows = np.column_stack([e, t0 + shift, t0 + length + shift, d + across])
    head = [ell, pressure.radius, float(pressure.filled), size, float(len(start)), *centre]
    return EDGES, _rows([head, *rows, *far])


def outline_table(outline: Outline) -> Array:
    """An outline for the kernels, shape (edges, 10): start, direction, length, inward normal, whether the corner at the
    start is convex; in row 0 whether all are, and the outline's size. A circle: centre, radius, and length -1."""
    if outline.is_circle:
        row = [*outline.centre, outline.radius, 0.0, -1.0, 0.0, 0.0, 1.0, 1.0, outline.size]
        return np.array([row])
    start = outline.vertices if outline.sense > 0 else outline.vertices[::-1]
    step = np.roll(start, -1, axis=0) - start
    length = np.hypot(step[:, 0], step[:, 1])
    e = step / length[:, None]
    before = np.roll(e, 1, axis=0)
    convex = before[:, 0] * e[:, 1] - before[:, 1] * e[:, 0] >= 0
    table = np.zeros((len(start), 10))
    table[:, :2], table[:, 2:4], table[:, 4] = start, e, length
    table[:, 5], table[:, 6], table[:, 7] = -e[:, 1], e[:, 0], convex
    table[0, 8], table[0, 9] = float(convex.all()), outline.size
    return table


def _rows(rows: list) -> Array:
    table = np.zeros((len(rows), _COLUMNS))
    for i, row in enumerate(rows):
        table[i, : len(row)] = row
    return table
