"""Whole runs of the plain plant: what the steps' advance, follow, push_out and many do, for any number of fingers."""

import numpy as np

from ...geometry import compose, inverse, log, transform, wrap_angle
from ...geometry.pose import Array
from .arrays import SeenRows
from .codes import AS_IT_IS, BODY, MODES, OUTCOMES
from .contacts import TOUCH
from .plain import Fingers, facing


def push_out(fingers: Fingers, q: Array, hands: Array) -> None:
    """Moves an object q (3,) that overlaps fingers out of them, in place, the shortest way."""
    for _ in range(50):
        inside = {(t.finger, t.slot): t.gap for t in fingers.near(q, hands) if t.gap < 0}
        if min(inside.values(), default=0.0) >= -TOUCH * fingers.outline.size:
            break
        q[:] = fingers.settle(q, hands, set(inside), [])


def follow(
    fingers: Fingers, q: Array, poses: Array, begin: int, kind: int, out: Array, seen: SeenRows
) -> tuple[int, int, Array]:
    """steps.follow from X_WO q (3,): poses (m, h, 3), out (rows, 3), seen SEEN rows (rows, k).

    Returns:
        the outcome's code, the number of poses reached, and the hands' last poses (h, 3).
    """
    hands, status, reached = poses[0].copy(), 0, 0
    step = np.zeros_like(hands)
    modes: list[str] = []
    ways: list[set[str]] = []
    seen["modes"] = 0
    for m in range(begin, len(poses)):
        if not status:
            if m and kind == BODY:
                step = np.atleast_2d(log(compose(inverse(hands), poses[m])))
            elif m:
                step = poses[m] - hands
                step[:, 2] = step[:, 2] if kind == AS_IT_IS else wrap_angle(step[:, 2])
            outcome, q, hands, modes, ways = fingers.advance(q, hands, step, kind == BODY)
            status = OUTCOMES.index(outcome)
            reached += not status
        out[m if len(out) > 1 else 0] = q
        row = seen[m if len(seen) > 1 else 0]
        for i, tip in enumerate(fingers.tips):
            place = transform(inverse(q), transform(hands[i if len(hands) > 1 else 0], tip))
            gap, point, _, _ = facing(fingers.outline, place)[0]
            bits = row[i]["modes"] | sum(1 << MODES.index(mode) for mode in ways[i])
            row[i] = (*point, gap - fingers.radius, MODES.index(modes[i]), bits)
    return status, reached, hands
