"""Fingers against an object over a stretch of their motion, compiled: at most two contacts at a time.

The plain version, for any number, is simulation.plant.plain. A step is a fourth-order Runge-Kutta-Munthe-Kaas step
(exact where the twist is constant); where contact modes or the touched features change on the way it is halved down to
a thirty-second, and where a finger touches it ends.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ...geometry.pose import Array
from .touch.kernels import GOING, JAMMED, REST, SEPARATION, STICKING, UNDECIDED, one, two

GRASPED, INSIDE, MANY = 2, 3, 4

part = nb.njit(cache=True, nogil=True, error_model="numpy")

STEP = 1 / 60  # longest travel of the fingers in one step, by the outline's size
TOUCH = 2e-8  # a gap up to this, by the outline's size, touches
OVERLAP = 1e-5  # a deeper overlap at the start, by the outline's size, is inside
_LOOKS = 8  # places on a step at which fingers that do not touch are watched
_HALVINGS = 5
_SETTLES = 4  # times that a step is shortened to where something touches


@part
def nearest(shape: Array, x: float, y: float) -> Any:
    """Signed distance from the outline to a point in O, nearest point, inward normal there, and the feature.

    Features: 2k an edge, 2k + 1 the corner at its start.
    """
    if shape[0, 4] < 0:
        dx, dy = x - shape[0, 0], y - shape[0, 1]
        d = math.sqrt(dx * dx + dy * dy)
        ux, uy = (dx / d, dy / d) if d > 0 else (1.0, 0.0)
        R = shape[0, 2]
        return d - R, shape[0, 0] + R * ux, shape[0, 1] + R * uy, -ux, -uy, 0
    best, edge, corner = np.inf, 0, False
    for i in range(shape.shape[0]):
        dx, dy = x - shape[i, 0], y - shape[i, 1]
        s = dx * shape[i, 2] + dy * shape[i, 3]
        if s < 0:
            square = dx * dx + dy * dy
            if square < best:
                best, edge, corner = square, i, True
        elif s <= shape[i, 4]:
            d = dx * shape[i, 5] + dy * shape[i, 6]
            if d * d < best:
                best, edge, corner = d * d, i, False
    dx, dy = x - shape[edge, 0], y - shape[edge, 1]
    nx, ny = shape[edge, 5], shape[edge, 6]
    if not corner:
        s = dx * shape[edge, 2] + dy * shape[edge, 3]
        px, py = shape[edge, 0] + s * shape[edge, 2], shape[edge, 1] + s * shape[edge, 3]
        return -(dx * nx + dy * ny), px, py, nx, ny, 2 * edge
    d = math.sqrt(best)
    sign = 1.0 if shape[edge, 7] > 0.5 else -1.0
    if d > 1e-12 * shape[0, 9]:
        nx, ny = -sign * dx / d, -sign * dy / d
    return sign * d, shape[edge, 0], shape[edge, 1], nx, ny, 2 * edge + 1


@part
def second(shape: Array, x: float, y: float, taken: int) -> Any:
    """As nearest, for another edge or corner that faces the point; distance inf if there is none.

    Only an outline that is not convex can meet a round finger twice.
    """
    best, edge, corner = np.inf, -1, False
    count = shape.shape[0]
    least = -OVERLAP * shape[0, 9]
    if shape[0, 8] > 0.5:
        return np.inf, 0.0, 0.0, 0.0, 0.0, -1
    for i in range(count):
        dx, dy = x - shape[i, 0], y - shape[i, 1]
        s = dx * shape[i, 2] + dy * shape[i, 3]
        if s < 0:
            if 2 * i + 1 == taken or shape[i, 7] < 0.5:
                continue
            j = i - 1 if i > 0 else count - 1
            before = (x - shape[j, 0]) * shape[j, 2] + (y - shape[j, 1]) * shape[j, 3]
            d = math.sqrt(dx * dx + dy * dy)
            if before > shape[j, 4] and d < best:
                best, edge, corner = d, i, True
        elif s <= shape[i, 4] and 2 * i != taken:
            d = -(dx * shape[i, 5] + dy * shape[i, 6])
            if least < d < best:
                best, edge, corner = d, i, False
    if edge < 0:
        return np.inf, 0.0, 0.0, 0.0, 0.0, -1
    dx, dy = x - shape[edge, 0], y - shape[edge, 1]
    if corner:
        return best, shape[edge, 0], shape[edge, 1], -dx / best, -dy / best, 2 * edge + 1
    s = dx * shape[edge, 2] + dy * shape[edge, 3]
    px, py = shape[edge, 0] + s * shape[edge, 2], shape[edge, 1] + s * shape[edge, 3]
    return best, px, py, shape[edge, 5], shape[edge, 6], 2 * edge


@part
def displaced(qx: float, qy: float, qt: float, a: float, b: float, w: float, s: float) -> Any:
    """A pose moved by s times a body twist for unit time: X · exp(s V)."""
    a, b, w = s * a, s * b, s * w
    if abs(w) > 1e-4:
        sine, versine = math.sin(w) / w, (1 - math.cos(w)) / w
    else:
        sine, versine = 1 - w * w / 6, w / 2 - w * w * w / 24
    x, y = sine * a - versine * b, versine * a + sine * b
    c, d = math.cos(qt), math.sin(qt)
    return qx + c * x - d * y, qy + d * x + c * y, qt + w


@part
def _hand_at(hand: Array, step: Array, body: int, i: int, s: float) -> Any:
    if body:
        return displaced(hand[i, 0], hand[i, 1], hand[i, 2], step[i, 0], step[i, 1], step[i, 2], s)
    return hand[i, 0] + s * step[i, 0], hand[i, 1] + s * step[i, 1], hand[i, 2] + s * step[i, 2]


@part
def _tip(qx: float, qy: float, qt: float, hx: float, hy: float, ht: float, fx: float, fy: float) -> Any:
    """A fingertip's centre in O."""
    c, d = math.cos(ht), math.sin(ht)
    x, y = hx + c * fx - d * fy - qx, hy + d * fx + c * fy - qy
    c, d = math.cos(qt), math.sin(qt)
    return c * x + d * y, c * y - d * x


