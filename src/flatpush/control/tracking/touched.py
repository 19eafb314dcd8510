"""Whether a simulated run touched anything but the object with the fingers: the plant knows no obstacles."""

import numpy as np
import shapely

from ...geometry import transform
from ...geometry.pose import Array
from ...problem import Scene
from ..loop.closed_loop import ClosedLoopRun

# Deeper than this counts [m]; circles are polygons to within a tenth of it.
DEPTH = 1e-4


def touched(scene: Scene, fingers: Array, run: ClosedLoopRun) -> str:
    """What first touched an obstacle or went over the bounds in a run, and when; "" if nothing did.

    The object counts at every tick, fingertips while they are on the table.

    Args:
        fingers: centres of the fingertips in E, shape (k, 2) [m].
    """
    bounds, obstacles = scene.workspace.bounds, scene.workspace.obstacles
    radius, down = scene.pusher.tip_radius, np.concatenate([[0.0], run.heights[:-1]]) == 0
    corners = transform(run.object[:, None], scene.object.outline.polyline(0.1 * DEPTH))
    tips = transform(run.pusher[down][:, None], fingers)
    found: list[tuple[float, str]] = []

    def note(what: str, wrong: Array, times: Array) -> None:
        if np.any(wrong):
            found.append((float(times[np.argmax(wrong)]), what))

    things = ("the object", corners, 0.0, run.times), ("a fingertip", tips, radius, run.times[down])
    if bounds is not None:
        for name, points, reach, times in things:
            over = np.maximum(bounds[:2] - points, points - bounds[2:]) + reach
            note(f"{name} went over the bounds", np.max(over, axis=(1, 2)) > DEPTH, times)
    shapes = shapely.polygons(corners)
    for k, outline in enumerate(obstacles):
        obstacle = shapely.Polygon(outline.polyline(0.1 * DEPTH))
        inner = obstacle.buffer(-DEPTH)
        shapely.prepare(inner)
        note(f"the object touched obstacle {k}", shapely.intersects(inner, shapes), run.times)
        near = np.min(shapely.distance(obstacle, shapely.points(tips)), axis=1)
        note(f"a fingertip touched obstacle {k}", near < radius - DEPTH, run.times[down])
    if not found:
        return ""
    time, what = min(found)
    return f"{what} after {time:.2f} s"
