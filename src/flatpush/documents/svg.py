"""Reads the lines of an SVG drawing."""

import os
import re
import warnings
from io import StringIO
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .reading import read_text
from .shapes import FLATNESS, flattened

# Metres per unit. px is no real length here: programs disagree about it.
_UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6}
_LENGTH = re.compile(r"\s*([0-9.eE+-]+)\s*(mm|cm|in|pt|pc)\s*")


def svg_lines(path: str | os.PathLike[str]) -> tuple[list[Array], float | None]:
    """The contours of a drawing, each of shape (n, 2), y up, and the length of its unit [m].

    Transforms are applied, and the basic shapes are read as paths. The unit is known if the drawing gives its
    width and height in mm, cm, in, pt or pc together with a viewBox; otherwise it is None.
    """
    from svgpathtools import Document

    source = os.fspath(path)
    text = read_text(path)
    if "<!ENTITY" in text:
        raise InputError("entities in drawings are not read", source=source, hint="Save it as plain SVG.")
    try:
        with warnings.catch_warnings():
            # It only warns of a transform that it cannot read.
            warnings.simplefilter("error", UserWarning)
            document = Document(StringIO(text))
            paths = [part for whole in document.paths() for part in whole.continuous_subpaths() if len(part)]
        scale = _scale(document.root.attrib)
    except InputError as error:
        raise InputError(error.rule, source=source, value=error.value, hint=error.hint) from None
    except Exception as error:  # a broken file can make it stumble anywhere
        hint = "Is it the right file, and is it complete?"
        raise InputError(f"this is not a drawing in SVG ({error})", source=source, hint=hint) from error
    corners = np.array(
        [(p.real, p.imag) for part in paths for segment in part for p in (segment.start, segment.end)]
    )
    if not len(corners):
        return [], scale
    size = float(np.max(np.ptp(corners, axis=0))) or float(max(part.length() for part in paths))
    return [_flattened(part, FLATNESS * size) * (1.0, -1.0) for part in paths], scale


def _flattened(part: Any, tolerance: float) -> Array:
    from svgpathtools import Line

    pieces = [np.array([[part[0].start.real, part[0].start.imag]])]
    for segment in part:
        if isinstance(segment, Line):
            points = np.array([[segment.end.real, segment.end.imag]])
        else:
            points = flattened(lambda t, s=segment: _points(s, t), tolerance)[1:]  # type: ignore[misc]
        pieces.append(points)
    return np.concatenate(pieces)


def _points(segment: Any, t: Array) -> Array:
    values = np.array([segment.point(float(x)) for x in t])
    return np.stack([values.real, values.imag], axis=-1)


def _scale(root: Any) -> float | None:
    width, height = (_LENGTH.fullmatch(root.get(key, "")) for key in ("width", "height"))
    box = root.get("viewBox", "").replace(",", " ").split()
    if not (width and height and box):
        return None
    if len(box) != 4:
        raise InputError("a viewBox is four numbers", value=root.get("viewBox"))
    scales = [
        float(side[1]) * _UNITS[side[2]] / float(extent)
        for side, extent in zip((width, height), box[2:], strict=True)
    ]
    if not (min(scales) > 0 and max(scales) <= 1.001 * min(scales)):
        raise InputError(
            "width, height and viewBox have the same proportions",
            value=[root.get("width"), root.get("height"), root.get("viewBox")],
            hint="The drawing is stretched; save it without.",
        )
    return scales[0]
