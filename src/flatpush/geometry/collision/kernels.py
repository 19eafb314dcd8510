"""Compiled clearances of a body at a pose, along an arc and along a straight way; plain.py explains them.

A world comes as a tuple (features, edges, bounds, grid, starts, items, winding, stamps), see World.arrays; a body as
its points (n, 4) and a tuple (corners, x, y, radius), see Body.arrays. Everything is decided in the body's frame:
there its points stand still, and it is the obstacles that move. Only what comes nearer than `reach` is looked at, and
the search ends where less than `need` is found.
"""

import math
from typing import Any

import numba as nb

from ..pose import Array

TURN = 2 * math.pi
FEW = 8  # features that are all looked at; more are found through the grid
INSIDE = -math.inf  # of shapes that overlap, where no depth is known
TOUCH = 1e-9  # what crosses by less than this touches [m]
part = nb.njit(forceinline=True, error_model="numpy")
inner = nb.njit(error_model="numpy")
outer = nb.njit(cache=True, nogil=True, error_model="numpy")


@part
def point_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float, inverse: float) -> float:
    """Squared distance of a point from a segment; inverse: one over its squared length, 0 for a point."""
    dx, dy, x, y = bx - ax, by - ay, px - ax, py - ay
    t = (x * dx + y * dy) * inverse
    t = min(1.0, max(0.0, t))
    x, y = x - t * dx, y - t * dy
    return x * x + y * y


