"""What one or two contacts do to the object at one moment.

Lengths in the surface's unit ℓ, everything about the centre of friction, twists (v, ℓω). PointContact.motion says the
same of one contact ([Zhou2017] Eqs. 10-14), and contact.several of any number.
"""

import math
from typing import Any

import numpy as np

from ...formulas import formula
from .arrays import Row, Rows, Scratch, SurfaceArrays
from .codes import GOING, JAMMED, LEFT, REST, RIGHT, SEPARATION, STICKING, UNDECIDED
from .resistance import Wrench, stick_of, twist_of, wrench_of

_CLOSED = 1e-9  # relative slack of a closed cone
_LOOSE = (
    1e-6  # part of a wrench that may be missing where both slide: the root is only so sharp beside a facet
)
_ANGLE = 1e-12  # [rad] slack of the friction cone's edge
_SAME = 1e-9  # [ℓ] points nearer than this are one
_ROOT = 60  # half the iterations that a root of both slips may take


@formula
def _chord(wrench: Wrench, px: float, py: float) -> tuple[float, float, float, float]:
    """The forces at p between which all lie that make a wrench of a rotation about a foot: PointContact.forces."""
    radius, fx, fy = wrench.free, wrench.fx, wrench.fy
    dx, dy = wrench.x - px, wrench.y - py
    torque = wrench.t - (px * fy - py * fx)
    distance = math.sqrt(dx * dx + dy * dy)
    if distance < _SAME:
        size = math.sqrt(fx * fx + fy * fy)
        spread = math.asin(min(1.0, radius / size)) if size > 0 else math.pi
        c, s = math.cos(spread), math.sin(spread)
        return c * fx - s * fy, s * fx + c * fy, c * fx + s * fy, -s * fx + c * fy
    least = -torque / distance
    half = math.sqrt(max(0.0, radius * radius - least * least))
    across = min(max(least, -radius), radius) / distance
    x, y = fx - across * dy, fy + across * dx
    hx, hy = half * dx / distance, half * dy / distance
    return x + hx, y + hy, x - hx, y - hy


@formula
def _angles(
    surface: SurfaceArrays, px: float, py: float, nx: float, ny: float, vx: float, vy: float, w: float
) -> tuple[float, float]:
    """Least and largest angle from the normal of the contact forces that make a wrench of a twist."""
    wrench = wrench_of(surface, vx, vy, w)
    fx, fy = wrench.fx, wrench.fy
    if wrench.free == 0.0:
        angle = math.atan2(nx * fy - ny * fx, nx * fx + ny * fy)
        return angle, angle
    ax, ay, bx, by = _chord(wrench, px, py)
    a = math.atan2(nx * ay - ny * ax, nx * ax + ny * ay)
    b = math.atan2(nx * by - ny * bx, nx * bx + ny * by)
    return min(a, b), max(a, b)


@formula
def edge_twist(
    surface: SurfaceArrays, px: float, py: float, nx: float, ny: float, mu: float, left: bool
) -> tuple[float, float, float]:
    """A twist under the force on the left or right edge of the friction cone, such that ∇H is as it comes."""
    tangent = mu if left else -mu  # [Zhou2017] Eqs. 10-11
    fx, fy = nx - tangent * ny, ny + tangent * nx
    return twist_of(surface, fx, fy, px * fy - py * fx)


@formula
def one(
    surface: SurfaceArrays, px: float, py: float, nx: float, ny: float, ux: float, uy: float, mu: float
) -> tuple[int, float, float, float, float]:
    """PointContact.motion: mode, twist (3) and slip."""
    speed = math.sqrt(ux * ux + uy * uy)
    if speed == 0.0:
        return REST, 0.0, 0.0, 0.0, 0.0
    approach, side = ux * nx + uy * ny, nx * uy - ny * ux
    if approach < 0.0:
        return SEPARATION, 0.0, 0.0, 0.0, side
    if approach <= 1e-12 * speed:
        left = side > 0
        still = mu == 0.0
        if not still:
            vx, vy, w = edge_twist(surface, px, py, nx, ny, mu, left)
            still = (vx - w * py) * nx + (vy + w * px) * ny >= 0
        if still:
            return (LEFT if left else RIGHT), 0.0, 0.0, 0.0, side
    half = math.atan(mu)
    vx, vy, w = stick_of(surface, px, py, ux, uy)  # [Zhou2017] Eq. 13
    low, high = _angles(surface, px, py, nx, ny, vx, vy, w)
    if high >= -half - _ANGLE and low <= half + _ANGLE:
        return STICKING, vx, vy, w, 0.0
    left = low > 0
    vx, vy, w = edge_twist(surface, px, py, nx, ny, mu, left)
    scale = approach / ((vx - w * py) * nx + (vy + w * px) * ny)  # [Zhou2017] Eq. 14
    vx, vy, w = scale * vx, scale * vy, scale * w
    slip = nx * (uy - vy - w * px) - ny * (ux - vx + w * py)
    return (LEFT if left else RIGHT), vx, vy, w, slip


