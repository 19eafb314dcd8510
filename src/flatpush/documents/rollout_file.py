"""Writes what the simulator saw."""

import os
from collections.abc import Sequence

from ..problem import Rollout
from .atomic import write_atomically
from .plan_file import as_text, finite_list


def save_rollouts(rollouts: Sequence[Rollout], path: str | os.PathLike[str]) -> None:
    """Writes {"flatpush": "rollouts/1", "rollouts": [...]}, JSON in SI, whole or not at all.

    The keys of each are the attributes of Rollout.

    Raises:
        InputError: if the file cannot be written or a number is not finite.
    """
    document = {"flatpush": "rollouts/1", "rollouts": [rollout_document(rollout) for rollout in rollouts]}
    write_atomically(path, as_text(document))


def rollout_document(rollout: Rollout) -> dict[str, object]:
    """The rollout as a mapping of plain values in SI."""
    arrays = ("final_pose", "times", "object", "pusher")
    return {
        "outcome": rollout.outcome,
        "seed": rollout.seed,
        **{name: finite_list(getattr(rollout, name), name) for name in arrays},
        "modes": list(rollout.modes),
    }
