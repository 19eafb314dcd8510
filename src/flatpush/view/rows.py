"""Axes in which each row has a name: what was predicted or tried, from the top downwards."""

from collections.abc import Sequence

import numpy as np

from . import drawing as d
from .drawing import GRID, SOFT, Box, Drawing, Look
from .panel import Panel

SIZE = 8.5  # of the names [pt]


def names_width(names: Sequence[str]) -> float:
    """Room at the left of the axes that the names need [pt]; a name may have several lines."""
    return max(d.text_width(line, SIZE) for name in names for line in name.split("\n")) + 10


def row_axes(
    page: Drawing, frame: Box, names: Sequence[str], most: float, label: str, named: bool = True
) -> Panel:
    """Axes from 0 to most in a frame [pt]; the middle of row k has the height -k, and each is one high."""
    panel = Panel(page, frame, (0.0, 0.5 - len(names), most, 0.5), equal=False)
    panel.axes(label, "", (True, False), rows=True)
    for k, name in enumerate(names):
        if k:
            panel.line(np.array([[0.0, 0.5 - k], [most, 0.5 - k]]), Look(GRID, 0.8), 0)
        lines = name.split("\n")
        for i, line in enumerate(lines if named else ()):
            y = float(panel.at(np.array([0.0, -k]))[1]) + 3.0 + 11.0 * (i - 0.5 * (len(lines) - 1))
            page.add(d.Text(frame[0] - 6, y, line, SIZE, SOFT, "end"), 20)
    return panel
