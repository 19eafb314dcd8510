"""The picture of many disturbed runs: the tube in which the object stays, its width, and where the object ends."""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..geometry import transform
from ..geometry.pose import Array
from ..simulation.study import Runs
from . import drawing as d
from . import palette
from .drawing import INK, PAGE, SOFT, Box, Drawing, Look
from .labels import Labels
from .legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
from .panel import BOTTOM, LEFT, Panel
from .picture import check_ending, save_picture
from .table import (
    MM,
    draw_endpoints,
    draw_object,
    draw_workspace,
    outline_at,
    view_box,
    what_is_drawn,
    workspace_entries,
)
from .trace import trace_pushes

MOST_DRAWN = 200
BANDS = ((0.025, 0.975, 0.22), (0.25, 0.75, 0.42))  # quantiles and opacity
FEWEST = 5  # runs under way at a sample, for a band there
ACROSS = 62.0  # height of the panel that shows how wide the tube is [pt]
TOLERANCE = Look(palette.GOAL, 1.0, (3.0, 2.0))
PUSH_ENDS = Look(SOFT, 0.6, (2.0, 2.0))
STUCK, SLIPPED = palette.PUSHES[0], palette.SIMULATED
FAR_OFF = 4.0  # times the width of 95 % of the ends; a picture of all of them would show only the few
THIN = 0.02  # width over length below which ends lie on a line, not in an ellipse
CHI_SQUARE = 5.991  # of two degrees of freedom at 95 %


def tube_figure(runs: Runs, path: str | Path) -> None:
    """Draws the band that holds the centre of friction in 95 % (and 50 %) of the runs, and the ends of the runs.

    At every sample of the plan the band holds these parts of the runs that are still under way, counted across the
    direction in which their middle moves. A tube is narrow beside the table it lies on, so that its width is drawn a
    second time, at its own scale, over the way.

    Args:
        runs: recorded (study(…, record=True)).
        path: ends in .svg or .png.

    Raises:
        InputError: if nothing was recorded, the ending is another, or the file cannot be written.
    """
    check_ending(path)
    if runs.object is None:
        raise InputError("the tube needs runs that were recorded", hint="study(…, record=True)")
    save_picture(draw_tube(runs), path)


def draw_tube(runs: Runs) -> Drawing:
    """The same as a drawing; the runs are recorded."""
    assert runs.object is not None
    plan = runs.plan
    title, subtitle = f"{plan.scene.object.name}: {len(runs)} runs of this plan", _subtitle(runs)
    top = title_height(title, subtitle) + 6
    traces = trace_pushes(plan)
    box = _table_box(runs, view_box(plan, traces))
    left = EDGE + LEFT
    wide = 0.62 * (PAGE - 2 * EDGE) - LEFT
    height = float(np.clip(wide * (box[3] - box[1]) / (box[2] - box[0]), 190.0, 300.0))
    right = left + wide + 12 + LEFT
    across = top + height + BOTTOM + 22
    entries = _legend(runs)
    below = across + ACROSS + BOTTOM
    page = Drawing(PAGE, below + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, below, PAGE - 2 * EDGE)

    table = Panel(page, (left, top, left + wide, top + height), box)
    table.axes()
    draw_workspace(table, plan.scene)
    drawn = [what_is_drawn(plan, traces)]
    drawn += [MM * outline_at(plan.scene, pose) for pose in runs.final[:MOST_DRAWN]]
    draw_endpoints(table, plan, Labels(table, np.concatenate(drawn)))
    for pose in runs.final[:MOST_DRAWN]:
        draw_object(table, plan.scene, pose, Look(palette.SIMULATED, 0.35, opacity=0.22), 2)
    found = tubes(runs)
    for middle, across_way, bands in found:
        for low, high, opacity in bands:
            a, b = middle + low[:, None] * across_way, middle + high[:, None] * across_way
            table.area(np.concatenate([a, b[::-1]]), Look(fill=palette.SIMULATED, fill_opacity=opacity), 5)
        table.line(middle, Look(palette.SIMULATED, 0.8), 7)

    ends = Panel(page, (right, top + 14, PAGE - EDGE, top + height), ends_box(runs))
    ends.axes()
    page.add(d.Text(right, top + 7, "ends of the drawing's origin", 8.0, SOFT, bold=True), 20)
    _ends(ends, runs)
    _width(page, (left, across, PAGE - EDGE, across + ACROSS), found)
    return page


Tube = tuple[Array, Array, list[tuple[Array, Array, float]]]