@part
def crosses(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> bool:
    """Whether two segments cross in inner points of both."""
    abx, aby, cdx, cdy = bx - ax, by - ay, dx - cx, dy - cy
    u = abx * (cy - ay) - aby * (cx - ax)
    v = abx * (dy - ay) - aby * (dx - ax)
    w = cdx * (ay - cy) - cdy * (ax - cx)
    z = cdx * (by - cy) - cdy * (bx - cx)
    return (u > 0.0) != (v > 0.0) and (w > 0.0) != (z > 0.0) and u * v < 0.0 and w * z < 0.0


@part
def within(x: float, y: float, sx: float, sy: float, ex: float, ey: float, sweep: float) -> bool:
    """Whether a direction lies on the counter-clockwise way from s to e, which sweeps an angle up to a turn."""
    if sweep <= math.pi:
        return sx * y - sy * x >= 0.0 and x * ey - y * ex >= 0.0
    return sweep >= TURN or not (ex * y - ey * x > 0.0 and x * sy - y * sx > 0.0)


@inner
def arc_segment(
    sx: float, sy: float, ex: float, ey: float, sweep: float, radius: float,
    ax: float, ay: float, bx: float, by: float, inverse: float,
) -> float:  # fmt: skip
    """Distance of a segment from the arc about the origin, counter-clockwise from s to e; INSIDE if they cross."""
    dx, dy = bx - ax, by - ay
    along = -(ax * dx + ay * dy) * inverse
    best = min(point_segment(sx, sy, ax, ay, bx, by, inverse), point_segment(ex, ey, ax, ay, bx, by, inverse))
    best = math.sqrt(best)
    fx, fy = ax + along * dx, ay + along * dy
    foot = fx * fx + fy * fy
    square = radius * radius
    if foot < square:
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
                    return INSIDE
                best = 0.0
    elif 0.0 < along < 1.0 and within(fx, fy, sx, sy, ex, ey, sweep):
        best = min(best, math.sqrt(foot) - radius)
    if within(ax, ay, sx, sy, ex, ey, sweep):
        best = min(best, abs(math.sqrt(ax * ax + ay * ay) - radius))
    if within(bx, by, sx, sy, ex, ey, sweep):
        best = min(best, abs(math.sqrt(bx * bx + by * by) - radius))
    return best


@inner
def arc_point(
    sx: float, sy: float, ex: float, ey: float, sweep: float, radius: float, px: float, py: float
) -> float:
    """Distance of a point from such an arc."""
    if within(px, py, sx, sy, ex, ey, sweep):
        return abs(math.sqrt(px * px + py * py) - radius)
    return min(math.hypot(px - sx, py - sy), math.hypot(px - ex, py - ey))


@inner
def segment_segment(
    sx: float, sy: float, ex: float, ey: float, one: float,
    ax: float, ay: float, bx: float, by: float, other: float,
) -> float:  # fmt: skip
    """Distance of two segments with the inverses of their squared lengths; INSIDE if they cross."""
    best = min(point_segment(sx, sy, ax, ay, bx, by, other), point_segment(ex, ey, ax, ay, bx, by, other))
    best = min(best, point_segment(ax, ay, sx, sy, ex, ey, one), point_segment(bx, by, sx, sy, ex, ey, one))
    if crosses(sx, sy, ex, ey, ax, ay, bx, by):
        return INSIDE if best > TOUCH * TOUCH else 0.0
    return math.sqrt(best)


@inner
def _cell(W: Any, x: float, y: float) -> tuple[int, int]:
    grid = W[3]
    nx, ny = int(grid[3]), int(grid[4])
    i = min(max((x - grid[0]) * grid[2], 0.0), nx - 1.0)
    j = min(max((y - grid[1]) * grid[2], 0.0), ny - 1.0)
    return int(i), int(j)


@inner
def occupied(W: Any, x: float, y: float) -> bool:
    """Whether a point is inside a polygon: from the winding number of a point in its cell, and the edges between."""
    features, grid, starts, items = W[0], W[3], W[4], W[5]
    if W[1] == 0:
        return False
    u, v = (x - grid[0]) * grid[2], (y - grid[1]) * grid[2]
    if u < 0.0 or v < 0.0 or u >= grid[3] or v >= grid[4]:
        return False
    i, j = int(u), int(v)
    cell = j * int(grid[3]) + i
    count = int(W[6][cell])
    rx, ry = grid[0] + (i + grid[5]) / grid[2], grid[1] + (j + grid[6]) / grid[2]
    dx, dy = x - rx, y - ry
    for k in range(starts[cell], starts[cell + 1]):
        f = items[k]
        if f >= W[1]:
            continue
        ax, ay, bx, by = features[f, 0], features[f, 1], features[f, 2], features[f, 3]
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
    W: Any, P: Array, corners: int, f: int, x: float, y: float, c: float, s: float, ball: Any, reach: float
) -> float:
    """Clearance of the body at a pose from one feature."""
    F = W[0]
    dx, dy = F[f, 0] - x, F[f, 1] - y
    ax, ay = c * dx + s * dy, c * dy - s * dx
    best = reach
    if f >= W[1]:
        r = F[f, 4]
        if math.hypot(ax - ball[1], ay - ball[2]) - r > ball[3] + reach:
            return best
        inside = False
        for k in range(corners):
            n = k + 1 if k + 1 < corners else 0
            best = min(
                best, math.sqrt(point_segment(ax, ay, P[k, 0], P[k, 1], P[n, 0], P[n, 1], P[k, 3])) - r
            )
            if (P[k, 1] > ay) != (P[n, 1] > ay) and (
                ax < P[k, 0] + (ay - P[k, 1]) * (P[n, 0] - P[k, 0]) / (P[n, 1] - P[k, 1])
            ):
                inside = not inside
        for k in range(corners, len(P)):
            best = min(best, math.hypot(ax - P[k, 0], ay - P[k, 1]) - r - P[k, 2])
        return INSIDE if inside else best
    dx, dy = F[f, 2] - x, F[f, 3] - y
    bx, by = c * dx + s * dy, c * dy - s * dx
    inverse = F[f, 5]
    limit = ball[3] + reach
    if point_segment(ball[1], ball[2], ax, ay, bx, by, inverse) > limit * limit:
        return best
    square = best * best
    inside = False
    for k in range(corners):
        n = k + 1 if k + 1 < corners else 0
        px, py, qx, qy = P[k, 0], P[k, 1], P[n, 0], P[n, 1]
        square = min(square, point_segment(px, py, ax, ay, bx, by, inverse))
        square = min(square, point_segment(ax, ay, px, py, qx, qy, P[k, 3]))
        if crosses(ax, ay, bx, by, px, py, qx, qy):
            return INSIDE
        if (py > ay) != (qy > ay) and ax < px + (ay - py) * (qx - px) / (qy - py):
            inside = not inside
    if inside:
        return INSIDE
    best = min(best, math.sqrt(square))
    for k in range(corners, len(P)):
        best = min(best, math.sqrt(point_segment(P[k, 0], P[k, 1], ax, ay, bx, by, inverse)) - P[k, 2])
    return best


