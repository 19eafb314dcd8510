"""From a path to a timed plan: landing, pushes, the transits between them, leaving."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from ..contact import Placement
from ..geometry import relative
from ..problem import Scene, Segment
from ..steering.car import Car
from .options import PushOption
from .path import Path
from .rolling import rolling_segment
from .segments import arcs_of, fingertips, push_segment
from .transits import PusherPath, Transits

Moved = TypeVar("Moved", bound=Segment)
Segments = tuple[Segment, ...]


def car_of(option: PushOption) -> Car:
    """The car of a push that has one."""
    assert option.car is not None
    return option.car


def assemble(scene: Scene, transits: Transits, options: Sequence[PushOption], path: Path) -> Segments:
    """The segments of a path whose pushes are numbers of the options.

    Raises:
        FlatpushError: if the pusher has no way between two pushes, or a finger that keeps its direction rolls off.
    """
    segments: list[Segment] = []
    pose, hand, before = path.start, None, None
    for number, word, amounts, end in path.stretches:
        option = options[number]
        there = option.placement
        assert there is not None
        if hand is None:
            segments.append(_landing(transits, there).segment(scene.pusher, pose))
        elif number != before or not scene.pusher.turns:
            crossing = _between(transits, hand, there).segment(scene.pusher, pose)
            segments.append(following(crossing, segments[-1]))
        tips = fingertips(option.push.fingers, option.push.spacing)
        arcs = arcs_of(car_of(option), word, amounts, tips)
        if scene.pusher.turns:
            push = push_segment(scene, option.push.name, car_of(option), tips, arcs, pose)
        else:
            push = rolling_segment(scene, option, arcs, pose, end)
        segments.append(following(push, segments[-1]))
        pose, before = push.object[-1], number
        # Where the fingers now stand on the object; a finger that kept its direction has rolled along.
        stand = relative(pose, push.pusher[-1])
        hand = there if scene.pusher.turns else replace(there, pose=stand, tips=stand[None, :2])
    assert hand is not None
    away = _leaving(transits, hand).segment(scene.pusher, pose)
    segments.append(following(away, segments[-1]))
    return tuple(segments)


# The ways from the contact of a push and to it are the same in every plan.
@lru_cache(maxsize=256)
def _landing(transits: Transits, there: Placement) -> PusherPath:
    return transits.landing(there)


@lru_cache(maxsize=256)
def _between(transits: Transits, first: Placement, second: Placement) -> PusherPath:
    return transits.between(first, second)


@lru_cache(maxsize=256)
def _leaving(transits: Transits, hand: Placement) -> PusherPath:
    return transits.landing(hand).reversed()


def following(segment: Moved, before: Segment) -> Moved:
    """A segment with whole turns added to the pusher's yaw, so that it goes on from the segment before."""
    turns = round(float(before.pusher[-1, 2] - segment.pusher[0, 2]) / (2 * np.pi))
    whole = np.array([0.0, 0.0, 2 * np.pi * turns])
    return segment if turns == 0 else replace(segment, pusher=segment.pusher + whole)
