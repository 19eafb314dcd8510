"""An object and the fingers that push it, moved step by step."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...friction.surface import LimitSurface
from ...geometry.pose import Array
from ...problem import Object
from ...problem.mechanics import surface_of
from ...problem.scene import Model
from . import runs, steps
from .arrays import (
    POINT,
    POSE,
    SEEN,
    Course,
    ManySettings,
    SeenRows,
    Setting,
    SurfaceArrays,
    blank,
    compilable,
    interpreted,
    of_many,
    outline_arrays,
    plain_rows,
    records,
    scratch,
    surface_arrays,
)
from .codes import AS_IT_IS, BODY, LEFT, MANY, MODES, OUTCOMES, RIGHT, STRAIGHT, UNDECIDED
from .plain import Fingers

Codes = NDArray[np.integer]


FARTHEST = (
    1e3  # fingertips from their hand, by the outline's size: a turn moves them by as many steps of the plant
)
LONGEST = 2e4  # way of a hand in one run, by the outline's size: some ten seconds of compiled steps


@dataclass(frozen=True, eq=False)
class PlantState:
    """Where object and fingers are.

    Attributes:
        object: X_WO, shape (3,).
        hand: X_WE, shape (3,); of fingers that move separately each its own, (k, 3).
        modes: contact mode of each finger in the last step, ContactMode's words; "separation" where it does not touch.
        points: nearest points of the outline to the fingers, in O, shape (k, 2): the contacts, where they touch.
        gaps: between each fingertip and the outline, shape (k,) [m].
        outcome: "" while all is well; "starts inside", "jammed" (between a finger that moves and one that stands),
            "grasped" (between fingers that close), after which nothing moves any more.
    """

    object: Array
    hand: Array
    modes: tuple[str, ...]
    points: Array
    gaps: Array
    outcome: str = ""


@dataclass(frozen=True, eq=False)
class PlantRun:
    """The object under a given motion of the hand; n poses, k fingers.

    Attributes:
        object: X_WO at each pose of the hand, shape (n, 3); after the run has ended, where it ended.
        modes: codes (MODES[code] is the word) in the last step before each pose, shape (n, k).
        points, gaps: as in PlantState, shapes (n, k, 2) and (n, k).
        outcome: as in PlantState; "" if the whole motion was made.
        reached: how many poses of the hand were reached.
    """

    object: Array
    modes: Codes
    points: Array
    gaps: Array
    outcome: str
    reached: int


@dataclass(frozen=True, eq=False)
class PlantRuns:
    """Many runs; n of them, m poses of the hand, k fingers.

    Attributes:
        final: X_WO at the end, shape (n, 3).
        outcome: codes, shape (n,); OUTCOMES[code] is the word.
        stuck: whether no finger slid in a step, shape (n,). It may have been off the object.
        object, modes, points: the way, shapes (n, m, 3), (n, m, k) and (n, m, k, 2), if it was recorded; else None.
    """

    final: Array
    outcome: Codes
    stuck: NDArray[np.bool_]
    object: Array | None = None
    modes: Codes | None = None
    points: Array | None = None


class Plant:
    """A quasi-static object on the table, and round fingers fixed to one hand or moving separately.

    Args:
        thing: the object.
        fingers: fingertip centres in E, shape (k, 2), any number [m]. One and two are compiled, and anything that these
            cannot decide (three contacts in a hollow) goes the plain way, as do three and more, and surfaces that the
            kernels do not know (collinear feet): far slower.
        tip_radius: [m].
        model: limit surface (see problem.mechanics.surface_of; "local": about a push along +x of the hand is not known
            here, give it as surface).
        surface: a limit surface about the centre of friction, instead of the model's.
        friction: between fingertip and object, instead of the object's.
        cof: the centre of friction in O (2,), instead of the support's centre.
        plain: goes the plain way for one and two fingers as well.

    Raises:
        InputError: for fingers or numbers that make no sense.

    >>> thing = Object([(0, 0), (2, 0), (2, 2), (0, 2)], friction=0.5)
    >>> plant = Plant(thing, [[0.0, 0.0]], 0.1)
    >>> state = plant.step(plant.start([0, 0, 0], [-0.1, 1, 0]), [1.0, 0.0, 0.0], 0.5)
    >>> state.modes, (state.object.round(9) + 0.0).tolist()
    (('sticking',), [0.5, 0.0, 0.0])
    """

    def __init__(
        self,
        thing: Object,
        fingers: ArrayLike,
        tip_radius: float,
        *,
        model: Model = "exact",
        surface: LimitSurface | None = None,
        friction: float | None = None,
        cof: ArrayLike | None = None,
        plain: bool = False,
    ) -> None:
        tips = np.ascontiguousarray(np.array(fingers, dtype=float))
        if tips.ndim != 2 or tips.shape[1] != 2 or not len(tips) or not np.isfinite(tips).all():
            raise InputError("fingers are one or more points [x, y] in the pusher's frame", value=fingers)
        if not (np.isfinite(tip_radius) and tip_radius >= 0):
            raise InputError("a tip radius is a finite number, 0 or more", value=tip_radius)
        if np.max(np.hypot(*tips.T)) > FARTHEST * thing.outline.size:
            raise InputError(
                f"a fingertip is at most {FARTHEST:g} times the object's size from the hand's origin",
                value=tips.tolist(),
            )
        mu = thing.friction if friction is None else float(friction)
        if not (np.isfinite(mu) and mu >= 0):
            raise InputError("friction is a finite number, 0 or more", value=friction)
        if surface is None and model == "local":
            raise InputError("the local model depends on the push: give it as surface=", value=model)
        self.thing, self.friction = thing, mu
        self.surface = surface if surface is not None else surface_of(thing, model, np.array([1.0, 0.0]))
        self.fingers, self.tip_radius = tips, float(tip_radius)
        self.cof = _vector(thing.cof if cof is None else cof, 2, "a centre of friction")
        self._plain = plain or len(tips) > 2 or not compilable(self.surface)
        self._arrays = None if self._plain else surface_arrays(self.surface)
        self._shared = None if self._arrays is None else of_many([self._arrays])
        self._outline, self._points = outline_arrays(thing.outline), records(POINT, tips)

    def start(self, object_: ArrayLike, hand: ArrayLike, push_out: bool = True) -> PlantState:
        """The state with the object at X_WO and the hand at X_WE, (3,) or one for each finger (k, 3).

        Where fingers overlap the object it is moved out the shortest way, or, without push_out, the state's outcome is
        "starts inside".
        """
        hands = self._hands(hand)
        done = self._run(_vector(object_, 3, "a pose")[None], hands[None, None], AS_IT_IS, push_out)
        return self._state(done, np.ndim(hand) == 2)

    def step(self, state: PlantState, velocity: ArrayLike, dt: float) -> PlantState:
        """The state after a time dt in which the hand moves with a velocity in W (vx, vy, yaw rate), (3,) or (k, 3).

        E's origin goes straight. Fingertips turn with their hand.
        """
        if not (np.isfinite(dt) and dt >= 0):
            raise InputError("a time step is a finite number, 0 or more", value=dt)
        hands = np.array(state.hand, dtype=float).reshape(-1, 3)
        step = np.atleast_2d(np.array(velocity, dtype=float)) * dt
        if step.shape != hands.shape or not np.isfinite(step).all():
            raise InputError("a velocity is three finite numbers for each hand", value=velocity)
        self._refuse_too_long(np.abs(step) * [1.0, 1.0, self._outline.size])
        if state.outcome:
            return state
        done = self._run(state.object[None], np.stack([hands, hands + step])[None], AS_IT_IS)
        return self._state(done, state.hand.ndim == 2)

    def follow(
        self, object_: ArrayLike, hand: ArrayLike, push_out: bool = True, body: bool = False
    ) -> PlantRun:
        """The object, from X_WO, under a hand that goes straight from pose to pose, (n, 3) or (n, k, 3).

        Args:
            push_out: as in start.
            body: whether the hand goes from pose to pose with a constant body twist instead.
        """
        hands = self._way(hand)
        q = _vector(object_, 3, "a pose")
        done = self._run(q[None], hands[None], BODY if body else STRAIGHT, push_out, len(hands))
        seen = done.seen[0]
        return PlantRun(
            done.poses[0],
            seen["mode"].astype(np.int8),
            _points(seen),
            seen["gap"],
            OUTCOMES[done.outcome[0]],
            int(done.reached[0]),
        )

    def many(
        self,
        starts: ArrayLike,
        hand: ArrayLike,
        *,
        friction: ArrayLike | None = None,
        surfaces: Sequence[LimitSurface] | None = None,
        cofs: ArrayLike | None = None,
        threads: int | None = None,
        push_out: bool = True,
        body: bool = False,
        record: bool = False,
    ) -> PlantRuns:
        """Runs from n poses X_WO (n, 3) under one motion of the hand (m, 3), or one for each run (n, m, 3).

        Args:
            friction: of each run (n,). surfaces: of each, all of one kind and size. cofs: of each (n, 2).
            threads: default: the machine's cores.
            push_out, body: as in follow. record: keeps the whole way of every run.
        """
        objects = np.array(starts, dtype=float)
        if objects.ndim != 2 or objects.shape[1] != 3 or not np.isfinite(objects).all():
            raise InputError("starts are poses, shape (n, 3)", value=objects.shape)
        n = len(objects)
        hands = np.array(hand, dtype=float)
        hands = self._way(hands)[None] if hands.ndim == 2 else np.stack([self._way(h) for h in hands])
        mus = None if friction is None else np.array(friction, dtype=float)
        centres = None if cofs is None else np.ascontiguousarray(np.array(cofs, dtype=float))
        for what, values, shape in (
            ("friction", mus, ()),
            ("cofs", centres, (2,)),
            ("surfaces", None if surfaces is None else np.zeros(len(surfaces)), ()),
            ("hand", hands[:, 0, 0], (3,)),
        ):
            if values is None:
                continue
            if values.shape not in ((1, *shape), (n, *shape)) or not np.isfinite(values).all():
                raise InputError(f"{what}: one for all or one for each of {n} runs", value=values.shape)
        if mus is not None and np.any(mus < 0):
            raise InputError("friction is 0 or more", value=float(mus.min()))
        rows = hands.shape[1] if record else 1
        kind = BODY if body else STRAIGHT
        done = self._run(objects, hands, kind, push_out, rows, mus, centres, surfaces, threads)
        stuck = ~np.any(done.seen["modes"] & (1 << LEFT | 1 << RIGHT), axis=(1, 2))
        if not record:
            return PlantRuns(done.poses[:, -1], done.outcome, stuck)
        modes = done.seen["mode"].astype(np.int8)
        return PlantRuns(done.poses[:, -1], done.outcome, stuck, done.poses, modes, _points(done.seen))

    def _hands(self, hand: ArrayLike) -> Array:
        hands = np.atleast_2d(np.array(hand, dtype=float))
        if hands.shape not in ((1, 3), (len(self.fingers), 3)) or not np.isfinite(hands).all():
            raise InputError("a hand is one pose, or one for each finger", value=hand)
        return hands

    def _way(self, hand: ArrayLike) -> Array:
        way = np.array(hand, dtype=float)
        way = way[:, None] if way.ndim == 2 else way
        if way.ndim != 3 or way.shape[2] != 3 or way.shape[1] not in (1, len(self.fingers)) or not len(way):
            raise InputError("the hand's way is poses, shape (n, 3)", value=np.shape(hand))
        if not np.isfinite(way).all():
            raise InputError("the poses of the hand are finite numbers")
        self._refuse_too_long(np.sum(np.abs(np.diff(way[..., :2], axis=0)), axis=0))
        return np.ascontiguousarray(way)

    def _refuse_too_long(self, ways: Array) -> None:
        if ways.max(initial=0.0) > LONGEST * self._outline.size:
            raise InputError(
                f"a hand goes at most {LONGEST:g} times the object's size in one run", value=float(ways.max())
            )

    def _run(
        self,
        starts: Array,
        hands: Array,
        kind: int,
        push_out: bool = False,
        rows: int = 1,
        mus: Array | None = None,
        cofs: Array | None = None,
        surfaces: Sequence[LimitSurface] | None = None,
        threads: int | None = None,
    ) -> "_Done":
        """Runs from starts (n, 3) under hands (n or 1, m, h, 3); what is None is the plant's own."""
        n, k = len(starts), len(self.fingers)
        mus = np.array([self.friction]) if mus is None else mus
        cofs = self.cof[None] if cofs is None else cofs
        poses, seen = np.empty((n, rows, 3)), np.zeros((n, rows, k), SEEN)
        done = _Done(poses, seen, np.full(n, MANY), np.zeros(n, np.int64), hands[-1, 0].copy())
        packed = None if self._arrays is None else [self._arrays]
        if packed and surfaces is not None:
            packed = [surface_arrays(s) for s in surfaces] if all(map(compilable, surfaces)) else None
        if packed and n:
            work = 0.0 if type(packed[0]) in _ready else n * self._work(hands)
            _patience[0] -= work
            if type(packed[0]) in _ready or _patience[0] < 0:
                self._compiled(starts, hands, kind, push_out, mus, cofs, packed, threads, done)
            else:
                self._interpreted(starts, hands, kind, push_out, mus, cofs, packed, done)
        for r in np.flatnonzero(done.outcome >= MANY).tolist():
            surface = self.surface if surfaces is None else surfaces[r % len(surfaces)]
            mu, cof = float(mus[r % len(mus)]), cofs[r % len(cofs)]
            written = Fingers(self.thing.outline, surface, cof, mu, self.tip_radius, self.fingers)
            q, way = starts[r].copy(), hands[r % len(hands)]
            if push_out:
                runs.push_out(written, q, way[0])
            done.outcome[r], done.reached[r], done.hands[:] = runs.follow(
                written, q, way, kind, poses[r], seen[r]
            )
        return done

    def _work(self, hands: Array) -> float:
        """Steps that a run takes at least."""
        turn = np.max(np.hypot(*self.fingers.T)) + self._outline.size
        ways = np.abs(np.diff(hands, axis=1)) @ [1.0, 1.0, turn] / (steps.STEP * self._outline.size)
        return float(np.max(np.sum(np.maximum(1.0, ways), axis=(1, 2)), initial=1.0))

    def _interpreted(
        self,
        starts: Array,
        hands: Array,
        kind: int,
        push_out: bool,
        mus: Array,
        cofs: Array,
        packed: Sequence[SurfaceArrays],
        done: "_Done",
    ) -> None:
        room = scratch(len(self.fingers), True)
        count, rows = hands.shape[2], done.poses.shape[1]
        ways = [plain_rows(records(POSE, way.reshape(-1, 3))) for way in hands]
        surfaces = [interpreted(arrays) for arrays in packed]
        outline, fingers = interpreted(self._outline), plain_rows(self._points)
        out, seen = blank(POSE, rows), blank(SEEN, rows * len(fingers))
        start = blank(POSE, 1)[0]
        for r, pose in enumerate(starts.tolist()):
            mu, (x, y) = float(mus[r % len(mus)]), cofs[r % len(cofs)].tolist()
            surface, way = surfaces[r % len(surfaces)], ways[r % len(ways)]
            setting = Setting(surface, x, y, outline, mu, self.tip_radius, fingers)
            start.x, start.y, start.angle = pose
            try:
                if push_out:
                    steps.push_out(setting, start, way[:count], room)
                done.outcome[r], done.reached[r] = steps.follow(
                    setting, start, way, count, kind, out, seen, room
                )
            except (ArithmeticError, ValueError):  # where the compiled formulas go on with inf or nan
                done.outcome[r] = UNDECIDED
                continue
            done.poses[r] = [(q.x, q.y, q.angle) for q in out]
            done.seen[r].flat = [(s.x, s.y, s.gap, s.mode, s.modes) for s in seen]
            done.hands[:] = [(h.x, h.y, h.angle) for h in room.hands[:count]]

    def _compiled(
        self,
        starts: Array,
        hands: Array,
        kind: int,
        push_out: bool,
        mus: Array,
        cofs: Array,
        packed: Sequence[SurfaceArrays],
        threads: int | None,
        done: "_Done",
    ) -> None:
        from .kernels import many

        surfaces = self._shared if packed[0] is self._arrays else of_many(packed)
        if surfaces is None:
            raise InputError("the surfaces of many runs are of one kind and size")
        n, (_, number, count, _) = len(starts), hands.shape
        settings = ManySettings(
            surfaces,
            records(POINT, cofs),
            self._outline,
            mus,
            self.tip_radius,
            self._points,
        )
        course = Course(count, number, kind, done.poses.shape[1], push_out)
        begun, way = records(POSE, starts.copy()), records(POSE, hands.reshape(-1, 3))
        out, seen = done.poses.reshape(-1, 3).view(POSE).reshape(-1), done.seen.reshape(-1)
        workers = 1 if n == 1 else threads or os.cpu_count() or 1
        size = max(1, -(-n // (4 * workers)))

        def chunk(first: int) -> Array:
            room = scratch(len(self.fingers), False)
            last = min(first + size, n)
            many(first, last, settings, begun, way, course, out, seen, done.outcome, done.reached, room)
            return room.hands

        last = chunk(0)  # compiles, if need be, in one thread
        _ready.add(type(surfaces))
        if n > size:
            with ThreadPoolExecutor(workers) as pool:
                list(pool.map(chunk, range(size, n, size)))
        done.hands[:] = last.view(np.float64).reshape(-1, 3)[:count]

    def _state(self, done: "_Done", separate: bool) -> PlantState:
        seen = done.seen[0, 0]
        modes = tuple(MODES[code] for code in seen["mode"])
        hand = done.hands if separate else done.hands[0]
        return PlantState(
            done.poses[0, 0], hand, modes, _points(seen), seen["gap"].copy(), OUTCOMES[done.outcome[0]]
        )


class _Done(NamedTuple):
    """Runs: X_WO (n, rows, 3), SEEN rows (n, rows, k), codes and poses reached (n,), last poses of the hands (h, 3)."""

    poses: Array
    seen: SeenRows
    outcome: Codes
    reached: Codes
    hands: Array


# Steps that this process may still interpret before it compiles the kernels (a step takes about a millisecond then,
# compiling takes longer than all of them), and the kinds of surface for which it has.
_patience = [3000.0]
_ready: set[type] = set()


def _points(seen: SeenRows) -> Array:
    return np.stack([seen["x"], seen["y"]], axis=-1)


def _vector(values: ArrayLike, size: int, what: str) -> Array:
    vector = np.array(values, dtype=float)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InputError(f"{what} is {size} finite numbers", value=values)
    return vector