@outer
def pose_gap(W: Any, P: Array, ball: Any, pose: Array, reach: float, need: float) -> float:
    """Clearance of the body at a pose X_WO, at most `reach`; negative where it overlaps or leaves the bounds."""
    x, y, c, s = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    corners, bounds = ball[0], W[2]
    best = reach
    for k in range(len(P)):
        px, py = x + c * P[k, 0] - s * P[k, 1], y + s * P[k, 0] + c * P[k, 1]
        gap = min(min(px - bounds[0], py - bounds[1]), min(bounds[2] - px, bounds[3] - py)) - P[k, 2]
        best = min(best, gap)
    if best < need:
        return best
    n = len(W[0])
    if n <= FEW:
        for f in range(n):
            best = min(best, _feature_gap(W, P, corners, f, x, y, c, s, ball, best))
            if best < need:
                return best
    else:
        bx, by = x + c * ball[1] - s * ball[2], y + s * ball[1] + c * ball[2]
        far = ball[3] + reach
        starts, items, stamps = W[4], W[5], W[7]
        i0, j0 = _cell(W, bx - far, by - far)
        i1, j1 = _cell(W, bx + far, by + far)
        stamps[n] += 1
        stamp = stamps[n]
        for j in range(j0, j1 + 1):
            for cell in range(j * int(W[3][3]) + i0, j * int(W[3][3]) + i1 + 1):
                for k in range(starts[cell], starts[cell + 1]):
                    f = items[k]
                    if stamps[f] != stamp:
                        stamps[f] = stamp
                        best = min(best, _feature_gap(W, P, corners, f, x, y, c, s, ball, best))
                        if best < need:
                            return best
    for k in range(len(P)):
        if (k == 0 or k >= corners) and occupied(
            W, x + c * P[k, 0] - s * P[k, 1], y + s * P[k, 0] + c * P[k, 1]
        ):
            return INSIDE
    return best


