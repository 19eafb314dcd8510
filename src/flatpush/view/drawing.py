"""A picture as a list of paths, discs and texts on a page, in points (1/72 inch), x to the right, y down.

Whatever is drawn goes through this list; svg.py and raster.py write it. It knows the box of every text, so that the
layout is the same in both and a test can ask whether two labels overlap.
"""

from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..geometry.pose import Array
from .letters import UNITS, WIDTHS

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

Box = tuple[float, float, float, float]  # xmin, ymin, xmax, ymax
Anchor = Literal["start", "middle", "end"]
INK, SOFT, GRID = "#1a1a1a", "#555555", "#ececec"
PAGE = 576.0  # width of a page [pt]: 8 inches
ASCENT, DESCENT = 0.76, 0.24  # of a line of DejaVu Sans, in sizes of the letters


@dataclass(frozen=True)
class Look:
    """How a path or a disc is drawn: stroke and fill are colours "#rrggbb", width and dash are in points.

    opacity is that of the stroke, fill_opacity that of the inside; hatch adds slanting lines in the stroke's colour.
    """

    stroke: str = ""
    width: float = 1.0
    dash: tuple[float, ...] = ()
    opacity: float = 1.0
    fill: str = ""
    fill_opacity: float = 1.0
    hatch: bool = False


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points (n, 2) [pt], closed or not."""

    points: Array
    look: Look
    closed: bool = False


@dataclass(frozen=True, eq=False)
class Disc:
    """A disc with its centre, shape (2,), and radius [pt]."""

    centre: Array
    radius: float
    look: Look


@dataclass(frozen=True)
class Text:
    """One line of letters; (x, y) is its anchor on the base line [pt], upright turns it by 90° to the left."""

    x: float
    y: float
    text: str
    size: float = 9.0
    colour: str = INK
    anchor: Anchor = "start"
    bold: bool = False
    halo: bool = False
    upright: bool = False

    @property
    def width(self) -> float:
        """Length of the line [pt]."""
        return text_width(self.text, self.size, self.bold)

    @property
    def box(self) -> Box:
        """What the letters cover [pt]."""
        before = {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor] * self.width
        if self.upright:
            return (
                self.x - ASCENT * self.size,
                self.y + before - self.width,
                self.x + DESCENT * self.size,
                self.y + before,
            )
        left = self.x - before
        return (left, self.y - ASCENT * self.size, left + self.width, self.y + DESCENT * self.size)


Item = Line | Disc | Text


class Drawing:
    """A page of the given size [pt], to which items are added in any order.

    Items are drawn by rising z, those of one z in the order in which they came; clip is the box outside of which an
    item is not seen.
    """

    def __init__(self, width: float, height: float, title: str) -> None:
        self.width, self.height, self.title = width, height, title
        self._items: list[tuple[float, Box | None, Item]] = []

    def add(self, item: Item, z: float = 0.0, clip: Box | None = None) -> None:
        """Adds an item."""
        self._items.append((z, clip, item))

    def items(self) -> list[tuple[Box | None, Item]]:
        """Clip and item, from the back to the front."""
        return [(clip, item) for _, clip, item in sorted(self._items, key=lambda entry: entry[0])]

    def texts(self) -> list[Text]:
        """The texts, from the back to the front."""
        return [item for _, item in self.items() if isinstance(item, Text)]


MARKS = "osD^vP"  # kinds of marks, as they are tried in turn: disc, square, diamond, triangles, cross


def mark(kind: str, middle: Array, radius: float, look: Look) -> Line | Disc:
    """A mark of a kind with its middle, shape (2,), and about that radius [pt]."""
    if kind == "o":
        return Disc(middle, radius, look)
    if kind == "P":
        arm, half = 1.1 * radius, 0.4 * radius
        corners = [(half, arm), (half, half), (arm, half)]
        turns = (np.array([[0, -1], [1, 0]]) for _ in range(4))
        quarter, points = np.array(corners), []
        for turn in turns:
            points.append(quarter)
            quarter = quarter @ turn
        return Line(middle + np.concatenate(points), look, closed=True)
    count, start, size = {"s": (4, 0.25, 1.25), "D": (4, 0.0, 1.3), "^": (3, -0.5, 1.3), "v": (3, 0.5, 1.3)}[
        kind
    ]
    angles = np.pi * (start + 2 * np.arange(count) / count)
    return Line(
        middle + size * radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), look, closed=True
    )


def arc_points(centre: Array, radius: float, start: float, end: float) -> Array:
    """Points on a circular arc between two angles [rad], one each 5°; shape (n, 2)."""
    n = 2 + int(abs(end - start) / np.radians(5.0))
    angles = np.linspace(start, end, n)
    return np.asarray(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def thinned(points: Array, step: float = 0.15) -> Array:
    """A line without points that lie closer to the last one kept than a step; ends are kept, shape (m, 2)."""
    if len(points) < 200:
        return points
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    kept = np.concatenate([[True], np.diff(np.floor(way / step)) > 0])
    kept[-1] = True
    return points[kept]


def shortened(text: str, size: float, room: float, bold: bool = False) -> str:
    """The text, or as much of its beginning as fits into the room [pt], and an ellipsis."""
    if text_width(text, size, bold) <= room:
        return text
    while text and text_width(text.rstrip() + "…", size, bold) > room:
        text = text[:-1]
    return text.rstrip() + "…"


def wrapped(text: str, size: float, room: float, bold: bool = False, most: int = 4) -> list[str]:
    """The text in lines that fit into the room [pt], at most so many, the last one shortened."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size, bold) <= room:
            lines[-1] = longer
        elif len(lines) < most:
            lines.append(word)
        else:
            lines[-1] = longer
            break
    return [shortened(line, size, room, bold) for line in lines]


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Length of a line of DejaVu Sans [pt]."""
    widths = WIDTHS[bold]
    try:
        return sum(widths[letter] for letter in text) * size / UNITS
    except KeyError:  # letters that our table has not
        return float(font(UNITS, bold).getlength(text)) * size / UNITS


@cache
def font(size: float, bold: bool = False) -> "FreeTypeFont":
    """DejaVu Sans, which comes with matplotlib, without importing matplotlib."""
    from PIL import ImageFont

    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.submodule_search_locations is not None
    folder = Path(spec.submodule_search_locations[0]) / "mpl-data" / "fonts" / "ttf"
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(folder / name), size, layout_engine=ImageFont.Layout.BASIC)
