"""The compiled search on a lattice ([Hart1968]); the package's docstring explains it."""

import math
from typing import NamedTuple

import numpy as np

from ....compiled import inner, kernel
from ....geometry.collision.body import POINT, BodyArrays
from ....geometry.collision.kernels import still_gap
from ....geometry.collision.world import Box, WorldArrays
from ....geometry.pose import Array
from ....steering.six_words import LEFT, MOST_WORDS, RIGHT, STRAIGHT, TURN, WORD, Records, drive
from ...query_arrays import QueryArrays
from ..kernels import changes, connect, free, lands, piece_clear, put

X, Y, THETA, COST, LETTER, AMOUNT = range(6)  # columns of the nodes
PARENT, PUSH, PLACE = range(3)  # columns of the links: PLACE is in the table
CODE, NODE = range(2)  # columns of the table
MANY = 1 << 20  # most cells along a side
SPENT, DONE, FULL = range(3)  # why an expansion stopped: the budget, nothing left, no room left
EIGHT = 0.9239  # cos(π/8): a path along eight directions is at most 1/EIGHT times as long as the straight one


class Queue(NamedTuple):
    """A tree of poses with what is still to be looked at.

    Attributes:
        nodes: rows X … AMOUNT; links: rows PARENT, PUSH, PLACE.
        table: hash table of cells, rows (CODE, best NODE), empty at -1, its length a power of two.
        keys, heap: of the priority queue; counts: nodes, entries of the queue, nodes expanded.
        bound: of what is of interest, shape (1,).
        costs, ends, shots: of the best path whose last push is each one, shape (k,): its cost, its last node before
            the word to the goal, and that, of WORD.
    """

    nodes: Array
    links: np.ndarray
    table: np.ndarray
    keys: Array
    heap: np.ndarray
    counts: np.ndarray
    bound: Array
    costs: Array
    ends: np.ndarray
    shots: Records


class Steps(NamedTuple):
    """The lattice.

    Attributes:
        x, y, theta: its corner and the angle of its first layer; cell [m]; angles: layers.
        step: path of the flat point in a step [m]; tries: words that are tried straight to the goal.
        changing: whether pushes may change.
        spare: how much dearer than the best path one with another last push may be.
    """

    x: float
    y: float
    theta: float
    cell: float
    angles: int
    step: float
    tries: int
    changing: bool
    spare: float


class Rest(NamedTuple):
    """What a path still costs at least, by that of one point of the body.

    Attributes:
        far: distances to the goal over a grid's cells [m], shape (columns · rows,).
        x, y, cell: of the grid [m]; columns, rows.
        px, py: the point in O [m].
        weight: of the estimate; per_metre: what a metre of the point's path costs at least; slack: of `far` [m].
    """

    far: Array
    x: float
    y: float
    cell: float
    columns: int
    rows: int
    px: float
    py: float
    weight: float
    per_metre: float
    slack: float


class Turns(NamedTuple):
    """With which heading an end is cheapest, roughly, by where it lies before the object.

    Attributes:
        turns: heading at the end, less that of the object, shape (k pushes, rings, sectors) [rad]; of no rings where
            the end has its heading.
        first: radius of the first ring [m]; growth: logarithm of the ratio of a ring's radius to the one before.
    """

    turns: Array
    first: float
    growth: float


