"""Fingers against an object over a stretch of their motion: at most two contacts at a time.

Python runs these formulas as they stand, and simulation.plant.kernels compiles them. A step is a fourth-order
Runge-Kutta-Munthe-Kaas step ([MuntheKaas1998]; exact where the twist is constant); where contact modes or the touched
features change on the way it is halved down to a thirty-second, and where a finger touches it ends. The plain version,
for any number of contacts and any surface, is simulation.plant.plain.
"""

import math

from ...formulas import formula
from ...geometry.displacement import displaced
from .arrays import Move, Row, Rows, Scratch, Setting
from .codes import (
    AS_IT_IS,
    BODY,
    GOING,
    GRASPED,
    INSIDE,
    JAMMED,
    MANY,
    REST,
    SEPARATION,
    STICKING,
    UNDECIDED,
)
from .contact_modes import one, two
from .contacts import TOUCH, close_gaps, find_contacts, hand_at, least_gap, see
from .facing import OVERLAP

STEP = 1 / 60  # longest travel of the fingers in one step, by the outline's size
CORNER_STEP = 0.25  # of the tip's radius: longest travel in a step round a corner,
SHARP_STEP = 2e-4  # or this by the outline's size, for a sharp tip
LOOKS = 8  # places on a step at which fingers that do not touch are watched
HALVINGS = 5
SETTLES = 4  # times that a step is shortened to where something touches
MOST_STEPS = 1_000_000  # of one motion between two poses
ALL_THAT_TOUCH = -1  # a mask of contacts


@formula
def _twist(setting: Setting, count: int, scratch: Scratch) -> tuple[int, int, int, float, float, float]:
    """Status, modes and the body twist about O's origin of the contacts in the scratch."""
    c, ell, mu = scratch.contacts, setting.surface.unit, setting.friction
    if count == 0:
        return GOING, REST, REST, 0.0, 0.0, 0.0
    if count == 1:
        at = c[0]
        m0, vx, vy, w, _ = one(setting.surface, at.x / ell, at.y / ell, at.nx, at.ny, at.ux, at.uy, mu)
        m1, status = REST, GOING
    elif count == 2:
        for i in range(2):
            c[i].x /= ell
            c[i].y /= ell
        status, m0, m1, vx, vy, w = two(setting.surface, mu, scratch)
        for i in range(2):
            c[i].x *= ell
            c[i].y *= ell
    else:
        return MANY, REST, REST, 0.0, 0.0, 0.0
    w /= ell
    return status, m0, m1, vx + w * setting.cof_y, vy - w * setting.cof_x, w


@formula
def _slope(ma: float, mb: float, mw: float, a: float, b: float, w: float) -> tuple[float, float, float]:
    """Rate of the displacement's logarithm when the body, displaced by exp(m), has a body twist V.

    V + [m, V] / 2 + [m, [m, V]] / 12: the inverse of the exponential's differential to the order of the step.
    """
    x, y = -mw * b + w * mb, mw * a - w * ma
    u, v = -mw * y, mw * x
    return a + 0.5 * x + u / 12, b + 0.5 * y + v / 12, w


@formula
def _travel(setting: Setting, move: Move) -> float:
    """The longest way of a finger or of a point of the object held by it, in a step of the hands [m]."""
    travel = 0.0
    for i in range(len(setting.fingers)):
        step = move.steps[i if len(move.hands) > 1 else 0]
        reach = math.hypot(setting.fingers[i].x, setting.fingers[i].y) + setting.outline.size
        travel = max(travel, math.hypot(step.x, step.y) + abs(step.angle) * reach)
    return travel


