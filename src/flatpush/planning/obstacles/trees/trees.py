"""Two random trees that look for a first way."""

import numpy as np

from ..path import Piece, Way
from ..task import Task

ROOM = 512  # nodes of each tree
BUDGET = 2000  # words looked at


class Trees:
    """Grown at once, deterministic for a seed.

    Attributes:
        way: the way that was found, or None; far from the cheapest.
        size: nodes of both trees; work: words that were looked at.
    """

    def __init__(self, task: Task, seed: int, budget: int = BUDGET) -> None:
        from .kernels import COLUMNS, grow

        k = task.fleet.size
        self._task = task
        self._poses, self._rows = np.empty((2, ROOM, 3)), np.zeros((2, ROOM, COLUMNS))
        self._pushes, self._parents = np.full((2, ROOM), -1), np.full((2, ROOM), -1)
        self._poses[:, 0] = task.start, task.goal
        sizes, joint, link = np.ones(2, np.int64), np.full(3, -1), np.zeros(COLUMNS)
        first = np.zeros(k, np.bool_)
        first[task.first] = True
        left = grow(
            task.arrays, task.extent, first, self._poses, self._pushes, self._parents, self._rows, sizes,
            np.array([seed], dtype=np.uint64), joint, link, budget,
        )  # fmt: skip
        self.size, self.work = int(sizes.sum()), budget - max(int(left), 0)
        self.way = None if left < 0 else self._way(joint, link)

    def _way(self, joint: np.ndarray, link: np.ndarray) -> Way:
        pieces = self._pieces(int(joint[2]), link)
        node = int(joint[0])
        while node > 0:
            pieces = self._pieces(int(self._pushes[0, node]), self._rows[0, node]) + pieces
            node = int(self._parents[0, node])
        node = int(joint[1])
        while node > 0:
            pieces += self._pieces(int(self._pushes[1, node]), self._rows[1, node])
            node = int(self._parents[1, node])
        return Way.of(self._task.fleet, self._task.start, pieces)

    @staticmethod
    def _pieces(push: int, row: np.ndarray) -> list[Piece]:
        return [(push, int(row[1 + 2 * i]), float(row[2 + 2 * i])) for i in range(3)]