@kernel()
def distances(
    W: WorldArrays, radius: float, box: Box, cell: float, nx: int, ny: int, goals: Array, need: float
) -> Array:
    """Distances of the middle of a disc from the nearest of some goals, shape (m, 2), at least, (nx · ny,) [m].

    Among the obstacles, over a grid's cells.

    Eight neighbours; what a path through cells can be longer than a straight one is taken off. Cells count as free
    unless the disc, less half a cell's diagonal, overlaps something at their middle.
    """
    n = nx * ny
    out, open_ = np.empty(n), np.empty(n, np.bool_)
    points = np.zeros(1, POINT)
    points[0].radius = max(radius - 0.75 * cell, 0.0)
    disc = BodyArrays(points, 0, 0.0, 0.0, points[0].radius)
    for j in range(ny):
        for i in range(nx):
            x, y = box.xmin + (i + 0.5) * cell, box.ymin + (j + 0.5) * cell
            out[j * nx + i] = math.inf
            open_[j * nx + i] = still_gap(W, disc, x, y, 1.0, 0.0, need, need) >= need
    heap_key, heap_at = np.empty(8 * n + len(goals)), np.empty(8 * n + len(goals), np.int64)
    size = 0
    for goal in goals:
        gi = min(max(int((goal[0] - box.xmin) / cell), 0), nx - 1)
        gj = min(max(int((goal[1] - box.ymin) / cell), 0), ny - 1)
        heap_key[size], heap_at[size] = 0.0, gj * nx + gi
        out[gj * nx + gi] = 0.0
        size += 1
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
    for at in range(n):
        out[at] *= EIGHT
    return out


