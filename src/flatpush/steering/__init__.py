"""The car of a push and how to steer it: flat output and Dubins paths, three-twist words."""

from . import dubins
from .flat import FlatOutput, flat_output
from .three_twist import Word, shortest_word, words

__all__ = ["FlatOutput", "Word", "dubins", "flat_output", "shortest_word", "words"]
