"""Compiled growth of two random trees; the package's docstring explains them.

The first axis of poses (2, m, 3), pushes, parents (2, m) and rows (2, m, COLUMNS) is the tree: 0 from the start, 1 back
from the goal. The push of a node is that of its word from its parent, or to it; of a root it is -1.
"""

import math
from typing import Any

import numba as nb
import numpy as np

from ....geometry.pose import Array
from ..kernels import COLUMNS, LAST, TURN, WORDS, changes, drive, free, keeps, random, words

NEAR = 2  # nodes of a tree that are tried
TRIES = 2  # words of each
CUT = 0.7, 3.0  # way of an edge that is cut short, in turning radii, from … to …
inner = nb.njit(error_model="numpy")
outer = nb.njit(cache=True, nogil=True, error_model="numpy")


@outer
def straight(T: Any, first: Any, start: Array, goal: Array, link: Array) -> int:
    """The first push of which a word leads clear from the start to the goal, or -1.

    Args:
        first: whether each push may begin at the start.
        link: becomes the word.
    """
    buffer, here = np.empty((WORDS, COLUMNS)), np.empty(3)
    for a in range(len(T[6])):
        if not first[a] or T[9][LAST + a] == 0.0:
            continue
        count = words(T[6][a], T[7][a], start, goal, buffer)
        for i in range(count):
            if keeps(T, a, start, buffer[i], here):
                link[:] = buffer[i]
                return a
    return -1


@outer
def grow(
    T: Any, box: Array, first: Any, poses: Array, pushes: Any, parents: Any, rows: Array, sizes: Any, state: Any,
    joint: Any, link: Array, budget: int,
) -> int:  # fmt: skip
    """Grows both trees until a word joins them or the budget is spent; returns how much of it is left, or -1.

    Args:
        box: where poses are drawn, (xmin, ymin, xmax, ymax).
        first: whether each push may begin at the start.
        joint: becomes (node of the first tree, node of the second, push); link: the word between them.
        budget: of words looked at.
    """
    k = len(T[6])
    pose, here, near = np.empty(3), np.empty(3), np.empty(NEAR, np.int64)
    buffer, row = np.empty((WORDS, COLUMNS)), np.empty(COLUMNS)
    left = budget
    side = 0
    while left > 0 and sizes[0] < len(poses[0]) and sizes[1] < len(poses[1]):
        left -= 1
        side = 1 - side
        pose[0] = box[0] + random(state) * (box[2] - box[0])
        pose[1] = box[1] + random(state) * (box[3] - box[1])
        pose[2] = TURN * random(state)
        a = int(random(state) * k)
        if not free(T, a, pose):
            continue
        new = -1
        count = _nearest(poses[side], sizes[side], pose, T[6][a, 6], near)
        for i in range(count):
            left -= 1
            if _joined(T, first, poses, pushes, side, near[i], pose, a, buffer, row, here, TRIES):
                new = _added(poses, pushes, parents, rows, sizes, side, pose, a, near[i], row)
                break
        if new < 0:
            way = T[6][a, 6] * CUT[0] * (CUT[1] / CUT[0]) ** random(state)
            node = near[0]
            left -= 1
            if _towards(T, first, poses, pushes, side, node, pose, a, way, buffer, row, here):
                new = _added(poses, pushes, parents, rows, sizes, side, pose, a, node, row)
        if new < 0:
            continue
        other = 1 - side
        count = _nearest(poses[other], sizes[other], pose, T[6][a, 6], near)
        for i in range(count + 1):
            # The root, too: every tree can be joined there, however it has grown.
            node = near[i] if i < count else 0
            b = a if random(state) < 0.5 else int(random(state) * k)
            left -= 1
            if not _fits(T, first, pushes, side, new, pose, b):
                continue
            if _joined(T, first, poses, pushes, other, node, pose, b, buffer, row, here, TRIES):
                joint[side], joint[other], joint[2] = new, node, b
                link[:] = row
                return left
    return -1


