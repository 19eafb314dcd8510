"""The paper's figures and the project's measurements, one file each; each prints its table and may draw its figure."""

import os
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path

from ..errors import InputError

EXPERIMENTS = {
    "duality": "cones, rotation centres, flat outputs of one finger (paper, Figs. 1 and 2, Proposition 1, Theorem 1)",
    "fig3": "two paths of a single-finger push (paper, Fig. 3)",
    "fig4": "feedback linearisation of a single-finger push, and what its numbers mean (paper, Fig. 4)",
    "fig6": "two fingers on a robot, in the physics cell: a rectangle on three feet (paper, Fig. 6; --runs, --seed)",
    "fig7": "the same with a rectangle on its edge (paper, Fig. 7)",
    "fig8": "the same with a butterfly (paper, Fig. 8)",
    "fig9": "the same with a triangle (paper, Fig. 9)",
    "sequences": "plans of Figs. 6-9, simulated many times with random starts and friction",
    "fig10": "the triangle among obstacles, and moments of its plan (paper, Figs. 10 and 11)",
    "sugar-box": "two queries of planning-through-contact",
    "open-loop": "where open-loop plans end under each model, from arcs and from samples",
    "cone": "two fingers with their composite cone against their virtual middle contact",
    "loops": "open loop against feedback, one finger on tables other than believed",
    "stored-graphs": "the authors' stored graphs against refined plans, on the robot's nine queries (--data)",
    "replay": "recorded runs of a robot through the simulator, calibrated and not (--data)",
    "crowded": "scenes full of obstacles, from a narrow passage to two hundred obstacles",
    "feedback": "random tasks of one finger under feedback, on another table than believed (--runs, --seed)",
    "push-t": "the learners' benchmark of pushing without friction, solved by planning (--seeds)",
    "force-pushes": "limit surfaces fitted to the recorded force pushes (--data)",
    "motion-pushes": "the same pushes without their forces: loads and friction from motion (--data)",
}
# Those that take a number of runs and a seed.
RANDOM = {"feedback", "fig6", "fig7", "fig8", "fig9"}
# Those that one file holds together.
TOGETHER = dict.fromkeys(("fig6", "fig7", "fig8", "fig9"), "robot_runs")
# Those that take a range of seeds.
SEEDED = {"push-t"}
# Those that need the folder of recorded data.
RECORDED = {"force-pushes", "motion-pushes", "replay", "stored-graphs"}


def experiment(
    name: str,
    data: Path | None = None,
    runs: int | None = None,
    seed: int | None = None,
    seeds: str | None = None,
) -> Callable[[Path | None], str]:
    """The experiment of a name: a function that takes a folder for figures, or None, and returns its table.

    Args:
        data: folder of the recorded data; default: that which the environment's FLATPUSH_DATA names.
        runs, seed: of an experiment with random runs; default: its own.
        seeds: "FIRST:END" for those that go through many; END is not one of them.

    Raises:
        InputError: if there is no such experiment, it needs recorded data and they are not there, or runs or seed make
            no sense.
    """
    if name not in EXPERIMENTS:
        raise InputError(
            "there is no such experiment", value=name, hint=f"There are: {', '.join(sorted(EXPERIMENTS))}."
        )
    module = TOGETHER.get(name, name.replace("-", "_"))
    run: Callable[..., str] = import_module(f"flatpush.experiments.{module}").run
    if name in TOGETHER:
        run = partial(run, figure=name)
    if runs is not None and runs < 1:
        raise InputError("there is at least one run", key="runs", value=runs)
    if seed is not None and seed < 0:
        raise InputError("a seed is 0 or more", key="seed", value=seed)
    if seeds is not None and name not in SEEDED:
        raise InputError(f"the experiment {name!r} takes no range of seeds", hint="Leave --seeds out.")
    if name in SEEDED:
        return run if seeds is None else partial(run, seeds=_range(seeds))
    folder = data if data is not None else os.environ.get("FLATPUSH_DATA")
    if name in TOGETHER and folder and Path(folder).is_dir():
        run = partial(run, data=Path(folder))
    if name in RANDOM:
        return partial(run, runs=runs, seed=seed)
    if runs is not None or seed is not None:
        raise InputError(f"the experiment {name!r} has no random runs", hint="Leave --runs and --seed out.")
    if name not in RECORDED:
        return run
    if not folder or not Path(folder).is_dir():
        raise InputError(
            f"the experiment {name!r} reads recorded data",
            value=None if folder is None else str(folder),
            hint="Name their folder with --data.",
        )
    return partial(run, data=Path(folder))


def _range(text: str) -> tuple[int, int]:
    first, _, end = text.partition(":")
    if not (first.isdigit() and end.isdigit() and int(first) < int(end)):
        raise InputError(
            "seeds are FIRST:END, two whole numbers, the first less than the second", key="seeds", value=text
        )
    return int(first), int(end)
