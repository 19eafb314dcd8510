"""One closed-loop run with a point finger on an ellipsoidal limit surface, on plain numbers.

laws.rollout_kernel compiles it."""

import math
from typing import Any

import numpy as np

from ...geometry.pose import Array
from .formulas import RAMP, along_path, linearised, nearest, place, point_velocity, wrapped

DFL, PATH = 0, 1
STICKING, SLIDING_LEFT, SLIDING_RIGHT, SEPARATION = 1, 2, 3, 4


def contact_twist(
    A: Array, cof: Array, px: float, py: float, nx: float, ny: float, mu: float, ux: float, uy: float
) -> Any:
    """Body twist in O at O's origin, slip of the finger along the edge (+ to the left) and mode; u in O.

    [Zhou2017] Eqs. 12-13: M = J A Jᵀ, f = M⁻¹ u where that lies in the friction cone, else the cone's edge.
    """
    un = ux * nx + uy * ny
    if un <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, SEPARATION
    x, y = px - cof[0], py - cof[1]
    # Columns of A Jᵀ: twists of a unit force along x and along y.
    ax, bx, cx = A[0, 0] - y * A[0, 2], A[1, 0] - y * A[1, 2], A[2, 0] - y * A[2, 2]
    ay, by, cy = A[0, 1] + x * A[0, 2], A[1, 1] + x * A[1, 2], A[2, 1] + x * A[2, 2]
    m00, m01, m11 = ax - y * cx, ay - y * cy, by + x * cy
    det = m00 * m11 - m01 * m01
    fx, fy = (m11 * ux - m01 * uy) / det, (m00 * uy - m01 * ux) / det
    tx, ty = -ny, nx
    fn, ft = fx * nx + fy * ny, fx * tx + fy * ty
    mode, slip = STICKING, 0.0
    if abs(ft) > mu * fn:
        # Which edge: the one whose slip goes the way of its friction.
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            gx, gy = nx + sign * mu * tx, ny + sign * mu * ty
            vx, vy = m00 * gx + m01 * gy, m01 * gx + m11 * gy
            vn = vx * nx + vy * ny
            if vn <= 0.0:
                continue
            k = un / vn
            slip = (ux - k * vx) * tx + (uy - k * vy) * ty
            if slip * sign >= 0.0:
                fx, fy = k * gx, k * gy
                mode = SLIDING_LEFT if side == 0 else SLIDING_RIGHT
                break
    a, b, w = ax * fx + ay * fy, bx * fx + by * fy, cx * fx + cy * fy
    # The force that slides left is on the left edge: the finger drags the object to the left.
    return a + w * cof[1], b - w * cof[0], w, slip, mode