def tubes(runs: Runs) -> list[Tube]:
    """The tube of recorded runs [mm], one for each stretch in which the object moves."""
    assert runs.object is not None
    cof = runs.plan.scene.object.cof
    paths = transform(runs.object[..., :3].reshape(-1, 3), cof).reshape(*runs.object.shape[:2], 2)
    stretches = [tube_across(MM * paths[:, first:last]) for first, last in _stretches(paths)]
    return [tube for tube in stretches if tube is not None]


def tube_across(paths: Array) -> Tube | None:
    """The tube of one stretch of runs, paths (n, m, 2): its middle, the direction across, and the bands across it.

    Returns:
        Middle and unit vectors across it, to the left, shape (k, 2) each; and for each band the offsets of its right
        and left border, shape (k,) each in the unit of the paths, with its opacity. None where too few runs are left.
    """
    enough = np.count_nonzero(np.isfinite(paths[..., 0]), axis=0) >= min(FEWEST, len(paths))
    paths = paths[:, enough]
    if paths.shape[1] < 2:
        return None
    middle = np.nanmedian(paths, axis=0)
    ahead = np.gradient(middle, axis=0)
    size = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = ahead / np.where(size > 0, size, 1.0)
    across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    offsets = np.einsum("nmi,mi->nm", paths - middle, across)
    return middle, across, [(*np.nanquantile(offsets, [a, b], axis=0), opacity) for a, b, opacity in BANDS]


def ends_box(runs: Runs) -> Box:
    """What shows the ends, the goal and its tolerance [mm].

    Every end, and their ellipse, unless a few lie so far off that nothing could be told of the others: then 95 % of
    them in x and in y.
    """
    goal = MM * runs.plan.scene.goal_pose[:2]
    tolerance = MM * np.array(runs.plan.scene.planning.goal_tolerance[:2])
    ends = MM * runs.final[:, :2]

    def around(points: Array) -> tuple[Array, Array]:
        shown = np.concatenate([points, (goal - tolerance)[None], (goal + tolerance)[None]])
        return shown.min(axis=0), shown.max(axis=0)

    half = MM * np.sqrt(CHI_SQUARE * np.diag(runs.covariance)[:2]) * has_ellipse(runs)
    low, high = around(np.concatenate([ends, [MM * runs.mean[:2] - half, MM * runs.mean[:2] + half]]))
    nearer = around(np.quantile(ends, [0.025, 0.975], axis=0))
    if np.max(high - low) > FAR_OFF * np.max(nearer[1] - nearer[0]):
        low, high = nearer
    border = max(0.12 * float(np.max(high - low)), 0.05)
    return (
        float(low[0] - border), float(low[1] - border), float(high[0] + border), float(high[1] + border),
    )  # fmt: skip


def _stretches(paths: Array) -> list[tuple[int, int]]:
    """Samples between which the runs move, one stretch from rest to rest."""
    with np.errstate(invalid="ignore"):
        steps = np.hypot(*np.moveaxis(np.diff(paths, axis=1), -1, 0))
        known = np.isfinite(steps).any(axis=0)
        moving = np.where(known, np.max(np.nan_to_num(steps), axis=0), 0.0) > 1e-6
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(int)))
    return [(int(a), int(b) + 1) for a, b in edges.reshape(-1, 2)]


def _width(page: Drawing, frame: Box, tubes: list[Tube]) -> None:
    """The bands over the way along the middle of the tube, at their own scale; a line where a push ends."""
    start, rows = 0.0, []
    for middle, _, bands in tubes:
        way = start + np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))])
        rows.append((way, bands))
        start = float(way[-1])
    most = max(
        (float(np.max(np.abs([low, high]))) for _, bands in rows for low, high, _ in bands), default=0.0
    )
    reach = 1.1 * max(most, 1e-3)
    panel = Panel(page, frame, (0.0, -reach, max(start, 1e-3), reach), equal=False)
    panel.axes("path of the centre of friction [mm]", "aside [mm]")
    page.add(
        d.Text(frame[0], frame[1] - 5, "how wide the tube is (+ left of its middle)", 8.0, SOFT, bold=True),
        20,
    )
    for way, bands in rows:
        for low, high, opacity in bands:
            ring = np.stack([np.concatenate([way, way[::-1]]), np.concatenate([low, high[::-1]])], axis=1)
            panel.area(ring, Look(fill=palette.SIMULATED, fill_opacity=opacity), 5)
        panel.line(np.array([[way[0], 0.0], [way[-1], 0.0]]), Look(palette.SIMULATED, 0.8), 7)
        panel.line(np.array([[way[-1], -reach], [way[-1], reach]]), PUSH_ENDS, 2)


