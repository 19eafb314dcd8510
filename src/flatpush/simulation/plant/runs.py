"""Whole runs of the plain plant: what the kernels' advance, follow, push_out and many do, for any number of fingers."""

import numpy as np

from ...contact import ContactMode
from ...geometry import compose, inverse, log, transform, wrap_angle
from ...geometry.pose import Array
from .plain import TOUCH, Fingers, facing

MODES = tuple(
    mode.value
    for mode in (
        ContactMode.REST,
        ContactMode.STICKING,
        ContactMode.SLIDING_LEFT,
        ContactMode.SLIDING_RIGHT,
        ContactMode.SEPARATION,
    )
)
OUTCOMES = ("", "jammed", "grasped", "starts inside", "too many contacts", "undecided")


def push_out(fingers: Fingers, q: Array, hands: Array) -> None:
    """Moves an object q (3,) that overlaps fingers out of them, in place, the shortest way."""
    for _ in range(50):
        inside = {(t.finger, t.slot): t.gap for t in fingers.near(q, hands) if t.gap < 0}
        if min(inside.values(), default=0.0) >= -1e-3 * TOUCH * fingers.outline.size:
            break
        q[:] = fingers.settle(q, hands, set(inside), [])


def advance(fingers: Fingers, q: Array, hands: Array, step: Array, body: int, seen: Array) -> int:
    """kernels.advance: moves q (3,) and hands (h, 3) in place, writes seen (k, 5), returns the outcome's code."""
    outcome, pose, moved, modes, ways = fingers.advance(q.copy(), hands.copy(), step, bool(body))
    q[:], hands[:] = pose, moved
    for i, tip in enumerate(fingers.tips):
        place = transform(inverse(q), transform(hands[i if len(hands) > 1 else 0], tip))
        gap, point, _, _ = facing(fingers.outline, place)[0]
        bits = sum(1 << MODES.index(mode) for mode in ways[i])
        seen[i] = [MODES.index(modes[i]), *point, gap - fingers.radius, bits]
    return OUTCOMES.index(outcome)


def follow(fingers: Fingers, q: Array, hands: Array, body: int, out: Array, seen: Array) -> tuple[int, int]:
    """kernels.follow: the object, q (3,), under a hand that goes from pose to pose, hands (m, h, 3)."""
    hand, now, bits = (
        hands[0].copy(),
        np.zeros((len(fingers.tips), 5)),
        np.zeros(len(fingers.tips), dtype=int),
    )
    for k in range(len(hands)):
        if body:
            step = log(compose(inverse(hand), hands[k]))
        else:
            step = hands[k] - hand
            step[:, 2] = wrap_angle(step[:, 2])
        status = advance(fingers, q, hand, np.atleast_2d(step), body, now)
        bits = bits | now[:, 4].astype(int)
        out[k if len(out) > 1 else 0] = q
        seen[k if len(seen) > 1 else 0] = now
        if status:
            out[k:], seen[k:] = q, now
            break
    if len(seen) == 1:
        seen[0, :, 4] = bits
    return status, k if status else len(hands)
