"""The picture of a comparison: the mean twist-angle error of every model in every experiment, with its interval."""

from pathlib import Path

import numpy as np

from ..documents.atomic import write_atomically
from ..friction.cross_validation import interval
from . import palette
from .angle_table import Judged
from .canvas import SOFT, drawing_style, figure_bytes, headline, legend_below, new_figure
from .figure import check_ending

ENDINGS = (".svg", ".png")
COLOURS = (
    palette.PUSHES[1],
    palette.GOAL,
    palette.PUSHES[0],
    palette.PUSHES[2],
    palette.PUSHER,
    palette.PUSHES[4],
)
MARKS = "osD^vP"


def angle_figure(judged: Judged, path: str | Path, *, title: str, subtitle: str = "") -> None:
    """Draws means with 95 % intervals as ".svg" or ".png", experiments from the top and their mean at the bottom.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    ending = check_ending(path, ENDINGS)
    models = list(dict.fromkeys(model for row in judged.values() for model in row))
    rows = {name: {m: [j] for m, j in row.items()} for name, row in judged.items()}
    if len(judged) > 1:
        rows["all, equally"] = {m: [row[m] for row in judged.values() if m in row] for m in models}
    with drawing_style():
        from matplotlib.lines import Line2D

        figure = new_figure(width=8.4, height=1.7 + 0.55 * len(rows))
        headline(figure, title, subtitle)
        looks = dict(zip(models, zip(COLOURS, MARKS, strict=True), strict=False))
        entries = []
        for model in models:
            colour, mark = looks[model]
            entries.append(
                Line2D([], [], color=colour, marker=mark, linewidth=1.4, markersize=5, label=model)
            )
        legend_below(figure, entries)
        axes = figure.add_subplot()
        for place, row in enumerate(rows.values()):
            for k, model in enumerate(m for m in models if m in row):
                y = place + 0.14 * (k - (len(row) - 1) / 2)
                colour, mark = looks[model]
                low, high = np.degrees(interval(row[model], np.mean))
                mean = np.degrees(np.mean([j.mean for j in row[model]]))
                median = np.degrees(np.mean([j.median for j in row[model]]))
                axes.plot([low, high], [y, y], color=colour, linewidth=1.4, solid_capstyle="butt")
                axes.plot(mean, y, mark, color=colour, markersize=5, mec="white", mew=0.5)
                axes.plot(median, y, "|", color=colour, markersize=6, mew=1.6)
        axes.set_yticks(range(len(rows)), list(rows))
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(left=0)
        axes.set_xlabel("angle between predicted and measured twist [°]: mean with 95 % interval, | median")
        axes.grid(True, axis="x", color="#ececec", linewidth=0.6)
        for edge in range(1, len(rows)):
            axes.axhline(
                edge - 0.5,
                color="#dddddd" if edge < len(rows) - 1 or len(judged) == 1 else SOFT,
                linewidth=0.6,
            )
        axes.tick_params(axis="y", length=0)
        axes.set_axisbelow(True)
        for side in ("top", "right", "left"):
            axes.spines[side].set_visible(False)
        write_atomically(path, figure_bytes(figure, ending, title))
