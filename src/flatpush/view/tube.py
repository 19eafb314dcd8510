"""The picture of many disturbed runs: the tube in which the object stays, and where it ends."""

from pathlib import Path
from typing import Any

import numpy as np

from ..documents.atomic import write_atomically
from ..errors import InputError
from ..geometry import transform
from ..geometry.pose import Array
from ..simulation.study import Runs
from . import palette
from .canvas import (
    INK,
    SOFT,
    drawing_style,
    figure_bytes,
    headline,
    legend_below,
    new_figure,
    settle,
    table_axes,
)
from .figure import check_ending
from .plan_figure import MM, draw_ends, draw_object, draw_workspace, view_box
from .trace import trace_pushes

ENDINGS = (".svg", ".png")
MOST_DRAWN = 200
_BANDS = ((0.025, 0.975, 0.20), (0.25, 0.75, 0.34))  # quantiles and opacity
_FEWEST = 5  # runs under way at a sample, for a band there


def tube_figure(runs: Runs, path: str | Path) -> None:
    """Draws the band that holds the centre of friction in 95 % (and 50 %) of the runs, and the ends of the runs.

    At every sample of the plan the band holds these parts of the runs that are still under way, counted across the
    direction in which their middle moves.

    Args:
        runs: recorded (study(…, record=True)).
        path: ends in .svg or .png.

    Raises:
        InputError: if nothing was recorded, the ending is another, or the file cannot be written.
    """
    ending = check_ending(path, ENDINGS)
    if runs.object is None:
        raise InputError("the tube needs runs that were recorded", hint="study(…, record=True)")
    plan = runs.plan
    with drawing_style():
        figure = new_figure(width=9.6, height=5.6)
        title = f"{plan.scene.object.name}: {len(runs)} runs of this plan"
        headline(figure, title, _subtitle(runs))
        _legend(figure)
        wide, close = figure.subplots(1, 2, width_ratios=(1.75, 1))
        table_axes(wide), table_axes(close).set_ylabel("")
        close.set_title("ends of the origin of the drawing", loc="left", color=SOFT)
        traces = trace_pushes(plan)
        settle(figure, [(wide, _wide_box(runs, view_box(plan, traces))), (close, _close_box(runs))])
        draw_workspace(wide, plan.scene)
        draw_ends(wide, plan, traces)
        for pose in runs.final[:MOST_DRAWN]:
            draw_object(wide, plan.scene, pose, palette.SIMULATED, linewidth=0.35, alpha=0.22, zorder=2)
        paths = transform(runs.object[..., :3].reshape(-1, 3), plan.scene.object.cof).reshape(
            *runs.object.shape[:2], 2
        )
        for first, last in _stretches(paths):
            _band(wide, MM * paths[:, first:last])
        _ends(close, runs)
        write_atomically(path, figure_bytes(figure, ending, title))


def _stretches(paths: Array) -> list[tuple[int, int]]:
    """Samples between which the runs move, one stretch from rest to rest."""
    with np.errstate(invalid="ignore"):
        moving = (
            np.nan_to_num(np.nanmax(np.hypot(*np.moveaxis(np.diff(paths, axis=1), -1, 0)), axis=0)) > 1e-6
        )
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(int)))
    return [(int(a), int(b) + 1) for a, b in edges.reshape(-1, 2)]


def _band(axes: Any, paths: Array) -> None:
    """Of one stretch, paths (n, m, 2) in mm."""
    enough = np.count_nonzero(np.isfinite(paths[..., 0]), axis=0) >= min(_FEWEST, len(paths))
    paths = paths[:, enough]
    if paths.shape[1] < 2:
        return
    middle = np.nanmedian(paths, axis=0)
    ahead = np.gradient(middle, axis=0)
    size = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = ahead / np.where(size > 0, size, 1.0)
    across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    offsets = np.einsum("nmi,mi->nm", paths - middle, across)
    for low, high, opacity in _BANDS:
        a, b = np.nanquantile(offsets, [low, high], axis=0)
        ring = np.concatenate([middle + a[:, None] * across, (middle + b[:, None] * across)[::-1]])
        axes.fill(*ring.T, facecolor=palette.SIMULATED, alpha=opacity, linewidth=0, zorder=5)
    axes.plot(*middle.T, color=palette.SIMULATED, linewidth=1.0, zorder=7)


