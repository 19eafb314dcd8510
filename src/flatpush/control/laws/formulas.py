"""Feedback laws of a sticking push, on plain numbers; kernels compile these same functions.

A reference path is a table of shape (n, 6), one row for each piece of the flat point's path: arc length at its start
[m], its length [m], the point (x, y) and the tangent's angle [rad] there, its curvature [1/m]. Heading φ: direction in
which the flat point moves, h = (cos φ, sin φ), with n = (-sin φ, cos φ) on its left. Flat speed s: of the flat point
along h, > 0; a sticking finger drives s and the turn ω of the object independently, within -right ≤ ω/s ≤ left.
"""

import math
from typing import NamedTuple

from ...formulas import formula
from ...geometry.pose import Array

# How a command is held over a tick, see laws.gains.Hold.
RAMP, BEFORE, AFTER = 0, 1, 2
# Bounds of the flat speed under feedback linearisation, by that of the reference: the law divides by it.
FLOOR, CAP = 0.1, 3.0
# A hand that slows down later than it was told to is at most so many times as fast as that.
MOST_SHARE = 3.0


class FlatPose(NamedTuple):
    """Of the flat point in W: x, y [m] and heading [rad]."""

    x: float
    y: float
    heading: float


class FlatTarget(NamedTuple):
    """Where the flat point should be, and its velocity and acceleration, in W [m], [m/s], [m/s²]."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float


class AxisGains(NamedTuple):
    """Along two axes: proportional [1/s²] and derivative [1/s]."""

    px: float
    py: float
    dx: float
    dy: float


class Bounds(NamedTuple):
    """Most turn per length to either side [1/m], and bounds of the flat speed [m/s]."""

    left: float
    right: float
    floor: float
    cap: float


@formula
def place(table: Array, length: float) -> tuple[float, float, float, float]:
    """Point x, y, tangent angle and curvature at an arc length; beyond the ends the path goes on straight."""
    k = 0
    while k + 1 < table.shape[0] and length >= table[k + 1, 0]:
        k += 1
    run = length - table[k, 0]
    x, y, angle, bend = table[k, 2], table[k, 3], table[k, 4], table[k, 5]
    if run < 0.0:
        return x + run * math.cos(angle), y + run * math.sin(angle), angle, 0.0
    over = max(0.0, run - table[k, 1])
    run -= over
    half = 0.5 * bend * run
    chord = run * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    x, y = x + chord * math.cos(angle + half), y + chord * math.sin(angle + half)
    angle += 2 * half
    if over > 0.0:
        return x + over * math.cos(angle), y + over * math.sin(angle), angle, 0.0
    return x, y, angle, bend


@formula
def nearest(
    table: Array, x: float, y: float, length: float, reach: float
) -> tuple[float, float, float, float]:
    """The path's point abeam of (x, y), near a first guess of its arc length, at most `reach` from it.

    Returns:
        arc length, how far (x, y) is to the left of it, tangent's angle and curvature there.
    """
    first = length
    for _ in range(6):
        px, py, angle, bend = place(table, length)
        c, d = math.cos(angle), math.sin(angle)
        ahead, left = (x - px) * c + (y - py) * d, (y - py) * c - (x - px) * d
        step = ahead / max(0.2, 1 - bend * left)
        step = min(max(length + step, first - reach), first + reach) - length
        length += step
        if abs(step) < 1e-6:  # what is left is of second order
            return length, left, angle + bend * step, bend
    px, py, angle, bend = place(table, length)
    return length, (y - py) * math.cos(angle) - (x - px) * math.sin(angle), angle, bend


@formula
def linearised(
    flat: FlatPose, speed: float, target: FlatTarget, gains: AxisGains, bounds: Bounds, dt: float, hold: int
) -> tuple[float, float, float, float, bool]:
    """One tick of dynamic feedback linearisation ([Zhou2017] Eqs. 43-46, for any contact: docs/errata.md rows 2, 15).

    The compensator state is the flat speed s: ṡ = w·h, ω = (w·n)/s make z̈ = w. Where the turn is more than the
    friction cone allows, it is scaled down to that. Below the floor, where the law divides by zero, s counts as the
    floor.

    Args:
        flat: where the flat point is. speed: s. target: the reference. gains: along x and y of the frame of both.
        bounds: of turn and s. dt: of the tick. hold: code.

    Returns:
        s for the next tick, flat speed and turn ω to command, how far ω was scaled (1: not), whether s was bounded.
    """
    c, d = math.cos(flat.heading), math.sin(flat.heading)
    s = min(max(speed, bounds.floor), bounds.cap)
    bounded = s != speed
    wx = target.ax - gains.px * (flat.x - target.x) - gains.dx * (s * c - target.vx)  # Eq. 46
    wy = target.ay - gains.py * (flat.y - target.y) - gains.dy * (s * d - target.vy)
    along, across = wx * c + wy * d, wy * c - wx * d
    after = s + along * dt  # Eq. 43
    if after < bounds.floor or after > bounds.cap:
        bounded = True
        after = min(max(after, bounds.floor), bounds.cap)
    out = 0.5 * (s + after) if hold == RAMP else (after if hold == BEFORE else s)
    mean = out if hold == RAMP else s  # over the tick
    scale = 1.0
    most = mean * out * (bounds.left if across > 0 else bounds.right)
    if abs(across) > most:
        scale = most / abs(across)
    omega = scale * across / mean  # Eq. 45
    return after, out, omega, scale, bounded


@formula
def along_path(
    left_of: float,
    heading_error: float,
    bend: float,
    stiffness: float,
    damping: float,
    left: float,
    right: float,
) -> tuple[float, bool]:
    """Turn per length that brings the flat point back to its path, without a singularity at rest.

    In arc length e' = sin ψ, ψ' = κ - κ_d cos ψ / (1 - κ_d e): feeding the path's own curvature forward and adding
    -k₁ e - k₂ ψ gives poles of λ² + k₂ λ + k₁ = 0 per metre.

    Args:
        left_of: distance e to the left of the path. heading_error: ψ. bend: κ_d. stiffness, damping: k₁ [1/m²] and
            k₂ [1/m]. left, right: most turn per length [1/m].

    Returns:
        κ, and whether it is at a limit.
    """
    psi = heading_error
    shape = math.sin(psi) / psi if abs(psi) > 1e-6 else 1.0
    feed = bend * math.cos(psi) / max(0.2, 1 - bend * left_of)
    kappa = feed - stiffness * left_of * shape - damping * psi
    bounded = min(max(kappa, -right), left)
    return bounded, bounded != kappa


@formula
def point_velocity(
    heading: float, speed: float, omega: float, ox: float, oy: float, turn: float, dt: float, hold: int
) -> tuple[float, float]:
    """Velocity in W of a body point while the flat point runs at a speed and the body turns at ω.

    Held on a ramp it is the mean over the tick: the chord of the point's way. Otherwise it is that at the tick's start.

    Args:
        ox, oy: from the flat point to the point, in O. turn: θ of O.
    """
    c, d = math.cos(turn), math.sin(turn)
    rx, ry = c * ox - d * oy, d * ox + c * oy
    if hold != RAMP:
        return speed * math.cos(heading) - omega * ry, speed * math.sin(heading) + omega * rx
    half = 0.5 * omega * dt
    shape = math.sin(half) / half if abs(half) > 1e-9 else 1.0
    u = speed * shape
    # (R(2 half) - 1) r / dt = 2 sin(half)/dt · R(half) perp(r)
    k = 2 * math.sin(half) / dt
    ch, sh = math.cos(half), math.sin(half)
    return (
        u * math.cos(heading + half) + k * (-ch * ry - sh * rx),
        u * math.sin(heading + half) + k * (ch * rx - sh * ry),
    )


@formula
def flat_motion(hx: float, hy: float, rx: float, ry: float, ux: float, uy: float) -> tuple[float, float]:
    """Flat speed and ω of a body whose point at an arm r from the flat point moves with u; h its heading; all in O."""
    omega = (hx * uy - hy * ux) / (hx * rx + hy * ry)
    return (ux + omega * ry) * hx + (uy - omega * rx) * hy, omega


@formula
def wrapped(angle: float) -> float:
    """The same angle in [-π, π]."""
    return angle - 2 * math.pi * math.floor(angle / (2 * math.pi) + 0.5)
