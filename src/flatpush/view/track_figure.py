"""The picture of a closed loop: where the object should go and went; over time its error, contact and controller."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..control.loop.closed_loop import ClosedLoopRun
from ..geometry import transform
from ..geometry.pose import Array
from ..problem import Plan, Scene
from . import drawing as d
from . import palette, words
from .drawing import PAGE, SOFT, Box, Drawing, Look
from .labels import Labels
from .legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
from .panel import AXIS, BOTTOM, LEFT, Panel, number, ticks
from .picture import check_ending, save_picture
from .table import MM, draw_endpoints, draw_object, draw_workspace, view_box, what_is_drawn, workspace_entries
from .trace import trace_pushes

HEAD = 8.0  # more room above the axes of the distance, for their name [pt]
STRIP = 11.0  # height of a strip over time [pt]
LEAST_SEEN = 1 / 800  # part of the time that is a quarter of a point in a strip
MOST_SAMPLES = 400  # of the clearance
REFERENCE, ACTUAL = Look("#b3b3b3", 3.0), Look(palette.SIMULATED, 1.2)
TOLERANCE = Look(palette.GOAL, 1.0, (3.0, 2.0))
CLEARANCE = Look(palette.OBSTACLE, 1.1, (2.0, 1.5))
CONTACTS = {
    "sticking": (words.STICKS, palette.PUSHES[0]),
    "sliding_left": (words.SLIDES_LEFT, "#f0b429"),
    "sliding_right": (words.SLIDES_RIGHT, "#b35c00"),
    "separation": (words.OFF, "#d4d4d4"),
    "rest": (words.RESTS, "#9a9a9a"),
    "": ("not known", "#eeeeee"),
}
MODES = {
    "path": "#4477aa", "tracking": "#332288", "posture": "#66ccee", "push": "#4477aa", "look": "#d9cf8a",
    "looking": "#d9cf8a", "resume": "#228833", "retreat": "#e6a100", "saturated": "#cc3311", "guarded": "#ee7733",
    "waiting": "#777777", "held": "#111111", "transit": "#aa3377", "done": "#002f5c",
}  # fmt: skip


def track_figure(plan: Plan, run: ClosedLoopRun, path: str | Path, subtitle: str = "") -> None:
    """Draws a run as ".svg" or ".png"; the error of a controller that plans anew is its distance from the goal.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    check_ending(path)
    save_picture(draw_track(plan, run, subtitle), path)


def draw_track(plan: Plan, run: ClosedLoopRun, subtitle: str = "") -> Drawing:
    """The same as a drawing."""
    scene = plan.scene
    how = "as it was run" if set(run.modes) == {"plan"} else "followed under feedback"
    title = f"{scene.object.name}: the plan {how}, {float(run.times[-1]):.0f} s"
    top = title_height(title, subtitle) + 6
    traces = trace_pushes(plan)
    actual = MM * transform(run.object, scene.object.cof)
    box = _table_box(plan, run, view_box(plan, traces))
    left, wide = EDGE + LEFT, 0.56 * (PAGE - 2 * EDGE) - LEFT
    height = float(np.clip(wide * (box[3] - box[1]) / (box[2] - box[0]), 190.0, 300.0))
    entries, strips = _legend(scene, run), _strip_entries(run)
    width = PAGE - 2 * EDGE
    bottom = top + height + BOTTOM
    lower = bottom + legend_height(entries, width) + 4
    heads = [words.CONTACT, words.CONTROLLER]
    rows = [legend_height(some, width - 62) for some in strips]
    page = Drawing(PAGE, lower + sum(rows) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, bottom, width)
    for head, some, room in zip(heads, strips, rows, strict=True):
        page.add(d.Text(EDGE, lower + 10, head, 8.0, SOFT, bold=True), 20)
        draw_legend(page, some, EDGE + 62, lower, width - 62)
        lower += room

    table = Panel(page, (left, top, left + wide, top + height), box)
    table.axes()
    draw_workspace(table, scene)
    draw_endpoints(table, plan, Labels(table, np.concatenate([what_is_drawn(plan, traces), actual])))
    draw_object(table, scene, run.object[-1], Look(palette.SIMULATED, 1.0), 6)
    for push in plan.on_table:
        table.line(MM * transform(push.object, scene.object.cof), REFERENCE, 4)
    table.line(actual, ACTUAL, 7)

    right = left + wide + 16 + LEFT
    foot = top + height
    _error(page, (right, top + HEAD, PAGE - EDGE, foot - 2 * STRIP - 14), plan, run)
    step = float(run.times[1] - run.times[0]) if len(run.times) > 1 else 1.0
    span = (float(run.times[0]), float(run.times[-1]) + step)
    for k, (values, looks) in enumerate(((run.contacts, CONTACTS), (run.modes, None))):
        strip_top = foot - (2 - k) * STRIP - 5 * (1 - k)
        strip = (right, strip_top, PAGE - EDGE, strip_top + STRIP)
        _strip(
            page,
            strip,
            span,
            run.times,
            values,
            {w: _colour(w, run) if looks is None else looks[w][1] for w in values},
        )
        page.add(d.Text(right - 4, strip_top + 8, heads[k], 6.5, SOFT, "end"), 20)
    for value in ticks(*span, (PAGE - EDGE - right) / 40):
        x = right + (value - span[0]) / (span[1] - span[0]) * (PAGE - EDGE - right)
        page.add(d.Text(x, foot + 10, number(value), 7.5, SOFT, "middle"), 20)
    page.add(d.Text((right + PAGE - EDGE) / 2, foot + 21, "time [s]", 8.5, SOFT, "middle"), 20)
    return page


