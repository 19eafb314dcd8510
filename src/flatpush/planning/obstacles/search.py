"""An anytime search among obstacles: trees, then lattices from coarse to fine, and every way they find made better."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...geometry import compose, exp
from ...geometry.collision import World
from ...geometry.pose import Array
from .lattice import Lattice, Level, Reach
from .path import Way
from .polish import Chain
from .task import Task
from .trees import Trees

FINER = 0.72  # from level to level
SLACK = 1.03  # ways that are dearer than the best by this may still become the best
EXPANSIONS, MOVES = (
    800,
    1200,
)  # of a round: poses, divided by the number of pushes, and tries at a better path
CHAINS = 5  # that are kept
MOST = 1 << 20  # poses of a lattice; then the next begins
ANGLES = (12, 1024)
DRAWN = 2000  # edges of a tree, for figures
NEAR_TWIST = np.array([1.0, 1.0, 0.0])
prepared = False


class Search:
    """One search, in rounds of some hundredths of a second; see rounds().

    Attributes:
        best: the cheapest way so far, or None.
        work: poses expanded and moves tried so far.
        nodes: poses of all lattices so far.
        finest: cell of the finest lattice so far [m].
        closed: whether there is provably no way: not even for a disc inside the object, of radius `disc` [m].
        direct: whether such a disc is known to have a way that is hardly longer than the straight one.
    """

    def __init__(self, task: Task, seed: int) -> None:
        self.task = task
        self.best: Way | None = None
        self.work = 0
        self.nodes = 0
        self.finest = np.inf
        self.chains: list[Chain] = []
        self.closed, self.disc, self.direct = False, 0.0, False
        self._seed = seed
        self._drawn: Lattice | None = None

    @cached_property
    def _rng(self) -> np.random.Generator:
        return np.random.default_rng(self._seed)

    def prepare(self) -> None:
        """Compiles, or loads what was compiled, so that it is not the search's time."""
        global prepared
        if prepared:
            return
        prepared = True
        near = replace(
            self.task, goal=compose(self.task.start, exp(0.5 * self.task.fleet.radius[0] * NEAR_TWIST))
        )
        near = replace(near, world=World.of())
        Trees(near, 0, direct=False)
        one = Search(near, 0)
        for turn, _ in enumerate(one.rounds()):
            if turn > 8:
                break

    @property
    def cost(self) -> float:
        return np.inf if self.best is None else self.best.cost

    def rounds(self) -> Iterator[Way | None]:
        """The best way so far after every round; ends only where there is provably none.

        Two random trees come first, for where there is room. Then two families of lattices take turns, one whose
        pushes change on the way and one of single pushes, which gets finer for the same work; each level is searched
        from the start or from the goal, in turns. What they find is polished at once, and the best ways again and
        again.
        """
        if not self.task.first or not self.task.last:
            return
        trees = Trees(self.task, self._seed)
        self.work, self.nodes = trees.work, trees.size
        if trees.way is not None:
            self.best = trees.way
            yield self.best
            self._add(trees.way)
        yield self.best
        reaches = [Reach(self.task)]
        self.disc, self.closed, self.direct = reaches[0].radius, not reaches[0].open, reaches[0].direct
        if self.closed:
            return
        families = [self._levels(reaches, True)]
        if self.task.fleet.size > 1:
            families.append(self._levels(reaches, False))
        turn = 0
        while True:
            for family in families:
                found = next(family)
                if found is not None:
                    if found.cost < self.cost:
                        self.best = found
                        yield self.best
                    self._add(found)
                yield self.best
            if self.chains:
                self._polish(turn)
                turn += 1
                yield self.best

    def _levels(self, reaches: list[Reach], changing: bool) -> Iterator[Way | None]:
        """Level after level, ever finer, in rounds: better ways where one is found.

        A level is searched from the start and from the goal, in turns; it ends where one of the two is through.
        """
        k = 0
        while True:
            level = level_of(self.task, reaches[0], k, changing)
            self.finest = min(self.finest, level.cell)
            pair: list[Lattice] = []
            while not any(lattice.done or lattice.size > MOST for lattice in pair):
                for back in (0, 1):
                    if len(pair) == back:
                        # The way back is estimated only when it is needed: the first way often comes sooner.
                        task = self.task.reversed if back else self.task
                        if len(reaches) == back:
                            reaches.append(Reach(task))
                        pair.append(Lattice(task, reaches[back], level, self.cost * SLACK, self._rng))
                    lattice = pair[back]
                    found = self._advance(lattice)
                    yield found.backwards(self.task.fleet, self.task.start) if found and back else found
                    if lattice.done:
                        break
            k += 1

    def _advance(self, lattice: Lattice) -> Way | None:
        seen, expanded = lattice.size, int(lattice.counts[2])
        lattice.best[0] = min(lattice.best[0], self.cost * SLACK)
        better = lattice.advance(1 + EXPANSIONS // self.task.fleet.size)
        self.work += int(lattice.counts[2]) - expanded
        self.nodes += lattice.size - seen
        if self._drawn is None or self._drawn.size < lattice.size <= DRAWN:
            self._drawn = lattice
        return lattice.way if better else None

    def _add(self, way: Way) -> None:
        chain = Chain(self.task, way, int(self._rng.integers(1 << 60)))
        if chain.legs:
            chain.improve(MOVES)
            self.work += MOVES
            self._keep([*self.chains, chain])

    def _polish(self, turn: int) -> None:
        """Every other round the best chain, in between the others in turn."""
        which = 0 if turn % 2 == 0 else turn // 2 % len(self.chains)
        self.chains[which].improve(MOVES)
        self.work += MOVES
        self._keep(self.chains)

    def _keep(self, chains: list[Chain]) -> None:
        kept: list[Chain] = []
        for chain in sorted(chains, key=lambda c: c.cost):
            twin = any(c.sequence == chain.sequence and chain.cost < c.cost * 1.002 for c in kept)
            if not twin:
                kept.append(chain)
        self.chains = kept[:CHAINS]
        if self.chains and self.chains[0].cost < self.cost * (1 - 1e-12):
            way = self.chains[0].way
            if way.cost < self.cost:
                self.best = way

    def offer(self, way: Way) -> bool:
        """Takes a way from elsewhere if it keeps the clearance."""
        from .kernels import changes, free, piece_gap

        T, need = self.task.arrays, self.task.clearance
        if (
            not way.pieces
            or way.pieces[0][0] not in self.task.first
            or way.pieces[-1][0] not in self.task.last
        ):
            return False
        for i, ((push, letter, amount), pose) in enumerate(zip(way.pieces, way.poses, strict=False)):
            before = way.pieces[max(0, i - 1)][0]
            if before != push and not changes(T, before, push, pose):
                return False
            if (
                not free(T, push, way.poses[i + 1])
                or piece_gap(T, push, letter, amount, pose, need, need) < need
            ):
                return False
        if way.cost < self.cost:
            self.best = way
        self._add(way)
        return True

    def edges(self) -> tuple[Array, Array]:
        """Edges of a tree of the search: displacements as body twists and poses where they begin, both (m, 3)."""
        if self._drawn is None:
            return np.zeros((0, 3)), np.zeros((0, 3))
        edges, starts = self._drawn.edges(DRAWN)
        way = Way(self._drawn.task.fleet, self.task.start, ())
        return np.array([way.step(int(a), int(letter), x) for a, letter, x, _ in edges]).reshape(
            -1, 3
        ), starts


def level_of(task: Task, reach: Reach, k: int, changing: bool) -> Level:
    """The k-th lattice: cells from a third of the object down, steps that leave a cell, turns that change its layer."""
    box = task.extent
    size = task.bodies[0].outline.size
    largest = max(0.75 * float(np.sqrt(reach.radius * size)), float(np.sqrt(np.prod(box[2:] - box[:2]))) / 60)
    cell = largest * FINER**k
    step = 1.5 * cell
    angles = int(np.clip(1.5 * 2 * np.pi * float(np.median(task.fleet.radius)) / step, *ANGLES))
    return Level(cell, angles, step, changing, 1.5 if k < 2 else 1.0)
