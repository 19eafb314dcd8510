"""Bounds and obstacles with a grid over them, as the arrays that collision checks work on."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..outline import Outline
from ..pose import Array

CELLS = 4.0  # cells of the grid per feature
MOST_CELLS = 250_000
# Where in its cell the reference point lies: not on a line that drawings are likely to have.
REFERENCE = (0.5 + 0.0317811, 0.5 - 0.0291317)

# An edge from a to b, or a circle about a = b with a radius [m]; 1/length² of the edge [1/m²], 0 of a circle.
FEATURE = np.dtype([(name, "f8") for name in ("ax", "ay", "bx", "by", "radius", "inverse")], align=True)


class Box(NamedTuple):
    """A rectangle along the axes [m]."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float


class Grid(NamedTuple):
    """Square cells over all features.

    Attributes:
        x, y: lower left corner [m]; per_metre: cells per metre; columns, rows: how many.
        u, v: place of a cell's reference point in it, 0 to 1.
    """

    x: float
    y: float
    per_metre: float
    columns: int
    rows: int
    u: float
    v: float


class WorldArrays(NamedTuple):
    """A world as kernels see it.

    Attributes:
        features: of FEATURE; edges: how many of them, the first ones, are edges.
        bounds: infinite where there is no side.
        grid: over the features; items: the features of its cells, those of cell i at starts[i] to starts[i + 1].
        winding: how often the polygons go around each cell's reference point.
        stamps, near: scratch: when each feature was last looked at, with a counter at the end; what is near.
    """

    features: np.ndarray
    edges: int
    bounds: Box
    grid: Grid
    starts: np.ndarray
    items: np.ndarray
    winding: np.ndarray
    stamps: np.ndarray
    near: np.ndarray


