"""The picture of a plan: outlines at even travel, flat path, cones ([Zhou2017] Figs. 3, 6), and its pushes in order."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..geometry import inverse, rotate, transform
from ..geometry.pose import Array
from ..problem import Plan, PushSegment, Rollout, Scene, TableSegment, TransitSegment
from . import drawing as d
from . import palette, words
from .drawing import PAGE, SOFT, Box, Drawing, Look
from .labels import Labels, along
from .legend import EDGE, Entry, draw_legend, draw_title, frame_and_legend, legend_height, title_height
from .panel import BOTTOM, Panel
from .table import (
    MM,
    draw_endpoints,
    draw_fingers,
    draw_number,
    draw_object,
    draw_workspace,
    view_box,
    what_is_drawn,
    workspace_entries,
)
from .trace import PushTrace, fingertips, rollout_paths, trace_pushes

MOST_EDGES = 900  # of the search tree that are drawn
MOST_CELLS = 27  # pushes shown in the strip
MOST_COLUMNS = 9
CELL_HEIGHT = 68.0  # of the strip [pt]
ALONE, LIFTED = (3.0, 2.0), (1.0, 2.5)  # dashes
RUN = (4.0, 2.0)
SLIDING = (2.5, 1.5)
TUBE = Look(palette.TUBE, 0.5, opacity=0.8, fill=palette.TUBE, fill_opacity=0.2)


def draw_plan(plan: Plan, rollouts: Sequence[Rollout] = (), explored: Array | None = None) -> Drawing:
    """The picture of a plan, with simulated runs over it in red dashes, and the search tree.

    Args:
        explored: paths of the tree's edges, shape (m, k, 2) [m], drawn faintly beneath everything.
    """
    tree = explored is not None and len(explored) > 0
    traces = trace_pushes(plan)
    title, subtitle = words.plan_title(plan), words.plan_subtitle(plan)
    box = view_box(plan, traces, rollouts)
    entries = _legend(plan, traces, box, bool(rollouts), tree)
    frame, legend = frame_and_legend(box, entries, title_height(title, subtitle))
    # The strip stands under the legend where both find room beside the axes, else under all of it.
    cells, last = min(len(traces), MOST_CELLS), legend[1] + legend_height(entries, legend[2])
    columns = -(-cells // -(-cells // MOST_COLUMNS)) if cells else 0
    strip, wide = (EDGE, max(frame[3] + BOTTOM, last) + 6), PAGE - 2 * EDGE
    if legend[0] > EDGE and last + 12 + _strip_height(cells, 1) <= frame[3] + BOTTOM:
        strip, wide, columns = (legend[0], last + 12), legend[2], min(cells, 1)
    bottom = max(frame[3] + BOTTOM, last, strip[1] + _strip_height(cells, columns))
    page = Drawing(PAGE, bottom + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, *legend)
    panel = Panel(page, frame, box)
    panel.axes()
    if explored is not None and tree:
        for edge in MM * explored[:: max(1, -(-len(explored) // MOST_EDGES))]:
            panel.line(edge, Look(palette.TREE, 0.5, opacity=0.4), 0.9)
    draw_workspace(panel, plan.scene)
    labels = Labels(panel, what_is_drawn(plan, traces))
    for trace in traces:
        _draw_push(panel, plan, trace, labels)
    _draw_tube(panel, plan)
    _draw_transits(panel, plan)
    draw_endpoints(panel, plan, labels)
    for trace in traces[:1]:
        _draw_cones(panel, plan.scene, trace)
    for rollout in rollouts:
        _draw_rollout(panel, plan, rollout, traces, faint=len(rollouts) > 3)
    _draw_strip(
        page, plan.scene, plan.on_table, *strip, wide / max(columns, 3 if wide > PAGE / 2 else 1), columns
    )
    return page


def _draw_push(panel: Panel, plan: Plan, trace: PushTrace, labels: Labels) -> None:
    scene, colour = plan.scene, palette.push_colour(trace.number)
    last = len(trace.marks) - 1
    for index, (pose, pusher) in enumerate(zip(trace.marks, trace.pushers, strict=True)):
        switch = index == 0 and trace.number > 0
        if switch:
            draw_object(panel, scene, pose, Look(colour, 1.4, fill=colour, fill_opacity=0.10), 5)
        elif index < last:
            draw_object(panel, scene, pose, Look(colour, 0.7, (), 0.45, colour, 0.035))
        endpoint = index in (0, last)
        draw_fingers(panel, scene, fingertips(pusher, trace.segment.fingers), 0.95 if endpoint else 0.35)
    panel.line(MM * trace.segment.pusher[:, :2], Look(palette.PUSHER, 0.6, opacity=0.55), 4)
    for centre, sense in trace.centres:
        if panel.holds(MM * centre):
            panel.sign(MM * centre, sense > 0, colour)
    first = (
        trace.flat_path if trace.flat_path is not None else transform(trace.segment.object, scene.object.cof)
    )
    if trace.flat_path is not None:
        path = MM * trace.flat_path
        if trace.contact is not None:
            for pose, place in ((trace.marks[0], path[0]), (trace.marks[-1], path[-1])):
                lever = np.stack([MM * transform(pose, trace.contact), place])
                panel.line(lever, Look(colour, 0.8, (0.9, 1.5)), 6.8)
        panel.line(path, Look("#ffffff", 3.2, opacity=0.8), 6.9)
        panel.line(path, Look(colour, 1.9), 7)
        moving = np.flatnonzero(np.linalg.norm(path - path[-1], axis=1) > panel.unit(9.0))
        if len(moving):
            panel.arrow(path[moving[-1]], path[-1], colour, 1.9, 7.1)
        panel.disc(path[0], 2.4, Look("#ffffff", 0.7, fill=colour), 7.2)
    if not isinstance(trace.segment, PushSegment):
        panel.line(MM * first, Look(colour, 1.9, SLIDING), 7)
    if len(plan.on_table) > 1:
        draw_number(panel.page, labels.place(13.0, 13.0, along(panel, MM * first), free=True), trace.number)


def tube_bands(plan: Plan) -> list[Array]:
    """Where the centre of friction may be, from any start, in W: polygons (n, 2) [m], the start region's disc first."""
    known, certificate = plan.scene.object.uncertainty, plan.certificate
    if certificate is None or not certificate.tube or known is None or known.start is None:
        return []
    cof = plan.scene.object.cof
    turns = np.linspace(0.0, 2 * np.pi, 73)
    reach = known.start.moves(float(np.hypot(*cof)))
    bands = [transform(plan.scene.start_pose, cof) + reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)]
    for part, push in zip(certificate.tube, plan.pushes, strict=True):
        along = np.stack([-np.sin(push.pusher[:, 2]), np.cos(push.pusher[:, 2])], axis=1)
        path, aside = transform(push.object, cof), part.offset * along
        bands.append(np.concatenate([path + aside, (path - aside)[::-1]]))
    return bands


