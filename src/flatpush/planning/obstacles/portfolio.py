"""One search to each of several endpoints, under one budget: for goals that leave the angle open."""

from collections.abc import Iterator, Sequence

import numpy as np

from ...geometry.pose import Array
from ..path import Path
from ..query import Query
from .search import Search


class Portfolio:
    """Searches that take turns; every other round goes to the one with the cheapest path. See Search.

    Args:
        queries: that differ in their goals; the most promising first.
    """

    def __init__(self, queries: Sequence[Query], seed: int) -> None:
        self.searches = [Search(query, seed) for query in queries]

    @property
    def leader(self) -> Search:
        """The search with the cheapest path; without one, the first."""
        return min(self.searches, key=lambda search: search.cost)

    @property
    def best(self) -> Path | None:
        return self.leader.best

    @property
    def cost(self) -> float:
        return self.leader.cost

    @property
    def query(self) -> Query:
        return self.leader.query

    @property
    def work(self) -> int:
        return sum(search.work for search in self.searches)

    @property
    def nodes(self) -> int:
        return sum(search.nodes for search in self.searches)

    @property
    def finest(self) -> float:
        return min(search.finest for search in self.searches)

    @property
    def closed(self) -> bool:
        return all(search.closed for search in self.searches)

    @property
    def direct(self) -> bool:
        return any(search.direct for search in self.searches)

    def rounds(self) -> Iterator[Path | None]:
        """The best path so far after every round; ends only where there is provably none."""
        running = [(search, search.rounds()) for search in self.searches]
        turn = 0
        while running:
            which = turn // 2 % len(running)
            if turn % 2 == 0 and np.isfinite(self.cost):
                leader = self.leader
                which = next((i for i, (search, _) in enumerate(running) if search is leader), which)
            search, rounds = running[which]
            search.known = self.cost
            try:
                next(rounds)
            except StopIteration:
                running.pop(which)
            else:
                yield self.best
            turn += 1

    def value(self, path: Path) -> float:
        """What a path that keeps clear is judged by."""
        return self.searches[0].value(path)

    def offer(self, path: Path) -> bool:
        """Takes a path from elsewhere if it keeps the clearance."""
        return self.searches[0].offer(path)

    def edges(self) -> tuple[Array, Array]:
        """Edges of a tree of the best search."""
        return self.leader.edges()
