"""How the table resists: the wrench of a twist, the twist of a wrench, the twist of a held point.

Everything is about the centre of friction in the surface's unit of length ℓ (arrays), and so are the twists (v, ℓω) and
the wrenches (f, τ/ℓ) here. Only directions of wrenches count. The limit surfaces of friction/ say the same by arrays.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ...formulas import by_type, formula
from .arrays import EllipsoidArrays, FeetArrays, QuarticArrays, RoundArrays, Rows, SidesArrays

_TIE = 1e-10  # as friction.exact: a force that misses a facet by less than this part of the load lies on it
_ON_FOOT = 1e-9  # as friction.pressure: a rotation centre within this part of the radius lies on the foot
_AT_FOOT = 1e-18  # square of the distance [ℓ] below which a contact lies on a foot
_FAR = 16.0  # as friction.pressure: from so many radii on, point loads stand for a spread pressure
_TINY = 1e-30  # keeps the logarithms finite where a rotation centre lies on the line of a side, in radii


class Resistance(NamedTuple):
    """Of a twist V: the dissipation h, its wrench ∇h, and ∇²h."""

    h: float
    fx: float
    fy: float
    t: float
    xx: float
    xy: float
    yy: float
    xt: float
    yt: float
    tt: float


class Wrench(NamedTuple):
    """A wrench of a twist; and where that turns about a foot, its place, and the friction of its own that is free."""

    fx: float
    fy: float
    t: float
    free: float  # 0 where no foot is
    x: float
    y: float


@formula
def _by_nodes(nodes: Rows, vx: float, vy: float, w: float) -> Resistance:
    """h, ∇h and ∇²h summed over point loads: h(V) = Σ w |v + ω × p|."""
    h = fx = fy = t = 0.0
    kxx = kxy = kyy = kxt = kyt = ktt = 0.0
    for i in range(len(nodes)):
        node = nodes[i]
        x, y, share = node.x, node.y, node.weight
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
    return Resistance(h, fx, fy, t, kxx, kxy, kyy, kxt, kyt, ktt)


@formula
def _sides_integrals(surface: SidesArrays, cx: float, cy: float) -> Any:
    """U, G, M of a uniform pressure on a polygon's outline, or inside it (friction.pressure.Edges)."""
    size = surface.size
    U = gx = gy = mxx = mxy = myy = 0.0
    for i in range(len(surface.sides)):
        side = surface.sides[i]
        ex, ey = side.ex, side.ey
        nx, ny = ey, -ex
        shift = cx * ex + cy * ey
        t0, t1 = side.first - shift, side.last - shift
        d = side.distance - (cx * nx + cy * ny)
        gap = max(abs(d), _TINY * surface.radius)
        r0, r1 = math.sqrt(t0 * t0 + gap * gap), math.sqrt(t1 * t1 + gap * gap)
        # asinh(t1/gap) - asinh(t0/gap), each as a logarithm without cancellation
        a1 = math.log((abs(t1) + r1) / gap)
        a0 = math.log((abs(t0) + r0) / gap)
        L = (a1 if t1 >= 0 else -a1) - (a0 if t0 >= 0 else -a0)
        ge, nn, ne = r1 - r0, t1 / r1 - t0 / r0, -d / r1 + d / r0
        gn = d * L
        u = t1 * r1 - t0 * r0 + d * gn
        ee = L - nn
        if surface.filled:
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


@formula
def _round_integrals(surface: RoundArrays, cx: float, cy: float) -> Any:
    """U, G, M of a uniform pressure on a circle, or inside it (friction.pressure.Round)."""
    a = surface.radius
    cx, cy = cx - surface.x, cy - surface.y
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
    if surface.filled:
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


@formula
def _feet_resist(surface: FeetArrays, vx: float, vy: float, w: float) -> Resistance:
    return _by_nodes(surface.feet, vx, vy, w)


