"""How the table resists: the wrench of a twist, the twist of a wrench, the twist of a held point.

Everything is about the centre of friction in the surface's unit of length ℓ (arrays), and so are the twists (v, ℓω) and
the wrenches (f, τ/ℓ) here. Only directions of wrenches count. The limit surfaces of friction/ say the same by arrays:
a twist of a wrench is ∇H ([Zhou2017] Eq. 1), that of a held point solves Eq. 13 for the force.
"""

import math
from typing import NamedTuple

import numpy as np

from ...formulas import by_type, formula
from ...friction.exact import TIE
from ...friction.pressure import ON_FOOT
from ...friction.root_step import root_step
from .arrays import EllipsoidArrays, FeetArrays, QuarticArrays, RoundArrays, SidesArrays
from .dissipation import resist, resist_at_nodes, spread_resist
from .quartic import quartic_held, quartic_hessian, quartic_root

_AT_FOOT = 1e-18  # square of the distance [ℓ] below which a contact lies on a foot


class Wrench(NamedTuple):
    """A wrench of a twist; and where that turns about a foot, its place, and the friction of its own that is free."""

    fx: float
    fy: float
    t: float
    free: float  # 0 where no foot is
    x: float
    y: float


@formula
def _ellipsoid_wrench(surface: EllipsoidArrays, vx: float, vy: float, w: float) -> Wrench:
    A = surface.ellipse[0]
    fx, fy = A.ixx * vx + A.ixy * vy + A.ixt * w, A.ixy * vx + A.iyy * vy + A.iyt * w
    return Wrench(fx, fy, A.ixt * vx + A.iyt * vy + A.itt * w, 0.0, 0.0, 0.0)


@formula
def _quartic_wrench(surface: QuarticArrays, vx: float, vy: float, w: float) -> Wrench:
    x, y, z = quartic_root(surface, vx, vy, w)
    return Wrench(x, y, z, 0.0, 0.0, 0.0)


@formula
def _feet_wrench(surface: FeetArrays, vx: float, vy: float, w: float) -> Wrench:
    if w != 0.0:
        limit = ON_FOOT * surface.radius * abs(w)
        for i in range(len(surface.feet)):
            foot = surface.feet[i]
            if math.hypot(vx - w * foot.y, vy + w * foot.x) <= limit:
                sign = 1.0 if w > 0 else -1.0
                return Wrench(sign * foot.fx, sign * foot.fy, sign * foot.t, foot.weight, foot.x, foot.y)
    r = resist_at_nodes(surface.feet, vx, vy, w)
    return Wrench(r.fx, r.fy, r.t, 0.0, 0.0, 0.0)


@formula
def _spread_wrench(surface: SidesArrays | RoundArrays, vx: float, vy: float, w: float) -> Wrench:
    r = spread_resist(surface, vx, vy, w)
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
def _ellipsoid_stick(
    surface: EllipsoidArrays, px: float, py: float, ux: float, uy: float
) -> tuple[float, float, float]:
    # f from J A Jᵀ f = u, then A Jᵀ f: [Zhou2017] Eq. 13 inverted.
    A = surface.ellipse[0]
    xx = A.xx - 2 * py * A.xt + py * py * A.tt
    xy = A.xy + px * A.xt - py * A.yt - px * py * A.tt
    yy = A.yy + 2 * px * A.yt + px * px * A.tt
    det = xx * yy - xy * xy
    fx, fy = (yy * ux - xy * uy) / det, (xx * uy - xy * ux) / det
    return _ellipsoid_twist(surface, fx, fy, px * fy - py * fx)


@formula
def _quartic_stick(
    surface: QuarticArrays, px: float, py: float, ux: float, uy: float
) -> tuple[float, float, float]:
    if ux == 0.0 and uy == 0.0:
        return 0.0, 0.0, 0.0
    vx, vy, w, _, _ = quartic_held(surface, px, py, ux, uy)
    return vx, vy, w


@formula
def _feet_stick(
    surface: FeetArrays, px: float, py: float, ux: float, uy: float
) -> tuple[float, float, float]:
    speed = math.sqrt(ux * ux + uy * uy)
    if speed == 0.0:
        return 0.0, 0.0, 0.0
    limit = ON_FOOT * surface.radius * speed
    for i in range(len(surface.feet)):
        foot = surface.feet[i]
        ax, ay = px - foot.x, py - foot.y
        if abs(ax * ux + ay * uy) <= limit:
            square = ax * ax + ay * ay
            if square > _AT_FOOT:
                missing = py * foot.fx - px * foot.fy + foot.t
                if abs(missing) <= foot.weight * math.sqrt(square) + TIE:
                    w = (ax * uy - ay * ux) / square
                    return w * foot.y, -w * foot.x, w
    return _spread_stick(surface, px, py, ux, uy)


@formula
def _spread_stick(
    surface: FeetArrays | SidesArrays | RoundArrays, px: float, py: float, ux: float, uy: float
) -> tuple[float, float, float]:
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
        step, done = root_step(w, slope, bend, low, high, before, arm)
        w += step
        if done:
            break
        before = abs(slope)
    return speed * (ux + w * py), speed * (uy - w * px), speed * w


@formula
def _newton(
    surface: FeetArrays | SidesArrays | RoundArrays, fx: float, fy: float, t: float
) -> tuple[float, float, float, float]:
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
def _ellipsoid_twist(surface: EllipsoidArrays, fx: float, fy: float, t: float) -> tuple[float, float, float]:
    A = surface.ellipse[0]
    return (
        A.xx * fx + A.xy * fy + A.xt * t,
        A.xy * fx + A.yy * fy + A.yt * t,
        A.xt * fx + A.yt * fy + A.tt * t,
    )


@formula
def _quartic_twist(surface: QuarticArrays, fx: float, fy: float, t: float) -> tuple[float, float, float]:
    a, b, c, d, e, f = quartic_hessian(surface, fx, fy, t)
    return a * fx + b * fy + d * t, b * fx + c * fy + e * t, d * fx + e * fy + f * t


@formula
def _feet_twist(surface: FeetArrays, fx: float, fy: float, t: float) -> tuple[float, float, float]:
    # Each foot has a facet of wrenches: those of the rotation about it, its own friction free.
    size = math.sqrt(fx * fx + fy * fy + t * t)
    fx, fy, t = fx / size, fy / size, t / size
    for i in range(len(surface.feet)):
        foot = surface.feet[i]
        power = foot.y * fx - foot.x * fy + t
        if power != 0.0:
            scale = foot.power / power
            gx, gy = scale * fx - foot.fx, scale * fy - foot.fy
            if math.sqrt(gx * gx + gy * gy) <= foot.weight + TIE:
                sign = 1.0 if power > 0 else -1.0
                return sign * foot.y, -sign * foot.x, sign
    return _spread_twist(surface, fx, fy, t)


@formula
def _spread_twist(
    surface: FeetArrays | SidesArrays | RoundArrays, fx: float, fy: float, t: float
) -> tuple[float, float, float]:
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