def distances(plan: Plan, run: ClosedLoopRun) -> Array:
    """Of the centre of friction from the nearest pushed path, or from the goal for a controller that plans anew [m]."""
    cof = plan.scene.object.cof
    actual = transform(run.object, cof)
    if _plans_anew(run):
        return np.linalg.norm(actual - transform(plan.goal_pose, cof), axis=1)
    paths = [_distance(actual, transform(push.object, cof)) for push in plan.on_table]
    return np.asarray(np.min(paths, axis=0))


def clearances(scene: Scene, poses: Array) -> Array:
    """Of the object at poses (n, 3) from obstacles and bounds, shape (n,) [m]; below 0 outside of the bounds."""
    from shapely import MultiPolygon, Polygon, distance, polygons

    bodies = polygons(transform(poses[:, None], scene.object.outline.polyline()[None]))
    found = np.full(len(poses), np.inf)
    if scene.workspace.obstacles:
        blocked = MultiPolygon([Polygon(o.polyline()) for o in scene.workspace.obstacles])
        found = np.minimum(found, distance(bodies, blocked))
    if scene.workspace.bounds is not None:
        x0, y0, x1, y1 = scene.workspace.bounds
        corners = transform(poses[:, None], scene.object.outline.polyline()[None])
        low, high = corners.min(axis=1), corners.max(axis=1)
        inside = np.min(np.concatenate([low - [x0, y0], [x1, y1] - high], axis=1), axis=1)
        found = np.minimum(found, inside)
    return found


def _error(page: Drawing, frame: Box, plan: Plan, run: ClosedLoopRun) -> None:
    """The distance over time with the tolerance; below it the clearance where there is something to clear."""
    near = MM * distances(plan, run)
    # Within this distance x and y are both within their tolerances.
    tolerance = MM * float(min(plan.scene.planning.goal_tolerance[:2]))
    span = (float(run.times[0]), max(float(run.times[-1]), float(run.times[0]) + 1e-6))
    left, top, right, bottom = frame
    foot = bottom - (0.4 * (bottom - top) if _has_clearance(plan.scene) else 0.0)
    most = 1.08 * max(float(near.max()), 1.3 * tolerance)
    panel = Panel(page, (left, top, right, foot), (span[0], 0.0, span[1], most), equal=False)
    panel.axes("", "", (False, True))
    # Names lie above their axes: upright ones are longer than the axes are high.
    goal = "goal" if _plans_anew(run) else "reference"
    page.add(d.Text(left, top - 4, f"distance from the {goal} [mm]", 8.5, SOFT), 20)
    if _has_clearance(plan.scene):
        some = np.unique(np.linspace(0, len(run.times) - 1, MOST_SAMPLES).astype(int))
        gap = MM * clearances(plan.scene, run.object[some])
        low, high = min(float(gap.min()), 0.0), 1.08 * max(float(gap.max()), 1.0)
        below = Panel(page, (left, foot + 20, right, bottom), (span[0], low, span[1], high), equal=False)
        below.axes("", "", (False, True))
        below.line(np.stack([run.times[some], gap], axis=1), CLEARANCE, 3)
        least = f"least {gap.min():.{2 if abs(gap.min()) < 1 else 1}f} mm".replace("-", "−")
        page.add(d.Text(left, foot + 16, "clearance [mm]", 8.5, SOFT), 20)
        page.add(d.Text(right, foot + 16, least, 7.5, palette.OBSTACLE, "end"), 20)
    panel.line(np.array([[span[0], tolerance], [span[1], tolerance]]), TOLERANCE, 4)
    panel.line(np.stack([run.times, near], axis=1), ACTUAL, 5)


