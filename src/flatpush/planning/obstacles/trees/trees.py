"""Two random trees that look for a first way."""

import numpy as np

from ..path import Piece, Way
from ..task import Task

ROOM = 512  # nodes of each tree
BUDGET = 2000  # words looked at


class Trees:
    """Grown at once, deterministic for a seed.

    Args:
        budget: of words to look at.
        direct: whether one word from the start to the goal is tried before anything grows.

    Attributes:
        way: the way that was found, or None; far from the cheapest.
        size: nodes of both trees; work: words that were looked at.
    """

    def __init__(self, task: Task, seed: int, budget: int = BUDGET, direct: bool = True) -> None:
        from .kernels import COLUMNS, grow, straight

        k = task.fleet.size
        self._task = task
        first = np.zeros(k, np.bool_)
        first[task.first] = True
        link = np.zeros(COLUMNS)
        self.size, self.work = 2, k
        push = int(straight(task.arrays, first, task.start, task.goal, link)) if direct else -1
        if push >= 0:
            self.way: Way | None = Way.of(task.fleet, task.start, self._pieces(push, link))
            return
        self._poses, self._rows = np.empty((2, ROOM, 3)), np.zeros((2, ROOM, COLUMNS))
        self._pushes, self._parents = np.full((2, ROOM), -1), np.full((2, ROOM), -1)
        self._poses[:, 0] = task.start, task.goal
        sizes, joint = np.ones(2, np.int64), np.full(3, -1)
        left = grow(
            task.arrays, task.extent, first, self._poses, self._pushes, self._parents, self._rows, sizes,
            np.array([seed], dtype=np.uint64), joint, link, budget - k,
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
