"""Reads the outline of an object from a drawing, SVG or DXF."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from ..errors import InputError, MissingExtra
from ..geometry import Outline
from ..geometry.pose import Array

# Curves become polygons within this part of the drawing's size; ends nearer than that are joined.
FLATNESS = 1e-4
EXTRA = 'pip install "flatpush[shapes]"'


def load_outline(path: str | os.PathLike[str], unit: float) -> Outline:
    """The outline drawn in an SVG or DXF file, a polygon whose y axis points up [m].

    Curves are replaced by polygons within 1e-4 of the drawing's size. Lines that meet end to end are joined.
    Contours inside the outer one (holes) are left out.

    Args:
        path: of the file.
        unit: length of one unit of the drawing where the drawing itself does not say [m].

    Raises:
        InputError: if the file is not such a drawing, or is not one closed outer contour.
        MissingExtra: if the library that reads it is not installed.
    """
    source = os.fspath(path)
    kind = Path(source).suffix.lower()
    try:
        if kind == ".svg":
            from .svg import svg_lines

            lines, scale = svg_lines(path)
        elif kind == ".dxf":
            from .dxf import dxf_lines

            lines, scale = dxf_lines(path)
        else:
            raise InputError(
                "a drawing is an .svg or .dxf file", source=source, hint="Save it as one of these."
            )
    except ImportError as error:
        raise MissingExtra(f"{source}: to read drawings: {EXTRA}") from error
    contour = outer_contour(lines, source)
    try:
        return Outline.polygon(contour * (unit if scale is None else scale))
    except InputError as error:
        raise InputError(error.rule, source=source, hint=error.hint or _ONE) from None


def outer_contour(lines: list[Array], source: str) -> Array:
    """The one closed contour that all other lines lie inside of, shape (n, 2), from lines of shape (n, 2)
    each."""
    lines = [line for line in lines if len(line) > 1]
    if not lines:
        raise InputError(
            "the drawing has no lines", source=source, hint="Text, images and blocks do not count."
        )
    everything = np.concatenate(lines)
    size = float(np.max(np.ptp(everything, axis=0)))
    if not (np.isfinite(everything).all() and size > 0):
        raise InputError("the drawing has no extent", source=source, hint=_ONE)
    closed, ends = _joined(lines, FLATNESS * size)
    if ends is not None:
        raise InputError(
            f"a line of the drawing is not closed: it ends at [{ends[0]:.6g}, {ends[1]:.6g}]",
            source=source,
            hint=_ONE,
        )
    largest = max(closed, key=lambda line: float(np.prod(np.ptp(line, axis=0))))
    outside = _outside(closed, largest)
    if outside:
        raise InputError(
            f"the drawing has {outside + 1} outer contours, not one",
            source=source,
            value=len(closed),
            hint=_ONE,
        )
    return largest[:-1]


def flattened(curve: Callable[[Array], Array], tolerance: float, start: int = 4, most: int = 4096) -> Array:
    """Points of a curve over [0, 1], shape (n, 2), whose chords stay within the tolerance of it.

    Args:
        curve: gives the points (k, 2) of parameters (k,).
        start, most: number of chords to begin and to end with; the number doubles between.
    """
    n = start
    while True:
        points = curve(np.linspace(0.0, 1.0, 4 * n + 1))
        a, b = points[:-1:4], points[4::4]
        chord = b - a
        length = np.maximum(np.hypot(*chord.T), 1e-300)
        gaps = [
            np.where(
                length > tolerance,
                np.abs(chord[:, 0] * (p - a)[:, 1] - chord[:, 1] * (p - a)[:, 0]) / length,
                np.hypot(*(p - a).T),
            )
            for p in (points[1::4], points[2::4], points[3::4])
        ]
        if n >= most or float(np.max(gaps)) <= 0.5 * tolerance:
            return points[::4]
        n *= 2


_ONE = "Draw the outline as one closed contour."


def _joined(lines: Iterable[Array], tolerance: float) -> tuple[list[Array], Array | None]:
    """The closed contours that the lines make, first point repeated at the end, and the end of an open one if
    any."""
    closed: list[Array] = []
    open_lines: list[Array] = []
    for line in lines:
        (closed if np.hypot(*(line[0] - line[-1])) <= tolerance and len(line) > 2 else open_lines).append(
            line
        )
    while open_lines:
        chain = open_lines.pop()
        while np.hypot(*(chain[0] - chain[-1])) > tolerance or len(chain) < 3:
            ends = np.array([(line[0], line[-1]) for line in open_lines]).reshape(-1, 2, 2)
            near = np.argwhere(np.hypot(*(ends - chain[-1]).T) <= tolerance)  # rows (which end, which line)
            if not len(near):
                return closed, chain[-1]
            backwards, number = near[0]
            other = open_lines.pop(number)
            chain = np.concatenate([chain, (other[::-1] if backwards else other)[1:]])
        closed.append(chain)
    # The two ends are one point.
    return [np.concatenate([line[:-1], line[:1]]) for line in closed], None


def _outside(closed: list[Array], largest: Array) -> int:
    """How many of the other contours are not inside the largest one."""
    from shapely import LineString, Polygon

    shell = Polygon(largest)
    if not shell.is_valid:
        return 0  # refused with a better reason when it becomes an outline
    return sum(line is not largest and not shell.covers(LineString(line)) for line in closed)
