"""Branch and bound over boxes of switch poses, compiled: the box of the least bound is halved, again and again.

A chain is a sequence of pushes. Its box holds, for every leg, where the leg ends: the switch poses, and last the goal
with what its tolerance leaves. The bound of a box is the sum of those of its legs (legs.py) and of the changes. Boxes
that cost no less than the best known plan are left; of the rest, in a heap, the least bound is below every plan.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import inner, kernel
from ...formulas import Record
from ...geometry.pose import Array
from ...steering.six_words import WORD, Records, cheapest_word
from .chains import MOST_LEGS, SIDES, Chains
from .joint import Scratch, chain_bound, scratch

POINT = 52  # a side that was halved so often is shorter than the rounding of its middle
LOOKED_AT = 4  # the middle of every so many boxes is tried as a plan
CLOSE = 1e-6  # a plan that is dearer than the bound by no more than this part is the cheapest

# The search as it stands: boxes that are open, slots that were ever used, slots that are free again, boxes halved so
# far, the cheapest known cost, and, if the search found it, its chain (else -1) and the ends of its legs.
STATE = np.dtype(
    [
        ("size", np.int64), ("used", np.int64), ("freed", np.int64), ("halved", np.int64),
        ("best", float), ("chain", np.int64), ("ends", float, SIDES),
    ]
)  # fmt: skip


class Boxes(NamedTuple):
    """Boxes in slots, and a heap of the slots of those that are open.

    Attributes:
        bound: of each, shape (n,); chain: number of its chain, (n,); level: how often each side was halved, and
            middle, shapes (n, SIDES).
        heap, free: slots: of open boxes, the least bound first, and of those that may be used again.
    """

    bound: Array
    chain: NDArray[np.int32]
    level: NDArray[np.uint8]
    middle: Array
    heap: NDArray[np.int32]
    free: NDArray[np.int32]

    @classmethod
    def new(cls, count: int) -> "Boxes":
        return cls(
            np.empty(count), np.empty(count, np.int32), np.empty((count, SIDES), np.uint8), np.empty((count, SIDES)),
            np.empty(count, np.int32), np.empty(count, np.int32),
        )  # fmt: skip


@kernel()
def begin(cars: Records, chains: Chains, boxes: Boxes, state: Records) -> None:
    """Opens the first box of every chain."""
    now = state[0]
    words = np.zeros(MOST_LEGS, WORD)
    here, there = np.zeros(3), np.zeros(3)
    work = scratch()
    for chain in range(len(chains.legs)):
        slot = _slot(boxes, now)
        boxes.chain[slot] = chain
        boxes.level[slot, :] = 0
        boxes.middle[slot, :] = chains.middle[chain]
        boxes.bound[slot] = chains.least[chain]
        _look(cars, chains, boxes, now, slot, words, here, there)
        _open(cars, chains, boxes, now, slot, work)


@kernel()
def halve(cars: Records, chains: Chains, boxes: Boxes, state: Records, count: int) -> bool:
    """Halves so many boxes; returns whether it could: the bound is not close, no box is a point, and there is room."""
    now = state[0]
    words = np.zeros(MOST_LEGS, WORD)
    here, there = np.zeros(3), np.zeros(3)
    work = scratch()
    for _ in range(count):
        if now.size == 0 or now.used - now.freed + 2 > len(boxes.bound):
            return False
        slot = boxes.heap[0]
        if boxes.bound[slot] >= now.best * (1.0 - CLOSE):
            return False
        side = _longest(chains, boxes, slot)
        if side < 0:
            return False
        _pop(boxes, now)
        chain = boxes.chain[slot]
        now.halved += 1
        if now.halved % LOOKED_AT == 0:
            _look(cars, chains, boxes, now, slot, words, here, there)
        half = chains.half[chain, side] * 0.5 ** (boxes.level[slot, side] + 1.0)
        twin = _slot(boxes, now)
        boxes.chain[twin] = chain
        boxes.bound[twin] = boxes.bound[slot]
        boxes.level[slot, side] += 1
        boxes.level[twin, :] = boxes.level[slot]
        boxes.middle[twin, :] = boxes.middle[slot]
        boxes.middle[slot, side] -= half
        boxes.middle[twin, side] += half
        _open(cars, chains, boxes, now, slot, work)
        _open(cars, chains, boxes, now, twin, work)
    return True


@kernel()
def box_bound(cars: Records, chains: Chains, chain: int, middle: Array, half: Array, limit: float) -> float:
    """The bound of one box (SIDES,) of a chain; the limit where it is above that."""
    return chain_bound(cars, chains, chain, middle, half, -np.inf, limit, scratch())


@inner
def _halves(chains: Chains, boxes: Boxes, slot: int, half: Array) -> None:
    for side in range(SIDES):
        half[side] = chains.half[boxes.chain[slot], side] * 0.5 ** float(boxes.level[slot, side])


@inner
def _longest(chains: Chains, boxes: Boxes, slot: int) -> int:
    """The side whose length costs most, or -1 of a point."""
    chain, longest, most = boxes.chain[slot], -1, 0.0
    for side in range(3 * chains.legs[chain]):
        length = chains.lever[chain, side] * chains.half[chain, side] * 0.5 ** float(boxes.level[slot, side])
        if length > most and boxes.level[slot, side] < POINT:
            longest, most = side, length
    return longest


@inner
def _look(
    cars: Records,
    chains: Chains,
    boxes: Boxes,
    now: Record,
    slot: int,
    words: Records,
    here: Array,
    there: Array,
) -> None:
    """Takes the plan through a box's middle if it is the cheapest so far."""
    chain = boxes.chain[slot]
    here[:] = chains.start
    total = chains.switching[chain]
    for leg in range(chains.legs[chain]):
        i = 3 * leg
        c, s = np.cos(boxes.middle[slot, i + 2]), np.sin(boxes.middle[slot, i + 2])
        x, y = chains.at[chain, leg]
        there[0] = boxes.middle[slot, i] - (c * x - s * y)
        there[1] = boxes.middle[slot, i + 1] - (s * x + c * y)
        there[2] = boxes.middle[slot, i + 2]
        total += cheapest_word(cars[chains.pushes[chain, leg]], here, there, words[leg])
        if total >= now.best:
            return
        here[:] = there
    now.best, now.chain = total, chain
    for side in range(SIDES):
        now.ends[side] = boxes.middle[slot, side]


