"""A first way in a fraction of a millisecond where there is much room: two random trees, from the start and the goal.

Before any of that the words of each push straight to the goal are tried. Then one tree after the other is led towards a
random pose, and each new pose is joined by a word with near ones of the other tree ([Kuffner2000]). Every edge is a
word that keeps clear, exact as everywhere. In narrow places this is slow; there the lattice takes over after a few
milliseconds.
"""

from .trees import Trees

__all__ = ["Trees"]
