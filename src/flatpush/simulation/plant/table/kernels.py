"""How the table resists, compiled: the wrench of a twist, the twist of a wrench, the twist of a held point.

Tables as surface_table packs them: row 0 begins with the unit of length ℓ [m]; everything else is about the centre
of friction in that unit, and so are the twists (v, ℓω) and the wrenches (f, τ/ℓ) here. Only directions of wrenches
count. The plain versions are the limit surfaces of friction/.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ....geometry.pose import Array

ELLIPSOID, FEET, QUARTIC, EDGES, ROUND = 0, 1, 2, 3, 4

part = nb.njit(cache=True, nogil=True, error_model="numpy")

_TIE = 1e-10  # as friction.exact: a force that misses a facet by less than this part of the load lies on it
_ON_FOOT = 1e-9  # as friction.pressure: a rotation centre within this part of the radius lies on the foot
_FAR = 16.0
_TINY = 1e-30


@part
def _by_nodes(table: Array, first: int, last: int, vx: float, vy: float, w: float) -> Any:
    """h, ∇h and ∇²h summed over point loads in rows of x, y, weight."""
    h = fx = fy = t = 0.0
    kxx = kxy = kyy = kxt = kyt = ktt = 0.0
    for i in range(first, last):
        x, y, share = table[i, 0], table[i, 1], table[i, 2]
        ax, ay = vx - w * y, vy + w * x
        speed = math.sqrt(ax * ax + ay * ay)
        if speed <= 1e-15 * abs(w):
            continue
        ux, uy = ax / speed, ay / speed
        h += share * speed
        fx += share * ux
        fy += share * uy
        t += share * (x * uy - y * ux)
        c = share / speed
        along = x * ux + y * uy
        kxx += c * uy * uy
        kxy -= c * ux * uy
        kyy += c * ux * ux
        kxt -= c * uy * along
        kyt += c * ux * along
        ktt += c * along * along
    return h, fx, fy, t, kxx, kxy, kyy, kxt, kyt, ktt


@part
def _edge_integrals(table: Array, cx: float, cy: float) -> Any:
    """U, G, M of a uniform pressure on a polygon's outline, or inside it (friction.pressure.Edges)."""
    filled, size = table[0, 2] > 0.5, table[0, 3]
    count, radius = int(table[0, 4]), table[0, 1]
    U = gx = gy = mxx = mxy = myy = 0.0
    for i in range(1, 1 + count):
        ex, ey, t0, t1, d0 = table[i, 0], table[i, 1], table[i, 2], table[i, 3], table[i, 4]
        nx, ny = ey, -ex
        shift = cx * ex + cy * ey
        t0, t1 = t0 - shift, t1 - shift
        d = d0 - (cx * nx + cy * ny)
        gap = max(abs(d), _TINY * radius)
        r0, r1 = math.sqrt(t0 * t0 + gap * gap), math.sqrt(t1 * t1 + gap * gap)
        # asinh(t1/gap) - asinh(t0/gap), each as a logarithm without cancellation
        a1 = math.log((abs(t1) + r1) / gap)
        a0 = math.log((abs(t0) + r0) / gap)
        L = (a1 if t1 >= 0 else -a1) - (a0 if t0 >= 0 else -a0)
        ge, nn, ne = r1 - r0, t1 / r1 - t0 / r0, -d / r1 + d / r0
        gn = d * L
        u = t1 * r1 - t0 * r0 + d * gn
        ee = L - nn
        if filled:
            u *= d / 3
            gn *= 0.5 * d
            ge *= 0.5 * d
            nn *= d
            ne *= d
            ee *= d
        U += u
        gx += gn * nx + ge * ex
        gy += gn * ny + ge * ey
        mxx += nn * nx * nx + 2 * ne * nx * ex + ee * ex * ex
        mxy += nn * nx * ny + ne * (nx * ey + ny * ex) + ee * ex * ey
        myy += nn * ny * ny + 2 * ne * ny * ey + ee * ey * ey
    return 0.5 * U / size, gx / size, gy / size, mxx / size, mxy / size, myy / size


