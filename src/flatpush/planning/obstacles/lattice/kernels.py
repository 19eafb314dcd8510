"""The compiled search on a lattice; the package's docstring explains it."""

import math
from typing import Any

import numba as nb
import numpy as np

from ....geometry.collision.kernels import pose_gap
from ....geometry.pose import Array
from ..kernels import COLUMNS, LAST, NEED, WORDS, changes, connect, drive, free, piece_gap

TURN = 2 * math.pi
inner = nb.njit(error_model="numpy")
outer = nb.njit(cache=True, nogil=True, error_model="numpy")

X, Y, THETA, COST, LETTER, AMOUNT = range(6)
MANY = 1 << 20  # most cells along a side


@outer
def distances(
    W: Any, disc: Array, box: Array, cell: float, nx: int, ny: int, goal: Array, need: float
) -> Array:
    """Ways of the middle of a disc to a goal among the obstacles over a grid's cells, at least, shape (nx · ny,) [m].

    Eight neighbours; what a way through cells can be longer than a straight one is taken off. Cells count as free
    unless the disc, less half a cell's diagonal, overlaps something at their middle.
    """
    n = nx * ny
    out = np.full(n, np.inf)
    open_ = np.zeros(n, np.bool_)
    P = np.array([[0.0, 0.0, max(disc[0] - 0.75 * cell, 0.0), 0.0]])
    ball = (0, 0.0, 0.0, P[0, 2])
    pose = np.zeros(3)
    for j in range(ny):
        for i in range(nx):
            pose[0], pose[1] = box[0] + (i + 0.5) * cell, box[1] + (j + 0.5) * cell
            open_[j * nx + i] = pose_gap(W, P, ball, pose, need, need) >= need
    gi = min(max(int((goal[0] - box[0]) / cell), 0), nx - 1)
    gj = min(max(int((goal[1] - box[1]) / cell), 0), ny - 1)
    heap_key, heap_at = np.empty(8 * n + 1), np.empty(8 * n + 1, np.int64)
    size = 1
    heap_key[0], heap_at[0] = 0.0, gj * nx + gi
    out[gj * nx + gi] = 0.0
    while size > 0:
        key, at = heap_key[0], heap_at[0]
        size -= 1
        _down(heap_key, heap_at, size)
        if key > out[at]:
            continue
        i, j = at % nx, at // nx
        for dj in range(-1, 2):
            for di in range(-1, 2):
                u, v = i + di, j + dj
                if (di == 0 and dj == 0) or u < 0 or v < 0 or u >= nx or v >= ny:
                    continue
                to = v * nx + u
                if not open_[to]:
                    continue
                new = key + cell * math.sqrt(di * di + dj * dj)
                if new < out[to] - 1e-12:
                    out[to] = new
                    heap_key[size], heap_at[size] = new, to
                    size += 1
                    _up(heap_key, heap_at, size - 1)
    return out * 0.9239  # the most by which eight directions are longer


