"""How wide the widest way from a start to a goal is: told where the object does not fit through."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...geometry import transform
from ...geometry.pose import Array
from ..query import Query
from .endpoints import SIDES
from .lattice.search import largest_disc

if TYPE_CHECKING:
    from shapely import Geometry

HALVINGS = 12
ROUND = 32  # chords of a quarter of a circle
ROUNDED = 1 - np.cos(np.pi / (4 * ROUND))  # by how much of its radius a circle of chords is less


@dataclass(frozen=True)
class WidestWay:
    """How much gets from a start to a goal.

    Attributes:
        radius: of the largest disc that gets through [m], at most `largest`; 0 if none does.
        largest: radius of the largest disc inside the object [m].
        narrowest: where it is tightest for the disc [m], in W; None where nothing or all of the object gets through.
        beside: names of what is as near there as the disc allows, the nearest two.
    """

    radius: float
    largest: float
    narrowest: tuple[float, float] | None = None
    beside: tuple[str, ...] = ()


def widest_way(query: Query) -> WidestWay:
    """The widest way of a disc, with the clearance on either side, from the middle of the object to its goal."""
    import shapely

    middle, largest = largest_disc(query)
    start = shapely.Point(transform(query.start, middle))
    goals = [shapely.Point(transform(X, middle)) for X in (query.goal, *query.other_goals)]
    obstacles = [shapely.Polygon(thing.polyline()) for thing in query.world.obstacles]
    things = shapely.union_all(obstacles)
    extent = np.array(query.extent)

    def around_start(radius: float) -> list["Geometry"]:
        """Where the disc's middle gets from the start, and after it where else it has room."""
        room = _shrunk(query.world.bounds, extent, radius + query.clearance)
        space = room.difference(things.buffer(radius + query.clearance, quad_segs=ROUND))
        parts = shapely.get_parts(space)
        near = [part for part in parts if part.intersects(start)]
        return [shapely.union_all(near), *(part for part in parts if not part.intersects(start))]

    low, high = 0.0, largest
    for _ in range(HALVINGS):
        radius = 0.5 * (low + high)
        reached = around_start(radius)[0]
        low, high = (radius, high) if any(reached.intersects(goal) for goal in goals) else (low, radius)
    if not low > 0 or high == largest:
        return WidestWay(low, largest)
    # Just above that radius the way falls apart, where it is narrowest.
    through, (here, *others) = around_start(low)[0], around_start(high)
    beyond = shapely.union_all([part for part in others if part.intersects(through)])
    if here.is_empty or beyond.is_empty:
        return WidestWay(low, largest)
    between = shapely.shortest_line(here, beyond).interpolate(0.5, normalized=True)
    spot = shapely.shortest_line(through, between).interpolate(0.0)
    sides = [(f"obstacle {k}", spot.distance(thing)) for k, thing in enumerate(obstacles)]
    gaps = np.abs(np.array([spot.x, spot.y, spot.x, spot.y]) - query.world.bounds)
    sides += [(f"the {side} side of the bounds", float(gap)) for side, gap in zip(SIDES, gaps, strict=True)]
    near = low + query.clearance + 2 * (high - low) + ROUNDED * (largest + query.clearance)
    beside = [name for name, gap in sorted(sides, key=lambda side: side[1]) if gap < near]
    return WidestWay(low, largest, (float(spot.x), float(spot.y)), tuple(beside[:2]))


def _shrunk(bounds: Array, extent: Array, by: float) -> "Geometry":
    """The box of the bounds less a border; where there is no side, that of the extent."""
    import shapely

    xmin, ymin, xmax, ymax = np.where(
        np.isfinite(bounds), bounds + by * np.array([1, 1, -1, -1]), extent
    ).tolist()
    return shapely.box(xmin, ymin, xmax, ymax) if xmin < xmax and ymin < ymax else shapely.Polygon()