Cells = tuple[Grid, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class World:
    """What a moving body must keep clear of.

    Build with World.of. Obstacles may overlap each other and reach over the bounds; they are numbered as given.

    Attributes:
        bounds: (xmin, ymin, xmax, ymax) [m], infinite where there is no side; the body stays inside.
        obstacles: polygons, convex or not, and circles.
    """

    bounds: Array
    obstacles: tuple[Outline, ...]

    @classmethod
    def of(cls, bounds: ArrayLike | None = None, obstacles: Iterable[Outline | ArrayLike] = ()) -> "World":
        """From bounds (None: none) and obstacles, each an Outline or the corners of a polygon, shape (n, 2)."""
        box = np.array([-np.inf, -np.inf, np.inf, np.inf] if bounds is None else bounds, dtype=float)
        return cls(box, tuple(o if isinstance(o, Outline) else Outline.polygon(o) for o in obstacles))

    @property
    def empty(self) -> bool:
        """Whether nothing can be touched: no obstacles and no bounds."""
        return not self.obstacles and not np.any(np.isfinite(self.bounds))

    @cached_property
    def features(self) -> np.ndarray:
        """Edges of polygons, counter-clockwise, then circles, of FEATURE, shape (n,)."""
        rows = []
        for o in self.obstacles:
            if not o.is_circle:
                corners = o.vertices if o.sense > 0 else o.vertices[::-1]
                ends = np.roll(corners, -1, axis=0)
                inverse = 1.0 / np.sum((ends - corners) ** 2, axis=1)
                rows.append(np.column_stack([corners, ends, np.zeros(len(corners)), inverse]))
        rows += [np.array([[*o.centre, *o.centre, o.radius, 0.0]]) for o in self.obstacles if o.is_circle]
        table = np.concatenate(rows) if rows else np.zeros((0, 6))
        return np.ascontiguousarray(table).view(FEATURE).reshape(-1)

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Lower and upper corners of a box about each feature, both of shape (n, 2) [m]."""
        return _boxes(self.features)

    @cached_property
    def owners(self) -> np.ndarray:
        """The obstacle of each feature, shape (n,)."""
        polygons = [i for i, o in enumerate(self.obstacles) for _ in range(len(o.vertices))]
        return np.array(polygons + [i for i, o in enumerate(self.obstacles) if o.is_circle], dtype=np.int64)

    @cached_property
    def edges(self) -> int:
        """How many features are edges."""
        return sum(len(o.vertices) for o in self.obstacles)

    @property
    def arrays(self) -> "WorldArrays":
        """What the kernels take; its scratch is one thread's."""
        n = len(self.features)
        scratch = np.zeros(n + 1, np.int64), np.zeros(n, np.int64)
        return WorldArrays(self.features, self.edges, Box(*self.bounds.tolist()), *self._cells, *scratch)

    @cached_property
    def _cells(self) -> Cells:
        # While something is dragged the same obstacles are laid out for plan after plan.
        return _laid_out(self.features.tobytes(), self.edges)


def _boxes(F: np.ndarray) -> tuple[Array, Array]:
    a, b = np.column_stack([F["ax"], F["ay"]]), np.column_stack([F["bx"], F["by"]])
    r = F["radius"][:, None]
    return np.minimum(a, b) - r, np.maximum(a, b) + r


@lru_cache(maxsize=8)
def _laid_out(features: bytes, edges: int) -> Cells:
    """The grid over features, where the list of each cell begins, the lists, and winding numbers."""
    if not features:
        grid = Grid(0.0, 0.0, 1.0, 1, 1, *REFERENCE)
        return grid, np.zeros(2, np.int64), np.zeros(0, np.int64), np.zeros(1, np.int64)
    F = np.frombuffer(features, FEATURE)
    low, high = _boxes(F)
    corner, size = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
    cells = min(CELLS * len(F) + 16, MOST_CELLS)
    cell = float(np.sqrt(np.prod(size + 1e-3 * size.max()) / cells)) + 1e-12
    corner = corner - 1e-3 * cell
    nx, ny = (int(n) + 1 for n in (size + 2e-3 * cell) / cell)
    grid = Grid(float(corner[0]), float(corner[1]), 1.0 / cell, nx, ny, *REFERENCE)
    pairs = _cells_of(F, edges, corner, cell, nx, ny)
    order = np.argsort(pairs[:, 0], kind="stable")
    pairs = pairs[order]
    starts = np.searchsorted(pairs[:, 0], np.arange(nx * ny + 1))
    reference = corner + cell * (
        np.stack(np.meshgrid(np.arange(nx), np.arange(ny)), axis=-1).reshape(-1, 2) + REFERENCE
    )
    return grid, starts.astype(np.int64), pairs[:, 1].copy(), _winding(F[:edges], reference, nx, ny)


def _cells_of(F: np.ndarray, edges: int, corner: Array, cell: float, nx: int, ny: int) -> np.ndarray:
    """Pairs (cell, feature) of all cells that a feature meets, with a little to spare, shape (n, 2)."""
    slack = 1e-6 * cell
    pairs = []
    for f, (ax, ay, bx, by, r, _) in enumerate(F.tolist()):
        low = (np.minimum([ax, ay], [bx, by]) - r - slack - corner) / cell
        high = (np.maximum([ax, ay], [bx, by]) + r + slack - corner) / cell
        i = np.arange(max(0, int(low[0])), min(nx - 1, int(high[0])) + 1)
        j = np.arange(max(0, int(low[1])), min(ny - 1, int(high[1])) + 1)
        columns, rows = np.meshgrid(i, j)
        centre = corner + cell * (np.stack([columns, rows], axis=-1).reshape(-1, 2) + 0.5)
        if f < edges:
            # An edge meets a cell of its box if it is not farther off along its own normal.
            d = np.array([bx - ax, by - ay])
            off = (centre - [ax, ay]) @ np.array([-d[1], d[0]])
            keep = np.abs(off) <= (0.5 * cell + slack) * np.abs(d).sum()
        else:
            gap = np.maximum(np.abs(centre - [ax, ay]) - 0.5 * cell, 0.0)
            keep = np.hypot(*gap.T) <= r + slack
        cells = (rows.ravel() * nx + columns.ravel())[keep]
        pairs.append(np.column_stack([cells, np.full(len(cells), f)]))
    return np.concatenate(pairs).astype(np.int64)


def _winding(edges: np.ndarray, points: Array, nx: int, ny: int) -> np.ndarray:
    """How often the polygons go around the reference points of the cells, shape (ny · nx,): counted along rows."""
    count = np.zeros((ny, nx + 1), dtype=np.int64)
    y = points.reshape(ny, nx, 2)[:, 0, 1]
    x = points.reshape(ny, nx, 2)[0, :, 0]
    for ax, ay, bx, by, *_ in edges.tolist():
        rows = np.flatnonzero((ay > y) != (by > y))
        at = ax + (y[rows] - ay) * (bx - ax) / (by - ay) if len(rows) else np.zeros(0)
        # Points to the left of the crossing see it to their right.
        np.add.at(count, (rows, np.searchsorted(x, at)), 1 if by > ay else -1)
    # A crossing counts for all columns before it.
    return np.ascontiguousarray(np.cumsum(count[:, ::-1], axis=1)[:, ::-1][:, 1:]).ravel()
