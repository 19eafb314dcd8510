"""Reads what is visible in an SVG drawing."""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from xml.parsers import expat

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .drawing import FLATNESS, WIDE, Curve, Drawing, LeftOut, Unreadable, extent
from .reading import read_bytes
from .svg_path import Segment, traced
from .svg_shapes import NUMBERS, SHAPES, Sizes
from .svg_style import MASKS, Element, Rule, Unsupported, sheet_rules, style_of
from .svg_units import (
    LENGTH,
    NO_TURN,
    PX,
    UNITS,
    fitted,
    joined,
    number,
    page_unit,
    transform,
    upright,
    view_box,
)
from .svg_xml import parsed

_URL = re.compile(r"url\(\s*['\"]?([^'\")]*)['\"]?\s*\)")
_CONTAINERS = ("g", "a", "svg", "switch")
# What is visible and is no line of the object, with the word for it.
_ASIDE = {"text": "text", "flowRoot": "text", "image": "a picture"}
_MOVING = ("animate", "animateTransform", "animateMotion", "set")
_MOST_NESTED, _MOST_ELEMENTS, _MOST_REUSED = 60, 200_000, 20_000
_OTHER_MEDIA = {"print", "speech", "aural", "braille", "embossed", "handheld", "projection", "tty", "tv"}
_WHITE = ("white", "#fff", "#ffffff", "rgb(255,255,255)")


def read_svg(path: str | os.PathLike[str]) -> Drawing:
    """The visible curves of a drawing, y up, each with its layers and ids.

    Styles, transforms, nested and reused parts are honoured as a browser does. The unit is known if the drawing
    gives its width and height, or the lengths of its shapes, in mm, cm, in, pt or pc; otherwise it is None.

    Raises:
        InputError: if the file is not a drawing in SVG, or is stretched.
    """
    source = os.fspath(path)
    hint = "Is it the right file, and is it complete?"
    try:
        root, linked = parsed(read_bytes(path))
    except expat.ExpatError as error:
        reason = f"line {error.lineno}: {expat.errors.messages[error.code]}"
        raise InputError(f"this is not a drawing in SVG ({reason})", source=source, hint=hint) from None
    except (ValueError, LookupError) as error:
        if isinstance(error, InputError):
            raise InputError(error.rule, source=source, hint=error.hint or "Save it as plain SVG.") from None
        raise InputError(f"this is not a drawing in SVG ({error})", source=source, hint=hint) from None
    if root is None or root.tag != "svg":
        raise InputError("this is not a drawing in SVG (it has no <svg>)", source=source, hint=hint)
    if linked:
        raise InputError(
            "the drawing takes its style from another file", source=source, value=linked, hint=_PLAIN
        )
    try:
        return _Reader(root).read()
    except InputError as error:
        raise InputError(
            error.rule, source=source, value=error.value, hint=error.hint or "Save it as plain SVG."
        ) from None


_PLAIN = "Save it as plain SVG, with its style in attributes."


@dataclass(frozen=True)
class _State:
    """What a parent hands to its children.

    Attributes:
        matrix: to the drawing's own units, y down, shape (2, 3).
        style: values of properties; opacity: whether anything can be seen.
        viewport: width and height that percentages refer to, NaN where unknown.
        names: by which the parts can be chosen; layer: the innermost layer of Inkscape.
        refusal: why what is drawn here is not what is seen.
        window: corners outside of which nothing is seen (4, 2), with the place of what cuts it off.
        used: the elements that are being reused, against endless recursion.
    """

    matrix: Array
    style: Mapping[str, str]
    viewport: tuple[float, float]
    hidden: str = ""
    names: tuple[str, ...] = ()
    layer: str = ""
    refusal: str = ""
    window: tuple[Array, str] | None = None
    used: tuple[int, ...] = ()