@part
def _round_integrals(table: Array, cx: float, cy: float) -> Any:
    """U, G, M of a uniform pressure on a circle, or inside it (friction.pressure.Round)."""
    a, filled = table[0, 1], table[0, 2] > 0.5
    cx, cy = cx - table[0, 5], cy - table[0, 6]
    c = math.sqrt(cx * cx + cy * cy)
    s, inside = max(a, c), c <= a
    k = min(a, c) / s
    m, k1 = k * k, max(abs(a - c) * (a + c) / (s * s), 1e-40)
    x, b = 1.0, math.sqrt(k1)
    share, total, power = m / (4 * (1 + b) ** 2), 0.0, 2.0
    for _ in range(8):
        total += power * share
        x, b, square = (x + b) / 2, math.sqrt(x * b), ((x - b) / 2) ** 2
        power *= 2
        share = share * square / (4 * (x + b) ** 2)
        if share < 1e-18:
            break
    K = math.pi / (x + b)
    D = K * (1 + total) / 2
    B = K - D
    k1 = abs(a - c) * (a + c) / (s * s)
    if filled:
        f = 4 / (3 * math.pi)
        U = f * s / 3 * ((3 + 5 * m) * B + (3 + m) * k1 * D if inside else (5 + 3 * m) * B + 4 * k1 * D)
        over = f / s * (2 * B + k1 * D)
        second = f / s * (B + 2 * k1 * D if inside else B - k1 * D)
    else:
        f = 2 / math.pi
        U = f * s * ((1 + m) * B + k1 * D)
        over = f / s * (B if inside else B + k1 * D)
        second = f / s * (D if inside else m * D)
    ux, uy = (cx / c, cy / c) if c > 0 else (0.0, 0.0)
    return (
        U,
        -over * cx,
        -over * cy,
        over * ux * ux + second * (1 - ux * ux),
        (over - second) * ux * uy,
        over * uy * uy + second * (1 - uy * uy),
    )


@part
def resist(kind: int, table: Array, vx: float, vy: float, w: float) -> Any:
    """h, ∇h (3) and ∇²h (xx, xy, yy, xt, yt, tt) of a twist, for the supports (not ellipsoid or quartic)."""
    if kind == FEET:
        return _by_nodes(table, 1, table.shape[0], vx, vy, w)
    ax, ay = vx - w * table[0, 6], vy + w * table[0, 5]
    if ax * ax + ay * ay >= (_FAR * table[0, 1] * w) ** 2:
        return _by_nodes(table, 1 + int(table[0, 4]), table.shape[0], vx, vy, w)
    cx, cy = -vy / w, vx / w
    if kind == EDGES:
        U, gx, gy, mxx, mxy, myy = _edge_integrals(table, cx, cy)
    else:
        U, gx, gy, mxx, mxy, myy = _round_integrals(table, cx, cy)
    size = abs(w)
    sign = 1.0 if w > 0 else -1.0
    lx, ly = -cy, cx
    sx, sy = mxx * lx + mxy * ly, mxy * lx + myy * ly
    return (
        size * U,
        -gy * sign,
        gx * sign,
        (U + cx * gx + cy * gy) * sign,
        mxx / size,
        mxy / size,
        myy / size,
        sx / size,
        sy / size,
        (sx * lx + sy * ly) / size,
    )


@part
def _quartic_hessian(table: Array, x: float, y: float, z: float) -> Any:
    """∇²H/12 of the quartic (xx, xy, yy, xz, yz, zz)."""
    v = table[1]
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    hxx = v[0] * xx + 0.5 * (v[3] * xy + v[4] * xz) + (v[9] * yy + v[10] * zz + v[12] * yz) / 6
    hyy = v[1] * yy + 0.5 * (v[5] * xy + v[6] * yz) + (v[9] * xx + v[11] * zz + v[13] * xz) / 6
    hzz = v[2] * zz + 0.5 * (v[7] * xz + v[8] * yz) + (v[10] * xx + v[11] * yy + v[14] * xy) / 6
    hxy = 0.25 * (v[3] * xx + v[5] * yy) + v[9] * xy / 3 + (v[12] * xz + v[13] * yz) / 6 + v[14] * zz / 12
    hxz = 0.25 * (v[4] * xx + v[7] * zz) + v[10] * xz / 3 + (v[12] * xy + v[14] * yz) / 6 + v[13] * yy / 12
    hyz = 0.25 * (v[6] * yy + v[8] * zz) + v[11] * yz / 3 + (v[13] * xy + v[14] * xz) / 6 + v[12] * xx / 12
    return hxx, hxy, hyy, hxz, hyz, hzz


