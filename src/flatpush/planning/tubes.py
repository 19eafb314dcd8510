"""Plans that end within the goal's tolerance from every start of a region: which sequences of pushes do, and how.

Every landing at a straight side squares the object against it. How far it is off after a sequence of pushes depends on
the sides alone, not on the way: so sequences are chosen first, and then their switch poses. Each push begins straight,
until both fingers hold the object for every start, and goes on with the best word from there to where it is to end.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from functools import cached_property
from itertools import pairwise, product
from typing import Any

import numpy as np

from ..compiling import clock
from ..contact.landing import Landing, Side, carried
from ..errors import InputError
from ..geometry import compose, exp, rotate
from ..geometry.pose import Array
from ..problem import Scene
from ..problem.mechanics import first_landing, side_of
from ..simulation import certify
from ..simulation.tube import check_landing, tube_excess
from ..steering.fleet import Fleet
from ..steering.lengths import fleet_lengths
from ..steering.three_twist import words
from .assembly import Segments, assemble, car_of
from .empty_table import ROUND, Found
from .options import PushOption
from .path import Path, Piece
from .query import Query
from .refine.pool import sample_poses
from .refine.problem import Sequences
from .transits import Transits

# A first stretch is longer than it must be by so much [m].
OVER = 1e-7
# Sequences that a refusal speaks of have at most so many pushes.
LONGEST = 3
# Switch poses that are drawn for each sequence of a round, how many of them and of all are kept, and tries to make each
# of these cheaper, so far away [radii, rad].
DRAWN, DRAWN_KEPT, KEPT, TRIES = 250, 2, 12, 40
STEPS = 0.4 * 0.7 ** np.arange(14.0)


class Tubes:
    """What becomes of the start region of a scene in sequences of its pushes.

    Args:
        scene: states a start region. options: its pushes with two fingers that have cars.
    """

    def __init__(self, scene: Scene, options: Sequence[PushOption], fleet: Fleet) -> None:
        self.scene, self.options, self.fleet = scene, options, fleet
        self._known: dict[tuple[int, ...], Landing | InputError] = {}

    @cached_property
    def _sides(self) -> list[tuple[Side, float]]:
        """The side of each push, and the angle between its straight motion and the side's normal [rad]."""
        found = []
        for option in self.options:
            assert option.placement is not None
            side = side_of(self.scene, option.placement)
            found.append((side, side.tilt(car_of(option).straight[:2])))
        return found

    def landing(self, pushes: tuple[int, ...]) -> Landing:
        """The last landing of a sequence.

        Raises:
            InputError: where one of its landings cannot be.
        """
        if pushes not in self._known:
            try:
                self._known[pushes] = self._landing(pushes)
            except InputError as error:
                self._known[pushes] = error
        found = self._known[pushes]
        if isinstance(found, InputError):
            raise found.with_traceback(None)
        return found

    def _landing(self, pushes: tuple[int, ...]) -> Landing:
        known = self.scene.object.uncertainty
        assert known is not None
        assert known.start is not None
        side, tilt = self._sides[pushes[-1]]
        if len(pushes) == 1:
            found, off = first_landing(self.scene, side, tilt), known.start.moves(side.reach)
        else:
            before = self.landing(pushes[:-1])
            found, off = carried(side, self._sides[pushes[-2]][0].along, before.offset, tilt), before.offset
        found = replace(found, offset=found.offset + known.offset, wander=found.wander + known.offset)
        check_landing(side, found, off)
        return found

    def excess(self, pushes: tuple[int, ...]) -> float:
        """How far from the goal a sequence may leave the object, as a share of the tolerance; inf if it cannot be."""
        offset = self.offset(pushes)
        if np.isinf(offset):
            return np.inf
        tolerance = np.array(self.scene.planning.goal_tolerance[:2])
        if self.scene.free_angle:
            return float(offset / np.min(tolerance))
        along = rotate(self.scene.goal_pose[2], self._sides[pushes[-1]][0].along)
        return float(np.max(offset * np.abs(along) / tolerance))

    def offset(self, pushes: tuple[int, ...]) -> float:
        """How far a sequence leaves the object off along the last side [m]; infinite where it cannot be."""
        try:
            return self.landing(pushes).offset
        except InputError:
            return np.inf

    def next_offset(self, push: int, after: int, offset: float) -> float:
        """The same of a push after one that leaves it off by so much."""
        known, (side, tilt) = self.scene.object.uncertainty, self._sides[after]
        assert known is not None
        found = carried(side, self._sides[push][0].along, offset, tilt)
        found = replace(found, offset=found.offset + known.offset, wander=found.wander + known.offset)
        try:
            check_landing(side, found, offset)
        except InputError:
            return np.inf
        return found.offset

    def allowed(self, pushes: tuple[int, ...]) -> bool:
        """Whether a sequence ends within the goal's tolerance from every start."""
        return self.excess(pushes) <= 1.0

    def sequences(self) -> list[tuple[int, ...]]:
        """The shortest allowed sequences, and those with one push more."""
        found: list[tuple[int, ...]] = []
        for n in range(1, LONGEST + 1):
            shorter = bool(found)
            found += [
                s
                for s in product(range(len(self.options)), repeat=n)
                if self._possible(s) and self.allowed(s)
            ]
            if shorter:
                break
        return found

    def _possible(self, pushes: tuple[int, ...]) -> bool:
        changes = list(pairwise(pushes))
        return all(a != b and np.isfinite(self.fleet.switching[a, b]) for a, b in changes)

    def paths(self) -> Iterator[Found]:
        """Better and better paths on an empty table that end within the tolerance from every start.

        Of every sequence the switch poses are drawn, and the best of all are moved at random to where they cost less.
        """
        planning, began = self.scene.planning, clock()
        rng = np.random.default_rng(planning.seed)
        query = Query(
            self.fleet, self.scene.start_pose, np.nan_to_num(self.scene.goal_pose), free=self.scene.free_angle
        )
        pool = Sequences.of(query, 0.0)
        best, known = np.inf, list[tuple[float, tuple[int, ...], Array]]()
        for done in range(max(1, planning.iterations // ROUND)):
            drawn = sample_poses(
                pool, rng, DRAWN, [poses[:-1] for _, _, poses in known[:4] if len(poses) > 1]
            )
            for pushes in self.sequences():
                ends = drawn[rng.integers(len(drawn), size=(DRAWN, len(pushes)))]
                known += self._cheapest(pushes, self._ended(ends), DRAWN_KEPT)
            known = sorted(known, key=lambda one: one[0])[:KEPT]
            scale = np.array([float(np.median(self.fleet.radius))] * 2 + [1.0])
            for step in STEPS:
                moved = []
                for cost, pushes, poses in known:
                    tried = poses + step * scale * rng.normal(size=(TRIES, *poses.shape))
                    moved.append(
                        min(
                            [(cost, pushes, poses), *self._cheapest(pushes, self._ended(tried), 1)],
                            key=_first,
                        )
                    )
                known = sorted(moved, key=_first)
            late = clock() - began > planning.time_limit
            if known and known[0][0] < best:
                best = known[0][0]
                path = self._path(known[0][1], known[0][2])
                details: dict[str, Any] = {"rounds": done + 1} | (
                    {"stopped_by": "time_limit"} if late else {}
                )
                yield Found(path, path.cost, details)
            if late:
                return

    def _ended(self, poses: Array) -> Array:
        """Poses at the ends of pushes (..., n, 3), the last being brought to the goal."""
        goal = self.scene.goal_pose
        poses[..., -1, :2] = goal[:2]
        if not self.scene.free_angle:
            poses[..., -1, 2] = goal[2]
        return poses

    def _cheapest(
        self, pushes: tuple[int, ...], ends: Array, count: int
    ) -> list[tuple[float, tuple[int, ...], Array]]:
        """The cheapest of poses at the ends of a sequence's pushes (m, n, 3), with their costs."""
        fleet = self.fleet
        total = np.full(len(ends), sum((fleet.switching[a, b] for a, b in pairwise(pushes)), 0.0))
        begin = np.broadcast_to(self.scene.start_pose, (len(ends), 3))
        for i, push in enumerate(pushes):
            one = Fleet(*(getattr(fleet, f.name)[[push]] for f in fields(Fleet)))
            need = self.landing(pushes[: i + 1]).travel + OVER
            held = compose(begin, np.array([*(need * fleet.direction[push]), 0.0]))
            total += fleet_lengths(one, held, ends[:, i])[0] + need * fleet.rates[push, 1]
            begin = ends[:, i]
        return [(float(total[m]), pushes, ends[m]) for m in np.argsort(total, kind="stable")[:count]]

    def _path(self, pushes: tuple[int, ...], ends: Array) -> Path:
        """The path of the cheapest words to the ends of pushes, without their first stretches."""
        pieces: list[Piece] = []
        begin = self.scene.start_pose
        for i, push in enumerate(pushes):
            need = self.landing(pushes[: i + 1]).travel + OVER
            pieces.append((push, 1, need))
            held = compose(begin, np.array([*(need * self.fleet.direction[push]), 0.0]))
            pieces += self.word(push, held, ends[i])
            begin = ends[i]
        return Path.of(self.fleet, self.scene.start_pose, pieces)

    def word(self, push: int, start: Array, end: Array) -> tuple[Piece, ...]:
        """The cheapest word of a push from pose to pose."""
        fleet = self.fleet
        ways = [
            Path.of(fleet, start, [(push, "LSR".index(x), float(p)) for x, p in zip(w.word, w.parameters, strict=True)])
            for w in words(fleet.left[push], fleet.right[push], fleet.direction[push], start, end)
        ]  # fmt: skip
        if not ways:
            raise InputError(f"no way on from where {self.options[push].push.name!r} holds the object")
        return min(ways, key=lambda way: way.cost).pieces

    def rooms(self) -> tuple[float, ...]:
        """What a search among obstacles keeps beside the clearance [m]: the most that a first landing leaves; none."""
        left = [offset for a in range(len(self.options)) if np.isfinite(offset := self.offset((a,)))]
        return max(left), 0.0

    def complaint(self, segments: Segments) -> str:
        """What a plan lacks; empty where it lacks nothing."""
        certificate = certify(self.scene, segments)
        if certificate.tube is None:
            return certificate.warnings[-1]
        excess = tube_excess(self.scene, certificate)
        if excess > 1.0:
            return f"the object may end {excess:.2f} times as far from the goal as the tolerance allows"
        if certificate.set_margin is not None and certificate.set_margin < 0:
            return "it does not hold for every table and offset"
        if certificate.clearance is not None and certificate.clearance < self.scene.clearance:
            return f"only {1000 * certificate.clearance:.2f} mm are left beside something"
        room, need = certificate.set_clearance, self.scene.planning.clearance
        if room is not None and certificate.tube and room < need:
            parts = [
                (p.clearance, i, p.push) for i, p in enumerate(certificate.tube, 1) if p.clearance is not None
            ]
            least, number, name = min(parts)
            return (
                f"from some starts only {1000 * least:.2f} mm are left beside something in push {number} ({name}),"
                f" {1000 * need:.2f} mm are asked for"
            )
        return ""

    def refusal(self) -> str:
        """Why no sequence of a few pushes ends within the tolerance; empty where one does."""
        count = range(len(self.options))
        tried = [s for n in range(1, LONGEST + 1) for s in product(count, repeat=n) if self._possible(s)]
        best = min(tried, key=lambda s: (self.excess(s), len(s)))
        if self.excess(best) <= 1.0:
            return ""
        names = [option.push.name for option in self.options]
        if np.isinf(self.excess(best)):
            lines = []
            for k in count:
                try:
                    self.landing((k,))
                except InputError as error:
                    lines.append(f"{names[k]}: {error.rule}. {error.hint}".rstrip())
            return "\n".join(["no push can begin at every start of the region.", *lines])
        side, last = self._sides[best[-1]][0], self.landing(best)
        x, y = 1000 * last.offset * np.abs(rotate(np.nan_to_num(self.scene.goal_pose[2]), side.along))
        dx, dy, _ = 1000 * np.array(self.scene.planning.goal_tolerance)
        return (
            f"from every start of the region, up to {LONGEST} pushes leave the object within ± {x:.2f} mm in x and"
            f" ± {y:.2f} mm in y of the goal at best ({', '.join(names[k] for k in best)}),"
            f" ± {dx:.2f} and ± {dy:.2f} mm are allowed.\n"
            "A push at a side square to the last one's, a smaller region (object.uncertainty.start) or a wider"
            " planning.goal_tolerance would do."
        )


class Layers:
    """The pushes of a scene several times over, by how far the object may be off in them, for a search among obstacles.

    A path begins in the first layer; in the next two the object is off by at most the steps of a ladder, the last of
    which is the goal's tolerance. Only changes that get there are left.

    Attributes:
        options, fleet: of all layers. begins, ends: where a path may begin and end, shape (k,).
    """

    def __init__(self, tubes: Tubes) -> None:
        self.tubes, own = tubes, tubes.fleet
        k = own.size
        first = np.array([tubes.offset((a,)) for a in range(k)])
        least = float(np.min(tubes.scene.planning.goal_tolerance[:2]))
        most = float(np.max(first, where=np.isfinite(first), initial=least))
        ladder = np.array([np.sqrt(most * least), least])
        offsets = np.concatenate([first, np.repeat(ladder, k)])
        which = np.tile(np.arange(k), 3)
        switching = np.full((3 * k, 3 * k), np.inf)
        np.fill_diagonal(switching, 0.0)
        for a, before in enumerate(offsets):
            for b in range(k) if np.isfinite(before) else ():
                after = tubes.next_offset(int(which[a]), b, float(before)) if b != which[a] else np.inf
                if (fits := np.flatnonzero(after <= ladder)).size:
                    switching[a, k * (1 + fits[-1]) + b] = own.switching[which[a], b]
        rows = {f.name: getattr(own, f.name)[which] for f in fields(Fleet) if f.name != "switching"}
        self.fleet = Fleet(**rows, switching=switching)
        self.options = [tubes.options[a] for a in which]
        self.begins = np.arange(3 * k) < np.where(np.isfinite(offsets), k, 0)
        self.ends = np.array([*(tubes.allowed((a,)) for a in range(k)), *[False] * k, *[True] * k])

    def plan(self, path: Path, transits: Transits, clear: Callable[[Path], bool]) -> tuple[Path, Segments]:
        """A path of the layers as one of the pushes, with its straight first stretches, and its segments.

        Args:
            clear: whether a path of the layers keeps its clearance.

        Raises:
            InputError: where it has no room for these, or the plan lacks something.
        """
        tubes = self.tubes
        k = tubes.fleet.size
        pieces: list[Piece] = []
        pushes: tuple[int, ...] = ()
        done = 0
        for layered, word, _, _ in path.stretches:
            pushes = (*pushes, layered % k)
            need = tubes.landing(pushes).travel + OVER
            own = path.pieces[done : done + len(word)]
            poses = path.poses[done : done + len(word) + 1]
            done += len(word)
            if need <= OVER or (own[0][1] == 1 and own[0][2] >= need):
                pieces += own
                continue
            first = (layered, 1, need)
            held = compose(poses[0], exp(path.step(*first)))
            ways = []
            for m in range(len(own)):
                on = [(layered, letter, x) for _, letter, x in tubes.word(pushes[-1], held, poses[m + 1])]
                way = Path.of(self.fleet, poses[0], [first, *on, *own[m + 1 :]])
                if clear(Path.of(self.fleet, poses[0], way.pieces)):
                    ways.append(way)
            if not ways:
                name = tubes.options[pushes[-1]].push.name
                raise InputError(
                    f"there is no room for {1000 * need:.2f} mm straight on, after which {name} holds the object for"
                    " every start"
                )
            pieces += min(ways, key=lambda way: way.cost).pieces
        found = Path.of(tubes.fleet, path.start, [(a % k, letter, x) for a, letter, x in pieces])
        segments = assemble(tubes.scene, transits, tubes.options, found)
        if lacks := tubes.complaint(segments):
            raise InputError(lacks)
        return found, segments


def _first(one: tuple[float, tuple[int, ...], Array]) -> float:
    return one[0]
