"""flatpush/Push-v0: an object of a scene is pushed to its goal on the table, for Gymnasium, one or many at a time."""

from collections.abc import Mapping
from dataclasses import fields
from os import PathLike
from typing import ClassVar, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import ArrayLike, NDArray

from ..arguments import finite, vector
from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Scene
from ..simulation.plant import Plant
from .drawing import SIZE, drawn
from .task import PushTask

Observation = NDArray[np.float32] | NDArray[np.uint8]
Info = dict[str, Array]
Flags = NDArray[np.bool_]
ID = "flatpush/Push-v0"
ACTIONS = "actions are finite numbers"
MOST = 1e3  # of the values of a state [m]


def task_of(scene: Scene | str | PathLike[str] | PushTask, options: Mapping[str, object]) -> PushTask:
    """A task by its scene or the scene's file, with fields of PushTask by their names.

    Raises:
        InputError: for a file that holds no scene, and an option that is none.
    """
    if isinstance(scene, PushTask):
        if options:
            raise InputError("a task has its options", value=sorted(options))
        return scene
    if not isinstance(scene, Scene):
        from ..documents import load_scene

        scene = load_scene(scene)
    known = {field.name for field in fields(PushTask)} - {"scene"}
    if unknown := sorted(set(options) - known):
        raise InputError(f"options of {ID} are {', '.join(sorted(known))}", value=unknown)
    return PushTask(scene, **options)  # type: ignore[arg-type]  # checked by PushTask


class PushEnv(gymnasium.Env[Observation, Array]):
    """The environment.

    Actions are velocities of the hand in W in parts of the pusher's limits, from -1 to 1: (x, y), and the yaw rate of
    two fingers. Observations are the state (see PushTask.names; metres) or, with observation="image", a picture of the
    table from above (96 × 96 × 3). The reward is by how much the outline's farthest corner came nearer to its place
    [m / size of the object], and 1 at the goal. An episode ends at the goal (info "is_success"), where the object
    touches an obstacle or leaves the bounds ("collision"), or where the simulator cannot go on ("stopped"), and is cut
    short after PushTask.longest decisions.

    Args:
        scene: a scene, its file, or a whole PushTask.
        observation: "state" or "image".
        render_mode: "rgb_array" or None.
        options: fields of PushTask.

    Raises:
        InputError: as task_of, and for another observation or render mode.
    """

    metadata: ClassVar[dict[str, object]] = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(
        self,
        scene: Scene | str | PathLike[str] | PushTask,
        observation: Literal["state", "image"] = "state",
        render_mode: str | None = None,
        **options: object,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise InputError("pictures are drawn as rgb_array", key="render_mode", value=render_mode)
        self.render_mode, self._many = render_mode, PushVectorEnv(scene, 1, observation, **options)
        self.task = self._many.task
        self.observation_space = self._many.single_observation_space
        self.action_space = self._many.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[Observation, Info]:
        """A new episode. Options: start, goal and hand, poses (3,), instead of what is drawn."""
        super().reset(seed=seed)
        self._many.rngs = [self.np_random]
        self._many.begin(0, options or {})
        return self._many.observed()[0], self._info()

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, Info]:
        """One decision."""
        reward, ended, cut = self._many.advance(finite(action, ACTIONS)[None])
        return self._many.observed()[0], float(reward[0]), bool(ended[0]), bool(cut[0]), self._info()

    def displace(self, displacement: Array) -> Observation:
        """Moves the object by (x, y, θ), shape (3,) [m, m, rad], as by a knock; what is seen then."""
        self._many.knock(0, displacement)
        return self._many.observed()[0]

    def render(self) -> NDArray[np.uint8] | None:
        """The table from above, (96, 96, 3)."""
        return self._many.picture(0) if self.render_mode == "rgb_array" else None

    def _info(self) -> Info:
        return {name: values[0] for name, values in self._many.told().items()}


