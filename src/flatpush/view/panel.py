"""Axes on a page: from millimetres on the table to points on the page, with a grid and numbers."""

from collections.abc import Sequence

import numpy as np

from ..geometry.pose import Array
from . import drawing as d
from .drawing import GRID, INK, SOFT, Anchor, Box, Drawing, Look

NUMBERS = 7.5  # size of the numbers at the axes [pt]
LEFT, BOTTOM = 36.0, 28.0  # room that numbers and names of the axes need [pt]
NARROWEST = 150.0  # of axes in a plan [pt]: their words need it
AXIS = "#777777"


class Panel:
    """Axes that fill a frame of the page [pt] and show at least a box of the drawn plane, y upwards.

    Args:
        page: what is drawn on.
        frame: of the axes on the page: left, top, right, bottom [pt].
        box: what has to be seen, in drawn units (mm, s).
        equal: whether a unit is as long upwards as to the right; the box grows to fill the frame.
    """

    def __init__(self, page: Drawing, frame: Box, box: Box, equal: bool = True) -> None:
        self.page, self.frame = page, frame
        size = np.array([frame[2] - frame[0], frame[3] - frame[1]])
        low, high = np.array(box[:2]), np.array(box[2:])
        scale = size / np.maximum(high - low, 1e-9)
        if equal:
            scale = np.full(2, scale.min())
            middle, half = (low + high) / 2, size / scale / 2
            low, high = middle - half, middle + half
        self.box: Box = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
        self._scale = scale

    def at(self, points: Array) -> Array:
        """Places on the page [pt] of drawn points (..., 2)."""
        p = np.asarray(points, dtype=float)
        return np.stack(
            [
                self.frame[0] + (p[..., 0] - self.box[0]) * self._scale[0],
                self.frame[3] - (p[..., 1] - self.box[1]) * self._scale[1],
            ],
            axis=-1,
        )

    def length(self, drawn: float) -> float:
        """A length along x on the page [pt]."""
        return float(drawn * self._scale[0])

    def unit(self, points: float) -> float:
        """How long so many points of the page are in drawn units."""
        return float(points / self._scale[0])

    def holds(self, point: Array) -> bool:
        """Whether a drawn point lies in the axes."""
        x, y = point
        return bool(self.box[0] <= x <= self.box[2] and self.box[1] <= y <= self.box[3])

    def line(self, points: Array, look: Look, z: float = 3.0) -> None:
        """A line through drawn points (n, 2); it is broken where they are nan."""
        places = self.at(points)
        known = np.all(np.isfinite(places), axis=1)
        for part in np.split(np.arange(len(places)), np.flatnonzero(np.diff(known)) + 1):
            if len(part) > 1 and known[part[0]]:
                self.page.add(d.Line(places[part], look), z, self.frame)

    def area(self, corners: Array, look: Look, z: float = 3.0) -> None:
        """A closed line through drawn corners (n, 2), filled if the look says so."""
        self.page.add(d.Line(self.at(corners), look, closed=True), z, self.frame)

    def disc(self, centre: Array, radius: float, look: Look, z: float = 3.0) -> None:
        """A disc with a drawn centre and a radius in points of the page."""
        self.page.add(d.Disc(self.at(centre), radius, look), z, self.frame)

    def arrow(self, tail: Array, head: Array, colour: str, width: float = 1.2, z: float = 6.0) -> None:
        """An arrow between drawn points."""
        a, b = self.at(np.stack([tail, head]))
        length = float(np.hypot(*(b - a)))
        if length == 0:
            return
        along = (b - a) / length
        across = np.array([-along[1], along[0]])
        size = min(4.2 + 1.2 * width, 0.7 * length)
        neck = b - size * along
        self.page.add(d.Line(np.stack([a, b - 0.8 * size * along]), Look(colour, width)), z, self.frame)
        self.page.add(
            d.Line(
                np.stack([b, neck + 0.36 * size * across, neck - 0.36 * size * across]),
                Look(fill=colour),
                closed=True,
            ),
            z,
            self.frame,
        )

    def sign(self, centre: Array, plus: bool, colour: str, radius: float = 3.6, z: float = 3.5) -> None:
        """A turning centre: a circle with + (counter-clockwise) or − (clockwise)."""
        middle, arm = self.at(centre), 0.5 * radius
        self.page.add(d.Disc(middle, radius, Look(colour, 0.25 * radius, fill="#ffffff")), z, self.frame)
        for way in ((1.0, 0.0), (0.0, 1.0)) if plus else ((1.0, 0.0),):
            ends = middle + arm * np.array([way, way]) * [[-1], [1]]
            self.page.add(d.Line(ends, Look(colour, 0.25 * radius)), z, self.frame)

    def text(
        self, at: Array, text: str, colour: str = INK, size: float = 8.5, anchor: Anchor = "middle",
        bold: bool = False, halo: bool = True, z: float = 9.0,
    ) -> None:  # fmt: skip
        """Letters whose middle (or end) is at a drawn place."""
        x, y = self.at(at)
        self.page.add(
            d.Text(float(x), float(y) + 0.36 * size, text, size, colour, anchor, bold, halo), z, self.frame
        )

    def axes(
        self,
        x: str = "x [mm]",
        y: str = "y [mm]",
        numbers: tuple[bool, bool] = (True, True),
        rows: bool = False,
    ) -> None:
        """The grid, its numbers, and what they are; an empty name leaves it out; rows: only lines upwards."""
        left, top, right, bottom = self.frame
        line = Look(GRID, 0.6)
        for value in ticks(self.box[0], self.box[2], max((right - left) / 48, 4.5)):
            place = float(self.at(np.array([value, 0.0]))[0])
            self.page.add(d.Line(np.array([[place, top], [place, bottom]]), line), -2)
            if numbers[0]:
                self.page.add(d.Text(place, bottom + 10, number(value), NUMBERS, SOFT, "middle"), -1)
        for value in () if rows else ticks(self.box[1], self.box[3], max((bottom - top) / 26, 4.5)):
            place = float(self.at(np.array([0.0, value]))[1])
            self.page.add(d.Line(np.array([[left, place], [right, place]]), line), -2)
            if numbers[1]:
                self.page.add(d.Text(left - 4, place + 2.7, number(value), NUMBERS, SOFT, "end"), -1)
        self.page.add(d.Line(np.array([[left, top], [left, bottom], [right, bottom]]), Look(AXIS, 0.7)), -1)
        if x:
            self.page.add(d.Text((left + right) / 2, bottom + 21, x, 8.5, SOFT, "middle"), -1)
        if y:
            self.page.add(
                d.Text(left - LEFT + 9, (top + bottom) / 2, y, 8.5, SOFT, "middle", upright=True), -1
            )


def frame_for(box: Box, left: float, top: float, width: float, low: float, high: float) -> Box:
    """A frame with the shape of a box: as wide as asked unless it would be higher than high; at least low [pt]."""
    aspect = (box[3] - box[1]) / max(box[2] - box[0], 1e-9)
    height = float(np.clip(width * aspect, low, high))
    return (left, top, left + min(width, max(height / aspect, NARROWEST)), top + height)


def ticks(low: float, high: float, most: float) -> Sequence[float]:
    """Round values between two others, at most about so many, at least two if there is room."""
    span = max(high - low, 1e-12)
    steps = (m * 10.0**e for e in range(-6, 9) for m in (1, 2, 5))
    step = next(s for s in steps if span / s <= max(most, 2.0))
    return [
        float(k * step) for k in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)
    ]


def number(value: float) -> str:
    """With a proper minus, and no more digits than it needs."""
    return f"{round(value, 9) + 0.0:g}".replace("-", "−")
