"""Moments of a plan side by side, as [Zhou2017] Fig. 11."""

from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from ..documents.atomic import write_atomically
from ..errors import InputError
from ..geometry.pose import Array
from ..problem import Plan, PushSegment
from . import palette
from .canvas import SOFT, drawing_style, figure_bytes, headline, new_figure, table_axes
from .figure import check_figure_at
from .plan_figure import MM, draw_fingers, draw_object, draw_workspace, view_box
from .timeline import Timeline, doing
from .trace import PushTrace, fingertips, trace_pushes
from .words import plan_subtitle, plan_title

ENDINGS = (".svg", ".png")
COLUMNS = 4
WIDTH = 8.0  # inches
ROOM = 36  # letters above a panel


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
    write_atomically(path, draw_snapshots(plan, Path(path).suffix.lower(), count))


def check_snapshots(path: str | Path) -> None:
    """Refuses a name that save_snapshots could not write to.

    Raises:
        InputError: if the ending is another, or the folder does not exist.
    """
    check_figure_at(path, ENDINGS)


def draw_snapshots(plan: Plan, extension: str, count: int = 8) -> bytes:
    """The picture as ".png" or ".svg"."""
    timeline, traces = Timeline.of(plan), trace_pushes(plan)
    times = moments(timeline, count)
    box = view_box(plan, traces)
    columns = min(COLUMNS, len(times))
    rows = -(-len(times) // columns)
    aspect = (box[3] - box[1]) / (box[2] - box[0])
    with drawing_style():
        panel = 0.86 * WIDTH / columns * float(np.clip(aspect, 0.3, 2.5))
        figure = new_figure(WIDTH, 1.0 + rows * (0.45 + panel))
        headline(figure, plan_title(plan), plan_subtitle(plan))
        for k, time in enumerate(times):
            axes = table_axes(figure.add_subplot(rows, columns, k + 1))
            left, bottom = k % columns == 0, k + columns >= len(times)
            axes.set(xlim=box[::2], ylim=box[1::2])
            axes.set_xlabel("x [mm]" if bottom else "", fontsize=7)
            axes.set_ylabel("y [mm]" if left else "", fontsize=7)
            axes.tick_params(labelsize=6.5, labelleft=left, labelbottom=bottom)
            axes.set_aspect("equal")
            what = shorten(doing(plan, timeline, time), ROOM, placeholder=" …")
            axes.set_title(f"{time:.1f} s\n{what}", fontsize=7, color=SOFT, loc="left")
            _moment(axes, plan, timeline, traces, time)
        return figure_bytes(figure, extension, plan_title(plan))


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


def _moment(axes: Any, plan: Plan, timeline: Timeline, traces: tuple[PushTrace, ...], time: float) -> None:
    scene = plan.scene
    draw_workspace(axes, scene)
    for pose, colour in ((scene.start_pose, palette.START), (scene.goal_pose, palette.GOAL)):
        draw_object(axes, scene, pose, colour, linewidth=0.8, alpha=0.6, zorder=3, linestyle=(0, (2, 1.5)))
    pose, pusher, _, number = timeline.at(time)
    passed = [i for i, s in enumerate(plan.segments) if isinstance(s, PushSegment)]
    colour = SOFT
    for trace, segment in zip(traces, passed, strict=True):
        if segment > number:
            break
        colour = palette.push_colour(trace.number)
        here = timeline.segment == segment
        gone = timeline.object[here & (timeline.times <= time)]
        if len(gone):
            axes.plot(*(MM * gone[:, :2]).T, color=colour, linewidth=1.4, zorder=4)
    draw_object(axes, scene, pose, colour, fill=0.35, linewidth=1.4, zorder=6)
    if timeline.moves:
        fingers = _fingers(plan, number)
        draw_fingers(axes, scene, fingertips(pusher, fingers), palette.PUSHER, zorder=7)


def _fingers(plan: Plan, number: int) -> Array:
    """The fingertips in E of the push that a segment is, or leads to, or comes from."""
    for segment in (*plan.segments[number:], *plan.segments[number::-1]):
        if isinstance(segment, PushSegment):
            return segment.fingers
    return np.zeros((0, 2))
