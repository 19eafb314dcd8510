"""Demonstrations for learners: episodes of our planner in flatpush/Push-v0, each replayed before it counts."""

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Object, Scene
from ..processes import processes
from ..simulation.noise import Noise
from .policy import PushPolicy
from .push import Observation, PushEnv, PushVectorEnv
from .task import Eyes, PushTask

BLOCK = 25  # episodes that are tried with one object
STRETCH = (0.85, 1.2)  # of each axis of an outline
FRICTION = (0.0, 0.3)  # between finger and object
DISTURBED = 0.3  # share of the episodes in which the object is displaced on the way
WHEN = (10, 150)  # decisions before that
DISPLACED = (0.004, 0.004, 0.1)  # standard deviations [m, m, rad]
AT_ONCE = 8  # blocks that a cluster is given
SAME = 1e-5  # states of a replay agree within this


Job = tuple[Scene, int, int]


@dataclass(frozen=True, eq=False)
class Episode:
    """A demonstration that leads to the goal, and did again when it was replayed; n decisions.

    Attributes:
        seed: of its reset. scene: index of the block whose scene it is in.
        states: as observed before each decision, shape (n, 10). actions: shape (n, 2).
        rewards: after each, shape (n,).
        disturbed: number of the decision before which the object was displaced; -1: none.
        displacement: by this in W, shape (3,) [m, m, rad].
        last: state after the last decision, shape (10,).
    """

    seed: int
    scene: int
    states: Array
    actions: Array
    rewards: Array
    disturbed: int
    displacement: Array
    last: Array


@dataclass(frozen=True, eq=False)
class Block:
    """Episodes of one object: a function of the scene, the seed and the block's number alone."""

    scene: Scene
    episodes: tuple[Episode, ...]
    tried: int


Spread = Callable[[Callable[[Job], Block], Sequence[Job]], Iterable[Block]]


def varied(scene: Scene, seed: int, number: int) -> Scene:
    """A scene whose object has other sides and another friction."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    stretch, friction = rng.uniform(*STRETCH, 2), float(rng.uniform(*FRICTION))
    thing = scene.object
    if not thing.support_word or thing.surface is not None:
        return replace(scene, object=replace(thing, friction=friction, uncertainty=None))
    outline = thing.outline.polyline() * (stretch[0] if thing.outline.is_circle else stretch)
    return replace(scene, object=Object(outline, thing.support_word, friction, name=thing.name))


def demonstrated(scene: Scene, seed: int, number: int) -> Block:
    """The episodes of a block that reach their goal, in the order of their seeds."""
    one = varied(scene, seed, number)
    task = PushTask(one, noise=Noise(0.0, 0.0, 0.1), eyes=Eyes(2e-4, 3e-3))
    env, policy, found = PushEnv(task), PushPolicy(task), []
    for k in range(BLOCK):
        own = int(np.random.SeedSequence(seed, spawn_key=(number, k)).generate_state(1)[0])
        episode = _tried(env, policy, own, number)
        if episode is not None:
            found.append(episode)
    again = replays(task, found)
    return Block(one, tuple(e for e, good in zip(found, again, strict=True) if good), BLOCK)


def blocks(
    scenes: Sequence[Scene], seed: int, first: int, workers: int | None = None, spread: Spread | None = None
) -> Generator[Block, None, None]:
    """Blocks from a number on, the scenes in turn, in order.

    Args:
        workers: how many processes make them; default: the cores.
        spread: makes several at once instead, as on a cluster.
    """
    number = first
    while spread is not None:
        jobs = [(scenes[n % len(scenes)], seed, n) for n in range(number, number + AT_ONCE)]
        yield from spread(_demonstrated, jobs)
        number += AT_ONCE
    count = workers or os.cpu_count() or 1
    if count == 1:
        while True:
            yield demonstrated(scenes[number % len(scenes)], seed, number)
            number += 1
    with processes(count) as pool:
        waiting = [
            pool.submit(demonstrated, scenes[n % len(scenes)], seed, n) for n in range(first, first + count)
        ]
        number = first + count
        while True:
            done = waiting.pop(0).result()
            waiting.append(pool.submit(demonstrated, scenes[number % len(scenes)], seed, number))
            number += 1
            yield done


def _demonstrated(job: Job) -> Block:
    return demonstrated(*job)


def replays(task: PushTask, episodes: Sequence[Episode]) -> list[bool]:
    """Whether the actions of each episode of a task lead through the same states to the goal again, all at once."""
    if not episodes:
        return []
    envs = PushVectorEnv(task, len(episodes))
    envs.reset(seed=[e.seed for e in episodes])
    lengths = np.array([len(e.actions) for e in episodes])
    good = np.ones(len(episodes), bool)
    for k in range(lengths.max()):
        runs = k < lengths
        actions = np.zeros((len(episodes), *task.limits.shape))
        for i in np.flatnonzero(runs).tolist():
            if k == episodes[i].disturbed:
                envs.knock(i, episodes[i].displacement)
            actions[i] = episodes[i].actions[k]
        seen = envs.observed()
        for i in np.flatnonzero(runs).tolist():
            good[i] &= np.max(np.abs(seen[i] - episodes[i].states[k])) <= SAME
        _, ended, _ = envs.advance(actions, resting=~runs)
        good[runs] &= ended[runs] == (k == lengths[runs] - 1)
        last = k == lengths - 1
        good[last] &= task.solved(envs.object, envs.goal)[last]
    return good.tolist()


def check_scenes(scenes: Sequence[Scene]) -> None:
    """Refuses scenes that no demonstration can be made of.

    Raises:
        InputError: for two fingers, or a goal without an angle.
    """
    for scene in scenes:
        if scene.pusher.fingers != 1:
            raise InputError("demonstrations are made with one finger", key="pusher.fingers", value=2)
        PushTask(scene)


def _tried(env: PushEnv, policy: PushPolicy, seed: int, number: int) -> Episode | None:
    rng = np.random.default_rng(seed)
    disturbed = int(rng.integers(*WHEN)) if rng.random() < DISTURBED else -1
    displacement = rng.standard_normal(3) * DISPLACED
    states: list[Observation] = []
    actions, rewards = [], []
    state, info = env.reset(seed=seed)
    policy.reset()
    ended = cut = False
    while not (ended or cut):
        if len(states) == disturbed:
            state = env.displace(displacement)
            policy.look()
        action = policy.act(state).astype(np.float32)
        states.append(state)
        actions.append(action)
        state, reward, ended, cut, info = env.step(action)
        rewards.append(reward)
    if not info["is_success"]:
        return None
    if disturbed >= len(states):
        disturbed = -1
    return Episode(
        seed,
        number,
        np.array(states),
        np.array(actions),
        np.array(rewards),
        disturbed,
        displacement,
        np.asarray(state, dtype=float),
    )
