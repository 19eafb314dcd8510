"""Where labels have room: never over each other, and over as little as possible of what is drawn."""

from collections.abc import Iterable

import numpy as np

from ..geometry.pose import Array
from .drawing import Box
from .panel import Panel


class Labels:
    """Boxes of labels in a panel, placed one after the other [pt].

    Args:
        panel: the axes.
        cloud: drawn points that labels should keep off, shape (n, 2).
    """

    def __init__(self, panel: Panel, cloud: Array) -> None:
        self._panel, self._cloud = panel, panel.at(cloud)
        self.boxes: list[Box] = []

    def place(self, width: float, height: float, middles: Iterable[Array], free: bool = False) -> Array:
        """The middle [pt] of a box of this size, the best of those offered; the earlier one of two equals.

        Args:
            middles: places on the page [pt] that would do, the best liked first.
            free: whether it may lie on what is drawn, as a number on its own line does.
        """
        left, top, right, bottom = self._panel.frame
        half = np.array([width, height]) / 2
        best, cost = None, np.inf
        for k, middle in enumerate(middles):
            low, high = middle - half, middle + half
            worse = 1e-3 * k + 1e4 * sum(_overlap((*low, *high), box) for box in self.boxes)
            worse += 1e3 * float(low[0] < left or low[1] < top or high[0] > right or high[1] > bottom)
            if not free and worse < cost:
                inside = np.all((self._cloud > low - 1.5) & (self._cloud < high + 1.5), axis=1)
                worse += np.count_nonzero(inside)
            if worse < cost:
                best, cost = middle, worse
        assert best is not None
        self.boxes.append((*(best - half), *(best + half)))
        return best


def beside(panel: Panel, corners: Array, width: float, height: float) -> list[Array]:
    """Places [pt] for a box around an outline (drawn corners): sixteen directions, near ones before far ones."""
    outline = panel.at(corners)
    found = []
    for gap in (4.0, 9.0, 16.0, 26.0):
        for angle in np.pi / 2 - np.arange(16) * np.pi / 8:
            side = np.array([np.cos(angle), -np.sin(angle)])
            reach = outline[np.argmax(outline @ side)]
            found.append(reach + side * (gap + 0.5 * np.array([width, height])))
    return found


def along(panel: Panel, path: Array, share: float = 0.5) -> list[Array]:
    """Places [pt] on the first part of a drawn path, then on circles about its first point."""
    places = panel.at(path)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    s = np.arange(0.0, share * way[-1] + 1e-9, 3.0)
    on = np.stack([np.interp(s, way, places[:, k]) for k in (0, 1)], axis=1)
    angles = np.arange(16) * np.pi / 8
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [*on, *(places[0] + radius * side for radius in (12.0, 20.0, 30.0, 45.0) for side in ring)]


def dense(line: Array, step: float) -> Array:
    """Points (m, 2) along a line (n, 2), no further apart than a step."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    s = np.linspace(0.0, way[-1], 1 + max(1, int(np.ceil(way[-1] / step))))
    return np.stack([np.interp(s, way, line[:, k]) for k in (0, 1)], axis=1)


def _overlap(a: Box, b: Box) -> float:
    """Whether two boxes share an area, and how much of it [pt²]."""
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return 0.0 if wide <= 0 or high <= 0 else 1.0 + wide * high
