"""Path data of SVG as segments that can be transformed and turned into polygons."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.pose import Array, cross
from .drawing import flattened

_COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])")
_NUMBER = re.compile(r"\s*,?\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)")
_FLAG = re.compile(r"\s*,?\s*([01])")
_COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
_NO_ROOM = 1e-12  # part of its radii that the ends of an arc may lie outside its ellipse without growing it


@dataclass(frozen=True, eq=False)
class Straight:
    """Straight lines from corner to corner, shape (n, 2)."""

    corners: Array

    def moved(self, matrix: Array) -> "Straight":
        return Straight(self.corners @ matrix[:, :2].T + matrix[:, 2])

    def points(self, tolerance: float) -> Array:
        return self.corners


@dataclass(frozen=True, eq=False)
class Bezier:
    """A Bézier curve by its control points, (3, 2) or (4, 2)."""

    controls: Array

    def moved(self, matrix: Array) -> "Bezier":
        return Bezier(self.controls @ matrix[:, :2].T + matrix[:, 2])

    def points(self, tolerance: float) -> Array:
        def curve(t: Array) -> Array:
            level = np.broadcast_to(self.controls[:, None], (len(self.controls), len(t), 2))
            while len(level) > 1:  # de Casteljau
                level = level[:-1] + t[:, None] * (level[1:] - level[:-1])
            return level[0]

        return flattened(curve, tolerance)


@dataclass(frozen=True, eq=False)
class EllipticArc:
    """centre + axes · (cos φ, sin φ) for φ from start to start + sweep; axes of shape (2, 2)."""

    centre: Array
    axes: Array
    start: float
    sweep: float

    def moved(self, matrix: Array) -> "EllipticArc":
        return EllipticArc(
            matrix[:, :2] @ self.centre + matrix[:, 2], matrix[:, :2] @ self.axes, self.start, self.sweep
        )

    def points(self, tolerance: float) -> Array:
        def curve(t: Array) -> Array:
            phi = self.start + t * self.sweep
            return self.centre + np.column_stack([np.cos(phi), np.sin(phi)]) @ self.axes.T

        return flattened(curve, tolerance)


Segment = Straight | Bezier | EllipticArc


def traced(segments: Sequence[Segment]) -> Callable[[float], Array]:
    """What gives the polygon of segments that follow each other."""

    def points(tolerance: float) -> Array:
        parts = [segment.points(tolerance) for segment in segments]
        return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])

    return points


def arc(
    start: Array, end: Array, radii: tuple[float, float], turned: float, large: bool, left: bool
) -> Segment:
    """The arc of an ellipse between two points; left: towards growing angles (SVG 2, appendix B.2).

    Without length or radius it is a straight line, and radii that are too small grow.

    Args:
        turned: of the ellipse's axes [rad].
    """
    rx, ry = abs(radii[0]), abs(radii[1])
    if rx == 0 or ry == 0 or np.array_equal(start, end):
        return Straight(np.array([start, end]))
    c, s = np.cos(turned), np.sin(turned)
    to_unit = np.array([[c / rx, s / rx], [-s / ry, c / ry]])  # to the frame in which it is a unit circle
    half = to_unit @ (end - start) / 2
    grow = float(np.hypot(*half))
    offset = np.zeros(2)
    if grow < 1 - _NO_ROOM:
        along = np.array([-half[1], half[0]]) / grow
        offset = along * np.sqrt(1 - grow**2) * (-1.0 if large != left else 1.0)
        grow = 1.0
    # From the middle of the chord; in the frame of the unit circle the ends are at ±half.
    axes = np.array([[c * rx, -s * ry], [s * rx, c * ry]]) * grow
    centre = (start + end) / 2 - np.linalg.inv(to_unit) @ offset
    first, last = (-half + offset) / grow, (half + offset) / grow
    phi = float(np.arctan2(first[1], first[0]))
    sweep = float(np.arctan2(cross(first, last), first @ last))
    if left and sweep < 0:
        sweep += 2 * np.pi
    elif not left and sweep > 0:
        sweep -= 2 * np.pi
    return EllipticArc(centre, axes, phi, sweep)


def subpaths(data: str) -> list[list[Segment]]:
    """The subpaths of path data. A closed one ends where it begins.

    Raises:
        ValueError: for data that break the grammar; it says how.
    """
    found: list[list[Segment]] = []
    segments: list[Segment] = []
    here = begin = np.zeros(2)
    control: Array | None = None  # of the curve before, which S and T mirror
    last = ""
    for letter, numbers in _commands(data):
        command, relative = letter.upper(), letter.islower()
        if not last and command != "M":
            raise ValueError(f"path data begin with M, not {letter}")
        origin = here if relative else np.zeros(2)
        if command in "MZ":
            if command == "Z":
                segments.append(Straight(np.array([here, begin])))
                here = begin
            else:
                here = begin = origin + np.array(numbers)
            if segments:
                found.append(segments)
            segments, control = [], None
            last = command
            continue
        if command in "CSQT":
            pairs = np.array(numbers).reshape(-1, 2) + origin
            if command in "ST":
                mirrors = control is not None and last in ("CS" if command == "S" else "QT")
                first = 2 * here - control if mirrors and control is not None else here
                pairs = np.concatenate([first[None], pairs])
            segments.append(Bezier(np.concatenate([here[None], pairs])))
            control, end = pairs[-2], pairs[-1]
        else:
            control = None
            if command == "H":
                end = np.array([origin[0] + numbers[0], here[1]])
            elif command == "V":
                end = np.array([here[0], origin[1] + numbers[0]])
            else:
                end = origin + np.array(numbers[-2:])
            if command == "A":
                rx, ry, turned, large, left = numbers[:5]
                segments.append(arc(here, end, (rx, ry), np.deg2rad(turned), large == 1, left == 1))
            else:
                segments.append(Straight(np.array([here, end])))
        here, last = end, command
    if segments:
        found.append(segments)
    return [_merged(segments) for segments in found]


def _commands(data: str) -> Iterator[tuple[str, list[float]]]:
    """Letters with the numbers of one command each; what follows a move without a letter is a line."""
    parts = _COMMAND.split(data)
    if parts[0].strip():
        raise ValueError(f"path data begin with M, not {parts[0].strip()[:20]!r}")
    for letter, text in zip(parts[1::2], parts[2::2], strict=True):
        count = _COUNTS.get(letter.upper(), 0)
        place = 0
        numbers: list[float] = []
        while text[place:].strip(" \t\r\n\f,"):
            flag = letter in "Aa" and len(numbers) % 7 in (3, 4)
            match = (_FLAG if flag else _NUMBER).match(text, place)
            if match is None:
                raise ValueError(f"{text[place:].strip()[:20]!r} after {letter} is no number")
            numbers.append(float(match[1]))
            place = match.end()
        if not np.all(np.isfinite(numbers)):
            raise ValueError(f"the numbers after {letter} are not finite")
        if count == 0:
            if numbers:
                raise ValueError(f"a number follows {letter}")
            yield letter, []
            continue
        if not numbers or len(numbers) % count:
            raise ValueError(f"{letter} takes {count} numbers at a time, not {len(numbers)}")
        for k in range(0, len(numbers), count):
            yield letter, numbers[k : k + count]
            letter = {"M": "L", "m": "l"}.get(letter, letter)


def _merged(segments: list[Segment]) -> list[Segment]:
    """The segments with straight lines that follow each other as one."""
    merged: list[Segment] = []
    run: list[Array] = []
    for segment in [*segments, None]:
        if isinstance(segment, Straight):
            run.append(segment.corners if not run else segment.corners[1:])
            continue
        if run:
            merged.append(Straight(np.concatenate(run)))
            run = []
        if segment is not None:
            merged.append(segment)
    return merged
