"""What figures draw on the table: workspace, object, fingers, start and goal."""

from collections.abc import Iterable, Sequence

import numpy as np

from ..geometry import transform
from ..geometry.pose import Array
from ..problem import Plan, Rollout, Scene
from . import drawing as d
from . import palette, words
from .drawing import Box, Drawing, Look
from .labels import Labels, beside, dense
from .legend import Entry
from .panel import Panel
from .trace import PushTrace, fingertips, orientation_mark

MM = 1e3
LABEL_STEPS = 200  # of what is drawn, from side to side: no label slips between two points of a line


def view_box(plan: Plan, traces: Sequence[PushTrace], rollouts: Sequence[Rollout] = ()) -> Box:
    """What the drawing must show, with a border: xmin, ymin, xmax, ymax [mm]."""
    scene = plan.scene
    tip = scene.pusher.tip_radius
    shown = [outline_at(scene, scene.start_pose), outline_at(scene, plan.goal_pose)]
    shown += [obstacle.polyline() for obstacle in scene.workspace.obstacles]
    if scene.workspace.bounds is not None:
        shown.append(np.reshape(scene.workspace.bounds, (2, 2)))
    for trace in traces:
        tips = fingertips(trace.pushers, trace.segment.fingers).reshape(-1, 2)
        shown += [outline_at(scene, pose) for pose in trace.marks] + [tips - tip, tips + tip]
        shown += [] if trace.flat_path is None else [trace.flat_path]
    shown += [outline_at(scene, rollout.final_pose) for rollout in rollouts]
    points = MM * np.concatenate(shown)
    low, high = points.min(axis=0), points.max(axis=0)
    border = 0.03 * float(np.max(high - low)) + 0.06 * MM * scene.object.outline.size
    return (
        float(low[0] - border), float(low[1] - border), float(high[0] + border), float(high[1] + border),
    )  # fmt: skip


def outline_at(scene: Scene, pose: Array) -> Array:
    """The object's outline on the table, shape (n, 2) [m]."""
    return transform(pose, scene.object.outline.polyline())


def draw_workspace(panel: Panel, scene: Scene) -> None:
    """Bounds and obstacles."""
    if scene.workspace.bounds is not None:
        panel.area(MM * corners_of(scene.workspace.bounds), BOUNDS, 1)
    for obstacle in scene.workspace.obstacles:
        panel.area(MM * obstacle.polyline(), OBSTACLE, 1)


def workspace_entries(scene: Scene) -> list[Entry]:
    """What the legend says of bounds and obstacles."""
    entries = [] if scene.workspace.bounds is None else [Entry(words.BOUNDS, BOUNDS)]
    return entries + ([Entry(words.OBSTACLE, OBSTACLE, "box")] if scene.workspace.obstacles else [])


BOUNDS = Look(palette.BOUNDS, 1.4)
OBSTACLE = Look(palette.OBSTACLE, 0.9, fill=palette.OBSTACLE, fill_opacity=0.14, hatch=True)


def draw_object(panel: Panel, scene: Scene, pose: Array, look: Look, z: float = 3.0) -> None:
    """The outline at a pose."""
    panel.area(MM * outline_at(scene, pose), look, z)


def draw_fingers(panel: Panel, scene: Scene, tips: Array, opacity: float = 1.0, z: float = 5.0) -> None:
    """Fingertips (k, 2) in W [m] as discs, and the line between two."""
    if len(tips) == 2:
        panel.line(MM * tips, Look(palette.PUSHER, 1.0, opacity=opacity), z)
    for tip in tips:
        panel.disc(MM * tip, tip_size(panel, scene), Look(fill=palette.PUSHER, fill_opacity=opacity), z)


def tip_size(panel: Panel, scene: Scene) -> float:
    """Radius of a fingertip on the page [pt], never too small to be seen."""
    return max(panel.length(MM * scene.pusher.tip_radius), 1.2)


def draw_endpoints(panel: Panel, plan: Plan, labels: Labels | None = None) -> None:
    """The object at start (black) and goal (blue) with their names, and marks of how it is to be turned."""
    scene = plan.scene
    together = bool(np.allclose(scene.start_pose, plan.goal_pose))
    endpoints = [(words.GOAL, plan.goal_pose, palette.GOAL), (words.START, scene.start_pose, palette.START)]
    for name, pose, colour in [(words.BOTH, plan.goal_pose, palette.GOAL)] if together else endpoints:
        draw_object(panel, scene, pose, Look(colour, 1.7, fill=colour, fill_opacity=0.10), 6)
        mark = MM * transform(pose, orientation_mark(scene))
        if name == words.START or not scene.free_angle:
            panel.line(mark, Look(colour, 1.3), 6)
        panel.disc(mark[0], 2.0, Look(fill=colour), 6)
        if labels is not None:
            width, height = d.text_width(name, 9.0, bold=True), 9.0
            place = labels.place(width, height, beside(panel, MM * outline_at(scene, pose), width, height))
            panel.page.add(
                d.Text(float(place[0]), float(place[1]) + 3.2, name, 9.0, colour, "middle", True, True), 9.5
            )


def draw_number(page: Drawing, place: Array, number: int) -> None:
    """The number of a push on a disc in its colour."""
    page.add(d.Disc(place, 6.2, Look("#ffffff", 0.8, fill=palette.push_colour(number))), 9)
    size = 7.5 if number < 99 else 6.0
    page.add(
        d.Text(
            float(place[0]), float(place[1]) + 0.36 * size, str(number + 1), size, "#ffffff", "middle", True
        ),
        9.1,
    )


def what_is_drawn(plan: Plan, traces: Iterable[PushTrace]) -> Array:
    """Points of all lines of a plan [mm], shape (n, 2), for labels to keep off."""
    scene = plan.scene
    poses = [scene.start_pose, plan.goal_pose, *(pose for trace in traces for pose in trace.marks)]
    lines = [_closed(outline_at(scene, pose)) for pose in poses]
    lines += [trace.flat_path for trace in traces if trace.flat_path is not None]
    lines += [_closed(obstacle.polyline()) for obstacle in scene.workspace.obstacles]
    if scene.workspace.bounds is not None:
        lines.append(_closed(corners_of(scene.workspace.bounds)))
    step = float(np.max(np.ptp(np.concatenate(lines), axis=0))) / LABEL_STEPS
    found = [dense(line, step) for line in lines]
    for trace in traces:
        found.append(fingertips(trace.pushers, trace.segment.fingers).reshape(-1, 2))
        found += [centre[None] for centre, _ in trace.centres]
    return MM * np.concatenate(found)


def corners_of(box: Sequence[float]) -> Array:
    """The corners (4, 2) of a box xmin, ymin, xmax, ymax."""
    x0, y0, x1, y1 = box
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _closed(corners: Array) -> Array:
    return np.concatenate([corners, corners[:1]])
