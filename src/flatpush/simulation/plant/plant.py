"""An object and the fingers that push it, moved step by step."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...friction.surface import LimitSurface
from ...geometry.pose import Array
from ...problem import Object
from ...problem.mechanics import surface_of
from ...problem.scene import Model
from . import runs
from .plain import Fingers
from .runs import MODES, OUTCOMES
from .table import compilable, outline_table, surface_table

UNKNOWN = -1  # kind of a surface that only the plain way knows
_MANY, _UNDECIDED = OUTCOMES.index("too many contacts"), OUTCOMES.index("undecided")


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
    modes: Array
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
    outcome: Any
    stuck: Any
    object: Array | None = None
    modes: Any = None
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
        mu = thing.friction if friction is None else float(friction)
        if not (np.isfinite(mu) and mu >= 0):
            raise InputError("friction is a finite number, 0 or more", value=friction)
        if surface is None and model == "local":
            raise InputError("the local model depends on the push: give it as surface=", value=model)
        self.thing, self.friction = thing, mu
        self.surface = surface if surface is not None else surface_of(thing, model, np.array([1.0, 0.0]))
        self.fingers, self.tip_radius = tips, float(tip_radius)
        self.cof = _vector(thing.cof if cof is None else cof, 2, "a centre of friction")
        known = compilable(self.surface)
        self._plain = plain or len(tips) > 2 or not known
        kind, table = surface_table(self.surface) if known else (UNKNOWN, np.zeros((1, 1)))
        # (kind, table, cof, shape, mu, radius, fingers): the first arguments of the kernels, if they know the kind.
        self._pack = (kind, table, self.cof, outline_table(thing.outline), mu, self.tip_radius, tips)

    def start(self, object_: ArrayLike, hand: ArrayLike, push_out: bool = True) -> PlantState:
        """The state with the object at X_WO and the hand at X_WE, (3,) or one for each finger (k, 3).

        Where fingers overlap the object it is moved out the shortest way, or, without push_out, the state's outcome is
        "starts inside".
        """
        q, hands = _vector(object_, 3, "a pose").copy(), self._hands(hand)
        if push_out:
            self._push_out(q, hands)
        return self._moved(q, hands, np.zeros_like(hands), np.ndim(hand) == 2)

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
        if state.outcome:
            return state
        return self._moved(state.object.copy(), hands, step, state.hand.ndim == 2)

    def follow(
        self, object_: ArrayLike, hand: ArrayLike, push_out: bool = True, body: bool = False
    ) -> PlantRun:
        """The object, from X_WO, under a hand that goes straight from pose to pose, (n, 3) or (n, k, 3).

        Args:
            push_out: as in start.
            body: whether the hand goes from pose to pose with a constant body twist instead.
        """
        q, hands = _vector(object_, 3, "a pose").copy(), self._way(hand)
        if push_out:
            self._push_out(q, hands[0])
        n, k = len(hands), len(self.fingers)
        poses, seen = np.empty((n, 3)), np.zeros((n, k, 5))
        status, reached = _MANY, 0
        if not self._plain:
            from .kernels import follow as kernel

            status, reached = kernel(*self._pack, q.copy(), hands, int(body), poses, seen)
        if status in (_MANY, _UNDECIDED):
            status, reached = runs.follow(self._written(self._pack), q, hands, int(body), poses, seen)
        return PlantRun(
            poses, seen[:, :, 0].astype(np.int8), seen[:, :, 1:3], seen[:, :, 3], OUTCOMES[status], reached
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
        n, k = len(objects), len(self.fingers)
        kind, table, cof, shape, mu, radius, fingers = self._pack
        hands = np.array(hand, dtype=float)
        hands = self._way(hands)[None] if hands.ndim == 2 else np.stack([self._way(h) for h in hands])
        tables, plain = table[None], self._plain
        if surfaces is not None and (self._plain or not all(map(compilable, surfaces))):
            plain = True
            if len(surfaces) not in (1, n):
                raise InputError(f"surfaces: one for all or one for each of {n} runs", value=len(surfaces))
        elif surfaces is not None:
            packed = [surface_table(s) for s in surfaces]
            if len({(p[0], p[1].shape) for p in packed}) != 1:
                raise InputError("the surfaces of many runs are of one kind and size")
            kind, tables = packed[0][0], np.stack([p[1] for p in packed])
        mus = np.array([mu]) if friction is None else np.array(friction, dtype=float)
        centres = cof[None] if cofs is None else np.ascontiguousarray(np.array(cofs, dtype=float))
        for what, values, width in (
            ("friction", mus[:, None], 1),
            ("cofs", centres, 2),
            ("surfaces", tables[:, 0], None),
            ("hand", hands[:, 0, 0], 3),
        ):
            if (
                len(values) not in (1, n)
                or (width and values.shape[1] != width)
                or not np.isfinite(values).all()
            ):
                raise InputError(f"{what}: one for all or one for each of {n} runs", value=values.shape)
        if np.any(mus < 0):
            raise InputError("friction is 0 or more", value=float(mus.min()))
        rows = hands.shape[1] if record else 1
        poses, seen, outcome = np.empty((n, rows, 3)), np.zeros((n, rows, k, 5)), np.zeros(n, np.int64)
        workers = threads or os.cpu_count() or 1
        size = max(1, -(-n // (4 * workers)))
        args = (kind, tables, centres, shape, mus, radius, fingers, objects, hands, int(body), int(push_out))

        begun = objects.copy()
        if n and not plain:
            from .kernels import many as kernel

            def chunk(first: int) -> None:
                kernel(first, min(first + size, n), *args, poses, seen, outcome)

            chunk(0)  # compiles, if need be, in one thread
            with ThreadPoolExecutor(workers) as pool:
                list(pool.map(chunk, range(size, n, size)))
        for r in range(n) if plain else np.flatnonzero(np.isin(outcome, (_MANY, _UNDECIDED))):
            self._again(int(r), begun[r], args, surfaces, push_out, poses, seen, outcome)
        bits = seen[..., 4].astype(int)
        stuck = ~np.any(bits & 0b1100, axis=(1, 2))
        way = (poses, seen[..., 0].astype(np.int8), seen[..., 1:3]) if record else (None, None, None)
        return PlantRuns(poses[:, -1], outcome, stuck, *way)

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
        return np.ascontiguousarray(way)

    def _push_out(self, q: Array, hands: Array) -> None:
        if self._plain:
            runs.push_out(self._written(self._pack), q, hands)
        else:
            from .kernels import push_out

            _, _, cof, shape, _, radius, fingers = self._pack
            push_out(shape, cof, radius, fingers, q, hands)

    def _written(self, pack: tuple[Any, ...], surface: LimitSurface | None = None) -> Fingers:
        """The plain version of what is packed."""
        _, _, cof, _, mu, radius, fingers = pack
        return Fingers(self.thing.outline, surface or self.surface, cof, mu, radius, fingers)

    def _again(
        self,
        r: int,
        q: Array,
        args: tuple[Any, ...],
        surfaces: Sequence[LimitSurface] | None,
        push_out: bool,
        poses: Array,
        seen: Array,
        outcome: Any,
    ) -> None:
        """Run r of many, plainly."""
        kind, tables, cofs, shape, mus, radius, fingers, _, hands, body, _ = args
        mine = (kind, tables, cofs[r % len(cofs)], shape, float(mus[r % len(mus)]), radius, fingers)
        written = self._written(mine, None if surfaces is None else surfaces[r % len(surfaces)])
        way = hands[r % len(hands)]
        if push_out:
            runs.push_out(written, q, way[0])
        outcome[r], _ = runs.follow(written, q, way, body, poses[r], seen[r])

    def _moved(self, q: Array, hands: Array, step: Array, separate: bool) -> PlantState:
        seen, status = np.zeros((len(self.fingers), 5)), _MANY
        if not self._plain:
            from .kernels import advance

            begun, held = q.copy(), hands.copy()
            status = advance(*self._pack, q, hands, step, 0, seen)
            if status in (_MANY, _UNDECIDED):
                q, hands = begun, held
        if status in (_MANY, _UNDECIDED):
            status = runs.advance(self._written(self._pack), q, hands, step, 0, seen)
        modes = tuple(MODES[int(code)] for code in seen[:, 0])
        return PlantState(
            q, hands if separate else hands[0], modes, seen[:, 1:3], seen[:, 3], OUTCOMES[status]
        )


def _vector(values: ArrayLike, size: int, what: str) -> Array:
    vector = np.array(values, dtype=float)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InputError(f"{what} is {size} finite numbers", value=values)
    return vector