@inner
def _feature_arc(
    W: Any, P: Array, corners: int, f: int, Qx: float, Qy: float, c: float, s: float, qx: float, qy: float,
    cp: float, sp: float, sweep: float, low: float, high: float, reach: float, need: float,
) -> float:  # fmt: skip
    """The same along a turn about the body point q, at Q in the world, by the angle of (cp, sp)."""
    F = W[0]
    dx, dy = F[f, 0] - Qx, F[f, 1] - Qy
    ax, ay = c * dx + s * dy, c * dy - s * dx
    r = F[f, 4]
    best = reach
    ra = math.sqrt(ax * ax + ay * ay)
    size = abs(sweep)
    edge = f < W[1]
    bx, by, inverse, near, far = ax, ay, 0.0, ra, ra
    if edge:
        dx, dy = F[f, 2] - Qx, F[f, 3] - Qy
        bx, by = c * dx + s * dy, c * dy - s * dx
        inverse = F[f, 5]
        near = math.sqrt(point_segment(0.0, 0.0, ax, ay, bx, by, inverse))
        far = max(ra, math.sqrt(bx * bx + by * by))
    if near - r > high + reach or far + r < low - reach:
        return best
    # The start of the feature seen from the body, as it turns the other way.
    tx, ty = cp * ax + sp * ay, cp * ay - sp * ax
    for k in range(corners):
        n = k + 1 if k + 1 < corners else 0
        px, py, ox, oy = P[k, 0] - qx, P[k, 1] - qy, P[n, 0] - qx, P[n, 1] - qy
        lx, ly = ox - px, oy - py
        t = min(1.0, max(0.0, -(px * lx + py * ly) * P[k, 3]))
        nearest = math.hypot(px + t * lx, py + t * ly)
        rp = math.sqrt(px * px + py * py)
        farthest = max(rp, math.sqrt(ox * ox + oy * oy))
        if ra >= nearest - r - best and ra <= farthest + r + best:
            if sweep > 0.0:
                gap = arc_segment(tx, ty, ax, ay, size, ra, px, py, ox, oy, P[k, 3]) - r
            else:
                gap = arc_segment(ax, ay, tx, ty, size, ra, px, py, ox, oy, P[k, 3]) - r
            best = min(best, gap)
        if edge and rp >= near - best and rp <= far + best:
            ex, ey = cp * px - sp * py, sp * px + cp * py
            if sweep > 0.0:
                gap = arc_segment(px, py, ex, ey, size, rp, ax, ay, bx, by, inverse)
            else:
                gap = arc_segment(ex, ey, px, py, size, rp, ax, ay, bx, by, inverse)
            best = min(best, gap)
        if best < need:
            return best
    for k in range(corners, len(P)):
        px, py = P[k, 0] - qx, P[k, 1] - qy
        rp, wide = math.sqrt(px * px + py * py), P[k, 2] + r
        if rp < near - wide - best or rp > far + wide + best:
            continue
        ex, ey = cp * px - sp * py, sp * px + cp * py
        if sweep < 0.0:
            px, py, ex, ey = ex, ey, px, py
        if edge:
            gap = arc_segment(px, py, ex, ey, size, rp, ax, ay, bx, by, inverse) - wide
        else:
            gap = arc_point(px, py, ex, ey, size, rp, ax, ay) - wide
        best = min(best, gap)
    return best


@inner
def _feature_line(
    W: Any, P: Array, corners: int, f: int, x: float, y: float, c: float, s: float, dx: float, dy: float,
    ball: Any, reach: float, need: float,
) -> float:  # fmt: skip
    """The same along a straight way (dx, dy), seen in the body."""
    F = W[0]
    hx, hy = F[f, 0] - x, F[f, 1] - y
    ax, ay = c * hx + s * hy, c * hy - s * hx
    r, edge = F[f, 4], f < W[1]
    bx, by, inverse = ax, ay, 0.0
    if edge:
        hx, hy = F[f, 2] - x, F[f, 3] - y
        bx, by = c * hx + s * hy, c * hy - s * hx
        inverse = F[f, 5]
    best = reach
    one = 1.0 / (dx * dx + dy * dy)
    if (
        segment_segment(ball[1], ball[2], ball[1] + dx, ball[2] + dy, one, ax, ay, bx, by, inverse) - r
        > ball[3] + reach
    ):
        return best
    for k in range(corners):
        n = k + 1 if k + 1 < corners else 0
        px, py = P[k, 0], P[k, 1]
        gap = segment_segment(ax - dx, ay - dy, ax, ay, one, px, py, P[n, 0], P[n, 1], P[k, 3]) - r
        if edge:
            gap = min(gap, segment_segment(px, py, px + dx, py + dy, one, ax, ay, bx, by, inverse))
        best = min(best, gap)
        if best < need:
            return best
    for k in range(corners, len(P)):
        px, py = P[k, 0], P[k, 1]
        gap = segment_segment(px, py, px + dx, py + dy, one, ax, ay, bx, by, inverse) - P[k, 2] - r
        best = min(best, gap)
    return best