@part
def _gap(
    shape: Array,
    radius: float,
    fingers: Array,
    qx: float,
    qy: float,
    qt: float,
    hand: Array,
    step: Array,
    body: int,
    s: float,
    mask: int,
) -> Any:
    """The least gap of the fingers' contacts that are not in the mask, two bits to a finger."""
    least = np.inf
    for i in range(fingers.shape[0]):
        hx, hy, ht = _hand_at(hand, step, body, i if hand.shape[0] > 1 else 0, s)
        x, y = _tip(qx, qy, qt, hx, hy, ht, fingers[i, 0], fingers[i, 1])
        d, _, _, _, _, feature = nearest(shape, x, y)
        other = np.inf
        if mask >> (2 * i) & 1:
            if not mask >> (2 * i + 1) & 1:
                other = second(shape, x, y, feature)[0]
        else:
            other = d
        least = min(least, other - radius)
    return least


@part
def _contacts(
    cof: Array,
    shape: Array,
    radius: float,
    fingers: Array,
    qx: float,
    qy: float,
    qt: float,
    hand: Array,
    step: Array,
    body: int,
    s: float,
    mask: int,
    c: Array,
) -> Any:
    """Fills the rows of c with the contacts in the mask: point and normal about the COF, finger's velocity there, gap,
    finger, feature. Of mask < 0 with all that touch. Returns their number and the mask."""
    count, found = 0, 0
    touch = TOUCH * shape[0, 9]
    co, so = math.cos(qt), math.sin(qt)
    for i in range(fingers.shape[0]):
        k = i if hand.shape[0] > 1 else 0
        hx, hy, ht = _hand_at(hand, step, body, k, s)
        x, y = _tip(qx, qy, qt, hx, hy, ht, fingers[i, 0], fingers[i, 1])
        d, px, py, nx, ny, feature = nearest(shape, x, y)
        first = d - radius <= touch if mask < 0 else (mask >> (2 * i) & 1) == 1
        if not first and d - radius > touch:
            continue
        for slot in range(2):
            if slot == 1:
                d, px, py, nx, ny, feature = second(shape, x, y, feature)
            if (d - radius <= touch) if mask < 0 else ((mask >> (2 * i + slot) & 1) == 1 and d < np.inf):
                found |= 1 << (2 * i + slot)
                if count < 4:
                    # The finger turns with its hand: its material velocity at the contact, in O.
                    rx, ry = qx + co * px - so * py - hx, qy + so * px + co * py - hy
                    w = step[k, 2]
                    if body:
                        ch, sh = math.cos(ht), math.sin(ht)
                        ux = ch * step[k, 0] - sh * step[k, 1] - w * ry
                        uy = sh * step[k, 0] + ch * step[k, 1] + w * rx
                    else:
                        ux, uy = step[k, 0] - w * ry, step[k, 1] + w * rx
                    c[count, 0], c[count, 1], c[count, 2], c[count, 3] = px - cof[0], py - cof[1], nx, ny
                    c[count, 4], c[count, 5] = co * ux + so * uy, co * uy - so * ux
                    c[count, 6], c[count, 7], c[count, 8] = d - radius, i, feature
                count += 1
    return count, found


