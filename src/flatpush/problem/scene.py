"""What is asked: an object on a table, a pusher, where to push, from where to where."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import is_finite, is_number, numbers, vector
from ..contact.landing import StartRegion
from ..errors import InputError
from ..friction.support import Support
from ..friction.surface import LimitSurface
from ..geometry import Outline, OutlinePoint, pose_error
from ..geometry.pose import Array

Model = Literal["exact", "ellipsoid", "local", "quartic"]
Cost = Literal["flat", "pusher", "time"]
MODELS: tuple[Model, ...] = ("exact", "ellipsoid", "local", "quartic")


@dataclass(frozen=True)
class Uncertainty:
    """How well an object's friction is known: the set of tables and fingers that two-finger pushes are proved for.

    Attributes:
        loads: pressure times table friction is within this share of its nominal value at every point, in [0, 1).
        friction: least and greatest Coulomb coefficient between fingertip and object; None: as the object's.
        offset: the fingers may stand so far along a straight side from where they should, either way [m].
        start: where the object may be about the scene's start; None: nothing is said, and each push is taken to begin
            within the offset of its place.

    Raises:
        InputError: with the key, for a share outside of [0, 1), coefficients that are no range, or a negative offset.
    """

    loads: float = 0.0
    friction: tuple[float, float] | None = None
    offset: float = 0.0
    start: StartRegion | None = None

    def __post_init__(self) -> None:
        def need(good: bool, key: str, rule: str) -> None:
            if not good:
                raise InputError(rule, key=f"object.uncertainty.{key}", value=getattr(self, key))

        need(
            is_finite(self.loads) and 0 <= self.loads < 1,
            "loads",
            "loads differ by a share of at least 0 and less than 1 (100 %)",
        )
        need(is_finite(self.offset) and self.offset >= 0, "offset", "an offset is a length, 0 or more")
        if self.friction is not None:
            low, high = self.friction
            need(
                is_finite(low) and is_finite(high) and 0 < low <= high,
                "friction",
                "a range of friction is [low, high], 0 < low ≤ high",
            )


@dataclass(frozen=True, eq=False)
class Object:
    """A rigid object on the table, in the frame O of its drawing.

    Args:
        outline: an Outline, or the corners of a polygon [m].
        support: where it presses on the table: "uniform", "outline", or a Support in the frame O; "unknown": nothing is
            known of it, and it stands for "uniform" until something is.
        friction: Coulomb coefficient between fingertip and object.
        surface: a known limit surface about the centre of friction, in SI; it overrides the support's own.
        name: for people.
        uncertainty: how well pressure and friction are known; None: exactly.

    Raises:
        InputError: for a friction that is negative, not finite, or outside of the uncertainty's range.
    """

    outline: Outline
    support: Support = field(default="uniform")  # type: ignore[assignment]  # words are replaced below
    friction: float = 0.3
    surface: LimitSurface | None = None
    name: str = "object"
    uncertainty: Uncertainty | None = None
    support_word: str = field(default="", init=False)  # the word where one was given

    if TYPE_CHECKING:

        def __init__(
            self,
            outline: Outline | ArrayLike,
            support: Support | str = "uniform",
            friction: float = 0.3,
            surface: LimitSurface | None = None,
            name: str = "object",
            uncertainty: Uncertainty | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.outline, Outline):
            object.__setattr__(self, "outline", Outline.polygon(self.outline))
        if isinstance(self.support, str):
            object.__setattr__(self, "support_word", self.support)
            object.__setattr__(self, "support", _support(self.outline, self.support))
        if not (is_finite(self.friction) and self.friction >= 0):
            raise InputError(
                "friction is a finite number, 0 or more", key="object.friction", value=self.friction
            )
        self._check_uncertainty()

    def _check_uncertainty(self) -> None:
        if self.uncertainty is None:
            return
        low, high = self.uncertainty.friction or (self.friction, self.friction)
        if not low <= self.friction <= high:
            raise InputError(
                f"the range of friction contains the object's own, {self.friction:g}",
                key="object.uncertainty.friction",
                value=self.uncertainty.friction,
            )
        if self.surface is not None:
            raise InputError(
                "a known limit surface has no loads that could differ",
                key="object.uncertainty",
                hint="Give the support instead of the surface.",
            )
        if self.uncertainty.start is None:
            return
        if self.outline.is_circle:
            raise InputError(
                "a disc has no straight side that would come to rest against two fingers",
                key="object.uncertainty.start",
                hint="Leave the start region out; feedback makes up for where a disc starts: flatpush track.",
            )
        if self.uncertainty.start.position > self.outline.size:
            raise InputError(
                f"a start region reaches at most as far as the object is long, {1000 * self.outline.size:.4g} mm",
                key="object.uncertainty.start.position",
                value=self.uncertainty.start.position,
            )

    @property
    def cof(self) -> Array:
        """The centre of friction in O, shape (2,) [m]."""
        return self.support.centre


SPEEDS = ("speed", "acceleration", "turn_rate", "travel_speed", "travel_acceleration")


@dataclass(frozen=True)
class Pusher:
    """The fingers and how they may move.

    Attributes:
        fingers: how many, 1 or 2.
        spacing: between the centres of two fingertips [m].
        tip_radius: of a fingertip [m].
        speed, acceleration: of the fastest fingertip on the table, at most [m/s], [m/s²].
        approach: distance from the contact at which the pusher lands and leaves [m].
        turns: whether the hand turns; if not, one finger keeps its orientation and rolls.
        transit: how it goes from push to push.
        lift: height of a lifted transit [m].
        turn_rate: of the hand, at most, always [rad/s].
        travel_speed, travel_acceleration: while it is lifted, at most [m/s], [m/s²].

    Raises:
        InputError: with the key, for a number that is negative, not finite, or 0 where nothing would move, and for
            fingers that overlap.
    """

    fingers: int = 1
    spacing: float = 0.0
    tip_radius: float = 0.0025
    speed: float = 0.02
    acceleration: float = 0.1
    approach: float = 0.002
    turns: bool = True
    transit: Literal["lift", "planar"] = "lift"
    lift: float = 0.03
    turn_rate: float = float(np.deg2rad(90))
    travel_speed: float = 0.1
    travel_acceleration: float = 0.5

    def __post_init__(self) -> None:
        def need(good: bool, key: str, rule: str, hint: str = "") -> None:
            if not good:
                raise InputError(rule, key=f"pusher.{key}", value=getattr(self, key), hint=hint)

        for key in ("spacing", "tip_radius", "approach", "lift", *SPEEDS):
            need(is_finite(getattr(self, key)), key, "a finite number is needed")
        need(is_number(self.fingers) and self.fingers in (1, 2), "fingers", "a pusher has 1 or 2 fingers")
        need(self.tip_radius >= 0, "tip_radius", "a tip radius is 0 or more")
        for key in SPEEDS:
            need(
                getattr(self, key) > 0,
                key,
                f"{'an' if key[0] == 'a' else 'a'} {key.replace('_', ' ')} is positive",
            )
        need(self.approach >= 0, "approach", "the approach distance is 0 or more")
        need(self.lift > 0, "lift", "the lift height is positive")
        if self.fingers == 2:
            need(self.spacing > 0, "spacing", "two fingers need a positive spacing")
            need(
                self.spacing >= 2 * self.tip_radius,
                "spacing",
                "the fingers overlap",
                "spacing ≥ 2 tip_radius",
            )
            need(self.turns, "turns", "two fingers that cannot turn cannot turn an object", "Use one finger.")


@dataclass(frozen=True, eq=False)
class Push:
    """One place to push at: a point of the outline and the fingers that push there.

    Attributes:
        name: for people, and in plans.
        at: the point of the outline, in O.
        fingers: how many push there, 1 or 2.
        spacing: between the centres of two fingertips [m].

    Raises:
        InputError: for another number of fingers, or a spacing that is negative or not finite.
    """

    name: str
    at: OutlinePoint
    fingers: int = 1
    spacing: float = 0.0

    def __post_init__(self) -> None:
        if not (is_number(self.fingers) and self.fingers in (1, 2)):
            raise InputError("a push has 1 or 2 fingers", key=self.name, value=self.fingers)
        if not (is_finite(self.spacing) and self.spacing >= 0):
            raise InputError("a spacing is a finite number, 0 or more", key=self.name, value=self.spacing)


@dataclass(frozen=True, eq=False)
class Workspace:
    """Where object and pusher must stay.

    Attributes:
        bounds: (xmin, ymin, xmax, ymax) [m], or None.
        obstacles: outlines, polygons or circles, in W; built from them or from the corners of simple polygons,
            shape (n, 2) [m].

    >>> Workspace((0, 0, 1, 1), (Outline.circle(0.1, (0.5, 0.5)), [(0, 0), (0.2, 0), (0, 0.2)])).obstacles[1].area
    0.02...

    Raises:
        InputError: for bounds that enclose no area, and corners that are no simple polygon.
    """

    bounds: tuple[float, float, float, float] | None = None
    obstacles: Sequence[Outline] = ()

    def __post_init__(self) -> None:
        if self.bounds is not None:
            sides = numbers(self.bounds, "the bounds are four numbers", "workspace.bounds")
            if sides.shape != (4,) or not np.all(np.isfinite(sides)) or np.any(sides[:2] >= sides[2:]):
                raise InputError(
                    "the bounds enclose an area",
                    key="workspace.bounds",
                    value=self.bounds,
                    hint="Their order is [xmin, ymin, xmax, ymax].",
                )
        outlines = []
        for k, obstacle in enumerate(self.obstacles):
            try:
                outlines.append(obstacle if isinstance(obstacle, Outline) else Outline.polygon(obstacle))
            except InputError as error:
                raise InputError(
                    error.rule, key=f"workspace.obstacles[{k}]", value=error.value, hint=error.hint
                ) from None
        object.__setattr__(self, "obstacles", tuple(outlines))


# By default, and what a plan leaves of a wider tolerance to whoever carries it out [m, m, rad].
GOAL_TOLERANCE = (0.0005, 0.0005, float(np.deg2rad(0.5)))


@dataclass(frozen=True)
class Planning:
    """How to plan; the defaults are those of the scene document, in SI.

    Attributes:
        model: of the limit surface: exact, or what is fitted to it.
        two_finger: the true composite cone of both contacts, or one virtual contact in their middle.
        cost: what is made small: the path of the flat point or of the pusher [m], or the time [s].
        switch_cost: of a change of contact, in the unit of the cost [m or s]; None: 0.03 m for flat, else 0.
        friction_margin: the share of the friction, and of the spacing, that may be missing, in [0, 1).
        clearance: of object and fingers from obstacles and bounds, at least [m].
        goal_tolerance: in x, y and angle [m, m, rad]; a plan uses what is wider than the default (Scene.goal_slack).
        robust: whether the cost after small errors of the switch poses is made small instead.
        seed: of the random search, a number from 0.
        iterations: how many the search makes at most.
        time_limit: after which the search is cut short [s].
        proof: of two fingers, where the object has an uncertainty.
        slides: whether one finger may push whatever the contact does: "auto", anywhere on the outline where no push of
            "auto" ones can steer; "join", also where some can, if that is cheaper; "never".

    Raises:
        InputError: with the key, for a value outside of what is said here.
    """

    model: Model = "exact"
    two_finger: Literal["cone", "middle"] = "cone"
    cost: Cost = "flat"
    switch_cost: float | None = None
    friction_margin: float = 0.2
    clearance: float = 0.0
    goal_tolerance: tuple[float, float, float] = GOAL_TOLERANCE
    robust: bool = False
    seed: int = 0
    iterations: int = 10000
    time_limit: float = 5.0
    proof: Literal["set", "nominal"] = "set"
    slides: Literal["auto", "join", "never"] = "auto"

    @property
    def switching(self) -> float:
        """The switching cost that applies, in the unit of the cost [m or s]."""
        if self.switch_cost is not None:
            return self.switch_cost
        return 0.03 if self.cost == "flat" else 0.0

    def __post_init__(self) -> None:
        def need(good: bool, key: str, rule: str) -> None:
            if not good:
                raise InputError(rule, key=f"planning.{key}", value=getattr(self, key))

        need(self.proof in ("set", "nominal"), "proof", "a proof is for the set or for the nominal table")
        need(self.slides in ("auto", "join", "never"), "slides", "slides are auto, join or never")
        need(self.model in MODELS, "model", f"the model is one of {', '.join(MODELS)}")
        need(
            is_finite(self.friction_margin) and 0 <= self.friction_margin < 1,
            "friction_margin",
            "the friction margin is at least 0 and less than 1",
        )
        need(is_finite(self.clearance) and self.clearance >= 0, "clearance", "a clearance is 0 or more")
        need(
            is_finite(self.switching) and self.switching >= 0,
            "switch_cost",
            "a switching cost is 0 or more",
        )
        need(
            isinstance(self.seed, int) and is_number(self.seed) and self.seed >= 0,
            "seed",
            "a seed is a whole number, 0 or more",
        )
        need(is_number(self.time_limit) and self.time_limit > 0, "time_limit", "a time limit is positive")
        need(
            is_number(self.iterations) and self.iterations >= 1,
            "iterations",
            "there is at least one iteration",
        )
        need(
            len(self.goal_tolerance) == 3 and all(is_finite(t) and t > 0 for t in self.goal_tolerance),
            "goal_tolerance",
            "three positive numbers are needed",
        )


@dataclass(frozen=True, eq=False)
class Scene:
    """All that a plan depends on, in SI.

    Args:
        object: what is pushed.
        start, goal: poses (x, y, θ) of the object frame O on the table W [m, rad]; a goal (x, y, "free") leaves the
            angle open, and NaN stands for it where the goal is read.
        pusher: the fingers.
        pushes: places to push at, or "auto".
        workspace, planning: as their classes say.

    Raises:
        InputError: for angles beyond two turns, and for a start region with one finger or planar transits.
    """

    object: Object
    start: ArrayLike
    goal: ArrayLike = (0.0, 0.0, 0.0)
    pusher: Pusher = field(default_factory=Pusher)
    pushes: tuple[Push, ...] | Literal["auto"] = "auto"
    workspace: Workspace = field(default_factory=Workspace)
    planning: Planning = field(default_factory=Planning)

    def __post_init__(self) -> None:
        for name in ("start", "goal"):
            value = getattr(self, name)
            pose = _pose(value, name)
            if abs(pose[2]) > 4 * np.pi:
                raise InputError(
                    "an angle of a pose is within two turns (4π rad)",
                    key=name,
                    value=value,
                    hint="It looks like degrees: use np.deg2rad.",
                )
            pose.setflags(write=False)
            object.__setattr__(self, name, pose)
        if self.pushes != "auto":
            object.__setattr__(self, "pushes", _checked_pushes(self.pushes))
        known = self.object.uncertainty
        if known is not None and known.start is not None:
            two = [self.pusher.fingers] if isinstance(self.pushes, str) else [p.fingers for p in self.pushes]
            if 2 not in two:
                raise InputError(
                    "one finger does not make up for an object that starts elsewhere",
                    key="object.uncertainty.start",
                    hint="Push with two fingers, or leave the start region out and use feedback: flatpush track.",
                )
            if self.pusher.transit != "lift":
                raise InputError(
                    "fingers that go around the object on the table have to know where it is",
                    key="pusher.transit",
                    value=self.pusher.transit,
                    hint="With a start region (object.uncertainty.start), transit: lift.",
                )

    @property
    def start_pose(self) -> Array:
        """X_WO, shape (3,) [m, m, rad]."""
        return np.asarray(self.start, dtype=float)

    @property
    def goal_pose(self) -> Array:
        """X_WO, shape (3,) [m, m, rad]; its angle is NaN where any will do."""
        return np.asarray(self.goal, dtype=float)

    @property
    def clearance(self) -> float:
        """What a plan keeps [m]: the clearance asked for, and for a set of tables the grasp's offset as well."""
        known = self.object.uncertainty
        return self.planning.clearance + (known.offset if known and self.planning.proof == "set" else 0.0)

    @property
    def free_angle(self) -> bool:
        """Whether the object may have any angle at the goal."""
        return bool(np.isnan(self.goal_pose[2]))

    @property
    def goal_slack(self) -> Array:
        """How far from the goal a plan may end, shape (3,) [m, m, rad]; half a turn where any angle will do.

        The default tolerance is left for errors on the way, so that by default a plan ends at the goal.
        """
        slack = np.maximum(np.subtract(self.planning.goal_tolerance, GOAL_TOLERANCE), 0.0)
        if self.free_angle or self.planning.goal_tolerance[2] >= np.pi:
            slack[2] = np.pi
        return slack

    @property
    def wide_goal(self) -> bool:
        """Whether a plan may end somewhere else than the goal asks."""
        x, y, angle = self.goal_slack
        return bool(x or y or (angle and not self.free_angle))

    def goal_error(self, pose: ArrayLike) -> Array:
        """A pose X_WO less the goal, shape (3,) [m, m, rad]: the angle wrapped, and 0 where any will do."""
        return (
            np.nan_to_num(pose_error(pose, self.goal_pose))
            if self.free_angle
            else pose_error(pose, self.goal)
        )