def _ends(axes: Any, runs: Runs) -> None:
    """Final positions, their mean and 95 % ellipse, the goal; ticks show how the object is turned."""
    from matplotlib.patches import Ellipse

    points, goal = MM * runs.final[:, :2], MM * runs.plan.scene.goal_pose[:2]
    stuck = runs.sticking
    length = 0.045 * float(np.ptp(axes.get_xlim()))
    for some, colour in ((stuck, palette.PUSHES[0]), (np.logical_not(stuck), palette.SIMULATED)):
        tips = points[some] + length * np.stack(
            [np.cos(runs.final[some, 2]), np.sin(runs.final[some, 2])], axis=1
        )
        lines = np.stack([points[some], tips, np.full_like(tips, np.nan)], axis=1).reshape(-1, 2)
        axes.plot(*lines.T, color=colour, linewidth=0.5, alpha=0.35, zorder=3)
        axes.plot(*points[some].T, "o", color=colour, markersize=2.6, mew=0, alpha=0.6, zorder=4)
    values, vectors = np.linalg.eigh(MM**2 * runs.covariance[:2, :2])
    widths = 2 * np.sqrt(5.991 * np.maximum(values, 0))  # χ² of two degrees of freedom at 95 %
    angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    axes.add_patch(
        Ellipse(
            tuple(MM * runs.mean[:2]),
            widths[1],
            widths[0],
            angle=angle,
            fill=False,
            edgecolor=INK,
            lw=1.1,
            zorder=6,
        )
    )
    axes.plot(*(MM * runs.mean[:2]), "+", color=INK, markersize=9, mew=1.4, zorder=7)
    axes.plot(*goal, "x", color=palette.GOAL, markersize=8, mew=2.0, zorder=8)


def _wide_box(runs: Runs, box: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """What shows the plan and nineteen ends out of twenty."""
    size = 0.6 * MM * runs.plan.scene.object.outline.size
    low, high = (MM * np.quantile(runs.final[:, :2], q, axis=0) for q in (0.025, 0.975))
    return (
        min(box[0], low[0] - size),
        min(box[1], low[1] - size),
        max(box[2], high[0] + size),
        max(box[3], high[1] + size),
    )


def _close_box(runs: Runs) -> tuple[float, float, float, float]:
    goal = MM * runs.plan.scene.goal_pose[None, :2]
    low, high = (MM * np.quantile(runs.final[:, :2], q, axis=0) for q in (0.01, 0.99))
    points = np.concatenate([low[None], high[None], goal])
    low, high = points.min(axis=0), points.max(axis=0)
    border = max(0.15 * float(np.max(high - low)), 0.05)
    return (low[0] - border, low[1] - border, high[0] + border, high[1] + border)


def _subtitle(runs: Runs) -> str:
    distance, turn = np.quantile(runs.errors, 0.5, axis=0)
    return (
        f"off the goal in the median {MM * distance:.2f} mm and {np.degrees(turn):.2f}°;"
        f" stayed sticking in {100 * runs.sticking_share:.1f} % of the runs"
    )


def _legend(figure: Any) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def dot(colour: str, label: str, **look: Any) -> Any:
        return Line2D([], [], linestyle="", color=colour, label=label, **look)

    legend_below(
        figure,
        [
            Patch(facecolor=palette.SIMULATED, alpha=0.2, label="centre of friction, 95 % of the runs"),
            Patch(facecolor=palette.SIMULATED, alpha=0.5, label="50 %"),
            Line2D([], [], color=palette.SIMULATED, linewidth=0.6, alpha=0.6, label="ends of the object"),
            dot(palette.PUSHES[0], "end of a run that stuck", marker="o", markersize=4),
            dot(palette.SIMULATED, "end of a run that slipped", marker="o", markersize=4),
            dot(INK, "mean and 95 % ellipse", marker="+", markersize=8),
            dot(palette.GOAL, "goal", marker="x", markersize=7, mew=2.0),
        ],
    )
