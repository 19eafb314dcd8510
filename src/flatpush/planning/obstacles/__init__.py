"""Plans among obstacles: a path at once, then better ones while there is time.

A lattice search over steps of all pushes, with exact words on to the goal from every pose, finds the first path; finer
lattices find narrower ones, and what they find is made shorter by moves that keep it clear (lattice, polish, search).
Whether a motion keeps the clearance is decided exactly, between its ends included (geometry.collision).
"""

from .endpoints import TOUCHING, check_endpoints, check_region
from .polish.polish import KNOT
from .prune import pruned
from .scene_query import careful, obstructions, query_of
from .search import FINE_KNOT, Search
from .widest_way import WidestWay, widest_way

__all__ = [
    "FINE_KNOT",
    "KNOT",
    "TOUCHING",
    "Search",
    "WidestWay",
    "careful",
    "check_endpoints",
    "check_region",
    "obstructions",
    "pruned",
    "query_of",
    "widest_way",
]
