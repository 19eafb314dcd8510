"""A quartic limit surface on plain numbers: its Hessian, the wrench of a twist, the twist of a held point.

Units as in simulation.plant.resistance; friction.quartic says the same by arrays ([Zhou2017] Eqs. 1, 13).
"""

import math

from ...formulas import formula
from .arrays import QuarticArrays


@formula
def quartic_hessian(
    surface: QuarticArrays, x: float, y: float, z: float
) -> tuple[float, float, float, float, float, float]:
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
def quartic_root(surface: QuarticArrays, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    """The F of least H(F) - b·F by damped Newton, as friction.quartic."""
    size = math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / size, by / size, bz / size
    x, y, z = bx, by, bz
    for k in range(100):
        a, b, c, d, e, f = quartic_hessian(surface, x, y, z)
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
            a, b, c, d, e, f = quartic_hessian(surface, x1, y1, z1)
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
def quartic_held(
    surface: QuarticArrays, px: float, py: float, ux: float, uy: float
) -> tuple[float, float, float, float, float]:
    """The force f at a point for which it moves with u: least H(Jᵀf) - u·f, damped Newton in the plane."""
    speed = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / speed, uy / speed
    x, y = ux, uy
    for k in range(100):
        z = px * y - py * x
        a, b, c, d, e, f = quartic_hessian(surface, x, y, z)
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
                a, b, c, d, e, f = quartic_hessian(surface, x1, y1, px * y1 - py * x1)
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
    a, b, c, d, e, f = quartic_hessian(surface, x, y, z)
    vx, vy, w = a * x + b * y + d * z, b * x + c * y + e * z, d * x + e * y + f * z
    t = 4 * speed
    return t * vx, t * vy, t * w, x, y
