"""Who makes a plant's runs: the compiled steps, the same steps interpreted while there are few, or the plain plant."""

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...friction.surface import LimitSurface
from ...geometry import Outline
from ...geometry.pose import Array
from . import contacts, runs, steps
from .arrays import (
    COURSE,
    OUTLINE,
    POINT,
    POSE,
    SCRATCH,
    SEEN,
    OutlineArrays,
    Row,
    Rows,
    RunArrays,
    Setting,
    SurfaceArrays,
    blank,
    compilable,
    interpreted,
    outline_arrays,
    plain_rows,
    records,
    run_arrays,
    scratch,
    surface_arrays,
)
from .codes import AS_IT_IS, GOING, MANY, STRAIGHT, UNDECIDED
from .plain import Fingers

Codes = NDArray[np.integer]

# Steps that this process interprets for a kind of surface before it compiles the kernels for it (a step takes about a
# millisecond then, compiling takes longer than all of them), how many it has, and the kinds for which it has compiled.
# Where two fingers just slide a step takes a hundred times as long: what was interpreted for longer than ENOUGH [s] in
# all is broken off. How long that was.
PATIENCE, ENOUGH = 3000.0, 6.0
# Steps of the compiled kernels that are not worth a second thread (a step takes about ten microseconds).
ALONE = 2000.0
_interpreted: dict[type, float] = {}
_spent: dict[type, float] = {}
_ready: set[type] = set()


# Numbers in rows, and where the hands begin in the scratch.
_SEEN, _SCRATCH = SEEN.itemsize // 8, SCRATCH.itemsize // 8
_HANDS = sum(SCRATCH[name].itemsize for name in ("contacts", "rays", "planes", "q")) // 8


class _Tired(Exception):
    """Interpreting has taken too long."""


class _Watched(Sequence[Row]):
    """Rows that the interpreter writes to, up to a time of its thread [s]."""

    def __init__(self, rows: Sequence[Row], until: float) -> None:
        self._rows, self._until = rows, until

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> Row:  # type: ignore[override]
        if time.thread_time() > self._until:
            raise _Tired
        return self._rows[index]


class Task(NamedTuple):
    """Runs to be made.

    starts: X_WO (n, 3). hands: X_WE of h hands (n or 1, m, h, 3). kind: codes.STRAIGHT and others. push_out: whether
    the object is moved out of the fingers first. rows: poses of the object that are kept, m or 1. begin: the pose of
    the hands that is gone to first, 1 where the state at the first is known.
    frictions (n or 1,), cofs (n or 1, 2), surfaces: of each run or one for all; None: the plant's own.
    """

    starts: Array
    hands: Array
    kind: int = STRAIGHT
    push_out: bool = False
    rows: int = 1
    begin: int = 0
    frictions: Array | None = None
    cofs: Array | None = None
    surfaces: Sequence[LimitSurface] | None = None

    def of_run(self, r: int) -> "Task":
        """The task of one of its runs alone."""

        return self._replace(
            starts=_single(self.starts, r),
            hands=_single(self.hands, r),
            frictions=None if self.frictions is None else _single(self.frictions, r),
            cofs=None if self.cofs is None else _single(self.cofs, r),
            surfaces=None if self.surfaces is None else [self.surfaces[r % len(self.surfaces)]],
        )


def _single(values: Array, r: int) -> Array:
    return values[r % len(values)][None]


