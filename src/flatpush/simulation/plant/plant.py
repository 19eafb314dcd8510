"""An object and the fingers that push it, moved step by step."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...friction.surface import LimitSurface
from ...geometry.pose import Array
from ...problem import Object
from ...problem.mechanics import surface_of
from ...problem.plan import check_fingers
from ...problem.scene import Model
from .codes import AS_IT_IS, BODY, LEFT, MODES, OUTCOMES, RIGHT, STRAIGHT
from .runner import Codes, Done, Runner, Task

LONGEST = 2e4  # way of a hand in one run, by the outline's size: some ten seconds of compiled steps
FARTHEST = (
    1e7  # from the table's origin, by the outline's size: beyond, rounding is as large as contacts are exact
)


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
        check_fingers(tips, thing.outline.size)
        mu = thing.friction if friction is None else float(friction)
        if not (np.isfinite(mu) and mu >= 0):
            raise InputError("friction is a finite number, 0 or more", value=friction)
        if surface is None and model == "local":
            raise InputError("the local model depends on the push: give it as surface=", value=model)
        self.thing, self.friction = thing, mu
        self.surface = surface if surface is not None else surface_of(thing, model, np.array([1.0, 0.0]))
        self.fingers, self.tip_radius = tips, float(tip_radius)
        self.cof = _vector(thing.cof if cof is None else cof, 2, "a centre of friction")
        self._size = thing.outline.size
        self._runner = Runner(thing.outline, self.surface, self.cof, mu, self.tip_radius, tips, plain)

    @property
    def compiled(self) -> bool:
        """Whether its steps can be compiled; if not, it goes the plain way."""
        return self._runner.compiled

    def start(self, object_: ArrayLike, hand: ArrayLike, push_out: bool = True) -> PlantState:
        """The state with the object at X_WO and the hand at X_WE, (3,) or one for each finger (k, 3).

        Where fingers overlap the object it is moved out the shortest way, or, without push_out, the state's outcome is
        "starts inside".
        """
        hands = self._hands(hand)
        done = self._runner.run(Task(self._pose(object_)[None], hands[None, None], AS_IT_IS, push_out))
        return self._state(done, np.ndim(hand) == 2)

    def step(self, state: PlantState, velocity: ArrayLike, dt: float) -> PlantState:
        """The state after a time dt in which the hand moves with a velocity in W (vx, vy, yaw rate), (3,) or (k, 3).

        E's origin goes straight. Fingertips turn with their hand.

        Raises:
            InputError: for a negative time, or velocities that are not finite or of another shape.
        """
        if not (math.isfinite(dt) and dt >= 0):
            raise InputError("a time step is a finite number, 0 or more", value=dt)
        step = np.array(velocity, dtype=float, ndmin=2)
        if step.shape != (state.hand.size // 3, 3):
            raise InputError("a velocity is three finite numbers for each hand", value=velocity)
        step *= dt
        for x, y, turn in step.tolist():  # quicker than arrays for so few
            if not abs(x) + abs(y) + abs(turn) * self._size <= LONGEST * self._size:
                if not np.isfinite(step).all():
                    raise InputError("a velocity is three finite numbers for each hand", value=velocity)
                self._refuse_too_long(np.abs(step) @ [1.0, 1.0, self._size])
        if state.outcome:
            return state
        hands = np.empty((2, *step.shape))
        hands[0] = state.hand
        np.add(state.hand, step, out=hands[1])
        return self._state(self._runner.step(state.object, hands), state.hand.ndim == 2)

    def follow(
        self, object_: ArrayLike, hand: ArrayLike, push_out: bool = True, body: bool = False
    ) -> PlantRun:
        """The object, from X_WO, under a hand that goes straight from pose to pose, (n, 3) or (n, k, 3).

        Args:
            push_out: as in start.
            body: whether the hand goes from pose to pose with a constant body twist instead.
        """
        hands = self._way(hand)
        q = self._pose(object_)
        done = self._runner.run(Task(q[None], hands[None], BODY if body else STRAIGHT, push_out, len(hands)))
        status, reached = done.ends[0].tolist()
        return PlantRun(
            done.poses[0],
            done.modes[0, ..., 0].astype(np.int8),
            done.points[0],
            done.gaps[0],
            OUTCOMES[status],
            reached,
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
            threads: how many; default: the machine's cores.
            push_out, body: as in follow. record: keeps the whole way of every run.

        Raises:
            InputError: for other shapes, a negative friction, or less than one thread.
        """
        objects = np.array(starts, dtype=float)
        if objects.ndim != 2 or objects.shape[1] != 3 or not np.isfinite(objects).all():
            raise InputError("starts are poses, shape (n, 3)", value=objects.shape)
        self._refuse_too_far(objects)
        if threads is not None and threads < 1:
            raise InputError("threads are 1 or more", value=threads)
        n = len(objects)
        hands = np.array(hand, dtype=float)
        hands = self._way(hands)[None] if hands.ndim == 2 else self._way(hands, many=True)
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
        task = Task(objects, hands, kind, push_out, rows, 0, mus, centres, surfaces)
        done = self._runner.run(task, threads)
        outcome = done.ends[:, 0].copy()
        stuck = ~np.any(done.modes[..., 1] & (1 << LEFT | 1 << RIGHT), axis=(1, 2))
        if not record:
            return PlantRuns(done.poses[:, -1], outcome, stuck)
        modes = done.modes[..., 0].astype(np.int8)
        return PlantRuns(done.poses[:, -1], outcome, stuck, done.poses, modes, done.points)

    def _hands(self, hand: ArrayLike) -> Array:
        hands = np.atleast_2d(np.array(hand, dtype=float))
        if hands.shape not in ((1, 3), (len(self.fingers), 3)) or not np.isfinite(hands).all():
            raise InputError("a hand is one pose, or one for each finger", value=hand)
        self._refuse_too_far(hands)
        return hands

    def _pose(self, object_: ArrayLike) -> Array:
        pose = _vector(object_, 3, "a pose")
        self._refuse_too_far(pose)
        return pose

    def _way(self, hand: ArrayLike, many: bool = False) -> Array:
        way = np.array(hand, dtype=float)
        way = way[..., None, :] if way.ndim == 2 + many else way
        if (
            way.ndim != 3 + many
            or way.shape[-1] != 3
            or way.shape[-2] not in (1, len(self.fingers))
            or not way.size
        ):
            raise InputError("the hand's way is poses, shape (n, 3)", value=np.shape(hand))
        if not np.isfinite(way).all():
            raise InputError("the poses of the hand are finite numbers")
        self._refuse_too_long(np.sum(np.abs(np.diff(way[..., :2], axis=-3)), axis=-3))
        self._refuse_too_far(way)
        return np.ascontiguousarray(way)

    def _refuse_too_far(self, poses: Array) -> None:
        far = float(np.max(np.abs(poses[..., :2]), initial=0.0))
        if far > FARTHEST * self._size:
            raise InputError(
                f"object and fingers are at most {FARTHEST:g} times the object's size from the origin",
                value=far,
            )

    def _refuse_too_long(self, ways: Array) -> None:
        if ways.max(initial=0.0) > LONGEST * self._size:
            raise InputError(
                f"a hand goes at most {LONGEST:g} times the object's size in one run", value=float(ways.max())
            )

    def _state(self, done: Done, separate: bool) -> PlantState:
        modes = tuple([MODES[code] for code in done.modes[0, 0, :, 0].tolist()])
        hand = done.hands if separate else done.hands[0]
        outcome = OUTCOMES[done.ends[0, 0]]
        return PlantState(done.poses[0, 0], hand, modes, done.points[0, 0], done.gaps[0, 0], outcome)


def _vector(values: ArrayLike, size: int, what: str) -> Array:
    vector = np.array(values, dtype=float)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InputError(f"{what} is {size} finite numbers", value=values)
    return vector