def _draw_tube(panel: Panel, plan: Plan) -> None:
    for band in tube_bands(plan):
        panel.area(MM * band, TUBE, 4.5)


def _draw_transits(panel: Panel, plan: Plan) -> None:
    """The pusher alone: dashed on the table, dotted while it is lifted."""
    for segment in plan.segments:
        if isinstance(segment, TransitSegment) and len(segment.times) > 1:
            path, lifted = MM * segment.pusher[:, :2], segment.height > 1e-6
            high = lifted[:-1] | lifted[1:]
            for part, dashes in ((~high, ALONE), (high, LIFTED)):
                for first, end in _runs(part):
                    panel.line(path[first : end + 1], Look(palette.PUSHER, 0.8, dashes), 4)


def _draw_cones(panel: Panel, scene: Scene, trace: PushTrace) -> None:
    """At the first contact: friction cone (blue) and the part of the motion cone that the plan uses (red)."""
    if trace.contact is None or trace.normal is None:
        return
    pose = trace.marks[0]
    half = np.arctan(scene.object.friction)
    normal = np.arctan2(trace.normal[1], trace.normal[0])
    cones = [(normal - half, normal + half, palette.FORCE, 1.0)]
    if trace.motion is not None:
        left, right = (float(np.arctan2(edge[1], edge[0])) for edge in trace.motion)
        cones.append((right, right + (left - right) % (2 * np.pi), palette.MOTION, 0.72))
    length = cone_length(scene, trace.contact, [a for low, high, *_ in cones for a in (low, high)])
    tip = MM * transform(pose, trace.contact)
    for low, high, colour, share in cones:
        size = share * MM * length
        edge = d.arc_points(tip, size, pose[2] + low, pose[2] + high)
        panel.area(np.concatenate([tip[None], edge]), Look(fill=colour, fill_opacity=0.22), 7.5)
        for end in edge[[0, -1]]:
            panel.line(np.stack([tip, end]), Look(colour, 1.0), 7.6)


