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

What is found about a word on the way, between which headings its arcs end and how long its straight piece is, is kept:
joint.py makes a better bound of it where legs meet.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import inner
from ...formulas import Record
from ...steering.six_words import Records

TURN = 2 * math.pi
# Slack for rounding, and for the arcs just short of a full turn that six_words.py takes as zero: of lengths by the
# query's, of angles [rad].
ROUNDING, ANGLE = 1e-9, 1e-9
LEFT, STRAIGHT, RIGHT = 0, 1, 2  # places of the rates
WIDE = (
    0.5 * math.pi
)  # arcs known no better than this, half an interval [rad], are not kept: nothing comes of them
MOST_KEPT = 12  # words of a leg: LSL, RSR, and two kinds of each other

# A word between two boxes, with its arcs in the lowest turns that these allow: what it costs at least; letters of its
# pieces; heading where the first arc ends and where the last begins (one for a straight piece), unwound from that of
# the first box, and half their intervals, infinite where nothing is known about them; by how much the last heading of
# the second box is more, unwound; least and greatest length or angle of the middle piece; whether the first and the
# last arc may be zero; and what it costs more when it ends a metre further, at its middle.
KEPT = np.dtype(
    [
        ("least", float), ("letter", np.int64, 3), ("heading", float, 2), ("spread", float), ("wound", float),
        ("short", float), ("long", float), ("opens", np.bool_), ("closes", np.bool_), ("costate", float, 2),
    ]
)  # fmt: skip


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


class Known(NamedTuple):
    """What is known about a leg: words that were kept, the least bound of those that were not, and of all."""

    kept: int
    other: float
    least: float


class Arc(NamedTuple):
    """Angle of an arc within the lowest turn that the boxes allow [rad]: middle and half of its interval."""

    middle: float
    half: float
    least: float
    may_vanish: bool


@inner
def leg_bound(car: Record, a: End, b: End, limit: float, kept: Records) -> Known:
    """What a leg of a car from a box to a box costs at least, if less than the limit; its words are filled in."""
    scale = math.hypot(b.x - a.x, b.y - a.y) + 2.0 * car.radius
    left_a, right_a = _disc(a, car.left_x, car.left_y), _disc(a, car.right_x, car.right_y)
    left_b, right_b = _disc(b, car.left_x, car.left_y), _disc(b, car.right_x, car.right_y)
    left, right = _between(left_a, left_b, scale), _between(right_a, right_b, scale)
    known = Known(0, limit, limit)
    known = _same(car, left, a, b, 1.0, limit, kept, known)
    known = _same(car, right, a, b, -1.0, limit, kept, known)
    known = _other(car, _between(left_a, right_b, scale), a, b, 1.0, limit, kept, known)
    known = _other(car, _between(right_a, left_b, scale), a, b, -1.0, limit, kept, known)
    known = _three(car, left, a, b, 1.0, limit, kept, known)
    return _three(car, right, a, b, -1.0, limit, kept, known)


@inner
def _with(known: Known, least: float) -> Known:
    """With a word that is not kept."""
    return Known(known.kept, min(known.other, least), min(known.least, least))


@inner
def _keep(known: Known, word: Record, least: float) -> Known:
    word.least = least
    return Known(known.kept + 1, known.other, min(known.least, least))


@inner
def _arc(angle: float, half: float) -> Arc:
    """The arcs within half of an angle, modulo a turn: those of the lowest turn, from zero on."""
    middle = angle % TURN
    if middle + half >= TURN:
        middle -= TURN
    return Arc(middle, half, max(0.0, middle - half), middle < half)


@inner
def _letters(word: Record, sense: float, straight: bool, ends_left: bool) -> None:
    word.letter[0] = LEFT if sense > 0 else RIGHT
    word.letter[1] = STRAIGHT if straight else (RIGHT if sense > 0 else LEFT)
    word.letter[2] = LEFT if ends_left else RIGHT


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
def _least_above(low: float, angle: float, half: float) -> float:
    """The least value from low on that is within half of an angle, modulo a turn."""
    turns = math.ceil((low - angle - half) / TURN)
    return max(low, angle - half + TURN * turns)


