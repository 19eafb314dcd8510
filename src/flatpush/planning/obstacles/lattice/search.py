"""One search on a lattice, in pieces, so that it can be watched and stopped."""

from dataclasses import dataclass

import numpy as np

from ....geometry import transform
from ....geometry.pose import Array
from ..path import Way
from ..task import Task

DETOUR = 1.05
ROOM = 1 << 14  # nodes there is room for at first


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

    def __init__(self, task: Task) -> None:
        from .kernels import distances

        self.point, self.radius = largest_disc(task)
        ends = np.array([transform(X, self.point) for X in (task.start, task.goal)])
        box = task.extent
        cell = max(0.35 * self.radius, float(np.sqrt(np.prod(box[2:] - box[:2]) / 6_000)))
        self.nx, self.ny = (int(n) + 1 for n in (box[2:] - box[:2]) / cell)
        self.cell, self.corner = cell, box[:2].copy()
        disc = np.array([self.radius])
        self.far = distances(
            task.world.arrays, disc, self.corner, cell, self.nx, self.ny, ends[1], task.clearance
        )
        at = np.clip(((ends[0] - self.corner) / cell).astype(int), 0, [self.nx - 1, self.ny - 1])
        way = float(self.far[at[1] * self.nx + at[0]])
        self.open = bool(np.isfinite(way))
        self.direct = way <= DETOUR * float(np.hypot(*(ends[1] - ends[0]))) + 2 * cell
        rates = []
        for a in range(task.fleet.size):
            laws = np.where(np.isfinite(task.fleet.speeds[a]), task.fleet.speeds[a], 1.0)
            left, straight, right = task.fleet.rates[a] / laws
            arms = [np.hypot(*(self.point - c)) for c in (task.fleet.left[a], task.fleet.right[a])]
            rates += [left / max(arms[0], 1e-12), straight, right / max(arms[1], 1e-12)]
        self.per_metre = float(min(rates))

    @property
    def around(self) -> tuple[float, float, float, int, int, float, float]:
        return (*self.corner.tolist(), self.cell, self.nx, self.ny, *self.point.tolist())


class Lattice:
    """A search on one level: advance() it until it is done; `way` is the best way to the goal so far.

    Args:
        bound: only ways that cost less are of interest.
        rng: shifts the lattice.
        pushes: what may be used first; by default all that land at the start.
    """

    def __init__(
        self, task: Task, reach: Reach, level: Level, bound: float, rng: np.random.Generator,
        pushes: list[int] | None = None,
    ) -> None:  # fmt: skip
        self.task, self.reach, self.level = task, reach, level
        self.nodes, self.links = np.empty((ROOM, 6)), np.empty((ROOM, 3), np.int64)
        self.table = np.full((2 * ROOM, 2), -1, np.int64)
        self.key, self.heap = np.empty(ROOM), np.empty(ROOM, np.int64)
        self.counts = np.zeros(3, np.int64)
        shift = rng.uniform(0, 1, 3) * [level.cell, level.cell, 2 * np.pi / level.angles]
        self.origin = np.array([*task.start[:2], task.start[2]]) - shift
        self.best, self.shot = np.array([bound, -1.0, -1.0]), np.zeros(7)
        self.done = False
        for a in task.first if pushes is None else pushes:
            n = int(self.counts[0])
            self.nodes[n] = [*task.start, 0.0, -1.0, 0.0]
            self.links[n] = [-1, a, n]
            # A root has a place of its own in the table, under a code that no cell has.
            self.table[n] = [-2 - n, n]
            self.key[n], self.heap[n] = 0.0, n
            self.counts[:2] += 1

    @property
    def size(self) -> int:
        """Poses of the tree."""
        return int(self.counts[0])

    def advance(self, budget: int) -> bool:
        """Expands up to so many poses; True if a better way was found."""
        from .kernels import expand

        level, before = self.level, self.best[0]
        grid = (level.cell, level.angles, level.step, 3, level.changing)
        weights = np.array([level.weight, self.reach.per_metre, 2.0 * self.reach.cell])
        left = budget
        while left > 0:
            expanded = int(self.counts[2])
            status = expand(
                self.task.arrays, self.origin, grid, self.nodes, self.links, self.table, self.key, self.heap,
                self.counts, self.reach.far, self.reach.around, weights, self.task.goal, self.best, self.shot, left,
            )  # fmt: skip
            if status == 2:
                self._grow()
                left -= int(self.counts[2]) - expanded
                continue
            self.done = status == 1
            break
        return bool(self.best[0] < before)

    def _grow(self) -> None:
        from .kernels import rehash

        self.nodes = np.concatenate([self.nodes, np.empty_like(self.nodes)])
        self.links = np.concatenate([self.links, np.empty_like(self.links)])
        self.key = np.concatenate([self.key, np.empty_like(self.key)])
        self.heap = np.concatenate([self.heap, np.empty_like(self.heap)])
        old, self.table = self.table, np.full((2 * len(self.table), 2), -1, np.int64)
        rehash(self.table, self.links, old)

    @property
    def way(self) -> Way:
        """The best way to the goal."""
        node, pieces = int(self.best[1]), []
        shot = [(int(self.best[2]), int(self.shot[1 + 2 * i]), float(self.shot[2 + 2 * i])) for i in range(3)]
        while self.links[node, 0] >= 0:
            pieces.append((int(self.links[node, 1]), int(self.nodes[node, 4]), float(self.nodes[node, 5])))
            node = int(self.links[node, 0])
        return Way.of(self.task.fleet, self.task.start, [*pieces[::-1], *shot])

    def edges(self, most: int) -> tuple[Array, Array]:
        """Some edges of the tree: (n, 4) rows (push, letter, amount, cost) and the poses (n, 3) where they begin."""
        with_parent = np.flatnonzero(self.links[: self.size, 0] >= 0)
        chosen = with_parent[:: max(1, -(-len(with_parent) // most))]
        nodes, links = self.nodes[chosen], self.links[chosen]
        return np.column_stack([links[:, 1], nodes[:, 4:6], nodes[:, 3]]), self.nodes[links[:, 0], :3]


def largest_disc(task: Task) -> tuple[Array, float]:
    """Middle, in O, and radius of (nearly) the largest disc inside the object, never larger."""
    outline = task.bodies[0].outline
    if outline.is_circle:
        return outline.centre, outline.radius
    import shapely

    shape = shapely.Polygon(outline.vertices)
    middle = np.array(shapely.maximum_inscribed_circle(shape, tolerance=0.02 * outline.size).coords[0])
    return middle, float(shape.exterior.distance(shapely.Point(*middle)))
