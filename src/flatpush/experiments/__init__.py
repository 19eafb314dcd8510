"""The paper's figures and the project's measurements, one file each; each prints its table and may draw its figure."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from ..errors import InputError

EXPERIMENTS = {
    "fig3": "two paths of a single-finger push (paper, Fig. 3)",
    "sugar-box": "two queries of planning-through-contact",
    "open-loop": "where open-loop plans end under each model, from arcs and from samples",
}


def experiment(name: str) -> Callable[[Path | None], str]:
    """The experiment of a name: a function that takes a folder for figures, or None, and returns its table."""
    if name not in EXPERIMENTS:
        raise InputError(
            "there is no such experiment", value=name, hint=f"There are: {', '.join(sorted(EXPERIMENTS))}."
        )
    run: Callable[[Path | None], str] = import_module(f"flatpush.experiments.{name.replace('-', '_')}").run
    return run
