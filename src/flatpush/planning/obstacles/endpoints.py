"""Starts and goals at which the object itself cannot be, told before anything is searched for."""

from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...geometry import Outline, inverse, transform
from ...geometry.collision import Body, World, pose_clearance
from ...geometry.pose import Array
from ...problem import Scene, Workspace

SIDES = ("left", "lower", "right", "upper")
# Rounding of drawings and poses [m].
TOUCHING = 1e-9


def check_endpoints(scene: Scene) -> None:
    """Refuses a start or goal where the object is outside, in an obstacle, or nearer to either than is allowed.

    Raises:
        InputError: names the end, the side or the obstacle (numbered as listed, from 0), and by how much.
    """
    body, every = Body.of(scene.object.outline), World.of(None, scene.workspace.obstacles)
    for key, pose in (("start", scene.start_pose), ("goal", scene.goal_pose)):
        _check_bounds(scene, key, pose)
        if pose_clearance(every, body, pose) >= scene.clearance - TOUCHING:
            continue
        for k, obstacle in enumerate(scene.workspace.obstacles):
            _check_obstacle(scene, key, pose, k, obstacle)


def check_region(scene: Scene) -> None:
    """Refuses a start region of which a part is outside, in an obstacle, or nearer to either than is allowed.

    Raises:
        InputError: names the side or the obstacle.
    """
    from ...simulation.tube import region_clearance

    known, space, need = scene.object.uncertainty, scene.workspace, scene.planning.clearance
    if known is None or known.start is None:
        return
    things = [(f"obstacle {k}", Workspace(None, [o])) for k, o in enumerate(space.obstacles)]
    if space.bounds is not None:
        things.append(("the bounds", Workspace(space.bounds)))
    for name, alone in things:
        room = region_clearance(replace(scene, workspace=alone), known.start)
        if room is not None and room < need - TOUCHING:
            raise InputError(
                f"somewhere in the start region the object is {1000 * room:.2f} mm from {name}, and"
                f" {1000 * need:.2f} mm are asked for"
                if room > 0
                else f"somewhere in the start region the object overlaps or leaves {name}",
                key="object.uncertainty.start",
                hint="A smaller region, or a start further away, would do.",
            )


def _check_bounds(scene: Scene, key: str, pose: Array) -> None:
    if scene.workspace.bounds is None:
        return
    outline, need = scene.object.outline, scene.clearance
    if outline.is_circle:
        centre = transform(pose, outline.centre)
        low, high = centre - outline.radius, centre + outline.radius
    else:
        corners = transform(pose, outline.vertices)
        low, high = corners.min(axis=0), corners.max(axis=0)
    xmin, ymin, xmax, ymax = scene.workspace.bounds
    rooms = np.array([low[0] - xmin, low[1] - ymin, xmax - high[0], ymax - high[1]])
    worst = int(np.argmin(rooms))
    if rooms[worst] < need - TOUCHING:
        _refuse(scene, key, float(rooms[worst]), f"the {SIDES[worst]} side of the bounds", "is outside")


def _check_obstacle(scene: Scene, key: str, pose: Array, k: int, obstacle: Outline) -> None:
    outline, need = scene.object.outline, scene.clearance
    room = pose_clearance(World.of(None, [obstacle]), Body.of(outline), pose)
    if room >= need - TOUCHING:
        return
    name = f"obstacle {k}"
    if np.isfinite(room) and room > -TOUCHING:
        _refuse(scene, key, max(room, 0.0), name, "")
    there = [outline.nearest(p).distance for p in transform(inverse(pose), obstacle.polyline())]
    here = [obstacle.nearest(p).distance for p in transform(pose, outline.polyline())]
    _refuse(scene, key, min(*there, *here, 0.0), name, "overlaps")


def _refuse(scene: Scene, key: str, room: float, what: str, verb: str) -> None:
    """The complaint: by how much the object is over something, or how much less clearance it has than it should."""
    need = 1000 * scene.clearance
    if room < -TOUCHING:
        text = f"{verb} {what} by {-1000 * room:.2f} mm"
    elif verb == "overlaps":
        text = f"crosses {what}"
    else:
        text = (
            f"is {1000 * max(room, 0.0):.2f} mm from {what}, and {need:.2f} mm are asked for{_offset(scene)}"
        )
    raise InputError(f"at the {key} the object {text}", key=key)


def _offset(scene: Scene) -> str:
    """What a set of tables adds to the clearance, in words."""
    more = 1000 * (scene.clearance - scene.planning.clearance)
    return f", {more:.2f} mm of them for the object's offset along the fingers" if more > 0 else ""
