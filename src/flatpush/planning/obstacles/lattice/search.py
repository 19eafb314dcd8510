"""One search on a lattice, in pieces, so that it can be watched and stopped."""

from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from ....geometry import transform
from ....geometry.pose import Array
from ...path import Path, pieces_of
from ...query import Query

DETOUR = 1.05
GRID_CELLS = 6_000  # of the grid over which distances to the goal are known, at most
TRIES = 3  # words from a pose straight to the goal
# Of the table of headings at a free end: places in polar coordinates, headings tried, and the least radius as a part of
# the turning radius.
RINGS, SECTORS, HEADINGS, NEAREST = 14, 36, 36, 0.2
ROOM = 1 << 14  # nodes there is room for at first


if TYPE_CHECKING:
    from .kernels import Rest, Turns


@dataclass(frozen=True)
class Level:
    """How fine a lattice is.

    Attributes:
        cell: size of a cell in the plane [m]; angles: layers of heading; step: way of the flat point in a step [m].
        changing: whether pushes may change on the way.
        weight: of the estimate of what is left; above 1 it finds something sooner and not the cheapest.
    """

    cell: float
    angles: int
    step: float
    changing: bool = True
    weight: float = 1.0


class Reach:
    """What is left to the goal at least, by the way of the middle of the largest disc inside the object.

    Attributes:
        point: that middle, in O; radius: of the disc [m].
        open: whether the disc has a way from the start to the goal at all; without one nothing has.
        direct: whether that way is hardly longer than the straight one.
    """

    def __init__(self, query: Query) -> None:
        from .kernels import distances

        self.point, self.radius = largest_disc(query)
        start = transform(query.start, self.point)
        goals = np.array([transform(X, self.point) for X in (query.goal, *query.other_goals)])
        box = query.extent
        size = np.array([box.xmax - box.xmin, box.ymax - box.ymin])
        cell = max(0.35 * self.radius, float(np.sqrt(np.prod(size) / GRID_CELLS)))
        self.nx, self.ny = (int(n) + 1 for n in size / cell)
        self.cell, self.corner = cell, np.array(box[:2])
        self.far = distances(
            query.world.arrays, self.radius, box, cell, self.nx, self.ny, goals, query.clearance
        )
        at = np.clip(((start - self.corner) / cell).astype(int), 0, [self.nx - 1, self.ny - 1])
        way = float(self.far[at[1] * self.nx + at[0]])
        self.open = bool(np.isfinite(way))
        self.direct = way <= DETOUR * float(np.min(np.linalg.norm(goals - start, axis=1))) + 2 * cell
        rates = []
        for a in range(query.fleet.size):
            laws = np.where(np.isfinite(query.fleet.speeds[a]), query.fleet.speeds[a], 1.0)
            left, straight, right = query.fleet.rates[a] / laws
            arms = [np.hypot(*(self.point - c)) for c in (query.fleet.left[a], query.fleet.right[a])]
            rates += [left / max(arms[0], 1e-12), straight, right / max(arms[1], 1e-12)]
        self.per_metre = float(min(rates))
        self.turns = _turns(query)

    def rest(self, weight: float) -> "Rest":
        """The same as kernels see it."""
        from .kernels import Rest

        (x, y), (px, py) = self.corner.tolist(), self.point.tolist()
        slack = 2.0 * self.cell
        return Rest(self.far, x, y, self.cell, self.nx, self.ny, px, py, weight, self.per_metre, slack)