@formula
def advance(setting: Setting, move: Move, q: Row, scratch: Scratch) -> int:
    """Moves the hands by their steps and the object at q with them, as far as it goes.

    Written in the scratch for each finger: mode in the last step, contact point and gap at the end, and the modes seen
    on the way as bits.

    Returns:
        codes.GOING, or why it stopped on the way.
    """
    fingers, now, c = len(setting.fingers), scratch.now, scratch.contacts
    size, radius = setting.outline.size, setting.radius
    travel = _travel(setting, move)
    for i in range(fingers):
        now[i].modes, now[i].mode = 0, REST
    if least_gap(setting, move, 0.0, q.x, q.y, q.angle, 0) < -OVERLAP * size:
        return INSIDE
    s, status = 0.0, GOING
    for _ in range(MOST_STEPS):
        if s >= 1.0:
            break
        qx, qy, qt = q.x, q.y, q.angle
        n, mask = find_contacts(setting, move, s, qx, qy, qt, ALL_THAT_TOUCH, c)
        status, m0, m1, a, b, w = _twist(setting, n, scratch)
        if status != GOING:
            if status == JAMMED:
                status = GRASPED
                for k in range(len(move.hands)):
                    step = move.steps[k]
                    if step.x == 0.0 and step.y == 0.0 and step.angle == 0.0:
                        status = JAMMED
            break
        f0, f1 = (c[0].feature if n > 0 else -1), (c[1].feature if n > 1 else -1)
        i0, i1 = (c[0].finger if n > 0 else -1), (c[1].finger if n > 1 else -1)
        stretch = STEP * size
        for i in range(n):
            if not setting.outline.circle and c[i].feature % 2 == 1:
                stretch = min(stretch, max(CORNER_STEP * radius, SHARP_STEP * size))
        if n == 0:
            # Nothing moves the object before the fingers have come across the gap.
            stretch = max(stretch, 0.9 * least_gap(setting, move, s, qx, qy, qt, mask))
        h = (1 - s) / max(1.0, math.ceil((1 - s) * travel / stretch - 1e-9))
        shortest = h / (1 << HALVINGS)
        settled = 0
        e0, e1 = m0, m1
        da = db = dw = 0.0
        for _ in range(60):
            a1, b1, w1 = a, b, w
            da, db, dw = a, b, w
            e0, e1 = m0, m1
            changed = False
            if n > 0:
                n1 = n
                for stage in range(3):
                    share = 0.5 if stage < 2 else 1.0
                    ma, mb, mw = share * h * a1, share * h * b1, share * h * w1
                    x, y, t = displaced(qx, qy, qt, ma, mb, mw, 1.0)
                    n1, _ = find_contacts(setting, move, s + share * h, x, y, t, mask, c)
                    status, e0, e1, ta, tb, tw = _twist(setting, n1, scratch)
                    if status != GOING or n1 != n:
                        changed = True
                        status = GOING
                        break
                    a1, b1, w1 = _slope(ma, mb, mw, ta, tb, tw)
                    weight = 2.0 if stage < 2 else 1.0
                    da, db, dw = da + weight * a1, db + weight * b1, dw + weight * w1
                    if e0 != m0 or e1 != m1 or c[0].feature != f0 or (n > 1 and c[1].feature != f1):
                        changed = True
                if changed and h > shortest * 1.5:
                    h *= 0.5
                    continue
                if n1 != n:
                    da, db, dw = 6 * a, 6 * b, 6 * w
                    e0, e1 = m0, m1
                da, db, dw = da / 6, db / 6, dw / 6
            if settled == SETTLES:
                break
            hit, before = _first_touch(setting, move, s, q, (da, db, dw), h, mask, 2 * travel * h)
            if not hit:
                break
            h = max(before, 1e-9) * h
            settled += 1  # and again, since the shorter step moves the object a little otherwise
        q.x, q.y, q.angle = displaced(qx, qy, qt, da, db, dw, h)
        s = 1.0 if s + h > 1 - 1e-12 else s + h
        if n > 0:
            lax = (1 if e0 in (SEPARATION, REST) else 0) | (2 if e1 in (SEPARATION, REST) else 0)
            close_gaps(setting, move, s, q, mask, lax, c)
        for i in range(fingers):
            mode = -1
            if i0 == i:
                mode = m0
            if i1 == i and mode != STICKING:
                mode = m1 if mode < 0 or mode == SEPARATION else (m1 if m1 == STICKING else mode)
            if mode < 0:
                mode = SEPARATION
            now[i].mode = mode
            now[i].modes |= 1 << mode
    else:
        status = UNDECIDED
    see(setting, move, s, q, now)
    for k in range(len(move.hands)):
        hand = move.hands[k]
        hand.x, hand.y, hand.angle = hand_at(move, k, s)
    return status