@formula
def _edge_wrench(at: Row, tangent: float) -> tuple[float, float, float]:
    """The wrench of the force at a contact whose tangential part, to the left, is so many times its normal part."""
    fx, fy = at.nx - tangent * at.ny, at.ny + tangent * at.nx
    return fx, fy, at.x * fy - at.y * fx


@formula
def _set_ray(ray: Row, at: Row, tangent: float) -> None:
    """Writes the unit wrench of an edge of the friction cone of a contact."""
    fx, fy, t = _edge_wrench(at, tangent)
    size = math.sqrt(fx * fx + fy * fy + t * t)
    ray.x, ray.y, ray.t = fx / size, fy / size, t / size


@formula
def _holds(surface: SurfaceArrays, vx: float, vy: float, w: float, scratch: Scratch, count: int) -> bool:
    """Whether some wrench of a twist lies in the closed cone of the unit rays (count, 3), which span space.

    The cone's faces are planes through two of its rays that leave no other behind them. About a foot's free force g
    each is a half-plane, and what is asked for is their point nearest to g = 0.
    """
    wrench = wrench_of(surface, vx, vy, w)
    fx, fy, t, at_foot = wrench.fx, wrench.fy, wrench.t, wrench.free > 0.0
    size = math.sqrt(fx * fx + fy * fy + t * t)
    if not at_foot:
        fx, fy, t = fx / size, fy / size, t / size
    rays, planes = scratch.rays, scratch.planes  # planes: of the free force g, (x, y)·g ≥ t
    found = 0
    for i in range(count):
        for j in range(i + 1, count):
            a, b = rays[i], rays[j]
            mx, my, mt = a.y * b.t - a.t * b.y, a.t * b.x - a.x * b.t, a.x * b.y - a.y * b.x
            length = math.sqrt(mx * mx + my * my + mt * mt)
            if length < 1e-12:
                continue
            mx, my, mt = mx / length, my / length, mt / length
            ahead = behind = 0
            for k in range(count):
                if k != i and k != j:
                    side = mx * rays[k].x + my * rays[k].y + mt * rays[k].t
                    if side > 1e-12:
                        ahead += 1
                    elif side < -1e-12:
                        behind += 1
            if ahead > 0 and behind > 0:
                continue
            power = mx * fx + my * fy + mt * t
            for sign in (1.0, -1.0):
                if (sign > 0 and behind > 0) or (sign < 0 and ahead > 0):
                    continue
                if not at_foot:
                    if sign * power < -_CLOSED:
                        return False
                else:
                    plane = planes[found]
                    plane.x, plane.y = sign * (mx - mt * wrench.y), sign * (my + mt * wrench.x)
                    plane.t = -sign * power
                    found += 1
    return found == 0 or _reach(planes, found) <= wrench.free + _CLOSED


@formula
def _reach(planes: Rows, count: int) -> float:
    """The size of the least g in the plane with (x, y)·g ≥ t for all rows; inf if there is none."""
    if _within(planes, count, 0.0, 0.0):
        return 0.0
    best = np.inf
    for i in range(count):
        ax, ay, b = planes[i].x, planes[i].y, planes[i].t
        square = ax * ax + ay * ay
        if square < 1e-24:
            continue
        gx, gy = ax * b / square, ay * b / square
        if _within(planes, count, gx, gy):
            best = min(best, math.sqrt(gx * gx + gy * gy))
        for j in range(i):
            cx, cy, d = planes[j].x, planes[j].y, planes[j].t
            det = ax * cy - ay * cx
            if abs(det) > 1e-12:
                gx, gy = (b * cy - ay * d) / det, (ax * d - b * cx) / det
                if _within(planes, count, gx, gy):
                    best = min(best, math.sqrt(gx * gx + gy * gy))
    return best


@formula
def _within(planes: Rows, count: int, gx: float, gy: float) -> Any:
    least = 0.0
    for i in range(count):
        least = min(least, planes[i].x * gx + planes[i].y * gy - planes[i].t)
    return least >= -_CLOSED


