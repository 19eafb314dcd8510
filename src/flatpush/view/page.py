"""The animation of a plan as one HTML file that needs nothing else: inline SVG and a small script."""

import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from string import Template

import numpy as np

from ..geometry import transform
from ..geometry.pose import Array
from ..problem import Plan, PushSegment, Rollout, Scene, TransitSegment
from . import palette
from .drawing import Box, Drawing
from .labels import Labels, beside
from .panel import Panel
from .table import MM, view_box, what_is_drawn
from .timeline import Timeline, arc_starts
from .trace import (
    PushTrace,
    fingers_at,
    fingertips,
    orientation_mark,
    rollout_paths,
    trace_pushes,
    turning_centre,
)
from .words import plan_subtitle, plan_title, push_label

NUMBERS = 0.06  # of the longer side, left and below, for the numbers of the axes
NUMBERS_OF_X = 30.0  # height of the row of numbers below, on a telephone, at MIDDLE [px]
MIDDLE = 620.0  # width of the table between those of a telephone and of a screen [px]


def draw_page(plan: Plan, rollouts: Sequence[Rollout] = ()) -> str:
    """The page: the plan's traces, object and fingers in motion, play, pause, scrub, speed, keyboard."""
    traces = trace_pushes(plan)
    box = _with_numbers(view_box(plan, traces, rollouts))
    data = plan_data(plan, traces)
    # "<" must not stand in a script, whatever a name in the scene contains.
    script_data = json.dumps(data, separators=(",", ":"), ensure_ascii=True).replace("<", "\\u003c")
    page = Template(files(__package__).joinpath("page.html").read_text(encoding="utf-8"))
    return page.substitute(
        title=escape(plan_title(plan)),
        subtitle=escape(plan_subtitle(plan)),
        viewbox=" ".join(f"{v:.2f}" for v in (box[0], -box[3], box[2] - box[0], box[3] - box[1])),
        unit=f"{max(box[2] - box[0], 1.5 * (box[3] - box[1])) / 900:.4f}",
        still=_still(plan, traces, rollouts, box),
        body=_body(plan.scene),
        tips="".join(f'<circle class="tip" r="{_tip(plan.scene):.3f}"/>' for _ in range(_most_fingers(plan))),
        legend=_legend(plan, traces, bool(rollouts)),
        data=script_data,
    )


def _with_numbers(box: Box) -> Box:
    """A box with room for the numbers of the axes, which stand in it."""
    room = NUMBERS * max(box[2] - box[0], box[3] - box[1])
    return box[0] - room, box[1] - room, box[2], box[3]


def plan_data(plan: Plan, traces: Sequence[PushTrace]) -> dict[str, object]:
    """What the script needs: samples of poses (mm, rad; y up), and the segments with their turns."""
    timeline = Timeline.of(plan)
    segments: list[dict[str, object]] = []
    pushes = iter(traces)
    for number, (start, segment) in enumerate(zip(timeline.starts, plan.segments, strict=True)):
        row = {"push": None} if isinstance(segment, TransitSegment) else _push(next(pushes), start)
        tips = _round(MM * fingers_at(plan, number), 4)
        segments.append({"start": round(start, 6), **row, "tips": tips})
    return {
        "times": _round(timeline.times, 6),
        "object": _round(timeline.object * [MM, MM, 1.0], 5),
        "pusher": _round(timeline.pusher * [MM, MM, 1.0], 5) if timeline.moves else [],
        "height": _round(MM * timeline.height, 2),
        "segment": timeline.segment.tolist(),
        "segments": segments,
    }


def _push(trace: PushTrace, start: float) -> dict[str, object]:
    turns, end = [], start
    segment = trace.segment
    arcs = zip(segment.arcs, arc_starts(segment), strict=False) if isinstance(segment, PushSegment) else ()
    for arc, pose in arcs:
        end += arc.duration
        centre = turning_centre(arc)
        where = None if centre is None else _round(MM * transform(pose, centre), 3)
        turns.append({"turn": arc.turn, "end": round(end, 6), "centre": where})
    return {
        "push": trace.segment.push,
        "number": trace.number + 1,
        "colour": palette.push_colour(trace.number),
        "flat": None if trace.flat_point is None else _round(MM * trace.flat_point, 4),
        "turns": turns,
    }


