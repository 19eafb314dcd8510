"""Compiled growth of two random trees; the package's docstring explains them."""

import math
from typing import NamedTuple

import numpy as np

from ....compiled import inner, kernel
from ....geometry.collision.world import Box
from ....geometry.pose import Array
from ..kernels import (
    COLUMNS,
    FULL_TURN,
    STRAIGHT,
    WORDS,
    amount_of,
    changes,
    copy,
    drive,
    free,
    keeps,
    letter_of,
    put,
    random,
    set_piece,
    words,
)
from ..task import TaskArrays

NEAR = 2  # nodes of a tree that are tried
TRIES = 2  # words of each
CUT = 0.7, 3.0  # way of an edge that is cut short, in turning radii, from … to …


class Forest(NamedTuple):
    """Two trees; the first axis is the tree: 0 from the start, 1 back from the goal.

    Attributes:
        poses: shape (2, m, 3); parents: shape (2, m).
        pushes: of a node's word from its parent, or to it, shape (2, m); of a root -1.
        rows: these words, shape (2, m, COLUMNS).
        sizes: nodes of each tree.
        first: whether each push may begin at the start.
    """

    poses: Array
    pushes: np.ndarray
    parents: np.ndarray
    rows: Array
    sizes: np.ndarray
    first: np.ndarray


@kernel()
def straight(T: TaskArrays, first: np.ndarray, start: Array, goal: Array, link: Array) -> int:
    """The first push of which a word leads clear from the start to the goal, or -1.

    Args:
        first: whether each push may begin at the start.
        link: becomes the word.
    """
    buffer, here = np.empty((WORDS, COLUMNS)), np.empty(3)
    for a in range(len(T.cars)):
        if not first[a] or not T.last[a]:
            continue
        count = words(T, a, start, goal, buffer)
        for i in range(count):
            if keeps(T, a, start, buffer[i], here):
                copy(buffer[i], link)
                return a
    return -1


@kernel()
def grow(
    T: TaskArrays, box: Box, forest: Forest, state: np.ndarray, joint: np.ndarray, link: Array, budget: int
) -> int:
    """Grows both trees until a word joins them or the budget is spent; returns how much of it is left, or -1.

    Args:
        box: where poses are drawn.
        joint: becomes (node of the first tree, node of the second, push); link: the word between them.
        budget: of words looked at.
    """
    poses, sizes = forest.poses, forest.sizes
    k = len(T.cars)
    pose, here, near = np.empty(3), np.empty(3), np.empty(NEAR, np.int64)
    buffer, row = np.empty((WORDS, COLUMNS)), np.empty(COLUMNS)
    left = budget
    side = 0
    while left > 0 and sizes[0] < len(poses[0]) and sizes[1] < len(poses[1]):
        left -= 1
        side = 1 - side
        pose[0] = box.xmin + random(state) * (box.xmax - box.xmin)
        pose[1] = box.ymin + random(state) * (box.ymax - box.ymin)
        pose[2] = FULL_TURN * random(state)
        a = int(random(state) * k)
        if not free(T, a, pose):
            continue
        new = -1
        count = _nearest(poses[side], sizes[side], pose, T.cars[a].radius, near)
        for i in range(count):
            left -= 1
            if _joined(T, forest, side, near[i], pose, a, buffer, row, here, TRIES):
                new = _added(forest, side, pose, a, near[i], row)
                break
        if new < 0:
            way = T.cars[a].radius * CUT[0] * (CUT[1] / CUT[0]) ** random(state)
            node = near[0]
            left -= 1
            if _towards(T, forest, side, node, pose, a, way, buffer, row, here):
                new = _added(forest, side, pose, a, node, row)
        if new < 0:
            continue
        other = 1 - side
        count = _nearest(poses[other], sizes[other], pose, T.cars[a].radius, near)
        for i in range(count + 1):
            # The root, too: every tree can be joined there, however it has grown.
            node = near[i] if i < count else 0
            b = a if random(state) < 0.5 else int(random(state) * k)
            left -= 1
            if not _fits(T, forest, side, new, pose, b):
                continue
            if _joined(T, forest, other, node, pose, b, buffer, row, here, TRIES):
                joint[side], joint[other], joint[2] = new, node, b
                copy(row, link)
                return left
    return -1


@inner
def _added(forest: Forest, side: int, pose: Array, a: int, parent: int, row: Array) -> int:
    n = forest.sizes[side]
    put(pose, forest.poses[side, n])
    copy(row, forest.rows[side, n])
    forest.pushes[side, n], forest.parents[side, n] = a, parent
    forest.sizes[side] += 1
    return int(n)


@inner
def _nearest(poses: Array, size: int, pose: Array, radius: float, near: np.ndarray) -> int:
    """The nearest nodes, nearest first, by place and, with the turning radius, heading; returns how many."""
    count = 0
    keys = np.empty(NEAR)
    for i in range(size):
        dx, dy = poses[i, 0] - pose[0], poses[i, 1] - pose[1]
        turn = abs((poses[i, 2] - pose[2] + math.pi) % FULL_TURN - math.pi)
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
def _fits(T: TaskArrays, forest: Forest, side: int, node: int, pose: Array, a: int) -> bool:
    """Whether push a may follow the node's, or come before it, at the node's pose, free with the node's push or a."""
    b = forest.pushes[side, node]
    if b == a:
        return True
    if side == 0:
        return bool(forest.first[a]) if b < 0 else changes(T, b, a, pose)
    if b < 0:
        return bool(T.last[a])
    return free(T, a, pose) and changes(T, a, b, pose)


@inner
def _endpoints(side: int, node: Array, pose: Array) -> tuple[Array, Array]:
    return (node, pose) if side == 0 else (pose, node)


@inner
def _joined(
    T: TaskArrays, forest: Forest, side: int, node: int, pose: Array, a: int, buffer: Array, row: Array,
    here: Array, tries: int,
) -> bool:  # fmt: skip
    """Whether a word of push a leads clear from a node to a pose (or back from it: tree 1); puts it into the row."""
    if not _fits(T, forest, side, node, forest.poses[side, node], a):
        return False
    begin, end = _endpoints(side, forest.poses[side, node], pose)
    count = words(T, a, begin, end, buffer)
    for i in range(min(count, tries)):
        if keeps(T, a, begin, buffer[i], here):
            copy(buffer[i], row)
            return True
    return False


@inner
def _towards(
    T: TaskArrays, forest: Forest, side: int, node: int, pose: Array, a: int, way: float, buffer: Array,
    row: Array, here: Array,
) -> bool:  # fmt: skip
    """Goes some way from a node towards a pose, which then is where it ends; whether that keeps clear."""
    if not _fits(T, forest, side, node, forest.poses[side, node], a):
        return False
    begin, end = _endpoints(side, forest.poses[side, node], pose)
    if words(T, a, begin, end, buffer) == 0:
        return False
    word = buffer[0]
    copy(word, row)
    left = way
    for i in range(3):
        piece = i if side == 0 else 2 - i
        letter = letter_of(word, piece)
        unit = 1.0 if letter == STRAIGHT else T.cars[a].radius
        amount = min(amount_of(word, piece), left / unit)
        set_piece(row, piece, letter, amount)
        left = max(0.0, left - amount * unit)
    if side == 1:
        # Back from the pose: what comes before the part that is kept leads to where the edge begins.
        for piece in range(3):
            drive(T, a, letter_of(word, piece), amount_of(word, piece) - amount_of(row, piece), pose)
        return free(T, a, pose) and keeps(T, a, pose, row, here)
    if not keeps(T, a, begin, row, here):
        return False
    put(here, pose)
    return True
