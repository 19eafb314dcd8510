"""The picture of recorded runs against what was predicted for them: every run a dot, every prediction a row."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..documents.atomic import write_atomically
from ..geometry.pose import Array
from . import palette
from .canvas import INK, SOFT, drawing_style, figure_bytes, headline, legend_below, new_figure
from .figure import check_ending

ENDINGS = (".svg", ".png")
MARKS = "osD^vP"


@dataclass(frozen=True, eq=False)
class ReplayRow:
    """The errors of one prediction.

    Attributes:
        label: at the left of the row; it may have two lines.
        names: what was pushed in each of n runs.
        errors: distance at the end [m], angle at the end [rad], mean distance over the run [m], shape (n, 3);
            nan where nothing is predicted.
    """

    label: str
    names: tuple[str, ...]
    errors: Array


COLUMNS = (
    ("distance at the end [mm]", 1000.0),
    ("angle at the end [°]", float(np.degrees(1.0))),
    ("mean over the run [mm]", 1000.0),
)


def replay_figure(
    rows: Sequence[ReplayRow], looks: Sequence[str], path: str | Path, *, title: str, subtitle: str = ""
) -> None:
    """Draws the rows from the top as ".svg" or ".png"; a bar is the mean of a row.

    Args:
        looks: names of what was pushed, in the order of the legend.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    ending = check_ending(path, ENDINGS)
    with drawing_style():
        from matplotlib.lines import Line2D

        figure = new_figure(width=10.0, height=1.6 + 0.48 * len(rows))
        headline(figure, title, subtitle)
        entries = [
            Line2D([], [], color=palette.push_colour(k), marker=MARKS[k], ls="", ms=5, label=name)
            for k, name in enumerate(looks)
        ]
        legend_below(
            figure, [*entries, Line2D([], [], color=INK, marker="|", ms=11, mew=1.8, ls="", label="mean")]
        )
        panels = figure.subplots(1, len(COLUMNS), sharey=True)
        for axes, (label, scale), values in zip(panels, COLUMNS, range(len(COLUMNS)), strict=True):
            for place, row in enumerate(rows):
                found = scale * row.errors[:, values]
                for k, name in enumerate(looks):
                    some = found[np.array(row.names) == name]
                    height = place + 0.13 * (k - (len(looks) - 1) / 2)
                    axes.plot(
                        some, np.full(len(some), height), MARKS[k], color=palette.push_colour(k), ms=3.6,
                        mec="white", mew=0.3, alpha=0.9, clip_on=False,
                    )  # fmt: skip
                axes.plot(np.mean(found), place, "|", color=INK, ms=20, mew=1.6, zorder=4)
            axes.set_xlim(left=0)
            axes.set_xlabel(label)
            axes.grid(True, axis="x", color="#ececec", linewidth=0.6)
            axes.set_axisbelow(True)
            axes.tick_params(axis="y", length=0)
            for edge in range(1, len(rows)):
                axes.axhline(edge - 0.5, color="#dddddd", linewidth=0.6)
            for side in ("top", "right", "left"):
                axes.spines[side].set_visible(False)
        panels[0].set_yticks(range(len(rows)), [row.label for row in rows], color=SOFT)
        panels[0].set_ylim(len(rows) - 0.5, -0.5)
        write_atomically(path, figure_bytes(figure, ending, title))
