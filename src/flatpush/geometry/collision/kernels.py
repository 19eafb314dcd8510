"""Compiled clearances of a body at a pose, along an arc and along a straight line; plain.py explains them.

Everything is decided in the body's frame: there its points stand still, and it is the obstacles that move. Only what
comes nearer than `reach` is looked at, and the search ends where less than `need` is found. A pose comes as x, y
and the cosine c and sine s of its angle.
"""

import math
from typing import NamedTuple

from ...compiled import inner, kernel, shared
from ..outline import Outline
from ..pose import Array
from .body import Body, BodyArrays
from .world import Box, World, WorldArrays

FULL_TURN = 2 * math.pi
FEW = 8  # features that are all looked at; more are found through the grid
OVERLAP = -math.inf  # of shapes that overlap, where no depth is known
TOUCH = 1e-9  # what crosses by less than this touches [m]
# A piece of an arc turns by at most one over this [rad], so that the box around it is hardly larger than the body's.
PIECES_PER_RADIAN = 1.2
WORLD, BODY = World.of().arrays, Body.of(Outline.circle(1.0)).arrays  # examples, for their types


class Turn(NamedTuple):
    """A turn of a body.

    Attributes:
        x, y: centre in W [m]; qx, qy: in the body [m].
        c, s: of the body's angle where the turn begins; cp, sp: of the turn; sweep: the turn [rad].
        low, high: least and largest distance of the body's points from the centre [m].
    """

    x: float
    y: float
    qx: float
    qy: float
    c: float
    s: float
    cp: float
    sp: float
    sweep: float
    low: float
    high: float


@inner
def point_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float, inverse: float) -> float:
    """Squared distance of a point from a segment; inverse: one over its squared length, 0 for a point."""
    dx, dy, x, y = bx - ax, by - ay, px - ax, py - ay
    t = (x * dx + y * dy) * inverse
    t = min(1.0, max(0.0, t))
    x, y = x - t * dx, y - t * dy
    return x * x + y * y


