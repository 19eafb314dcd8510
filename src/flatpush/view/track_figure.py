"""The picture of a closed loop: where the object should go and went, its error and the controller's mode over time."""

from pathlib import Path

import numpy as np

from ..control.loop.closed_loop import ClosedLoopRun
from ..documents.atomic import write_atomically
from ..geometry import transform
from ..geometry.pose import Array
from ..problem import Plan
from . import palette
from .canvas import SOFT, drawing_style, figure_bytes, headline, legend_below, new_figure, settle, table_axes
from .figure import check_ending
from .plan_figure import MM, draw_ends, draw_object, draw_workspace, view_box
from .trace import trace_pushes

ENDINGS = (".svg", ".png")
_COLOURS = {
    "path": palette.PUSHES[0],
    "tracking": palette.PUSHES[0],
    "posture": palette.PUSHES[0],
    "push": palette.PUSHES[0],
    "look": "#bbbbbb",
    "resume": palette.SIMULATED,
    "retreat": palette.PUSHES[1],
    "saturated": palette.SIMULATED,
    "guarded": palette.PUSHES[1],
    "waiting": "#777777",
    "held": palette.START,
    "transit": palette.PUSHES[3],
    "done": palette.GOAL,
}


def track_figure(plan: Plan, run: ClosedLoopRun, path: str | Path, subtitle: str = "") -> None:
    """Draws a run as ".svg" or ".png"; the error of a controller that plans anew is its distance from the goal.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    ending = check_ending(path, ENDINGS)
    cof = plan.scene.object.cof
    actual = transform(run.object, cof)
    modes = list(dict.fromkeys(run.modes))
    replans = "look" in modes
    if replans:
        near = np.hypot(*(actual - transform(plan.scene.goal_pose, cof)).T)
    else:
        near = np.min([_distance(actual, transform(push.object, cof)) for push in plan.pushes], axis=0)
    with drawing_style():
        figure = new_figure(width=9.6, height=5.2)
        headline(figure, f"{plan.scene.object.name}: this plan under feedback", subtitle)
        look = {m: _COLOURS.get(m, palette.PUSHES[(k + 2) % 6]) for k, m in enumerate(modes)}
        legend_below(
            figure,
            [
                Line2D(
                    [],
                    [],
                    color=palette.START,
                    linewidth=3,
                    alpha=0.3,
                    label="first plan" if replans else "reference",
                ),
                Line2D([], [], color=palette.SIMULATED, linewidth=1.2, label="actual, centre of friction"),
                *(Patch(facecolor=look[m], label=m) for m in modes),
            ],
        )
        grid = figure.add_gridspec(2, 2, width_ratios=(1.5, 1), height_ratios=(4, 1))
        wide, error = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
        strip = figure.add_subplot(grid[1, 1], sharex=error)
        table_axes(wide)
        traces = trace_pushes(plan)
        box = view_box(plan, traces)
        seen = MM * np.concatenate([actual, transform(run.object[-1], plan.scene.object.outline.vertices)])
        low, high = np.minimum(box[:2], seen.min(axis=0)), np.maximum(box[2:], seen.max(axis=0))
        settle(figure, [(wide, (float(low[0]), float(low[1]), float(high[0]), float(high[1])))])
        draw_workspace(wide, plan.scene)
        draw_ends(wide, plan, traces)
        draw_object(wide, plan.scene, run.object[-1], palette.SIMULATED, linewidth=1.0, zorder=6)
        for push in plan.pushes:
            line = MM * transform(push.object, plan.scene.object.cof)
            wide.plot(*line.T, color=palette.START, linewidth=3, alpha=0.3, zorder=4)
        wide.plot(*(MM * actual).T, color=palette.SIMULATED, linewidth=1.2, zorder=7)
        error.plot(run.times, MM * near, color=palette.SIMULATED, linewidth=1.2)
        error.set_ylabel(f"distance from the {'goal' if replans else 'reference'} [mm]")
        error.set_ylim(bottom=0)
        error.tick_params(labelbottom=False)
        step = float(run.times[1] - run.times[0]) if len(run.times) > 1 else 1.0
        for mode in modes:
            on = [(float(t), step) for t, m in zip(run.times, run.modes, strict=True) if m == mode]
            strip.broken_barh(on, (0, 1), facecolor=look[mode], linewidth=0)
        strip.set(yticks=[], xlabel="time [s]", ylim=(0, 1), xlim=(run.times[0], run.times[-1] + step))
        strip.set_ylabel("mode", color=SOFT)
        write_atomically(path, figure_bytes(figure, ending, "feedback"))


def _distance(points: Array, line: Array) -> Array:
    """Of points (n, 2) from a polyline (m, 2), shape (n,)."""
    start, step = line[:-1], np.diff(line, axis=0)
    away = points[:, None] - start[None]
    share = np.clip(np.sum(away * step, axis=2) / np.maximum(np.sum(step * step, axis=1), 1e-300), 0, 1)
    return np.asarray(np.min(np.linalg.norm(away - share[..., None] * step, axis=2), axis=1))