@part
def _quartic_wrench(table: Array, bx: float, by: float, bz: float) -> Any:
    """The F of least H(F) - b·F by damped Newton, as friction.quartic."""
    size = math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / size, by / size, bz / size
    x, y, z = bx, by, bz
    for k in range(100):
        a, b, c, d, e, f = _quartic_hessian(table, x, y, z)
        if k == 0:
            power, value = (
                1.0,
                a * x * x + 2 * b * x * y + c * y * y + 2 * d * x * z + 2 * e * y * z + f * z * z,
            )
            t = (power / (4 * value)) ** (1 / 3)
            x, y, z = t * x, t * y, t * z
            t *= t
            a, b, c, d, e, f = t * a, t * b, t * c, t * d, t * e, t * f
        rx = 4 * (a * x + b * y + d * z) - bx
        ry = 4 * (b * x + c * y + e * z) - by
        rz = 4 * (d * x + e * y + f * z) - bz
        square = rx * rx + ry * ry + rz * rz
        if square <= 1e-29:
            break
        lift = 1e-14 * (a + c + f)
        a1, c1, f1 = a + lift, c + lift, f + lift
        # Inverse by cofactors of 12 M.
        p, q, r = c1 * f1 - e * e, d * e - b * f1, b * e - c1 * d
        det = 12 * (a1 * p + b * q + d * r)
        sx = -(p * rx + q * ry + r * rz) / det
        sy = -(q * rx + (a1 * f1 - d * d) * ry + (b * d - a1 * e) * rz) / det
        sz = -(r * rx + (b * d - a1 * e) * ry + (a1 * c1 - b * b) * rz) / det
        power, descent = bx * x + by * y + bz * z, rx * sx + ry * sy + rz * sz
        fraction, moved = 1.0, False
        while fraction > 1e-6:
            x1, y1, z1 = x + fraction * sx, y + fraction * sy, z + fraction * sz
            a, b, c, d, e, f = _quartic_hessian(table, x1, y1, z1)
            p1 = bx * x1 + by * y1 + bz * z1
            if p1 > 0:
                value = (
                    a * x1 * x1
                    + 2 * b * x1 * y1
                    + c * y1 * y1
                    + 2 * d * x1 * z1
                    + 2 * e * y1 * z1
                    + f * z1 * z1
                )
                t = (p1 / (4 * value)) ** (1 / 3)
                x1, y1, z1, p1 = t * x1, t * y1, t * z1, t * p1
                t *= t
                a, b, c, d, e, f = t * a, t * b, t * c, t * d, t * e, t * f
                change = -0.75 * (p1 - power)
                r1x = 4 * (a * x1 + b * y1 + d * z1) - bx
                r1y = 4 * (b * x1 + c * y1 + e * z1) - by
                r1z = 4 * (d * x1 + e * y1 + f * z1) - bz
                after = r1x * r1x + r1y * r1y + r1z * r1z
                if change <= 1e-4 * fraction * descent or (change <= 1e-13 * power and after < 0.25 * square):
                    moved = True
                    break
            fraction *= 0.5
        if not moved:
            break
        x, y, z = x1, y1, z1
    return x, y, z


