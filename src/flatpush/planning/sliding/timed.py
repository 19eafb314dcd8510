"""Slides as the segments of a plan: each with its times, the transits between, and how far it may end elsewhere."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...geometry import inverse, relative, rotate, transform, wrap_angle
from ...geometry.collision import World
from ...geometry.pose import Array
from ...problem import Scene, Segment, SlideSegment
from ...simulation.slides import plant_of_slides, slide_sensitivity
from ..assembly import following
from ..transits import PusherPath
from .exact import SWITCH, TRIES, SlidePlan, SlidePlanner, SlidePush

ANGLES = 8  # at the goal that are tried where it leaves the angle open


def slide_planner(scene: Scene) -> SlidePlanner:
    """The planner of slides for a scene's object, finger, bounds and obstacles."""
    workspace, planning = scene.workspace, scene.planning
    crowded = workspace.bounds is not None or len(workspace.obstacles)
    return SlidePlanner(
        plant_of_slides(scene),
        World.of(workspace.bounds, workspace.obstacles) if crowded else None,
        planning.clearance,
        scene.pusher.transit == "planar",
        SWITCH if planning.cost == "time" else planning.switching,
        scene.pusher,
    )


def slide_plans(planner: SlidePlanner, scene: Scene, tip: Array | None = None) -> Iterator[SlidePlan]:
    """Plans from a scene's start to its goal, each cheaper than the one before.

    Args:
        tip: where the fingertip is on the table, (2,); None: it lands.
    """
    if not scene.free_angle:
        yield from planner.plans(scene.start_pose, scene.goal_pose, tip=tip)
        return
    least, turns = np.inf, 2 * np.pi * np.arange(ANGLES) / ANGLES
    for turn in turns if planner.turns else turns[:1]:
        goal = np.array([*scene.goal_pose[:2], scene.start_pose[2] + turn])
        for found in planner.plans(scene.start_pose, goal, max(1, TRIES // 2), tip):
            if found.cost < least:
                least = found.cost
                yield found


def slide_segments(
    scene: Scene, pushes: Sequence[SlidePush], before: Array | None = None
) -> tuple[Segment, ...]:
    """The segments of slides from a scene's start, with the way of the finger before, between and after them.

    Args:
        before: X_WE where the hand is on the table, (3,); None: it lands.
    """
    segments: list[Segment] = []
    yaw = float(np.arctan2(*(pushes[0].tip[-1] - pushes[0].tip[0])[::-1]))
    pose = scene.start_pose
    for number, push in enumerate(pushes, start=1):
        if scene.pusher.turns:
            yaw = float(np.arctan2(*(push.tip[-1] - push.tip[0])[::-1]))
        if before is None:  # later ones follow it
            yaw = float(pose[2] + wrap_angle(yaw - pose[2]))
        hand = np.column_stack([push.tip, np.full(len(push.tip), yaw)])
        way = _way(scene, pose, before, hand[0], push.way)
        transit = way.segment(scene.pusher, pose)
        segments.append(following(transit, segments[-1]) if segments else transit)
        assert push.times is not None
        slide = SlideSegment(
            f"slide {number}", push.times, push.object, hand, np.zeros((1, 2)), push.object[-1], {}
        )
        slide = replace(slide, sensitivity=slide_sensitivity(scene, slide))
        slide = following(slide, segments[-1])
        segments.append(slide)
        pose, before = push.object[-1], slide.pusher[-1]
    assert before is not None
    away = leaving(scene, pose, before)
    last = PusherPath(relative(pose, away[0]), away[1], 0.0).segment(scene.pusher, pose)
    return (*segments, following(last, segments[-1]))


def _way(scene: Scene, pose: Array, before: Array | None, begin: Array, around: Array | None) -> PusherPath:
    """From where the finger left off (None: from above) to where a slide begins, beside the object at rest."""
    if before is None:
        poses, heights = (a[::-1] for a in _risen(scene, begin[None]))
    elif around is not None:
        share = np.linspace(0.0, 1.0, len(around))
        turned = before[2] + share * wrap_angle(begin[2] - before[2])
        poses, heights = np.column_stack([around, turned]), np.zeros(len(around))
    else:
        poses, heights = leaving(scene, pose, before)
        end = np.array([*begin[:2], before[2] + wrap_angle(begin[2] - before[2])])
        poses, heights = np.concatenate([poses, [end, end]]), np.concatenate([heights, heights[-1:], [0.0]])
    return PusherPath(relative(pose, poses), heights, 0.0)


def leaving(scene: Scene, pose: Array, hand: Array) -> tuple[Array, Array]:
    """Poses X_WE (n, 3) and heights (n,) of a hand after a slide that left the object at X_WO, both (3,)."""
    return _risen(scene, _away(scene, pose, hand))


def _risen(scene: Scene, poses: Array) -> tuple[Array, Array]:
    """Poses on the table, and the last of them lifted as well where the pusher lifts; with heights."""
    if scene.pusher.transit == "planar":
        return poses, np.zeros(len(poses))
    return np.concatenate([poses, poses[-1:]]), np.append(np.zeros(len(poses)), scene.pusher.lift)


def _away(scene: Scene, pose: Array, hand: Array) -> Array:
    """The hand after a slide, and away from the outline by the approach distance where there is room, (1 or 2, 3)."""
    outline, need = scene.object.outline, scene.pusher.tip_radius + scene.pusher.approach
    near = outline.nearest(transform(inverse(pose), hand[:2]))
    missing = need - near.distance
    if missing <= 0:
        return hand[None]
    back = np.array([*(hand[:2] - missing * rotate(pose[2], near.normal)), hand[2]])
    there = outline.nearest(transform(inverse(pose), back[:2])).distance
    return np.stack([hand, back]) if there >= need - 1e-9 else hand[None]
