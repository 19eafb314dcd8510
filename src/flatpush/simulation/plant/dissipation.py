"""The dissipation of a support's friction for a twist, its wrench and how that changes, on plain numbers.

Units as in simulation.plant.resistance; friction.pressure says the same by arrays.
"""

import math
from typing import NamedTuple

from ...formulas import by_type, formula
from ...friction.pressure import POINT_LIKE
from .arrays import FeetArrays, RoundArrays, Rows, SidesArrays

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


@formula
def resist_at_nodes(nodes: Rows, vx: float, vy: float, w: float) -> Resistance:
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
def _sides_integrals(
    surface: SidesArrays, cx: float, cy: float
) -> tuple[float, float, float, float, float, float]:
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
def _round_integrals(
    surface: RoundArrays, cx: float, cy: float
) -> tuple[float, float, float, float, float, float]:
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
    return resist_at_nodes(surface.feet, vx, vy, w)


@formula
def spread_resist(surface: SidesArrays | RoundArrays, vx: float, vy: float, w: float) -> Resistance:
    ax, ay = vx - w * surface.y, vy + w * surface.x
    if ax * ax + ay * ay >= (POINT_LIKE * surface.radius * w) ** 2:
        return resist_at_nodes(surface.nodes, vx, vy, w)
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
resist = by_type({FeetArrays: _feet_resist, SidesArrays: spread_resist, RoundArrays: spread_resist})
"""The Resistance of a support to a twist."""