@part
def _quartic_stick(table: Array, px: float, py: float, ux: float, uy: float) -> Any:
    """The force f at a point for which it moves with u: least H(Jᵀf) - u·f, damped Newton in the plane."""
    speed = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / speed, uy / speed
    x, y = ux, uy
    for k in range(100):
        z = px * y - py * x
        a, b, c, d, e, f = _quartic_hessian(table, x, y, z)
        # Gᵀ M G with the columns (1, 0, -py) and (0, 1, px).
        gxx = a - 2 * py * d + py * py * f
        gxy = b + px * d - py * e - px * py * f
        gyy = c + 2 * px * e + px * px * f
        if k == 0:
            t = (1.0 / (4 * (gxx * x * x + 2 * gxy * x * y + gyy * y * y))) ** (1 / 3)
            x, y = t * x, t * y
            t *= t
            gxx, gxy, gyy = t * gxx, t * gxy, t * gyy
        rx, ry = 4 * (gxx * x + gxy * y) - ux, 4 * (gxy * x + gyy * y) - uy
        square = rx * rx + ry * ry
        if square <= 1e-29:
            break
        lift = 1e-14 * (gxx + gyy)
        det = 12 * ((gxx + lift) * (gyy + lift) - gxy * gxy)
        sx, sy = -((gyy + lift) * rx - gxy * ry) / det, -((gxx + lift) * ry - gxy * rx) / det
        power, descent = ux * x + uy * y, rx * sx + ry * sy
        fraction, moved = 1.0, False
        while fraction > 1e-6:
            x1, y1 = x + fraction * sx, y + fraction * sy
            p1 = ux * x1 + uy * y1
            if p1 > 0:
                a, b, c, d, e, f = _quartic_hessian(table, x1, y1, px * y1 - py * x1)
                gxx = a - 2 * py * d + py * py * f
                gxy = b + px * d - py * e - px * py * f
                gyy = c + 2 * px * e + px * px * f
                t = (p1 / (4 * (gxx * x1 * x1 + 2 * gxy * x1 * y1 + gyy * y1 * y1))) ** (1 / 3)
                x1, y1, p1 = t * x1, t * y1, t * p1
                t *= t
                r1x = 4 * t * (gxx * x1 + gxy * y1) - ux
                r1y = 4 * t * (gxy * x1 + gyy * y1) - uy
                after, change = r1x * r1x + r1y * r1y, -0.75 * (p1 - power)
                if change <= 1e-4 * fraction * descent or (change <= 1e-13 * power and after < 0.25 * square):
                    moved = True
                    break
            fraction *= 0.5
        if not moved:
            break
        x, y = x1, y1
    z = px * y - py * x
    a, b, c, d, e, f = _quartic_hessian(table, x, y, z)
    vx, vy, w = a * x + b * y + d * z, b * x + c * y + e * z, d * x + e * y + f * z
    t = 4 * speed
    return t * vx, t * vy, t * w, x, y


@part
def foot_of(kind: int, table: Array, vx: float, vy: float, w: float) -> Any:
    """The row of the foot that a twist turns about, or 0."""
    if kind == FEET and w != 0.0:
        limit = _ON_FOOT * table[0, 1] * abs(w)
        for i in range(1, table.shape[0]):
            if math.hypot(vx - w * table[i, 1], vy + w * table[i, 0]) <= limit:
                return i
    return 0


@part
def wrench_of(kind: int, table: Array, vx: float, vy: float, w: float) -> Any:
    """A wrench of a twist, and the row of a foot whose own friction (up to its weight) is free, or 0.

    Of the load's size where there is such a foot.
    """
    if kind == ELLIPSOID:
        return (
            table[4, 0] * vx + table[4, 1] * vy + table[4, 2] * w,
            table[5, 0] * vx + table[5, 1] * vy + table[5, 2] * w,
            table[6, 0] * vx + table[6, 1] * vy + table[6, 2] * w,
            0,
        )
    if kind == QUARTIC:
        x, y, z = _quartic_wrench(table, vx, vy, w)
        return x, y, z, 0
    foot = foot_of(kind, table, vx, vy, w)
    if foot > 0:
        sign = 1.0 if w > 0 else -1.0
        return sign * table[foot, 4], sign * table[foot, 5], sign * table[foot, 6], foot
    r = resist(kind, table, vx, vy, w)
    return r[1], r[2], r[3], 0


