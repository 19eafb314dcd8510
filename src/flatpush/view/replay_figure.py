"""The picture of recorded runs against what was predicted for them: every run a dot, every prediction a row."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..geometry.pose import Array
from . import drawing as d
from . import palette
from .drawing import INK, MARKS, PAGE, Drawing, Look
from .legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
from .panel import BOTTOM
from .picture import check_ending, save_picture
from .rows import names_width, row_axes

ROW = 36.0  # height of a row [pt]
COLUMNS = (
    ("distance at the end [mm]", 1000.0),
    ("angle at the end [°]", float(np.degrees(1.0))),
    ("mean over the run [mm]", 1000.0),
)


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


def replay_figure(
    rows: Sequence[ReplayRow], looks: Sequence[str], path: str | Path, *, title: str, subtitle: str = ""
) -> None:
    """Draws the rows from the top as ".svg" or ".png"; a bar is the mean of a row.

    Args:
        looks: names of what was pushed, in the order of the legend.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    check_ending(path)
    save_picture(draw_replay(rows, looks, title, subtitle), path)


def draw_replay(rows: Sequence[ReplayRow], looks: Sequence[str], title: str, subtitle: str = "") -> Drawing:
    """The same as a drawing."""
    dots = [Look("#ffffff", 0.4, fill=palette.push_colour(k), fill_opacity=0.9) for k in range(len(looks))]
    entries = [
        Entry(name, Look(palette.push_colour(k)), "dot", mark=MARKS[k]) for k, name in enumerate(looks)
    ]
    entries.append(Entry("mean", Look(INK, 1.8)))
    top, names = title_height(title, subtitle) + 6, [row.label for row in rows]
    left = EDGE + names_width(names)
    wide = (PAGE - EDGE - left + 14) / len(COLUMNS)
    bottom = top + ROW * len(rows)
    page = Drawing(PAGE, bottom + BOTTOM + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, bottom + BOTTOM, PAGE - 2 * EDGE)
    for column, (label, scale) in enumerate(COLUMNS):
        known = np.concatenate([row.errors[:, column] for row in rows])
        most = 1.06 * scale * max(float(np.nanmax(known)), 1e-9)
        x = left + wide * column
        panel = row_axes(page, (x, top, x + wide - 14, bottom), names, most, label, named=column == 0)
        for place, row in enumerate(rows):
            found = scale * row.errors[:, column]
            for k, name in enumerate(looks):
                height = -place - 0.13 * (k - (len(looks) - 1) / 2)
                for value in found[(np.array(row.names) == name) & np.isfinite(found)]:
                    page.add(d.mark(MARKS[k], panel.at(np.array([value, height])), 2.0, dots[k]), 3)
            mean = float(np.mean(found))
            panel.line(np.array([[mean, -place - 0.3], [mean, -place + 0.3]]), Look(INK, 1.6), 4)
    return page