@formula
def _spread_resist(surface: SidesArrays | RoundArrays, vx: float, vy: float, w: float) -> Resistance:
    ax, ay = vx - w * surface.y, vy + w * surface.x
    if ax * ax + ay * ay >= (_FAR * surface.radius * w) ** 2:
        return _by_nodes(surface.nodes, vx, vy, w)
    cx, cy = -vy / w, vx / w
    U, gx, gy, mxx, mxy, myy = _integrals(surface, cx, cy)
    size = abs(w)
    sign = 1.0 if w > 0 else -1.0
    lx, ly = -cy, cx
    sx, sy = mxx * lx + mxy * ly, mxy * lx + myy * ly
    return Resistance(
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


_integrals = by_type({SidesArrays: _sides_integrals, RoundArrays: _round_integrals})
resist = by_type({FeetArrays: _feet_resist, SidesArrays: _spread_resist, RoundArrays: _spread_resist})
"""The Resistance of a support to a twist."""


@formula
def _quartic_hessian(surface: QuarticArrays, x: float, y: float, z: float) -> Any:
    """∇²H/12 of the quartic (xx, xy, yy, xz, yz, zz)."""
    v = surface.terms[0]
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    hxx = v.xxxx * xx + 0.5 * (v.xxxy * xy + v.xxxz * xz) + (v.xxyy * yy + v.xxzz * zz + v.xxyz * yz) / 6
    hyy = v.yyyy * yy + 0.5 * (v.yyyx * xy + v.yyyz * yz) + (v.xxyy * xx + v.yyzz * zz + v.yyxz * xz) / 6
    hzz = v.zzzz * zz + 0.5 * (v.zzzx * xz + v.zzzy * yz) + (v.xxzz * xx + v.yyzz * yy + v.zzxy * xy) / 6
    hxy = (
        0.25 * (v.xxxy * xx + v.yyyx * yy)
        + v.xxyy * xy / 3
        + (v.xxyz * xz + v.yyxz * yz) / 6
        + v.zzxy * zz / 12
    )
    hxz = (
        0.25 * (v.xxxz * xx + v.zzzx * zz)
        + v.xxzz * xz / 3
        + (v.xxyz * xy + v.zzxy * yz) / 6
        + v.yyxz * yy / 12
    )
    hyz = (
        0.25 * (v.yyyz * yy + v.zzzy * zz)
        + v.yyzz * yz / 3
        + (v.yyxz * xy + v.zzxy * xz) / 6
        + v.xxyz * xx / 12
    )
    return hxx, hxy, hyy, hxz, hyz, hzz


@formula
def _quartic_root(surface: QuarticArrays, bx: float, by: float, bz: float) -> Any:
    """The F of least H(F) - b·F by damped Newton, as friction.quartic."""
    size = math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / size, by / size, bz / size
    x, y, z = bx, by, bz
    for k in range(100):
        a, b, c, d, e, f = _quartic_hessian(surface, x, y, z)
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
            a, b, c, d, e, f = _quartic_hessian(surface, x1, y1, z1)
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


@formula
def _quartic_held(surface: QuarticArrays, px: float, py: float, ux: float, uy: float) -> Any:
    """The force f at a point for which it moves with u: least H(Jᵀf) - u·f, damped Newton in the plane."""
    speed = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / speed, uy / speed
    x, y = ux, uy
    for k in range(100):
        z = px * y - py * x
        a, b, c, d, e, f = _quartic_hessian(surface, x, y, z)
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
                a, b, c, d, e, f = _quartic_hessian(surface, x1, y1, px * y1 - py * x1)
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
    a, b, c, d, e, f = _quartic_hessian(surface, x, y, z)
    vx, vy, w = a * x + b * y + d * z, b * x + c * y + e * z, d * x + e * y + f * z
    t = 4 * speed
    return t * vx, t * vy, t * w, x, y


@formula
def _ellipsoid_wrench(surface: EllipsoidArrays, vx: float, vy: float, w: float) -> Wrench:
    A = surface.ellipse[0]
    fx, fy = A.ixx * vx + A.ixy * vy + A.ixt * w, A.ixy * vx + A.iyy * vy + A.iyt * w
    return Wrench(fx, fy, A.ixt * vx + A.iyt * vy + A.itt * w, 0.0, 0.0, 0.0)


@formula
def _quartic_wrench(surface: QuarticArrays, vx: float, vy: float, w: float) -> Wrench:
    x, y, z = _quartic_root(surface, vx, vy, w)
    return Wrench(x, y, z, 0.0, 0.0, 0.0)


@formula
def _feet_wrench(surface: FeetArrays, vx: float, vy: float, w: float) -> Wrench:
    if w != 0.0:
        limit = _ON_FOOT * surface.radius * abs(w)
        for i in range(len(surface.feet)):
            foot = surface.feet[i]
            if math.hypot(vx - w * foot.y, vy + w * foot.x) <= limit:
                sign = 1.0 if w > 0 else -1.0
                return Wrench(sign * foot.fx, sign * foot.fy, sign * foot.t, foot.weight, foot.x, foot.y)
    r = _by_nodes(surface.feet, vx, vy, w)
    return Wrench(r.fx, r.fy, r.t, 0.0, 0.0, 0.0)


@formula
def _spread_wrench(surface: SidesArrays | RoundArrays, vx: float, vy: float, w: float) -> Wrench:
    r = _spread_resist(surface, vx, vy, w)
    return Wrench(r.fx, r.fy, r.t, 0.0, 0.0, 0.0)


wrench_of = by_type(
    {
        EllipsoidArrays: _ellipsoid_wrench,
        QuarticArrays: _quartic_wrench,
        FeetArrays: _feet_wrench,
        SidesArrays: _spread_wrench,
        RoundArrays: _spread_wrench,
    }
)
"""A wrench of a twist, of the load's size where it turns about a foot: LimitSurface.wrench_set."""


@formula
def _ellipsoid_stick(surface: EllipsoidArrays, px: float, py: float, ux: float, uy: float) -> Any:
    # f from J A Jᵀ f = u, then A Jᵀ f: [Zhou2017] Eq. 13 inverted.
    A = surface.ellipse[0]
    xx = A.xx - 2 * py * A.xt + py * py * A.tt
    xy = A.xy + px * A.xt - py * A.yt - px * py * A.tt
    yy = A.yy + 2 * px * A.yt + px * px * A.tt
    det = xx * yy - xy * xy
    fx, fy = (yy * ux - xy * uy) / det, (xx * uy - xy * ux) / det
    return _ellipsoid_twist(surface, fx, fy, px * fy - py * fx)


@formula
def _quartic_stick(surface: QuarticArrays, px: float, py: float, ux: float, uy: float) -> Any:
    if ux == 0.0 and uy == 0.0:
        return 0.0, 0.0, 0.0
    vx, vy, w, _, _ = _quartic_held(surface, px, py, ux, uy)
    return vx, vy, w


@formula
def _feet_stick(surface: FeetArrays, px: float, py: float, ux: float, uy: float) -> Any:
    speed = math.sqrt(ux * ux + uy * uy)
    if speed == 0.0:
        return 0.0, 0.0, 0.0
    limit = _ON_FOOT * surface.radius * speed
    for i in range(len(surface.feet)):
        foot = surface.feet[i]
        ax, ay = px - foot.x, py - foot.y
        if abs(ax * ux + ay * uy) <= limit:
            square = ax * ax + ay * ay
            if square > _AT_FOOT:
                missing = py * foot.fx - px * foot.fy + foot.t
                if abs(missing) <= foot.weight * math.sqrt(square) + _TIE:
                    w = (ax * uy - ay * ux) / square
                    return w * foot.y, -w * foot.x, w
    return _spread_stick(surface, px, py, ux, uy)


@formula
def _spread_stick(
    surface: FeetArrays | SidesArrays | RoundArrays, px: float, py: float, ux: float, uy: float
) -> Any:
    speed = math.sqrt(ux * ux + uy * uy)
    if speed == 0.0:
        return 0.0, 0.0, 0.0
    ux, uy = ux / speed, uy / speed
    # V = (u, 0) + ω k with k the rotation about p: h is least where k·∇h = 0.
    arm2 = px * px + py * py + 1.0
    arm = math.sqrt(arm2)
    w = (px * uy - py * ux) / arm2
    low, high, before = -np.inf, np.inf, np.inf
    for _ in range(200):
        r = resist(surface, ux + w * py, uy - w * px, w)
        slope = py * r.fx - px * r.fy + r.t
        bend = py * py * r.xx - 2 * px * py * r.xy + px * px * r.yy + 2 * (py * r.xt - px * r.yt) + r.tt
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


@formula
def _newton(surface: FeetArrays | SidesArrays | RoundArrays, fx: float, fy: float, t: float) -> Any:
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
    r = resist(surface, vx, vy, w)
    g1, g2 = ax * r.fx + ay * r.fy + at * r.t, bx * r.fx + by * r.fy + bt * r.t
    for _ in range(60):
        square = g1 * g1 + g2 * g2
        if square <= (4e-15 * r.h) ** 2:
            break
        kax, kay, kat = (
            r.xx * ax + r.xy * ay + r.xt * at,
            r.xy * ax + r.yy * ay + r.yt * at,
            r.xt * ax + r.yt * ay + r.tt * at,
        )
        kbx, kby, kbt = (
            r.xx * bx + r.xy * by + r.xt * bt,
            r.xy * bx + r.yy * by + r.yt * bt,
            r.xt * bx + r.yt * by + r.tt * bt,
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
            r1 = resist(surface, x, y, z)
            n1, n2 = ax * r1.fx + ay * r1.fy + at * r1.t, bx * r1.fx + by * r1.fy + bt * r1.t
            slope = n1 * s1 + n2 * s2
            if slope <= 0 or r1.h <= r.h + 1e-4 * fraction * descent:
                moved = True
            elif slope <= -descent / 2 and r1.h <= r.h * (1 + 1e-12):
                moved = n1 * n1 + n2 * n2 < square
            if moved or square <= (1e-12 * r.h) ** 2:
                break
            fraction *= 0.5
        if not moved or (square <= (1e-12 * r.h) ** 2 and n1 * n1 + n2 * n2 >= square):
            break
        vx, vy, w, r, g1, g2 = x, y, z, r1, n1, n2
    return vx, vy, w, math.sqrt(g1 * g1 + g2 * g2) / r.h


@formula
def _ellipsoid_twist(surface: EllipsoidArrays, fx: float, fy: float, t: float) -> Any:
    A = surface.ellipse[0]
    return (
        A.xx * fx + A.xy * fy + A.xt * t,
        A.xy * fx + A.yy * fy + A.yt * t,
        A.xt * fx + A.yt * fy + A.tt * t,
    )


@formula
def _quartic_twist(surface: QuarticArrays, fx: float, fy: float, t: float) -> Any:
    a, b, c, d, e, f = _quartic_hessian(surface, fx, fy, t)
    return a * fx + b * fy + d * t, b * fx + c * fy + e * t, d * fx + e * fy + f * t


@formula
def _feet_twist(surface: FeetArrays, fx: float, fy: float, t: float) -> Any:
    # Each foot has a facet of wrenches: those of the rotation about it, its own friction free.
    size = math.sqrt(fx * fx + fy * fy + t * t)
    fx, fy, t = fx / size, fy / size, t / size
    for i in range(len(surface.feet)):
        foot = surface.feet[i]
        power = foot.y * fx - foot.x * fy + t
        if power != 0.0:
            scale = foot.power / power
            gx, gy = scale * fx - foot.fx, scale * fy - foot.fy
            if math.sqrt(gx * gx + gy * gy) <= foot.weight + _TIE:
                sign = 1.0 if power > 0 else -1.0
                return sign * foot.y, -sign * foot.x, sign
    return _spread_twist(surface, fx, fy, t)


@formula
def _spread_twist(surface: FeetArrays | SidesArrays | RoundArrays, fx: float, fy: float, t: float) -> Any:
    size = math.sqrt(fx * fx + fy * fy + t * t)
    fx, fy, t = fx / size, fy / size, t / size
    vx, vy, w, residual = _newton(surface, fx, fy, t)
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
        vx, vy, w = stick_of(surface, px, py, c * dx - s * dy, s * dx + c * dy)
        r = resist(surface, vx, vy, w)
        if dx * r.fy - dy * r.fx < 0:
            low = middle
        else:
            high = middle
        if high - low <= 1e-15:
            break
    return vx, vy, w


stick_of = by_type(
    {
        EllipsoidArrays: _ellipsoid_stick,
        QuarticArrays: _quartic_stick,
        FeetArrays: _feet_stick,
        SidesArrays: _spread_stick,
        RoundArrays: _spread_stick,
    }
)
"""The twist of the body whose point p is held to the velocity u by a force through it: LimitSurface.stick."""

twist_of = by_type(
    {
        EllipsoidArrays: _ellipsoid_twist,
        QuarticArrays: _quartic_twist,
        FeetArrays: _feet_twist,
        SidesArrays: _spread_twist,
        RoundArrays: _spread_twist,
    }
)
"""A twist of a wrench: LimitSurface.twist."""