def _still(plan: Plan, traces: tuple[PushTrace, ...], rollouts: Sequence[Rollout], box: Box) -> str:
    """All that does not move, back to front."""
    scene = plan.scene
    parts = [_grid(box)]
    if scene.workspace.bounds is not None:
        x0, y0, x1, y1 = MM * np.asarray(scene.workspace.bounds)
        parts.append(
            f'<rect class="bounds" x="{x0:.2f}" y="{-y1:.2f}" width="{x1 - x0:.2f}" height="{y1 - y0:.2f}"/>'
        )
    parts += [
        f'<path class="obstacle" d="{_path(obstacle.polyline(), closed=True)}"/>'
        for obstacle in scene.workspace.obstacles
    ]
    for trace in traces:
        colour = palette.push_colour(trace.number)
        parts.append(f'<g class="push" style="--c:{colour}">')
        parts += [
            f'<path class="ghost" d="{_path(_outline(scene, pose), closed=True)}"/>' for pose in trace.marks
        ]
        for tips in fingertips(trace.pushers, trace.segment.fingers):
            parts += [f'<circle class="trail" {_at(tip)} r="{_tip(scene):.3f}"/>' for tip in tips]
        if trace.flat_path is not None:
            parts.append(f'<path class="flat" d="{_path(trace.flat_path)}"/>')
        elif not isinstance(trace.segment, PushSegment):
            way = transform(trace.segment.object, scene.object.cof)
            parts.append(f'<path class="flat slide" d="{_path(way)}"/>')
        parts.append("</g>")
    for trace in traces if len(traces) > 1 else ():
        path = trace.flat_path
        path = transform(trace.segment.object, scene.object.cof) if path is None else path
        points = json.dumps(_round(MM * path[:: max(1, len(path) // 60)], 2))
        parts.append(
            f'<g class="number" style="--c:{palette.push_colour(trace.number)}" data-path="{points}">'
            f'<circle r="1"/><text dy="0.36em">{trace.number + 1}</text></g>'
        )
    panel, labels = _labels(plan, traces, box)
    for name, pose in (("start", scene.start_pose), ("goal", plan.goal_pose)):
        corners = _outline(scene, pose)
        mark = transform(pose, orientation_mark(scene))
        parts.append(
            f'<g class="end {name}"><path d="{_path(corners, closed=True)}"/>'
            + ("" if name == "goal" and scene.free_angle else f'<path d="{_path(mark)}"/>')
        )
        if name == "goal" or not np.allclose(scene.start_pose, plan.goal_pose):
            parts.append(_name(panel, labels, corners, name))
        parts.append("</g>")
    for rollout in rollouts:
        paths = [_path(path) for path in rollout_paths(rollout, plan, traces)]
        paths.append(_path(_outline(scene, rollout.final_pose), closed=True))
        parts += [f'<path class="simulated" d="{path}"/>' for path in paths]
    return "\n".join(parts)


def _labels(plan: Plan, traces: Sequence[PushTrace], box: Box) -> tuple[Panel, Labels]:
    """Where names have room on a page of a middle size; the numbers of the grid are there already."""
    width, height = MIDDLE, MIDDLE * (box[3] - box[1]) / (box[2] - box[0])
    panel = Panel(Drawing(width, height, ""), (0.0, 0.0, width, height), box)
    labels = Labels(panel, what_is_drawn(plan, traces))
    for y in _grid_values(box, 1):
        place = float(panel.at(np.array([0.0, y]))[1])
        labels.boxes.append((0.0, place - 8, 44.0, place + 8))
    labels.boxes.append((0.0, height - NUMBERS_OF_X, width, height))
    return panel, labels


def _name(panel: Panel, labels: Labels, corners: Array, name: str) -> str:
    """A name beside an outline: it keeps its distance on the screen from a point of it, however large the page is."""
    size = 40.0, 14.0
    middle = labels.place(*size, beside(panel, MM * corners, *size))
    near = corners[np.argmin(np.linalg.norm(panel.at(MM * corners) - middle, axis=1))]
    dx, dy = middle - panel.at(MM * near)
    return (
        f'<text x="{MM * near[0]:.2f}" y="{-MM * near[1]:.2f}" dy="0.36em" style="transform: translate('
        f'calc({dx:.1f} * var(--u)), calc({dy:.1f} * var(--u)))">{name}</text>'
    )


def _grid_values(box: Box, axis: int) -> Array:
    """Round values along an axis of the box [mm]; those at its edges have no room for their numbers."""
    extent = max(box[2] - box[0], box[3] - box[1])
    step = next(s for e in range(-3, 9) for s in (10.0**e, 2 * 10.0**e, 5 * 10.0**e) if extent / s <= 9)
    # On a telephone the row of numbers and the unit at its end take an eighth.
    low, high = box[axis] + (0.05, 0.1)[axis] * extent, box[axis + 2] - (0.12, 0.02)[axis] * extent
    return np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step


def _grid(box: Box) -> str:
    """Grid lines at round millimetres, with their numbers along the lower and the left border."""
    parts = ['<g class="grid">']
    for x in _grid_values(box, 0):
        parts.append(f'<path d="M{x:.3f} {-box[1]:.2f}V{-box[3]:.2f}"/>')
        parts.append(f'<text class="x" x="{x:.3f}" y="{-box[1]:.2f}">{_number(x)}</text>')
    for y in _grid_values(box, 1):
        parts.append(f'<path d="M{box[0]:.2f} {-y:.3f}H{box[2]:.2f}"/>')
        parts.append(f'<text class="y" x="{box[0]:.2f}" y="{-y:.3f}">{_number(y)}</text>')
    parts.append(f'<text class="x unit" x="{box[2]:.2f}" y="{-box[1]:.2f}">mm</text></g>')
    return "".join(parts)


def _body(scene: Scene) -> str:
    """The object in its own frame O, y down as SVG has it."""
    outline, mark = scene.object.outline.polyline(), orientation_mark(scene)
    return f'<path class="shape" d="{_path(outline, closed=True)}"/><path class="mark" d="{_path(mark)}"/>'


def _legend(plan: Plan, traces: Sequence[PushTrace], simulated: bool) -> str:
    items = [("start", "var(--ink)", "box"), ("goal", "var(--goal)", "box")]
    several = len(traces) > 1
    items += [
        (push_label(t.number, t.segment, several), palette.push_colour(t.number), "line") for t in traces
    ]
    if plan.scene.workspace.obstacles:
        items.append(("obstacle", "var(--red)", "box"))
    if plan.scene.workspace.bounds is not None:
        items.append(("bounds", "var(--bounds)", "line"))
    if simulated:
        items.append(("simulated", "var(--red)", "dash"))
    return "".join(
        f'<li><i class="{kind}" style="--c:{colour}"></i>{escape(text)}</li>' for text, colour, kind in items
    )


def _outline(scene: Scene, pose: Array) -> Array:
    return transform(pose, scene.object.outline.polyline())


def _tip(scene: Scene) -> float:
    return MM * max(scene.pusher.tip_radius, 0.008 * scene.object.outline.size)


def _most_fingers(plan: Plan) -> int:
    return max((len(push.fingers) for push in plan.on_table), default=0)


def _path(points: Array, closed: bool = False) -> str:
    """SVG path data, mm, y down."""
    steps = " ".join(f"{MM * x:.3f} {-MM * y:.3f}" for x, y in np.asarray(points))
    return f"M{steps}{'Z' if closed else ''}"


def _at(point: Array) -> str:
    return f'cx="{MM * point[0]:.3f}" cy="{-MM * point[1]:.3f}"'


def _number(value: float) -> str:
    return f"{value + 0.0:g}".replace("-", "−")


def _round(values: Array, digits: int) -> list[object]:
    return np.round(np.asarray(values, dtype=float) + 0.0, digits).tolist()
