"""An anytime search among obstacles: trees, then lattices from coarse to fine, and every path they find made better."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...geometry.pose import Array
from ..path import Path
from ..query import Query
from .lattice import Lattice, Level, Reach
from .polish import Chain
from .trees import Trees

FINER = 0.72  # from level to level
# Ways that are dearer than the best by this may still become the best; where the end may turn, by that, if they end
# with another push: the first are cheap, and a turn makes others cheaper.
SLACK, SLACK_FREE = 1.03, 1.2
EXPANSIONS, MOVES = (
    800,
    1200,
)  # of a round: poses, divided by the number of pushes, and tries at a better path
REPLANNED = 8  # moves that one counts as which is judged by replanning
CHAINS, ALIKE = 5, 2  # that are kept; where the end may turn, so many of one sequence of pushes
# Where the end may turn a new chain is polished so often as it gets cheaper by more, before it is compared.
SETTLE, SETTLED, DEARER = 5, 0.99, 1.05
# Moves at last, and the part of the cost that a knot must then save; so often.
FINE_KNOT = 1e-4
FINISH, CYCLES = ((2000, 1e-5), (4000, FINE_KNOT)), 4
GOALS = 4  # of several, to which trees are grown
MOST = 1 << 20  # poses of a lattice; then the next begins
ANGLES = (12, 1024)
DRAWN = 2000  # edges of a tree, for figures


class Search:
    """One search, in rounds of some hundredths of a second; see rounds().

    Attributes:
        best: the cheapest path so far, or None; cost: what it is judged by, infinite without one.
        work: poses expanded and moves tried so far.
        nodes: poses of all lattices so far.
        finest: cell of the finest lattice so far [m].
        closed: whether there is provably no path: not even for the largest disc inside the object.
        direct: whether that disc is known to have a path that is hardly longer than the straight one.
    """

    def __init__(self, query: Query, seed: int) -> None:
        self.query = query
        self.best: Path | None = None
        self.cost = np.inf
        self.work = 0
        self.nodes = 0
        self.finest = np.inf
        self.chains: list[Chain] = []
        self.closed, self.direct = False, False
        self._seed = seed
        self._moves = MOVES // REPLANNED if query.robust else MOVES
        self._alike = ALIKE if query.free else CHAINS
        self._drawn: Lattice | None = None

    @cached_property
    def _rng(self) -> np.random.Generator:
        return np.random.default_rng(self._seed)

    def value(self, path: Path) -> float:
        """What a path that keeps clear is judged by: its cost, or, for a robust query, that of replanning.

        After each change the push is planned again from where the switch pose is missed to where three pieces of it,
        or fewer, were to end.
        """
        if not self.query.robust:
            return path.cost
        from .kernels import cost_replanned

        total, pieces = path.cost, path.pieces
        for i in range(1, len(pieces)):
            push = pieces[i][0]
            if push != pieces[i - 1][0]:
                end = next(
                    (j for j in range(i, len(pieces)) if j == i + 3 or pieces[j][0] != push), len(pieces)
                )
                own = Path(path.fleet, path.poses[i], pieces[i:end]).cost
                total += (
                    cost_replanned(self.query.arrays, push, path.poses[i], path.poses[end], path.cost) - own
                )
        return total

    def _take(self, path: Path) -> bool:
        """Keeps a path if it is better than the best."""
        value = self.value(path)
        if value >= self.cost:
            return False
        self.best, self.cost = path, value
        return True

    def rounds(self) -> Iterator[Path | None]:
        """The best path so far after every round; ends only where there is provably none.

        Two random trees come first, for where there is room. Then two families of lattices take turns, one whose
        pushes change on the path and one of single pushes, which gets finer for the same work; each level is searched
        from the start or from the goal, in turns. What they find is polished at once, and the best ways again and
        again.
        """
        if not self.query.first or not any(arrays.last.any() for _, arrays in self.query.aims):
            return
        for goal in (self.query.goal, *self.query.other_goals[: GOALS - 1]):
            trees = Trees(replace(self.query, goal=goal), self._seed)
            self.work += trees.work
            self.nodes += trees.size
            if trees.path is not None:
                self._take(trees.path)
                yield self.best
                self._add(trees.path)
            yield self.best
        reaches = [Reach(self.query)]
        self.closed, self.direct = not reaches[0].open, reaches[0].direct
        if self.closed:
            return
        families = [self._levels(reaches, True)]
        if self.query.fleet.size > 1:
            families.append(self._levels(reaches, False))
        turn = 0
        while True:
            for family in families:
                for found in next(family):
                    if self._take(found):
                        yield self.best
                    self._add(found)
                yield self.best
            if self.chains:
                self._polish(turn)
                turn += 1
                yield self.best

    def _levels(self, reaches: list[Reach], changing: bool) -> Iterator[list[Path]]:
        """Level after level, ever finer, in rounds: better ways where some are found.

        A level is searched from the start and from the goal, in turns; it ends where one of the two is through.
        """
        k = 0
        while True:
            level = level_of(self.query, reaches[0], k, changing)
            self.finest = min(self.finest, level.cell)
            pair: list[Lattice] = []
            while not any(lattice.done or lattice.size > MOST for lattice in pair):
                for back in (0, 1):
                    if len(pair) == back:
                        # The path back is estimated only when it is needed: the first path often comes sooner.
                        query = self.query.reversed if back else self.query
                        if len(reaches) == back:
                            reaches.append(Reach(query))
                        pair.append(Lattice(query, reaches[back], level, self._limit, self._rng, self._spare))
                    lattice = pair[back]
                    found = self._advance(lattice)
                    yield [
                        way.backwards(self.query.fleet, self.query.start) if back else way for way in found
                    ]
                    if lattice.done:
                        break
            k += 1

    @property
    def _limit(self) -> float:
        return self.cost * max(SLACK, self._spare)

    @property
    def _spare(self) -> float:
        return SLACK_FREE if self.query.free else 1.0

    def _advance(self, lattice: Lattice) -> list[Path]:
        seen, expanded = lattice.size, lattice.expanded
        found = lattice.advance(1 + EXPANSIONS // self.query.fleet.size, self._limit)
        self.work += lattice.expanded - expanded
        self.nodes += lattice.size - seen
        if self._drawn is None or self._drawn.size < lattice.size <= DRAWN:
            self._drawn = lattice
        return found

    def _add(self, path: Path) -> None:
        alike = (c.cost for c in self.chains if c.sequence == tuple(path.pushes))
        if self.query.free and path.cost > DEARER * min(alike, default=np.inf):
            return
        chain = Chain(self.query, path, int(self._rng.integers(1 << 60)))
        if chain.legs:
            for _ in range(SETTLE if self.query.free else 1):
                before = chain.cost
                chain.improve(self._moves)
                self.work += MOVES
                if chain.cost > before * SETTLED:
                    break
            self._keep([*self.chains, chain])

    def _polish(self, turn: int) -> None:
        """Every other round the best chain, in between the others in turn."""
        which = 0 if turn % 2 == 0 else turn // 2 % len(self.chains)
        self.chains[which].improve(self._moves)
        self.work += MOVES
        self._keep(self.chains)

    def _keep(self, chains: list[Chain]) -> None:
        kept: list[Chain] = []
        for chain in sorted(chains, key=lambda c: c.cost):
            same = [c for c in kept if c.sequence == chain.sequence]
            if not any(chain.cost < c.cost * 1.002 for c in same) and len(same) < self._alike:
                kept.append(chain)
        self.chains = kept[:CHAINS]
        if self.chains and self.chains[0].cost < self.cost * (1 - 1e-12):
            self._take(self.chains[0].path)

    def finish(self) -> Path | None:
        """The best path after a last polish, in which a knot may save less."""
        for moves, knot in CYCLES * FINISH if self.chains else ():
            self.chains[0].improve(moves, knot)
            self.work += moves
        self._keep(self.chains)
        return self.best

    def clear(self, path: Path) -> bool:
        """Whether a path keeps the clearance; not one without pieces."""
        from .kernels import path_clear

        if not path.pieces:
            return False
        pushes, letters, amounts = (np.array(column) for column in zip(*path.pieces, strict=True))
        return bool(path_clear(self.query.arrays, path.start, pushes, letters, amounts))

    def offer(self, path: Path) -> bool:
        """Takes a path from elsewhere if it keeps the clearance."""
        if not self.clear(path):
            return False
        self._take(path)
        self._add(path)
        return True

    def edges(self) -> tuple[Array, Array]:
        """Edges of a tree of the search: displacements as body twists and poses where they begin, both (m, 3)."""
        if self._drawn is None:
            return np.zeros((0, 3)), np.zeros((0, 3))
        edges, starts = self._drawn.edges(DRAWN)
        path = Path(self._drawn.query.fleet, self.query.start, ())
        return np.array([path.step(int(a), int(letter), x) for a, letter, x, _ in edges]).reshape(
            -1, 3
        ), starts


def level_of(query: Query, reach: Reach, k: int, changing: bool) -> Level:
    """The k-th lattice: cells from a third of the object down, steps that leave a cell, turns that change its layer."""
    box = query.extent
    size = query.bodies[0].outline.size
    largest = max(
        0.75 * float(np.sqrt(reach.radius * size)),
        float(np.sqrt((box.xmax - box.xmin) * (box.ymax - box.ymin))) / 60,
    )
    cell = largest * FINER**k
    step = 1.5 * cell
    angles = int(np.clip(1.5 * 2 * np.pi * float(np.median(query.fleet.radius)) / step, *ANGLES))
    return Level(cell, angles, step, changing, 1.5 if k < 2 else 1.0)
