"""Ways with fewer pieces: arcs of a fraction of a millimetre save next to nothing, and each begins and ends at rest."""

import numpy as np

from .path import NOTHING, Piece, Way
from .task import Task

WORTH = 5e-4  # of the cost of the way, that each piece must save
WINDOW = 7  # pieces that one word may replace
SWEEPS = 6


def tidied(task: Task, way: Way) -> Way:
    """The same way with words instead of several pieces where they keep clear and cost hardly more."""
    worth = WORTH * way.cost
    for _ in range(SWEEPS):
        better = _swept(task, way, worth)
        if better is None:
            return way
        way = better
    return way


def _swept(task: Task, way: Way, worth: float) -> Way | None:
    """One sweep over all windows; None where nothing changed."""
    pieces, done, changed = list(way.pieces), 0, False
    while done < len(pieces):
        way = Way(way.fleet, way.start, tuple(pieces))
        for end in range(min(len(pieces), done + WINDOW), done + 1, -1):
            word = _fewer(task, way, done, end, worth)
            if word is not None:
                pieces[done:end] = word
                changed = True
                break
        done += 1
    return Way.of(way.fleet, way.start, pieces) if changed else None


def _fewer(task: Task, way: Way, first: int, end: int, worth: float) -> list[Piece] | None:
    """A word with fewer pieces than those from `first` up to `end`, not included, that is worth it."""
    from .kernels import COLUMNS, WORDS, keeps, words

    old = way.pieces[first:end]
    push = old[0][0]
    if any(piece[0] != push for piece in old):
        return None
    T, here, rows = task.arrays, np.empty(3), np.empty((WORDS, COLUMNS))
    cost = Way(way.fleet, way.start, old).cost
    found = words(T[6][push], T[7][push], way.poses[first], way.poses[end], rows)
    for row in rows[:found]:
        pieces = [
            (push, int(letter), float(amount))
            for letter, amount in zip(row[1::2], row[2::2], strict=True)
            if amount > NOTHING
        ]
        gone = len(old) - len(pieces)
        if row[0] > cost + worth * gone:
            return None  # so are those that follow
        if gone > 0 and keeps(T, push, way.poses[first], row, here):
            return pieces
    return None