@inner
def _added(
    poses: Array, pushes: Any, parents: Any, rows: Array, sizes: Any, side: int, pose: Array, a: int, parent: int,
    row: Array,
) -> int:  # fmt: skip
    n = sizes[side]
    for j in range(3):
        poses[side, n, j] = pose[j]
    for j in range(COLUMNS):
        rows[side, n, j] = row[j]
    pushes[side, n], parents[side, n] = a, parent
    sizes[side] += 1
    return int(n)


@inner
def _nearest(poses: Array, size: int, pose: Array, radius: float, near: Any) -> int:
    """The nearest nodes, nearest first, by place and, with the turning radius, heading; returns how many."""
    count = 0
    keys = np.empty(NEAR)
    for i in range(size):
        dx, dy = poses[i, 0] - pose[0], poses[i, 1] - pose[1]
        turn = abs((poses[i, 2] - pose[2] + math.pi) % TURN - math.pi)
        key = math.sqrt(dx * dx + dy * dy) + radius * turn
        if count == NEAR and key >= keys[NEAR - 1]:
            continue
        at = count if count < NEAR else NEAR - 1
        while at > 0 and keys[at - 1] > key:
            keys[at], near[at] = keys[at - 1], near[at - 1]
            at -= 1
        keys[at], near[at] = key, i
        count = min(count + 1, NEAR)
    return count


@inner
def _fits(T: Any, first: Any, pushes: Any, side: int, node: int, pose: Array, a: int) -> bool:
    """Whether push a may follow the node's, or come before it, at the node's pose, free with the node's push or a."""
    b = pushes[side, node]
    if b == a:
        return True
    if side == 0:
        return bool(first[a]) if b < 0 else changes(T, b, a, pose)
    if b < 0:
        return bool(T[9][LAST + a] > 0.0)
    return free(T, a, pose) and changes(T, a, b, pose)


@inner
def _ends(side: int, node: Array, pose: Array) -> tuple[Array, Array]:
    return (node, pose) if side == 0 else (pose, node)


@inner
def _joined(
    T: Any, first: Any, poses: Array, pushes: Any, side: int, node: int, pose: Array, a: int, buffer: Array,
    row: Array, here: Array, tries: int,
) -> bool:  # fmt: skip
    """Whether a word of push a leads clear from a node to a pose (or back from it: tree 1); puts it into the row."""
    if not _fits(T, first, pushes, side, node, poses[side, node], a):
        return False
    begin, end = _ends(side, poses[side, node], pose)
    count = words(T[6][a], T[7][a], begin, end, buffer)
    for i in range(min(count, tries)):
        if keeps(T, a, begin, buffer[i], here):
            row[:] = buffer[i]
            return True
    return False


@inner
def _towards(
    T: Any, first: Any, poses: Array, pushes: Any, side: int, node: int, pose: Array, a: int, way: float,
    buffer: Array, row: Array, here: Array,
) -> bool:  # fmt: skip
    """Goes some way from a node towards a pose, which then is where it ends; whether that keeps clear."""
    if not _fits(T, first, pushes, side, node, poses[side, node], a):
        return False
    begin, end = _ends(side, poses[side, node], pose)
    car = T[6][a]
    if words(car, T[7][a], begin, end, buffer) == 0:
        return False
    row[:] = buffer[0]
    left = way
    for i in range(3):
        piece = i if side == 0 else 2 - i
        unit = 1.0 if row[1 + 2 * piece] == 1.0 else car[6]
        amount = min(row[2 + 2 * piece], left / unit)
        if side == 1:
            row[2 + 2 * piece] -= amount  # for now what is left out, in front
        else:
            row[2 + 2 * piece] = amount
        left = max(0.0, left - amount * unit)
    if side == 1:
        for piece in range(3):
            drive(car, int(row[1 + 2 * piece]), row[2 + 2 * piece], pose)
            row[2 + 2 * piece] = buffer[0, 2 + 2 * piece] - row[2 + 2 * piece]
        return free(T, a, pose) and keeps(T, a, pose, row, here)
    if not keeps(T, a, begin, row, here):
        return False
    for j in range(3):
        pose[j] = here[j]
    return True