class Done(NamedTuple):
    """Runs: X_WO (n, rows, 3), SEEN rows as numbers (n, rows, k, 5), codes of the outcomes and numbers of poses reached
    (n, 2), and the last poses of the hands (h, 3) of one of them."""

    poses: Array
    seen: Array
    ends: Codes
    hands: Array

    @classmethod
    def of(cls, task: Task, fingers: int) -> "Done":
        """Room for the runs of a task, none of them made."""
        n = len(task.starts)
        seen, ends = np.zeros((n, task.rows, fingers, _SEEN)), np.tile([MANY, 0], (n, 1))
        return cls(np.empty((n, task.rows, 3)), seen, ends, task.hands[-1, 0].copy())

    def take(self, found: "Done", at: int, begin: int) -> None:
        """Takes the rows of one run from `begin` on over, as those from `at` on and all after."""
        self.poses[:, at:], self.seen[:, at:] = found.poses[:, -1:], found.seen[:, -1:]
        stop = at + found.poses.shape[1] - begin
        self.poses[:, at:stop], self.seen[:, at:stop] = found.poses[:, begin:], found.seen[:, begin:]
        self.hands[:] = found.hands

    def put(self, done: "Done", r: int) -> None:
        """Writes a run of which every row is kept as run r of others, of which every row is kept or the last."""
        rows = done.poses.shape[1]
        done.poses[r], done.seen[r], done.ends[r] = self.poses[0, -rows:], self.seen[0, -rows:], self.ends[0]
        if rows == 1:
            done.modes[r, ..., 1] = np.bitwise_or.reduce(self.modes[0, ..., 1], axis=0)
        done.hands[:] = self.hands

    @property
    def points(self) -> Array:
        """Nearest points of the outline in O, (n, rows, k, 2) [m]."""
        return self.seen[..., :2]

    @property
    def gaps(self) -> Array:
        """(n, rows, k) [m]."""
        return self.seen[..., 2]

    @property
    def modes(self) -> Codes:
        """Codes of the last modes, and of all modes on the way as bits, (n, rows, k, 2)."""
        return self.seen.view(np.int64)[..., 3:]