@inner
def _same(
    car: Record, w: Between, a: End, b: End, sense: float, limit: float, kept: Records, known: Known
) -> Known:
    """LSL (sense 1) or RSR (-1)."""
    rate, straight = car.rate[LEFT if sense > 0 else RIGHT], car.rate[STRAIGHT]
    cost = straight * w.near
    if cost >= limit:
        return known
    heading = w.way - math.atan2(car.ahead_y, car.ahead_x)  # of the object on the straight piece
    first = _arc(sense * (heading - a.theta), w.spread + a.turn).least
    last = _arc(sense * (b.theta - heading), w.spread + b.turn).least
    angle, half = sense * (b.theta - a.theta), a.turn + b.turn
    turns = math.ceil((first + last - angle - half) / TURN)
    least = cost + rate * max(first + last, angle - half + TURN * turns)
    if least >= limit:
        return known
    if half >= WIDE:
        return _with(known, least)
    known = _with(known, cost + rate * (angle - half + TURN * (turns + 1)))
    word = kept[known.kept]
    _letters(word, sense, True, sense > 0)
    word.heading[0] = word.heading[1] = heading
    word.spread, word.wound = w.spread, sense * TURN * turns
    word.short, word.long = w.near, w.far
    word.opens = word.closes = False  # the sum of the arcs alone counts
    word.costate[0], word.costate[1] = straight * math.cos(w.way), straight * math.sin(w.way)
    return _keep(known, word, least)


@inner
def _other(
    car: Record, w: Between, a: End, b: End, sense: float, limit: float, kept: Records, known: Known
) -> Known:
    """LSR (sense 1) or RSL (-1); where the straight direction leans back, both lengths."""
    dx, dy = sense * (car.right_x - car.left_x), sense * (car.right_y - car.left_y)
    along, across = dx * car.ahead_x + dy * car.ahead_y, dx * car.ahead_y - dy * car.ahead_x
    if w.far < abs(across):
        return known
    least, most = math.sqrt(max(0.0, w.near**2 - across**2)), math.sqrt(w.far**2 - across**2)
    if most >= along:
        known = _bent(car, w, a, b, sense, max(0.0, least - along), most - along, limit, kept, known)
    if least <= -along:
        known = _bent(car, w, a, b, sense, max(0.0, -most - along), -least - along, limit, kept, known)
    return known


@inner
def _bent(
    car: Record, w: Between, a: End, b: End, sense: float, short: float, long: float, limit: float,
    kept: Records, known: Known,
) -> Known:  # fmt: skip
    """LSR or RSL with a straight piece between two lengths."""
    straight = car.rate[STRAIGHT]
    cost = straight * short
    if cost >= limit:
        return known
    dx, dy = sense * (car.right_x - car.left_x), sense * (car.right_y - car.left_y)
    # In the object frame the centres lie apart by this arm, whose direction turns one way while the piece grows.
    px, py = dx + short * car.ahead_x, dy + short * car.ahead_y
    qx, qy = dx + long * car.ahead_x, dy + long * car.ahead_y
    half = 0.5 * math.atan2(px * qy - py * qx, px * qx + py * qy)
    heading = w.way - (math.atan2(py, px) + half)
    spread = w.spread + abs(half)
    first = _arc(sense * (heading - a.theta), spread + a.turn)
    last = _arc(sense * (heading - b.theta), spread + b.turn)
    rate_a, rate_b = (car.rate[LEFT], car.rate[RIGHT]) if sense > 0 else (car.rate[RIGHT], car.rate[LEFT])
    angle, turn = sense * (b.theta - a.theta), a.turn + b.turn
    more_first = _least_above(first.least - last.least, angle, turn) - (first.least - last.least)
    more_last = _least_above(last.least - first.least, -angle, turn) - (last.least - first.least)
    arcs = rate_a * first.least + rate_b * last.least
    least = cost + arcs + min(rate_a * more_first, rate_b * more_last)
    if least >= limit:
        return known
    if first.half >= WIDE or last.half >= WIDE:
        return _with(known, least)
    if first.may_vanish:
        known = _with(known, cost + arcs + rate_a * (first.middle - first.half + TURN))
    if last.may_vanish:
        known = _with(known, cost + arcs + rate_b * (last.middle - last.half + TURN))
    word = kept[known.kept]
    _letters(word, sense, True, sense < 0)
    _wind(word, a, b, sense * first.middle, 0.0, -sense * last.middle)
    word.spread, word.short, word.long = spread, short, long
    word.opens, word.closes = first.may_vanish, last.may_vanish
    along, across = dx * car.ahead_x + dy * car.ahead_y, dx * car.ahead_y - dy * car.ahead_x
    lean = sense * (rate_a + rate_b) - straight * across  # 0 of Dubins cars
    lean /= max(0.5 * (short + long) + along, car.radius)
    c, s = math.cos(heading), math.sin(heading)
    gx, gy = straight * car.ahead_x - lean * car.ahead_y, straight * car.ahead_y + lean * car.ahead_x
    word.costate[0], word.costate[1] = c * gx - s * gy, s * gx + c * gy
    return _keep(known, word, least)


