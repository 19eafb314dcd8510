"""A drawing as pixels, by Pillow: drawn larger and made smaller, so that edges are smooth."""

import io
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.pose import Array
from .drawing import Box, Disc, Drawing, Item, Text, font, thinned

if TYPE_CHECKING:
    from PIL.Image import Image

PIXELS = 150 / 72  # of a PNG per point: a page of 8 inches is 1200 pixels wide
FINER = 3  # how many times larger it is drawn
HATCH = 6.0  # distance of hatching lines [pt]


def png_bytes(drawing: Drawing) -> bytes:
    """The picture as PNG, with its title."""
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    info.add_itxt("Title", drawing.title)
    buffer = io.BytesIO()
    canvas = Canvas(drawing.width, drawing.height)
    for clip, item in drawing.items():
        canvas.draw(item, clip)
    canvas.picture().save(buffer, format="PNG", pnginfo=info)
    return buffer.getvalue()


class Canvas:
    """A white page that items are painted on [pt]."""

    def __init__(self, width: float, height: float, pixels: float = PIXELS, finer: int = FINER) -> None:
        from PIL import Image

        self._size = (round(width * pixels), round(height * pixels))
        self._finer, self._scale = finer, pixels * finer
        self._image = Image.new("RGB", (finer * self._size[0], finer * self._size[1]), "#ffffff")

    def copy(self) -> "Canvas":
        """Another page with the same on it."""
        other = object.__new__(Canvas)
        other._size, other._finer, other._scale = self._size, self._finer, self._scale
        other._image = self._image.copy()
        return other

    def picture(self) -> "Image":
        """The page in its final size."""
        return self._image.reduce(self._finer)

    def draw(self, item: Item, clip: Box | None = None) -> None:
        """Paints one item, within the box only if there is one."""
        if isinstance(item, Text):
            self._text(item)
            return
        if isinstance(item, Disc):
            middle, r = np.asarray(item.centre), item.radius
            angles = np.linspace(0, 2 * np.pi, 49)[:-1]
            points, closed = middle + r * np.stack([np.cos(angles), np.sin(angles)], axis=1), True
        else:
            points, closed = thinned(item.points), item.closed
        look, points = item.look, self._scale * points
        if look.fill and len(points) > 2:
            self._paint([points], look.fill, look.fill_opacity, clip, 0)
        if look.hatch and len(points) > 2:
            self._paint(_hatching(points, self._scale * HATCH), look.stroke, 0.45, clip, self._width(1.2))
        if look.stroke and len(points) > 1:
            line = np.concatenate([points, points[:2]]) if closed else points
            dashes = _dashes(line, [self._scale * d for d in look.dash]) if look.dash else [line]
            self._paint(dashes, look.stroke, look.opacity, clip, self._width(look.width))

    def _width(self, points: float) -> int:
        return max(1, round(points * self._scale))

    def _paint(self, lines: list[Array], colour: str, opacity: float, clip: Box | None, width: int) -> None:
        """Lines of a width, or an area where the width is 0, as one layer that is as opaque as asked."""
        from PIL import Image, ImageDraw

        if not lines:
            return
        every = np.concatenate(lines)
        every = every[np.all(np.isfinite(every), axis=1)]
        edge = (0, 0, *self._image.size)
        if clip is not None:
            edge = tuple(round(self._scale * v) for v in clip)
        low, high = np.floor(every.min(axis=0) - width - 1), np.ceil(every.max(axis=0) + width + 2)
        x0, y0 = int(max(low[0], edge[0], 0)), int(max(low[1], edge[1], 0))
        x1, y1 = int(min(high[0], edge[2])), int(min(high[1], edge[3]))
        if x0 >= x1 or y0 >= y1:
            return
        inside = clip is None or ((low >= edge[:2]).all() and (high <= edge[2:]).all())
        ink: str | int = colour
        if opacity >= 1 and inside:
            tool, origin = ImageDraw.Draw(self._image), np.zeros(2)
        else:
            mask = Image.new("L", (x1 - x0, y1 - y0))
            tool, ink, origin = ImageDraw.Draw(mask), round(255 * opacity), np.array([x0, y0])
        for line in lines:
            flat = (line - origin).ravel().tolist()
            if width == 0:
                tool.polygon(flat, fill=ink)
            else:
                tool.line(flat, fill=ink, width=width, joint="curve")
        if opacity < 1 or not inside:
            self._image.paste(colour, (x0, y0, x1, y1), mask)

    def _text(self, text: Text) -> None:
        from PIL import Image, ImageDraw

        letters = font(round(text.size * self._scale, 2), text.bold)
        border = self._width(1.2) if text.halo else 0
        anchor = {"start": "ls", "middle": "ms", "end": "rs"}[text.anchor]
        if text.upright:
            left, top, right, bottom = letters.getbbox(text.text, anchor=anchor)
            piece = Image.new("L", (int(right - left) + 2, int(bottom - top) + 2))
            ImageDraw.Draw(piece).text((-left, -top), text.text, fill=255, font=letters, anchor=anchor)
            turned = piece.transpose(Image.Transpose.ROTATE_90)
            x, y = self._scale * text.x + top, self._scale * text.y - left - turned.height
            self._image.paste(text.colour, (round(x), round(y)), turned)
            return
        ImageDraw.Draw(self._image).text(
            (self._scale * text.x, self._scale * text.y), text.text, fill=text.colour, font=letters, anchor=anchor,
            stroke_width=border, stroke_fill="#ffffff",
        )  # fmt: skip


def _dashes(line: Array, pattern: list[float]) -> list[Array]:
    """The parts of a line that a dash pattern leaves, on and off in turn."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    if len(pattern) % 2:
        pattern = pattern * 2
    found, at, k = [], 0.0, 0
    while at < way[-1]:
        end = min(at + pattern[k % len(pattern)], way[-1])
        if k % 2 == 0 and end > at:
            between = way[(way > at) & (way < end)]
            s = np.concatenate([[at], between, [end]])
            found.append(np.stack([np.interp(s, way, line[:, i]) for i in (0, 1)], axis=1))
        at, k = end, k + 1
    return found


def _hatching(polygon: Array, gap: float) -> list[Array]:
    """Lines at 45° inside a polygon, a gap apart."""
    turn = np.array([[1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(2)
    p = polygon @ turn
    q = np.roll(p, -1, axis=0)
    lines = []
    for height in np.arange(np.ceil(p[:, 1].min() / gap), np.floor(p[:, 1].max() / gap) + 1) * gap:
        cut = (p[:, 1] <= height) != (q[:, 1] <= height)
        a, b = p[cut], q[cut]
        x = np.sort(a[:, 0] + (height - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0]))
        for left, right in zip(x[::2], x[1::2], strict=False):
            lines.append(np.array([[left, height], [right, height]]) @ turn.T)
    return lines