def rollout(
    law: int,
    hold: int,
    table: Array,
    speed: float,
    model: Array,
    gains: Array,
    rate: float,
    ticks: int,
    start: Array,
    A: Array,
    cof: Array,
    mu: float,
    half: float,
    noise: Array,
    way: Array,
) -> Any:
    """One run.

    Args:
        law: DFL or PATH. hold: code. table, speed: of the path reference. model: flat point (2), heading, left, right,
            contact point (2) and inward normal (2), shape (9,). gains: kpx, kpy, kdx, kdy, or k₁, k₂, -, -.
        start: X_WO. A: limit surface (3, 3) about cof (2,). mu: of the plant. half: of the edge, either side [m].
        noise: of the measured pose in each tick, shape (ticks, 3) or (1, 3): the same in all.
        way: X_WO before each tick and at the end, (ticks + 1, 3), written; or of shape (0, 3).

    Returns:
        the last pose x, y, θ; the largest distance of the flat point from its path; the ticks that stuck; the contact's
        way along the edge; 0, or 1 if the finger left the edge, 2 if it arrived (PATH).
    """
    dt = 1.0 / rate
    qx, qy, qt = start[0], start[1], start[2]
    lx, ly, heading0, left, right = model[0], model[1], model[2], model[3], model[4]
    px, py, nx, ny = model[5], model[6], model[7], model[8]
    along, gap = 0.0, 0.0
    s, out, length, worst, stuck, outcome = speed, 0.0, 0.0, 0.0, 0, 0
    finish = table[table.shape[0] - 1, 0] + table[table.shape[0] - 1, 1]
    for k in range(ticks):
        if way.shape[0] > 0:
            way[k, 0], way[k, 1], way[k, 2] = qx, qy, qt
        row = k if noise.shape[0] > 1 else 0
        mx, my, mt = qx + noise[row, 0], qy + noise[row, 1], qt + noise[row, 2]
        c, d = math.cos(mt), math.sin(mt)
        x, y, heading = mx + c * lx - d * ly, my + d * lx + c * ly, mt + heading0
        if law == DFL:
            zx, zy, angle, bend = place(table, speed * k * dt)
            tx, ty = math.cos(angle), math.sin(angle)
            s, out, omega, _, _ = linearised(
                x, y, heading, s, zx, zy, speed * tx, speed * ty, -speed * speed * bend * ty,
                speed * speed * bend * tx, gains[0], gains[1], gains[2], gains[3], left, right, 0.1 * speed,
                3.0 * speed, dt, hold,
            )  # fmt: skip
            off = math.hypot(x - zx, y - zy)
        else:
            ahead = min(length + out * dt, finish)
            reach = max(0.25 / max(left, right), 2 * speed * dt)
            length, e, angle, bend = nearest(table, x, y, ahead, reach)
            remaining = finish - length
            if remaining <= 1e-9:
                outcome = 2
                break
            psi = wrapped(heading - angle)
            out = min(speed, remaining / (dt * max(0.2, math.cos(psi))))
            if length + out * dt < finish:
                # The mean turn of what is driven in this tick, as path_following.path_command has it.
                _, _, further, _ = place(table, length + out * dt)
                bend = wrapped(further - angle) / (out * dt)
            kappa, _ = along_path(e, psi, bend, gains[0], gains[1], left, right)
            omega = kappa * out
            off = abs(e)
        worst = max(worst, off)
        ux, uy = point_velocity(heading, out, omega, px - lx, py - ly, mt, dt, hold if law == DFL else RAMP)
        # The plant: the finger goes straight in W, the twist of the middle of the tick.
        cx, cy = px - along * ny, py + along * nx
        if gap > 0.0:
            c, d = math.cos(qt), math.sin(qt)
            gap = max(0.0, gap - dt * ((c * ux + d * uy) * nx + (c * uy - d * ux) * ny))
            continue
        c0, d0 = math.cos(qt), math.sin(qt)
        c, d, a, b, w, slip, mode = c0, d0, 0.0, 0.0, 0.0, 0.0, 0
        for _ in range(2):
            a, b, w, slip, mode = contact_twist(A, cof, cx, cy, nx, ny, mu, c * ux + d * uy, c * uy - d * ux)
            c, d = math.cos(qt + 0.5 * w * dt), math.sin(qt + 0.5 * w * dt)
        c, d = c0, d0
        if mode == SEPARATION:
            gap = -dt * ((c * ux + d * uy) * nx + (c * uy - d * ux) * ny)
            continue
        stuck += 1 if mode == STICKING else 0
        along += slip * dt
        if abs(along) > half:
            outcome = 1
            break
        turn = w * dt
        sine, versine = (
            (math.sin(turn) / turn, (1 - math.cos(turn)) / turn) if abs(turn) > 1e-6 else (1.0, 0.5 * turn)
        )
        ex, ey = dt * (sine * a - versine * b), dt * (versine * a + sine * b)
        qx, qy, qt = qx + c * ex - d * ey, qy + d * ex + c * ey, qt + turn
    for k in range(way.shape[0]):
        if k == way.shape[0] - 1 or (outcome != 0 and np.isnan(way[k, 0])):
            way[k, 0], way[k, 1], way[k, 2] = qx, qy, qt
    return qx, qy, qt, worst, stuck, along, outcome
