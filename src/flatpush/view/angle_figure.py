"""The picture of a comparison: the mean twist-angle error of every model in every experiment, with its interval."""

from pathlib import Path

import numpy as np

from ..friction.cross_validation import Judgement, interval
from ..geometry.pose import Array
from . import drawing as d
from . import palette
from .angle_table import Judged
from .drawing import MARKS, PAGE, SOFT, Drawing, Look
from .legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
from .panel import BOTTOM
from .picture import check_ending, save_picture
from .rows import names_width, row_axes

ROW = 38.0  # height of a row [pt]
COLOURS = (
    palette.PUSHES[1],
    palette.GOAL,
    palette.PUSHES[0],
    palette.PUSHES[2],
    palette.PUSHER,
    palette.PUSHES[4],
)


def angle_figure(judged: Judged, path: str | Path, *, title: str, subtitle: str = "") -> None:
    """Draws means with 95 % intervals as ".svg" or ".png", experiments from the top and their mean at the bottom.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    check_ending(path)
    save_picture(draw_angles(judged, title, subtitle), path)


def draw_angles(judged: Judged, title: str, subtitle: str = "") -> Drawing:
    """The same as a drawing."""
    models = list(dict.fromkeys(model for row in judged.values() for model in row))
    rows = {name: {m: [j] for m, j in row.items()} for name, row in judged.items()}
    if len(judged) > 1:
        rows["all, equally"] = {m: [row[m] for row in judged.values() if m in row] for m in models}
    looks = dict(zip(models, zip(COLOURS, MARKS, strict=True), strict=False))
    entries = [Entry(m, Look(looks[m][0], 1.4), "line and dot", mark=looks[m][1]) for m in models]
    ranges = {(name, m): _range(found) for name, row in rows.items() for m, found in row.items()}
    top = title_height(title, subtitle) + 4
    left, bottom = EDGE + names_width(list(rows)), top + ROW * len(rows)
    page = Drawing(PAGE, bottom + BOTTOM + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, bottom + BOTTOM, PAGE - 2 * EDGE)
    most = 1.06 * max(float(values.max()) for values in ranges.values())
    label = "angle between predicted and measured twist [°]: mean with 95 % interval, | median"
    panel = row_axes(page, (left, top, PAGE - EDGE, bottom), list(rows), most, label)
    if len(judged) > 1:
        panel.line(np.array([[0.0, 1.5 - len(rows)], [most, 1.5 - len(rows)]]), Look(SOFT, 0.7), 1)
    for place, (name, row) in enumerate(rows.items()):
        for k, model in enumerate(m for m in models if m in row):
            y = -place - 0.18 * (k - (len(row) - 1) / 2)
            colour, kind = looks[model]
            low, high, mean, median = ranges[name, model].tolist()
            panel.line(np.array([[low, y], [high, y]]), Look(colour, 1.4), 3)
            panel.line(np.array([[median, y - 0.08], [median, y + 0.08]]), Look(colour, 1.6), 4)
            page.add(d.mark(kind, panel.at(np.array([mean, y])), 2.6, Look("#ffffff", 0.5, fill=colour)), 5)
    return page


def _range(found: list[Judgement]) -> Array:
    """Low and high end of the interval, mean and median [°]."""
    means, medians = (np.mean([getattr(j, what) for j in found]) for what in ("mean", "median"))
    return np.degrees([*interval(found, np.mean), means, medians])
