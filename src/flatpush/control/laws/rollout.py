"""One closed-loop run with a point finger on an ellipsoidal limit surface, on plain numbers.

laws.rollout_kernel compiles it."""

import math
from typing import NamedTuple

import numpy as np

from ...formulas import formula
from ...geometry.displacement import displaced
from ...geometry.pose import Array
from ..loop.limits import HandLimits, HandMotion, kept_motion
from .formulas import (
    CAP,
    FLOOR,
    MOST_SHARE,
    RAMP,
    AxisGains,
    Bounds,
    FlatPose,
    FlatTarget,
    along_path,
    flat_motion,
    linearised,
    nearest,
    place,
    point_velocity,
    wrapped,
)

DFL, PATH = 0, 1
STICKING, SLIDING_LEFT, SLIDING_RIGHT, SEPARATION = 1, 2, 3, 4


class PointPush(NamedTuple):
    """What a controller knows of a push, in O: flat point, heading, most turns per length, contact, inward normal."""

    flat_x: float
    flat_y: float
    heading: float
    left: float
    right: float
    x: float
    y: float
    nx: float
    ny: float


class Loop(NamedTuple):
    """What all runs share.

    Attributes:
        law: DFL or PATH. hold: code. table, speed: of the path reference. push: of the model.
        gains: of dfl; with the path law px and py are k₁ and k₂. rate: of the ticks [Hz], and how many of them.
        half: of the edge, either side [m]. limits: of the hand.
    """

    law: int
    hold: int
    table: Array
    speed: float
    push: PointPush
    gains: AxisGains
    rate: float
    ticks: int
    half: float
    limits: HandLimits


class Ended(NamedTuple):
    """How a run ended.

    Attributes:
        x, y, turn: X_WO. worst: largest distance of the flat point from its path [m]. stuck: ticks that stuck.
        along: the contact's way along the edge [m]. outcome: 0, or 1 if the finger left the edge, 2 if it arrived
            (PATH).
    """

    x: float
    y: float
    turn: float
    worst: float
    stuck: int
    along: float
    outcome: int


@formula
def contact_twist(
    A: Array, cof: Array, px: float, py: float, nx: float, ny: float, mu: float, ux: float, uy: float
) -> tuple[float, float, float, float, int]:
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


@formula
def rollout(
    loop: Loop, start: Array, A: Array, cof: Array, mu: float, tips: Array, noise: Array, way: Array
) -> Ended:
    """One run.

    Args:
        start: X_WO. A: limit surface (3, 3) about cof (2,). mu: of the plant.
        tips: the fingertip in the hand's frame, shape (1, 2): zeros.
        noise: of the measured pose in each tick, shape (ticks, 3) or (1, 3): the same in all.
        way: X_WO before each tick and at the end, (ticks + 1, 3), written; or of shape (0, 3).
    """
    dt = 1.0 / loop.rate
    push, table, speed = loop.push, loop.table, loop.speed
    qx, qy, qt = start[0], start[1], start[2]
    px, py, nx, ny = push.x, push.y, push.nx, push.ny
    hx, hy, rx, ry = math.cos(push.heading), math.sin(push.heading), px - push.flat_x, py - push.flat_y
    bounds = Bounds(push.left, push.right, FLOOR * speed, CAP * speed)
    last, clock = HandMotion(0.0, 0.0, 0.0, 0.0), 0.0
    along, gap = 0.0, 0.0
    s, out, length, worst, stuck, outcome = speed, 0.0, 0.0, 0.0, 0, 0
    finish = table[table.shape[0] - 1, 0] + table[table.shape[0] - 1, 1]
    for k in range(loop.ticks):
        if way.shape[0] > 0:
            way[k, 0], way[k, 1], way[k, 2] = qx, qy, qt
        row = k if noise.shape[0] > 1 else 0
        mx, my, mt = qx + noise[row, 0], qy + noise[row, 1], qt + noise[row, 2]
        c, d = math.cos(mt), math.sin(mt)
        x, y = mx + c * push.flat_x - d * push.flat_y, my + d * push.flat_x + c * push.flat_y
        heading = mt + push.heading
        if loop.law == DFL:
            zx, zy, angle, bend = place(table, speed * clock)
            _, _, soon, _ = place(table, speed * min(clock + dt, finish / speed))
            tx, ty = math.cos(angle), math.sin(angle)
            # The mean acceleration over the tick, as TrackingController has it.
            ax, ay = speed / dt * (math.cos(soon) - tx), speed / dt * (math.sin(soon) - ty)
            target = FlatTarget(zx, zy, speed * tx, speed * ty, ax, ay)
            s, out, omega, _, _ = linearised(
                FlatPose(x, y, heading), s, target, loop.gains, bounds, dt, loop.hold
            )
            off = math.hypot(x - zx, y - zy)
        else:
            ahead = min(length + out * dt, finish)
            reach = max(0.25 / max(push.left, push.right), 2 * speed * dt)
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
            kappa, _ = along_path(e, psi, bend, loop.gains.px, loop.gains.py, push.left, push.right)
            omega = kappa * out
            off = abs(e)
        worst = max(worst, off)
        hold = loop.hold if loop.law == DFL else RAMP
        ux, uy = point_velocity(heading, out, omega, rx, ry, mt, dt, hold)
        wanted = HandMotion(ux, uy, omega, 0.0)
        last = kept_motion(last, wanted, mt, dt, tips, loop.limits)
        share = 1.0
        if last.vx != ux or last.vy != uy:
            middle = mt + 0.5 * last.spin * dt
            c, d = math.cos(middle), math.sin(middle)
            done, _ = flat_motion(hx, hy, rx, ry, c * last.vx + d * last.vy, c * last.vy - d * last.vx)
            share = min(max(done / out, 0.0), MOST_SHARE)
        ux, uy = last.vx, last.vy
        clock += share * dt
        out *= share
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
        if abs(along) > loop.half:
            outcome = 1
            break
        qx, qy, qt = displaced(qx, qy, qt, a, b, w, dt)
    for k in range(way.shape[0]):
        if k == way.shape[0] - 1 or (outcome != 0 and np.isnan(way[k, 0])):
            way[k, 0], way[k, 1], way[k, 2] = qx, qy, qt
    return Ended(qx, qy, qt, worst, stuck, along, outcome)