@formula
def _side_force(
    surface: SurfaceArrays, vx: float, vy: float, w: float, zx: float, zy: float, zt: float
) -> float:
    """How far a wrench of a twist lies off the plane z of two sliding forces; of a free foot the nearest."""
    wrench = wrench_of(surface, vx, vy, w)
    off = zx * wrench.fx + zy * wrench.fy + zt * wrench.t
    if wrench.free > 0.0:
        free = wrench.free * math.hypot(zx - zt * wrench.y, zy + zt * wrench.x)
        if abs(off) <= free:
            return 0.0
        off -= free if off > 0 else -free
    return off


@formula
def _both_push(
    surface: SurfaceArrays, vx: float, vy: float, w: float, c: Rows, s0: float, s1: float, tight: float
) -> bool:
    """Whether a wrench of a twist is made by the forces with tangential shares s0 and s1, none of them negative."""
    wrench = wrench_of(surface, vx, vy, w)
    fx, fy, t = wrench.fx, wrench.fy, wrench.t
    ax, ay, at = _edge_wrench(c[0], s0)
    bx, by, bt = _edge_wrench(c[1], s1)
    zx, zy, zt = ay * bt - at * by, at * bx - ax * bt, ax * by - ay * bx
    if wrench.free > 0.0:
        # The free force that reaches the plane of both, square to it as seen from the foot.
        qx, qy = zx - zt * wrench.y, zy + zt * wrench.x
        square = qx * qx + qy * qy
        if square > 0:
            k = -(zx * fx + zy * fy + zt * t) / square
            size = abs(k) * math.sqrt(square)
            if size > wrench.free:
                k *= wrench.free / size
            fx, fy, t = fx + k * qx, fy + k * qy, t + k * (wrench.x * qy - wrench.y * qx)
    size = math.sqrt(fx * fx + fy * fy + t * t)
    aa, bb = ax * ax + ay * ay + at * at, bx * bx + by * by + bt * bt
    ab = ax * bx + ay * by + at * bt
    af, bf = ax * fx + ay * fy + at * t, bx * fx + by * fy + bt * t
    det = aa * bb - ab * ab
    if det <= 1e-18 * aa * bb:
        return False
    p, q = (bb * af - ab * bf) / det, (aa * bf - ab * af) / det
    if p * math.sqrt(aa) < -_CLOSED * size or q * math.sqrt(bb) < -_CLOSED * size:
        return False
    ex, ey, et = p * ax + q * bx - fx, p * ay + q * by - fy, p * at + q * bt - t
    return math.sqrt(ex * ex + ey * ey + et * et) <= tight * size


@formula
def _slip(at: Row, vx: float, vy: float, w: float) -> float:
    """Tangential velocity of the finger less the object's at a contact, + to the left."""
    rx, ry = at.ux - vx + w * at.y, at.uy - vy - w * at.x
    return at.nx * ry - at.ny * rx


