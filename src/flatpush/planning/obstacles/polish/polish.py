"""A path as a chain of legs that get better."""

import numpy as np

from ...path import Path, Piece, pieces_of
from ...query import Query

KNOT = 5e-4  # of the cost, that a knot must save: every piece starts and ends at rest
KNOTS = 48  # of a path, of which the cheapest chain is made


class Chain:
    """A path that keeps clear, improved in place by improve().

    Attributes:
        cost: that the chain is judged by, of replanning for robust queries; path: what it is.
    """

    def __init__(self, query: Query, path: Path, seed: int) -> None:
        from ....steering.six_words import WORD
        from ..kernels import stands
        from .kernels import MOST, Legs, thread, worth

        self.query = query
        able = [stands(query.arrays, a, path.poses[-1]) for a in range(query.fleet.size)]
        self._query_arrays = query.arrays._replace(last=np.array(able))
        self.state = np.array([seed], dtype=np.uint64)
        self._arrays = Legs(np.zeros((MOST + 1, 3)), np.zeros(MOST, np.int64), np.zeros(MOST, WORD))
        legs = _legs(path)
        knots = np.array([path.poses[i] for i in [0, *np.cumsum([len(leg) for leg in legs])]])
        arrived = np.array([leg[0][0] for leg in legs])
        given = np.zeros(len(legs), WORD)
        for word, leg in zip(given, legs, strict=True):
            word["cost"] = Path.of(path.fleet, path.start, leg).cost
            for i, (_, letter, amount) in enumerate(leg):
                word["letter"][i], word["amount"][i] = letter, amount
        self.legs = int(thread(self._query_arrays, knots, arrived, given, len(legs), self._arrays))
        self.cost = float(worth(self._query_arrays, self._arrays, self.legs)) if self.legs else np.inf

    def improve(self, moves: int, knot: float = KNOT) -> bool:
        """Tries a number of moves; True if the path got cheaper.

        Args:
            knot: the part of the cost that a knot must save.
        """
        from .kernels import polish, worth

        before = self.cost
        self.legs = int(polish(self._query_arrays, self._arrays, self.legs, self.state, moves, knot))
        self.cost = float(worth(self._query_arrays, self._arrays, self.legs))
        return self.cost < before * (1 - 1e-12)

    @property
    def sequence(self) -> tuple[int, ...]:
        """Its pushes, in order."""
        found = self._arrays.pushes[: self.legs].tolist()
        return tuple(p for i, p in enumerate(found) if i == 0 or found[i - 1] != p)

    @property
    def path(self) -> Path:
        pieces: list[Piece] = []
        for push, word in zip(self._arrays.pushes[: self.legs], self._arrays.words[: self.legs], strict=True):
            pieces += pieces_of(int(push), word)
        return Path.of(self.query.fleet, self._arrays.poses[0], pieces)


def _legs(path: Path) -> list[list[Piece]]:
    """The pieces in legs of up to three of one push: short ones, unless the path is long."""
    size = 1 if len(path.pieces) <= KNOTS else 3
    legs: list[list[Piece]] = []
    for piece in path.pieces:
        if legs and len(legs[-1]) < size and legs[-1][0][0] == piece[0]:
            legs[-1].append(piece)
        else:
            legs.append([piece])
    return legs
