"""Paths with fewer pieces: arcs of a fraction of a millimetre save next to nothing, and each starts and stops."""

import numpy as np

from ..path import NOTHING, Path, Piece, pieces_of
from ..query import Query
from .polish.polish import KNOT

WINDOW = 7  # pieces that one word may replace
SWEEPS = 6


def pruned(query: Query, path: Path, knot: float = KNOT) -> Path:
    """The same path with words instead of several pieces where they keep clear and cost hardly more.

    Args:
        knot: the part of the cost of the path that each piece must save.
    """
    worth = knot * path.cost
    for _ in range(SWEEPS):
        better = _swept(query, path, worth)
        if better is None:
            return path
        path = better
    return path


def _swept(query: Query, path: Path, worth: float) -> Path | None:
    """One sweep over all windows; None where nothing changed."""
    pieces, done, changed = list(path.pieces), 0, False
    while done < len(pieces):
        path = Path(path.fleet, path.start, tuple(pieces))
        for end in range(min(len(pieces), done + WINDOW), done + 1, -1):
            word = _fewer(query, path, done, end, worth)
            if word is not None:
                pieces[done:end] = word
                changed = True
                break
        done += 1
    return Path.of(path.fleet, path.start, pieces) if changed else None


def _fewer(query: Query, path: Path, first: int, end: int, worth: float) -> list[Piece] | None:
    """A word with fewer pieces than those from `first` up to `end`, not included, that is worth it."""
    from ...steering.six_words import MOST_WORDS, WORD, every_word
    from .kernels import word_clear

    old = path.pieces[first:end]
    push = old[0][0]
    if any(piece[0] != push for piece in old):
        return None
    T, words, start = query.arrays, np.zeros(MOST_WORDS, WORD), path.poses[first]
    cost = Path(path.fleet, path.start, old).cost
    count = every_word(T.cars, push, start, path.poses[end], words)
    for index in range(count):
        pieces = [piece for piece in pieces_of(push, words[index]) if piece[2] > NOTHING]
        gone = len(old) - len(pieces)
        if words["cost"][index] > cost + worth * gone:
            return None  # so are those that follow
        if gone > 0 and word_clear(T, push, start, words, index):
            return pieces
    return None
