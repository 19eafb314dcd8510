"""The search among obstacles for a scene: each path is made a plan, checked as a whole, and only then given."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..compiling import clock
from ..errors import FlatpushError
from ..geometry import Outline, compose, exp, transform
from ..geometry.collision import Body, World
from ..geometry.pose import Array
from ..problem import PushSegment, Scene, TransitSegment
from ..steering.fleet import Fleet
from .assembly import Segments, assemble
from .empty_table import Found, refined_paths
from .obstacles import FINE_KNOT, KNOT, Search, WidestWay, careful, obstructions, pruned, query_of, widest_way
from .options import PushOption
from .path import Path
from .segments import SAG
from .transits import Transits

if TYPE_CHECKING:
    from .tubes import Layers

# For each of the scene's iterations the search may expand so many poses or try so many moves in all, and without an
# improvement of at least BETTER.
WORK, PATIENCE = 30, 4
# Where the angle at the goal is free, from so much work on: the last polish takes its share.
LATE, PATIENCE_LATE = 8, 1
BETTER = 0.003  # the part of its cost by which a path is better before it is worth checking
LARGEST_GAP = 1.0  # clearances beyond it are not told apart [m]
SAMPLES = 7  # points of an edge that is drawn
Progress = Callable[[float, float, int], object]


class AmongObstacles:
    """One scene among obstacles.

    Args:
        endpoints: where the object may end, shape (e, 3), the most promising first: the goal, or angles all around.
        layers: where the scene states a start region; options and fleet are then those of its layers.

    Attributes:
        search: the search, for what it has seen.
        stopped_by: the limit that ended it, "time_limit" or "iterations"; empty before, and where it was through.
        tried: what was tried so far, in words.
    """

    def __init__(
        self,
        scene: Scene,
        options: Sequence[PushOption],
        fleet: Fleet,
        transits: Transits,
        progress: Progress | None,
        endpoints: Array,
        layers: "Layers | None" = None,
    ) -> None:
        self.scene, self.options, self.transits, self.progress = scene, options, transits, progress
        self.query = query_of(scene, options, fleet, endpoints[0])
        self.layers = layers
        if layers is not None:
            self.query = replace(self.query, begins=layers.begins, ends=layers.ends)
        ends = [pose for pose in endpoints if self.query.able(pose)]
        if len(endpoints) > 1 and ends:
            self.query = replace(self.query, goal=ends[0], other_goals=np.array(ends[1:]).reshape(-1, 3))
        self.search = Search(self.query, scene.planning.seed)
        self.best, self.refused, self._knot = np.inf, 0, KNOT
        self.complaint = self.stopped_by = ""
        self._first: float | None = None

    def plans(self) -> Iterator[tuple[Found, Segments]]:
        """Better and better paths that are plans as a whole; ends with the limits of the scene."""
        self.complaint = obstructions(self.scene, self.query, self.options)
        if self.complaint:
            return
        began = clock()
        for path in self._rounds(began, self.search):
            plan = self._checked(path, began)
            if plan is not None:
                yield plan
            else:
                # The hand did not find its way at a change of push: from now on changes have room to spare.
                self.search = Search(careful(self.scene, self.query), self.scene.planning.seed)
                break
        else:
            return
        for path in self._rounds(began, self.search):
            plan = self._checked(path, began)
            if plan is not None:
                yield plan

    def _rounds(self, began: float, search: Search) -> Iterator[Path]:
        """Paths that are worth checking."""
        planning = self.scene.planning
        given, before, fresh = np.inf, np.inf, True
        known, since = np.inf, 0  # a cost, and the work after which nothing much better was found
        for path in search.rounds():
            spent = clock() - began
            if self.progress is not None:
                self.progress(self.best, spent, search.nodes)
            if search.cost < known * (1 - BETTER):
                known, since = search.cost, search.work
            late = self.scene.free_angle and search.work > LATE * planning.iterations
            tries = PATIENCE_LATE if late else PATIENCE
            patience = np.inf if path is None else float(tries * planning.iterations)
            done = search.work >= WORK * planning.iterations or search.work - since >= patience
            self.stopped_by = "time_limit" if spent > planning.time_limit else "iterations" if done else ""
            done = bool(self.stopped_by)
            worth = min(given, self.best) * (1.0 if done else 1 - BETTER)
            # While it falls from round to round, the next is soon better.
            settled = done or np.isinf(given) or search.cost > before * (1 - BETTER)
            before = search.cost
            if path is not None and settled and search.cost < worth:
                given = search.cost
                yield path
            if done and self.scene.free_angle and self.stopped_by != "time_limit":
                self._knot = FINE_KNOT
                path = search.finish()
                if path is not None and search.cost < min(given, self.best):
                    yield path
            if done:
                return
            if fresh and path is not None and search.direct and self.layers is None:
                fresh = False
                if self._free(search):
                    if search.best is not None and search.cost < min(given, self.best):
                        yield search.best
                    return

    def _free(self, search: Search) -> bool:
        """Whether what is best without obstacles keeps clear of them: then there is nothing left to search for."""
        clear = False
        for done, found in enumerate(refined_paths(self.scene, self.query.fleet)):
            clear = search.offer(found.path)
            if done > 0 and not clear:
                return False
        return clear

    def _checked(self, path: Path, began: float) -> tuple[Found, Segments] | None:
        """The plan of a path, if it is one as a whole, with the pusher's transits."""
        scene, need = self.scene, self.scene.clearance
        shorter = pruned(self.query, path, self._knot)
        # Fewer pieces may cost a little; still every answer is cheaper than the one before.
        path = shorter if self.search.value(shorter) < self.best else path
        try:
            if self.layers is None:
                segments = assemble(scene, self.transits, self.options, path)
            else:
                path, segments = self.layers.plan(path, self.transits, self.search.clear)
        except FlatpushError as error:
            self.refused += 1
            self.complaint = f"{error}."
            return None
        room = hand_clearance(scene, self.query.world, segments)
        if room < need:
            self.refused += 1
            self.complaint = (
                f"the pusher comes within {1000 * room:.2f} mm of something between two pushes."
                if room > 0
                else "the pusher touches something between two pushes."
            )
            return None
        self.best = self.search.value(path) if self.layers is None else path.cost
        if self._first is None:
            self._first = clock() - began
        details = {"first_path_time": self._first, "poses_searched": self.search.nodes}
        if scene.planning.robust:
            details["replanning_cost"] = self.best
        return Found(path, self.best, details), segments

    @property
    def tried(self) -> str:
        """What was tried, for a scene without a plan."""
        search, need = self.search, 1000 * self.scene.clearance
        keeping = f" with {need:.2f} mm of clearance" if need > 0 else ""
        if self.complaint and not search.nodes:
            return self.complaint
        less = ", less clearance (planning.margin.clearance)" if need > 0 else ""
        widest = widest_way(self.query)
        way, wide = 2000 * widest.radius, 2000 * widest.largest
        if search.closed or way < 0.999 * wide:
            room = f"no way is wider than {way:.1f} mm" if way > 0 else "nothing gets through at all"
            return (
                f"the object does not fit through from the start to the goal{keeping}.\n"
                f"{room}, and the object is {wide:.1f} mm wide (the largest disc inside it).{_narrow(widest)}\n"
                f"A wider gap{less} or another start or goal would help."
            )
        within = f" in {self.scene.planning.iterations} iterations" if self.stopped_by == "iterations" else ""
        head = f"no way{keeping} was found{within}"
        if self.stopped_by == "time_limit":
            head = f"stopped by time_limit after {self.scene.planning.time_limit:g} s"
        finest = f" in cells down to {1000 * search.finest:.1f} mm" if np.isfinite(search.finest) else ""
        pushes = f"{self.query.fleet.size} pushes" if self.query.fleet.size > 1 else "the only push"
        refused = ""
        if self.refused:
            ways = (
                "one way was refused" if self.refused == 1 else f"{self.refused} ways were refused, the last"
            )
            refused = f"\n{ways} because {self.complaint}"
        return (
            f"{head}: {search.nodes} poses were searched from the start and from the goal with"
            f" {pushes}{finest}.{refused}\n"
            f"More time (time_limit, iterations){less} or other pushes may help."
        )

    @property
    def explored(self) -> Array:
        """Paths of the COF along edges of the search tree, shape (m, SAMPLES, 2) [m]."""
        steps, starts = self.search.edges()
        shares = np.linspace(0.0, 1.0, SAMPLES)
        poses = compose(starts[:, None], exp(shares[None, :, None] * steps[:, None]))
        return transform(poses, self.scene.object.cof)


