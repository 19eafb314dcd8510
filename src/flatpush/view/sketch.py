"""The panels of one push: its cones, its rotation centres, its flat point ([Zhou2017] Figs. 1, 2)."""

import textwrap
from typing import Any

import numpy as np

from ..geometry import cross, perpendicular
from ..geometry.pose import Array
from ..problem import Scene
from . import palette
from .canvas import (
    INK,
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
from .describe import PushSketch

MM = 1e3
FAR = 6.0  # sizes of the object; turning centres further from the centre of friction are only pointed at


def draw_sketches(scene: Scene, sketches: tuple[PushSketch, ...], extension: str) -> bytes:
    """The pushes as ".png" or ".svg", one row each: the contact (Fig. 1), the rotation centres (Fig. 2)."""
    rows = len(sketches)
    with drawing_style():
        figure = new_figure(width=9.6, height=3.9 * rows + 1.2)
        title = f"{scene.object.name}: what each push can do"
        headline(
            figure,
            title,
            f"friction {scene.object.friction:g} at the fingertips, model {scene.planning.model}",
        )
        _legend(figure, sketches)
        panels = figure.subplots(rows, 2, squeeze=False, width_ratios=(1, 1.45))
        boxes = []
        for (close, wide), sketch in zip(panels, sketches, strict=True):
            _dress(close, wide, sketch)
            boxes += [(close, _contact_box(scene, sketch)), (wide, _centres_box(scene, sketch))]
        settle(figure, boxes)
        for (close, wide), sketch in zip(panels, sketches, strict=True):
            _draw_contact(close, scene, sketch)
            _draw_centres(wide, scene, sketch)
        return figure_bytes(figure, extension, title)


def _dress(close: Any, wide: Any, sketch: PushSketch) -> None:
    """Axes, name and caption."""
    table_axes(close).set_title(f"push “{sketch.name}”", loc="left", weight="bold", color=INK)
    table_axes(wide).set_ylabel("")
    if sketch.steers:
        wide.set_title("\n".join(textwrap.wrap(_caption(sketch), 68)), loc="left", fontsize=9, color=SOFT)
    else:
        wide.axis("off")
        text = "\n".join(["This push cannot steer:", *textwrap.wrap(sketch.refusal, 58)])
        wide.text(0.04, 0.97, text, transform=wide.transAxes, va="top", color=palette.MOTION, linespacing=1.5)


def _draw_contact(axes: Any, scene: Scene, sketch: PushSketch) -> None:
    """[Zhou2017] Fig. 1: friction cone, motion cone, push frame."""
    size = MM * scene.object.outline.size
    _object(axes, scene, sketch)
    if sketch.steers:
        _rotation_centres(axes, sketch, pointers=False)
    _cone(axes, sketch, (sketch.force_left, sketch.force_right), palette.FORCE, 0.36 * size)
    _cone(axes, sketch, (sketch.motion_left, sketch.motion_right), palette.MOTION, 0.26 * size)
    axes.plot(
        *(MM * np.stack([sketch.contact, sketch.cof])).T, color=INK, linewidth=0.8, linestyle=":", zorder=6
    )
    _push_frame(axes, sketch, 0.2 * size)


def _draw_centres(axes: Any, scene: Scene, sketch: PushSketch) -> None:
    """[Zhou2017] Fig. 2: rotation-centre line, rays, flat point."""
    if sketch.steers:
        _object(axes, scene, sketch)
        _rotation_centres(axes, sketch, pointers=True)
        _straight(axes, sketch, 0.2 * float(np.ptp(axes.get_ylim())))


def _contact_box(scene: Scene, sketch: PushSketch) -> Box:
    tips = np.atleast_2d(sketch.fingertips)
    size = scene.object.outline.size
    return _box(
        [scene.object.outline.polyline(), tips - sketch.tip_radius, tips + sketch.tip_radius], 0.08 * size
    )


def _centres_box(scene: Scene, sketch: PushSketch) -> Box:
    outline, cof, size = scene.object.outline.polyline(), sketch.cof, scene.object.outline.size
    shown = [outline, sketch.fingertips - sketch.tip_radius, sketch.fingertips + sketch.tip_radius]
    for place in (sketch.left_centre, sketch.right_centre, sketch.flat_point):
        if _near(place, sketch, size):
            # Beyond a centre there must be room to see where its ray goes.
            shown.append((cof + 1.15 * (place - cof))[None])
    if sketch.region is not None:
        # Room for the centres that are far away, where the darker regions are.
        along = (sketch.left_centre - sketch.right_centre) * 2.2 * size
        along /= max(float(np.linalg.norm(sketch.left_centre - sketch.right_centre)), 1e-300)
        shown.append(cof + np.stack([along, -along]))
    return _box(shown, 0.14 * size)


def _box(shown: list[Array], border: float) -> Box:
    points = np.concatenate(shown)
    low, high = points.min(axis=0), points.max(axis=0)
    border = max(border, 0.08 * float(np.max(high - low)))
    low, high = MM * (low - border), MM * (high + border)
    return (low[0], low[1], high[0], high[1])


def _near(place: Array, sketch: PushSketch, size: float) -> bool:
    return bool(np.all(np.isfinite(place)) and np.linalg.norm(place - sketch.cof) <= FAR * size)


def _object(axes: Any, scene: Scene, sketch: PushSketch) -> None:
    from matplotlib.patches import Circle, Polygon, Wedge

    corners = MM * scene.object.outline.polyline()
    axes.add_patch(
        Polygon(corners, facecolor="#f1f1ef", edgecolor=INK, linewidth=1.5, joinstyle="round", zorder=1)
    )
    radius = MM * max(sketch.tip_radius, 0.012 * scene.object.outline.size)
    for tip, point in zip(
        MM * np.atleast_2d(sketch.fingertips), MM * np.atleast_2d(sketch.contact_points), strict=True
    ):
        axes.add_patch(
            Circle(tuple(tip), radius, facecolor="#bdbdbd", edgecolor=palette.PUSHER, linewidth=0.8, zorder=4)
        )
        axes.plot(*point, "o", color=INK, markersize=2.8, zorder=8)
    if len(np.atleast_2d(sketch.fingertips)) == 2:
        axes.plot(*(MM * sketch.fingertips).T, color=palette.PUSHER, linewidth=1.2, zorder=3.9)
    # The centre of friction, as centres of mass are drawn.
    cof, r = tuple(MM * sketch.cof), 0.022 * MM * scene.object.outline.size
    axes.add_patch(Circle(cof, r, facecolor="white", edgecolor=INK, linewidth=0.9, zorder=7))
    for start in (0, 180):
        axes.add_patch(Wedge(cof, r, start, start + 90, facecolor=INK, linewidth=0, zorder=7.1))


def _cone(axes: Any, sketch: PushSketch, edges: tuple[Array, Array], colour: str, length: float) -> None:
    from matplotlib.patches import Wedge

    tip = MM * sketch.contact
    if not np.all(np.isfinite(edges)):
        return
    left, right = (np.asarray(edge) / np.linalg.norm(edge) for edge in edges)
    low, high = (np.degrees(np.arctan2(edge[1], edge[0])) for edge in (right, left))
    axes.add_patch(Wedge(tuple(tip), length, low, high, facecolor=colour, alpha=0.10, linewidth=0, zorder=5))
    for edge in (left, right):
        _arrow(axes, tip, tip + length * edge, colour, zorder=6)


def _rotation_centres(axes: Any, sketch: PushSketch, pointers: bool) -> None:
    """The line, its two rays and their ends; pointers to what lies outside the axes."""
    left, right = MM * sketch.left_centre, MM * sketch.right_centre
    along = (left - right) / np.linalg.norm(left - right)
    reach = 4 * float(np.ptp(axes.get_xlim()) + np.ptp(axes.get_ylim())) + float(np.linalg.norm(left - right))
    line = np.stack([left + reach * along, right - reach * along])
    axes.plot(*line.T, color="#888888", linewidth=0.8, linestyle=(0, (4, 2.5)), zorder=2)
    if sketch.region is not None:
        _regions(axes, sketch)
    elif len(sketch.centres):
        turning = _sense(sketch)
        for sense, colour in ((1, palette.COUNTER_CLOCKWISE), (-1, palette.CLOCKWISE)):
            curve = np.where((turning == sense)[:, None], MM * sketch.centres, np.nan)
            axes.plot(*curve.T, color=colour, linewidth=2.2, zorder=2.6)
    else:
        axes.plot(
            *np.stack([left, left + reach * along]).T,
            color=palette.COUNTER_CLOCKWISE,
            linewidth=2.2,
            zorder=2.6,
        )
        axes.plot(
            *np.stack([right, right - reach * along]).T, color=palette.CLOCKWISE, linewidth=2.2, zorder=2.6
        )
    for place, sign, colour in ((left, "+", palette.COUNTER_CLOCKWISE), (right, "−", palette.CLOCKWISE)):
        _centre(axes, place, sign, colour, pointers)
    axes.plot(
        *(MM * sketch.flat_point), "o", color=palette.FLAT, mec="white", mew=0.8, markersize=8, zorder=9
    )


def _regions(axes: Any, sketch: PushSketch) -> None:
    """The centres that keep two contacts, light; those that do so under any pressure, dark."""
    from matplotlib.patches import Polygon

    assert sketch.region is not None
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    x, y = sketch.cof
    box = (x0 / MM - x, y0 / MM - y, x1 / MM - x, y1 / MM - y)
    for sense, colour in ((1, palette.COUNTER_CLOCKWISE), (-1, palette.CLOCKWISE)):
        shown = [(sketch.region.polygon(sense, box), 0.16, 0.8)]
        if sketch.any_pressure is not None:
            shown.append((sketch.any_pressure.polygon(sense, box), 0.3, 0.0))
        for corners, alpha, width in shown:
            if len(corners) > 2:
                axes.add_patch(
                    Polygon(
                        MM * (corners + sketch.cof), facecolor=colour, alpha=alpha, linewidth=0, zorder=1.5
                    )
                )
                if width:
                    axes.add_patch(
                        Polygon(
                            MM * (corners + sketch.cof),
                            fill=False,
                            edgecolor=colour,
                            linewidth=width,
                            zorder=1.6,
                        )
                    )


def _sense(sketch: PushSketch) -> Array:
    """+1 for a counter-clockwise centre, −1 for a clockwise one, 0 for nan: a turn about it must push."""
    arm = sketch.contact - sketch.centres
    pushing = perpendicular(arm) @ np.asarray(sketch.normal)
    return np.where(np.isfinite(pushing), np.sign(pushing), 0.0)


def _centre(axes: Any, place: Array, sign: str, colour: str, pointer: bool) -> None:
    """A circle with its sign; a pointer at the border when it lies outside the panel."""
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    if x0 < place[0] < x1 and y0 < place[1] < y1:
        axes.plot(*place, "o", mfc="white", mec=colour, markersize=12, mew=1.6, zorder=9)
        axes.plot(
            *place, marker="+" if sign == "+" else "_", color=colour, markersize=6.5, mew=1.6, zorder=9.1
        )
        return
    if not pointer:
        return
    # Where the line from the middle of the panel to the centre leaves the panel.
    middle, half = np.array([x0 + x1, y0 + y1]) / 2, np.array([x1 - x0, y1 - y0]) / 2
    away = place - middle
    border = middle + away / float(np.max(np.abs(away) / (0.97 * half)))
    text = f"{sign} at ({place[0]:.0f}, {place[1]:.0f}) mm".replace("-", "−")
    _arrow(axes, border - 0.12 * (border - middle), border, colour, zorder=9)
    axes.text(
        *(border - 0.16 * (border - middle)), text, color=colour, fontsize=8.5, zorder=9, va="center",
        ha="right" if away[0] > 0 else "left", bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip


def _straight(axes: Any, sketch: PushSketch, length: float) -> None:
    start = MM * sketch.flat_point
    direction = np.asarray(sketch.straight) / np.linalg.norm(sketch.straight)
    _arrow(axes, start, start + length * direction, "#11804f", zorder=8, width=1.8)


def _push_frame(axes: Any, sketch: PushSketch, length: float) -> None:
    """P: origin at the centre of friction, +y from the contact towards it."""
    towards = sketch.cof - sketch.contact
    distance = float(np.linalg.norm(towards))
    if distance == 0:
        return
    y = towards / distance
    x = -perpendicular(y)
    origin = MM * sketch.cof
    for axis, name in ((x, "x"), (y, "y")):
        _arrow(axes, origin, origin + length * axis, INK, zorder=6.5, width=1.0)
        axes.text(
            *(origin + 1.22 * length * axis),
            f"${name}_P$",
            fontsize=8.5,
            color=INK,
            ha="center",
            va="center",
            zorder=10,
            parse_math=True,
        )


def _arrow(axes: Any, tail: Array, head: Array, colour: str, zorder: float, width: float = 1.4) -> None:
    axes.annotate(
        "", xy=head, xytext=tail, zorder=zorder, annotation_clip=False,
        arrowprops={
            "arrowstyle": "-|>,head_length=0.45,head_width=0.2", "color": colour, "linewidth": width,
            "shrinkA": 0, "shrinkB": 0,
        },
    )  # fmt: skip


def _caption(sketch: PushSketch) -> str:
    """Turning radius, and where the flat point is, seen from the COF along the straight motion."""
    ahead = np.asarray(sketch.straight) / np.linalg.norm(sketch.straight)
    offset = MM * (sketch.flat_point - sketch.cof)
    forward, aside = float(offset @ ahead), float(cross(ahead, offset))
    place = f"{forward:.1f} mm ahead of the COF" if forward >= 0 else f"{-forward:.1f} mm behind the COF"
    if abs(aside) >= 0.05:
        place += f", {abs(aside):.1f} mm to the {'left' if aside > 0 else 'right'}"
    return f"turning radius {MM * sketch.turning_radius:.1f} mm, flat point {place}"


def _legend(figure: Any, sketches: tuple[PushSketch, ...]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def dot(colour: str, label: str, **look: Any) -> Any:
        return Line2D([], [], linestyle="", marker="o", color=colour, label=label, **look)

    entries = [
        Patch(facecolor=palette.FORCE + "30", edgecolor=palette.FORCE, label="friction cone"),
        Patch(facecolor=palette.MOTION + "30", edgecolor=palette.MOTION, label="motion cone of the contact"),
        dot(INK, "centre of friction (COF)", mfc="white", markersize=6),
        Line2D([], [], color=INK, linewidth=0.8, linestyle=":", label="contact to COF"),
    ]
    if any(s.steers for s in sketches):
        turns = (
            (palette.COUNTER_CLOCKWISE, "centres of left turns (+, ccw)"),
            (palette.CLOCKWISE, "centres of right turns (−, cw)"),
        )
        if any(s.region is not None for s in sketches):
            entries += [Patch(facecolor=c + "38", edgecolor=c, label=label) for c, label in turns]
            entries.append(Patch(facecolor="#00000055", label="darker: whatever the pressure on the table"))
        else:
            entries += [Line2D([], [], color=c, linewidth=2.2, label=label) for c, label in turns]
        entries += [
            Line2D(
                [],
                [],
                color="#888888",
                linewidth=0.8,
                linestyle=(0, (4, 2.5)),
                label="line through the two centres",
            ),
            dot(palette.FLAT, "flat point (their middle)", markersize=7),
            Line2D([], [], color="#11804f", linewidth=1.8, label="straight motion"),
        ]
    legend_below(figure, entries)
