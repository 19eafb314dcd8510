"""Compiled twins of dubins.py ([Dubins1957], [Shkel2001]) and three_twist.py ([Furtuna2010]), for many pairs of poses.

The lengths are computed without a branch, so that LLVM does several pairs at once: which word is feasible, and
whether an arc needs a full turn more, are decided by signs of cross products and become selects. Half of the words
are mirror images of the others. Poses come as cosine and sine, and few angles need an inverse function:
the arcs of LSL add up to the heading difference, those of LRL to that less the apex angle.
"""

import math
from typing import Any, NamedTuple

from .vectors.kernels import SLACK, TURN, _large, _ratio, _select, _small, _turned, block

TOLERANCE = 4e-10  # as in dubins.py; of a length, per length of the query
LOOSE = 2e-10  # as in three_twist.py, where a length is that of the centres as well
SQUARE_TOLERANCE = 4 * TOLERANCE  # where what is compared is four times a length, or a square of about four
NEVER = 1e300
TINY = 1e-30


class Pieces(NamedTuple):
    """First arc, straight piece and last arc of a word, and 0, or NEVER where it leads nowhere."""

    first: float
    way: float
    last: float
    unfit: float


class Frame(NamedTuple):
    """A pose: place [turning radii], cosine and sine of its heading, and the heading in [0, 2π) [rad]."""

    x: float
    y: float
    c: float
    s: float
    heading: float


class Weighted(NamedTuple):
    """A car of linear costs.

    Attributes:
        radius: half the distance R of the turning centres [m].
        tilt_c, tilt_s: the straight direction seen from the axle's heading, tilt_c > 0.
        left, straight, right: cost of a radian to the left, of a length R straight on and of a radian to the right.
    """

    radius: float
    tilt_c: float
    tilt_s: float
    left: float
    straight: float
    right: float


class Law(NamedTuple):
    """The time of a piece from rest to rest: slope · amount + ramp above the knee, √(root · amount) below."""

    slope: float
    ramp: float
    root: float
    knee: float


class Timed(NamedTuple):
    """A car whose pieces take time, as Weighted; the laws are per radian or length R."""

    radius: float
    tilt_c: float
    tilt_s: float
    left: Law
    straight: Law
    right: Law


