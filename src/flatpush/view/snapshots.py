"""Moments of a plan side by side, as [Zhou2017] Fig. 11."""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..geometry import transform
from ..geometry.pose import Array
from ..problem import Plan, TransitSegment
from . import drawing as d
from . import palette, words
from .drawing import PAGE, SOFT, Drawing, Look
from .figure import check_figure_at
from .legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
from .panel import BOTTOM, LEFT, Panel
from .picture import ENDINGS, save_picture
from .table import MM, draw_fingers, draw_object, draw_workspace, view_box, workspace_entries
from .timeline import Timeline, doing
from .trace import fingers_at, fingertips, trace_pushes

COLUMNS = 4
ABOVE = 24.0  # room for the words above a panel [pt]


def save_snapshots(plan: Plan, path: str | Path, count: int = 8) -> None:
    """Draws a plan as a row of moments into a .svg or .png file, whole or not at all.

    The moments are the start, the end, and between them those that share the object's way evenly; each shows what is
    in the way, where the object is, with its fingers, and the way it has come.

    Args:
        count: how many moments, at least 2.

    Raises:
        InputError: if there are fewer, the ending is another, or the file cannot be written.
    """
    if count < 2:
        raise InputError("snapshots show at least the start and the end", value=count)
    check_snapshots(path)
    save_picture(draw_snapshots(plan, count), path)


def check_snapshots(path: str | Path) -> None:
    """Refuses a name that save_snapshots could not write to.

    Raises:
        InputError: if the ending is another, or the folder does not exist.
    """
    check_figure_at(path, ENDINGS)


def draw_snapshots(plan: Plan, count: int = 8) -> Drawing:
    """The moments in rows of at most four, under one title."""
    timeline = Timeline.of(plan)
    times = moments(timeline, count)
    box = view_box(plan, trace_pushes(plan))
    columns = min(COLUMNS, len(times))
    rows = -(-len(times) // columns)
    aspect = float(np.clip((box[3] - box[1]) / (box[2] - box[0]), 0.3, 2.0))
    title, subtitle = words.plan_title(plan), words.plan_subtitle(plan)
    width = (PAGE - 2 * EDGE - LEFT + 8.0) / columns - 8.0
    height = width * aspect
    top = title_height(title, subtitle)
    below = top + rows * (ABOVE + height) + BOTTOM
    entries = [
        Entry(words.START, Look(palette.START, 0.8, (2.0, 1.5)), "box"),
        Entry(words.GOAL, Look(palette.GOAL, 0.8, (2.0, 1.5)), "box"),
        Entry(words.WAY, Look(palette.push_colour(0) if len(plan.on_table) == 1 else SOFT, 1.4)),
        *([Entry(words.FINGERS_ALONE, Look(palette.PUSHER, 1.0), "line and dot")] if timeline.moves else []),
        *workspace_entries(plan.scene),
    ]
    page = Drawing(PAGE, below + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, below, PAGE - 2 * EDGE)
    for k, time in enumerate(times):
        row, column = divmod(k, columns)
        left, high = EDGE + LEFT + column * (width + 8.0), top + row * (ABOVE + height) + ABOVE
        panel = Panel(page, (left, high, left + width, high + height), box)
        first, last = column == 0, k + columns >= len(times)
        panel.axes("x [mm]" if last else "", "y [mm]" if first else "", (last, first))
        page.add(d.Text(left, high - 13, f"{time:.1f} s", 7.5, d.INK, bold=True), 20)
        what = d.shortened(doing(plan, timeline, float(time)), 7.0, width)
        page.add(d.Text(left, high - 4, what, 7.0, SOFT), 20)
        _moment(panel, plan, timeline, float(time))
    return page


def moments(timeline: Timeline, count: int) -> Array:
    """Instants that share the object's way evenly, the first and the last included [s]."""
    if not timeline.moves:
        return np.zeros(1)
    steps = np.diff(timeline.object, axis=0)
    reach = float(np.ptp(timeline.object[:, :2], axis=0).max()) / (2 * np.pi) + 1e-9
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*steps[:, :2].T) + reach * np.abs(steps[:, 2]))])
    # A hair of time keeps apart what is at rest.
    way += 1e-9 * max(float(way[-1]), 1e-9) * timeline.times
    return np.interp(np.linspace(0.0, way[-1], count), way, timeline.times)


def way_until(plan: Plan, timeline: Timeline, time: float) -> list[tuple[int, Array]]:
    """Each push that has begun: its number, and the way of the centre of friction until a time; it ends at the object.

    Samples may be far apart on a straight, so the pose at the time itself is the last point.
    """
    found: list[tuple[int, Array]] = []
    pose, _, _, now = timeline.at(time)
    for segment, push in enumerate(plan.segments):
        if segment > now or isinstance(push, TransitSegment):
            continue
        gone = timeline.object[(timeline.segment == segment) & (timeline.times <= time)]
        poses = np.concatenate([gone, pose[None]]) if segment == now else gone
        found.append((len(found), transform(poses, plan.scene.object.cof)))
    return found


def _moment(panel: Panel, plan: Plan, timeline: Timeline, time: float) -> None:
    scene = plan.scene
    draw_workspace(panel, scene)
    for pose, colour in ((scene.start_pose, palette.START), (plan.goal_pose, palette.GOAL)):
        draw_object(panel, scene, pose, Look(colour, 0.8, (2.0, 1.5), 0.6), 3)
    pose, pusher, _, number = timeline.at(time)
    colour = SOFT
    for push, way in way_until(plan, timeline, time):
        colour = palette.push_colour(push)
        panel.line(MM * way, Look(colour, 1.4), 7)
    draw_object(panel, scene, pose, Look(colour, 1.3, fill=colour, fill_opacity=0.3), 6)
    panel.disc(MM * transform(pose, scene.object.cof), 1.6, Look(fill=colour), 7)
    if timeline.moves:
        draw_fingers(panel, scene, fingertips(pusher, fingers_at(plan, number)), z=8)
