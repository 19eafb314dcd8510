"""Search on a lattice of poses: A* ([Hart1968]) over steps of the pushes, with exact words on to the goal.

A step is a short turn to the left, straight on or a turn to the right of a push, or the same of another push after a
change. Poses are not moved to the lattice: of all that fall into one cell of position, heading and push the cheapest
is kept. From every pose that is expanded the exact words to the goal are tried, so that an answer is a path that
really ends there, and comes long before the search is through. What is left to go is estimated by the way that the
middle of the largest disc inside the object has to make around the obstacles.

What a coarse lattice does not see, such as a passage narrower than its cells, a finer one finds. Every search is
bounded by the best answer so far, so that fine lattices stay small.
"""

from .search import Lattice, Level, Reach

__all__ = ["Lattice", "Level", "Reach"]