def _strip(
    page: Drawing,
    frame: Box,
    span: tuple[float, float],
    times: Array,
    values: Sequence[str],
    colours: dict[str, str],
) -> None:
    """What holds when, as coloured stretches from left to right."""
    left, top, right, bottom = frame
    names = np.array(values)
    starts = np.concatenate([[0], np.flatnonzero(names[1:] != names[:-1]) + 1])
    ends = np.append(times[starts[1:]], span[1])
    for first, end in zip(starts, ends, strict=True):
        x0, x1 = (left + (t - span[0]) / (span[1] - span[0]) * (right - left) for t in (times[first], end))
        corners = np.array([[x0, top], [x1, top], [x1, bottom], [x0, bottom]])
        page.add(d.Line(corners, Look(fill=colours[names[first]]), closed=True), 4)
    page.add(d.Line(np.array([[left, bottom], [right, bottom]]), Look(AXIS, 0.7)), 5)


def _table_box(plan: Plan, run: ClosedLoopRun, box: Box) -> Box:
    corners = transform(run.object[-1], plan.scene.object.outline.polyline())
    seen = MM * np.concatenate([transform(run.object, plan.scene.object.cof), corners])
    low, high = np.minimum(box[:2], seen.min(axis=0)), np.maximum(box[2:], seen.max(axis=0))
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def _legend(scene: Scene, run: ClosedLoopRun) -> list[Entry]:
    entries = [
        Entry("first plan" if _plans_anew(run) else "reference", REFERENCE),
        Entry("actual, centre of friction", ACTUAL),
        Entry("goal tolerance", TOLERANCE),
    ]
    if _has_clearance(scene):
        entries.append(Entry("clearance of the object", CLEARANCE))
    return entries + workspace_entries(scene)


def _strip_entries(run: ClosedLoopRun) -> tuple[list[Entry], list[Entry]]:
    """What the colours of the two strips mean, only those that can be seen."""
    contacts = [Entry(CONTACTS[c][0], Look(fill=CONTACTS[c][1]), "box") for c in _seen(run.contacts)]
    modes = [Entry(m, Look(fill=_colour(m, run)), "box") for m in _seen(run.modes)]
    return contacts, modes


def _seen(values: Sequence[str]) -> list[str]:
    """Those that hold long enough, in the order in which they begin."""
    least = LEAST_SEEN * len(values)
    return [value for value, count in Counter(values).items() if count >= least]


def _colour(mode: str, run: ClosedLoopRun) -> str:
    """Of a controller's mode; one that is not known gets a colour of its own."""
    if mode in MODES:
        return MODES[mode]
    unknown = [m for m in dict.fromkeys(run.modes) if m not in MODES]
    return palette.push_colour(6 + unknown.index(mode))


def _plans_anew(run: ClosedLoopRun) -> bool:
    return "look" in run.modes


def _has_clearance(scene: Scene) -> bool:
    return bool(scene.workspace.obstacles) or scene.workspace.bounds is not None


def _distance(points: Array, line: Array) -> Array:
    """Of points (n, 2) from a polyline (m, 2), shape (n,)."""
    start, step = line[:-1], np.diff(line, axis=0)
    away = points[:, None] - start[None]
    share = np.clip(np.sum(away * step, axis=2) / np.maximum(np.sum(step * step, axis=1), 1e-300), 0, 1)
    return np.asarray(np.min(np.linalg.norm(away - share[..., None] * step, axis=2), axis=1))
