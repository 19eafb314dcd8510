"""How wide the widest way from a start to a goal is: told where the object does not fit through."""

from typing import TYPE_CHECKING

import numpy as np

from ...geometry import transform
from ...geometry.pose import Array
from ..query import Query
from .lattice.search import largest_disc

if TYPE_CHECKING:
    from shapely import Geometry

HALVINGS = 12
ROUND = 32  # chords of a quarter of a circle


def widest_way(query: Query) -> tuple[float, float]:
    """Radii of the largest disc that gets through, up to the largest one inside the object, and of that one [m].

    With the clearance on either side, from the middle of the object at the start to that at the goal; 0 if none does.
    """
    import shapely

    middle, largest = largest_disc(query)
    start = shapely.Point(transform(query.start, middle))
    goals = [shapely.Point(transform(X, middle)) for X in (query.goal, *query.other_goals)]
    things = shapely.union_all([shapely.Polygon(thing.polyline()) for thing in query.world.obstacles])
    extent = np.array(query.extent)

    def through(radius: float) -> bool:
        room = _shrunk(query.world.bounds, extent, radius + query.clearance)
        space = room.difference(things.buffer(radius + query.clearance, quad_segs=ROUND))
        parts = [part for part in shapely.get_parts(space) if part.intersects(start)]
        return any(part.intersects(goal) for part in parts for goal in goals)

    low, high = 0.0, largest
    for _ in range(HALVINGS):
        radius = 0.5 * (low + high)
        low, high = (radius, high) if through(radius) else (low, radius)
    return low, largest


def _shrunk(bounds: Array, extent: Array, by: float) -> "Geometry":
    """The box of the bounds less a border; where there is no side, that of the extent."""
    import shapely

    xmin, ymin, xmax, ymax = np.where(
        np.isfinite(bounds), bounds + by * np.array([1, 1, -1, -1]), extent
    ).tolist()
    return shapely.box(xmin, ymin, xmax, ymax) if xmin < xmax and ymin < ymax else shapely.Polygon()
