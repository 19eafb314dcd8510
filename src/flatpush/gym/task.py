"""A pushing task for learners: what is drawn for each episode, what is seen, and when it is solved."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arguments import is_finite
from ..errors import InputError
from ..geometry import rotate, transform, wrap_angle
from ..geometry.pose import Array
from ..problem import Scene
from ..simulation.noise import Disturbances, Noise

TRIES = 1000  # placements that are drawn until one is free
FARTHEST = 1.5  # starts and goals without bounds: within so many of the object's sizes of the scene's goal
ROOM = 1.0  # beyond that for the hand, likewise
LENGTH_OF_EPISODE = 60.0  # [s]
# Values of the state in their order, for one finger; a hand that turns adds sin and cos of its yaw.
STATE = (
    "object x",
    "object y",
    "sin θ",
    "cos θ",
    "finger x",
    "finger y",
    "goal x",
    "goal y",
    "sin goal",
    "cos goal",
)


@dataclass(frozen=True)
class Eyes:
    """How the object is seen: in each step one frame.

    Attributes:
        position, angle: standard deviations of the pose that is seen [m, rad].
        late: how many steps old frames are.
        dropped: the share of frames that do not come; the last one is seen again.

    Raises:
        InputError: for a negative standard deviation or age, or frames that never come.
    """

    position: float = 0.0
    angle: float = 0.0
    late: int = 0
    dropped: float = 0.0

    def __post_init__(self) -> None:
        for name in ("position", "angle"):
            if not (is_finite(getattr(self, name)) and getattr(self, name) >= 0):
                raise InputError(
                    "a standard deviation is 0 or more", key=f"eyes.{name}", value=getattr(self, name)
                )
        if self.late < 0 or not 0 <= self.dropped < 1:
            raise InputError(
                "frames are 0 or more steps late, and not all are dropped", key="eyes", value=self
            )


@dataclass(frozen=True, eq=False)
class PushTask:
    """What is asked of a learner in a scene.

    Attributes:
        scene: object, pusher (its fingers stay on the table), bounds and obstacles, goal tolerance.
        random: whether start, goal and hand are drawn for each episode within the bounds (else within 1.5
            sizes of the object of the scene's goal); if not, start and goal are the scene's.
        success: "pose", within the scene's goal_tolerance; or "coverage", where so much of the goal's area is covered.
        coverage: the share of the goal's area that is enough.
        noise: what differs from the scene in each episode; None: nothing.
        eyes: how the object is seen.
        rate: of decisions [Hz]. substeps: how many steps of the simulator each has.
        longest: how many decisions after which an episode is cut short.

    Raises:
        InputError: with the key, for a goal of any angle, or a value outside of what is said here.
    """

    scene: Scene
    random: bool = True
    success: Literal["pose", "coverage"] = "pose"
    coverage: float = 0.95
    noise: Noise | None = None
    eyes: Eyes = Eyes()
    rate: float = 10.0
    substeps: int = 10
    longest: int = int(10 * LENGTH_OF_EPISODE)

    def __post_init__(self) -> None:
        if self.scene.free_angle:
            raise InputError("a task has a goal with an angle", key="goal", value="free")
        if self.success not in ("pose", "coverage"):
            raise InputError("success is pose or coverage", key="success", value=self.success)
        for name, of in (("noise", Noise | None), ("eyes", Eyes), ("substeps", int), ("longest", int)):
            if not isinstance(getattr(self, name), of):
                what = "a whole number" if of is int else "fp.Noise or None" if name == "noise" else "Eyes"
                raise InputError(f"{name} is {what}", key=name, value=getattr(self, name))
        if not (is_finite(self.coverage) and 0 < self.coverage <= 1):
            raise InputError("a coverage is above 0 and at most 1", key="coverage", value=self.coverage)
        for name, least in (("rate", 0.0), ("substeps", 1), ("longest", 1)):
            value = getattr(self, name)
            if not (is_finite(value) and value >= least and value > 0):
                raise InputError("a positive number is needed", key=name, value=value)

    @property
    def fingers(self) -> Array:
        """Fingertip centres in E, shape (1 or 2, 2)."""
        half = 0.5 * self.scene.pusher.spacing
        return np.zeros((1, 2)) if self.scene.pusher.fingers == 1 else np.array([[0.0, half], [0.0, -half]])

    @property
    def turns(self) -> bool:
        """Whether the hand turns as well: of two fingers."""
        return self.scene.pusher.fingers == 2

    @property
    def limits(self) -> Array:
        """Greatest velocity (x, y, and yaw rate of a hand that turns) [m/s, rad/s]."""
        speed = self.scene.pusher.speed
        return np.array([speed, speed, self.scene.pusher.turn_rate] if self.turns else [speed, speed])

    @property
    def box(self) -> tuple[Array, Array]:
        """Where hands may be, lower and upper corner, each (2,) [m]."""
        bounds = self.scene.workspace.bounds
        if bounds is not None:
            low, high = np.reshape(bounds, (2, 2))
            return low + self.scene.pusher.tip_radius, high - self.scene.pusher.tip_radius
        far = (FARTHEST + ROOM) * self.scene.object.outline.size
        return self.scene.goal_pose[:2] - far, self.scene.goal_pose[:2] + far

    @property
    def names(self) -> tuple[str, ...]:
        """Of the values of a state, in their order."""
        return (*STATE, "sin yaw", "cos yaw") if self.turns else STATE

    def drawn(self, rng: np.random.Generator) -> tuple[Scene, Array]:
        """An episode's scene, the object and its start as they are, and where the hand begins, X_WE (3,).

        Raises:
            InputError: if there is no room.
        """
        scene = self.scene
        if self.random:
            start, goal = (self._free(rng) for _ in range(2))
            scene = replace(scene, start=start, goal=goal)
        if self.noise is not None:
            scene = Disturbances(scene, self.noise).draw(rng)
        return scene, self._hand(rng, scene)

    def _free(self, rng: np.random.Generator) -> Array:
        """A pose at which the object is clear of bounds and obstacles by its clearance and the width of a finger."""
        outline, pusher = self.scene.object.outline, self.scene.pusher
        room = self.scene.planning.clearance + 2 * pusher.tip_radius + pusher.approach
        low, high = self.box
        if self.scene.workspace.bounds is None:
            less = ROOM * outline.size
            low, high = low + less, high - less
        for _ in range(TRIES):
            pose = np.append(rng.uniform(low, high), rng.uniform(-np.pi, np.pi))
            if self.free(self.shape(pose, room)):
                return pose
        raise InputError("there is no room for the object", key="workspace", value=outline.size)

    def _hand(self, rng: np.random.Generator, scene: Scene) -> Array:
        """A pose of the hand beside the object."""
        thing, pusher = scene.object, scene.pusher
        reach = float(np.max(np.linalg.norm(self.fingers, axis=1))) + pusher.tip_radius
        body, (low, high) = self.shape(scene.start_pose, pusher.approach), self.box
        middle, far = transform(scene.start_pose, thing.cof), thing.outline.radius_about(thing.cof)
        for _ in range(TRIES):
            away, angle = far * rng.uniform(0.5, 1.5) + reach, rng.uniform(-np.pi, np.pi)
            place = middle + rotate(angle, np.array([away, 0.0]))
            tips = shapely.MultiPoint(place + rotate(angle + np.pi, self.fingers)).buffer(pusher.tip_radius)
            if np.all((low <= place) & (place <= high)) and self.free(tips) and not tips.intersects(body):
                return np.append(place, wrap_angle(angle + np.pi))
        raise InputError("there is no room for the finger", key="workspace", value=reach)

    def shape(self, pose: Array, wider: float = 0.0) -> "shapely.Polygon":
        """The object at a pose X_WO (3,), wider all around by a distance [m]."""
        found = shapely.Polygon(transform(pose, self.scene.object.outline.polyline()))
        return found.buffer(wider) if wider else found

    def free(self, shape: "shapely.Geometry") -> bool:
        """Whether a shape is within the bounds and off the obstacles."""
        bounds = self.scene.workspace.bounds
        inside = bounds is None or shapely.box(*bounds).covers(shape)
        return bool(inside) and not any(
            shape.intersects(shapely.Polygon(o.polyline())) for o in self.scene.workspace.obstacles
        )

    def state(self, seen: Array, hand: Array, goal: Array) -> NDArray[np.float32]:
        """What is observed, (..., 10 or 12), of X_WO as seen, X_WE of the hand and X_WO of the goal, each (..., 3)."""

        def ends(X: Array) -> list[Array]:
            return [X[..., 0], X[..., 1], np.sin(X[..., 2]), np.cos(X[..., 2])]

        yaw = [np.sin(hand[..., 2]), np.cos(hand[..., 2])] if self.turns else []
        return np.stack([*ends(seen), hand[..., 0], hand[..., 1], *ends(goal), *yaw], axis=-1).astype(
            np.float32
        )

    def error(self, pose: Array, goal: Array) -> Array:
        """Distance [m] and angle [rad] of each pose from its goal, shape (..., 2); pose, goal: X_WO, shape (..., 3)."""
        off = pose[..., :2] - goal[..., :2]
        turn = np.abs(wrap_angle(pose[..., 2] - goal[..., 2]))
        return np.stack([np.hypot(off[..., 0], off[..., 1]), turn], axis=-1)

    def farthest(self, pose: Array, goal: Array) -> Array:
        """How far the farthest corner is from its place at the goal, (...) [m]; pose, goal: X_WO, shape (..., 3)."""
        corners = self.scene.object.outline.polyline()
        away = transform(pose[..., None, :], corners) - transform(goal[..., None, :], corners)
        return np.max(np.linalg.norm(away, axis=-1), axis=-1)

    def solved(self, pose: Array, goal: Array) -> Array:
        """Whether each pose is at its goal, shape (...); pose, goal: X_WO, shape (..., 3)."""
        if self.success == "coverage":
            flat = zip(pose.reshape(-1, 3), goal.reshape(-1, 3), strict=True)
            return np.reshape([self.covered(X, G) >= self.coverage for X, G in flat], pose.shape[:-1])
        off = np.abs(pose - goal)
        off[..., 2] = np.abs(wrap_angle(off[..., 2]))
        return np.all(off <= self.scene.planning.goal_tolerance, axis=-1)

    def covered(self, pose: Array, goal: Array) -> float:
        """The share of the goal's area that the object covers; pose, goal: X_WO, shape (3,)."""
        there = self.shape(goal)
        return float(there.intersection(self.shape(pose)).area / there.area)

    @cached_property
    def _shares(self) -> Array:
        """Of the way of a decision at its poses, (substeps + 1, 1)."""
        return np.linspace(0.0, 1.0, self.substeps + 1)[:, None]

    def moved(self, hand: Array, action: Array) -> Array:
        """Poses X_WE of the hand in a decision, shape (..., substeps + 1, 3).

        Args:
            hand: X_WE at its begin, shape (..., 3).
            action: a fraction of the limits, -1 to 1, for each velocity.

        The hand goes straight and stays in its box; no fingertip is faster than the pusher's speed.
        """
        action = np.clip(np.asarray(action, dtype=float), -1.0, 1.0) * self.limits
        length = np.linalg.norm(action[..., :2], axis=-1, keepdims=True)
        velocity = action[..., :2] * np.minimum(1.0, self.scene.pusher.speed / np.maximum(length, 1e-12))
        turn = action[..., 2:] if self.turns else np.zeros_like(action[..., :1])
        low, high = self.box
        end = hand + np.concatenate([velocity, turn], axis=-1) / self.rate
        end[..., :2] = np.clip(end[..., :2], low, high)
        return hand[..., None, :] + self._shares * (end - hand)[..., None, :]
