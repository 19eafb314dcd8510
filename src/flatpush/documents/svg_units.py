"""Lengths and matrices of an SVG drawing: units, transforms, view boxes."""

import re
from collections.abc import Mapping

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .svg_style import Element

# Metres per unit of a page. px is no real length here: programs disagree about it.
UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6, "q": 0.25e-3}
PX = 0.0254 / 96  # where a drawing mixes real lengths with its own units, these are CSS pixels
_OLD_PX = 0.0254 / 90  # of Inkscape before 0.92
NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
LENGTH = re.compile(rf"\s*({NUMBER})\s*([a-zA-Z%]*)\s*")
TWO_COMMAS = re.compile(r",\s*,")  # between numbers: browsers then stop reading
_WORD = re.compile(rf"{NUMBER}[a-zA-Z%]*")
_FUNCTION = re.compile(r"[\s,]*([A-Za-z0-9]+)\s*\(([^()]*)\)")
NO_TURN = np.hstack([np.eye(2), np.zeros((2, 1))])


def joined(outer: Array, inner: Array) -> Array:
    """The matrix (2, 3) that does the inner one first."""
    return np.hstack([outer[:, :2] @ inner[:, :2], (outer[:, :2] @ inner[:, 2] + outer[:, 2])[:, None]])


def upright(matrix: Array) -> Array:
    """The same, with y up."""
    return matrix * np.array([[1.0], [-1.0]])


def number(text: str) -> float:
    """A length in CSS pixels; NaN where it is none, or a part of something."""
    match = LENGTH.fullmatch(text)
    if match is None or match[2].lower() not in ("", "px", *UNITS):
        return np.nan
    return float(match[1]) * (UNITS[match[2].lower()] / PX if match[2].lower() in UNITS else 1.0)


def view_box(element: Element) -> Array | None:
    """x, y, width, height of a viewBox; None without one.

    Raises:
        InputError: if it is not four numbers, the sizes positive.
    """
    text = element.attributes.get("viewBox")
    if text is None:
        return None
    words = text.replace(",", " ").split()
    try:
        box = np.array([float(word) for word in words])
    except ValueError:
        box = np.empty(0)
    if len(box) != 4 or not np.all(np.isfinite(box)) or not np.all(box[2:] > 0):
        raise InputError("a viewBox is four numbers, width and height positive", value=text)
    return box


def fitted(box: Array, width: float, height: float, aspect: str) -> Array:
    """From the units of a viewBox to those around a viewport at the origin."""
    words = aspect.split()
    align = words[0] if words else "xMidYMid"
    sx, sy = width / box[2], height / box[3]
    if align != "none":
        sx = sy = max(sx, sy) if "slice" in words[1:] else min(sx, sy)
    room = np.array([width - sx * box[2], height - sy * box[3]])
    part = np.array(
        [{"xMin": 0.0, "xMax": 1.0}.get(align[:4], 0.5), {"YMin": 0.0, "YMax": 1.0}.get(align[4:], 0.5)]
    )
    shift = part * room if align != "none" else np.zeros(2)
    return np.array([[sx, 0.0, shift[0] - sx * box[0]], [0.0, sy, shift[1] - sy * box[1]]])


def transform(element: Element, style: Mapping[str, str]) -> Array:
    """The matrix of an element's transform (2, 3), from its attribute or style.

    Raises:
        ValueError: if it is not understood; it says how.
    """
    for name in ("translate", "rotate", "scale", "offset-path"):
        if style.get(name, "none").lower() not in ("", "none"):
            raise ValueError(f"its style has {name}: {style[name]}, which is not read")
    text = style.get("transform", "").strip()
    if text.lower() in ("", "none"):
        return NO_TURN
    css = text != element.attributes.get("transform", "").strip()
    matrix, place = NO_TURN, 0
    while text[place:].strip(" \t\r\n,"):
        match = _FUNCTION.match(text, place)
        if match is None:
            raise ValueError(f"its transform is not understood ({text!r})")
        words = _WORD.findall(match[2])  # numbers need nothing between them, as in translate(20-10)
        if _WORD.sub("", match[2]).strip(" \t\r\n,") or TWO_COMMAS.search(match[2]):
            raise ValueError(f"its transform is not understood ({text!r})")
        matrix = joined(matrix, _function(match[1], words, css, text))
        place = match.end()
    origin = style.get("transform-origin", "").replace(",", " ").split()
    if not np.all(np.isfinite(matrix)):
        raise ValueError(f"its transform is not finite ({text!r})")
    boxed = style.get("transform-box", "view-box") != "view-box" and np.any(matrix[:, :2] != np.eye(2))
    if boxed:  # then even the origin (0, 0) is a corner of the element
        raise ValueError("its transform-box is not read")
    if not origin or all(word in ("0", "left", "top", "0px", "0%") for word in origin):
        return matrix
    if len(origin) > 1 and (origin[0] in ("top", "bottom") or origin[1] in ("left", "right")):
        origin[:2] = origin[1], origin[0]
    at = np.array([0.0 if w in ("left", "top") else number(w) for w in origin[:2]])
    if len(at) != 2 or not np.all(np.isfinite(at)):
        raise ValueError(f"its transform-origin is not a point ({' '.join(origin)!r})")
    there, back = np.hstack([np.eye(2), at[:, None]]), np.hstack([np.eye(2), -at[:, None]])
    return joined(joined(there, matrix), back)


