"""Reads the lines of a DXF drawing."""

import os
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .reading import MOST_BYTES
from .shapes import FLATNESS

_LINES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE")
# $INSUNITS: metres per unit; 0 and what is not listed say nothing.
_UNITS = {
    1: 0.0254,
    2: 0.3048,
    4: 1e-3,
    5: 1e-2,
    6: 1.0,
    8: 0.0254e-6,
    9: 0.0254e-3,
    10: 0.9144,
    13: 1e-6,
    14: 0.1,
}
_MOST_NESTED = 8


def dxf_lines(path: str | os.PathLike[str]) -> tuple[list[Array], float | None]:
    """The contours of the model space, each of shape (n, 2), and the length of its unit [m], None if not
    declared.

    Read are lines, arcs, circles, ellipses, polylines (with bulges) and splines, also inside inserted blocks.
    """
    import ezdxf
    from ezdxf import path as paths

    source = os.fspath(path)
    hint = "Is it the right file, and is it complete?"
    try:
        if os.path.getsize(path) > MOST_BYTES:
            raise InputError("a drawing has at most 10 MB", source=source, hint=hint)
        drawing = ezdxf.readfile(source)
        contours = [paths.make_path(entity) for entity in _entities(drawing.modelspace(), 0)]
    except OSError as error:
        # ezdxf raises a plain OSError for a file that is no DXF file.
        reason = (error.strerror or "it is not a drawing in DXF").lower()
        raise InputError(f"the drawing cannot be read ({reason})", source=source, hint=hint) from None
    except InputError:
        raise
    except Exception as error:  # a broken file can make it stumble anywhere
        raise InputError(f"this is not a drawing in DXF ({error})", source=source, hint=hint) from error
    contours = [contour for contour in contours if len(contour)]
    if not contours:
        return [], None
    box = paths.bbox(contours)
    tolerance = FLATNESS * max(box.size.x, box.size.y)
    if not tolerance > 0:
        return [], None
    lines = [np.array([(p.x, p.y) for p in contour.flattening(tolerance)]) for contour in contours]
    return lines, _UNITS.get(drawing.header.get("$INSUNITS", 0))


def _entities(container: Iterable[Any], level: int) -> Iterator[Any]:
    for entity in container:
        if entity.dxftype() in _LINES:
            yield entity
        elif entity.dxftype() == "INSERT" and level < _MOST_NESTED:
            yield from _entities(entity.virtual_entities(), level + 1)
