"""The contacts of fingers with an object at one moment: where they are, and the move that closes their gaps.

Python runs these formulas as they stand, and simulation.plant.kernels compiles them.
"""

import math

import numpy as np

from ...formulas import formula
from ...geometry.displacement import displaced
from .arrays import Move, Row, Rows, Scratch, Setting
from .codes import AS_IT_IS, BODY
from .facing import Place, nearest, second

TOUCH = 2e-8  # a gap up to this, by the outline's size, touches
LEVER = 0.3  # of the outline's size: the length by which a turn is weighed against a shift where contacts are restored


@formula
def hand_at(move: Move, k: int, s: float) -> tuple[float, float, float]:
    """The pose of hand k after a part s of its step."""
    hand, step = move.hands[k], move.steps[k]
    if move.kind == BODY:
        return displaced(hand.x, hand.y, hand.angle, step.x, step.y, step.angle, s)
    return hand.x + s * step.x, hand.y + s * step.y, hand.angle + s * step.angle


@formula
def tip_in_object(
    setting: Setting, move: Move, i: int, s: float, qx: float, qy: float, qt: float
) -> tuple[float, float]:
    """The centre of fingertip i in O, with the object at the pose q."""
    hx, hy, ht = hand_at(move, i if len(move.hands) > 1 else 0, s)
    finger = setting.fingers[i]
    c, d = math.cos(ht), math.sin(ht)
    x, y = hx + c * finger.x - d * finger.y - qx, hy + d * finger.x + c * finger.y - qy
    c, d = math.cos(qt), math.sin(qt)
    return c * x + d * y, c * y - d * x


@formula
def least_gap(setting: Setting, move: Move, s: float, qx: float, qy: float, qt: float, mask: int) -> float:
    """The least gap of the fingers' contacts that are not in the mask, two bits to a finger."""
    least = np.inf
    for i in range(len(setting.fingers)):
        x, y = tip_in_object(setting, move, i, s, qx, qy, qt)
        place = nearest(setting.outline, x, y)
        other = np.inf
        if mask >> (2 * i) & 1:
            if not mask >> (2 * i + 1) & 1:
                other = second(setting.outline, x, y, place.feature).distance
        else:
            other = place.distance
        least = min(least, other - setting.radius)
    return least


@formula
def _set_contact(
    contact: Row, setting: Setting, move: Move, i: int, s: float, q: tuple[float, float, float], place: Place
) -> None:
    """Writes a contact of finger i at a place, with the object at the pose q."""
    # The finger turns with its hand: its material velocity at the contact, in O.
    k = i if len(move.hands) > 1 else 0
    hx, hy, ht = hand_at(move, k, s)
    step = move.steps[k]
    qx, qy, qt = q
    co, so = math.cos(qt), math.sin(qt)
    rx, ry = qx + co * place.x - so * place.y - hx, qy + so * place.x + co * place.y - hy
    ux, uy = step.x, step.y
    if move.kind == BODY:
        ch, sh = math.cos(ht), math.sin(ht)
        ux, uy = ch * step.x - sh * step.y, sh * step.x + ch * step.y
    ux, uy = ux - step.angle * ry, uy + step.angle * rx
    contact.x, contact.y, contact.nx, contact.ny = (
        place.x - setting.cof_x,
        place.y - setting.cof_y,
        place.nx,
        place.ny,
    )
    contact.ux, contact.uy = co * ux + so * uy, co * uy - so * ux
    contact.gap, contact.finger, contact.feature = place.distance - setting.radius, i, place.feature