def cone_length(scene: Scene, contact: Array, angles: Sequence[float]) -> float:
    """How long a cone at a contact is drawn [m]: 0.4 of the object's size, and it does not leave the object.

    Args:
        contact: on the outline or, as the middle of two, near it, in O.
        angles: of the cones' edges in O [rad]; those that leave at once do not count.
    """
    corners = scene.object.outline.polyline()
    size = scene.object.outline.size
    step = np.roll(corners, -1, axis=0) - corners
    length = 0.4 * size
    for angle in angles:
        ray = rotate(angle, np.array([1.0, 0.0]))
        with np.errstate(divide="ignore", invalid="ignore"):
            across = ray[0] * step[:, 1] - ray[1] * step[:, 0]
            away = corners - contact
            reach = (away[:, 0] * step[:, 1] - away[:, 1] * step[:, 0]) / across
            share = (away[:, 0] * ray[1] - away[:, 1] * ray[0]) / across
        hits = np.sort(reach[(share >= -1e-9) & (share <= 1 + 1e-9) & (reach > 0.02 * size)])
        # From the middle of two contacts in a notch a ray first enters the object, and leaves it later.
        length = min([length, *hits[1 - len(hits) % 2 :].tolist()])
    return length


def _draw_rollout(
    panel: Panel, plan: Plan, rollout: Rollout, traces: tuple[PushTrace, ...], faint: bool
) -> None:
    look = Look(palette.SIMULATED, 1.0, RUN, 0.35 if faint else 0.95)
    for path in rollout_paths(rollout, plan, traces):
        panel.line(MM * path, look, 8)
    draw_object(panel, plan.scene, rollout.final_pose, look, 8)


