"""The sizes of elements of an SVG drawing, and the subpaths of its shapes."""

import re
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from .drawing import extent
from .svg_path import EllipticArc, Segment, Straight, subpaths
from .svg_style import GEOMETRY, Element
from .svg_units import LENGTH, NUMBER, PX, TWO_COMMAS, UNITS

NUMBERS = re.compile(NUMBER)
SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")


class Surroundings(Protocol):
    """What lengths are read by: the style of the element, and the size of the viewport, NaN where it is not known."""

    @property
    def style(self) -> Mapping[str, str]: ...
    @property
    def viewport(self) -> tuple[float, float]: ...


class Sizes:
    """Reads sizes and shapes, and remembers the first shape with bare numbers and the first with real units."""

    def __init__(self) -> None:
        self.bare = self.real = ""

    def segments(self, element: Element, state: Surroundings) -> list[list[Segment]]:
        """The subpaths of a basic shape or a path, in its own frame."""
        tag = element.tag
        if tag == "path":
            self.note(element, bare=True)
            data = state.style.get("d", element.attributes.get("d", ""))
            if match := re.fullmatch(r"path\(\s*['\"](.*)['\"]\s*\)", data, re.S):
                data = match[1]
            return subpaths("" if data.strip().lower() == "none" else data)
        if tag in ("polyline", "polygon"):
            text = element.attributes.get("points", "")
            if NUMBERS.sub("", text).strip(" \t\r\n\f,") or TWO_COMMAS.search(text):
                raise ValueError(f"its points are no numbers ({text[:40]!r})")
            numbers = [float(x) for x in NUMBERS.findall(text)]
            if len(numbers) % 2 or not np.all(np.isfinite(numbers)):
                raise ValueError("its points are not pairs of finite numbers")
            self.note(element, bare=True)
            corners = np.array(numbers).reshape(-1, 2)
            if tag == "polygon" and len(corners):
                corners = np.concatenate([corners, corners[:1]])
            return [[Straight(corners)]] if len(corners) > 1 else []
        if tag == "line":
            x1, y1, x2, y2 = (
                self.length(element, k, state, n % 2) for n, k in enumerate(("x1", "y1", "x2", "y2"))
            )
            return [[Straight(np.array([(x1, y1), (x2, y2)]))]]
        if tag == "rect":
            x, y, w, h = (
                self.length(element, k, state, n % 2) for n, k in enumerate(("x", "y", "width", "height"))
            )
            rx, ry = (self.radius(element, k, state, n) for n, k in enumerate(("rx", "ry")))
            if w < 0 or h < 0:
                raise ValueError("its width and height are not negative")
            return _rectangle(x, y, w, h, rx, ry) if w and h else []
        cx, cy = (self.length(element, k, state, n) for n, k in enumerate(("cx", "cy")))
        if tag == "circle":
            rx = ry = self.length(element, "r", state, 2)
        else:
            given = [self.radius(element, k, state, n) for n, k in enumerate(("rx", "ry"))]
            rx = given[0] if given[0] is not None else given[1] or 0.0
            ry = given[1] if given[1] is not None else rx
        if rx < 0 or ry < 0:
            raise ValueError("its radius is not negative")
        if not (rx and ry):
            return []
        return [[EllipticArc(np.array([cx, cy]), np.diag([rx, ry]), 0.0, 2 * np.pi)]]

    def radius(self, element: Element, key: str, state: Surroundings, axis: int) -> float | None:
        """A radius that may be left out or auto; None then, and for a negative one, as browsers read it."""
        text = state.style.get(key, element.attributes.get(key, "auto"))
        if text.strip().lower() in ("", "auto"):
            return None
        value = self.length(element, key, state, axis)
        return value if value >= 0 else None

    def length(self, element: Element, key: str, state: Surroundings, axis: int) -> float:
        """A length in the units of the drawing; 0 if left out. axis: 0 across, 1 down, 2 of both for radii."""
        text = state.style.get(key, "") if key in GEOMETRY and element.tag in SHAPES else ""
        text = text or element.attributes.get(key, "0")
        match = LENGTH.fullmatch(text)
        if match is None:
            if text.strip().lower() == "auto" and key in ("width", "height"):
                return self.length(Element(element.tag, {key: "100%"}, element.line), key, state, axis)
            raise ValueError(f"its {key} is no length ({text!r})")
        value, unit = float(match[1]), match[2].lower()
        if not np.isfinite(value):
            raise ValueError(f"its {key} is not finite ({text!r})")
        if unit == "%":
            w, h = state.viewport
            whole = (w, h, np.hypot(w, h) / np.sqrt(2))[axis]
            if not np.isfinite(whole):
                raise ValueError(f"its {key} is a part of a page of unknown size ({text!r})")
            return value / 100 * float(whole)
        if unit not in ("", "px", *UNITS):
            raise ValueError(f"the unit of its {key} is not known ({text!r})")
        if value and element.tag in SHAPES:
            self.note(element, bare=unit in ("", "px"))
        return value * (UNITS[unit] / PX if unit in UNITS else 1.0)

    def note(self, element: Element, bare: bool) -> None:
        """Remembers a shape, by whether its numbers are bare."""
        if bare:
            self.bare = self.bare or element.place
        else:
            self.real = self.real or element.place


def _rectangle(
    x: float, y: float, w: float, h: float, rx: float | None, ry: float | None
) -> list[list[Segment]]:
    """A rectangle with round corners; a radius that is left out is the other, none exceeds half the side."""
    rx, ry = (ry or 0.0) if rx is None else rx, (rx or 0.0) if ry is None else ry
    rx, ry = min(rx, w / 2), min(ry, h / 2)
    if not (rx and ry):
        return [[Straight(np.array([(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)]))]]
    parts: list[Segment] = []
    corners = (x + w - rx, y + ry), (x + w - rx, y + h - ry), (x + rx, y + h - ry), (x + rx, y + ry)
    axes = np.diag([rx, ry])
    last = np.array([x + rx, y])
    for k, corner in enumerate(corners):
        arc = EllipticArc(np.array(corner), axes, (k - 1) * np.pi / 2, np.pi / 2)
        ends = arc.points(np.inf)
        parts += [Straight(np.array([last, ends[0]])), arc]
        last = ends[-1]
    return [[part for part in parts if extent(part.points(np.inf)) > 0]]
