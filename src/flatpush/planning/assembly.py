"""From chosen words to a timed plan: landing, pushes, the transits between them, leaving."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..geometry import relative
from ..geometry.pose import Array
from ..problem import PushSegment, Scene, TransitSegment
from ..steering.car import Car
from ..steering.three_twist import Word, words
from .options import PushOption
from .rolling import rolling_segment
from .segments import arc_duration, arcs_of, fingertips, push_segment
from .transits import Transits

Segment = TypeVar("Segment", PushSegment, TransitSegment)
Segments = tuple[PushSegment | TransitSegment, ...]
# A word found again from where the last push really ended is the same if its amounts differ by less [rad, m].
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Leg:
    """One push of a plan before it is timed: which one, its word with angles and lengths, and where it leads."""

    option: PushOption
    word: str
    amounts: Array
    goal: Array


def car_of(option: PushOption) -> Car:
    """The car of a push that has one."""
    assert option.car is not None
    return option.car


def words_of(scene: Scene, option: PushOption) -> list[Word]:
    """All words of a push from the scene's start to its goal."""
    car = car_of(option)
    return words(car.left_centre, car.right_centre, car.direction, scene.start_pose, scene.goal_pose)


def costs(scene: Scene, option: PushOption) -> list[float]:
    """The costs of these words."""
    car, tips = car_of(option), fingertips(option.push.fingers, option.push.spacing)
    found = []
    for word in words_of(scene, option):
        if scene.planning.cost == "time":
            found.append(
                sum(arc_duration(arc, scene.pusher) for arc in arcs_of(car, word.word, word.parameters, tips))
            )
        else:
            each = dict(zip("LSR", car.weights(scene.planning.cost), strict=True))
            found.append(sum(each[x] * float(p) for x, p in zip(word.word, word.parameters, strict=True)))
    return found


def assemble(scene: Scene, transits: Transits, legs: Sequence[Leg]) -> Segments:
    """The segments of a plan from the scene's start.

    Raises:
        FlatpushError: if the pusher has no way between two pushes, or a finger that keeps its direction rolls off.
    """
    segments: list[PushSegment | TransitSegment] = []
    pose, hand, before = scene.start_pose, None, None
    for leg in legs:
        there = leg.option.placement
        assert there is not None
        if hand is None:
            segments.append(transits.landing(there).segment(scene.pusher, pose))
        elif leg.option is not before or not scene.pusher.turns:
            way = transits.between(hand, there).segment(scene.pusher, pose)
            segments.append(following(way, segments[-1]))
        push = _push(scene, leg, pose)
        segments.append(following(push, segments[-1]))
        pose, before = push.object[-1], leg.option
        # Where the fingers now stand on the object; a finger that kept its direction has rolled along.
        stand = relative(pose, push.pusher[-1])
        hand = there if scene.pusher.turns else replace(there, pose=stand, tips=stand[None, :2])
    assert hand is not None
    away = transits.landing(hand).reversed().segment(scene.pusher, pose)
    segments.append(following(away, segments[-1]))
    return tuple(segments)


def following(segment: Segment, before: PushSegment | TransitSegment) -> Segment:
    """A segment with whole turns added to the pusher's yaw, so that it goes on from the segment before."""
    turns = round(float(before.pusher[-1, 2] - segment.pusher[0, 2]) / (2 * np.pi))
    whole = np.array([0.0, 0.0, 2 * np.pi * turns])
    return segment if turns == 0 else replace(segment, pusher=segment.pusher + whole)


def _push(scene: Scene, leg: Leg, start: Array) -> PushSegment:
    """One push. Its word is kept even where, after rounding, another is cheaper: good plans sit beside jumps."""
    car, push = car_of(leg.option), leg.option.push
    tips = fingertips(push.fingers, push.spacing)
    part = replace(scene, start=start, goal=leg.goal)
    amounts = leg.amounts
    for word in words_of(part, leg.option):
        if word.word == leg.word and np.max(np.abs(word.parameters - leg.amounts)) < SAME:
            amounts = word.parameters
    arcs = arcs_of(car, leg.word, amounts, tips)
    if not scene.pusher.turns:
        return rolling_segment(part, leg.option, arcs)
    return push_segment(part, push.name, car, tips, arcs, start)