def _pose(value: ArrayLike, name: str) -> Array:
    """A pose; "free" for the angle of a goal becomes NaN."""
    parts = list(value) if isinstance(value, list | tuple | np.ndarray) else [value]
    free = name == "goal" and len(parts) == 3 and (parts[2] == "free" or _is_nan(parts[2]))
    rule = "a pose is three finite numbers, [x, y, θ]" + (', or [x, y, "free"]' if name == "goal" else "")
    pose = vector(np.array([*parts[:2], 0.0]) if free else value, 3, rule, name)
    if free:
        pose[2] = np.nan
    return pose


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and np.isnan(value)


def _support(outline: Outline, word: str) -> Support:
    if word not in ("uniform", "outline", "unknown"):
        raise InputError(
            'the support is "uniform", "outline", "unknown" or a Support', key="object.support", value=word
        )
    if outline.is_circle:
        disc = Support.ring if word == "outline" else Support.disc
        return disc(outline.radius, centre=outline.centre)
    return (Support.outline if word == "outline" else Support.polygon)(outline.vertices)


def _checked_pushes(pushes: Sequence[Push]) -> tuple[Push, ...]:
    if not pushes:
        raise InputError("there is at least one push", key="pushes", hint='Or leave it to "auto".')
    names = [push.name for push in pushes]
    for name in names:
        if names.count(name) > 1:
            raise InputError("each push has a name of its own", key="pushes", value=name)
    return tuple(pushes)
