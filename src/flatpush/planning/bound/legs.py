"""What a leg between two boxes of poses costs at least, compiled.

A box holds the poses whose reference point lies in a rectangle and whose angle lies in an interval. The turning
centres of a pose then lie in discs: about those of the box's middle, with half the rectangle's diagonal plus the chord
that half the interval makes at the centre's distance from the reference point.

A word A-S-B or A-B-A joins the centre of its first arc, fixed while it turns, to that of its last one (three_twist.py).
With w between the middles of their discs and ρ the sum of the radii, the distance of the centres is |w| ± ρ and their
direction arg w ± asin(ρ/|w|). The distance gives the straight piece or the middle arc, the direction gives both outer
arcs modulo a turn, each within an interval. An interval that holds 0 counts as 0: this is the jump of the length where
an arc vanishes, of which the lower branch is taken. Two arcs to one side add up to the difference of the angles,
modulo a turn; two arcs to different sides differ by it. So the least pair above both least arcs is taken.

Every bound is below what the word costs between any two poses of the boxes, so the least of the six is below every
leg. Costs are lengths: the time of a piece is not linear in it, and is not treated.
"""

import math
from typing import NamedTuple

from ...compiled import inner
from ...formulas import Record

TURN = 2 * math.pi
# Slack for rounding, and for the arcs just short of a full turn that six_words.py takes as zero: of lengths by the
# query's, of angles [rad].
ROUNDING, ANGLE = 1e-9, 1e-9
LEFT, STRAIGHT, RIGHT = 0, 1, 2  # places of the rates


class End(NamedTuple):
    """A box of poses as a leg sees it.

    Attributes:
        x, y, theta: the middle: reference point [m] and angle [rad]; c, s: its cosine and sine.
        away: half the diagonal of the rectangle [m].
        turn: half the interval of angles [rad]; chord: 2 sin(turn/2), what it moves a point at a distance of 1.
        at_x, at_y: the reference point in the object frame [m].
    """

    x: float
    y: float
    theta: float
    c: float
    s: float
    away: float
    turn: float
    chord: float
    at_x: float
    at_y: float


class Disc(NamedTuple):
    """Where a turning centre may be [m]."""

    x: float
    y: float
    radius: float


class Between(NamedTuple):
    """From one turning centre to another: least and greatest distance [m], direction and half its interval [rad]."""

    near: float
    far: float
    way: float
    spread: float


@inner
def end_of(
    x: float, y: float, theta: float, half: tuple[float, float, float], at: tuple[float, float]
) -> End:
    """A box by its middle, half its sides and its reference point."""
    turn = half[2] + ANGLE
    return End(
        x, y, theta, math.cos(theta), math.sin(theta), math.hypot(half[0], half[1]),
        turn, 2.0 * math.sin(0.5 * min(turn, math.pi)), at[0], at[1],
    )  # fmt: skip


@inner
def leg_bound(car: Record, a: End, b: End, limit: float) -> float:
    """What a leg of a car from a box to a box costs at least; any value above the limit where that is above it."""
    scale = math.hypot(b.x - a.x, b.y - a.y) + 2.0 * car.radius
    left_a, right_a = _disc(a, car.left_x, car.left_y), _disc(a, car.right_x, car.right_y)
    left_b, right_b = _disc(b, car.left_x, car.left_y), _disc(b, car.right_x, car.right_y)
    left, right = _between(left_a, left_b, scale), _between(right_a, right_b, scale)
    ahead = math.atan2(car.ahead_y, car.ahead_x)
    wl, ws, wr = car.rate[LEFT], car.rate[STRAIGHT], car.rate[RIGHT]
    best = limit
    best = min(best, _same(left, a, b, ahead, 1.0, wl, ws, best))
    best = min(best, _same(right, a, b, ahead, -1.0, wr, ws, best))
    best = min(best, _other(car, _between(left_a, right_b, scale), a, b, 1.0, best))
    best = min(best, _other(car, _between(right_a, left_b, scale), a, b, -1.0, best))
    best = min(best, _three(car, left, a, b, 1.0, best))
    return min(best, _three(car, right, a, b, -1.0, best))


@inner
def _disc(end: End, x: float, y: float) -> Disc:
    """Where a point of the object frame is."""
    dx, dy = x - end.at_x, y - end.at_y
    return Disc(
        end.x + end.c * dx - end.s * dy,
        end.y + end.s * dx + end.c * dy,
        end.away + end.chord * math.hypot(dx, dy),
    )


@inner
def _between(a: Disc, b: Disc, scale: float) -> Between:
    dx, dy, radius = b.x - a.x, b.y - a.y, a.radius + b.radius + ROUNDING * scale
    distance = math.hypot(dx, dy)
    if distance <= radius:
        return Between(0.0, distance + radius, 0.0, math.pi)
    return Between(distance - radius, distance + radius, math.atan2(dy, dx), math.asin(radius / distance))


