"""A plan as the motions of its hand: stretches in which the same fingers move in the same way."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.pose import Array
from ..problem import Plan
from .pieces import Piece, Source, pieces


@dataclass(frozen=True, eq=False)
class Stretch:
    """Part of the hand's way.

    Attributes:
        push: index of the push or slide it belongs to, among Plan.on_table; None in a transit.
        fingers: index of the one whose fingers it moves: in a transit those of the push before until the hand is
            lifted, then those of the next.
        lifted: whether the hand is off the table.
        body: whether the hand goes from pose to pose with a constant body twist, or else straight in W.
        times: from the start of the plan, shape (m,) [s].
        hand: X_WE, shape (m, 3).
    """

    push: int | None
    fingers: int
    lifted: bool
    body: bool
    times: Array
    hand: Array


def stretches(plan: Plan, source: Source) -> tuple[Stretch, ...]:
    """The stretches of a plan in order; each starts with the pose at which the one before ended."""
    found: list[Stretch] = []
    group: list[Piece] = []
    before, raised = -1, False  # the last push, and whether the hand was lifted since
    last = len(plan.on_table) - 1

    def close() -> None:
        if group:
            push = group[0].push
            fingers = push if push is not None else min(max(before + (raised or before < 0), 0), last)
            found.append(_stretch(group, push, fingers))
            group.clear()

    for piece in pieces(plan.segments, np.asarray(plan.scene.start, dtype=float), source):
        if group and (piece.push, piece.lifted, piece.body) != (
            group[0].push,
            group[0].lifted,
            group[0].body,
        ):
            close()
        if piece.push is not None:
            before, raised = piece.push, False
        raised = raised or piece.lifted
        group.append(piece)
    close()
    return tuple(found)


def _stretch(group: Sequence[Piece], push: int | None, fingers: int) -> Stretch:
    end = group[-1]
    times = [piece.time for piece in group] + [end.time + end.duration]
    hand = [piece.pusher for piece in group] + [end.pusher_at(1.0)]
    return Stretch(push, fingers, group[0].lifted, group[0].body, np.array(times), np.array(hand))