@inner
def _slot(boxes: Boxes, now: Record) -> int:
    if now.freed > 0:
        now.freed -= 1
        return boxes.free[now.freed]
    now.used += 1
    return now.used - 1


@inner
def _open(cars: Records, chains: Chains, boxes: Boxes, now: Record, slot: int, work: Scratch) -> None:
    """Puts a box on the heap, or frees its slot where nothing in it can be cheaper than what is known.

    What bounded the box that it is a half of bounds it too, and stands as its bound.
    """
    half = np.empty(SIDES)
    _halves(chains, boxes, slot, half)
    known = boxes.bound[slot]
    bound = max(
        known,
        chain_bound(cars, chains, boxes.chain[slot], boxes.middle[slot], half, known, now.best, work),
    )
    if bound >= now.best:
        boxes.free[now.freed] = slot
        now.freed += 1
        return
    boxes.bound[slot] = bound
    place = now.size
    now.size += 1
    while place > 0:
        above = (place - 1) // 2
        if boxes.bound[boxes.heap[above]] <= bound:
            break
        boxes.heap[place] = boxes.heap[above]
        place = above
    boxes.heap[place] = slot


@inner
def _pop(boxes: Boxes, now: Record) -> None:
    """Takes the least bound off the heap."""
    now.size -= 1
    slot = boxes.heap[now.size]
    place = 0
    while 2 * place + 1 < now.size:
        below = 2 * place + 1
        if below + 1 < now.size and boxes.bound[boxes.heap[below + 1]] < boxes.bound[boxes.heap[below]]:
            below += 1
        if boxes.bound[boxes.heap[below]] >= boxes.bound[slot]:
            break
        boxes.heap[place] = boxes.heap[below]
        place = below
    boxes.heap[place] = slot
