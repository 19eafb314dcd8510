"""The picture of a plan: outlines at even travel, fingers, flat path, cones ([Zhou2017] Figs. 3, 6)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import rotate, transform
from ..geometry.pose import Array
from ..problem import Plan, Rollout, Scene, TransitSegment
from . import palette
from .canvas import (
    SOFT,
    Box,
    drawing_style,
    figure_bytes,
    headline,
    legend_below,
    new_figure,
    settle,
    table_axes,
)
from .label import along_edges, halo, room_for_label
from .trace import PushTrace, fingertips, orientation_mark, rollout_paths, trace_pushes
from .words import plan_subtitle, plan_title, push_label

MM = 1e3
TREE = "#8a93a0"
MOST_EDGES = 900  # of the search tree that are drawn


def draw_plan(
    plan: Plan, extension: str, rollouts: Sequence[Rollout] = (), explored: Array | None = None
) -> bytes:
    """The picture of a plan as ".png" or ".svg", with simulated runs over it in red dashes, and the search tree.

    Args:
        explored: paths of the tree's edges, shape (m, k, 2) [m], drawn faintly beneath everything.
    """
    tree = explored is not None and len(explored) > 0
    with drawing_style():
        figure = new_figure()
        axes = table_axes(figure.add_subplot())
        traces = trace_pushes(plan)
        headline(figure, plan_title(plan), plan_subtitle(plan))
        _legend(figure, plan, traces, bool(rollouts), tree)
        settle(figure, [(axes, view_box(plan, traces, rollouts))])
        if explored is not None and tree:
            _draw_tree(axes, explored)
        draw_workspace(axes, plan.scene)
        for trace in traces:
            _draw_push(axes, plan, trace)
        _draw_transits(axes, plan)
        draw_ends(axes, plan, traces)
        for trace in traces[:1]:
            _draw_cones(axes, plan.scene, trace)
        for rollout in rollouts:
            _draw_rollout(axes, plan, rollout, traces, faint=len(rollouts) > 3)
        return figure_bytes(figure, extension, plan_title(plan))


def view_box(plan: Plan, traces: Sequence[PushTrace], rollouts: Sequence[Rollout] = ()) -> Box:
    """What the drawing must show, with a border: xmin, ymin, xmax, ymax [mm]."""
    scene = plan.scene
    tip = scene.pusher.tip_radius
    shown = [_outline(scene, scene.start_pose), _outline(scene, scene.goal_pose)]
    shown += [obstacle.polyline() for obstacle in scene.workspace.obstacles]
    if scene.workspace.bounds is not None:
        shown.append(np.reshape(scene.workspace.bounds, (2, 2)))
    for trace in traces:
        tips = fingertips(trace.pushers, trace.segment.fingers).reshape(-1, 2)
        shown += [_outline(scene, pose) for pose in trace.marks] + [tips - tip, tips + tip]
        shown += [] if trace.flat_path is None else [trace.flat_path]
    shown += [_outline(scene, rollout.final_pose) for rollout in rollouts]
    points = MM * np.concatenate(shown)
    low, high = points.min(axis=0), points.max(axis=0)
    border = 0.04 * float(np.max(high - low)) + 0.1 * MM * scene.object.outline.size
    return (low[0] - border, low[1] - border, high[0] + border, high[1] + border)


def draw_workspace(axes: Any, scene: Scene) -> None:
    """Bounds and obstacles."""
    from matplotlib.patches import Polygon, Rectangle

    if scene.workspace.bounds is not None:
        x0, y0, x1, y1 = MM * np.asarray(scene.workspace.bounds)
        axes.add_patch(
            Rectangle(
                (x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=palette.BOUNDS, linewidth=1.6, zorder=1
            )
        )
    for obstacle in scene.workspace.obstacles:
        corners = MM * obstacle.polyline()
        axes.add_patch(Polygon(corners, facecolor=palette.OBSTACLE, alpha=0.16, linewidth=0, zorder=1))
        axes.add_patch(
            Polygon(corners, fill=False, edgecolor=palette.OBSTACLE, hatch="////", linewidth=1.0, zorder=1)
        )


def draw_ends(axes: Any, plan: Plan, traces: Sequence[PushTrace]) -> None:
    """The object at start (black) and goal (blue), each with its name and a mark of how it is turned."""
    scene = plan.scene
    cloud = MM * np.concatenate(
        [along_edges(_outline(scene, pose)) for pose in (scene.start_pose, scene.goal_pose)]
        + [_outline(scene, pose) for trace in traces for pose in trace.marks]
        + [trace.flat_path for trace in traces if trace.flat_path is not None]
        + [fingertips(trace.pushers, trace.segment.fingers).reshape(-1, 2) for trace in traces]
        + [np.reshape([centre for centre, _ in trace.centres], (-1, 2)) for trace in traces]
    )
    together = bool(np.allclose(scene.start_pose, scene.goal_pose))
    ends = [("goal", scene.goal_pose, palette.GOAL), ("start", scene.start_pose, palette.START)]
    if together:
        ends = [("start = goal", scene.goal_pose, palette.GOAL)]
    for name, pose, colour in ends:
        draw_object(axes, scene, pose, colour, fill=0.10, linewidth=2.0, zorder=6)
        mark = MM * transform(pose, orientation_mark(scene))
        axes.plot(*mark.T, color=colour, linewidth=1.6, zorder=6, solid_capstyle="round")
        axes.plot(*mark[0], "o", color=colour, markersize=4.5, zorder=6)
        place = room_for_label(axes, MM * _outline(scene, pose), cloud)
        axes.text(
            *place,
            name,
            color=colour,
            weight="bold",
            fontsize=10,
            ha="center",
            va="center",
            zorder=9,
            **halo(),
        )
        cloud = np.concatenate([cloud, place[None]])


def draw_object(axes: Any, scene: Scene, pose: Array, colour: str, fill: float = 0.0, **line: Any) -> Any:
    """The outline at a pose; fill is the opacity of its inside. Returns the patch of the edge."""
    from matplotlib.patches import Polygon

    corners = MM * _outline(scene, pose)
    if fill:
        zorder = line.get("zorder", 3) - 3
        axes.add_patch(Polygon(corners, facecolor=colour, alpha=fill, linewidth=0, zorder=max(zorder, 1.5)))
    return axes.add_patch(Polygon(corners, fill=False, edgecolor=colour, joinstyle="round", **line))


def draw_fingers(
    axes: Any, scene: Scene, tips: Array, colour: str, alpha: float = 1.0, zorder: float = 5
) -> None:
    """Fingertips (k, 2) in W as discs, and the line between two."""
    from matplotlib.patches import Circle

    radius = MM * max(scene.pusher.tip_radius, 0.008 * scene.object.outline.size)
    axes.plot(*(MM * tips).T, color=colour, linewidth=1.1, alpha=alpha, zorder=zorder)
    for tip in MM * tips:
        axes.add_patch(
            Circle(
                tip, radius, facecolor=colour, edgecolor="white", linewidth=0.3, alpha=alpha, zorder=zorder
            )
        )


def _draw_tree(axes: Any, explored: Array) -> None:
    """Edges of the search tree, by the path of the centre of friction; some of them where there are many."""
    from matplotlib.collections import LineCollection

    some = MM * explored[:: max(1, -(-len(explored) // MOST_EDGES))]
    axes.add_collection(
        LineCollection(list(some), colors=TREE, linewidths=0.5, alpha=0.4, zorder=0.9), autolim=False
    )


def _draw_push(axes: Any, plan: Plan, trace: PushTrace) -> None:
    scene, colour = plan.scene, palette.push_colour(trace.number)
    last = len(trace.marks) - 1
    for index, (pose, pusher) in enumerate(zip(trace.marks, trace.pushers, strict=True)):
        switch = index == 0 and trace.number > 0
        look = {"linewidth": 1.7, "alpha": 1.0, "zorder": 5} if switch else {"linewidth": 0.8, "alpha": 0.45}
        if index < last:
            draw_object(axes, scene, pose, colour, fill=0.10 if switch else 0.035, **look)
        ends = index in (0, last)
        draw_fingers(
            axes, scene, fingertips(pusher, trace.segment.fingers), palette.PUSHER, 0.95 if ends else 0.4
        )
    axes.plot(
        *(MM * trace.segment.pusher[:, :2]).T, color=palette.PUSHER, linewidth=0.7, alpha=0.55, zorder=4
    )
    for centre, sense in trace.centres:
        axes.plot(
            *(MM * centre), "o", mfc="white", mec=colour, markersize=7.5, mew=0.9, alpha=0.8, zorder=3.5
        )
        sign = "+" if sense > 0 else "_"
        axes.plot(*(MM * centre), marker=sign, color=colour, markersize=4, mew=0.9, alpha=0.8, zorder=3.6)
    if trace.flat_path is not None and trace.contact is not None:
        for pose, place in ((trace.marks[0], trace.flat_path[0]), (trace.marks[-1], trace.flat_path[-1])):
            lever = MM * np.stack([transform(pose, trace.contact), place])
            axes.plot(*lever.T, color=colour, linewidth=0.9, linestyle=(0, (1, 1.6)), zorder=6.8)
    if trace.flat_path is not None:
        path = MM * trace.flat_path
        axes.plot(*path.T, color="white", linewidth=3.8, alpha=0.8, zorder=6.9, solid_capstyle="round")
        axes.plot(*path.T, color=colour, linewidth=2.2, zorder=7, solid_capstyle="round")
        _arrow_head(axes, path, colour)
        axes.plot(*path[0], "o", color=colour, mec="white", mew=0.8, markersize=5.5, zorder=7.2)
    if len(plan.pushes) > 1:
        where = (
            trace.flat_path[0] if trace.flat_path is not None else transform(trace.marks[0], scene.object.cof)
        )
        axes.text(
            *(MM * where), str(trace.number + 1), color="white", fontsize=7.5, weight="bold", ha="center",
            va="center", zorder=9,
            bbox={"boxstyle": "circle,pad=0.22", "facecolor": colour, "edgecolor": "white"},
        )  # fmt: skip


def _draw_transits(axes: Any, plan: Plan) -> None:
    """The pusher alone: dashed on the table, dotted while it is lifted."""
    for segment in plan.segments:
        if isinstance(segment, TransitSegment) and len(segment.times) > 1:
            path, lifted = MM * segment.pusher[:, :2], segment.height > 1e-6
            high = lifted[:-1] | lifted[1:]
            for part, dashes in ((~high, (0, (3, 2))), (high, (0, (1, 2.5)))):
                for first, end in _runs(part):
                    axes.plot(
                        *path[first : end + 1].T,
                        color=palette.PUSHER,
                        linewidth=0.9,
                        linestyle=dashes,
                        zorder=4,
                    )


def _draw_cones(axes: Any, scene: Scene, trace: PushTrace) -> None:
    """At the first contact: friction cone (blue) and the part of the motion cone that the plan uses (red)."""
    from matplotlib.patches import Wedge

    if trace.contact is None or trace.normal is None:
        return
    pose = trace.marks[0]
    tip = tuple(MM * transform(pose, trace.contact))
    length = 0.4 * MM * scene.object.outline.size
    half = np.arctan(scene.object.friction)
    edges = [rotate(pose[2] + side * half, trace.normal) for side in (1, -1)]
    cones = [(edges, palette.FORCE, length)]
    if trace.motion is not None:
        unit = trace.motion / np.linalg.norm(trace.motion, axis=1, keepdims=True)
        cones.append(([rotate(pose[2], edge) for edge in unit], palette.MOTION, 0.72 * length))
    for (left, right), colour, size in cones:
        low, high = (np.degrees(np.arctan2(edge[1], edge[0])) for edge in (right, left))
        axes.add_patch(Wedge(tip, size, low, high, facecolor=colour, alpha=0.22, linewidth=0, zorder=7.5))
        for edge in (left, right):
            axes.plot(*np.stack([tip, np.add(tip, size * edge)]).T, color=colour, linewidth=1.2, zorder=7.6)


def _draw_rollout(
    axes: Any, plan: Plan, rollout: Rollout, traces: tuple[PushTrace, ...], faint: bool
) -> None:
    look = {"color": palette.SIMULATED, "linestyle": (0, (4, 2)), "alpha": 0.35 if faint else 0.95}
    for path in rollout_paths(rollout, plan, traces):
        axes.plot(*(MM * path).T, linewidth=1.1, zorder=8, **look)
    corners = MM * _outline(plan.scene, rollout.final_pose)
    axes.plot(*np.concatenate([corners, corners[:1]]).T, linewidth=1.3, zorder=8, **look)


def _legend(
    figure: Any, plan: Plan, traces: Sequence[PushTrace], simulated: bool, tree: bool = False
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    several = len(traces) > 1
    entries: list[Any] = []
    for t in traces:
        colour = palette.push_colour(t.number)
        entries.append(
            Patch(facecolor=colour + "1c", edgecolor=colour, label=push_label(t.number, t.segment, several))
        )
    if any(t.flat_path is not None for t in traces):
        colour = SOFT if several else palette.push_colour(0)
        entries.append(Line2D([], [], color=colour, linewidth=2.2, label="path of the flat point"))
    if traces:
        entries.append(
            Line2D(
                [],
                [],
                color=palette.PUSHER,
                marker="o",
                markersize=4,
                linewidth=1,
                label="fingers and their path",
            )
        )
    if any(isinstance(s, TransitSegment) for s in plan.segments):
        entries.append(
            Line2D(
                [],
                [],
                color=palette.PUSHER,
                linewidth=0.9,
                linestyle=(0, (3, 2)),
                label="pusher alone (dotted: lifted)",
            )
        )
    if any(t.centres for t in traces):
        entries.append(
            Line2D(
                [],
                [],
                linestyle="",
                marker="o",
                mfc="white",
                mec=SOFT,
                markersize=6,
                label="turning centre (+ left, − right)",
            )
        )
    if traces and traces[0].contact is not None:
        entries.append(Patch(facecolor=palette.FORCE, alpha=0.45, label="friction cone"))
        if traces[0].motion is not None:
            entries.append(Patch(facecolor=palette.MOTION, alpha=0.45, label="motion cone in use"))
    if plan.scene.workspace.bounds is not None:
        entries.append(Line2D([], [], color=palette.BOUNDS, linewidth=1.6, label="bounds"))
    if plan.scene.workspace.obstacles:
        entries.append(
            Patch(
                facecolor=palette.OBSTACLE + "29", edgecolor=palette.OBSTACLE, hatch="////", label="obstacle"
            )
        )
    if tree:
        entries.append(Line2D([], [], color=TREE, linewidth=0.8, label="search tree"))
    if simulated:
        entries.append(
            Line2D([], [], color=palette.SIMULATED, linestyle=(0, (4, 2)), linewidth=1.3, label="simulated")
        )
    if entries:
        legend_below(figure, entries)


def _outline(scene: Scene, pose: Array) -> Array:
    return transform(pose, scene.object.outline.polyline())


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and end (one past the last) of every run of true flags."""
    padded = np.concatenate([[False], flags, [False]])
    turns = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(a), int(b)) for a, b in zip(turns[::2], turns[1::2], strict=True)]


def _arrow_head(axes: Any, path: Array, colour: str) -> None:
    """Which way the flat point goes, at the end of its path."""
    tip, tail = path[-1], path[-2] if len(path) > 1 else path[-1]
    if np.any(tip != tail):
        axes.annotate(
            "", xy=tip, xytext=tip - 1e-3 * (tip - tail) / np.linalg.norm(tip - tail), zorder=7.1,
            arrowprops={"arrowstyle": "-|>,head_length=0.5,head_width=0.28", "color": colour, "lw": 1.2},
        )  # fmt: skip