class Lattice:
    """A search on one level: advance() it until it is done.

    Args:
        bound: only ways that cost less are of interest.
        rng: shifts the lattice.
        spare: how much dearer than the best path one with another last push may be, and still be of interest.
    """

    def __init__(
        self,
        query: Query,
        reach: Reach,
        level: Level,
        bound: float,
        rng: np.random.Generator,
        spare: float = 1.0,
    ) -> None:
        from ....steering.six_words import WORD
        from .kernels import Queue, Steps

        self.query = query
        shift = rng.uniform(0, 1, 3) * [level.cell, level.cell, 2 * np.pi / level.angles]
        x, y, theta = (query.start - shift).tolist()
        self.steps = Steps(x, y, theta, level.cell, level.angles, level.step, TRIES, level.changing, spare)
        self.rest = reach.rest(level.weight)
        self.turns = cycle([reach.turns, reach.turns._replace(turns=reach.turns.turns[:, :0])])
        self.queue = Queue(
            np.empty((ROOM, 6)), np.empty((ROOM, 3), np.int64), np.full((2 * ROOM, 2), -1), np.empty(ROOM),
            np.empty(ROOM, np.int64), np.zeros(3, np.int64), np.array([bound]),
            np.full(query.fleet.size, np.inf), np.full(query.fleet.size, -1), np.zeros(query.fleet.size, WORD),
        )  # fmt: skip
        self.done = False
        self._aims = cycle(query.aims)
        self._aim = query.aims[0]
        q = self.queue
        for pose, a in ((pose, a) for pose, pushes in query.roots for a in pushes):
            n = self.size
            q.nodes[n] = [*pose, 0.0, -1.0, 0.0]
            q.links[n] = [-1, a, n]
            # A root has a place of its own in the table, under a code that no cell has.
            q.table[n] = [-2 - n, n]
            q.keys[n], q.heap[n] = 0.0, n
            q.counts[:2] += 1

    @property
    def size(self) -> int:
        """Poses of the tree."""
        return int(self.queue.counts[0])

    @property
    def expanded(self) -> int:
        """Poses that were expanded."""
        return int(self.queue.counts[2])

    def advance(self, budget: int, bound: float) -> list[Path]:
        """Expands up to so many poses; the better paths that were found, of those that cost less than a bound.

        Words are tried to one of the goals, with every call to the next; where the end may turn, every other call to
        where it costs least.
        """
        from .kernels import DONE, FULL, expand

        self.queue.bound[0] = min(self.queue.bound[0], bound)
        before = self.queue.costs.copy()
        left = budget
        turns = next(self.turns)
        if not turns.turns.size:
            self._aim = next(self._aims)
        goal, arrays = self._aim
        while left > 0:
            expanded = self.expanded
            status = expand(arrays, self.queue, self.steps, self.rest, goal, turns, left)
            if status == FULL:
                self._grow()
                left -= self.expanded - expanded
                continue
            self.done = status == DONE
            break
        costs = self.queue.costs
        better = np.flatnonzero((costs < before) & (costs <= self.queue.bound[0]))
        return [self._path(push) for push in better[np.argsort(costs[better])].tolist()]

    def _grow(self) -> None:
        from .kernels import rehash

        q = self.queue
        twice = {name: _doubled(getattr(q, name)) for name in ("nodes", "links", "keys", "heap")}
        self.queue = q._replace(table=np.full((2 * len(q.table), 2), -1), **twice)
        rehash(self.queue.table, self.queue.links, q.table)

    def _path(self, push: int) -> Path:
        """The best path to the goal whose last push this is."""
        q = self.queue
        node, pieces = int(q.ends[push]), []
        while q.links[node, 0] >= 0:
            letter, amount = q.nodes[node, 4:6].tolist()
            pieces.append((int(q.links[node, 1]), int(letter), amount))
            node = int(q.links[node, 0])
        shot = pieces_of(push, q.shots[push])
        return Path.of(self.query.fleet, q.nodes[node, :3].copy(), [*pieces[::-1], *shot])

    def edges(self, most: int) -> tuple[Array, Array]:
        """Some edges of the tree: (n, 4) rows (push, letter, amount, cost) and the poses (n, 3) where they begin."""
        q = self.queue
        with_parent = np.flatnonzero(q.links[: self.size, 0] >= 0)
        chosen = with_parent[:: max(1, -(-len(with_parent) // most))]
        nodes, links = q.nodes[chosen], q.links[chosen]
        return np.column_stack([links[:, 1], nodes[:, 4:6], nodes[:, 3]]), q.nodes[links[:, 0], :3]


def _doubled(array: np.ndarray) -> np.ndarray:
    return np.concatenate([array, np.empty_like(array)])


def _turns(query: Query) -> "Turns":
    """The cheapest of some headings at places about the object, if the end may turn."""
    from ....steering.lengths import fleet_lengths
    from .kernels import Turns

    first = NEAREST * float(np.min(query.fleet.radius))
    box = query.extent
    growth = np.log(max(np.hypot(box.xmax - box.xmin, box.ymax - box.ymin) / first, 2.0)) / (RINGS - 1)
    if not (query.free and len(query.other_goals)):
        return Turns(np.zeros((query.fleet.size, 0, SECTORS)), first, growth)
    r, phi = first * np.exp(growth * np.arange(RINGS)), np.arange(SECTORS) * (2 * np.pi / SECTORS)
    turns = np.arange(HEADINGS) * (2 * np.pi / HEADINGS)
    ends = np.empty((RINGS, SECTORS, HEADINGS, 3))
    ends[..., 0], ends[..., 1] = (r[:, None, None] * f(phi)[:, None] for f in (np.cos, np.sin))
    ends[..., 2] = turns
    return Turns(turns[np.argmin(fleet_lengths(query.fleet, np.zeros(3), ends), axis=-1)], first, growth)


def largest_disc(query: Query) -> tuple[Array, float]:
    """Middle, in O, and radius of (nearly) the largest disc inside the object, never larger."""
    outline = query.bodies[0].outline
    if outline.is_circle:
        return outline.centre, outline.radius
    import shapely

    shape = shapely.Polygon(outline.vertices)
    middle = np.array(shapely.maximum_inscribed_circle(shape, tolerance=0.02 * outline.size).coords[0])
    return middle, float(shape.exterior.distance(shapely.Point(*middle)))
