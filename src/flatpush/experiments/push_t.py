"""Push-T solved by planning: seeds of gym_pusht/PushT-v0, the state observed, flatpush.gym.PushTPolicy acting.

Success is the environment's own: more than 95 % of the goal's area covered within its 300 control steps of 0.1 s.
"""

import sys
import time
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import MissingExtra
from ..geometry.pose import Array
from ..gym import PushTPolicy

SEEDS = (100000, 100500)


class Episode(NamedTuple):
    """One seed: whether it was solved, control steps taken, the last coverage, CPU seconds of each plan."""

    seed: int
    solved: bool
    steps: int
    coverage: float
    planning: list[float]


def episode(env: object, policy: PushTPolicy, seed: int) -> Episode:
    """Acts from the seed's start until the environment ends the episode."""
    observation, _ = env.reset(seed=seed)  # type: ignore[attr-defined]
    policy.reset()
    steps, over, took = 0, False, []
    while not over:
        plans, began = policy.plans, time.process_time()
        command = policy.act(observation)
        if policy.plans > plans:
            took.append(time.process_time() - began)
        observation, _, solved, late, told = env.step(command)  # type: ignore[attr-defined]
        steps, over = steps + 1, solved or late
    return Episode(seed, bool(solved), steps, float(told["coverage"]), took)


def run(folder: Path | None = None, seeds: tuple[int, int] | None = None) -> str:
    """The table for the seeds from the first up to, not with, the second."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the environment's own imports
        try:
            import gym_pusht  # noqa: F401
            import gymnasium
        except ImportError as error:
            raise MissingExtra("Push-T needs an extra: pip install 'flatpush[gym]'") from error
        env = gymnasium.make("gym_pusht/PushT-v0", obs_type="state")
        policy = PushTPolicy(env)
        first, last = SEEDS if seeds is None else seeds
        done = []
        for seed in range(first, last):
            done.append(e := episode(env, policy, seed))
            solved = "solved" if e.solved else "not solved"
            print(
                f"seed {seed}: {solved}, {e.steps} steps, {len(e.planning)} plans",
                file=sys.stderr,
                flush=True,
            )
    steps = np.sort([e.steps for e in done if e.solved])
    took = 1e3 * np.concatenate([e.planning for e in done])
    missed = [f"seed {e.seed} ends at a coverage of {e.coverage:.3f}" for e in done if not e.solved]
    counted = [_counted(steps, share * len(done)) for share in (0.5, 0.9, 1.0)]
    return "\n".join(
        [
            f"Push-T, seeds {first} to {last - 1}, state observed, one look before each push.",
            f"solved {len(steps)} of {len(done)}; half of all within {counted[0]} control steps of 0.1 s, 90 % within"
            f" {counted[1]}, all within {counted[2]}",
            f"{len(took)} plans of one push each: median {np.median(took):.0f} ms of CPU,"
            f" 90 % within {np.quantile(took, 0.9):.0f} ms, most {took.max():.0f} ms",
            *missed,
            "Published for 500 episodes from pixels: 63.8 % and 64.2 % solved (model card of lerobot/diffusion_pusht,"
            " its training and that of the original Diffusion Policy code).",
        ]
    )


def _counted(steps: Array, number: float) -> str:
    """Within how many steps so many episodes are solved."""
    wanted = int(np.ceil(number))
    return str(steps[wanted - 1]) if wanted <= len(steps) else "(never)"
