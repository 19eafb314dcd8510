"""Where a name has room beside an outline."""

from typing import Any

import numpy as np

from ..geometry.pose import Array


def room_for_label(axes: Any, corners: Array, cloud: Array) -> Array:
    """The middle of a short text [mm] right beside the outline, where it is furthest from what is drawn."""
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    gap = 0.014 * (x1 - x0)
    best, place = -np.inf, corners[0]
    for angle in np.pi / 2 - np.arange(16) * np.pi / 8:
        side = np.array([np.cos(angle), np.sin(angle)])
        middle = corners[np.argmax(corners @ side)] + gap * side * [3.2, 1.7]
        text = middle + gap * np.array([[-1.8, 0.0], [0.0, 0.0], [1.8, 0.0]])
        room = float(np.min(np.linalg.norm(cloud[:, None] - text, axis=2)))
        inside = x0 + 2.5 * gap < middle[0] < x1 - 2.5 * gap and y0 + gap < middle[1] < y1 - gap
        room = min(room, 3 * gap) - (0.0 if inside else 1e3 * gap)
        if room > best + 1e-9:
            best, place = room, middle
    return place


def along_edges(corners: Array) -> Array:
    """Points along the edges of a polygon, sixteen to an edge."""
    s = np.arange(16)[:, None, None] / 16
    return ((1 - s) * corners + s * np.roll(corners, -1, axis=0)).reshape(-1, 2)


def halo() -> dict[str, Any]:
    """What keeps a text readable over lines: a white border."""
    from matplotlib.patheffects import withStroke

    return {"path_effects": [withStroke(linewidth=2.5, foreground="white")]}