@block
def dubins_between(i: Frame, j: Frame) -> float:
    """Length of the shortest Dubins path from pose i to pose j [radii].

    Without a branch: a loop over i or j does several at once if its function calls _widest_vectors().
    """
    x, y, c, s, delta = _seen_from(i, j)
    back = TURN - delta
    k = 1.0 - c
    # The goal's offset along and across its own heading; straight pieces of LSR and RSL, LSL and RSR.
    p, q = x * s - y * c, x * c + y * s
    m, g = (x * x + y * y) - 2.0 * k, 2.0 * (y - p)
    lsr2, rsl2 = _large(m - g, 0.0), _large(m + g, 0.0)
    lsr, rsl = math.sqrt(lsr2), math.sqrt(rsl2)
    xm, xp, ym, yp = x - s, x + s, y - k, y + k
    lsl2, rsr2 = xm * xm + ym * ym, xp * xp + yp * yp
    lsl, rsr = math.sqrt(lsl2), math.sqrt(rsr2)
    # Four times the cosine of half the apex angle of LRL and RLR; the sine is a quarter of lsl and rsr.
    lrl2, rlr2 = 16.0 - lsl2, 16.0 - rsr2
    lrl, rlr = math.sqrt(_large(lrl2, 0.0)), math.sqrt(_large(rlr2, 0.0))

    # LSR, RSL: the first arcs are the angles of (ax, ay), (bx, by). Their tangents of the half share a division.
    u, v = y - (1.0 + c), y + (1.0 + c)
    ax, ay = xp * lsr - (u + u), u * lsr + (xp + xp)
    bx, by = xm * rsl + (v + v), (xm + xm) - v * rsl
    a_big = _large(abs(ax), abs(ay)) + (4.0 + lsr2)
    b_big = _large(abs(bx), abs(by)) + (4.0 + rsl2)
    inverse = 1.0 / (a_big * b_big)
    a_tangent = _small(abs(ax), abs(ay)) * (b_big * inverse)
    b_tangent = _small(abs(bx), abs(by)) * (a_big * inverse)

    # LSL, RSR: is the straight piece's heading between those of start and goal?
    tolerance = TOLERANCE + (0.5 * TOLERANCE) * (lsl + rsr)
    low, high, f = _small(y, p), _large(y, p), x + q
    fm, fp = f - (s + s), f + (s + s)
    least = k - tolerance
    left = _select(delta < math.pi, _small(low, fm + k), high)
    right = _select(delta > math.pi, _small(-high, fp + k), -low)
    length = lsl + delta
    best = _select(left < least, length + TURN, length)
    length = rsr + back
    best = _small(best, _select(right < least, length + TURN, length))

    # LRL, RLR: is that of the end of the first arc?
    pm, pp, qm, qp = p - k, p + k, q - s, q + s
    em, ep = (y + p) - (k + k), (y + p) + (k + k)
    turn = delta - math.pi
    ratio = _ratio(0.25 * lsl - 0.5)
    outer = lrl * ratio + turn
    outer = _select(outer < 0.0, outer + TURN, outer)
    after, before, ahead = ym * lrl - xm * lsl, pm * lrl - qm * lsl, fm * lrl + em * lsl
    miss = _select(outer < math.pi, _large(_large(after, before), ahead), _small(after, before))
    length = outer + (lrl * ratio + math.pi)
    length = _select(miss > SQUARE_TOLERANCE, length + TURN, length)
    best = _select(lrl2 >= -SQUARE_TOLERANCE, _small(best, length), best)
    ratio = _ratio(0.25 * rsr - 0.5)
    outer = rlr * ratio - turn
    outer = _select(outer < 0.0, outer + TURN, outer)
    after, before, ahead = yp * rlr + xp * rsr, pp * rlr + qp * rsr, ep * rsr - fp * rlr
    hit = _select(outer < math.pi, _small(_small(after, before), ahead), _large(after, before))
    length = outer + (rlr * ratio + math.pi)
    length = _select(hit < -SQUARE_TOLERANCE, length + TURN, length)
    best = _select(rlr2 >= -SQUARE_TOLERANCE, _small(best, length), best)

    # The rest of LSR and RSL comes last: with this order the division is done by then.
    first = _turned(a_tangent, ax, ay)
    length = lsr + first + _remaining(first, delta)
    best = _select(m - g >= -SQUARE_TOLERANCE, _small(best, length), best)
    first = _turned(b_tangent, bx, by)
    length = rsl + first + _remaining(first, back)
    return _select(m + g >= -SQUARE_TOLERANCE, _small(best, length), best)


@block
def three_twist_between(i: Frame, j: Frame, car: Weighted) -> float:
    """Cost of the cheapest word of a car with any centres, as three_twist.shortest_word finds it.

    A pose is that of the axle: the midpoint of the turning centres in units of half their distance, and the heading
    across their line (with the left centre to the left).
    """
    tilt_c, tilt_s, wl, ws, wr = car.tilt_c, car.tilt_s, car.left, car.straight, car.right
    x, y, c, s, delta = _seen_from(i, j)
    back = TURN - delta
    for_left = _alike(x, y, c, s, delta, tilt_c, tilt_s)
    for_right = _alike(x, -y, c, -s, back, tilt_c, -tilt_s)
    straight, same, z, long, short = for_left[:5]
    best = ws * straight + wl * same
    cost = _small(wr * (TURN - z) + wl * long, wr * z + wl * short)
    best = _select(straight <= 4.0 + SQUARE_TOLERANCE, _small(best, cost), best)
    straight, same, z, long, short = for_right[:5]
    best = _small(best, ws * straight + wr * same)
    cost = _small(wl * (TURN - z) + wr * long, wl * z + wr * short)
    best = _select(straight <= 4.0 + SQUARE_TOLERANCE, _small(best, cost), best)
    lsr, rsl, other = _unlike(x, y, c, s, delta, tilt_c, tilt_s)
    best = _small(best, ws * lsr.way + (wl * lsr.first + wr * lsr.last) + lsr.unfit)
    best = _small(best, ws * rsl.way + (wr * rsl.first + wl * rsl.last) + rsl.unfit)
    wa, wb = _select(tilt_s > 0.0, wl, wr), _select(tilt_s > 0.0, wr, wl)
    return _small(best, ws * other.way + (wa * other.first + wb * other.last) + other.unfit)