@formula
def find_contacts(
    setting: Setting, move: Move, s: float, qx: float, qy: float, qt: float, mask: int, contacts: Rows
) -> tuple[int, int]:
    """Writes the contacts in the mask, or all that touch; returns their number and the mask."""
    count, found = 0, 0
    touch = TOUCH * setting.outline.size
    for i in range(len(setting.fingers)):
        x, y = tip_in_object(setting, move, i, s, qx, qy, qt)
        place = nearest(setting.outline, x, y)
        first = place.distance - setting.radius <= touch if mask < 0 else (mask >> (2 * i) & 1) == 1
        if not first and place.distance - setting.radius > touch:
            continue
        other = second(setting.outline, x, y, place.feature)
        if mask < 0:
            both = other.distance - setting.radius <= touch
        else:
            both = (mask >> (2 * i + 1) & 1) == 1 and other.distance < np.inf
        found |= (1 if first else 0) << (2 * i) | (1 if both else 0) << (2 * i + 1)
        # In a hollow by their features: which of two touching places is nearer changes with the rounding.
        if both and (not first or other.feature < place.feature):
            place, other = other, place
        if (first or both) and count < len(contacts):
            _set_contact(contacts[count], setting, move, i, s, (qx, qy, qt), place)
        count += 1 if first or both else 0
        if first and both:
            if count < len(contacts):
                _set_contact(contacts[count], setting, move, i, s, (qx, qy, qt), other)
            count += 1
    return count, found


@formula
def close_gaps(setting: Setting, move: Move, s: float, q: Row, mask: int, lax: int, contacts: Rows) -> None:
    """Moves the object so that the contacts of the mask touch exactly, those of the bits `lax` only if they overlap.

    Three times, so that what the curved normals leave is of fourth order.
    """
    ell = LEVER * setting.outline.size
    for _ in range(3):
        count, _ = find_contacts(setting, move, s, q.x, q.y, q.angle, mask, contacts)
        ga = gb = ax = ay = at = bx = by = bt = 0.0
        rows = 0
        for i in range(min(count, 2)):
            c = contacts[i]
            if lax >> i & 1 and c.gap >= 0:
                continue
            t = (c.x * c.ny - c.y * c.nx) / ell
            if rows == 0:
                ax, ay, at, ga = c.nx, c.ny, t, -c.gap
            else:
                bx, by, bt, gb = c.nx, c.ny, t, -c.gap
            rows += 1
        if rows == 0 or max(abs(ga), abs(gb)) < 1e-15 * setting.outline.size:
            return
        if rows == 1:
            # One contact: along its normal, without a turn, as the finger's push leaves its bearing.
            x, y, w = ga * ax, ga * ay, 0.0
        else:
            # The least move that closes both gaps; where the two normals are nearly one, the mean of both.
            a, b, ab = ax * ax + ay * ay + at * at, bx * bx + by * by + bt * bt, ax * bx + ay * by + at * bt
            lift = 1e-9 * (a + b)
            det = (a + lift) * (b + lift) - ab * ab
            p, r = ((b + lift) * ga - ab * gb) / det, ((a + lift) * gb - ab * ga) / det
            x, y, w = p * ax + r * bx, p * ay + r * by, (p * at + r * bt) / ell
        # About the COF.
        co, so = math.cos(q.angle), math.sin(q.angle)
        x, y = x + w * setting.cof_y, y - w * setting.cof_x
        q.x += co * x - so * y
        q.y += so * x + co * y
        q.angle += w


@formula
def push_out(setting: Setting, q: Row, hands: Rows, scratch: Scratch) -> None:
    """Moves an object at q that overlaps fingers out of them, the shortest way."""
    for k in range(len(hands)):
        scratch.steps[k].x = scratch.steps[k].y = scratch.steps[k].angle = 0.0
    move = Move(hands, scratch.steps, AS_IT_IS)
    for _ in range(50):
        worst, mask = 0.0, 0
        for i in range(len(setting.fingers)):
            x, y = tip_in_object(setting, move, i, 0.0, q.x, q.y, q.angle)
            place = nearest(setting.outline, x, y)
            if place.distance - setting.radius < 0:
                mask |= 1 << (2 * i)
                worst = max(worst, setting.radius - place.distance)
            if second(setting.outline, x, y, place.feature).distance - setting.radius < 0:
                mask |= 1 << (2 * i + 1)
        if worst <= TOUCH * setting.outline.size:  # every step closes what touches
            break
        close_gaps(setting, move, 0.0, q, mask, 0, scratch.contacts)


@formula
def see(setting: Setting, move: Move, s: float, q: Row, now: Rows) -> None:
    """Writes each finger's nearest point and gap."""
    for i in range(len(setting.fingers)):
        x, y = tip_in_object(setting, move, i, s, q.x, q.y, q.angle)
        place = nearest(setting.outline, x, y)
        now[i].x, now[i].y, now[i].gap = place.x, place.y, place.distance - setting.radius
