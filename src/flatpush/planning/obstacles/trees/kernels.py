"""Compiled growth of two random trees ([Kuffner2000]); the package's docstring explains them."""

import math
from typing import Any, NamedTuple

import numpy as np

from ....compiled import inner, kernel
from ....geometry.collision.world import Box
from ....geometry.pose import Array
from ....steering.six_words import MOST_WORDS, STRAIGHT, TURN, WORD, Records, all_words, drive
from ...query_arrays import QueryArrays
from ..kernels import changes, free, keeps, put, random

NEIGHBOURS = 2  # nodes of a tree that are tried
TRIES = 2  # words of each
CUT = 0.7, 3.0  # way of an edge that is cut short, in turning radii, from … to …


class Forest(NamedTuple):
    """Two trees; the first axis is the tree: 0 from the start, 1 back from the goal.

    Attributes:
        poses: shape (2, m, 3); parents: shape (2, m).
        pushes: of a node's word from its parent, or to it, shape (2, m); of a root -1.
        words: these words, of six_words.WORD, shape (2, m).
        sizes: nodes of each tree.
        first: whether each push may begin at the start.
    """

    poses: Array
    pushes: np.ndarray
    parents: np.ndarray
    words: Records
    sizes: np.ndarray
    first: np.ndarray


@kernel()
def straight(T: QueryArrays, first: np.ndarray, start: Array, goal: Array, link: Records) -> int:
    """The first push of which a word leads clear from the start to the goal, or -1.

    Args:
        first: whether each push may begin at the start.
        link: becomes the word, shape (1,).
    """
    buffer, here = np.empty(MOST_WORDS, WORD), np.empty(3)
    for a in range(len(T.cars)):
        if not first[a] or not T.last[a]:
            continue
        count = all_words(T.cars[a], start, goal, buffer)
        for i in range(count):
            if keeps(T, a, start, buffer[i], here):
                link[0] = buffer[i]
                return a
    return -1


@kernel()
def grow(
    T: QueryArrays, box: Box, forest: Forest, state: np.ndarray, joint: np.ndarray, link: Records, budget: int
) -> int:
    """Grows both trees until a word joins them or the budget is spent; returns how much of it is left, or -1.

    Args:
        box: where poses are drawn.
        joint: becomes (node of the first tree, node of the second, push); link: the word between them.
        budget: of words looked at.
    """
    poses, sizes = forest.poses, forest.sizes
    k = len(T.cars)
    pose, here, near = np.empty(3), np.empty(3), np.empty(NEIGHBOURS, np.int64)
    buffer, word = np.empty(MOST_WORDS, WORD), np.empty(1, WORD)
    left = budget
    side = 0
    while left > 0 and sizes[0] < len(poses[0]) and sizes[1] < len(poses[1]):
        left -= 1
        side = 1 - side
        pose[0] = box.xmin + random(state) * (box.xmax - box.xmin)
        pose[1] = box.ymin + random(state) * (box.ymax - box.ymin)
        pose[2] = TURN * random(state)
        a = int(random(state) * k)
        if not free(T, a, pose):
            continue
        new = -1
        count = _nearest(poses[side], sizes[side], pose, T.cars[a].radius, near)
        for i in range(count):
            left -= 1
            if _joined(T, forest, side, near[i], pose, a, buffer, word, here, TRIES):
                new = _added(forest, side, pose, a, near[i], word[0])
                break
        if new < 0:
            way = T.cars[a].radius * CUT[0] * (CUT[1] / CUT[0]) ** random(state)
            node = near[0]
            left -= 1
            if _towards(T, forest, side, node, pose, a, way, buffer, word, here):
                new = _added(forest, side, pose, a, node, word[0])
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
            if _joined(T, forest, other, node, pose, b, buffer, word, here, TRIES):
                joint[side], joint[other], joint[2] = new, node, b
                link[0] = word[0]
                return left
    return -1


@inner
def _added(forest: Forest, side: int, pose: Array, a: int, parent: int, word: Any) -> int:
    n = forest.sizes[side]
    put(pose, forest.poses[side, n])
    forest.words[side, n] = word
    forest.pushes[side, n], forest.parents[side, n] = a, parent
    forest.sizes[side] += 1
    return int(n)


@inner
def _nearest(poses: Array, size: int, pose: Array, radius: float, near: np.ndarray) -> int:
    """The nearest nodes, nearest first, by place and, with the turning radius, heading; returns how many."""
    count = 0
    keys = np.empty(NEIGHBOURS)
    for i in range(size):
        dx, dy = poses[i, 0] - pose[0], poses[i, 1] - pose[1]
        turn = abs((poses[i, 2] - pose[2] + math.pi) % TURN - math.pi)
        key = math.sqrt(dx * dx + dy * dy) + radius * turn
        if count == NEIGHBOURS and key >= keys[NEIGHBOURS - 1]:
            continue
        at = count if count < NEIGHBOURS else NEIGHBOURS - 1
        while at > 0 and keys[at - 1] > key:
            keys[at], near[at] = keys[at - 1], near[at - 1]
            at -= 1
        keys[at], near[at] = key, i
        count = min(count + 1, NEIGHBOURS)
    return count


@inner
def _fits(T: QueryArrays, forest: Forest, side: int, node: int, pose: Array, a: int) -> bool:
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
    T: QueryArrays, forest: Forest, side: int, node: int, pose: Array, a: int, buffer: Records, word: Records,
    here: Array, tries: int,
) -> bool:  # fmt: skip
    """Whether a word of push a leads clear from a node to a pose (or back from it: tree 1); puts it into word[0]."""
    if not _fits(T, forest, side, node, forest.poses[side, node], a):
        return False
    begin, end = _endpoints(side, forest.poses[side, node], pose)
    count = all_words(T.cars[a], begin, end, buffer)
    for i in range(min(count, tries)):
        if keeps(T, a, begin, buffer[i], here):
            word[0] = buffer[i]
            return True
    return False


@inner
def _towards(
    T: QueryArrays, forest: Forest, side: int, node: int, pose: Array, a: int, way: float, buffer: Records,
    word: Records, here: Array,
) -> bool:  # fmt: skip
    """Goes some way from a node towards a pose, which then is where it ends; whether that keeps clear."""
    if not _fits(T, forest, side, node, forest.poses[side, node], a):
        return False
    begin, end = _endpoints(side, forest.poses[side, node], pose)
    if all_words(T.cars[a], begin, end, buffer) == 0:
        return False
    whole = buffer[0]
    word[0] = whole
    part, left = word[0], way
    for i in range(3):
        piece = i if side == 0 else 2 - i
        unit = 1.0 if whole.letter[piece] == STRAIGHT else T.cars[a].radius
        part.amount[piece] = min(whole.amount[piece], left / unit)
        left = max(0.0, left - part.amount[piece] * unit)
    if side == 1:
        # Back from the pose: what comes before the part that is kept leads to where the edge begins.
        for piece in range(3):
            drive(T.cars[a], whole.letter[piece], whole.amount[piece] - part.amount[piece], pose)
        return free(T, a, pose) and keeps(T, a, pose, part, here)
    if not keeps(T, a, begin, part, here):
        return False
    put(here, pose)
    return True
