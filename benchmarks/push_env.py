"""flatpush/Push-v0: steps of the simulator in a second, many environments at once, and what the baseline solves.

    python benchmarks/push_env.py [SCENE] [--policy N]

Half of all hands go towards their object and half at random, so that they touch it about half of the time. Steps are
counted in CPU time and in seconds on the clock, with all cores. --policy: N episodes of the baseline.
"""

import sys
import time

import numpy as np

from flatpush.documents import load_scene
from flatpush.gym import PushPolicy, PushTask
from flatpush.gym.push import PushEnv, PushVectorEnv

MANY, DECISIONS = 512, 60


def speed(task: PushTask) -> None:
    env, rng = PushVectorEnv(task, MANY), np.random.default_rng(0)
    state, _ = env.reset(seed=0)
    env.step(np.zeros((MANY, len(task.limits))))  # compiles, if need be
    wall, cpu, moved = time.perf_counter(), time.process_time(), 0.0
    for _ in range(DECISIONS):
        actions = rng.uniform(-1, 1, (MANY, len(task.limits)))
        towards = state[:, :2] - state[:, 4:6]
        actions[::2, :2] = (towards / np.linalg.norm(towards, axis=1, keepdims=True))[::2]
        before = env.object.copy()
        state, *_ = env.step(actions)
        moved += np.mean(np.any(env.object != before, axis=1))
    steps = MANY * DECISIONS * task.substeps
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(
        f"{steps} steps of {MANY} environments, the object moving in {100 * moved / DECISIONS:.0f} %:"
        f" {steps / cpu:.0f} in a second of CPU, {steps / wall:.0f} in a second"
    )


def baseline(task: PushTask, episodes: int) -> None:
    env, policy, solved, lengths = PushEnv(task), PushPolicy(task), 0, []
    began = time.process_time()
    for seed in range(episodes):
        state, _ = env.reset(seed=seed)
        policy.reset()
        ended = cut = False
        count = 0
        while not (ended or cut):
            state, _, ended, cut, info = env.step(policy.act(state))
            count += 1
        solved += bool(info["is_success"])
        lengths.append(count)
    print(
        f"baseline: {solved} of {episodes} solved, {np.median(lengths):.0f} decisions in the median,"
        f" {(time.process_time() - began) / episodes:.2f} CPU s an episode"
    )


if __name__ == "__main__":
    words = sys.argv[1:]
    number = words.index("--policy") if "--policy" in words else None
    asked = PushTask(load_scene(words[0] if words and number != 0 else "examples/soap.yaml"))
    speed(asked)
    if number is not None:
        baseline(asked, int(words[number + 1]))
