"""What a reader of drawings finds in a file: visible curves, and what it leaves out or cannot read."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..geometry.pose import Array

# Curves become polygons within this part of their outline's size; ends nearer than that are joined.
FLATNESS = 1e-4
WIDE = 0.05  # of the size of a shape, from which on it is told that its line has a width
_CHORDS = 4, 4096  # of one curve, at first and at most


@dataclass(frozen=True, eq=False)
class Curve:
    """A visible line of a drawing, open or closed, in its units with y up.

    Attributes:
        points: gives its polygon within a tolerance, shape (n, 2), from end to end.
        place: what and where it is, for people.
        layer: the layer that it is on; empty if none.
        names: all by which it can be chosen: layers and ids.
        aside: why it is no outline by the way it is drawn, as a centre line; empty if it may be one.
        refusal: why it is not what is seen, as where it is clipped; empty if it is.
        filled: whether what it surrounds is painted, up to the straight line between its ends.
    """

    points: Callable[[float], Array]
    place: str
    layer: str = ""
    names: tuple[str, ...] = ()
    aside: str = ""
    refusal: str = ""
    filled: bool = False


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Something in a drawing that is not part of the outline.

    Attributes:
        place: what and where it is, for people; reason: why it is left out.
        points: its polygon, shape (n, 2), in the units of the drawing or, in a DrawnOutline, in O [m]; empty
            where it has none or was not read.
    """

    place: str
    reason: str
    points: Array = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class Unreadable:
    """Something visible that cannot be read: what and where, why, and the names by which it can be chosen."""

    place: str
    reason: str
    names: tuple[str, ...] = ()


@dataclass(eq=False)
class Drawing:
    """The contents of a drawing; a reader fills it.

    Attributes:
        unit: length of its unit [m]; None if it declares none.
        known: names of layers and objects that can be chosen, those of hidden ones too.
        hidden: curves that are not seen, with the reason in `aside`: an outline with a gap may lack one of them.
    """

    unit: float | None = None
    curves: list[Curve] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    unreadable: list[Unreadable] = field(default_factory=list)
    known: dict[str, None] = field(default_factory=dict)
    hidden: list[Curve] = field(default_factory=list)


def extent(points: Array) -> float:
    """The longer side of the box around points of shape (n, 2)."""
    return float(np.max(np.ptp(points, axis=0))) if len(points) else 0.0


def flattened(curve: Callable[[Array], Array], tolerance: float) -> Array:
    """Points of a curve over [0, 1], shape (n, 2), whose chords stay within the tolerance of it.

    Args:
        curve: gives the points (k, 2) of parameters (k,).
    """
    n, most = _CHORDS
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