@formula
def _both_slide(surface: SurfaceArrays, c: Rows, mu: float, speed: float) -> tuple[bool, float, float, float]:
    """Both contacts slide: ok and the twist, among those that keep both normal velocities, V₀ + ω k.

    Between the two ω at which a slip vanishes, and beyond them, the sides on which both slide are known; what is sought
    is a zero of the wrench's distance from the plane of the two forces.
    """
    ax, ay, at = _edge_wrench(c[0], 0.0)
    bx, by, bt = _edge_wrench(c[1], 0.0)
    a, b = ax * c[0].ux + ay * c[0].uy, bx * c[1].ux + by * c[1].uy
    kx, ky, kt = ay * bt - at * by, at * bx - ax * bt, ax * by - ay * bx
    length = math.sqrt(kx * kx + ky * ky + kt * kt)
    aa, bb, ab = ax * ax + ay * ay + at * at, bx * bx + by * by + bt * bt, ax * bx + ay * by + at * bt
    det = aa * bb - ab * ab
    if length < 1e-9 or det <= 0:
        return False, 0.0, 0.0, 0.0
    kx, ky, kt = kx / length, ky / length, kt / length
    p, q = (bb * a - ab * b) / det, (aa * b - ab * a) / det
    ox, oy, ot = p * ax + q * bx, p * ay + q * by, p * at + q * bt
    # The slips are linear in ω: where each vanishes.
    s0, s1 = _slip(c[0], ox, oy, ot), _slip(c[1], ox, oy, ot)
    d0, d1 = _slip(c[0], ox + kx, oy + ky, ot + kt) - s0, _slip(c[1], ox + kx, oy + ky, ot + kt) - s1
    w0 = -s0 / d0 if abs(d0) > 1e-12 else np.inf
    w1 = -s1 / d1 if abs(d1) > 1e-12 else np.inf
    lowest, highest = min(w0, w1), max(w0, w1)
    if lowest == np.inf:
        lowest = highest = 0.0
    elif highest == np.inf:
        highest = lowest
    far = 1e6 * (speed + abs(lowest) + abs(highest))
    for pieces in (1, 32):
        for span in range(3):
            if span == 0:
                low, high = lowest, highest
                if low == high:
                    continue
            elif span == 1:
                low, high = highest, highest + far
            else:
                low, high = lowest - far, lowest
            middle = 0.5 * (low + high)
            left0 = s0 + middle * d0 > 0
            left1 = s1 + middle * d1 > 0
            t0, t1 = (mu if left0 else -mu), (mu if left1 else -mu)
            gx, gy, gt = _edge_wrench(c[0], t0)
            hx, hy, ht = _edge_wrench(c[1], t1)
            zx, zy, zt = gy * ht - gt * hy, gt * hx - gx * ht, gx * hy - gy * hx
            size = math.sqrt(zx * zx + zy * zy + zt * zt)
            if size < 1e-12:
                continue
            zx, zy, zt = zx / size, zy / size, zt / size
            start = low
            value = _side_force(surface, ox + low * kx, oy + low * ky, ot + low * kt, zx, zy, zt)
            for piece in range(1, pieces + 1):
                share = piece / pieces
                if span == 0:
                    end = low + share * (high - low)
                elif span == 1:
                    end = low + far * share**12 if pieces > 1 else high
                else:
                    end = high - far * (1 - share) ** 12 if pieces > 1 else high
                after = _side_force(surface, ox + end * kx, oy + end * ky, ot + end * kt, zx, zy, zt)
                if value * after <= 0.0 and (value != 0.0 or after != 0.0 or pieces == 1):
                    x0, x1, f0, f1 = start, end, value, after
                    side = 0
                    root = x0 if f0 == 0.0 else x1
                    if f0 != 0.0 and f1 != 0.0:
                        for step in range(2 * _ROOT):
                            # False position (Illinois), and every third step the middle: of a wide span by size.
                            if step % 3 == 2:
                                root = 0.5 * (x0 + x1)
                                m0, m1 = abs(x0 - lowest) + speed, abs(x1 - lowest) + speed
                                if m0 > 8 * m1 or m1 > 8 * m0:
                                    jump = math.sqrt(m0 * m1) - speed
                                    root = lowest + (jump if x1 > lowest else -jump)
                                    if not x0 < root < x1:
                                        root = 0.5 * (x0 + x1)
                            else:
                                root = (x0 * f1 - x1 * f0) / (f1 - f0)
                            f = _side_force(
                                surface, ox + root * kx, oy + root * ky, ot + root * kt, zx, zy, zt
                            )
                            if f == 0.0 or x1 - x0 <= 1e-15 * (abs(x0) + abs(x1) + 1e-3 * speed):
                                break
                            if f * f0 > 0:
                                x0, f0 = root, f
                                f1 = 0.5 * f1 if side == 1 and step % 3 != 2 else f1
                                side = 1
                            else:
                                x1, f1 = root, f
                                f0 = 0.5 * f0 if side == -1 and step % 3 != 2 else f0
                                side = -1
                    vx, vy, w = ox + root * kx, oy + root * ky, ot + root * kt
                    if _both_push(surface, vx, vy, w, c, t0, t1, _LOOSE):
                        return True, vx, vy, w
                start, value = end, after
    return False, 0.0, 0.0, 0.0


