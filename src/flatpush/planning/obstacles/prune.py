"""Paths with fewer pieces: arcs of a fraction of a millimetre save next to nothing, and each starts and stops."""

import numpy as np

from ..path import COLUMNS, NOTHING, Path, Piece, pieces_of
from .task import Task

WORTH = 5e-4  # of the cost of the path, that each piece must save
WINDOW = 7  # pieces that one word may replace
SWEEPS = 6


def pruned(task: Task, path: Path) -> Path:
    """The same path with words instead of several pieces where they keep clear and cost hardly more."""
    worth = WORTH * path.cost
    for _ in range(SWEEPS):
        better = _swept(task, path, worth)
        if better is None:
            return path
        path = better
    return path


def _swept(task: Task, path: Path, worth: float) -> Path | None:
    """One sweep over all windows; None where nothing changed."""
    pieces, done, changed = list(path.pieces), 0, False
    while done < len(pieces):
        path = Path(path.fleet, path.start, tuple(pieces))
        for end in range(min(len(pieces), done + WINDOW), done + 1, -1):
            word = _fewer(task, path, done, end, worth)
            if word is not None:
                pieces[done:end] = word
                changed = True
                break
        done += 1
    return Path.of(path.fleet, path.start, pieces) if changed else None


def _fewer(task: Task, path: Path, first: int, end: int, worth: float) -> list[Piece] | None:
    """A word with fewer pieces than those from `first` up to `end`, not included, that is worth it."""
    from .kernels import WORDS, word_clear, words_between

    old = path.pieces[first:end]
    push = old[0][0]
    if any(piece[0] != push for piece in old):
        return None
    T, rows, start = task.arrays, np.empty((WORDS, COLUMNS)), path.poses[first]
    cost = Path(path.fleet, path.start, old).cost
    found = words_between(T, push, start, path.poses[end], rows)
    for row in rows[:found]:
        pieces = [piece for piece in pieces_of(push, row) if piece[2] > NOTHING]
        gone = len(old) - len(pieces)
        if row[0] > cost + worth * gone:
            return None  # so are those that follow
        if gone > 0 and word_clear(T, push, start, row):
            return pieces
    return None
