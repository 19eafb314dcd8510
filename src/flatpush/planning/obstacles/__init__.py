"""Plans among obstacles: a way at once, then better ones while there is time.

A lattice search over steps of all pushes, with exact words on to the goal from every pose, finds the first way; finer
lattices find narrower ones, and what they find is made shorter by moves that keep it clear (lattice, polish, search).
Whether a motion keeps the clearance is decided exactly, between its ends included (geometry.collision).
"""

from .asked import careful, legs_of, obstructions, task_of, way_of
from .ends import check_ends
from .path import Way
from .search import Search
from .task import Task
from .tidy import tidied

__all__ = [
    "Search",
    "Task",
    "Way",
    "careful",
    "check_ends",
    "legs_of",
    "obstructions",
    "task_of",
    "tidied",
    "way_of",
]
