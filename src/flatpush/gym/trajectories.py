"""Episodes for other readers: Gymnasium's steps as arrays, and rosbag2 files of standard ROS 2 messages."""

import io
import os
from pathlib import Path
from typing import Literal
from uuid import uuid4

import numpy as np

from ..documents import write_atomically
from ..execution.bag import McapLog
from ..execution.robot import State, Target
from ..execution.run import Cycle
from .demonstrations import Episode

Form = Literal["gymnasium", "mcap"]
FORMS: tuple[Form, ...] = ("gymnasium", "mcap")
ENDING = {"gymnasium": ".npz", "mcap": ".mcap"}


def save_episode(path: Path, form: Form, episode: Episode, rate: float, speed: float) -> None:
    """Writes an episode to a file that appears whole or not at all.

    "gymnasium": observations (n + 1, 10), actions (n, 2), rewards, terminations and truncations (n,), and the reset's
    seed, as a NumPy archive. "mcap": before each decision target, tool, twist and object, as `flatpush run --log` has
    them, and the outcome.

    Args:
        rate: of decisions [Hz]. speed: of the finger for an action of 1 [m/s].

    Raises:
        InputError: if the file cannot be written.
        MissingExtra: for "mcap" without its libraries.
    """
    if form == "mcap":
        _bag(path, episode, rate, speed)
        return
    count, buffer = len(episode.actions), io.BytesIO()
    np.savez_compressed(
        buffer,
        observations=np.concatenate([episode.states, episode.last[None]]).astype(np.float32),
        actions=episode.actions,
        rewards=episode.rewards,
        terminations=np.arange(count) == count - 1,
        truncations=np.zeros(count, dtype=bool),
        seed=episode.seed,
    )
    write_atomically(path, buffer.getvalue())


def _bag(path: Path, episode: Episode, rate: float, speed: float) -> None:
    part = path.with_name(f".{path.name}.{uuid4().hex[:8]}.part")
    states = np.concatenate([episode.states, episode.last[None]]).astype(float)
    poses = np.column_stack([states[:, :2], np.arctan2(states[:, 2], states[:, 3])])
    tips = np.column_stack([states[:, 4:6], np.zeros((len(states), 2))])
    try:
        with McapLog(part, "demonstration") as log:
            for k, action in enumerate(episode.actions):
                twist = np.array([*(speed * action), 0.0, 0.0])
                log.write(
                    Cycle(
                        k / rate,
                        Target((k + 1) / rate, tips[k + 1], twist),
                        State(tips[k], twist, k / rate),
                        poses[k],
                        "displaced" if k == episode.disturbed else "push",
                        0,
                        "plan",
                        0.0,
                        0.0,
                    )
                )
            log.end("completed")
        write_atomically(path, part.read_bytes())
    finally:
        part.unlink(missing_ok=True)


def numbered(folder: Path, form: Form, number: int) -> Path:
    """The file of an episode, a thousand in a folder, which is made."""
    path = folder / form / f"{number // 1000:03d}" / f"episode-{number:06d}{ENDING[form]}"
    os.makedirs(path.parent, exist_ok=True)
    return path