@part
def _twist(kind: int, table: Array, cof: Array, mu: float, c: Array, count: int, rays: Array) -> Any:
    """Status, modes and the body twist about O's origin of the contacts in c."""
    ell = table[0, 0]
    if count == 0:
        return GOING, REST, REST, 0.0, 0.0, 0.0
    if count == 1:
        m0, vx, vy, w, _ = one(
            kind, table, c[0, 0] / ell, c[0, 1] / ell, c[0, 2], c[0, 3], c[0, 4], c[0, 5], mu
        )
        m1, status = REST, GOING
    elif count == 2:
        for i in range(2):
            c[i, 0] /= ell
            c[i, 1] /= ell
        status, m0, m1, vx, vy, w = two(kind, table, c, mu, rays)
        for i in range(2):
            c[i, 0] *= ell
            c[i, 1] *= ell
    else:
        return MANY, REST, REST, 0.0, 0.0, 0.0
    w /= ell
    return status, m0, m1, vx + w * cof[1], vy - w * cof[0], w


@part
def _slope(ma: float, mb: float, mw: float, a: float, b: float, w: float) -> Any:
    """Rate of the displacement's logarithm when the body, displaced by exp(m), has a body twist."""
    x, y = -mw * b + w * mb, mw * a - w * ma
    u, v = -mw * y, mw * x
    return a + 0.5 * x + u / 12, b + 0.5 * y + v / 12, w


@part
def _settle(
    shape: Array,
    radius: float,
    fingers: Array,
    q: Array,
    hand: Array,
    step: Array,
    body: int,
    s: float,
    mask: int,
    c: Array,
    cof: Array,
    only_inside: int,
) -> Any:
    """Moves the object so that the contacts of the mask touch exactly (or only those that overlap): twice, so that what
    the curved normals leave is of fourth order."""
    ell = 0.3 * shape[0, 9]
    for _ in range(3):
        count, _ = _contacts(cof, shape, radius, fingers, q[0], q[1], q[2], hand, step, body, s, mask, c)
        a = b = ab = ga = gb = 0.0
        ax = ay = at = bx = by = bt = 0.0
        rows = 0
        for i in range(min(count, 2)):
            gap = c[i, 6]
            if only_inside >> i & 1 and gap >= 0:
                continue
            t = (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2]) / ell
            if rows == 0:
                ax, ay, at, ga = c[i, 2], c[i, 3], t, -gap
            else:
                bx, by, bt, gb = c[i, 2], c[i, 3], t, -gap
            rows += 1
        if rows == 0 or max(abs(ga), abs(gb)) < 1e-15 * shape[0, 9]:
            return
        a = ax * ax + ay * ay + at * at
        if rows == 1:
            # One contact: along its normal, without a turn, as the finger's push leaves its bearing.
            x, y, w = ga * ax, ga * ay, 0.0
        else:
            b, ab = bx * bx + by * by + bt * bt, ax * bx + ay * by + at * bt
            lift = 1e-9 * (a + b)
            det = (a + lift) * (b + lift) - ab * ab
            p, r = ((b + lift) * ga - ab * gb) / det, ((a + lift) * gb - ab * ga) / det
            x, y, w = p * ax + r * bx, p * ay + r * by, (p * at + r * bt) / ell
        # About the COF.
        co, so = math.cos(q[2]), math.sin(q[2])
        x, y = x + w * cof[1], y - w * cof[0]
        q[0] += co * x - so * y
        q[1] += so * x + co * y
        q[2] += w