def _strip_height(cells: int, columns: int) -> float:
    return CELL_HEIGHT * -(-cells // columns) + 14.0 if cells else 0.0


def _draw_strip(
    page: Drawing,
    scene: Scene,
    pushes: Sequence[TableSegment],
    left: float,
    top: float,
    cell: float,
    columns: int,
) -> None:
    """The pushes in order, as an operator sets them up: the object as it was drawn, the fingers where they land."""
    if not pushes:
        return
    more = f"; the first {MOST_CELLS} of {len(pushes)}" if len(pushes) > MOST_CELLS else ""
    head = d.shortened(f"{words.STRIP}{more}", 8.0, PAGE - EDGE - left, bold=True)
    page.add(d.Text(left, top + 9, head, 8.0, SOFT, bold=True), 20)
    for number, push in enumerate(pushes[:MOST_CELLS]):
        row, column = divmod(number, columns)
        x, y = left + cell * column, top + 14 + CELL_HEIGHT * row
        _draw_cell(page, scene, push, number, (x, y, x + cell - 6, y + CELL_HEIGHT))


def _draw_cell(page: Drawing, scene: Scene, push: TableSegment, number: int, cell: Box) -> None:
    """One push in a cell of the page: the object in its frame O with the fingers at its start, number and name."""
    landing = transform(inverse(push.object[0]), transform(push.pusher[0], push.fingers))
    ahead = rotate(push.pusher[0, 2] - push.object[0, 2], np.array([1.0, 0.0]))
    size, middle = scene.object.outline.size, landing.mean(axis=0)
    tail, head = middle - 0.32 * size * ahead, middle - 0.06 * size * ahead
    shown = MM * np.concatenate([scene.object.outline.polyline(), landing, tail[None]])
    low, high = shown.min(axis=0) - 0.06 * MM * size, shown.max(axis=0) + 0.06 * MM * size
    picture = (cell[0], cell[1], min(cell[2], cell[0] + 72.0), cell[3] - 24.0)
    panel = Panel(page, picture, (float(low[0]), float(low[1]), float(high[0]), float(high[1])))
    colour = palette.push_colour(number)
    panel.area(MM * scene.object.outline.polyline(), Look(colour, 1.0, fill=colour, fill_opacity=0.12), 3)
    draw_fingers(panel, scene, landing)
    panel.arrow(MM * tail, MM * head, palette.PUSHER, 1.0)
    x, y = cell[0] + 6.5, picture[3] + 8.0
    draw_number(page, np.array([x, y]), number)
    room = cell[2] - x - 9
    page.add(d.Text(x + 9, y + 2.5, d.shortened(push.push, 7.5, room), 7.5, d.INK), 20)
    page.add(d.Text(x + 9, y + 11.5, d.shortened(words.word_of(push), 7.0, room), 7.0, SOFT), 20)


def _legend(plan: Plan, traces: Sequence[PushTrace], box: Box, simulated: bool, tree: bool) -> list[Entry]:
    low, high = np.reshape(box, (2, 2))
    several = len(traces) > 1
    entries: list[Entry] = []
    if any(t.flat_path is not None for t in traces):
        colour = SOFT if several else palette.push_colour(0)
        entries.append(Entry(words.FLAT_PATH, Look(colour, 1.9)))
    if any(not isinstance(t.segment, PushSegment) for t in traces):
        entries.append(
            Entry(words.SLIDE_PATH, Look(SOFT if several else palette.push_colour(0), 1.9, SLIDING))
        )
    if traces:
        entries.append(Entry(words.FINGERS, Look(palette.PUSHER, 0.9), "line and dot"))
    if any(isinstance(s, TransitSegment) for s in plan.segments):
        entries.append(Entry(words.ALONE, Look(palette.PUSHER, 0.9, ALONE)))
    if any(np.all((low <= MM * c) & (MM * c <= high)) for t in traces for c, _ in t.centres):
        entries.append(Entry(words.CENTRE, Look(SOFT, fill="#ffffff"), "dot", signs=True))
    if traces and traces[0].contact is not None:
        entries.append(
            Entry(words.FRICTION_CONE, Look(palette.FORCE, fill=palette.FORCE, fill_opacity=0.22), "box")
        )
        if traces[0].motion is not None:
            look = Look(palette.MOTION, fill=palette.MOTION, fill_opacity=0.22)
            entries.append(Entry(words.MOTION_CONE, look, "box"))
    if tube_bands(plan):
        entries.append(Entry(words.TUBE, TUBE, "box"))
    entries += workspace_entries(plan.scene)
    if tree:
        entries.append(Entry(words.TREE, Look(palette.TREE, 0.8)))
    if simulated:
        entries.append(Entry(words.SIMULATED, Look(palette.SIMULATED, 1.2, RUN)))
    return entries


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and end (one past the last) of every run of true flags."""
    padded = np.concatenate([[False], flags, [False]])
    turns = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(a), int(b)) for a, b in zip(turns[::2], turns[1::2], strict=True)]
