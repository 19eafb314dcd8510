"""The query of a scene with something in the way, and why nothing can begin or end."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...geometry import transform
from ...geometry.collision import Body, World
from ...geometry.pose import Array
from ...problem import Scene
from ...steering.fleet import Fleet
from ..options import PushOption
from ..query import Query
from ..transits import LEAST_GAP

# More than is asked for, since the judge's clearance is a lower bound, at most 10 µm below the true one [m].
SPARE = 1.5e-5


def query_of(scene: Scene, options: Sequence[PushOption], fleet: Fleet, goal: Array | None = None) -> Query:
    """What is asked of a search among a scene's obstacles with pushes that have cars.

    Args:
        goal: the pose X_WO to search for, shape (3,); by default the scene's, which must not leave the angle open.
    """
    pusher = scene.pusher
    placements = [option.placement for option in options if option.placement is not None]
    backs = [transform([0.0, 0.0, p.pose[2]], [-pusher.approach, 0.0]) for p in placements]
    return Query(
        fleet,
        scene.start_pose,
        scene.goal_pose if goal is None else goal,
        World.of(scene.workspace.bounds, scene.workspace.obstacles),
        [Body.of(scene.object.outline, p.tips, pusher.tip_radius) for p in placements],
        np.array(backs),
        scene.clearance + SPARE,
        free=bool(scene.goal_slack[2] >= np.pi),
        slack=scene.goal_slack,
        robust=scene.planning.robust,
    )


def careful(scene: Scene, query: Query) -> Query:
    """The same with so much room about every change of push that the hand finds its way from any contact to any."""
    if scene.pusher.transit == "lift":
        return replace(query, inside=True)
    gap = max(scene.clearance, LEAST_GAP)
    return replace(query, room=2.05 * float(np.max(query.arrays.hands["reach"])) + 2 * gap + scene.clearance)


def obstructions(scene: Scene, query: Query, options: Sequence[PushOption]) -> str:
    """Why no push can begin at the start, or end at the goal; empty where some can."""
    from ...geometry.collision import pose_clearance

    need = scene.clearance
    for name, pose, able in (("start", query.start, query.first), ("goal", query.goal, query.last)):
        if able:
            continue
        alone = pose_clearance(query.world, Body.of(query.bodies[0].outline), pose)
        if alone < need:
            has = "touches or overlaps something" if alone <= 0 else f"has {1000 * alone:.2f} mm of clearance"
            return f"at the {name} the object {has}, {1000 * need:.2f} mm are asked for."
        reasons = []
        for a, option in enumerate(options):
            room = pose_clearance(query.world, query.bodies[a], pose)
            what = "have no room" if room < query.clearance else "do not land clear of obstacles and bounds"
            reasons.append(f"{option.push.name}: its fingers {what}")
        verb = "begin" if name == "start" else "end"
        lines = [f"no push can {verb} at the {name}; more room there, or pushes at other places, would help."]
        return "\n".join(lines + reasons)
    return ""