@part
def stick_of(kind: int, table: Array, px: float, py: float, ux: float, uy: float) -> Any:
    """The twist of the body whose point p is held to the velocity u by a force through it: LimitSurface.stick."""
    speed = math.sqrt(ux * ux + uy * uy)
    if speed == 0.0:
        return 0.0, 0.0, 0.0
    if kind == ELLIPSOID:
        # f from J A Jᵀ f = u, then A Jᵀ f.
        a, b, d = table[1, 0], table[1, 1], table[1, 2]
        c, e, f = table[2, 1], table[2, 2], table[3, 2]
        xx = a - 2 * py * d + py * py * f
        xy = b + px * d - py * e - px * py * f
        yy = c + 2 * px * e + px * px * f
        det = xx * yy - xy * xy
        fx, fy = (yy * ux - xy * uy) / det, (xx * uy - xy * ux) / det
        t = px * fy - py * fx
        return a * fx + b * fy + d * t, b * fx + c * fy + e * t, d * fx + e * fy + f * t
    if kind == QUARTIC:
        vx, vy, w, _, _ = _quartic_stick(table, px, py, ux, uy)
        return vx, vy, w
    ux, uy = ux / speed, uy / speed
    if kind == FEET:
        limit = _ON_FOOT * table[0, 1]
        for i in range(1, table.shape[0]):
            ax, ay = px - table[i, 0], py - table[i, 1]
            if abs(ax * ux + ay * uy) <= limit:
                square = ax * ax + ay * ay
                if square > 1e-18:
                    w = (ax * uy - ay * ux) / square
                    missing = py * table[i, 4] - px * table[i, 5] + table[i, 6]
                    if abs(missing) <= table[i, 2] * math.sqrt(square) + _TIE:
                        w *= speed
                        return w * table[i, 1], -w * table[i, 0], w
    # V = (u, 0) + ω k with k the rotation about p: h is least where k·∇h = 0.
    arm2 = px * px + py * py + 1.0
    arm = math.sqrt(arm2)
    w = (px * uy - py * ux) / arm2
    low, high, before = -np.inf, np.inf, np.inf
    for _ in range(200):
        r = resist(kind, table, ux + w * py, uy - w * px, w)
        slope = py * r[1] - px * r[2] + r[3]
        bend = py * py * r[4] - 2 * px * py * r[5] + px * px * r[6] + 2 * (py * r[7] - px * r[8]) + r[9]
        if abs(slope) <= 4e-16 * arm:
            break
        if slope < 0:
            low = w
        else:
            high = w
        reach = 4 * (abs(w) + 1 / arm)
        if bend > 0:
            step = min(max(-slope / bend, -reach), reach)
        else:
            step = -reach if slope > 0 else reach
        bracketed = low > -np.inf and high < np.inf
        if bracketed and (not low < w + step < high or abs(slope) > before / 2):
            step = (low + high) / 2 - w
        elif abs(slope) <= 1e-8 * arm and abs(step) <= 1e-8 * (abs(w) + 1 / arm):
            w += step
            break
        before = abs(slope)
        if w + step == w or (bracketed and high - low <= 1e-16 * (abs(w) + 1 / arm)):
            break
        w += step
    return speed * (ux + w * py), speed * (uy - w * px), speed * w