def has_ellipse(runs: Runs) -> bool:
    """Whether the ends spread in two directions, so that an ellipse stands for them."""
    if len(runs) < 3:
        return False
    less, more = np.linalg.eigvalsh(runs.covariance[:2, :2]).tolist()
    return bool(less > max(1e-14, THIN**2 * more))


def _ends(panel: Panel, runs: Runs) -> None:
    """Final positions with ticks along O's x, their mean and 95 % ellipse, the goal with its tolerance."""
    scene = runs.plan.scene
    points, goal = MM * runs.final[:, :2], MM * scene.goal_pose[:2]
    tick = panel.unit(5.0)
    for some, colour in ((runs.sticking, STUCK), (np.logical_not(runs.sticking), SLIPPED)):
        for point, angle in zip(points[some], runs.final[some, 2], strict=True):
            tip = point + tick * np.array([np.cos(angle), np.sin(angle)])
            panel.line(np.stack([point, tip]), Look(colour, 0.5, opacity=0.35), 3)
            panel.disc(point, 1.4, Look(fill=colour, fill_opacity=0.6), 4)
    x, y = MM * np.array(scene.planning.goal_tolerance[:2])
    panel.area(goal + np.array([[-x, -y], [x, -y], [x, y], [-x, y]]), TOLERANCE, 5)
    if has_ellipse(runs):
        values, vectors = np.linalg.eigh(MM**2 * runs.covariance[:2, :2])
        angles = np.linspace(0, 2 * np.pi, 73)[:-1]
        circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ring = MM * runs.mean[:2] + (circle * np.sqrt(CHI_SQUARE * np.maximum(values, 0))) @ vectors.T
        panel.area(ring, Look(INK, 1.1), 6)
    outside = sum(not panel.holds(point) for point in points)
    if outside:
        corner = np.array([panel.box[2] - panel.unit(4.0), panel.box[1] + panel.unit(8.0)])
        panel.text(corner, f"{outside} ends further off", SOFT, 7.5, "end")
    _cross(panel, MM * runs.mean[:2], INK, 4.5, 0.0)
    _cross(panel, goal, palette.GOAL, 4.0, np.pi / 4)


def _cross(panel: Panel, centre: Array, colour: str, arm: float, turn: float) -> None:
    """Two strokes of so many points from a drawn centre."""
    for angle in (turn, turn + np.pi / 2):
        step = panel.unit(arm) * np.array([np.cos(angle), np.sin(angle)])
        panel.line(np.stack([centre - step, centre + step]), Look(colour, 1.5), 8)


def _table_box(runs: Runs, box: Box) -> Box:
    """What shows the plan and every end of the object."""
    size = 0.6 * MM * runs.plan.scene.object.outline.size
    low, high = (MM * f(runs.final[:, :2], axis=0) for f in (np.min, np.max))
    return (
        min(box[0], float(low[0]) - size),
        min(box[1], float(low[1]) - size),
        max(box[2], float(high[0]) + size),
        max(box[3], float(high[1]) + size),
    )


def _subtitle(runs: Runs) -> str:
    distance, turn = np.quantile(runs.errors, 0.5, axis=0)
    stuck = f"; stayed sticking in {100 * runs.sticking_share:.1f} % of the runs" if runs.plan.pushes else ""
    return f"off the goal in the median {_small(MM * distance)} mm and {_small(np.degrees(turn))}°{stuck}"


def _small(value: float) -> str:
    """With two digits; nothing that is there becomes 0."""
    return f"{value:.2f}" if value >= 0.005 or value == 0 else "<0.01"


def _legend(runs: Runs) -> list[Entry]:
    red = palette.SIMULATED
    entries = [
        Entry("centre of friction, 95 % of the runs", Look(fill=red, fill_opacity=BANDS[0][2]), "box"),
        Entry("50 % of the runs", Look(fill=red, fill_opacity=0.55), "box"),
        Entry("ends of the object", Look(red, 0.6, opacity=0.6)),
    ]
    if np.any(runs.sticking):
        entries.append(Entry("end of a run that stuck", Look(STUCK), "dot"))
    if not np.all(runs.sticking):
        entries.append(Entry("end of a run that slipped", Look(SLIPPED), "dot"))
    entries.append(Entry("mean and 95 % ellipse" if has_ellipse(runs) else "mean (+)", Look(INK, 1.1)))
    return [
        *entries,
        Entry("goal (×) and its tolerance", TOLERANCE),
        *([Entry("end of a push", PUSH_ENDS)] if runs.plan.pushes else []),
        *workspace_entries(runs.plan.scene),
    ]