@formula
def two(surface: SurfaceArrays, mu: float, scratch: Scratch) -> tuple[int, int, int, float, float, float]:
    """Two contacts at once: status, both modes and the twist.

    Of several answers, which friction allows now and then, the first of: both stick, one sticks and the other slides,
    both slide, one touches alone (sticking before sliding), none.

    The contacts are the scratch's first two, their points in ℓ.
    """
    c, rays = scratch.contacts, scratch.rays
    speed = max(math.hypot(c[0].ux, c[0].uy), math.hypot(c[1].ux, c[1].uy))
    if speed == 0.0:
        return GOING, REST, REST, 0.0, 0.0, 0.0
    tiny = 1e-12 * speed
    a, b = c[0].nx * c[0].ux + c[0].ny * c[0].uy, c[1].nx * c[1].ux + c[1].ny * c[1].uy
    if a < -tiny and b < -tiny:
        return GOING, SEPARATION, SEPARATION, 0.0, 0.0, 0.0
    px, py, qx, qy = c[0].x, c[0].y, c[1].x, c[1].y
    dx, dy = qx - px, qy - py
    gap = math.sqrt(dx * dx + dy * dy)
    if mu > 0.0 and gap > 1e-9:
        ex, ey = c[1].ux - c[0].ux, c[1].uy - c[0].uy
        # Both stick, if the fingers move as points of one body.
        if abs(ex * dx + ey * dy) <= 1e-9 * gap * speed:
            w = (dx * ey - dy * ex) / (gap * gap)
            vx, vy = c[0].ux + w * py, c[0].uy - w * px
            if abs(vx) + abs(vy) + abs(w) > tiny:
                for i in range(2):
                    _set_ray(rays[2 * i], c[i], mu)
                    _set_ray(rays[2 * i + 1], c[i], -mu)
                if _holds(surface, vx, vy, w, scratch, 4):  # [Zhou2017] Sec. 4.2
                    return GOING, STICKING, STICKING, vx, vy, w
        # One sticks, the other slides.
        for i in range(2):
            j = 1 - i
            side = 1.0 if i == 0 else -1.0
            turn = side * (c[j].ny * dx - c[j].nx * dy)
            if abs(turn) > 1e-12:
                w = side * (c[j].nx * ex + c[j].ny * ey) / turn
                vx, vy = c[i].ux + w * c[i].y, c[i].uy - w * c[i].x
                if abs(vx) + abs(vy) + abs(w) > tiny:
                    left = _slip(c[j], vx, vy, w) > 0
                    _set_ray(rays[0], c[i], mu)
                    _set_ray(rays[1], c[i], -mu)
                    _set_ray(rays[2], c[j], mu if left else -mu)
                    if _holds(surface, vx, vy, w, scratch, 3):
                        other = LEFT if left else RIGHT
                        if i == 0:
                            return GOING, STICKING, other, vx, vy, w
                        return GOING, other, STICKING, vx, vy, w
    ok, vx, vy, w = _both_slide(surface, c, mu, speed)
    if ok:
        m0 = LEFT if _slip(c[0], vx, vy, w) > 0 else RIGHT
        m1 = LEFT if _slip(c[1], vx, vy, w) > 0 else RIGHT
        return GOING, m0, m1, vx, vy, w
    # One alone: the object must not move into the other finger.
    best, found = -1, REST
    sx = sy = sw = 0.0
    for i in range(2):
        j = 1 - i
        mode, vx, vy, w, _ = one(surface, c[i].x, c[i].y, c[i].nx, c[i].ny, c[i].ux, c[i].uy, mu)
        if mode == SEPARATION or (vx == 0.0 and vy == 0.0 and w == 0.0):
            continue
        moves = c[j].nx * (vx - w * c[j].y) + c[j].ny * (vy + w * c[j].x)
        if moves >= c[j].nx * c[j].ux + c[j].ny * c[j].uy - 1e-9 * speed and (best < 0 or found != STICKING):
            best, found, sx, sy, sw = i, mode, vx, vy, w
    if best >= 0:
        other = SEPARATION
        if best == 0:
            return GOING, found, other, sx, sy, sw
        return GOING, other, found, sx, sy, sw
    if a <= 1e-9 * speed and b <= 1e-9 * speed:
        m0 = SEPARATION if a < -tiny else (LEFT if _slip(c[0], 0.0, 0.0, 0.0) > 0 else RIGHT)
        m1 = SEPARATION if b < -tiny else (LEFT if _slip(c[1], 0.0, 0.0, 0.0) > 0 else RIGHT)
        return GOING, m0, m1, 0.0, 0.0, 0.0
    # Nothing agrees with both. It must be that they hold the object between them, along the line that joins them.
    status = UNDECIDED
    if gap > 1e-9:
        along = (c[0].nx * dx + c[0].ny * dy) / gap
        against = -(c[1].nx * dx + c[1].ny * dy) / gap
        least = (1 - 1e-6) / math.sqrt(1 + mu * mu)
        if along >= least and against >= least:
            status = JAMMED
    return status, REST, REST, 0.0, 0.0, 0.0
