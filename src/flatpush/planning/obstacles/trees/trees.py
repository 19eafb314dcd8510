"""Two random trees that look for a first path."""

import numpy as np

from ...path import Path, pieces_of
from ...query import Query

ROOM = 512  # nodes of each tree
BUDGET = 2000  # words looked at


class Trees:
    """Grown at once, deterministic for a seed.

    Args:
        budget: of words to look at.
        direct: whether one word from the start to the goal is tried before anything grows.

    Attributes:
        path: the one that was found, or None; far from the cheapest.
        size: nodes of both trees; work: words that were looked at.
    """

    def __init__(self, query: Query, seed: int, budget: int = BUDGET, direct: bool = True) -> None:
        from ....steering.six_words import WORD
        from .kernels import Forest, grow, straight

        k = query.fleet.size
        self._query = query
        first = np.zeros(k, np.bool_)
        first[query.first] = True
        link = np.zeros(1, WORD)
        self.size, self.work = 2, k
        push = int(straight(query.arrays, first, query.start, query.goal, link)) if direct else -1
        if push >= 0:
            self.path: Path | None = Path.of(query.fleet, query.start, pieces_of(push, link[0]))
            return
        self._forest = Forest(
            np.empty((2, ROOM, 3)), np.full((2, ROOM), -1), np.full((2, ROOM), -1), np.zeros((2, ROOM), WORD),
            np.ones(2, np.int64), first,
        )  # fmt: skip
        self._forest.poses[:, 0] = query.start, query.goal
        joint, state = np.full(3, -1), np.array([seed], dtype=np.uint64)
        left = grow(query.arrays, query.extent, self._forest, state, joint, link, budget - k)
        self.size, self.work = int(self._forest.sizes.sum()), budget - max(int(left), 0)
        self.path = None if left < 0 else self._path(joint, link)

    def _path(self, joint: np.ndarray, link: np.ndarray) -> Path:
        pieces = pieces_of(int(joint[2]), link[0])
        node = int(joint[0])
        while node > 0:
            pieces = pieces_of(int(self._forest.pushes[0, node]), self._forest.words[0, node]) + pieces
            node = int(self._forest.parents[0, node])
        node = int(joint[1])
        while node > 0:
            pieces += pieces_of(int(self._forest.pushes[1, node]), self._forest.words[1, node])
            node = int(self._forest.parents[1, node])
        return Path.of(self._query.fleet, self._query.start, pieces)
