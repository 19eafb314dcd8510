"""The task of a scene, and why it cannot be done."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...geometry import transform
from ...geometry.collision import Body, World
from ...problem import Scene
from ...steering.fleet import Fleet
from ..options import PushOption
from ..transits import LEAST_GAP
from .task import Task

# More than is asked for, since the judge's clearance is a lower bound, at most 10 µm below the true one [m].
SPARE = 1.5e-5


def task_of(scene: Scene, options: Sequence[PushOption], fleet: Fleet) -> Task:
    """What is asked of a search among a scene's obstacles with pushes that have cars."""
    pusher = scene.pusher
    placements = [option.placement for option in options if option.placement is not None]
    backs = [transform([0.0, 0.0, p.pose[2]], [-pusher.approach, 0.0]) for p in placements]
    return Task(
        fleet,
        World.of(scene.workspace.bounds, scene.workspace.obstacles),
        [Body.of(scene.object.outline, p.tips, pusher.tip_radius) for p in placements],
        np.array(backs),
        scene.start_pose,
        scene.goal_pose,
        scene.planning.clearance + SPARE,
    )


def careful(scene: Scene, task: Task) -> Task:
    """The same with so much room about every change of push that the hand finds its way from any contact to any."""
    if scene.pusher.transit == "lift":
        return replace(task, inside=True)
    gap = max(scene.planning.clearance, LEAST_GAP)
    return replace(
        task, room=2.05 * float(np.max(task.arrays.hands["reach"])) + 2 * gap + scene.planning.clearance
    )


def obstructions(scene: Scene, task: Task, options: Sequence[PushOption]) -> str:
    """Why no push can begin at the start, or end at the goal; empty where some can."""
    from ...geometry.collision import pose_clearance

    need = scene.planning.clearance
    for name, pose, able in (("start", task.start, task.first), ("goal", task.goal, task.last)):
        if able:
            continue
        alone = pose_clearance(task.world, Body.of(task.bodies[0].outline), pose)
        if alone < need:
            has = "touches or overlaps something" if alone <= 0 else f"has {1000 * alone:.2f} mm of clearance"
            return f"at the {name} the object {has}, {1000 * need:.2f} mm are asked for. "
        reasons = []
        for a, option in enumerate(options):
            room = pose_clearance(task.world, task.bodies[a], pose)
            what = "have no room" if room < task.clearance else "do not land clear of obstacles and bounds"
            reasons.append(f"{option.push.name}: its fingers {what}")
        verb = "begin" if name == "start" else "end"
        return f"no push can {verb} at the {name}. {' · '.join(reasons)}. "
    return ""
