"""Blocks of made-up episodes, which take no time: what writes data sets is tried with them."""

import time

import numpy as np

from flatpush.gym.demonstrations import Block, Episode
from flatpush.problem import Scene


def quick(scene: Scene, seed: int, number: int) -> Block:
    """Two episodes of random numbers, the same for the same arguments."""
    rng = np.random.default_rng([seed, number])
    episodes = []
    for n in (3, 5):
        states = rng.normal(size=(n + 1, 10)).astype(np.float32)
        actions = rng.uniform(-1, 1, (n, 2)).astype(np.float32)
        own = int(rng.integers(1000))
        episodes.append(
            Episode(own, number, states[:n], actions, rng.normal(size=n), -1, np.zeros(3), states[n])
        )
    return Block(scene, tuple(episodes), 2)


def stuck_at_last(scene: Scene, seed: int, number: int) -> Block:
    """Two such blocks, and then one that takes minutes."""
    if number > 1:
        time.sleep(200)
    return quick(scene, seed, number)
