"""The ends of the curves of a drawing: which of them are one, and between which an outline has its gap."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .drawing import FLATNESS, Curve, extent


def joints(points: Array, tolerance: float) -> list[tuple[int, int]]:
    """Numbers of the clusters that the ends of each piece belong to, from the ends (2 n, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    near = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    near = near.astype(np.int32)  # scipy 1.11 walks through no others
    links = coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(len(points), len(points)))
    labels = connected_components(links, directed=False)[1].reshape(-1, 2)
    return [(int(u), int(v)) for u, v in labels]


def gap_refusal(
    pieces: Sequence[tuple[Curve, Array]], others: Sequence[Curve], unit: float | None, rule: str, source: str
) -> InputError:
    """The refusal of lines that make no closed contour: both ends of the gap, and what of the others begins there.

    Of the lines that hang together, those with the largest box count; from their loose ends the nearest other end is
    across the gap.

    Args:
        pieces: open curves with their polygons (n, 2); others: curves that are not visible or do not count, each
            with the reason in `aside`.
        unit: length of the drawing's unit [m]; None if it declares none. rule: what is refused.
    """
    ends = np.array([(points[0], points[-1]) for _, points in pieces]).reshape(-1, 2)
    tolerance = FLATNESS * max(extent(points) for _, points in pieces)
    numbers = joints(ends, tolerance)
    counts = Counter(node for pair in numbers for node in pair)
    part = _largest(pieces, numbers)
    # Row 2 k is the begin of piece k, row 2 k + 1 its end.
    loose = [n for n, node in enumerate(np.ravel(numbers).tolist()) if counts[node] == 1]
    pairs = [
        (float(np.hypot(*(ends[a] - ends[b]))), b, a)
        for a in loose
        for b in loose
        if a != b and a // 2 in part and (b < a or b // 2 not in part)
    ]
    if not pairs:  # as where three lines meet in each end
        return InputError(rule, source=source, value=pieces[0][0].place, hint=_ONE)
    gap, first, second = min(pairs)
    digits = int(np.clip(np.log10(max(float(np.abs(ends).max()) / max(gap, 1e-300), 1.0)) + 2, 6, 15))

    def at(n: int) -> str:
        return "[" + ", ".join(f"{value + 0.0:.{digits}g}" for value in ends[n].tolist()) + "]"

    units = "the drawing's units" if unit is None else f"units of {1000 * unit:.6g} mm"
    places = list(dict.fromkeys(pieces[n // 2][0].place for n in (first, second)))
    found = []
    for curve in others:
        there = [n for n in (first, second) if _ends_at(curve, ends[n], tolerance)]
        if there:
            found.append(f"At {at(there[0])} begins {curve.place}, which is left out: {curve.aside}.")
    return InputError(
        f"{rule}: between {at(first)} and {at(second)} is a gap of {gap:.3g} (y up, in {units})",
        source=source,
        value=" and ".join(places),
        hint=" ".join([_ONE, *found[:3]]),
    )


_ONE = "Draw the outline as one closed contour, or choose it by its layer or id: outline: {file: ..., layer: NAME}."


def _largest(pieces: Sequence[tuple[Curve, Array]], numbers: list[tuple[int, int]]) -> set[int]:
    """The pieces of those that hang together around which the box is largest."""
    groups: list[tuple[set[int], set[int]]] = []  # of pieces and of the clusters of their ends
    for k, pair in enumerate(numbers):
        mine, nodes = {k}, set(pair)
        apart = []
        for group in groups:
            if group[1] & nodes:
                mine |= group[0]
                nodes |= group[1]
            else:
                apart.append(group)
        groups = [*apart, (mine, nodes)]

    def box(group: tuple[set[int], set[int]]) -> float:
        return float(np.prod(np.ptp(np.concatenate([pieces[k][1] for k in sorted(group[0])]), axis=0)))

    return max(groups, key=box)[0]


def _ends_at(curve: Curve, point: Array, tolerance: float) -> bool:
    points = curve.points(np.inf)
    return bool(min(np.hypot(*(points[0] - point)), np.hypot(*(points[-1] - point))) <= tolerance)
