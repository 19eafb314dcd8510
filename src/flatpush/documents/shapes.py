"""Reads the outline of an object from a drawing (SVG, DXF) or a mask (a bitmap)."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import InputError, MissingExtra
from ..geometry import Outline
from ..geometry.pose import Array, rotate
from .contours import outer_contour
from .drawing import LeftOut

_BITMAPS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm")


@dataclass(frozen=True, eq=False)
class Choice:
    """What of a drawing is the object, and where its frame O is.

    Attributes:
        layer: the layer, id or label of the outline; empty: all that is visible.
        origin: of O: the drawing's own, the outline's centroid, or a point (x, y) of the drawing, y up [m].
        turn: by which the drawing is turned about that origin, counter-clockwise [rad].
        pixel: side of a pixel of a bitmap [m]; 0 for drawings.
    """

    layer: str = ""
    origin: str | tuple[float, float] = "drawing"
    turn: float = 0.0
    pixel: float = 0.0


@dataclass(frozen=True, eq=False)
class DrawnOutline:
    """An outline as it was drawn.

    Attributes:
        source: the file.
        outline: of the object, in O.
        taken: what the outline was made of, for people.
        left_out: everything else, in O.
        unit: length of a unit of the drawing [m]; declared: whether the drawing says so itself.
        origin: of O in the drawing, y up (2,) [m]; turn: of the drawing in O [rad].
        tolerance: by which the outline may be off what is drawn [m].
    """

    source: str
    outline: Outline
    taken: str
    left_out: tuple[LeftOut, ...]
    unit: float
    declared: bool
    origin: Array
    turn: float
    tolerance: float


def load_drawing(path: str | os.PathLike[str], unit: float, choice: Choice | None = None) -> DrawnOutline:
    """The outline drawn in an SVG or DXF file or seen in a bitmap, a polygon whose y axis points up [m].

    What is visible counts. Curves are replaced by polygons within 1e-4 of the outline's size. Lines that meet
    end to end are joined. Contours inside the outer one (holes) are left out, and so are open lines.

    Args:
        path: of the file.
        unit: length of one unit of the drawing where the drawing itself does not say [m].
        choice: of what is taken and of the frame; everything in the drawing's own frame if left out.

    Raises:
        InputError: if the file is not such a drawing, or is not one closed outer contour.
        MissingExtra: if the library that reads it is not installed.
    """
    source = os.fspath(path)
    choice = choice or Choice()
    kind = Path(source).suffix.lower()
    if (kind in _BITMAPS) != (choice.pixel > 0) and kind in (*_BITMAPS, ".svg", ".dxf"):
        rule = "a drawing has no pixels"
        if kind in _BITMAPS:
            rule = "a drawing is an .svg or .dxf file, and a bitmap needs the side of a pixel"
        hint = "Write outline: {file: mask.png, pixel: 0.4}." if kind in _BITMAPS else "Leave out pixel."
        raise InputError(rule, source=source, hint=hint)
    try:
        if kind in _BITMAPS:
            from .bitmap import read_bitmap

            contour, taken, left, tolerance = read_bitmap(path)
            declared, unit = False, choice.pixel
        else:
            contour, taken, left, tolerance, scale = _drawn(path, kind, choice.layer)
            declared, unit = scale is not None, unit if scale is None else scale
    except ImportError as error:
        raise MissingExtra(f'{source}: to read such files: pip install "flatpush[shapes]"') from error
    try:
        drawn = Outline.polygon(contour * unit)
        origin = np.zeros(2)
        if not isinstance(choice.origin, str):
            origin = np.array(choice.origin, dtype=float)
        elif choice.origin == "centroid":
            origin = drawn.centroid

        def placed(points: Array) -> Array:
            moved = points - origin
            return rotate(choice.turn, moved) if choice.turn else moved

        outline = Outline.polygon(placed(drawn.vertices)) if choice.turn or np.any(origin) else drawn
    except InputError as error:
        raise InputError(
            error.rule, source=source, hint=error.hint or "Draw the outline as one closed contour."
        ) from None
    left_out = tuple(replace(part, points=placed(part.points * unit)) for part in left)
    return DrawnOutline(
        source, outline, taken, left_out, unit, declared, origin, choice.turn, tolerance * unit
    )


def _drawn(
    path: str | os.PathLike[str], kind: str, layer: str
) -> tuple[Array, str, list[LeftOut], float, float | None]:
    from .drawing import FLATNESS, extent

    if kind == ".svg":
        from .svg import read_svg

        drawing = read_svg(path)
    elif kind == ".dxf":
        from .dxf import read_dxf

        drawing = read_dxf(path)
    else:
        raise InputError(
            "a drawing is an .svg or .dxf file, or a bitmap with its pixel",
            source=os.fspath(path),
            hint="Save it as one of these.",
        )
    contour, outer, left = outer_contour(drawing, os.fspath(path), layer)
    return contour, outer.place, left, FLATNESS * extent(contour), drawing.unit