@part
def push_out(shape: Array, cof: Array, radius: float, fingers: Array, object_: Array, hand: Array) -> Any:
    """Moves an object that overlaps fingers out of them, in place, the shortest way; returns the largest overlap."""
    c, step = np.zeros((4, 9)), np.zeros(hand.shape)
    deepest = 0.0
    for _ in range(50):
        worst = 0.0
        mask = 0
        for i in range(fingers.shape[0]):
            k = i if hand.shape[0] > 1 else 0
            x, y = _tip(
                object_[0],
                object_[1],
                object_[2],
                hand[k, 0],
                hand[k, 1],
                hand[k, 2],
                fingers[i, 0],
                fingers[i, 1],
            )
            d, _, _, _, _, feature = nearest(shape, x, y)
            if d - radius < 0:
                mask |= 1 << (2 * i)
                worst = max(worst, radius - d)
            if second(shape, x, y, feature)[0] - radius < 0:
                mask |= 1 << (2 * i + 1)
        deepest = max(deepest, worst)
        if worst <= 1e-3 * TOUCH * shape[0, 9]:
            break
        _settle(shape, radius, fingers, object_, hand, step, 0, 0.0, mask, c, cof, 0)
    return deepest


@part
def advance(
    kind: int,
    table: Array,
    cof: Array,
    shape: Array,
    mu: float,
    radius: float,
    fingers: Array,
    object_: Array,
    hand: Array,
    step: Array,
    body: int,
    seen: Array,
) -> Any:
    """Moves the hand by a step and the object with it.

    Args:
        kind, table: the limit surface (surface_table). cof: in O (2,). shape: outline_table. mu: of the contacts.
        radius: of the fingertips. fingers: their centres in E (k, 2), k ≤ 2.
        object_: X_WO (3,), updated. hand: X_WE (1, 3), or one for each finger (k, 3), updated.
        step: the hand's displacement (dx, dy, dθ) in W, straight; with `body` a body twist. Shape as hand's.
        seen: (k, 5), written for each finger: mode in the last step, contact point x, y in O and gap at the end (nan
            where nothing is near), and the modes seen on the way as bits 1 << mode.

    Returns:
        0, or why it stopped on the way: 1 jammed, 2 grasped, 3 starts inside, 4 more than two contacts, 5 undecided.
    """
    count = fingers.shape[0]
    size = shape[0, 9]
    c, rays = np.empty((4, 9)), np.empty((16, 3))
    travel = 0.0
    for i in range(count):
        k = i if hand.shape[0] > 1 else 0
        reach = math.hypot(fingers[i, 0], fingers[i, 1]) + size
        travel = max(travel, math.hypot(step[k, 0], step[k, 1]) + abs(step[k, 2]) * reach)
        seen[i, 4] = 0.0
        seen[i, 0] = REST
    if (
        _gap(shape, radius, fingers, object_[0], object_[1], object_[2], hand, step, body, 0.0, 0)
        < -OVERLAP * size
    ):
        return INSIDE
    s, status = 0.0, GOING
    for _ in range(1_000_000):
        if s >= 1.0:
            break
        qx, qy, qt = object_[0], object_[1], object_[2]
        n, mask = _contacts(cof, shape, radius, fingers, qx, qy, qt, hand, step, body, s, -1, c)
        status, m0, m1, a, b, w = _twist(kind, table, cof, mu, c, n, rays)
        if status != GOING:
            if status == JAMMED:
                status = GRASPED
                for i in range(hand.shape[0]):
                    if step[i, 0] == 0.0 and step[i, 1] == 0.0 and step[i, 2] == 0.0:
                        status = JAMMED
            break
        f0, f1 = (c[0, 8] if n > 0 else -1.0), (c[1, 8] if n > 1 else -1.0)
        i0, i1 = (int(c[0, 7]) if n > 0 else -1), (int(c[1, 7]) if n > 1 else -1)
        stretch = STEP * size
        for i in range(n):
            if shape[0, 4] > 0 and int(c[i, 8]) % 2 == 1:
                stretch = min(stretch, max(0.25 * radius, 2e-4 * size))
        h = (1 - s) / max(1.0, math.ceil((1 - s) * travel / stretch - 1e-9))
        shortest = h / (1 << _HALVINGS)
        settled = 0
        e0, e1 = m0, m1
        da = db = dw = 0.0
        for _ in range(60):
            a1, b1, w1 = a, b, w
            da, db, dw = a, b, w
            e0, e1 = m0, m1
            changed = False
            if n > 0:
                for stage in range(3):
                    share = 0.5 if stage < 2 else 1.0
                    ma, mb, mw = share * h * a1, share * h * b1, share * h * w1
                    x, y, t = displaced(qx, qy, qt, ma, mb, mw, 1.0)
                    n1, _ = _contacts(
                        cof, shape, radius, fingers, x, y, t, hand, step, body, s + share * h, mask, c
                    )
                    status, e0, e1, ta, tb, tw = _twist(kind, table, cof, mu, c, n1, rays)
                    if status != GOING or n1 != n:
                        changed = True
                        status = GOING
                        break
                    a1, b1, w1 = _slope(ma, mb, mw, ta, tb, tw)
                    weight = 2.0 if stage < 2 else 1.0
                    da, db, dw = da + weight * a1, db + weight * b1, dw + weight * w1
                    if e0 != m0 or e1 != m1 or (n > 0 and c[0, 8] != f0) or (n > 1 and c[1, 8] != f1):
                        changed = True
                if changed and h > shortest * 1.5:
                    h *= 0.5
                    continue
                if n1 != n:
                    da, db, dw = 6 * a, 6 * b, 6 * w
                    e0, e1 = m0, m1
                da, db, dw = da / 6, db / 6, dw / 6
            if settled == _SETTLES:
                break
            # Fingers that do not touch yet.
            before, hit = 0.0, -1.0
            if (
                _gap(shape, radius, fingers, qx, qy, qt, hand, step, body, s, mask)
                < 2 * travel * h + radius * 0.0
            ):
                for look in range(1, _LOOKS + 1):
                    at = look / _LOOKS
                    x, y, t = displaced(qx, qy, qt, da, db, dw, at * h)
                    if _gap(shape, radius, fingers, x, y, t, hand, step, body, s + at * h, mask) < 0:
                        hit = at
                        break
                    before = at
            if hit < 0:
                break
            while hit - before > 1e-12:
                middle = 0.5 * (before + hit)
                x, y, t = displaced(qx, qy, qt, da, db, dw, middle * h)
                gap = _gap(shape, radius, fingers, x, y, t, hand, step, body, s + middle * h, mask)
                if gap < 0:
                    hit = middle
                else:
                    before = middle
                    if gap <= 0.5 * TOUCH * size:
                        break
            h = max(before, 1e-9) * h
            settled += 1  # and again, since the shorter step moves the object a little otherwise
        x, y, t = displaced(qx, qy, qt, da, db, dw, h)
        object_[0], object_[1], object_[2] = x, y, t
        s = 1.0 if s + h > 1 - 1e-12 else s + h
        if n > 0:
            lax = (1 if e0 in (SEPARATION, REST) else 0) | (2 if e1 in (SEPARATION, REST) else 0)
            _settle(shape, radius, fingers, object_, hand, step, body, s, mask, c, cof, lax)
        for i in range(count):
            mode = -1
            if i0 == i:
                mode = m0
            if i1 == i and mode != STICKING:
                mode = m1 if mode < 0 or mode == SEPARATION else (m1 if m1 == STICKING else mode)
            if mode < 0:
                mode = SEPARATION
            seen[i, 0] = mode
            seen[i, 4] = int(seen[i, 4]) | (1 << mode)
    else:
        status = UNDECIDED
    for i in range(hand.shape[0]):
        hand[i, 0], hand[i, 1], hand[i, 2] = _hand_at(hand, step, body, i, s)
    for i in range(count):
        k = i if hand.shape[0] > 1 else 0
        x, y = _tip(
            object_[0],
            object_[1],
            object_[2],
            hand[k, 0],
            hand[k, 1],
            hand[k, 2],
            fingers[i, 0],
            fingers[i, 1],
        )
        d, px, py, _, _, _ = nearest(shape, x, y)
        seen[i, 1], seen[i, 2], seen[i, 3] = px, py, d - radius
    return status