@inner
def crosses(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> bool:
    """Whether two segments cross in inner points of both."""
    abx, aby, cdx, cdy = bx - ax, by - ay, dx - cx, dy - cy
    u = abx * (cy - ay) - aby * (cx - ax)
    v = abx * (dy - ay) - aby * (dx - ax)
    w = cdx * (ay - cy) - cdy * (ax - cx)
    z = cdx * (by - cy) - cdy * (bx - cx)
    return (u > 0.0) != (v > 0.0) and (w > 0.0) != (z > 0.0) and u * v < 0.0 and w * z < 0.0


@inner
def within(x: float, y: float, sx: float, sy: float, ex: float, ey: float, sweep: float) -> bool:
    """Whether a direction lies on the counter-clockwise way from s to e, which sweeps an angle up to a turn."""
    if sweep <= math.pi:
        return sx * y - sy * x >= 0.0 and x * ey - y * ex >= 0.0
    return sweep >= FULL_TURN or not (ex * y - ey * x > 0.0 and x * sy - y * sx > 0.0)


@inner
def arc_segment(
    sx: float, sy: float, ex: float, ey: float, sweep: float, radius: float,
    ax: float, ay: float, bx: float, by: float, inverse: float,
) -> float:  # fmt: skip
    """Distance of a segment (or a point, with inverse 0) from the arc about the origin, counter-clockwise from s to e.

    OVERLAP if they cross.
    """
    dx, dy = bx - ax, by - ay
    along = -(ax * dx + ay * dy) * inverse
    best = min(point_segment(sx, sy, ax, ay, bx, by, inverse), point_segment(ex, ey, ax, ay, bx, by, inverse))
    best = math.sqrt(best)
    fx, fy = ax + along * dx, ay + along * dy
    foot = fx * fx + fy * fy
    square = radius * radius
    if foot < square and inverse > 0.0:
        h = math.sqrt((square - foot) * inverse)
        for side in range(2):
            t = along + h if side == 0 else along - h
            x, y = ax + t * dx, ay + t * dy
            if 0.0 <= t <= 1.0 and within(x, y, sx, sy, ex, ey, sweep):
                ends = min(
                    min(math.hypot(x - ax, y - ay), math.hypot(x - bx, y - by)),
                    min(math.hypot(x - sx, y - sy), math.hypot(x - ex, y - ey)),
                )
                if ends > TOUCH and radius - math.sqrt(foot) > TOUCH:
                    return OVERLAP
                best = 0.0
    elif 0.0 < along < 1.0 and within(fx, fy, sx, sy, ex, ey, sweep):
        best = min(best, math.sqrt(foot) - radius)
    if within(ax, ay, sx, sy, ex, ey, sweep):
        best = min(best, abs(math.sqrt(ax * ax + ay * ay) - radius))
    if within(bx, by, sx, sy, ex, ey, sweep):
        best = min(best, abs(math.sqrt(bx * bx + by * by) - radius))
    return best


@inner
def segment_segment(
    sx: float, sy: float, ex: float, ey: float, one: float,
    ax: float, ay: float, bx: float, by: float, other: float,
) -> float:  # fmt: skip
    """Distance of two segments with the inverses of their squared lengths; OVERLAP if they cross."""
    best = min(point_segment(sx, sy, ax, ay, bx, by, other), point_segment(ex, ey, ax, ay, bx, by, other))
    best = min(best, point_segment(ax, ay, sx, sy, ex, ey, one), point_segment(bx, by, sx, sy, ex, ey, one))
    if crosses(sx, sy, ex, ey, ax, ay, bx, by):
        return OVERLAP if best > TOUCH * TOUCH else 0.0
    return math.sqrt(best)


@inner
def _cell(W: WorldArrays, x: float, y: float) -> tuple[int, int]:
    grid = W.grid
    i = min(max((x - grid.x) * grid.per_metre, 0.0), grid.columns - 1.0)
    j = min(max((y - grid.y) * grid.per_metre, 0.0), grid.rows - 1.0)
    return int(i), int(j)


@inner
def _gather(W: WorldArrays, xmin: float, ymin: float, xmax: float, ymax: float) -> int:
    """Puts the numbers of the features that may meet a box into W.near; returns how many."""
    n = len(W.features)
    if n <= FEW:
        for f in range(n):
            W.near[f] = f
        return n
    starts, items, stamps, width = W.starts, W.items, W.stamps, W.grid.columns
    i0, j0 = _cell(W, xmin, ymin)
    i1, j1 = _cell(W, xmax, ymax)
    stamps[n] += 1
    stamp, count = stamps[n], 0
    for j in range(j0, j1 + 1):
        for k in range(starts[j * width + i0], starts[j * width + i1 + 1]):
            f = items[k]
            if stamps[f] != stamp:
                stamps[f] = stamp
                W.near[count] = f
                count += 1
    return count


@inner
def occupied(W: WorldArrays, x: float, y: float) -> bool:
    """Whether a point is inside a polygon: from the winding number of a point in its cell, and the edges between."""
    features, grid, starts, items = W.features, W.grid, W.starts, W.items
    if W.edges == 0:
        return False
    u, v = (x - grid.x) * grid.per_metre, (y - grid.y) * grid.per_metre
    if u < 0.0 or v < 0.0 or u >= grid.columns or v >= grid.rows:
        return False
    i, j = int(u), int(v)
    cell = j * grid.columns + i
    count = W.winding[cell]
    rx, ry = grid.x + (i + grid.u) / grid.per_metre, grid.y + (j + grid.v) / grid.per_metre
    dx, dy = x - rx, y - ry
    for k in range(starts[cell], starts[cell + 1]):
        f = items[k]
        if f >= W.edges:
            continue
        ax, ay, bx, by = features[f].ax, features[f].ay, features[f].bx, features[f].by
        a = dx * (ay - ry) - dy * (ax - rx)
        b = dx * (by - ry) - dy * (bx - rx)
        if (a > 0.0) == (b > 0.0):
            continue
        ex, ey = bx - ax, by - ay
        r = ex * (ry - ay) - ey * (rx - ax)
        p = ex * (y - ay) - ey * (x - ax)
        if (r > 0.0) != (p > 0.0):
            count += 1 if p > 0.0 else -1
    return count != 0


@inner
def _feature_gap(
    W: WorldArrays, B: BodyArrays, f: int, x: float, y: float, c: float, s: float, reach: float
) -> float:
    """Clearance of the body at a pose from one feature."""
    F, P, corners = W.features[f], B.points, B.corners
    dx, dy = F.ax - x, F.ay - y
    ax, ay = c * dx + s * dy, c * dy - s * dx
    edge = f < W.edges
    bx, by, inverse, r = ax, ay, 0.0, F.radius
    if edge:
        dx, dy = F.bx - x, F.by - y
        bx, by = c * dx + s * dy, c * dy - s * dx
        inverse = F.inverse
    best = reach
    limit = B.reach + reach + r
    if point_segment(B.x, B.y, ax, ay, bx, by, inverse) > limit * limit:
        return best
    inside, square = False, math.inf
    for k in range(corners):
        n = k + 1 if k + 1 < corners else 0
        px, py, qx, qy = P[k].x, P[k].y, P[n].x, P[n].y
        square = min(square, point_segment(ax, ay, px, py, qx, qy, P[k].inverse))
        if edge:
            square = min(square, point_segment(px, py, ax, ay, bx, by, inverse))
            if crosses(ax, ay, bx, by, px, py, qx, qy):
                return OVERLAP
        if (py > ay) != (qy > ay) and ax < px + (ay - py) * (qx - px) / (qy - py):
            inside = not inside
    if inside:
        return OVERLAP
    best = min(best, math.sqrt(square) - r)
    for k in range(corners, len(P)):
        square = point_segment(P[k].x, P[k].y, ax, ay, bx, by, inverse)
        best = min(best, math.sqrt(square) - r - P[k].radius)
    return best


@shared(0.0, WORLD, BODY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
def still_gap(
    W: WorldArrays, B: BodyArrays, x: float, y: float, c: float, s: float, reach: float, need: float
) -> float:
    """Clearance of the body at a pose, at most `reach`; negative where it overlaps or leaves the bounds."""
    P, bounds = B.points, W.bounds
    best = reach
    for k in range(len(P)):
        px, py = x + c * P[k].x - s * P[k].y, y + s * P[k].x + c * P[k].y
        gap = min(min(px - bounds.xmin, py - bounds.ymin), min(bounds.xmax - px, bounds.ymax - py))
        best = min(best, gap - P[k].radius)
    if best < need:
        return best
    bx, by, far = x + c * B.x - s * B.y, y + s * B.x + c * B.y, B.reach + reach
    for k in range(_gather(W, bx - far, by - far, bx + far, by + far)):
        best = min(best, _feature_gap(W, B, W.near[k], x, y, c, s, best))
        if best < need:
            return best
    for k in range(len(P)):
        if (k == 0 or k >= B.corners) and occupied(
            W, x + c * P[k].x - s * P[k].y, y + s * P[k].x + c * P[k].y
        ):
            return OVERLAP
    return best


@inner
def _feature_arc(W: WorldArrays, B: BodyArrays, f: int, turn: Turn, reach: float, need: float) -> float:
    """The least clearance from one feature along a turn."""
    F, P, corners = W.features[f], B.points, B.corners
    c, s, cp, sp, sweep = turn.c, turn.s, turn.cp, turn.sp, turn.sweep
    dx, dy = F.ax - turn.x, F.ay - turn.y
    ax, ay = c * dx + s * dy, c * dy - s * dx
    r = F.radius
    best = reach
    ra = math.sqrt(ax * ax + ay * ay)
    size = abs(sweep)
    edge = f < W.edges
    bx, by, inverse, near, far = ax, ay, 0.0, ra, ra
    if edge:
        dx, dy = F.bx - turn.x, F.by - turn.y
        bx, by = c * dx + s * dy, c * dy - s * dx
        inverse = F.inverse
        near = math.sqrt(point_segment(0.0, 0.0, ax, ay, bx, by, inverse))
        far = max(ra, math.sqrt(bx * bx + by * by))
    if near - r > turn.high + reach or far + r < turn.low - reach:
        return best
    # The start of the feature seen from the body, as it turns the other way.
    tx, ty = cp * ax + sp * ay, cp * ay - sp * ax
    fx, fy, gx, gy = (tx, ty, ax, ay) if sweep > 0.0 else (ax, ay, tx, ty)
    for k in range(len(P)):
        px, py = P[k].x - turn.qx, P[k].y - turn.qy
        rp, wide = math.sqrt(px * px + py * py), P[k].radius + r
        if k < corners:
            n = k + 1 if k + 1 < corners else 0
            ox, oy = P[n].x - turn.qx, P[n].y - turn.qy
            nearest = math.sqrt(point_segment(0.0, 0.0, px, py, ox, oy, P[k].inverse))
            farthest = max(rp, math.sqrt(ox * ox + oy * oy))
            if ra >= nearest - r - best and ra <= farthest + r + best:
                gap = arc_segment(fx, fy, gx, gy, size, ra, px, py, ox, oy, P[k].inverse)
                best = min(best, gap - r)
        if (edge or k >= corners) and rp >= near - wide - best and rp <= far + wide + best:
            sx, sy = px, py
            ex, ey = cp * px - sp * py, sp * px + cp * py
            if sweep < 0.0:
                sx, sy, ex, ey = ex, ey, px, py
            best = min(best, arc_segment(sx, sy, ex, ey, size, rp, ax, ay, bx, by, inverse) - wide)
        if best < need:
            return best
    return best


@inner
def _feature_line(
    W: WorldArrays, B: BodyArrays, f: int, x: float, y: float, c: float, s: float, dx: float, dy: float,
    reach: float, need: float,
) -> float:  # fmt: skip
    """The least clearance from one feature along a straight line (dx, dy), seen in the body."""
    F, P, corners = W.features[f], B.points, B.corners
    hx, hy = F.ax - x, F.ay - y
    ax, ay = c * hx + s * hy, c * hy - s * hx
    r, edge = F.radius, f < W.edges
    bx, by, inverse = ax, ay, 0.0
    if edge:
        hx, hy = F.bx - x, F.by - y
        bx, by = c * hx + s * hy, c * hy - s * hx
        inverse = F.inverse
    best = reach
    one = 1.0 / (dx * dx + dy * dy)
    near = segment_segment(B.x, B.y, B.x + dx, B.y + dy, one, ax, ay, bx, by, inverse)
    if near - r > B.reach + reach:
        return best
    for k in range(len(P)):
        px, py = P[k].x, P[k].y
        if k < corners:
            n = k + 1 if k + 1 < corners else 0
            gap = segment_segment(ax - dx, ay - dy, ax, ay, one, px, py, P[n].x, P[n].y, P[k].inverse)
            best = min(best, gap - r)
        if edge or k >= corners:
            gap = segment_segment(px, py, px + dx, py + dy, one, ax, ay, bx, by, inverse)
            best = min(best, gap - r - P[k].radius)
        if best < need:
            return best
    return best


@inner
def _bounds_arc(bounds: Box, B: BodyArrays, turn: Turn, best: float) -> float:
    """Clearance of the turning body from the sides of the bounds."""
    size = abs(turn.sweep)
    for k in range(len(B.points)):
        p = B.points[k]
        lx, ly = p.x - turn.qx, p.y - turn.qy
        sx, sy = turn.c * lx - turn.s * ly, turn.s * lx + turn.c * ly
        ex, ey = turn.cp * sx - turn.sp * sy, turn.sp * sx + turn.cp * sy
        radius = math.hypot(lx, ly)
        right, left, top, bottom = max(sx, ex), min(sx, ex), max(sy, ey), min(sy, ey)
        if turn.sweep < 0.0:
            sx, sy, ex, ey = ex, ey, sx, sy
        right = radius if within(1.0, 0.0, sx, sy, ex, ey, size) else right
        left = -radius if within(-1.0, 0.0, sx, sy, ex, ey, size) else left
        top = radius if within(0.0, 1.0, sx, sy, ex, ey, size) else top
        bottom = -radius if within(0.0, -1.0, sx, sy, ex, ey, size) else bottom
        gap = min(
            min(turn.x + left - bounds.xmin, turn.y + bottom - bounds.ymin),
            min(bounds.xmax - turn.x - right, bounds.ymax - turn.y - top),
        )
        best = min(best, gap - p.radius)
    return best


@shared(0.0, WORLD, BODY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
def arc_gap(
    W: WorldArrays, B: BodyArrays, x: float, y: float, c: float, s: float, qx: float, qy: float, sweep: float,
    reach: float, need: float,
) -> float:  # fmt: skip
    """The least clearance while a body turns about its point q by an angle, from a pose in which it is free."""
    P, bounds, corners = B.points, W.bounds, B.corners
    Qx, Qy = x + c * qx - s * qy, y + s * qx + c * qy
    low, high = math.inf, 0.0
    for k in range(len(P)):
        radius = math.hypot(P[k].x - qx, P[k].y - qy)
        high = max(high, radius + P[k].radius)
        if k < corners:
            n = k + 1 if k + 1 < corners else 0
            low = min(low, math.sqrt(point_segment(qx, qy, P[k].x, P[k].y, P[n].x, P[n].y, P[k].inverse)))
        else:
            low = min(low, radius - P[k].radius)
    best = reach
    side = min(min(Qx - bounds.xmin, Qy - bounds.ymin), min(bounds.xmax - Qx, bounds.ymax - Qy))
    if side < high + reach:
        turn = Turn(Qx, Qy, qx, qy, c, s, math.cos(sweep), math.sin(sweep), sweep, low, high)
        best = _bounds_arc(bounds, B, turn, best)
        if best < need:
            return best
    # In pieces, so that each looks only at what is near.
    lx, ly = B.x - qx, B.y - qy
    arm = math.hypot(lx, ly)
    pieces = 1
    if len(W.features) > FEW:
        pieces += int(abs(sweep) * max(PIECES_PER_RADIAN, arm / (2.0 * B.reach)))
    angle = sweep / pieces
    cp, sp = math.cos(angle), math.sin(angle)
    far = B.reach + reach + arm * (1.0 - math.cos(0.5 * angle))
    for _ in range(pieces):
        turn = Turn(Qx, Qy, qx, qy, c, s, cp, sp, angle, low, high)
        sx, sy = c * lx - s * ly, s * lx + c * ly
        ex, ey = cp * sx - sp * sy, sp * sx + cp * sy
        count = _gather(
            W, Qx + min(sx, ex) - far, Qy + min(sy, ey) - far, Qx + max(sx, ex) + far, Qy + max(sy, ey) + far
        )
        for k in range(count):
            best = min(best, _feature_arc(W, B, W.near[k], turn, best, need))
            if best < need:
                return best
        c, s = c * cp - s * sp, s * cp + c * sp
    return best


@shared(0.0, WORLD, BODY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
def line_gap(
    W: WorldArrays, B: BodyArrays, x: float, y: float, c: float, s: float, dx: float, dy: float,
    reach: float, need: float,
) -> float:  # fmt: skip
    """The least clearance while a body moves straight by (dx, dy), seen in the body, from a free pose."""
    P, bounds = B.points, W.bounds
    best = reach
    wx, wy = c * dx - s * dy, s * dx + c * dy
    for k in range(len(P)):
        px, py = x + c * P[k].x - s * P[k].y, y + s * P[k].x + c * P[k].y
        gap = min(
            min(px + min(wx, 0.0) - bounds.xmin, py + min(wy, 0.0) - bounds.ymin),
            min(bounds.xmax - px - max(wx, 0.0), bounds.ymax - py - max(wy, 0.0)),
        )
        best = min(best, gap - P[k].radius)
    if best < need:
        return best
    pieces = 1
    if len(W.features) > FEW:
        pieces += int(math.hypot(dx, dy) / (2.0 * B.reach))
    dx, dy, wx, wy = dx / pieces, dy / pieces, wx / pieces, wy / pieces
    far = B.reach + reach
    for _ in range(pieces):
        bx, by = x + c * B.x - s * B.y, y + s * B.x + c * B.y
        count = _gather(
            W,
            bx + min(wx, 0.0) - far,
            by + min(wy, 0.0) - far,
            bx + max(wx, 0.0) + far,
            by + max(wy, 0.0) + far,
        )
        for k in range(count):
            best = min(best, _feature_line(W, B, W.near[k], x, y, c, s, dx, dy, best, need))
            if best < need:
                return best
        x, y = x + wx, y + wy
    return best


@kernel()
def pose_gap(W: WorldArrays, B: BodyArrays, pose: Array, reach: float, need: float) -> float:
    """Clearance of the body at a pose X_WO, at most `reach`; negative where it overlaps or leaves the bounds."""
    return still_gap(W, B, pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2]), reach, need)


@kernel()
def twist_gap(W: WorldArrays, B: BodyArrays, start: Array, step: Array, reach: float, need: float) -> float:
    """The least clearance along start · exp(t step), 0 ≤ t ≤ 1, from a pose in which the body is free."""
    x, y, c, s = start[0], start[1], math.cos(start[2]), math.sin(start[2])
    if step[2] != 0.0:
        return arc_gap(W, B, x, y, c, s, -step[1] / step[2], step[0] / step[2], step[2], reach, need)
    if step[0] == 0.0 and step[1] == 0.0:
        return still_gap(W, B, x, y, c, s, reach, need)
    return line_gap(W, B, x, y, c, s, step[0], step[1], reach, need)