@inner
def _up(key: Array, at: Any, i: int) -> None:
    k, a = key[i], at[i]
    while i > 0 and key[(i - 1) // 2] > k:
        key[i], at[i] = key[(i - 1) // 2], at[(i - 1) // 2]
        i = (i - 1) // 2
    key[i], at[i] = k, a


@inner
def _down(key: Array, at: Any, size: int) -> None:
    """Moves the last item, at `size`, to the top and down."""
    k, a = key[size], at[size]
    i = 0
    while 2 * i + 1 < size:
        child = 2 * i + 1
        if child + 1 < size and key[child + 1] < key[child]:
            child += 1
        if key[child] >= k:
            break
        key[i], at[i] = key[child], at[child]
        i = child
    key[i], at[i] = k, a


@outer
def expand(
    T: Any, origin: Array, grid: Any, nodes: Array, links: Any, table: Any, key: Array, heap: Any, counts: Any,
    far: Array, around: Any, weights: Array, goal: Array, best: Array, shot: Array, budget: int,
) -> int:  # fmt: skip
    """Expands up to a number of nodes; returns why it stopped: 0 budget, 1 nothing left, 2 no room left.

    Args:
        origin: (x, y) of the lattice's corner, and the angle of its first layer.
        grid: (cell [m], angles, step [m], words to try straight to the goal, whether pushes may change).
        nodes: rows X … AMOUNT; links: rows (parent, push, place in the table).
        table: hash table of cells, rows (cell, best node), empty at -1, its length a power of two.
        key, heap: of the queue; counts: (nodes, queue, expanded).
        far: ways to the goal of a point of the body, at least [m]; around: (x, y, cell, nx, ny, x, y in O).
        weights: of the cost to go, what a metre of that point costs at least, what may be wrong with it [m].
        best: (cost of the best way to the goal, its last node, its push); shot: its last word.
    """
    cell, angles, step, tries, changing = grid
    k, need, size, queued = len(T[6]), T[9][NEED], counts[0], counts[1]
    pose, here, rows = np.empty(3), np.empty(3), np.empty((WORDS, COLUMNS))
    status = 0
    for _ in range(budget):
        if queued == 0:
            status = 1
            break
        if size + 3 * k >= len(nodes) or 2 * (size + 3 * k) > len(table):
            status = 2
            break
        node, value = heap[0], key[0]
        queued -= 1
        _down(key, heap, queued)
        a, g = links[node, 1], nodes[node, COST]
        if table[links[node, 2], 1] != node or (weights[0] <= 1.0 and value >= best[0]):
            continue
        counts[2] += 1
        for b in range(k):
            extra = T[8][a, b]
            for j in range(3):
                pose[j] = nodes[node, j]
            if (b != a and not changing) or g + extra >= best[0]:
                continue
            if b != a and not changes(T, a, b, pose):
                continue
            # Straight to the goal.
            if g + extra + _least(T, b, pose, goal) < best[0] and T[9][LAST + b] > 0.0:
                found = connect(T, b, pose, goal, best[0] - g - extra, tries, rows, here)
                if found >= 0:
                    best[0], best[1], best[2] = g + extra + rows[found, 0], node, b
                    for j in range(COLUMNS):
                        shot[j] = rows[found, j]
            for letter in range(3):
                amount = step if letter == 1 else step / T[6][b, 6]
                law = T[7][b, letter]
                cost = g + extra + law[0] * amount
                if law[1] != np.inf:
                    # At full speed; what it takes to start and stop counts where the motion changes.
                    same = b == a and nodes[node, LETTER] == letter
                    cost = g + extra + law[0] * amount / law[1] + (0.0 if same else law[1] / law[2])
                if cost >= best[0]:
                    continue
                for j in range(3):
                    here[j] = pose[j]
                drive(T[6][b], letter, amount, here)
                i, m = (
                    np.int64(math.floor((here[0] - origin[0]) / cell)),
                    np.int64(math.floor((here[1] - origin[1]) / cell)),
                )
                h = int(((here[2] - origin[2]) % TURN) / TURN * angles) % angles
                code = ((np.int64(b) * angles + h) * MANY + (m + MANY // 2)) * MANY + (i + MANY // 2)
                at = _slot(table, code)
                old = table[at, 1]
                if old >= 0 and nodes[old, COST] <= cost + 1e-12:
                    continue
                rest = _rest(far, around, here, weights)
                if cost + rest >= best[0]:
                    continue
                if not free(T, b, here) or piece_gap(T, b, letter, amount, pose, need, need) < need:
                    continue
                for j in range(3):
                    nodes[size, j] = here[j]
                nodes[size, COST], nodes[size, LETTER], nodes[size, AMOUNT] = cost, letter, amount
                links[size, 0], links[size, 1], links[size, 2] = node, b, at
                table[at, 0], table[at, 1] = code, size
                key[queued], heap[queued] = cost + weights[0] * rest, size
                queued += 1
                _up(key, heap, queued - 1)
                size += 1
    counts[0], counts[1] = size, queued
    return status


@outer
def rehash(table: Any, links: Any, old: Any) -> None:
    """Moves the cells of a full table to a larger one."""
    for i in range(len(old)):
        if old[i, 1] >= 0:
            at = _slot(table, old[i, 0])
            table[at, 0], table[at, 1] = old[i, 0], old[i, 1]
            links[old[i, 1], 2] = at


@inner
def _slot(table: Any, code: int) -> int:
    """The place of a cell in the table: where it is, or where it would go."""
    mask = len(table) - 1
    mixed = code * np.int64(-7046029254386353131)
    at = (mixed ^ (mixed >> 29)) & mask
    while table[at, 1] >= 0 and table[at, 0] != code:
        at = (at + 1) & mask
    return int(at)


@inner
def _rest(far: Array, around: Any, pose: Array, weights: Array) -> float:
    """What the way from a pose to the goal costs at least, by that of one point of the body."""
    x0, y0, cell, nx, ny, px, py = around
    c, s = math.cos(pose[2]), math.sin(pose[2])
    u = int((pose[0] + c * px - s * py - x0) / cell)
    v = int((pose[1] + s * px + c * py - y0) / cell)
    u, v = min(max(u, 0), nx - 1), min(max(v, 0), ny - 1)
    return max(0.0, far[v * nx + u] - weights[2]) * weights[1]


@inner
def _least(T: Any, b: int, pose: Array, goal: Array) -> float:
    """What push b costs at least from pose to goal: the way of the midpoint of its centres."""
    car, law = T[6][b], T[7][b]
    fx, fy = 0.5 * (car[0] + car[2]), 0.5 * (car[1] + car[3])
    c, s, d, t = math.cos(pose[2]), math.sin(pose[2]), math.cos(goal[2]), math.sin(goal[2])
    x = goal[0] + d * fx - t * fy - pose[0] - c * fx + s * fy
    y = goal[1] + t * fx + d * fy - pose[1] - s * fx - c * fy
    rate = min(law[1, 0], min(law[0, 0], law[2, 0]) / car[6])
    if law[1, 1] != np.inf:
        rate = rate / max(law[0, 1], max(law[1, 1], law[2, 1]))
    return rate * math.sqrt(x * x + y * y)