class PushVectorEnv(VectorEnv[Observation, Array, Array]):
    """Many of them at once, in one call of the simulator; ended ones begin anew in the next step.

    Args:
        num_envs: how many. Others as of PushEnv.
    """

    metadata: ClassVar[dict[str, object]] = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_fps": 10}

    def __init__(
        self,
        scene: Scene | str | PathLike[str] | PushTask,
        num_envs: int,
        observation: Literal["state", "image"] = "state",
        **options: object,
    ) -> None:
        if observation not in ("state", "image"):
            raise InputError("the observation is state or image", key="observation", value=observation)
        self.task, self.num_envs, self._image = task_of(scene, options), num_envs, observation == "image"
        task = self.task
        count = len(task.names)
        state = spaces.Box(-MOST, MOST, (count,), np.float32)
        picture = spaces.Box(0, 255, (SIZE, SIZE, 3), np.uint8)
        self.single_observation_space = picture if self._image else state
        self.single_action_space = spaces.Box(-1.0, 1.0, task.limits.shape, np.float32)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, num_envs)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, num_envs)
        thing = task.scene.object
        self._plant = Plant(thing, task.fingers, task.scene.pusher.tip_radius)
        self.rngs = [np.random.default_rng(k) for k in range(num_envs)]
        self.scenes = [task.scene] * num_envs
        self.object, self.hand, self.goal = (np.zeros((num_envs, 3)) for _ in range(3))
        self._frames = np.zeros((num_envs, 1 + task.eyes.late, 3))
        self._friction, self._cofs = np.full(num_envs, thing.friction), np.tile(thing.cof, (num_envs, 1))
        self._surfaces = [self._plant.surface] * num_envs
        self._steps = np.zeros(num_envs, dtype=int)
        self._done = np.zeros(num_envs, dtype=bool)
        self._far = np.zeros(num_envs)
        self._collision, self._stopped = (np.zeros(num_envs, dtype=bool) for _ in range(2))

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, object] | None = None
    ) -> tuple[Observation, dict[str, Array]]:
        """New episodes; environment k has the seed plus k."""
        if not isinstance(seed, list):
            seed = [None if seed is None else seed + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"there is one seed for each of {self.num_envs}", key="seed", value=seed)
        for k, own in enumerate(seed):
            if own is not None:
                self.rngs[k] = np.random.default_rng(own)
            self.begin(k, options or {})
        self._done[:] = False
        return self.observed(), self.told()

    def step(self, actions: Array) -> tuple[Observation, Array, Flags, Flags, dict[str, Array]]:
        """A decision of each; one that had ended begins anew instead, with no reward."""
        again = np.flatnonzero(self._done)
        reward, ended, cut = self.advance(finite(actions, ACTIONS), resting=self._done)
        for k in again.tolist():
            self.begin(k, {})
        reward[again], ended[again], cut[again] = 0.0, False, False
        self._done = ended | cut
        return self.observed(), reward, ended, cut, self.told()

    def begin(self, k: int, options: Mapping[str, object]) -> None:
        """A new episode of one environment; options as of PushEnv.reset.

        Raises:
            InputError: for an option that is none, and a pose that is none.
        """
        if unknown := sorted(set(options) - {"start", "goal", "hand"}):
            raise InputError("options of a reset are start, goal and hand", value=unknown)
        scene, hand = self.task.drawn(self.rngs[k])
        given = {name: _pose(value, name) for name, value in options.items()}  # type: ignore[arg-type]  # checked there
        self.object[k], self.goal[k] = (
            given.get("start", scene.start_pose),
            given.get("goal", scene.goal_pose),
        )
        self.hand[k] = given.get("hand", hand)
        self.scenes[k] = scene
        self._friction[k], self._cofs[k] = scene.object.friction, scene.object.cof
        if scene.object is not self.task.scene.object and scene.object.surface is not None:
            self._surfaces[k] = scene.object.surface
        self._steps[k], self._collision[k], self._stopped[k] = 0, False, False
        self._far[k] = self.task.farthest(self.object[k], self.goal[k])
        self._frames[k] = self._seen(self.object[k], self.rngs[k])

    def advance(
        self, actions: Array, resting: NDArray[np.bool_] | None = None
    ) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
        """Rewards, and which episodes have ended or are cut short, each (n,), after actions (n, 2 or 3)."""
        task, size = self.task, self.task.scene.object.outline.size
        shape = (self.num_envs, *task.limits.shape)
        if actions.shape != shape:
            raise InputError(f"{ACTIONS}, shape {shape[1:]} for each of {shape[0]}", value=actions)
        hands = task.moved(self.hand, actions)
        if resting is not None:
            hands[resting] = self.hand[resting, None]
        other = any(surface is not self._plant.surface for surface in self._surfaces)
        runs = self._plant.many(
            self.object,
            hands,
            friction=self._friction,
            cofs=self._cofs,
            surfaces=self._surfaces if other else None,
        )
        self._stopped = runs.outcome != 0
        self.object, self.hand = runs.final.copy(), hands[:, -1].copy()
        self._steps += 1
        self._collision = self._collided()
        solved = task.solved(self.object, self.goal)
        far = task.farthest(self.object, self.goal)
        reward = (self._far - far) / size + solved
        self._far = far
        self._see()
        ended = solved | self._stopped | self._collision
        return reward, ended, (self._steps >= task.longest) & ~ended

    def knock(self, k: int, displacement: Array) -> None:
        """Moves the object of one environment by (x, y, θ), shape (3,) [m, m, rad]."""
        self.object[k] += _pose(displacement, "displacement")
        self._frames[k] = self._seen(self.object[k], self.rngs[k])
        self._far[k] = self.task.farthest(self.object[k], self.goal[k])

    def told(self) -> dict[str, Array]:
        """Of each: pose of the object as it is, its error (m, rad), success, collision, stop."""
        return {
            "pose": self.object.copy(),
            "error": self.task.error(self.object, self.goal),
            "is_success": self.task.solved(self.object, self.goal),
            "collision": self._collision.copy(),
            "stopped": self._stopped.copy(),
        }

    def observed(self) -> Observation:
        """Of each the state as seen, or a picture."""
        if self._image:
            return np.stack([self.picture(k) for k in range(self.num_envs)])
        return self.task.state(self._frames[:, 0], self.hand, self.goal)

    def picture(self, k: int) -> NDArray[np.uint8]:
        """The table of one environment as it is."""
        return drawn(self.task, self.object[k], self.hand[k], self.goal[k])

    def _collided(self) -> NDArray[np.bool_]:
        workspace = self.task.scene.workspace
        if workspace.bounds is None and not workspace.obstacles:
            return np.zeros(self.num_envs, dtype=bool)
        return np.array([not self.task.free(self.task.shape(pose)) for pose in self.object])

    def _see(self) -> None:
        """One more frame of each."""
        eyes = self.task.eyes
        if not (eyes.position or eyes.angle or eyes.late or eyes.dropped):
            self._frames = self.object[:, None].copy()
            return
        for k, rng in enumerate(self.rngs):
            lost = eyes.dropped > 0 and rng.random() < eyes.dropped
            new = self._frames[k, -1] if lost else self._seen(self.object[k], rng)
            self._frames[k] = np.concatenate([self._frames[k, 1:], new[None]])

    def _seen(self, pose: Array, rng: np.random.Generator) -> Array:
        eyes = self.task.eyes
        if not (eyes.position or eyes.angle):
            return pose.copy()
        return pose + rng.standard_normal(3) * [eyes.position, eyes.position, eyes.angle]


def _pose(value: ArrayLike, name: str) -> Array:
    return vector(value, 3, f"the {name} is three finite numbers")