class _Reader:
    def __init__(self, root: Element) -> None:
        self.root = root
        self.drawing = Drawing()
        self.ids: dict[str, Element] = {}
        self.rules: list[Rule] = []
        self.count = self.reused = 0
        self.sizes = Sizes()

    def read(self) -> Drawing:
        waiting = [self.root]
        while waiting:
            element = waiting.pop()
            if "id" in element.attributes:
                self.ids.setdefault(element.attributes["id"], element)
            waiting += reversed(element.children)
            if element.tag == "style":
                try:
                    self.sheet(element)
                except Unsupported as reason:
                    raise InputError(f"{element.place}: {reason}", hint=_PLAIN) from None
        style = style_of(self.root, self.rules, {})
        for key in ("width", "height"):
            size = LENGTH.fullmatch(style.get(key, ""))
            if size and size[2].lower() in UNITS and style[key] != self.root.attributes.get(key):
                rule = f"the {key} of the page is in its style, which programs read differently"
                raise InputError(rule, value=style[key], hint="Write it as an attribute of <svg>.")
        self.drawing.unit = page_unit(self.root)
        box = view_box(self.root)
        sides = [number(self.root.attributes.get(key, "")) for key in ("width", "height")]
        viewport = (box[2], box[3]) if box is not None else (sides[0], sides[1])
        state = _State(NO_TURN, {}, viewport)
        aspect = self.root.attributes.get("preserveAspectRatio", "")
        if box is not None and "slice" in aspect.split()[1:] and np.isfinite(sides).all() and min(sides) > 0:
            # The page is filled, and what of the view box has no room on it is not seen.
            matrix = fitted(box, sides[0], sides[1], aspect)
            page = np.array([(0, 0), (sides[0], 0), sides, (0, sides[1])], dtype=float) - matrix[:, 2]
            state = replace(state, window=(page / np.diag(matrix), "the edge of the page (slice)"))
        self.visit(self.root, state, page=True)
        real, bare = self.sizes.real, self.sizes.bare
        if real and self.drawing.unit is None:
            if bare:
                raise InputError(
                    f"{real} has lengths in real units, {bare} has none, and the page has no real size",
                    hint="Give the page width and height in mm and a viewBox.",
                )
            self.drawing.unit = PX
        return self.drawing

    def sheet(self, element: Element) -> None:
        """Reads a style sheet that holds on screens; others are passed over."""
        if element.attributes.get("type", "").strip().lower() not in ("", "text/css"):
            return
        rules = sheet_rules(element.text, len(self.rules))
        media = {word.strip().lower() for word in element.attributes.get("media", "").split(",")}
        if media & {"", "all", "screen"}:
            self.rules += rules
        elif rules and not media <= _OTHER_MEDIA:
            raise Unsupported(f"whether it holds depends on the screen ({element.attributes['media']!r})")

    def visit(self, element: Element, state: _State, page: bool = False) -> None:
        self.count += 1
        self.reused += bool(state.used)
        if self.count > _MOST_ELEMENTS or self.reused > _MOST_REUSED or len(state.used) > _MOST_NESTED:
            raise InputError(
                f"the drawing has at most {_MOST_ELEMENTS} parts, {_MOST_REUSED} of them reused,"
                f" and {_MOST_NESTED} levels of reuse"
            )
        tag = element.tag
        if tag not in (*_CONTAINERS, *SHAPES, *_ASIDE, "use", "foreignObject"):
            return  # definitions, metadata and what other programs put there
        try:
            style = style_of(element, self.rules, state.style)
            state = self.inside(element, state, style, page)
        except (Unsupported, ValueError) as reason:
            self.unreadable(element, state, str(reason))
            return
        if state.hidden:
            self.left_out(element, state.hidden)
            self.remember(element, state)
            return
        if "requiredExtensions" in element.attributes:
            self.left_out(element, "not shown (requiredExtensions)")
            return
        if (language := element.attributes.get("systemLanguage")) is not None:
            if language.strip():
                self.unreadable(element, state, "whether it is shown depends on the language of the reader")
            else:
                self.left_out(element, "not shown (for no language)")
            return
        try:
            if tag in SHAPES:
                self.shape(element, state)
            elif tag in _ASIDE:
                self.left_out(element, _ASIDE[tag])
            elif tag == "foreignObject":
                self.unreadable(element, state, "what it shows is not SVG")
            elif tag == "use":
                self.use(element, state)
            elif tag == "switch":
                self.switch(element, state)
            else:
                if tag == "svg" and not page:
                    state = self.viewport(element, state, element.attributes)
                for child in element.children:
                    self.visit(child, state)
        except ValueError as reason:
            if isinstance(reason, InputError):
                raise
            self.unreadable(element, state, str(reason))

    def inside(self, element: Element, state: _State, style: Mapping[str, str], page: bool) -> _State:
        """The state for what is drawn by an element and its children."""
        names = [element.attributes.get(key, "") for key in ("id", "inkscape:label")]
        layer = state.layer
        if element.attributes.get("inkscape:groupmode") == "layer":
            layer = names[1] or names[0]
        own = tuple(name for name in names if name and not page)
        self.drawing.known.update(dict.fromkeys(own))
        hidden = state.hidden
        if style.get("display", "").lower() == "none":
            hidden = "hidden (display: none)"
        elif "opacity" in style and _portion(style["opacity"]) <= 0:
            hidden = "hidden (opacity: 0)"
        refusal = state.refusal
        clip = style.get("clip-path", "")
        masks = [style[key] for key in MASKS if style.get(key, "").lower() not in ("", "none")]
        if masks:
            refusal = f"it is masked ({masks[0]})"
        if style.get("filter", "").lower() not in ("", "none"):
            refusal = f"it has a filter ({style['filter']})"
        moving = next((child.tag for child in element.children if child.tag in _MOVING), "")
        if moving and not page:
            refusal = f"it moves (<{moving}>)"
        matrix = joined(state.matrix, transform(element, style))
        if np.linalg.det(matrix[:, :2]) == 0:
            hidden = hidden or "not visible (scaled to nothing)"
        if page and np.any(matrix != state.matrix):
            raise ValueError("it has a transform, which programs read differently for a whole page")
        result = replace(
            state, matrix=matrix, style=style, hidden=hidden, names=(*state.names, *own),
            layer=layer, refusal=refusal,
        )  # fmt: skip
        if clip.lower() not in ("", "none") and not hidden:
            window = self.clip(clip, result)
            if window is None or state.window is not None:
                return replace(result, refusal=f"it is clipped ({clip})")
            return replace(result, window=(window, f"clip-path {clip}"))
        return result

    def clip(self, clip: str, state: _State) -> Array | None:
        """The corners of a plain clipping path in the drawing's units; None where it is not plain."""
        match = _URL.fullmatch(clip.strip())
        element = self.ids.get(match[1].lstrip("#")) if match else None
        if element is None or element.tag != "clipPath" or len(element.children) != 1:
            return None
        if element.attributes.get("clipPathUnits", "userSpaceOnUse") != "userSpaceOnUse":
            return None
        (child,) = element.children
        if child.tag not in SHAPES or any(
            k in e.attributes for k in ("clip-path",) for e in (element, child)
        ):
            return None
        matrix = joined(state.matrix, transform(element, style_of(element, self.rules, {})))
        style = style_of(child, self.rules, {})
        matrix = joined(matrix, transform(child, style))
        parts = self.sizes.segments(child, replace(state, matrix=matrix, style=style))
        if len(parts) != 1:
            return None
        points = traced([s.moved(matrix) for s in parts[0]])(np.inf)
        return traced([s.moved(matrix) for s in parts[0]])(FLATNESS * extent(points))

    def use(self, element: Element, state: _State) -> None:
        href = element.attributes.get("href", element.attributes.get("xlink:href", ""))
        target = self.ids.get(href[1:]) if href.startswith("#") else None
        if target is None:
            where = "is in another file" if href and not href.startswith("#") else "is not in the drawing"
            self.unreadable(element, state, f"what it shows ({href!r}) {where}")
            return
        if id(target) in state.used:
            self.unreadable(element, state, "it shows itself")
            return
        x, y = (self.sizes.length(element, key, state, axis) for axis, key in enumerate(("x", "y")))
        matrix = joined(state.matrix, np.array([[1.0, 0.0, x], [0.0, 1.0, y]]))
        state = replace(state, matrix=matrix, used=(*state.used, id(target)))
        if target.tag not in ("symbol", "svg"):
            self.visit(target, state)
            return
        sides = {k: v for k, v in element.attributes.items() if k in ("width", "height")}
        inner = {**target.attributes, **sides}
        places = ("refX", "refY", "x", "y") if target.tag == "symbol" else ()
        if away := next((key for key in places if target.attributes.get(key, "0") != "0"), ""):
            self.unreadable(element, state, f"the {away} of its symbol is not read")
            return
        style = style_of(target, self.rules, state.style)
        if target.tag == "symbol" and style.get("display", "").lower() == "none":
            self.unreadable(element, state, "its symbol has display: none, which browsers pass over")
            return
        state = self.inside(target, state, style, False)
        if state.hidden:
            self.left_out(target, state.hidden)
            return
        state = self.viewport(target, state, inner)
        for child in target.children:
            self.visit(child, state)

    def switch(self, element: Element, state: _State) -> None:
        """Draws the first part whose conditions hold."""
        for child in element.children:
            if child.tag not in (*_CONTAINERS, *SHAPES, *_ASIDE, "use", "foreignObject"):
                continue
            language = child.attributes.get("systemLanguage")
            if language is not None and not language.strip():
                continue  # of no language: never shown
            if language is not None:
                self.visit(child, state)  # which refuses it
                return
            needs = child.attributes.get("requiredExtensions")
            if needs is not None or child.tag == "foreignObject":
                continue
            self.visit(child, state)
            return

    def viewport(self, element: Element, state: _State, given: Mapping[str, str]) -> _State:
        """The state inside a nested drawing or a symbol."""
        whole = {"width": "100%", "height": "100%"}
        placed = Element(element.tag, {**whole, **given}, element.line)
        x, y = (0.0, 0.0)
        if element.tag == "svg":
            x, y = (self.sizes.length(placed, key, state, axis) for axis, key in enumerate(("x", "y")))
        box = view_box(placed)
        try:
            width, height = (
                self.sizes.length(placed, key, state, axis) for axis, key in enumerate(("width", "height"))
            )
        except ValueError:
            if box is not None:
                raise
            width = height = np.nan
        matrix = joined(state.matrix, np.array([[1.0, 0.0, x], [0.0, 1.0, y]]))
        window = state.window
        refusal = state.refusal
        if state.style.get("overflow", "hidden") not in ("visible", "auto") and np.isfinite(width + height):
            corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float)
            if window is not None:
                refusal = refusal or f"it is cut off by {element.place} and by {window[1]}"
            window = (corners @ matrix[:, :2].T + matrix[:, 2], f"the edge of {element.place}")
        inner = (width, height)
        if box is not None:
            matrix = joined(matrix, fitted(box, width, height, given.get("preserveAspectRatio", "")))
            inner = (box[2], box[3])
        return replace(state, matrix=matrix, viewport=inner, window=window, refusal=refusal)

    def shape(self, element: Element, state: _State) -> None:
        style = {**state.style, **self.fallbacks(state.style)}
        if style.get("visibility", "").lower() in ("hidden", "collapse"):
            reason = f"hidden (visibility: {style['visibility']})"
            self.left_out(element, reason)
            self.remember(element, replace(state, hidden=reason))
            return
        filled = _painted(style, "fill", "black")
        stroked = _painted(style, "stroke", "none") and _width(style.get("stroke-width", "1")) > 0
        if not (filled and element.tag != "line") and not stroked:
            self.left_out(element, "not visible (no fill and no stroke)")
            return
        aside, refusal = "", state.refusal
        place = element.place + (f" on layer {state.layer!r}" if state.layer else "")
        if filled and not stroked and self.is_paper(element, state):
            aside = "a white rectangle as large as the page"
        dashes = [float(x) for x in NUMBERS.findall(style.get("stroke-dasharray", ""))]
        gaps = (dashes if len(dashes) % 2 == 0 else 2 * dashes)[1::2]
        if stroked and not filled and any(gaps):
            aside = f"a dashed line ({style['stroke-dasharray']})"
        marker = next((style[k] for k in ("marker-start", "marker-mid", "marker-end") if k in style), "none")
        if (
            stroked
            and marker.lower() not in ("", "none")
            and element.tag in ("path", "line", "polyline", "polygon")
        ):
            refusal = refusal or f"it has markers ({marker})"
        for segments in self.sizes.segments(element, state):
            moved: list[Segment] = [s.moved(upright(state.matrix)) for s in segments]
            points = traced(moved)
            cut = refusal
            if state.window is not None and not cut and not _within(points, state.window[0] * (1.0, -1.0)):
                cut = f"it is cut off by {state.window[1]}"
            self.drawing.curves.append(Curve(points, place, state.layer, state.names, aside, cut, filled))
            if stroked and not aside:
                scale = np.sqrt(abs(np.linalg.det(state.matrix[:, :2])))
                width = scale * _width(style.get("stroke-width", "1"))
                if width > WIDE * extent(points(np.inf)):
                    self.left_out(
                        element, f"half of the width of its line ({width:.3g} in all), beyond its middle"
                    )

    def fallbacks(self, style: Mapping[str, str]) -> dict[str, str]:
        """What is painted instead of a gradient or pattern that is not in the drawing or shows nothing: nothing if not
        said."""
        found: dict[str, str] = {}
        for kind in ("fill", "stroke"):
            match = _URL.match(style.get(kind, ""))
            if match and match[1].startswith("#"):
                paint = self.ids.get(match[1][1:])
                if paint is None:
                    found[kind] = style[kind][match.end() :].strip() or "none"
                elif not self.paints(paint):
                    found[kind] = "none"
        return found

    def paints(self, paint: Element) -> bool:
        """Whether a gradient or pattern shows anything; its stops or contents may be those of another."""
        if paint.tag not in ("linearGradient", "radialGradient", "pattern"):
            return True
        gradient, seen = paint.tag != "pattern", set[int]()
        while id(paint) not in seen:
            seen.add(id(paint))
            parts = [child for child in paint.children if child.tag == "stop" or not gradient]
            if parts:
                stops = [style_of(part, self.rules, {}) for part in parts] if gradient else []
                return not gradient or any(_painted(stop, "stop", "black", "color") for stop in stops)
            href = paint.attributes.get("href", paint.attributes.get("xlink:href", ""))
            paint = self.ids.get(href[1:], paint)
        return False

    def is_paper(self, element: Element, state: _State) -> bool:
        """Whether a shape is a white rectangle that covers the page."""
        box = view_box(self.root)
        if state.style.get("fill", "").replace(" ", "").lower() not in _WHITE:
            return False
        if box is None:
            box = np.array([0.0, 0.0, *state.viewport])
        parts = self.sizes.segments(element, state)
        if len(parts) != 1:
            return False
        x, y = points = traced([s.moved(state.matrix) for s in parts[0]])(np.inf).T
        low, high = points.min(axis=1), points.max(axis=1)
        area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
        if area < 0.98 * np.prod(high - low):
            return False
        slack = 1e-3 * max(box[2], box[3])
        return bool(np.all(low <= box[:2] + slack) and np.all(high >= box[:2] + box[2:] - slack))

    def left_out(self, element: Element, reason: str) -> None:
        if any(child.tag in (*_CONTAINERS, *SHAPES, *_ASIDE, "use") for child in element.children) or (
            element.tag in (*SHAPES, *_ASIDE, "use", "image")
        ):
            self.drawing.left_out.append(LeftOut(element.place, reason))
        for child in element.children:  # so that what is hidden is known by name
            names = (child.attributes.get(key, "") for key in ("id", "inkscape:label"))
            self.drawing.known.update(dict.fromkeys(name for name in names if name))

    def remember(self, element: Element, state: _State) -> None:
        """Keeps the curves of what is hidden, as far as they can be read."""
        try:
            for segments in Sizes().segments(element, state) if element.tag in SHAPES else ():
                points = traced([s.moved(upright(state.matrix)) for s in segments])
                self.drawing.hidden.append(
                    Curve(points, element.place, state.layer, state.names, state.hidden)
                )
            for child in element.children if element.tag in _CONTAINERS else ():
                if child.tag in (*_CONTAINERS, *SHAPES):
                    style = style_of(child, self.rules, state.style)
                    self.remember(child, self.inside(child, state, style, False))
        except (Unsupported, ValueError):
            return

    def unreadable(self, element: Element, state: _State, reason: str) -> None:
        names = (element.attributes.get(key, "") for key in ("id", "inkscape:label"))
        self.drawing.unreadable.append(Unreadable(element.place, reason, (*state.names, *names)))


def _within(points: Callable[[float], Array], corners: Array) -> bool:
    """Whether a curve lies in a window."""
    from shapely import LineString, Polygon

    rough = points(np.inf)
    size = extent(rough)
    shape = Polygon(corners)
    return bool(
        shape.is_valid and shape.buffer(2 * FLATNESS * size).covers(LineString(points(FLATNESS * size)))
    )


def _portion(text: str) -> float:
    match = LENGTH.fullmatch(text)
    return float(match[1]) if match else 1.0


def _width(text: str) -> float:
    match = LENGTH.fullmatch(text)
    return float(match[1]) if match else 1.0


def _painted(style: Mapping[str, str], kind: str, default: str, name: str = "") -> bool:
    colour = (style.get(f"{kind}-{name}" if name else kind, "") or default).replace(" ", "").lower()
    if colour == "currentcolor":
        colour = style.get("color", "black").replace(" ", "").lower()
    if colour in ("none", "transparent") or _portion(style.get(f"{kind}-opacity", "1") or "1") <= 0:
        return False
    if re.fullmatch(r"#(...0|......00)", colour):
        return False
    return not re.fullmatch(r"(rgba?|hsla?)\(.*[,/]0(\.0*)?%?\)", colour) or colour.count(",") == 2
