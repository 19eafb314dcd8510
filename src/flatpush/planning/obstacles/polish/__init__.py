"""Making a path among obstacles better: shortcuts, fewer changes of push, and its poses moved where they cost least.

A path is a chain of legs, each a word of one push from one knot to the next. Moves are tried at random and kept if the
path stays clear and gets cheaper:

* a knot, or several neighbours together, are shifted and turned by a little or by a lot;
* two places of the path, anywhere on it, are joined by one word of some push, which may save a change of push;
* a knot is left out; a knot is put in and shifted, so that a leg may bend where the obstacles want it.

Every leg is the cheapest of the words that keep clear, so that a path also changes its words.
"""

from .polish import Chain

__all__ = ["Chain"]
