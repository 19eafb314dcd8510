"""Writes what a study of many runs found."""

import os
from dataclasses import asdict
from typing import Any

import numpy as np

from ..problem import Plan
from .atomic import write_atomically
from .plan_file import as_text, finite_list
from .scene_writer import goal_values


def save_runs(runs: Any, path: str | os.PathLike[str]) -> None:
    """Writes {"flatpush": "runs/1", "seed": …, "noise": {…}, "goal": […], "runs": [{…}, …]}, JSON in SI.

    If the name ends in .csv, one row a run instead. Whole or not at all.

    Each run has its start, friction, centre of friction (in O) and final pose, its outcome and whether all fingers
    stuck.

    Raises:
        InputError: if the file cannot be written or a number is not finite.
    """
    if os.fspath(path).lower().endswith(".csv"):
        write_atomically(path, _table(runs))
        return
    plan: Plan = runs.plan
    document = {
        "flatpush": "runs/1",
        "seed": runs.seed,
        "noise": asdict(runs.noise),
        "goal": goal_values(plan.scene),
        "runs": [_run(runs, k) for k in range(len(runs))],
    }
    write_atomically(path, as_text(document))


def _run(runs: Any, k: int) -> dict[str, Any]:
    return {
        "outcome": runs.outcomes[k],
        "sticking": bool(runs.sticking[k]),
        "start": finite_list(runs.starts[k], "start"),
        "friction": float(runs.frictions[k]),
        "centre": finite_list(runs.centres[k], "centre"),
        "final_pose": finite_list(runs.final[k], "final_pose"),
    }


def _table(runs: Any) -> str:
    head = "run,outcome,sticking,start_x[m],start_y[m],start_angle[rad],friction,centre_x[m],centre_y[m],"
    lines = [head + "final_x[m],final_y[m],final_angle[rad]"]
    for k in range(len(runs)):
        numbers = np.concatenate([runs.starts[k], [runs.frictions[k]], runs.centres[k], runs.final[k]])
        lines.append(
            f"{k},{runs.outcomes[k]},{int(runs.sticking[k])}," + ",".join(repr(float(x)) for x in numbers)
        )
    return "\n".join(lines) + "\n"