@inner
def _bounds_arc(bounds: Array, P: Array, x: float, y: float, c: float, s: float, qx: float, qy: float,
    Qx: float, Qy: float, cp: float, sp: float, sweep: float, best: float) -> float:  # fmt: skip
    """Clearance of the turning body from the sides of the bounds."""
    size = abs(sweep)
    for k in range(len(P)):
        lx, ly = P[k, 0] - qx, P[k, 1] - qy
        sx, sy = c * lx - s * ly, s * lx + c * ly
        ex, ey = cp * sx - sp * sy, sp * sx + cp * sy
        r, radius = P[k, 2], math.hypot(lx, ly)
        right, left, top, bottom = max(sx, ex), min(sx, ex), max(sy, ey), min(sy, ey)
        if sweep < 0.0:
            sx, sy, ex, ey = ex, ey, sx, sy
        right = radius if within(1.0, 0.0, sx, sy, ex, ey, size) else right
        left = -radius if within(-1.0, 0.0, sx, sy, ex, ey, size) else left
        top = radius if within(0.0, 1.0, sx, sy, ex, ey, size) else top
        bottom = -radius if within(0.0, -1.0, sx, sy, ex, ey, size) else bottom
        gap = min(min(Qx + left - bounds[0], Qy + bottom - bounds[1]),
                  min(bounds[2] - Qx - right, bounds[3] - Qy - top))  # fmt: skip
        best = min(best, gap - r)
    return best


@outer
def arc_gap(
    W: Any, P: Array, ball: Any, x: float, y: float, c: float, s: float, qx: float, qy: float, sweep: float,
    reach: float, need: float,
) -> float:  # fmt: skip
    """The least clearance while a body turns about its point q by an angle, from a pose in which it is free."""
    corners = ball[0]
    Qx, Qy = x + c * qx - s * qy, y + s * qx + c * qy
    cp, sp = math.cos(sweep), math.sin(sweep)
    low, high = math.inf, 0.0
    for k in range(len(P)):
        lx, ly = P[k, 0] - qx, P[k, 1] - qy
        radius = math.hypot(lx, ly)
        high = max(high, radius + P[k, 2])
        if k < corners:
            n = k + 1 if k + 1 < corners else 0
            low = min(low, math.sqrt(point_segment(qx, qy, P[k, 0], P[k, 1], P[n, 0], P[n, 1], P[k, 3])))
        else:
            low = min(low, radius - P[k, 2])
    best, bounds = reach, W[2]
    if min(min(Qx - bounds[0], Qy - bounds[1]), min(bounds[2] - Qx, bounds[3] - Qy)) < high + reach:
        best = _bounds_arc(bounds, P, x, y, c, s, qx, qy, Qx, Qy, cp, sp, sweep, best)
        if best < need:
            return best
    n = len(W[0])
    if n <= FEW:
        for f in range(n):
            gap = _feature_arc(W, P, corners, f, Qx, Qy, c, s, qx, qy, cp, sp, sweep, low, high, best, need)
            best = min(best, gap)
            if best < need:
                return best
        return best
    # In pieces, so that each looks only at what is near.
    starts, items, stamps, width = W[4], W[5], W[7], int(W[3][3])
    arm = math.hypot(ball[1] - qx, ball[2] - qy)
    pieces = 1 + int(max(abs(sweep) * 1.2, abs(sweep) * arm / (2.0 * ball[3])))
    part_angle = sweep / pieces
    cp, sp = math.cos(part_angle), math.sin(part_angle)
    far = ball[3] + reach + arm * (1.0 - math.cos(0.5 * part_angle))
    lx, ly = ball[1] - qx, ball[2] - qy
    for _ in range(pieces):
        sx, sy = c * lx - s * ly, s * lx + c * ly
        ex, ey = cp * sx - sp * sy, sp * sx + cp * sy
        i0, j0 = _cell(W, Qx + min(sx, ex) - far, Qy + min(sy, ey) - far)
        i1, j1 = _cell(W, Qx + max(sx, ex) + far, Qy + max(sy, ey) + far)
        stamps[n] += 1
        stamp = stamps[n]
        for j in range(j0, j1 + 1):
            for cell in range(j * width + i0, j * width + i1 + 1):
                for k in range(starts[cell], starts[cell + 1]):
                    f = items[k]
                    if stamps[f] == stamp:
                        continue
                    stamps[f] = stamp
                    gap = _feature_arc(
                        W, P, corners, f, Qx, Qy, c, s, qx, qy, cp, sp, part_angle, low, high, best, need
                    )
                    best = min(best, gap)
                    if best < need:
                        return best
        c, s = c * cp - s * sp, s * cp + c * sp
    return best