@inner
def _up(key: Array, at: np.ndarray, i: int) -> None:
    k, a = key[i], at[i]
    while i > 0 and key[(i - 1) // 2] > k:
        key[i], at[i] = key[(i - 1) // 2], at[(i - 1) // 2]
        i = (i - 1) // 2
    key[i], at[i] = k, a


@inner
def _down(key: Array, at: np.ndarray, size: int) -> None:
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


@kernel()
def expand(
    T: QueryArrays, queue: Queue, steps: Steps, rest: Rest, goal: Array, turns: Turns, budget: int
) -> int:
    """Expands up to a number of nodes; returns why it stopped: SPENT, DONE or FULL.

    Words are tried to the goal, or to its place with the heading that is cheapest there.
    """
    nodes, links, table, counts, bound = queue.nodes, queue.links, queue.table, queue.counts, queue.bound
    keys, heap, cell, angles = queue.keys, queue.heap, steps.cell, steps.angles
    k, size, queued = len(T.cars), counts[0], counts[1]
    pose, here, words, aim = np.empty(3), np.empty(3), np.empty(MOST_WORDS, WORD), goal.copy()
    status, turning = SPENT, turns.turns.shape[1] > 0
    for _ in range(budget):
        if queued == 0:
            status = DONE
            break
        if size + 3 * k >= len(nodes) or 2 * (size + 3 * k) > len(table):
            status = FULL
            break
        node, value = heap[0], keys[0]
        queued -= 1
        _down(keys, heap, queued)
        a, g = links[node, PUSH], nodes[node, COST]
        if table[links[node, PLACE], NODE] != node or (rest.weight <= 1.0 and value >= bound[0]):
            continue
        counts[2] += 1
        for b in range(k):
            extra = T.switching[a, b]
            for j in range(3):
                pose[j] = nodes[node, j]
            if (b != a and not steps.changing) or g + extra >= bound[0]:
                continue
            if b != a and not changes(T, a, b, pose):
                continue
            # Straight to the goal.
            limit = min(bound[0], queue.costs[b])
            if turning:
                aim[2] = pose[2] + _turn(turns, b, pose, goal)
            ends = g + extra + _least(T, b, pose, aim) < limit
            if ends and ((free(T, b, aim) and lands(T, b, aim)) if turning else T.last[b]):
                found = connect(T, b, pose, aim, limit - g - extra, steps.tries, words, here)
                if found >= 0:
                    queue.costs[b], queue.ends[b] = g + extra + words[found].cost, node
                    queue.shots[b] = words[found]
                    bound[0] = min(bound[0], steps.spare * queue.costs[b])
            for letter in range(3):
                amount = steps.step if letter == STRAIGHT else steps.step / T.cars[b].radius
                way, speed = T.cars[b].rate[letter] * amount, T.cars[b].speed[letter]
                cost = g + extra + way
                if speed != np.inf:
                    # At full speed; what it takes to start and stop counts where the motion changes.
                    same = b == a and nodes[node, LETTER] == letter
                    ramp = 0.0 if same else speed / T.cars[b].acceleration[letter]
                    cost = g + extra + way / speed + ramp
                if cost >= bound[0]:
                    continue
                put(pose, here)
                drive(T.cars[b], letter, amount, here)
                i, m = (
                    np.int64(math.floor((here[0] - steps.x) / cell)),
                    np.int64(math.floor((here[1] - steps.y) / cell)),
                )
                h = int(((here[2] - steps.theta) % TURN) / TURN * angles) % angles
                code = ((np.int64(b) * angles + h) * MANY + (m + MANY // 2)) * MANY + (i + MANY // 2)
                at = _slot(table, code)
                old = table[at, NODE]
                if old >= 0 and nodes[old, COST] <= cost + 1e-12:
                    continue
                left = _rest(rest, here)
                if cost + left >= bound[0]:
                    continue
                if not free(T, b, here) or not piece_clear(T, b, letter, amount, pose):
                    continue
                for j in range(3):
                    nodes[size, j] = here[j]
                nodes[size, COST], nodes[size, LETTER], nodes[size, AMOUNT] = cost, letter, amount
                links[size, PARENT], links[size, PUSH], links[size, PLACE] = node, b, at
                table[at, CODE], table[at, NODE] = code, size
                keys[queued], heap[queued] = cost + rest.weight * left, size
                queued += 1
                _up(keys, heap, queued - 1)
                size += 1
    counts[0], counts[1] = size, queued
    return status


@kernel()
def rehash(table: np.ndarray, links: np.ndarray, old: np.ndarray) -> None:
    """Moves the cells of a full table to a larger one."""
    for i in range(len(old)):
        if old[i, NODE] >= 0:
            at = _slot(table, old[i, CODE])
            table[at, CODE], table[at, NODE] = old[i, CODE], old[i, NODE]
            links[old[i, NODE], PLACE] = at


@inner
def _slot(table: np.ndarray, code: np.int64) -> int:
    """The place of a cell in the table: where it is, or where it would go."""
    mask = len(table) - 1
    mixed = code * np.int64(-7046029254386353131)
    at = (mixed ^ (mixed >> 29)) & mask
    while table[at, NODE] >= 0 and table[at, CODE] != code:
        at = (at + 1) & mask
    return int(at)


@inner
def _rest(rest: Rest, pose: Array) -> float:
    """What the path from a pose to the goal costs at least, by that of one point of the body."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    u = int((pose[0] + c * rest.px - s * rest.py - rest.x) / rest.cell)
    v = int((pose[1] + s * rest.px + c * rest.py - rest.y) / rest.cell)
    u, v = min(max(u, 0), rest.columns - 1), min(max(v, 0), rest.rows - 1)
    return max(0.0, rest.far[v * rest.columns + u] - rest.slack) * rest.per_metre


@inner
def _turn(turns: Turns, b: int, pose: Array, goal: Array) -> float:
    """By how much push b turns the object at the least cost on its way to a place."""
    x, y = goal[0] - pose[0], goal[1] - pose[1]
    away = math.log(max(math.hypot(x, y), turns.first) / turns.first) / turns.growth
    rings, sectors = turns.turns.shape[1], turns.turns.shape[2]
    sector = int(((math.atan2(y, x) - pose[2]) % TURN) / TURN * sectors + 0.5) % sectors
    return float(turns.turns[b, min(int(away + 0.5), rings - 1), sector])


@inner
def _least(T: QueryArrays, b: int, pose: Array, goal: Array) -> float:
    """What push b costs at least from pose to goal: the path of the midpoint of its centres."""
    car = T.cars[b]
    fx, fy = 0.5 * (car.left_x + car.right_x), 0.5 * (car.left_y + car.right_y)
    c, s, d, t = math.cos(pose[2]), math.sin(pose[2]), math.cos(goal[2]), math.sin(goal[2])
    x = goal[0] + d * fx - t * fy - pose[0] - c * fx + s * fy
    y = goal[1] + t * fx + d * fy - pose[1] - s * fx - c * fy
    rate = min(car.rate[STRAIGHT], min(car.rate[LEFT], car.rate[RIGHT]) / car.radius)
    if car.speed[STRAIGHT] != np.inf:
        rate = rate / max(car.speed[LEFT], max(car.speed[STRAIGHT], car.speed[RIGHT]))
    return rate * math.sqrt(x * x + y * y)