class Runner:
    """Makes the runs of one plant; arguments as Plant's."""

    def __init__(
        self,
        outline: Outline,
        surface: LimitSurface,
        cof: Array,
        friction: float,
        radius: float,
        tips: Array,
        plain: bool,
    ) -> None:
        self._plain = Fingers(outline, surface, cof, friction, radius, tips)
        known = not plain and len(tips) <= 2 and compilable(surface)
        self._surface = surface_arrays(surface) if known else None
        self._outline = o = outline_arrays(outline)
        # What the kernel is given of the plant itself, made once: making it takes longer than a step.
        row = (o.x, o.y, o.radius, o.size, radius, o.circle, o.convex)
        self._things = np.array([row], OUTLINE), o.edges, records(POINT, tips)
        self._own: RunArrays | None = None
        if self._surface is not None:
            self._own = run_arrays([self._surface], cof[None], np.array([friction]))
        self._last: tuple[tuple[bytes, bytes], RunArrays | None] | None = None
        self._step: Callable[..., None] | None = None  # the kernel, with what it is given of the plant itself

    @cached_property
    def _rows(self) -> tuple[OutlineArrays, Rows, SurfaceArrays | None]:
        """Outline, fingertips and surface for the interpreter."""
        own = None if self._surface is None else interpreted(self._surface)
        return interpreted(self._outline), plain_rows(self._things[2]), own

    @property
    def compiled(self) -> bool:
        """Whether the steps that are compiled know its surface and its number of fingers."""
        return self._own is not None

    def __reduce__(self) -> tuple[type["Runner"], tuple[object, ...]]:
        """For pickle and copies: made anew, as the kernel and rows for the interpreter belong to a process."""
        own = self._plain
        given = own.outline, own.surface, own.cof, own.friction, own.radius, own.tips, not self.compiled
        return Runner, given

    def step(self, q: Array, way: Array) -> Done:
        """One run from X_WO q (3,) under hands that go straight between two poses (2, h, 3), the first known.

        As run, but where the kernel is there already it costs little more than the kernel itself.
        """
        if self._step is None:
            done = self.run(Task(q[None], way[None], AS_IT_IS, begin=1))
            if self._own is not None and type(self._surface) in _ready:
                from .kernels import many

                def step(hands: int, *numbers: Array) -> None:
                    many(courses[hands - 1], *own, *numbers)

                own = *self._own, *self._things
                courses = [np.array([(0, 1, 1, h, 2, 1, AS_IT_IS, 1, False)], COURSE) for h in (1, 2)]
                self._step = step
            return done
        count, out, seen = way.shape[1], np.empty((1, 1, 3)), np.empty((1, 1, len(self._plain.tips), _SEEN))
        end, room = np.array([*q.tolist(), 0.0, 0.0]), np.empty(_SCRATCH)
        self._step(count, end, way.ravel(), out.ravel(), seen.ravel(), room)
        codes = end.view(np.int64)[3:]
        if codes[0] >= MANY:
            return self.run(Task(q[None], way[None], AS_IT_IS, begin=1))
        return Done(out, seen, codes[None], room[_HANDS : _HANDS + 3 * count].reshape(count, 3))

    def run(self, task: Task, threads: int | None = None) -> Done:
        """The runs of a task.

        Raises:
            InputError: for surfaces of several kinds or sizes.
        """
        n = len(task.starts)
        done = Done.of(task, len(self._plain.tips))
        surfaces = None if self._surface is None else [self._surface]
        if surfaces and task.surfaces is not None:
            known = all(map(compilable, task.surfaces))
            surfaces = [surface_arrays(s) for s in task.surfaces] if known else None
        if surfaces and n:
            self._made(task, surfaces, threads, done)
        for r in np.flatnonzero(done.ends[:, 0] >= MANY).tolist():
            if surfaces:
                self._past(task, r, surfaces[r % len(surfaces)], done)
            else:
                self._plainly(task, r, done)
        return done

    def _made(self, task: Task, surfaces: Sequence[SurfaceArrays], threads: int | None, done: Done) -> None:
        """The runs by the steps, up to where these cannot decide."""
        kind = type(surfaces[0])
        if kind not in _ready:
            _interpreted[kind] = _interpreted.get(kind, 0.0) + len(task.starts) * self._work(task.hands)
        late = kind in _ready or _interpreted[kind] > PATIENCE
        if late or not self._interpreted(task, surfaces, done):
            self._compiled(task, surfaces, threads, done)

    def _past(self, task: Task, r: int, surface: SurfaceArrays, done: Done) -> None:
        """A run that the steps could not decide: from pose to pose by them, and where they cannot the plain way."""
        way, fingers = task.hands[r % len(task.hands)], len(self._plain.tips)
        count, rest = len(way), task.of_run(r)._replace(rows=len(way))
        whole, at, status = Done.of(rest, fingers), task.begin, GOING
        while at < count and status == GOING:
            begin = min(at, 1)
            rest = rest._replace(hands=way[None, at - begin :], rows=count - at + begin, begin=begin)
            found = Done.of(rest, fingers)
            self._made(rest, [surface], 1, found)
            status, reached = found.ends[0].tolist()
            whole.take(found, at, begin)
            at += reached
            if status >= MANY:
                q = whole.poses[:, at - 1] if reached else rest.starts
                begin = min(at, 1)
                step = rest._replace(
                    starts=q, hands=way[None, at - begin : at + 1], rows=1 + begin, begin=begin
                )
                found = Done.of(step, fingers)
                self._plainly(step, 0, found)
                status, reached = found.ends[0].tolist()
                whole.take(found, at, begin)
                at += reached
            rest = rest._replace(starts=whole.poses[:, at - 1], push_out=False)
        whole.ends[0] = status, at - task.begin
        whole.put(done, r)

    def _work(self, hands: Array) -> float:
        """Steps that a run takes at least."""
        turn = np.max(np.hypot(*self._plain.tips.T)) + self._outline.size
        ways = np.abs(np.diff(hands, axis=1)) @ [1.0, 1.0, turn] / (steps.STEP * self._outline.size)
        return float(np.max(np.sum(np.maximum(1.0, ways), axis=(1, 2)), initial=1.0))

    def _compiled(
        self, task: Task, surfaces: Sequence[SurfaceArrays], threads: int | None, done: Done
    ) -> None:
        from .kernels import many

        own = self._own
        if task.surfaces is not None or task.frictions is not None or task.cofs is not None:
            own = self._varied(task, surfaces)
        if own is None:
            raise InputError("the surfaces of many runs are of one kind and size")
        n, (_, number, count, _) = len(task.starts), task.hands.shape
        ends = np.concatenate([task.starts, np.zeros((n, 2))], axis=1)
        way, out, seen, ran = task.hands.ravel(), done.poses.ravel(), done.seen.ravel(), ends.ravel()
        few = n == 1 or n * self._work(task.hands) < ALONE
        workers = 1 if few else threads or os.cpu_count() or 1
        size = n if workers == 1 else -(-n // (4 * workers))

        def chunk(first: int) -> None:
            last = min(first + size, n)
            how = first, last, len(surfaces), count, number, task.begin, task.kind, task.rows, task.push_out
            room = np.empty(_SCRATCH)
            many(np.array([how], COURSE), *own, *self._things, ran, way, out, seen, room)
            if first == 0:
                done.hands[:] = room[_HANDS : _HANDS + 3 * count].reshape(count, 3)

        chunk(0)  # compiles, if need be, in one thread
        _ready.add(type(surfaces[0]))
        if n > size:
            with ThreadPoolExecutor(workers) as pool:
                list(pool.map(chunk, range(size, n, size)))
        done.ends[:] = ends.view(np.int64)[:, 3:]

    def _varied(self, task: Task, surfaces: Sequence[SurfaceArrays]) -> RunArrays | None:
        """What the kernel is given of runs that differ; kept for the next task, which often has the same."""
        cofs = self._plain.cof[None] if task.cofs is None else task.cofs
        mus = np.array([self._plain.friction]) if task.frictions is None else task.frictions
        if task.surfaces is not None:
            return run_arrays(surfaces, cofs, mus)
        key = cofs.tobytes(), mus.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, run_arrays(surfaces, cofs, mus)
        return self._last[1]

    def _interpreted(self, task: Task, surfaces: Sequence[SurfaceArrays], done: Done) -> bool:
        """Whether the runs were made; not where that would take too long."""
        kind, began = type(surfaces[0]), time.thread_time()
        room, count = scratch(), task.hands.shape[2]
        ways = [plain_rows(records(POSE, way.reshape(-1, 3))) for way in task.hands]
        outline, fingers, own = self._rows
        plain = [own if own and arrays is self._surface else interpreted(arrays) for arrays in surfaces]
        rows = blank(POSE, task.rows)
        out = _Watched(rows, began + ENOUGH - _spent.get(kind, 0.0))
        seen = blank(SEEN, task.rows * len(fingers))
        start = blank(POSE, 1)[0]
        for r, pose in enumerate(task.starts.tolist()):
            made, way = self._of_run(task, r), ways[r % len(ways)]
            x, y = made.cof.tolist()
            setting = Setting(plain[r % len(plain)], x, y, outline, made.friction, made.radius, fingers)
            start.x, start.y, start.angle = pose
            try:
                if task.push_out:
                    contacts.push_out(setting, start, way[:count], room)
                done.ends[r] = steps.follow(
                    setting, start, way, count, task.begin, task.kind, out, seen, room
                )
            except _Tired:
                break
            except (ArithmeticError, ValueError):  # where the compiled formulas go on with inf or nan
                done.ends[r] = UNDECIDED, 0
                continue
            done.poses[r] = [(q.x, q.y, q.angle) for q in rows]
            done.seen[r, ..., :3] = np.reshape([(s.x, s.y, s.gap) for s in seen], (task.rows, -1, 3))
            done.modes[r] = np.reshape([(s.mode, s.modes) for s in seen], (task.rows, -1, 2))
            done.hands[:] = [(h.x, h.y, h.angle) for h in room.hands[:count]]
        _spent[kind] = _spent.get(kind, 0.0) + time.thread_time() - began
        return _spent[kind] <= ENOUGH

    def _plainly(self, task: Task, r: int, done: Done) -> None:
        fingers, q, way = self._of_run(task, r), task.starts[r].copy(), task.hands[r % len(task.hands)]
        if task.push_out:
            runs.push_out(fingers, q, way[0])
        seen = done.seen[r].view(SEEN)[..., 0]
        status, reached, done.hands[:] = runs.follow(
            fingers, q, way, task.begin, task.kind, done.poses[r], seen
        )
        done.ends[r] = status, reached

    def _of_run(self, task: Task, r: int) -> Fingers:
        """The plain plant with what a run has of its own."""
        own = self._plain
        surface = own.surface if task.surfaces is None else task.surfaces[r % len(task.surfaces)]
        cof = own.cof if task.cofs is None else task.cofs[r % len(task.cofs)]
        mu = own.friction if task.frictions is None else float(task.frictions[r % len(task.frictions)])
        return Fingers(own.outline, surface, cof, mu, own.radius, own.tips)