def hand_clearance(scene: Scene, world: World, segments: Segments) -> float:
    """The least clearance of the fingertips while they do not push, from the bounds and, on the table, obstacles [m].

    A lower bound: along the chords between samples, less what a turning hand may bow out from them. The object rests
    meanwhile, and its own clearance belongs to the pushes.
    """
    from ..geometry.collision.kernels import pose_gap, twist_gap

    radius, bounds = scene.pusher.tip_radius, world.bounds
    tip = Body.of(Outline.circle(max(radius, 1e-9)))
    arrays, best = world.arrays, np.inf
    for i, segment in enumerate(segments):
        if not isinstance(segment, TransitSegment):
            continue
        push = next(s for s in (*segments[i + 1 :], *segments[i - 1 :: -1]) if isinstance(s, PushSegment))
        turned = np.diff(segment.pusher[:, 2]) != 0.0
        bow = 2 * SAG if np.any(turned) else 0.0
        for finger in push.fingers:
            points = transform(segment.pusher, finger)
            inside = min(np.min(points - bounds[:2]), np.min(bounds[2:] - points)) - radius
            best = min(best, float(inside) - bow)
            for k, m in _stretches(points, segment.height):
                at, (dx, dy) = np.array([*points[k], 0.0]), points[m] - points[k]
                gap = pose_gap(arrays, tip.arrays, at, LARGEST_GAP, -np.inf)
                if np.hypot(dx, dy) > 0:
                    gap = min(
                        gap, twist_gap(arrays, tip.arrays, at, np.array([dx, dy, 0.0]), LARGEST_GAP, -np.inf)
                    )
                best = min(best, float(gap) - bow)
    return best


def _stretches(points: Array, heights: Array) -> list[tuple[int, int]]:
    """First and last sample of the straight stretches on the table."""
    found: list[tuple[int, int]] = []
    for k in range(len(points) - 1):
        if heights[k] > 0 or heights[k + 1] > 0:
            continue
        if found and found[-1][1] == k:
            a, b = points[k] - points[found[-1][0]], points[k + 1] - points[k]
            if abs(a[0] * b[1] - a[1] * b[0]) <= 1e-12 * np.hypot(*a) and a @ b >= 0:
                found[-1] = (found[-1][0], k + 1)
                continue
        found.append((k, k + 1))
    return found


def _narrow(widest: WidestWay) -> str:
    """Where the way is too narrow, as a line of the reason."""
    if widest.narrowest is None:
        return ""
    x, y = (1000 * v for v in widest.narrowest)
    where = (
        f"between {' and '.join(widest.beside)}" if len(widest.beside) == 2 else f"beside {widest.beside[0]}"
    )
    return f"\nIt is narrowest at ({x:.1f}, {y:.1f}) mm, {where}."