@block
def timed_between(i: Frame, j: Frame, car: Timed) -> float:
    """As three_twist_between where each piece starts and ends at rest, so that its time is no multiple of its length.

    See lengths.timed_car.
    """
    tilt_c, tilt_s, left, straight, right = car.tilt_c, car.tilt_s, car.left, car.straight, car.right
    x, y, c, s, delta = _seen_from(i, j)
    best = _timed_alike(_alike(x, y, c, s, delta, tilt_c, tilt_s), delta, left, straight, right)
    back = TURN - delta
    cost = _timed_alike(_alike(x, -y, c, -s, back, tilt_c, -tilt_s), back, right, straight, left)
    best = _small(best, cost)
    lsr, rsl, other = _unlike(x, y, c, s, delta, tilt_c, tilt_s)
    tilts_left = tilt_s > 0.0
    first = _select(tilts_left, _time(left, other.first), _time(right, other.first))
    last = _select(tilts_left, _time(right, other.last), _time(left, other.last))
    best = _small(best, first + _time(straight, other.way) + last + other.unfit)
    cost = _time(left, lsr.first) + _time(straight, lsr.way) + _time(right, lsr.last) + lsr.unfit
    best = _small(best, cost)
    return _small(
        best, _time(right, rsl.first) + _time(straight, rsl.way) + _time(left, rsl.last) + rsl.unfit
    )


@block
def _time(law: Law, amount: float) -> float:
    return _select(amount > law.knee, law.slope * amount + law.ramp, math.sqrt(law.root * amount))


@block
def _timed_alike(found: Any, delta: float, outer: Law, straight: Law, middle: Law) -> float:
    way, same, z, long, short, vx, vy, tx, ty, nx, ny, tolerance, d_long, d_short = found
    first = _first(vx, vy, way, same, delta, tolerance)
    best = _time(outer, first) + _time(straight, way) + _time(outer, same - first)
    first = _first(tx, ty, way, long, d_long, tolerance)
    cost = _time(outer, first) + _time(middle, TURN - z) + _time(outer, long - first)
    first = _first(nx, ny, way, short, d_short, tolerance)
    cost = _small(cost, _time(outer, first) + _time(middle, z) + _time(outer, short - first))
    return _select(way <= 4.0 + SQUARE_TOLERANCE, _small(best, cost), best)


@block
def _first(vx: float, vy: float, size: float, total: float, angle: float, tolerance: float) -> float:
    """The first of two arcs to the same side that add up to total: angle, or a turn more."""
    large, small = _large(abs(vx), abs(vy)), _small(abs(vx), abs(vy))
    first = _turned(small / (large + _large(size, TINY)), vx, vy)
    nearest = _select(first - angle < TURN - first, angle, 0.0)
    first = _select((total <= angle) & (first > angle), nearest, first)
    return _select(size <= tolerance, 0.0, first)


@block
def _alike(
    x: float, y: float, c: float, s: float, delta: float, tilt_c: float, tilt_s: float
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float, float, float]:
    """LSL and both LRL.

    Returns the distance of the centres and both arcs of LSL together; the smaller middle arc and the outer arcs
    together of the LRL with the larger one and with the smaller one; then, for _first, the directions (x, y) in which
    the middle pieces begin, a tolerance of lengths, and those two sums less a turn too many.
    """
    k = 1.0 - c
    dx, dy = x - s, y - k
    fx, fy = (x * c + y * s) - s, (x * s - y * c) - k
    square = dx * dx + dy * dy
    d = math.sqrt(square)
    tolerance = LOOSE + LOOSE * d
    vx, vy = dx * tilt_c + dy * tilt_s, dy * tilt_c - dx * tilt_s
    same = _both(vx, vy, fx * tilt_c - fy * tilt_s, fy * tilt_c + fx * tilt_s, delta, tolerance)

    rest = math.sqrt(_large(16.0 - square, 0.0))
    z = math.pi - rest * _ratio(0.25 * d - 0.5)
    ax, ay, bx, by = dx * rest, dy * rest, dx * d, dy * d
    ex, ey, gx, gy = fx * rest, fy * rest, fx * d, fy * d
    wide = delta - z
    wide = _select(wide < 0.0, wide + TURN, wide)
    long = _both(-(ax + by), bx - ay, -(ex + gy), gx - ey, wide, 4.0 * LOOSE)
    narrow = delta + z
    narrow = _select(narrow >= TURN, narrow - TURN, narrow)
    short = _both(ax - by, ay + bx, ex - gy, gx + ey, narrow, 4.0 * LOOSE)
    return (
        d, same, z, long, short,
        vx, vy, -0.25 * (ax + by), 0.25 * (bx - ay), 0.25 * (ax - by), 0.25 * (ay + bx), tolerance, wide, narrow,
    )  # fmt: skip


