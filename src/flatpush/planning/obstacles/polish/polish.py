"""A path as a chain of legs that get better."""

import numpy as np

from ..path import Piece, Way
from ..task import Task

COLUMNS = 7  # of a word: cost, then letter and amount of three pieces
KNOTS = 48  # of a path, of which the cheapest chain is made


class Chain:
    """A path that keeps clear, improved in place by improve().

    Attributes:
        cost: of the chain; way: what it is.
    """

    def __init__(self, task: Task, way: Way, seed: int) -> None:
        from .kernels import MOST, thread, total

        self.task = task
        self.state = np.array([seed], dtype=np.uint64)
        self.poses, self.pushes = np.zeros((MOST + 1, 3)), np.zeros(MOST, np.int64)
        self.rows = np.zeros((MOST, COLUMNS))
        legs = _legs(way)
        knots = np.array([way.poses[i] for i in [0, *np.cumsum([len(leg) for leg in legs])]])
        arrived = np.array([leg[0][0] for leg in legs])
        given = np.zeros((len(legs), COLUMNS))
        for row, leg in zip(given, legs, strict=True):
            row[0] = Way.of(way.fleet, way.start, leg).cost
            for i, (_, letter, amount) in enumerate(leg):
                row[1 + 2 * i : 3 + 2 * i] = letter, amount
        self.legs = int(
            thread(task.arrays, knots, arrived, given, len(legs), self.poses, self.pushes, self.rows)
        )
        self.cost = float(total(task.arrays, self.pushes, self.rows, self.legs)) if self.legs else np.inf

    def improve(self, moves: int) -> bool:
        """Tries a number of moves; True if the path got cheaper."""
        from .kernels import polish, total

        before = self.cost
        self.legs = int(
            polish(self.task.arrays, self.poses, self.pushes, self.rows, self.legs, self.state, moves)
        )
        self.cost = float(total(self.task.arrays, self.pushes, self.rows, self.legs))
        return self.cost < before * (1 - 1e-12)

    @property
    def sequence(self) -> tuple[int, ...]:
        """Its pushes, in order."""
        found = self.pushes[: self.legs].tolist()
        return tuple(p for i, p in enumerate(found) if i == 0 or found[i - 1] != p)

    @property
    def way(self) -> Way:
        pieces: list[Piece] = []
        for push, row in zip(self.pushes[: self.legs], self.rows[: self.legs], strict=True):
            pieces += [(int(push), int(row[1 + 2 * i]), float(row[2 + 2 * i])) for i in range(3)]
        return Way.of(self.task.fleet, self.poses[0], pieces)


def _legs(way: Way) -> list[list[Piece]]:
    """The pieces in legs of up to three of one push: short ones, unless the path is long."""
    size = 1 if len(way.pieces) <= KNOTS else 3
    legs: list[list[Piece]] = []
    for piece in way.pieces:
        if legs and len(legs[-1]) < size and legs[-1][0][0] == piece[0]:
            legs[-1].append(piece)
        else:
            legs.append([piece])
    return legs
