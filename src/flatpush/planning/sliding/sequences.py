"""Sequences of sliding pushes that lead to a displacement: nearest neighbours among products."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ...geometry import compose, inverse
from ...geometry.pose import Array
from .slides import SlideLibrary, product

Numbers = NDArray[np.intp]

# Products of two pushes that are kept (first factors × second factors), and of those tried as the first two of four.
FIRST, SECOND, OF_FOUR = 1000, 700, 20000
KEPT = 200  # sequences of each number of pushes that are given
FAR_KEPT = 5000  # of each number of pushes towards a goal out of reach, of which many may not be made
MOVES = (
    0.03  # factors move the outline at least so far, by its reach; a smaller push corrects, it does not lead
)


@dataclass(frozen=True)
class Sequence:
    """Pushes of a library one after another.

    Attributes:
        pushes: the number of each in the library.
        miss: how far the outline's farthest point ends from where it should be, about [m].
    """

    pushes: tuple[int, ...]
    miss: float


class SlideSearch:
    """Finds sequences of up to four pushes of a library.

    Three pushes meet a goal if the last two make up for the first: the first one's inverse times the goal is sought
    among the products of two. Which products are kept is drawn with a fixed seed.
    """

    def __init__(self, library: SlideLibrary) -> None:
        self.slides = library
        moves = library.displacement
        places = library.coordinates(moves)
        self._undone = inverse(moves)
        rng = np.random.default_rng(0)
        far = np.linalg.norm(places - library.coordinates(np.zeros(3)), axis=1) > MOVES * library.reach
        first = rng.permutation(np.flatnonzero(far))[:FIRST]
        second = rng.permutation(np.flatnonzero(far))[:SECOND]
        self._pairs = product(moves[first], moves[second])
        self._singles: Numbers = np.arange(len(library))[:, None]
        self._doubles: Numbers = np.stack([first.repeat(len(second)), np.tile(second, len(first))], axis=1)
        self._some = rng.permutation(len(self._pairs))[:OF_FOUR]
        self._tree = cKDTree(places)
        self._pair_tree = cKDTree(library.coordinates(self._pairs), balanced_tree=False, compact_nodes=False)

    def sequences(self, goal: ArrayLike, within: float) -> Iterator[Sequence]:
        """Sequences that end `within` a distance [m] (see Sequence.miss) of a goal X_OG (3,), few pushes first.

        Of each number of pushes the nearest are given, nearest first. Longer ones are sought only when the caller asks
        for more.
        """
        X, at = np.asarray(goal, dtype=float), self.slides.coordinates
        misses, last = self._tree.query(at(X), k=20, distance_upper_bound=within)
        yield from (Sequence((int(j),), float(m)) for m, j in zip(misses, last, strict=True) if m < within)
        rest = at(compose(self._undone, X))
        yield from _completed(self._singles, rest, self._tree, self._singles, within)
        yield from _completed(self._singles, rest, self._pair_tree, self._doubles, within)
        rest = at(compose(inverse(self._pairs[self._some]), X))
        yield from _completed(self._doubles[self._some], rest, self._pair_tree, self._doubles, within)

    def approaches(self, goal: ArrayLike) -> Iterator[Sequence]:
        """Pairs of pushes, then single ones, that come nearest to a goal X_OG however far it is, nearest first."""
        target = self.slides.coordinates(goal)
        for tree, pushes in ((self._pair_tree, self._doubles), (self._tree, self._singles)):
            yield from _best(
                np.sqrt(sum((tree.data[:, i] - target[i]) ** 2 for i in range(4))), pushes, FAR_KEPT
            )


def _completed(
    begun: Numbers, rest: Array, ends: cKDTree, endings: Numbers, within: float
) -> Iterator[Sequence]:
    """Beginnings (n, a) with what they leave to do (n, 4), each completed by the nearest of the endings (m, b)."""
    misses, last = ends.query(rest, distance_upper_bound=within)
    met = np.flatnonzero(misses < within)
    yield from _best(misses[met], np.concatenate([begun[met], endings[last[met]]], axis=1))


def _best(misses: Array, pushes: Numbers, most: int = KEPT) -> Iterator[Sequence]:
    kept = np.argpartition(misses, most)[:most] if len(misses) > most else np.arange(len(misses))
    for k in kept[np.argsort(misses[kept], kind="stable")]:
        yield Sequence(tuple(pushes[k].tolist()), float(misses[k]))