@part
def follow(
    kind: int,
    table: Array,
    cof: Array,
    shape: Array,
    mu: float,
    radius: float,
    fingers: Array,
    object_: Array,
    hands: Array,
    body: int,
    out: Array,
    seen: Array,
) -> Any:
    """The object under a hand that goes from pose to pose, hands (m, h, 3); the shorter way round from angle to angle.

    Args:
        object_: X_WO at the first pose, updated.
        body: each step as the constant body twist between two poses, instead of straight in W.
        out: poses at each hand pose, shape (m, 3), or (1, 3): only the last. seen: likewise (m, k, 5) or (1, k, 5).

    Returns:
        the outcome as advance, and the number of poses reached.
    """
    m, h = hands.shape[0], hands.shape[1]
    hand, step = hands[0].copy(), np.zeros((h, 3))
    status, reached = GOING, m
    now = np.zeros((fingers.shape[0], 5))
    for k in range(m):
        if k > 0:
            for i in range(h):
                turn = hands[k, i, 2] - hand[i, 2]
                turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
                dx, dy = hands[k, i, 0] - hand[i, 0], hands[k, i, 1] - hand[i, 1]
                if body:
                    # The logarithm of the step.
                    c, d = math.cos(hand[i, 2]), math.sin(hand[i, 2])
                    x, y = c * dx + d * dy, c * dy - d * dx
                    half = 0.5 * turn
                    cot = half / math.tan(half) if abs(half) > 1e-6 else 1 - half * half / 3
                    step[i, 0], step[i, 1] = cot * x + half * y, cot * y - half * x
                else:
                    step[i, 0], step[i, 1] = dx, dy
                step[i, 2] = turn
        status = advance(kind, table, cof, shape, mu, radius, fingers, object_, hand, step, body, now)
        row = k if out.shape[0] > 1 else 0
        out[row] = object_
        if seen.shape[0] > 1:
            seen[k] = now
        else:
            for i in range(fingers.shape[0]):
                past = int(seen[0, i, 4])
                seen[0, i] = now[i]
                seen[0, i, 4] = past | int(now[i, 4])
        if status != GOING:
            reached = k
            for r in range(k + 1, out.shape[0]):
                out[r] = object_
            for r in range(k + 1, seen.shape[0]):
                seen[r] = now
            break
    return status, reached


@part
def many(
    first: int,
    last: int,
    kind: int,
    tables: Array,
    cofs: Array,
    shape: Array,
    mus: Array,
    radius: float,
    fingers: Array,
    objects: Array,
    hands: Array,
    body: int,
    push: int,
    out: Array,
    seen: Array,
    outcome: Array,
) -> Any:
    """follow for the runs first to last: tables, cofs, mus and hands have one row for all or one for each run."""
    for r in range(first, last):
        table = tables[r if tables.shape[0] > 1 else 0]
        cof = cofs[r if cofs.shape[0] > 1 else 0]
        mu = mus[r if mus.shape[0] > 1 else 0]
        way = hands[r if hands.shape[0] > 1 else 0]
        if push:
            push_out(shape, cof, radius, fingers, objects[r], way[0])
        status, _ = follow(
            kind, table, cof, shape, mu, radius, fingers, objects[r], way, body, out[r], seen[r]
        )
        outcome[r] = status
