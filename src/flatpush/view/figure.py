"""Saves the picture or the animation of a plan; the ending of the file name says which."""

from collections.abc import Sequence
from pathlib import Path

from ..documents.atomic import write_atomically
from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Plan, Rollout
from .picture import check_ending, encoded

ENDINGS = (".svg", ".png", ".gif", ".html")


def save_figure(
    plan: Plan, path: str | Path, rollouts: Sequence[Rollout] = (), explored: Array | None = None
) -> None:
    """Draws a plan into a file, whole or not at all.

    Args:
        plan: solved or not; without a plan the figure shows start, goal and the reason.
        path: ends in .svg or .png (a picture), .gif (an animation) or .html (one to play with, in one file).
        rollouts: simulated runs of this plan, drawn over it in red dashes.
        explored: Planner.explored, paths of the search tree, shape (m, samples, 2) [m], drawn faintly into a picture.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    check_figure(path)
    ending = Path(path).suffix.lower()
    if ending == ".gif":
        from .gif import draw_gif

        content = draw_gif(plan, rollouts)
    elif ending == ".html":
        from .page import draw_page

        content = draw_page(plan, rollouts).encode("utf-8")
    else:
        from .plan_figure import draw_plan

        content = encoded(draw_plan(plan, rollouts, explored), ending)
    write_atomically(path, content)


def check_figure(path: str | Path) -> None:
    """Refuses a name that save_figure could not write to, so that a long computation need not end with that.

    Raises:
        InputError: if the ending is none of save_figure's, or the folder does not exist.
    """
    check_figure_at(path, ENDINGS)


def check_figure_at(path: str | Path, endings: tuple[str, ...]) -> None:
    """The same for a figure with other endings."""
    check_ending(path, endings)
    target = Path(path)
    if target.is_dir():
        raise InputError("this is a folder, not a file", source=str(path))
    if not target.parent.is_dir():
        raise InputError("the folder of this file does not exist", source=str(path), hint="Create it first.")