@inner
def _least_turn(angle: float, half: float) -> float:
    """The least in [0, 2π) of the angles within half of one, modulo a turn."""
    middle = angle % TURN
    return middle - half if half < middle and middle + half < TURN else 0.0


@inner
def _least_above(low: float, angle: float, half: float) -> float:
    """The least value from low on that is within half of an angle, modulo a turn."""
    turns = math.ceil((low - angle - half) / TURN)
    return max(low, angle - half + TURN * turns)


@inner
def _same(
    w: Between, a: End, b: End, ahead: float, sense: float, rate: float, straight: float, limit: float
) -> float:
    """LSL (sense 1) or RSR (-1)."""
    cost = straight * w.near
    if cost >= limit:
        return cost
    heading = w.way - ahead  # of the object on the straight piece
    first = _least_turn(sense * (heading - a.theta), w.spread + a.turn)
    last = _least_turn(sense * (b.theta - heading), w.spread + b.turn)
    return cost + rate * _least_above(first + last, sense * (b.theta - a.theta), a.turn + b.turn)


@inner
def _other(car: Record, w: Between, a: End, b: End, sense: float, limit: float) -> float:
    """LSR (sense 1) or RSL (-1); where the straight direction leans back, both lengths."""
    dx, dy = sense * (car.right_x - car.left_x), sense * (car.right_y - car.left_y)
    along, across = dx * car.ahead_x + dy * car.ahead_y, dx * car.ahead_y - dy * car.ahead_x
    if w.far < abs(across):
        return math.inf
    least, most = math.sqrt(max(0.0, w.near**2 - across**2)), math.sqrt(w.far**2 - across**2)
    best = limit
    if most >= along:
        best = min(best, _bent(car, w, a, b, sense, max(0.0, least - along), most - along, best))
    if least <= -along:
        best = min(best, _bent(car, w, a, b, sense, max(0.0, -most - along), -least - along, best))
    return best


@inner
def _bent(
    car: Record, w: Between, a: End, b: End, sense: float, short: float, long: float, limit: float
) -> float:
    """LSR or RSL with a straight piece between two lengths."""
    cost = car.rate[STRAIGHT] * short
    if cost >= limit:
        return cost
    dx, dy = sense * (car.right_x - car.left_x), sense * (car.right_y - car.left_y)
    # In the object frame the centres lie apart by this arm, whose direction turns one way while the piece grows.
    px, py = dx + short * car.ahead_x, dy + short * car.ahead_y
    qx, qy = dx + long * car.ahead_x, dy + long * car.ahead_y
    half = 0.5 * math.atan2(px * qy - py * qx, px * qx + py * qy)
    heading = w.way - (math.atan2(py, px) + half)
    spread = w.spread + abs(half)
    first = _least_turn(sense * (heading - a.theta), spread + a.turn)
    last = _least_turn(sense * (heading - b.theta), spread + b.turn)
    rate_a, rate_b = (car.rate[LEFT], car.rate[RIGHT]) if sense > 0 else (car.rate[RIGHT], car.rate[LEFT])
    angle, turn = sense * (b.theta - a.theta), a.turn + b.turn
    more_first = _least_above(first - last, angle, turn) - (first - last)
    more_last = _least_above(last - first, -angle, turn) - (last - first)
    return cost + rate_a * first + rate_b * last + min(rate_a * more_first, rate_b * more_last)


@inner
def _three(car: Record, w: Between, a: End, b: End, sense: float, limit: float) -> float:
    """LRL (sense 1) or RLR (-1), with a middle arc of less and of more than half a turn."""
    span = 4.0 * car.radius
    if w.near > span:
        return math.inf
    low, high = 2.0 * math.asin(w.near / span), 2.0 * math.asin(min(1.0, w.far / span))
    best = min(limit, _looped(car, w, a, b, sense, TURN - high, TURN - low, limit))
    return min(best, _looped(car, w, a, b, sense, low, high, best))


@inner
def _looped(
    car: Record, w: Between, a: End, b: End, sense: float, low: float, high: float, limit: float
) -> float:
    """LRL or RLR with a middle arc between two angles."""
    outer, middle = (car.rate[LEFT], car.rate[RIGHT]) if sense > 0 else (car.rate[RIGHT], car.rate[LEFT])
    cost = middle * low
    if cost >= limit:
        return cost
    dx, dy = sense * (car.right_x - car.left_x), sense * (car.right_y - car.left_y)
    arc, half = 0.5 * (low + high), 0.5 * (high - low)
    # The arm is (1 - exp(-i sense arc)) times that between the centres.
    heading = w.way - (math.atan2(dy, dx) + sense * 0.5 * (math.pi - arc))
    spread = w.spread + 0.5 * half
    first = _least_turn(sense * (heading - a.theta), spread + a.turn)
    last = _least_turn(sense * (b.theta - heading) + arc, spread + b.turn)
    total = _least_above(first + last, sense * (b.theta - a.theta) + arc, a.turn + b.turn + half)
    return cost + outer * total
