"""Finds the one outer contour that the curves of a drawing make."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .drawing import FLATNESS, Curve, Drawing, LeftOut, extent
from .ends import gap_refusal, joints

if TYPE_CHECKING:
    from shapely import Polygon

_ONE = "Draw the outline as one closed contour"
_CHOOSE = "or choose it by its layer or id: outline: {file: ..., layer: NAME}."
# Words in the name of a layer that holds the frame of a sheet.
_FRAMES = ("frame", "border", "title", "sheet", "page", "rahmen", "cadre", "marco", "schriftfeld")
_ROUND = 0.99  # 4π area / perimeter² of what is nearly a circle
_STRAIGHT = 1e-3  # a chain is straight if its box, turned as it likes, is so much thinner than long


@dataclass(frozen=True, eq=False)
class Chain:
    """Curves that meet end to end, each with whether it is passed backwards."""

    parts: tuple[tuple[Curve, bool], ...]
    points: Array  # (n, 2), from end to end; closed: the first point is repeated at the end

    @property
    def place(self) -> str:
        first, more = self.parts[0][0].place, len(self.parts) - 1
        return first if not more else f"{first} and {more} more"

    @property
    def layers(self) -> set[str]:
        return {curve.layer for curve, _ in self.parts}


def outer_contour(drawing: Drawing, source: str, choice: str = "") -> tuple[Array, Chain, list[LeftOut]]:
    """The one closed contour around all others, without a repeated point, shape (n, 2), in the drawing's units.

    With it come the curves that make it, and what was left out.

    Args:
        choice: the layer or id of the curves that count; all if empty.

    Raises:
        InputError: if there is not one such contour, or it is not what is seen; it says what and where.
    """
    curves, left = _chosen(drawing, source, choice)
    for thing in drawing.unreadable:
        if not choice or choice.casefold() in (name.casefold() for name in thing.names):
            hint = "Redraw it with plain lines, hide it, " + _CHOOSE
            raise InputError(f"{thing.place}: {thing.reason}", source=source, hint=hint)
    left = [*drawing.left_out, *left]
    if any(not curve.aside for curve in curves):
        left += [_left(curve, curve.aside) for curve in curves if curve.aside]
        curves = [curve for curve in curves if not curve.aside]
    with np.errstate(invalid="ignore"):  # of what is not finite
        pieces = [(curve, points) for curve in curves if not extent(points := _rough(curve)) <= 0]
    if not pieces:
        raise InputError("the drawing has no lines", source=source, hint=_nothing(left))
    if not all(np.isfinite(points).all() for _, points in pieces):
        raise InputError(
            "the drawing has no extent", source=source, hint="Its coordinates are finite numbers."
        )
    closed, opened = _filled(*_joined(pieces, source))

    def gap(rule: str, chains: list[Chain]) -> InputError:
        used = {id(curve) for curve in curves}
        others = [
            replace(c, aside=c.aside or f"not on {choice}") for c in drawing.curves if id(c) not in used
        ]
        lines = [(chain.parts[0][0], chain.points) for chain in chains]
        return gap_refusal(lines, [*others, *drawing.hidden], drawing.unit, rule, source)

    if not closed:
        raise gap("a line of the drawing is not closed", opened)
    outer = max(closed, key=lambda chain: float(np.prod(np.ptp(chain.points, axis=0))))
    _check_alone(outer, closed, opened, source, gap)
    _check_no_frame(outer, [chain for chain in closed if chain is not outer], source, choice)
    if flaw := next((curve for curve, _ in outer.parts if curve.refusal), None):
        raise InputError(f"{flaw.place}: {flaw.refusal}", source=source, hint=_REDRAW)
    own = {curve.place for curve, _ in outer.parts}  # the width of a line matters where it is the outline's
    left = [part for part in left if not part.reason.startswith("half of the width") or part.place in own]
    left += [LeftOut(c.place, "inside the outline (a hole)", c.points) for c in closed if c is not outer] + [
        LeftOut(c.place, "an open line", c.points) for c in opened
    ]
    tolerance = FLATNESS * extent(outer.points)
    return _traced(outer.parts, lambda curve: curve.points(tolerance))[:-1], outer, left


_REDRAW = "Redraw the outline without it."


def _filled(closed: list[Chain], opened: list[Chain]) -> tuple[list[Chain], list[Chain]]:
    """The same, with open curves that are painted closed by the straight line between their ends, as SVG paints them.

    Where such curves were joined to a contour, and what is painted goes beyond it, the contour is not what is seen.
    """
    from shapely import Polygon

    for k, chain in enumerate(closed):
        if len(chain.parts) > 1 and any(curve.filled for curve, _ in chain.parts):
            shape = Polygon(chain.points).buffer(FLATNESS * extent(chain.points))
            parts = tuple(
                (replace(c, refusal=c.refusal or _BEYOND) if c.filled and _beyond(c, shape) else c, backwards)
                for c, backwards in chain.parts
            )
            closed[k] = Chain(parts, chain.points)
    rest = []
    for chain in opened:
        ((curve, _),) = chain.parts
        if not curve.filled or _is_straight(chain.points):
            rest.append(chain)
            continue
        place = f"{curve.place}, closed by a straight line as its fill is"
        whole = replace(curve, place=place, points=_closing(curve.points))
        closed.append(Chain(((whole, False),), np.concatenate([chain.points, chain.points[:1]])))
    return closed, rest


_BEYOND = "its fill goes beyond the outline of which it is a part (fill: none would take it away)"


def _beyond(curve: Curve, shape: "Polygon") -> bool:
    """Whether the paint of an open curve reaches out of a shape."""
    from shapely import LinearRing

    points = _rough(curve)
    return not _is_straight(points) and not shape.covers(LinearRing(points))


def _closing(points: Callable[[float], Array]) -> Callable[[float], Array]:
    def closed(tolerance: float) -> Array:
        line = points(tolerance)
        return np.concatenate([line, line[:1]])

    return closed


def _is_straight(points: Array) -> bool:
    from shapely.geometry import MultiPoint

    hull = MultiPoint(points).convex_hull
    return bool(hull.area <= _STRAIGHT * hull.length**2)


def _left(curve: Curve, reason: str) -> LeftOut:
    return LeftOut(curve.place, reason, _rough(curve))


def _rough(curve: Curve) -> Array:
    """The polygon of a curve within a part of its own size."""
    size = extent(curve.points(np.inf))
    return curve.points(FLATNESS * size if size > 0 else np.inf)


def _nothing(left: Sequence[LeftOut]) -> str:
    reasons = list(dict.fromkeys(f"{thing.place}: {thing.reason}" for thing in left))
    if not reasons:
        return "Text, images and annotations do not count."
    more = f"; and {len(reasons) - 3} more" if len(reasons) > 3 else ""
    return f"Left out were {'; '.join(reasons[:3])}{more}."


def _chosen(drawing: Drawing, source: str, choice: str) -> tuple[list[Curve], list[LeftOut]]:
    if not choice:
        return drawing.curves, []
    wanted = choice.casefold()
    picked = [c for c in drawing.curves if wanted in (name.casefold() for name in c.names)]
    if not picked:
        known = [name for name in drawing.known if name]
        there = any(name.casefold() == wanted for name in known)
        rule = "nothing visible is on the chosen layer" if there else "the drawing has no such layer or id"
        shown = ", ".join(dict.fromkeys(n for c in drawing.curves for n in c.names if n)) or "no names"
        raise InputError(rule, source=source, value=choice, hint=f"What is visible has: {shown[:300]}.")
    taken = {id(curve) for curve in picked}
    return picked, [_left(c, f"not on {choice}") for c in drawing.curves if id(c) not in taken]


def _joined(pieces: list[tuple[Curve, Array]], source: str) -> tuple[list[Chain], list[Chain]]:
    """Closed and open chains; the lines of one layer are joined first."""
    closed: list[Chain] = []
    rest: list[tuple[Curve, Array]] = []
    for curve, points in pieces:
        if np.hypot(*(points[0] - points[-1])) <= FLATNESS * extent(points) and len(points) > 3:
            closed.append(Chain(((curve, False),), np.concatenate([points[:-1], points[:1]])))
        else:
            rest.append((curve, points))
    size = max((extent(points) for _, points in pieces), default=0.0)
    layers = list(dict.fromkeys(curve.layer for curve, _ in rest))
    # What stays open in its layer may go on in another; sizes, and so tolerances, are known better then.
    groups = [[piece for piece in rest if piece[0].layer == layer] for layer in layers]
    left: list[Chain] = []
    for group in groups:
        cycles, open_chains = _linked(group, FLATNESS * size, source)
        closed += cycles
        left += open_chains
    if left:
        size = max(extent(chain.points) for chain in [*closed, *left])
        parts = {id(part) for chain in left for part, _ in chain.parts}
        again = [piece for piece in rest if id(piece[0]) in parts]
        cycles, left = _linked(again, FLATNESS * size, source)
        closed += cycles
    return closed, left


def _linked(
    pieces: list[tuple[Curve, Array]], tolerance: float, source: str
) -> tuple[list[Chain], list[Chain]]:
    """Closed chains, and open ones, of open curves whose ends nearer than the tolerance are one."""
    pieces = _once([p for p in pieces if extent(p[1]) > tolerance], tolerance)
    if not pieces:
        return [], []
    ends = joints(np.array([(points[0], points[-1]) for _, points in pieces]).reshape(-1, 2), tolerance)
    at: dict[int, list[int]] = {}  # node: the pieces that end there
    for k, (u, v) in enumerate(ends):
        at.setdefault(u, []).append(k)
        at.setdefault(v, []).append(k)
    # Lines that hang at one end are no part of a closed contour.
    hanging: list[int] = []
    loose = [node for node, there in at.items() if len(there) == 1]
    while loose:
        node = loose.pop()
        if len(at[node]) != 1:
            continue
        k = at[node][0]
        hanging.append(k)
        for end in ends[k]:
            at[end].remove(k)
            if len(at[end]) == 1:
                loose.append(end)
    used = set(hanging)
    by_curve = {id(curve): points for curve, points in pieces}
    closed = []
    for k in range(len(pieces)):
        if k in used:
            continue
        walk, node = [], ends[k][0]
        while k not in used:
            used.add(k)
            backwards = ends[k][0] != node
            walk.append((pieces[k][0], bool(backwards)))
            node = ends[k][0] if backwards else ends[k][1]
            if len(at[node]) > 2:
                point = by_curve[id(walk[-1][0])][0 if backwards else -1]
                raise InputError(
                    f"the outline may go either way at [{point[0]:.6g}, {point[1]:.6g}],"
                    f" where {len(at[node])} lines meet",
                    source=source,
                    value=walk[-1][0].place,
                    hint=f"{_ONE}, {_CHOOSE}",
                )
            k = next((other for other in at[node] if other not in used), k)
        closed.append(Chain(tuple(walk), _traced(walk, lambda curve: by_curve[id(curve)])))
    opened = [Chain(((pieces[k][0], False),), pieces[k][1]) for k in sorted(hanging)]
    return closed, opened


def _once(pieces: list[tuple[Curve, Array]], tolerance: float) -> list[tuple[Curve, Array]]:
    """The pieces without those that are drawn twice, in either sense."""
    if len(pieces) < 2:
        return pieces
    from scipy.spatial import cKDTree

    # A quarter, the middle and three quarters of the length, those of one sense only.
    keys = []
    for _, points in pieces:
        s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        at = [np.interp(f * s[-1], s, points[:, k]) for f in (0.0, 0.25, 0.5, 0.75, 1.0) for k in (0, 1)]
        row = np.array(at).reshape(5, 2)
        # A sense that rounding does not change: of the larger difference of the ends.
        step = row[-1] - row[0]
        back = step[int(np.argmax(np.abs(step) > 0.5 * np.max(np.abs(step))))] < 0
        keys.append((row[::-1] if back else row).ravel())
    twins = cKDTree(np.array(keys)).query_pairs(2 * tolerance, output_type="ndarray")
    repeated = set(twins.max(axis=1).tolist()) if len(twins) else set()
    return [piece for k, piece in enumerate(pieces) if k not in repeated]


def _traced(parts: Sequence[tuple[Curve, bool]], points: Callable[[Curve], Array]) -> Array:
    """The polygon along the parts of a closed chain, the first point repeated at the end."""
    whole = []
    for curve, backwards in parts:
        line = points(curve)
        whole.append((line[::-1] if backwards else line)[:-1])
    return np.concatenate([*whole, whole[0][:1]])


def _check_alone(
    outer: Chain,
    closed: list[Chain],
    opened: list[Chain],
    source: str,
    gap: Callable[[str, list[Chain]], InputError],
) -> None:
    """Refuses contours outside the outer one, and open lines that may be the true outline; gap: says where it is."""
    from shapely import LineString, Polygon, box
    from shapely.geometry import MultiPoint

    shell = Polygon(outer.points)
    if not shell.is_valid:
        return  # refused with a better reason when it becomes an outline
    around = shell.buffer(FLATNESS * extent(outer.points))
    outside = [c for c in closed if c is not outer and not around.covers(LineString(c.points))]
    flawed = next((part for c in outside for part, _ in c.parts if part.refusal), None)
    if flawed is not None:
        raise InputError(f"{flawed.place}: {flawed.refusal}", source=source, hint=_REDRAW)
    if outside:
        shapes = [Polygon(c.points).buffer(FLATNESS * extent(c.points)) for c in outside]
        outside = [
            c
            for c in outside
            if not any(
                d is not c and s.covers(LineString(c.points)) for d, s in zip(outside, shapes, strict=True)
            )
        ]
        raise InputError(
            f"the drawing has {len(outside) + 1} outer contours, not one:"
            f" {'; '.join(c.place for c in [outer, *outside][:4])}",
            source=source,
            hint=f"{_ONE}, {_CHOOSE}",
        )
    apart: dict[str, Array] = {}  # the boxes around the open lines of each layer, as two corners
    for chain in opened:
        line = LineString(chain.points)
        surrounds = not _is_straight(chain.points) and MultiPoint(chain.points).convex_hull.covers(shell)
        if not surrounds and line.intersects(shell):
            continue
        layer = chain.parts[0][0].layer
        known = np.concatenate([chain.points, apart.get(layer, chain.points[:1])])
        apart[layer] = np.array([known.min(axis=0), known.max(axis=0)])
        if surrounds or box(*apart[layer].ravel()).covers(shell):
            around_it = [c for c in opened if c.parts[0][0].layer == layer]
            raise gap("lines around the only closed contour are not closed", around_it)


def _check_no_frame(outer: Chain, others: list[Chain], source: str, choice: str) -> None:
    """Refuses a rectangle around contours of other layers that may be the frame of the sheet."""
    from shapely import Polygon

    corners = outer.points[:-1]
    sides = np.abs(np.diff(outer.points, axis=0))
    upright = bool(np.all(np.min(sides, axis=1) <= FLATNESS * extent(corners)))
    if choice or not others or not upright or len(corners) > 8:
        return
    layer = next(iter(outer.layers))
    alone = bool(layer) and not any(outer.layers & c.layers for c in others)
    named = any(word in name.casefold() for name in outer.parts[0][0].names for word in _FRAMES)
    # A hole that is no circle has no contours in it; a part in a frame has its holes. Of letters, which have too,
    # there are several: on the layer of the outline one such contour is suspect, on others any.
    inner = [shape for c in others if (shape := Polygon(c.points)).is_valid]
    nested = [
        a
        for a in inner
        if a.area < _ROUND * a.length**2 / (4 * np.pi) and any(b is not a and a.contains(b) for b in inner)
    ]
    nested = [a for a in nested if not any(b is not a and b.contains(a) for b in nested)]
    if named or (nested and (alone or len(nested) == 1)):
        inside = sorted(set().union(*(c.layers for c in others)) - {""})
        layers = f" Inside it are contours on {', '.join(inside)}." if inside else ""
        raise InputError(
            f"the outer contour may be the frame of the sheet: {outer.place}",
            source=source,
            hint="Choose the outline by its layer or id: outline: {file: ..., layer: NAME}." + layers,
        )
