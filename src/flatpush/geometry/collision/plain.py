"""The same clearances in plain numpy, pair by pair and without a grid: what explains and tests kernels.py.

A point p of the body that turns about the body point q by the angle φ runs on an arc; seen from the body a point of an
obstacle does so the other way round. Between polygons that do not overlap the least distance is one of a corner and
an edge, so it suffices to know how near an arc comes to a segment. It comes nearest at one of

* its own ends,
* the direction of an end of the segment, seen from the centre, if it runs through that,
* the foot of the perpendicular from the centre onto the segment, if that is outside the circle, else where circle and
  segment meet, at distance zero.
"""

from collections.abc import Iterator

import numpy as np

from ..outline import Outline
from ..pose import Array, compose, exp, inverse, relative, transform
from .body import Body
from .world import World


def arc_points(p: Array, centre: Array | None, move: Array | float, segment: Array) -> Array:
    """Fractions of an arc (a straight line without a centre) at which it may come nearest to a segment (2, 2)."""
    a, b = segment
    if centre is None:
        d = np.asarray(move)
        length2 = float(d @ d)
        found = [0.0, 1.0, float((a - p) @ d) / length2, float((b - p) @ d) / length2]
        side = b - a
        rise = float(d[0] * side[1] - d[1] * side[0])
        if abs(rise) > 0:
            found.append(float((a - p)[0] * side[1] - (a - p)[1] * side[0]) / rise)
        return np.clip(found, 0.0, 1.0)
    sweep = float(np.asarray(move))
    directions = [a - centre, b - centre]
    side = b - a
    length2 = float(side @ side)
    radius = float(np.hypot(*(p - centre)))
    if length2 > 0:
        along = float((centre - a) @ side) / length2
        foot = a + along * side - centre
        off = float(np.hypot(*foot))
        directions.append(foot)
        if off < radius:
            h = np.sqrt((radius**2 - off**2) / length2)
            directions += [foot + h * side, foot - h * side]
    begin = np.arctan2(*(p - centre)[::-1])
    angles = np.array([np.arctan2(d[1], d[0]) for d in directions]) - begin
    found = np.remainder(angles * np.sign(sweep), 2 * np.pi) / abs(sweep)
    return np.array([0.0, 1.0, *found[found <= 1.0]])


def twist_clearance(world: World, body: Body, start: Array, step: Array) -> tuple[float, float, int]:
    """The least clearance along start · exp(t step) without overlap at the start: distance, fraction t, obstacle."""
    return min(
        _pairs(world, body, np.asarray(start, float), np.asarray(step, float)), default=(np.inf, 0.0, -2)
    )


def place(
    world: World, body: Body, start: Array, step: Array, distance: float, reach: float
) -> tuple[float, int]:
    """Where along a twist a known clearance is met, and with what."""
    if not np.isfinite(distance):
        inside = [i for i, o in enumerate(world.obstacles) if _overlaps(o, body, np.asarray(start, float))]
        if inside:
            return 0.0, inside[0]
        # What overlaps on the way crosses something first, at a distance of nothing or less.
        return twist_clearance(world, body, start, step)[1:]
    if distance >= reach:
        return 0.0, -2
    _, fraction, obstacle = min(
        _pairs(world, body, np.asarray(start, float), np.asarray(step, float)),
        key=lambda p: abs(p[0] - distance),
    )
    return fraction, obstacle


def _overlaps(obstacle: Outline, body: Body, pose: Array) -> bool:
    """Whether a body at a pose overlaps an obstacle, as shapely sees it; circles as polygons."""
    import shapely

    other = shapely.Polygon(obstacle.polyline(1e-6))
    shapes = [shapely.Polygon(transform(pose, body.outline.polyline(1e-6)))]
    shapes += [shapely.Point(*tip).buffer(body.radius) for tip in transform(pose, body.discs)]
    return any(s.intersection(other).area > 0 for s in shapes)


def _pairs(world: World, body: Body, start: Array, step: Array) -> Iterator[tuple[float, float, int]]:
    """(distance, fraction, obstacle) of every pair of features."""
    points, corners, *_ = body.arrays
    turning = bool(step[2] != 0)
    centre = np.array([-step[1], step[0]]) / step[2] if turning else None
    Q = transform(start, centre) if centre is not None else None
    move: Array | float = float(step[2]) if turning else transform([0, 0, start[2]], step[:2])
    still = not turning and not np.any(step)
    back: Array | float = float(-step[2]) if turning else -step[:2]
    for x, y, r, _ in points.tolist():
        p = transform(start, [x, y])
        xmin, ymin, xmax, ymax = world.bounds
        for bound, axis, sign in ((xmin, 0, 1), (ymin, 1, 1), (xmax, 0, -1), (ymax, 1, -1)):
            if not np.isfinite(bound):
                continue
            at = [0.0, 1.0]
            if Q is not None:
                far = (np.pi if sign > 0 else 0.0) + (0.5 * np.pi if axis else 0.0)
                begin = np.arctan2(*(p - Q)[::-1])
                t = np.remainder((far - begin) * np.sign(step[2]), 2 * np.pi) / abs(step[2])
                at += [float(t)] if t <= 1 else []
            for t in at:
                value = transform(compose(start, exp(t * step)), [x, y])[axis]
                yield sign * float(value - bound) - r, t, -1
    for f, row in enumerate(world.features):
        segment = np.array([(row["ax"], row["ay"]), (row["bx"], row["by"])])
        r, owner = float(row["radius"]), int(world.owners[f])
        for x, y, radius, _ in (points if f < world.edges else points[corners:]).tolist():
            p = transform(start, [x, y])
            for t in [0.0] if still else arc_points(p, Q, move, segment):
                q = transform(compose(start, exp(t * step)), [x, y])
                yield _distance(q, segment) - radius - r, float(t), owner
        seen = transform(inverse(start), segment[0])
        for k in range(corners):
            edge = body.outline.vertices[[k, (k + 1) % corners]]
            for t in [0.0] if still else arc_points(seen, centre, back, edge):
                q = transform(relative(compose(start, exp(t * step)), np.zeros(3)), segment[0])
                yield _distance(q, edge) - r, float(t), owner


def _distance(p: Array, segment: Array) -> float:
    a, d = segment[0], segment[1] - segment[0]
    length2 = float(d @ d)
    t = 0.0 if length2 == 0 else min(1.0, max(0.0, float((p - a) @ d) / length2))
    return float(np.hypot(*(p - a - t * d)))