@block
def _both(vx: float, vy: float, wx: float, wy: float, angle: float, tolerance: float) -> float:
    """Two arcs to the same side: angle, in [0, 2π), or a turn more if the direction between is not.

    The direction is (vx, vy) seen from the start; its mirror image at the goal's heading is (wx, wy).
    """
    within = _select(angle < math.pi, _small(_small(vy, wy), vx + wx), _large(vy, wy))
    return _select(within < -tolerance, angle + TURN, angle)


@block
def _unlike(
    x: float, y: float, c: float, s: float, delta: float, tilt_c: float, tilt_s: float
) -> tuple[Pieces, Pieces, Pieces]:
    """LSR, RSL and the second solution of the one that leans back."""
    k, back = 1.0 + c, TURN - delta
    lx, ly, rx, ry = x + s, y - k, x - s, -(y + k)
    width, lean = 2.0 * tilt_c, 2.0 * tilt_s
    l2, r2 = lx * lx + ly * ly, rx * rx + ry * ry
    l_rest, r_rest = l2 - width * width, r2 - width * width
    l_way, r_way = math.sqrt(_large(l_rest, 0.0)), math.sqrt(_large(r_rest, 0.0))
    lx, ly = lx * tilt_c + ly * tilt_s, ly * tilt_c - lx * tilt_s
    rx, ry = rx * tilt_c - ry * tilt_s, ry * tilt_c + rx * tilt_s
    left = tilt_s > 0.0
    ox, oy, o_way = _select(left, lx, rx), _select(left, ly, ry), _select(left, l_way, r_way)
    o2, o_rest, o_delta = _select(left, l2, r2), _select(left, l_rest, r_rest), _select(left, delta, back)

    ax, ay = lx * l_way - width * ly, ly * l_way + width * lx
    bx, by = rx * r_way - width * ry, ry * r_way + width * rx
    ox, oy = -(ox * o_way + width * oy), width * ox - oy * o_way
    a_big = _large(abs(ax), abs(ay)) + _large(l2, TINY)
    b_big = _large(abs(bx), abs(by)) + _large(r2, TINY)
    o_big = _large(abs(ox), abs(oy)) + _large(o2, TINY)
    inverse = 1.0 / (a_big * b_big * o_big)
    a = _turned(_small(abs(ax), abs(ay)) * (b_big * o_big * inverse), ax, ay)
    b = _turned(_small(abs(bx), abs(by)) * (a_big * o_big * inverse), bx, by)
    o = _turned(_small(abs(ox), abs(oy)) * (a_big * b_big * inverse), ox, oy)
    l_way, r_way, o_way = l_way + lean, r_way - lean, abs(lean) - o_way
    l_fit = _select(_small(l_rest, l_way) >= -SQUARE_TOLERANCE, 0.0, NEVER)
    r_fit = _select(_small(r_rest, r_way) >= -SQUARE_TOLERANCE, 0.0, NEVER)
    o_fit = _select(_small(o_rest, o_way) >= -SQUARE_TOLERANCE, 0.0, NEVER)
    return (
        Pieces(a, _large(l_way, 0.0), _remaining(a, delta), l_fit),
        Pieces(b, _large(r_way, 0.0), _remaining(b, back), r_fit),
        Pieces(o, _large(o_way, 0.0), _remaining(o, o_delta), o_fit),
    )


@block
def _seen_from(i: Frame, j: Frame) -> tuple[float, float, float, float, float]:
    """Pose j in the frame of pose i: x, y, cosine, sine, heading in [0, 2π]."""
    gx, gy, delta = j.x - i.x, j.y - i.y, j.heading - i.heading
    delta = _select(delta < 0.0, delta + TURN, delta)
    return i.c * gx + i.s * gy, i.c * gy - i.s * gx, i.c * j.c + i.s * j.s, i.c * j.s - i.s * j.c, delta


@block
def _remaining(first: float, delta: float) -> float:
    """The last arc of a word that turns back."""
    last = first - delta
    return _large(_select(last < -SLACK, last + TURN, last), 0.0)