@formula
def _first_touch(
    setting: Setting,
    move: Move,
    s: float,
    q: Row,
    V: tuple[float, float, float],
    h: float,
    mask: int,
    near: float,
) -> tuple[bool, float]:
    """Whether a contact not in the mask is made in a step h with the twist V from q, and after which part of it.

    If nothing is within `near` [m], nothing can be.
    """
    a, b, w = V
    qx, qy, qt = q.x, q.y, q.angle
    if least_gap(setting, move, s, qx, qy, qt, mask) >= near:
        return False, 0.0
    before, hit = 0.0, -1.0
    for look in range(1, LOOKS + 1):
        at = look / LOOKS
        x, y, t = displaced(qx, qy, qt, a, b, w, at * h)
        if least_gap(setting, move, s + at * h, x, y, t, mask) < 0:
            hit = at
            break
        before = at
    if hit < 0:
        return False, before
    while hit - before > 1e-12:
        middle = 0.5 * (before + hit)
        x, y, t = displaced(qx, qy, qt, a, b, w, middle * h)
        gap = least_gap(setting, move, s + middle * h, x, y, t, mask)
        if gap < 0:
            hit = middle
        else:
            before = middle
            if gap <= 0.5 * TOUCH * setting.outline.size:
                break
    return True, before


@formula
def _set_step(step: Row, hand: Row, to: Row, kind: int) -> None:
    """Writes the displacement from a hand's pose to another, in the kind's terms."""
    turn = to.angle - hand.angle
    if kind != AS_IT_IS:
        turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
    dx, dy = to.x - hand.x, to.y - hand.y
    if kind == BODY:
        # The logarithm of the step.
        c, d = math.cos(hand.angle), math.sin(hand.angle)
        x, y = c * dx + d * dy, c * dy - d * dx
        half = 0.5 * turn
        cot = half / math.tan(half) if abs(half) > 1e-6 else 1 - half * half / 3
        dx, dy = cot * x + half * y, cot * y - half * x
    step.x, step.y, step.angle = dx, dy, turn


@formula
def follow(
    setting: Setting,
    start: Row,
    poses: Rows,
    count: int,
    begin: int,
    kind: int,
    out: Rows,
    seen: Rows,
    scratch: Scratch,
) -> tuple[int, int]:
    """The object under hands that go from pose to pose.

    Args:
        start: X_WO at the first pose.
        poses: of `count` hands, one pose of each after the other.
        begin: the pose that is gone to first: 0, or 1 where the state at the first is known.
        kind: codes.STRAIGHT, BODY or AS_IT_IS.
        out: POSE rows, X_WO at each pose of the hands, or one row: only the last.
        seen: SEEN rows, one for each finger at each pose, or at the last, then with the modes of the whole way.

    Returns:
        the outcome as advance, and the number of poses reached.
    """
    fingers = len(setting.fingers)
    hands, steps, now = scratch.hands[:count], scratch.steps[:count], scratch.now
    q = scratch.q[0]
    q.x, q.y, q.angle = start.x, start.y, start.angle
    all_poses, all_seen = len(out) > 1, len(seen) > fingers
    for k in range(count):
        hands[k].x, hands[k].y, hands[k].angle = poses[k].x, poses[k].y, poses[k].angle
        steps[k].x = steps[k].y = steps[k].angle = 0.0
    for i in range(len(seen)):
        seen[i].modes = 0
    status, reached, number = GOING, 0, len(poses) // count
    for m in range(begin, number):
        if status == GOING:
            if m > 0:
                for k in range(count):
                    _set_step(steps[k], hands[k], poses[m * count + k], kind)
            status = advance(setting, Move(hands, steps, kind), q, scratch)
            reached += status == GOING
        row = m if all_poses else 0
        out[row].x, out[row].y, out[row].angle = q.x, q.y, q.angle
        for i in range(fingers):
            to = seen[m * fingers + i if all_seen else i]
            to.x, to.y, to.gap, to.mode = now[i].x, now[i].y, now[i].gap, now[i].mode
            to.modes |= now[i].modes
    return status, reached
