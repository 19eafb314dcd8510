"""Slides of a plan, rolled out again: where they end, and how far elsewhere if something differs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..geometry import pose_error, transform, wrap_angle
from ..geometry.pose import Array
from ..problem import Plan, Scene, Segment, SlideSegment
from ..problem.mechanics import true_surface
from .plant import Plant, PlantRun
from .rollout import roll

# By so much the start and the centre of friction differ, by the outline's size, or the start by its angle [rad], and
# the friction between finger and object: small against what a real setup is off by, large against rounding.
ASIDE, TURNED, SLIPPERIER = 1e-3, 1e-3, 1e-2
DIRECTIONS = 8


def plant_of_slides(scene: Scene) -> Plant:
    """The object as believed, and one finger at its hand's origin."""
    return Plant(scene.object, [[0.0, 0.0]], scene.pusher.tip_radius)


def rolled_out(plant: Plant, pose: Array, hand: Array) -> PlantRun:
    """A slide from where the object is, X_WO (3,), under poses of the hand (n, 3)."""
    return plant.follow(pose, hand, push_out=False)


def sensitivity_of(scene: Scene, segments: Sequence[Segment]) -> dict[str, float] | None:
    """How far segments with slides end elsewhere, at the outline's farthest point; see Certificate.sensitivity.

    By differences of rollouts from the scene's start; None for segments without a slide.
    """
    if not any(isinstance(s, SlideSegment) for s in segments):
        return None
    size = scene.object.outline.size
    # Known, so that it is the same about every centre of friction, and worked out once.
    thing = replace(scene.object, surface=true_surface(scene.object), uncertainty=None)
    scene = replace(scene, object=thing)
    angles = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    around = ASIDE * size * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    frictions = {thing.friction + SLIPPERIER, max(0.0, thing.friction - SLIPPERIER)} - {thing.friction}
    changed = {
        "place": [replace(scene, start=scene.start_pose + np.append(off, 0.0)) for off in around],
        "turn": [replace(scene, start=scene.start_pose + np.array([0, 0, t])) for t in (-TURNED, TURNED)],
        "friction": [replace(scene, object=replace(thing, friction=mu)) for mu in sorted(frictions)],
        "centre": [replace(scene, object=replace(thing, support=thing.support.translated(off))) for off in around],
    }  # fmt: skip
    by = {"place": ASIDE * size, "turn": TURNED, "friction": SLIPPERIER, "centre": ASIDE * size}
    scenes = [scene, *(other for others in changed.values() for other in others)]
    rolled = roll(Plan("solved", scene, segments=tuple(segments)), scenes, "exact", "arcs")
    outline, first, found = thing.outline.polyline(), 1, {}
    there = transform(rolled.final[0], outline)
    for name, others in changed.items():
        ends = transform(rolled.final[first : first + len(others), None], outline)
        found[name] = float(np.max(np.linalg.norm(ends - there, axis=2))) / by[name]
        first += len(others)
    return found


def slide_sensitivity(scene: Scene, slide: SlideSegment) -> dict[str, float]:
    """Of one slide alone, from where it begins."""
    x, y, angle = slide.object[0]
    found = sensitivity_of(replace(scene, start=(x, y, wrap_angle(angle))), (slide,))
    assert found is not None
    return found


def beside(run: PlantRun, poses: Array) -> tuple[Array, Array]:
    """How far poses (n, 3) are from those of a run, distances and angles, each (n,) [m, rad]."""
    error = np.abs(pose_error(run.object, poses))
    return np.hypot(error[:, 0], error[:, 1]), error[:, 2]