@inner
def _three(
    car: Record, w: Between, a: End, b: End, sense: float, limit: float, kept: Records, known: Known
) -> Known:
    """LRL (sense 1) or RLR (-1), with a middle arc of less and of more than half a turn."""
    span = 4.0 * car.radius
    if w.near > span:
        return known
    low, high = 2.0 * math.asin(w.near / span), 2.0 * math.asin(min(1.0, w.far / span))
    known = _looped(car, w, a, b, sense, TURN - high, TURN - low, limit, kept, known)
    return _looped(car, w, a, b, sense, low, high, limit, kept, known)


@inner
def _looped(
    car: Record, w: Between, a: End, b: End, sense: float, low: float, high: float, limit: float,
    kept: Records, known: Known,
) -> Known:  # fmt: skip
    """LRL or RLR with a middle arc between two angles."""
    outer, middle = (car.rate[LEFT], car.rate[RIGHT]) if sense > 0 else (car.rate[RIGHT], car.rate[LEFT])
    cost = middle * low
    if cost >= limit:
        return known
    dx, dy = sense * (car.right_x - car.left_x), sense * (car.right_y - car.left_y)
    arc, half = 0.5 * (low + high), 0.5 * (high - low)
    # The arm is (1 - exp(-i sense arc)) times that between the centres.
    heading = w.way - (math.atan2(dy, dx) + sense * 0.5 * (math.pi - arc))
    spread = w.spread + 0.5 * half
    first = _arc(sense * (heading - a.theta), spread + a.turn)
    last = _arc(sense * (b.theta - heading) + arc, spread + b.turn)
    arcs = first.least + last.least
    total = _least_above(arcs, sense * (b.theta - a.theta) + arc, a.turn + b.turn + half)
    least = cost + outer * total
    if least >= limit:
        return known
    word = kept[known.kept]
    _letters(word, sense, False, sense > 0)
    word.short, word.long = low, high
    if first.half >= WIDE or last.half >= WIDE:  # the outer arcs less the middle one are known all the same
        angle, turn = sense * (b.theta - a.theta), a.turn + b.turn
        if turn >= WIDE:
            return _with(known, least)
        turns = math.ceil((arcs - high - angle - turn) / TURN)
        known = _with(known, cost + outer * (angle - turn + TURN * (turns + 1) + low))
        word.spread, word.wound = math.inf, sense * TURN * turns
        word.costate[0] = word.costate[1] = 0.0
        return _keep(known, word, least)
    if first.may_vanish:
        known = _with(known, cost + outer * (arcs + first.middle - first.half + TURN))
    if last.may_vanish:
        known = _with(known, cost + outer * (arcs + last.middle - last.half + TURN))
    _wind(word, a, b, sense * first.middle, -sense * arc, sense * last.middle)
    word.spread = spread
    word.opens, word.closes = first.may_vanish, last.may_vanish
    pull = (
        0.5 * (outer + middle) / car.radius / math.copysign(max(0.2, abs(math.cos(0.5 * arc))), math.pi - arc)
    )
    word.costate[0], word.costate[1] = pull * math.cos(w.way), pull * math.sin(w.way)
    return _keep(known, word, least)


@inner
def _wind(word: Record, a: End, b: End, first: float, middle: float, last: float) -> None:
    """The headings between arcs of so much, left positive, from that of the first box on."""
    word.heading[0] = a.theta + first
    word.heading[1] = word.heading[0] + middle
    word.wound = TURN * round((word.heading[1] + last - b.theta) / TURN)