@outer
def line_gap(
    W: Any, P: Array, ball: Any, x: float, y: float, c: float, s: float, dx: float, dy: float,
    reach: float, need: float,
) -> float:  # fmt: skip
    """The least clearance while a body moves straight by (dx, dy), seen in the body, from a free pose."""
    corners, bounds = ball[0], W[2]
    best = reach
    wx, wy = c * dx - s * dy, s * dx + c * dy
    for k in range(len(P)):
        px, py = x + c * P[k, 0] - s * P[k, 1], y + s * P[k, 0] + c * P[k, 1]
        gap = min(min(px + min(wx, 0.0) - bounds[0], py + min(wy, 0.0) - bounds[1]),
                  min(bounds[2] - px - max(wx, 0.0), bounds[3] - py - max(wy, 0.0)))  # fmt: skip
        best = min(best, gap - P[k, 2])
    if best < need:
        return best
    n = len(W[0])
    if n <= FEW:
        for f in range(n):
            best = min(best, _feature_line(W, P, corners, f, x, y, c, s, dx, dy, ball, best, need))
            if best < need:
                return best
        return best
    starts, items, stamps, width = W[4], W[5], W[7], int(W[3][3])
    pieces = 1 + int(math.hypot(dx, dy) / (2.0 * ball[3]))
    dx, dy, wx, wy = dx / pieces, dy / pieces, wx / pieces, wy / pieces
    far = ball[3] + reach
    for _ in range(pieces):
        bx, by = x + c * ball[1] - s * ball[2], y + s * ball[1] + c * ball[2]
        i0, j0 = _cell(W, bx + min(wx, 0.0) - far, by + min(wy, 0.0) - far)
        i1, j1 = _cell(W, bx + max(wx, 0.0) + far, by + max(wy, 0.0) + far)
        stamps[n] += 1
        stamp = stamps[n]
        for j in range(j0, j1 + 1):
            for cell in range(j * width + i0, j * width + i1 + 1):
                for k in range(starts[cell], starts[cell + 1]):
                    f = items[k]
                    if stamps[f] == stamp:
                        continue
                    stamps[f] = stamp
                    best = min(best, _feature_line(W, P, corners, f, x, y, c, s, dx, dy, ball, best, need))
                    if best < need:
                        return best
        x, y = x + wx, y + wy
    return best


@outer
def twist_gap(W: Any, P: Array, ball: Any, start: Array, step: Array, reach: float, need: float) -> float:
    """The least clearance along start · exp(t step), 0 ≤ t ≤ 1, from a pose in which the body is free."""
    c, s = math.cos(start[2]), math.sin(start[2])
    if step[2] != 0.0:
        qx, qy = -step[1] / step[2], step[0] / step[2]
        return arc_gap(W, P, ball, start[0], start[1], c, s, qx, qy, step[2], reach, need)
    if step[0] == 0.0 and step[1] == 0.0:
        return pose_gap(W, P, ball, start, reach, need)
    return line_gap(W, P, ball, start[0], start[1], c, s, step[0], step[1], reach, need)