@part
def _newton(kind: int, table: Array, fx: float, fy: float, t: float) -> Any:
    """The V of least h(V) over F·V = 1 by damped Newton from V = F (a unit wrench), and the residual."""
    # An orthonormal basis a, b of the plane normal to F.
    if abs(fx) <= abs(fy) and abs(fx) <= abs(t):
        ax, ay, at = 1.0, 0.0, 0.0
    elif abs(fy) <= abs(t):
        ax, ay, at = 0.0, 1.0, 0.0
    else:
        ax, ay, at = 0.0, 0.0, 1.0
    dot = ax * fx + ay * fy + at * t
    ax, ay, at = ax - dot * fx, ay - dot * fy, at - dot * t
    size = math.sqrt(ax * ax + ay * ay + at * at)
    ax, ay, at = ax / size, ay / size, at / size
    bx, by, bt = fy * at - t * ay, t * ax - fx * at, fx * ay - fy * ax
    vx, vy, w = fx, fy, t
    r = resist(kind, table, vx, vy, w)
    g1, g2 = ax * r[1] + ay * r[2] + at * r[3], bx * r[1] + by * r[2] + bt * r[3]
    for _ in range(60):
        square = g1 * g1 + g2 * g2
        if square <= (4e-15 * r[0]) ** 2:
            break
        kax, kay, kat = (
            r[4] * ax + r[5] * ay + r[7] * at,
            r[5] * ax + r[6] * ay + r[8] * at,
            r[7] * ax + r[8] * ay + r[9] * at,
        )
        kbx, kby, kbt = (
            r[4] * bx + r[5] * by + r[7] * bt,
            r[5] * bx + r[6] * by + r[8] * bt,
            r[7] * bx + r[8] * by + r[9] * bt,
        )
        haa, hab, hbb = (
            ax * kax + ay * kay + at * kat,
            ax * kbx + ay * kby + at * kbt,
            bx * kbx + by * kby + bt * kbt,
        )
        lift = 1e-14 * (haa + hbb) + 1e-300
        haa, hbb = haa + lift, hbb + lift
        det = haa * hbb - hab * hab
        if det > 0:
            s1, s2 = -(hbb * g1 - hab * g2) / det, -(haa * g2 - hab * g1) / det
        else:
            s1, s2 = -g1 / (haa + hbb), -g2 / (haa + hbb)
        descent = g1 * s1 + g2 * s2
        fraction, moved = 1.0, False
        n1 = n2 = 0.0
        x = y = z = 0.0
        r1 = r
        while fraction > 1e-9:
            p, q = fraction * s1, fraction * s2
            x, y, z = vx + p * ax + q * bx, vy + p * ay + q * by, w + p * at + q * bt
            r1 = resist(kind, table, x, y, z)
            n1, n2 = ax * r1[1] + ay * r1[2] + at * r1[3], bx * r1[1] + by * r1[2] + bt * r1[3]
            slope = n1 * s1 + n2 * s2
            if slope <= 0 or r1[0] <= r[0] + 1e-4 * fraction * descent:
                moved = True
            elif slope <= -descent / 2 and r1[0] <= r[0] * (1 + 1e-12):
                moved = n1 * n1 + n2 * n2 < square
            if moved or square <= (1e-12 * r[0]) ** 2:
                break
            fraction *= 0.5
        if not moved or (square <= (1e-12 * r[0]) ** 2 and n1 * n1 + n2 * n2 >= square):
            break
        vx, vy, w, r, g1, g2 = x, y, z, r1, n1, n2
    return vx, vy, w, math.sqrt(g1 * g1 + g2 * g2) / r[0]


@part
def twist_of(kind: int, table: Array, fx: float, fy: float, t: float) -> Any:
    """A twist of a wrench: LimitSurface.twist (not for collinear feet)."""
    if kind == ELLIPSOID:
        return (
            table[1, 0] * fx + table[1, 1] * fy + table[1, 2] * t,
            table[2, 0] * fx + table[2, 1] * fy + table[2, 2] * t,
            table[3, 0] * fx + table[3, 1] * fy + table[3, 2] * t,
        )
    if kind == QUARTIC:
        a, b, c, d, e, f = _quartic_hessian(table, fx, fy, t)
        return a * fx + b * fy + d * t, b * fx + c * fy + e * t, d * fx + e * fy + f * t
    size = math.sqrt(fx * fx + fy * fy + t * t)
    fx, fy, t = fx / size, fy / size, t / size
    if kind == FEET:
        for i in range(1, table.shape[0]):
            power = table[i, 1] * fx - table[i, 0] * fy + t
            if power != 0.0:
                scale = table[i, 3] / power
                gx, gy = scale * fx - table[i, 4], scale * fy - table[i, 5]
                if math.sqrt(gx * gx + gy * gy) <= table[i, 2] + _TIE:
                    sign = 1.0 if power > 0 else -1.0
                    return sign * table[i, 1], -sign * table[i, 0], sign
    vx, vy, w, residual = _newton(kind, table, fx, fy, t)
    force = math.sqrt(fx * fx + fy * fy)
    if residual <= 1e-11 or force < 1e-9:
        return vx, vy, w
    # Beside a foot Newton may stall: turn the velocity of a point on the force's line until its force lies along it.
    dx, dy = fx / force, fy / force
    px, py = t / force * dy, -t / force * dx
    low, high = -0.5 * math.pi, 0.5 * math.pi
    for _ in range(80):
        middle = 0.5 * (low + high)
        c, s = math.cos(middle), math.sin(middle)
        vx, vy, w = stick_of(kind, table, px, py, c * dx - s * dy, s * dx + c * dy)
        r = resist(kind, table, vx, vy, w)
        if dx * r[2] - dy * r[1] < 0:
            low = middle
        else:
            high = middle
        if high - low <= 1e-15:
            break
    return vx, vy, w
