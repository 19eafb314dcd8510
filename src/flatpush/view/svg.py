"""A drawing as SVG, as wide as its page allows. Letters stay letters: they can be searched, copied and read aloud."""

import re

from ..geometry.pose import Array
from .drawing import Box, Disc, Drawing, Item, Look, Text, thinned

FONTS = "DejaVu Sans, Verdana, Segoe UI, Helvetica, Arial, sans-serif"
_NAMES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#x27;"}  # & first
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")  # XML forbids them


def svg_text(drawing: Drawing) -> str:
    """The whole document; the same drawing gives the same text."""
    clips: dict[Box, str] = {}
    body: list[str] = []
    opened: Box | None = None
    for clip, item in drawing.items():
        if clip != opened:
            body.append("</g>" if opened is not None else "")
            if clip is not None:
                name = clips.setdefault(clip, f"frame{len(clips) + 1}")
                body.append(f'<g clip-path="url(#{name})">')
            opened = clip
        body.append(_element(item))
    body.append("</g>" if opened is not None else "")
    frames = "".join(
        f'<clipPath id="{name}"><rect x="{_n(b[0])}" y="{_n(b[1])}" width="{_n(b[2] - b[0])}"'
        f' height="{_n(b[3] - b[1])}"/></clipPath>'
        for b, name in clips.items()
    )
    colours = sorted(
        {
            i.look.stroke
            for _, i in drawing.items()
            if not isinstance(i, Text) and i.look.hatch and i.look.stroke
        }
    )
    hatches = "".join(
        f'<pattern id="{_hatch(c)}" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
        f'<path d="M0 0V6" stroke="{c}" stroke-width="1.2" stroke-opacity="0.45"/></pattern>'
        for c in colours
    )
    title = clean(drawing.title)
    return "\n".join(
        part
        for part in (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_n(drawing.width)} {_n(drawing.height)}"'
            f' width="100%" role="img" font-family="{FONTS}" stroke-linejoin="round" stroke-linecap="round">',
            f"<title>{title}</title>",
            f"<defs>{frames}{hatches}</defs>",
            f'<rect width="{_n(drawing.width)}" height="{_n(drawing.height)}" fill="#ffffff"/>',
            *body,
            "</svg>\n",
        )
        if part
    )


def clean(text: str) -> str:
    """Text that may stand between tags and in attributes."""
    for letter, name in _NAMES.items():
        text = text.replace(letter, name)
    return _CONTROL.sub("\ufffd", text)


def _element(item: Item) -> str:
    if isinstance(item, Text):
        return _text(item)
    if isinstance(item, Disc):
        x, y = item.centre
        return f'<circle cx="{_n(x)}" cy="{_n(y)}" r="{_n(item.radius)}"{_style(item.look)}/>'
    path = _path(item.points, item.closed)
    hatched = f'<path d="{path}" fill="url(#{_hatch(item.look.stroke)})"/>' if item.look.hatch else ""
    return f'{hatched}<path d="{path}"{_style(item.look)}/>'


def _style(look: Look) -> str:
    parts = [f' fill="{look.fill or "none"}"']
    if look.fill and look.fill_opacity < 1:
        parts.append(f' fill-opacity="{look.fill_opacity:g}"')
    if look.stroke:
        parts.append(f' stroke="{look.stroke}" stroke-width="{look.width:g}"')
        if look.opacity < 1:
            parts.append(f' stroke-opacity="{look.opacity:g}"')
        if look.dash:
            parts.append(f' stroke-dasharray="{" ".join(f"{d:g}" for d in look.dash)}" stroke-linecap="butt"')
    return "".join(parts)


def _text(text: Text) -> str:
    x, y = _n(text.x), _n(text.y)
    parts = [f'<text x="{x}" y="{y}" font-size="{text.size:g}" fill="{text.colour}"']
    # Whatever font the reader has, the words keep the room that was measured for them.
    parts.append(
        f' textLength="{_n(text.width)}" lengthAdjust="spacingAndGlyphs"' if len(text.text) > 1 else ""
    )
    parts.append(f' text-anchor="{text.anchor}"' if text.anchor != "start" else "")
    parts.append(' font-weight="bold"' if text.bold else "")
    parts.append(f' transform="rotate(-90 {x} {y})"' if text.upright else "")
    parts.append(' paint-order="stroke" stroke="#ffffff" stroke-width="2.4"' if text.halo else "")
    return "".join(parts) + f">{clean(text.text)}</text>"


def _path(points: Array, closed: bool) -> str:
    steps = " ".join(f"{_n(x)} {_n(y)}" for x, y in thinned(points).tolist())
    return f"M{steps}{'Z' if closed else ''}"


def _hatch(colour: str) -> str:
    return f"hatch{colour[1:]}"


def _n(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}" if abs(value) < 1e4 else f"{value:.1f}"
