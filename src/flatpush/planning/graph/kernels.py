"""The tree and its queries compiled: Dijkstra from the goal over dense arrays, edges steered on the fly.

tree.plain_tree is the plain twin. Only edges that can still improve something are steered: with push a an edge
from j to i can lower the cost V(j, a) only if it costs less than V(j, a) - W(i, a), so it is left out where a
lower bound of cars.py says that it does not. `general` is None for a fleet of Dubins cars with the flat cost, and
`timed` is None without a time law, where the first bound alone is fastest; numba compiles what the fleet at hand
needs.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ...geometry.pose import Array
from ...steering.kernels import _angle, _widest_vectors, dubins_between, three_twist_between, timed_between
from .cars import (
    AHEAD,
    FALL,
    LATE,
    LATE_L,
    LATE_R,
    LATE_S,
    OFFSET,
    RISE,
    SIDE,
    SIGMA,
    TILT,
    TILT_C,
    TILT_S,
    TURN_L,
    TURN_R,
    TURNING,
    UNIT,
    WAY,
)

TURN = 2 * math.pi
TILE = 512
COMPACT = 64  # relaxations of a push between two clearings of its list of open poses
NEAR = 1e-6  # [radii]
part = nb.njit(forceinline=True, error_model="numpy", fastmath={"contract"})
inner = nb.njit(error_model="numpy", fastmath={"contract"})
outer = nb.njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)


@outer
def grow(
    frames: Array, cars: Array, switching: Array, switch_only: bool, general: Any, timed: Any
) -> tuple[Array, Array, Array, Array]:
    """Dijkstra from the goal.

    Args:
        frames: axle_frames of the poses and, last, of the goal, shape (k, 5, n + 1); cars: car_table.
        switch_only: relax a pose only where the push changes; exact where the cost obeys the triangle inequality.

    Returns:
        costs V, W, next poses and pushes taken there, each (k, n), as in Tree.
    """
    k, n = frames.shape[0], frames.shape[2] - 1
    V, W = np.empty((k, n)), np.empty((k, n))
    follow, via = np.full((k, n), -1, np.int32), np.empty((k, n), np.int16)
    lane, ids, open_ = np.empty((k, 4, n)), np.empty((k, n), np.int32), np.full(k, n)
    hits, out, mask = np.empty(n, np.int32), np.empty(n), np.empty(n, np.bool_)
    for a in range(k):
        for j in range(n):
            lane[a, 0, j] = frames[a, 0, j] - cars[a, OFFSET] * frames[a, 3, j]
            lane[a, 1, j] = frames[a, 1, j] + cars[a, OFFSET] * frames[a, 2, j]
            lane[a, 2, j], lane[a, 3, j] = np.inf, frames[a, 4, j]
            ids[a, j] = hits[j] = j
        _steer(frames[a], cars[a], n, ids[a], lane[a, 2], hits, n, 0.0, V[a], general, timed)
        lane[a, 2] = V[a]
    for a in range(k):
        for j in range(n):
            W[a, j], via[a, j] = V[a, j], a
            for b in range(k):
                if V[b, j] + switching[a, b] < W[a, j]:
                    W[a, j], via[a, j] = V[b, j] + switching[a, b], b

    key = W.reshape(k * n)
    heap, place = np.arange(k * n).astype(np.int32), np.arange(k * n).astype(np.int32)
    for at in range(k * n // 2, -1, -1):
        _sift_down(heap, place, key, at, k * n)
    relaxed = np.zeros(k, np.int64)
    for size in range(k * n - 1, -1, -1):
        settled = heap[0]
        heap[0] = heap[size]
        place[heap[0]] = 0
        place[settled] = -1
        _sift_down(heap, place, key, 0, size)
        a, i = settled // n, settled % n
        if switch_only and via[a, i] == a:
            continue
        w = W[a, i]
        if relaxed[a] % COMPACT == COMPACT - 1:
            open_[a] = _clear(lane[a], ids[a], open_[a], w)
        relaxed[a] += 1
        px = frames[a, 0, i] - cars[a, OFFSET] * frames[a, 3, i]
        py = frames[a, 1, i] + cars[a, OFFSET] * frames[a, 2, i]
        count = _within(lane[a], open_[a], px, py, frames[a, 4, i], cars[a], w, mask, hits, timed)
        count = _steer(frames[a], cars[a], i, ids[a], lane[a, 2], hits, count, w, out, general, timed)
        for q in range(count):
            p, cost = hits[q], w + out[q]
            if cost < lane[a, 2, p] and ids[a, p] != i:
                j = ids[a, p]
                V[a, j], lane[a, 2, p], follow[a, j] = cost, cost, i
                for b in range(k):
                    copy = b * n + j
                    if cost + switching[b, a] < key[copy] and place[copy] >= 0:
                        key[copy], via[b, j] = cost + switching[b, a], a
                        _sift_up(heap, place, key, place[copy])
    return V, W, follow, via


@outer
def reach(start: Array, frames: Array, cars: Array, general: Any, timed: Any) -> Array:
    """Costs from a start to all poses, shape (k, n + 1), given frames of both."""
    _widest_vectors()
    k, n = frames.shape[0], frames.shape[2]
    out = np.empty((k, n))
    tile = np.empty((5, TILE))
    for a in range(k):
        xi, yi, ci, si, hi = start[a, 0, 0], start[a, 1, 0], start[a, 2, 0], start[a, 3, 0], start[a, 4, 0]
        unit, tc, ts = cars[a, UNIT], cars[a, TILT_C], cars[a, TILT_S]
        wl, ws, wr = cars[a, TURN_L], cars[a, AHEAD], cars[a, TURN_R]
        if timed is not None:
            left, straight = _law(wl, cars[a, LATE_L]), _law(ws, cars[a, LATE_S])
            right = _law(wr, cars[a, LATE_R])
        for begin in range(0, n, TILE):
            m = min(TILE, n - begin)
            for r in range(5):
                for q in range(m):
                    tile[r, q] = frames[a, r, begin + q]
            some = out[a, begin : begin + m]
            if general is None:
                for q in range(m):
                    some[q] = unit * dubins_between(
                        xi, yi, ci, si, hi, tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q]
                    )
            elif timed is None:
                for q in range(m):
                    some[q] = three_twist_between(
                        xi, yi, ci, si, hi, tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q],
                        tc, ts, wl, ws, wr,
                    )  # fmt: skip
            else:
                for q in range(m):
                    some[q] = timed_between(
                        xi, yi, ci, si, hi, tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q],
                        tc, ts, left, straight, right,
                    )  # fmt: skip
    return out


@outer
def cheapest(
    out: Array, V: Array, switching: Array, key: Array, keys: int, chained: bool
) -> tuple[Array, Array]:
    """For each distinct push sequence the cheapest candidate: its cost and its number ((i n + j) k + b), -1 where none.

    A candidate drives from the start to pose j with push i, takes push b there and follows the tree; key[i, b, j]
    numbers its push sequence. Where not `chained`, b = i is left out.
    """
    k, n = V.shape
    best, which = np.full(keys, np.inf), np.full(keys, -1)
    for i in range(k):
        for b in range(k):
            if b == i and not chained:
                continue
            more = switching[i, b]
            for j in range(n):
                cost = out[i, j] + (V[b, j] + more)
                number = key[i, b, j]
                if cost < best[number]:
                    best[number], which[number] = cost, (i * n + j) * k + b
    return best, which


@inner
def _within(
    lane: Array,
    n: int,
    px: float,
    py: float,
    h: float,
    car: Array,
    w: float,
    mask: Any,
    hits: Any,
    timed: Any,
) -> int:
    """Open poses near enough, in way and heading, to be improved over a pose of cost w; fills hits."""
    _widest_vectors()
    x, y, v, headings = lane[0], lane[1], lane[2], lane[3]
    way, turning, late = car[WAY] * car[WAY], car[TURNING], car[LATE]
    for p in range(n):
        dx, dy = x[p] - px, y[p] - py
        budget = v[p] - w
        if timed is not None:
            budget = _at_full_speed(budget, late)
        turned = abs(headings[p] - h)
        turned = turned if turned < math.pi else TURN - turned
        square = turned * turned
        # x - 2 sin(x/2), beyond the progress of turning by x; the first terms of its series are less.
        left = budget - turning * (turned * square) * (1 / 24 - square * (1 / 1920))
        mask[p] = (budget > turning * turned) & (left > 0.0) & (way * (dx * dx + dy * dy) < left * left)
    count = 0
    for p in range(n):
        hits[count] = p
        count += mask[p]
    return count


@inner
def _steer(
    frames: Array, car: Array, i: int, ids: Any, v: Array, hits: Any, count: int, w: float, out: Array,
    general: Any, timed: Any,
) -> int:  # fmt: skip
    """Fills out with the costs of the edges from the poses hits[:count] of a list to pose i.

    Where timed, hits that bounds exclude are dropped first; returns how many are left. Without a time law the bound
    costs more than the edges that it saves.
    """
    _widest_vectors()
    tile, low = np.empty((6, TILE)), np.empty(TILE)
    xi, yi, ci, si, hi = frames[0, i], frames[1, i], frames[2, i], frames[3, i], frames[4, i]
    tc, ts, wl, ws, wr = car[TILT_C], car[TILT_S], car[TURN_L], car[AHEAD], car[TURN_R]
    if timed is not None:
        left_law, straight_law, right_law = (
            _law(wl, car[LATE_L]),
            _law(ws, car[LATE_S]),
            _law(wr, car[LATE_R]),
        )
    kept = 0
    for begin in range(0, count, TILE):
        m = min(TILE, count - begin)
        for q in range(m):
            p = hits[begin + q]
            j = ids[p]
            for r in range(5):
                tile[r, q] = frames[r, j]
            tile[5, q] = v[p] - w
        if general is None:
            some = out[kept : kept + m]
            unit = car[UNIT]
            for q in range(m):
                some[q] = unit * dubins_between(
                    tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q], xi, yi, ci, si, hi
                )
            kept += m
        else:
            left = m
            if timed is not None:
                way, offset, turning, sigma = car[WAY], car[OFFSET], car[TURNING], car[SIGMA]
                tilt, fall, side, rise, late = car[TILT], car[FALL], car[SIDE], car[RISE], car[LATE]
                for q in range(m):
                    bound = _bound(
                        tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q], xi, yi, ci, si, hi,
                        way, offset, turning, sigma, tilt, fall, side, rise,
                    )  # fmt: skip
                    low[q] = _delayed(bound, late)
                left = 0
                for q in range(m):
                    if low[q] < tile[5, q]:
                        for r in range(6):
                            tile[r, left] = tile[r, q]
                        hits[kept + left] = hits[begin + q]
                        left += 1
            some = out[kept : kept + left]
            for q in range(left):
                some[q] = three_twist_between(
                    tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q], xi, yi, ci, si, hi,
                    tc, ts, wl, ws, wr,
                )  # fmt: skip
            if timed is not None:  # what takes too long even as one arc is not timed
                fewer = 0
                for q in range(left):
                    if _delayed(some[q], late) < tile[5, q]:
                        for r in range(5):
                            tile[r, fewer] = tile[r, q]
                        hits[kept + fewer] = hits[kept + q]
                        fewer += 1
                left = fewer
                for q in range(left):
                    some[q] = timed_between(
                        tile[0, q], tile[1, q], tile[2, q], tile[3, q], tile[4, q], xi, yi, ci, si, hi,
                        tc, ts, left_law, straight_law, right_law,
                    )  # fmt: skip
            kept += left
    return kept


@part
def _bound(
    xi: float, yi: float, ci: float, si: float, hi: float, xj: float, yj: float, cj: float, sj: float, hj: float,
    way: float, offset: float, turning: float, sigma: float, tilt: float, fall: float, side: float, rise: float,
) -> float:  # fmt: skip
    """What an edge costs at least at full speed (cars.py)."""
    x, y = (xj - offset * sj) - (xi - offset * si), (yj + offset * cj) - (yi + offset * ci)
    distance = math.sqrt(x * x + y * y)
    over = sigma / (distance + 1e-300)
    a_across, b_across = abs(x * si - y * ci), abs(x * sj - y * cj)
    alpha, beta = _angle(a_across, x * ci + y * si), _angle(b_across, x * cj + y * sj)
    fa, fb = alpha - over * a_across, beta - over * b_across
    ahead = (fa - fall if fa > fall else 0.0) + (fb - fall if fb > fall else 0.0)
    less = fa if fa < fb else fb
    back = (rise - fa if fa < rise else 0.0) + (rise - fb if fb < rise else 0.0)
    back = back + (2.0 * (less - side) if less > side else 0.0)
    beyond = ahead if ahead < back else back
    turned = abs(hj - hi)
    turned = turned if turned < math.pi else TURN - turned
    both = alpha + beta - 4.0 * tilt
    far = distance > NEAR  # else the direction is rounding, and words end within a tolerance anyway
    both = both if far & (both > turned) else turned
    least = way * distance + (turning * beyond if far else 0.0)
    return least if least > turning * both else turning * both


@part
def _law(slope: float, late: float) -> tuple[float, float, float, float]:
    """A time law as timed_between takes it."""
    return slope, late, 4.0 * slope * late, late / (slope + 1e-300)


@part
def _delayed(cost: float, late: float) -> float:
    """How long an arc takes that takes `cost` at full speed."""
    short = cost * late
    return cost + late if cost >= late else 2.0 * math.sqrt(short if short > 0.0 else 0.0)


@part
def _at_full_speed(time: float, late: float) -> float:
    """The inverse of _delayed."""
    return time - late if time >= 2.0 * late else 0.25 * time * abs(time) / (late + 1e-300)


@inner
def _clear(lane: Array, ids: Any, n: int, w: float) -> int:
    """Drops the poses that nothing can improve any more from a list, in place; returns its new length."""
    left = 0
    for p in range(n):
        if lane[2, p] > w:
            for r in range(4):
                lane[r, left] = lane[r, p]
            ids[left] = ids[p]
            left += 1
    return left


@inner
def _sift_up(heap: Any, place: Any, key: Array, at: int) -> None:
    item = heap[at]
    while at > 0 and key[item] < key[heap[(at - 1) // 2]]:
        heap[at] = heap[(at - 1) // 2]
        place[heap[at]] = at
        at = (at - 1) // 2
    heap[at] = item
    place[item] = at


@inner
def _sift_down(heap: Any, place: Any, key: Array, at: int, size: int) -> None:
    if size == 0:
        return
    item = heap[at]
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and key[heap[child + 1]] < key[heap[child]]:
            child += 1
        if key[heap[child]] >= key[item]:
            break
        heap[at] = heap[child]
        place[heap[at]] = at
        at = child
    heap[at] = item
    place[item] = at


@outer
def delayed_bound(
    xi: float, yi: float, ci: float, si: float, hi: float, xj: float, yj: float, cj: float, sj: float, hj: float,
    way: float, offset: float, turning: float, sigma: float, tilt: float, fall: float, side: float,
    rise: float, late: float,
) -> float:  # fmt: skip
    """_bound with the time law, for one pair."""
    bound = _bound(
        xi, yi, ci, si, hi, xj, yj, cj, sj, hj, way, offset, turning, sigma, tilt, fall, side, rise
    )
    return _delayed(bound, late)
