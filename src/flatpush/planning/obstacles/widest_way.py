"""How wide the widest way from a start to a goal is: told where the object does not fit through."""

import numpy as np

from ...geometry import transform
from ..query import Query
from .lattice.search import largest_disc

CELLS = 60_000  # of the grid
HALVINGS = 8


def widest_way(query: Query) -> tuple[float, float]:
    """Radii of the largest disc that gets through, up to the largest one inside the object, and of that one [m].

    With the clearance on either side, from the middle of the object at the start to that at the goal; 0 if none does.
    Over a grid, and half a cell's diagonal too large at most.
    """
    from .lattice.kernels import distances

    point, largest = largest_disc(query)
    start = transform(query.start, point)
    goals = np.array([transform(X, point) for X in (query.goal, *query.other_goals)])
    box = query.extent
    size = np.array([box.xmax - box.xmin, box.ymax - box.ymin])
    cell = float(np.sqrt(np.prod(size) / CELLS))
    nx, ny = (int(n) + 1 for n in size / cell)
    i, j = np.clip(((start - box[:2]) / cell).astype(int), 0, [nx - 1, ny - 1])

    def through(radius: float) -> bool:
        distance = distances(query.world.arrays, radius, box, cell, nx, ny, goals, query.clearance)
        return bool(np.isfinite(distance[j * nx + i]))

    low, high = 0.0, largest
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if through(middle) else (low, middle)
    return low, largest
