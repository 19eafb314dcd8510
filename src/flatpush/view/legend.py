"""What stands around the axes: the title above them, the legend below."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..geometry.pose import Array
from . import drawing as d
from .drawing import INK, PAGE, SOFT, Box, Drawing, Look
from .panel import BOTTOM, LEFT, frame_for

LINE = 14.0  # height of a line of the legend [pt]
SIZE = 8.0
_SYMBOL, _GAP = 20.0, 16.0
TITLE, SUBTITLE = 11.5, 9.0
EDGE = 8.0  # border of the page [pt]


@dataclass(frozen=True)
class Entry:
    """A line of the legend: a symbol and what it stands for; with signs it is two dots, one with + and one with −.

    mark: the kind of a dot, as d.mark has it.
    """

    label: str
    look: Look
    symbol: Literal["line", "box", "dot", "line and dot", "mass"] = "line"
    signs: bool = False
    mark: str = "o"

    @property
    def width(self) -> float:
        return _SYMBOL + 5 + d.text_width(self.label, SIZE)


def title_height(title: str, subtitle: str, width: float = d.PAGE) -> float:
    """Room that the title and the line below it need [pt]."""
    return EDGE + sum(step for _, _, step, _ in _title_lines(title, subtitle, width)) + 6


def draw_title(page: Drawing, title: str, subtitle: str) -> None:
    """Bold and plain lines at the top left; long ones are wrapped."""
    y = EDGE
    for line, size, step, bold in _title_lines(title, subtitle, page.width):
        y += step
        page.add(d.Text(EDGE, y - 0.25 * step, line, size, INK if bold else SOFT, bold=bold), 20)


def legend_height(entries: Sequence[Entry], width: float) -> float:
    """Room that the legend needs [pt]."""
    return LINE * len(_rows(entries, width)) if entries else 0.0


def frame_and_legend(
    box: Box, entries: Sequence[Entry], top: float, highest: float = 330.0
) -> tuple[Box, tuple[float, float, float]]:
    """The frame of axes that show a box, and where their legend is: left, top, width [pt].

    Axes that are too high to be as wide as the page have it at their right instead of an empty margin.
    """
    full = PAGE - LEFT - 2 * EDGE
    frame = frame_for(box, EDGE + LEFT, top, full, 110.0, highest)
    if not entries or frame[2] - frame[0] >= 0.9 * full:
        return frame, (EDGE, frame[3] + BOTTOM + 4, PAGE - 2 * EDGE)
    width = max(entry.width for entry in entries)
    frame = frame_for(box, EDGE + LEFT, top, full - width - 16.0, 110.0, 1.15 * highest)
    return frame, (frame[2] + 16.0, top, width)


def draw_legend(page: Drawing, entries: Sequence[Entry], left: float, top: float, width: float) -> None:
    """The entries by rows, in as many columns as fit, at most four."""
    rows = _rows(entries, width)
    if not rows:
        return
    wide = [max(row[k].width for row in rows if k < len(row)) for k in range(len(rows[0]))]
    for r, row in enumerate(rows):
        x, y = left, top + LINE * (r + 0.5)
        for entry, room in zip(row, wide, strict=False):
            _draw_symbol(page, entry, x, y)
            text = d.shortened(entry.label, SIZE, width - _SYMBOL - 5)
            page.add(d.Text(x + _SYMBOL + 5, y + 2.9, text, SIZE, INK), 20)
            x += room + _GAP


def _rows(entries: Sequence[Entry], width: float) -> list[list[Entry]]:
    """Entries in columns, filled downwards; rows of them."""
    for columns in (4, 3, 2, 1):
        height = -(-len(entries) // columns)
        stacks = [list(entries[k : k + height]) for k in range(0, len(entries), height)] if entries else []
        if columns == 1 or sum(max(e.width for e in s) for s in stacks) + _GAP * (len(stacks) - 1) <= width:
            return [[s[r] for s in stacks if r < len(s)] for r in range(height)]
    return []


def _draw_symbol(page: Drawing, entry: Entry, x: float, y: float) -> None:
    look = entry.look
    if entry.symbol == "box":
        corners = np.array([[x, y - 4], [x + _SYMBOL, y - 4], [x + _SYMBOL, y + 4], [x, y + 4]])
        page.add(d.Line(corners, look, closed=True), 20)
    if entry.symbol in ("line", "line and dot"):
        page.add(d.Line(np.array([[x, y], [x + _SYMBOL, y]]), look), 20)
    if entry.symbol == "mass":
        draw_mass(page, np.array([x + _SYMBOL / 2, y]), 3.4, 20)
    if entry.symbol in ("dot", "line and dot"):
        middle = np.array([x + _SYMBOL / 2, y])
        around = Look(look.stroke, 0.9, fill=look.fill or look.stroke)
        for sign, shift in (("+", -5.0), ("−", 5.0)) if entry.signs else (("", 0.0),):
            centre = middle + np.array([shift, 0.0])
            page.add(d.mark(entry.mark, centre, 3.4, around), 20)
            arms = {"+": ((1.7, 0.0), (0.0, 1.7)), "−": ((1.7, 0.0),), "": ()}[sign]
            for arm in arms:
                page.add(d.Line(np.stack([centre - arm, centre + arm]), Look(look.stroke, 0.9)), 20)


def draw_mass(page: Drawing, middle: Array, radius: float, z: float, clip: Box | None = None) -> None:
    """The centre of friction, as centres of mass are drawn."""
    page.add(d.Disc(middle, radius, Look(INK, 0.9, fill="#ffffff")), z, clip)
    for start in (0.0, np.pi):
        arc = d.arc_points(middle, radius, start, start + np.pi / 2)
        page.add(d.Line(np.concatenate([middle[None], arc]), Look(fill=INK), closed=True), z + 0.1, clip)


def _title_lines(title: str, subtitle: str, width: float) -> list[tuple[str, float, float, bool]]:
    room = width - 2 * EDGE
    return [(line, TITLE, 15.5, True) for line in d.wrapped(title, TITLE, room, bold=True)] + [
        (line, SUBTITLE, 12.5, False) for line in d.wrapped(subtitle, SUBTITLE, room)
    ]