_ANGLES = {"deg": 1.0, "rad": 180 / np.pi, "grad": 0.9, "turn": 360.0}


def _function(name: str, words: list[str], css: bool, text: str) -> Array:
    def bad() -> ValueError:
        return ValueError(f"its transform is not understood ({text!r})")

    def value_of(word: str, angle: bool, scale: bool = False) -> float:
        match = LENGTH.fullmatch(word)
        if match is None:
            raise bad()
        value, unit = float(match[1]), match[2].lower()
        if unit and not css:  # units are for style sheets; a browser ignores the whole attribute
            raise bad()
        if angle and unit in _ANGLES:
            return value * _ANGLES[unit]
        if scale and unit == "%":
            return value / 100
        if not angle and not scale and (unit == "px" or unit in UNITS):
            return number(word)
        if unit or (css and not scale and value):
            raise bad()
        return value

    name = name if css else name.strip()
    lower = name.lower() if css else name
    known = {
        "matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3), "skewX": (1,), "skewY": (1,),
    }  # fmt: skip
    if css:
        known = {k.lower(): v for k, v in known.items()}
        known |= {"translatex": (1,), "translatey": (1,), "scalex": (1,), "scaley": (1,), "skew": (1, 2)}
    if lower not in known or len(words) not in known[lower]:
        raise bad()
    lower = lower.lower()
    if lower == "matrix":
        values = [value_of(word, False, True) for word in words]
        return np.array(values).reshape(3, 2).T
    if lower.startswith("translate"):
        values = [value_of(word, False) for word in words]
        values = [0.0, values[0]] if lower == "translatey" else [*values, 0.0]
        return np.array([[1.0, 0.0, values[0]], [0.0, 1.0, values[1]]])
    if lower.startswith("scale"):
        values = [value_of(word, False, True) for word in words]
        sx, sy = {"scalex": (values[0], 1.0), "scaley": (1.0, values[0])}.get(lower, (values[0], values[-1]))
        return np.array([[sx, 0.0, 0.0], [0.0, sy, 0.0]])
    angle = np.deg2rad(value_of(words[0], True))
    if lower == "rotate":
        c, s = np.cos(angle), np.sin(angle)
        about = np.array([value_of(word, False) for word in words[1:]] or [0.0, 0.0])
        turn = np.array([[c, -s], [s, c]])
        return np.hstack([turn, (about - turn @ about)[:, None]])
    other = np.deg2rad(value_of(words[1], True)) if len(words) > 1 else 0.0
    across, down = (0.0, angle) if lower == "skewy" else (angle, other)
    return np.array([[1.0, np.tan(across), 0.0], [np.tan(down), 1.0, 0.0]])


def page_unit(root: Element) -> float | None:
    """The length of the drawing's unit [m], where its page has a real size."""
    sides = [LENGTH.fullmatch(root.attributes.get(key, "")) for key in ("width", "height")]
    real = [m for m in sides if m and m[2].lower() in UNITS]
    box = view_box(root)
    if len(real) < 2 and not (real and box is not None):
        return None
    if box is None:
        version = re.match(r"0\.([0-9]+)", root.attributes.get("inkscape:version", ""))
        minor = float(f"0.{version[1]}") if version else 1.0
        return _OLD_PX if minor < 0.92 else PX
    scales = [
        float(side[1]) * {**UNITS, "": PX, "px": PX}[side[2].lower()] / extent
        for side, extent in zip(sides, box[2:].tolist(), strict=True)
        if side and side[2].lower() in ("", "px", *UNITS)
    ]
    aspect = root.attributes.get("preserveAspectRatio", "").split()
    if aspect and aspect[0] != "none" and min(scales) > 0:
        return max(scales) if "slice" in aspect[1:] else min(scales)
    if not (min(scales) > 0 and max(scales) <= 1.001 * min(scales)):
        raise InputError(
            "width, height and viewBox have the same proportions",
            value=[root.attributes.get(key) for key in ("width", "height", "viewBox")],
            hint="Is it stretched? Save it without, or say how it fits: preserveAspectRatio.",
        )
    return scales[0]
