"""The pushes of a scene, one row each: the contact ([Zhou2017] Fig. 1) and the rotation centres (Fig. 2)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..documents.outline_reader import OutlineNote
from ..documents.shapes import DrawnOutline
from ..errors import InputError
from ..geometry import cross, perpendicular
from ..geometry.pose import Array
from ..planning.candidates import FEW
from ..problem import Scene
from . import drawing as d
from . import palette, words
from .drawing import INK, PAGE, SOFT, Box, Drawing, Look
from .labels import Labels, dense
from .legend import EDGE, Entry, draw_legend, draw_mass, draw_title, legend_height, title_height
from .panel import BOTTOM, LEFT, Panel
from .picture import check_ending, save_picture
from .plan_figure import cone_length
from .push_sketch import PushSketch
from .table import MM, tip_size

MOST_SIZES = (
    6.0  # sizes of the object; turning centres further from the centre of friction are only pointed at
)
REGION = 2.2  # sizes of the object to both sides, in which the centres of two fingers are shown
ROW, CAPTION = 190.0, 32.0  # height of the axes of a row, and of the words above them [pt]
BODY = Look(INK, 1.4, fill="#f1f1ef")
LINE, LEVER = Look("#888888", 0.8, (4.0, 2.5)), Look(INK, 0.8, (1.0, 1.5))
DRIVE_ARM = Look(palette.DRIVE, 0.9, (3.0, 2.0))
SIGN, DOT = 5.2, 3.4  # radius of a turning centre and of the flat point [pt]


def describe_figure(
    scene: Scene, descriptions: Sequence[PushSketch], path: str | Path, note: OutlineNote | None = None
) -> None:
    """Draws the pushes of a scene into a file, one row each, whole or not at all.

    Args:
        scene: whose object is drawn.
        descriptions: the pushes.
        path: ends in .svg or .png.
        note: of what the outline was made; a drawing is shown above the pushes.

    Raises:
        InputError: if the ending is another, the file cannot be written, or there is nothing to draw.
    """
    check_ending(path)
    if not descriptions:
        raise InputError("there is at least one push to describe", source=str(path))
    save_picture(draw_sketches(scene, descriptions, note), path)


def draw_sketches(scene: Scene, sketches: Sequence[PushSketch], note: OutlineNote | None = None) -> Drawing:
    """The same as a drawing."""
    title = f"{scene.object.name}: where it can be pushed, and how it turns"
    subtitle = (
        f"friction {scene.object.friction:g} between fingertip and object, model {scene.planning.model}"
    )
    entries = _legend(scene, sketches)
    top, width = title_height(title, subtitle), PAGE - 2 * EDGE
    head = top
    if note is not None and note.drawing is not None:
        top += CAPTION + ROW + BOTTOM
    below = top + len(sketches) * (CAPTION + ROW + BOTTOM) + 4
    page = Drawing(PAGE, below + legend_height(entries, width) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, below, width)
    left, middle = EDGE + LEFT, EDGE + LEFT + 0.4 * width
    if note is not None and note.drawing is not None:
        high = head + CAPTION
        page.add(d.Text(left, high - 8, "the drawing", 9.5, INK, bold=True), 20)
        draw_source(page, note.drawing, (left, high, middle - 12, high + ROW))
        y = high + 8
        for told in note.lines:
            for line in d.wrapped(told, 8.0, PAGE - EDGE - middle - LEFT, most=6):
                page.add(d.Text(middle + LEFT, y, line, 8.0, SOFT), 20)
                y += 11
            y += 4
    for row, sketch in enumerate(sketches):
        high = top + row * (CAPTION + ROW + BOTTOM) + CAPTION
        close = Panel(page, (left, high, middle - 12, high + ROW), _contact_box(scene, sketch))
        page.add(
            d.Text(left, high - 8, f"push “{d.shortened(sketch.name, 9, 150)}”", 9.5, INK, bold=True), 20
        )
        close.axes()
        _draw_contact(close, scene, sketch)
        frame = (middle + LEFT, high, PAGE - EDGE, high + ROW)
        if sketch.steers:
            wide = Panel(page, frame, _centres_box(scene, sketch))
            wide.axes(y="")
            _write(
                page, d.wrapped(caption(sketch), 8.0, frame[2] - frame[0], most=2), frame[0], high - 6, SOFT
            )
            _draw_centres(wide, scene, sketch)
        else:
            lines = d.wrapped(f"This push cannot steer: {sketch.refusal}", 8.0, frame[2] - frame[0], most=12)
            _write(page, lines, frame[0], high + 12 * len(lines), palette.MOTION)
    return page


def draw_source(page: Drawing, drawn: DrawnOutline, frame: Box) -> None:
    """What was drawn, in O: the outline that was taken in black, what was left out in grey, and the axes of O.

    The edges have their numbers where pushes are named by them.
    """
    outline = drawn.outline.polyline()
    size = drawn.outline.size
    low, high = outline.min(axis=0), outline.max(axis=0)
    parts = [part.points for part in drawn.left_out if len(part.points) > 1]
    # A sheet much larger than the object is not shown whole.
    for points in parts:
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    low, high = np.maximum(low, outline.min(axis=0) - size), np.minimum(high, outline.max(axis=0) + size)
    panel = Panel(page, frame, _box([np.stack([low, high])], 0.08 * size))
    panel.axes()
    panel.area(MM * outline, BODY, 2)
    for points in parts:
        panel.line(MM * points, Look("#9a9a9a", 0.8), 3)
    ring = MM * np.concatenate([outline, outline[:1]])
    axes = {"x of O": size * np.array([0.3, 0.0]), "y of O": size * np.array([0.0, 0.3])}
    lines = [ring, *(MM * np.stack([np.zeros(2), head]) for head in axes.values())]
    labels = Labels(panel, np.concatenate([dense(line, panel.unit(3.0)) for line in lines]))
    if not drawn.outline.is_circle and len(outline) <= FEW:
        for k, (middle, inward) in enumerate(
            zip(drawn.outline.edges.mean(axis=1), drawn.outline.edge_normals, strict=True)
        ):
            _name(panel, labels, MM * middle, -inward, str(k), SOFT)
    for name, head in axes.items():
        panel.arrow(np.zeros(2), MM * head, INK, 0.9, 6.5)
        if panel.holds(MM * head):
            _name(panel, labels, MM * head, head, name, INK)


def caption(sketch: PushSketch) -> str:
    """Turning radius, and where the flat point is, seen from the centre of friction along the straight motion."""
    ahead = np.asarray(sketch.straight) / np.linalg.norm(sketch.straight)
    offset = MM * (sketch.flat_point - sketch.cof)
    forward, aside = float(offset @ ahead), float(cross(ahead, offset))
    place = f"{abs(forward):.1f} mm {'ahead of' if forward >= 0 else 'behind'} the centre of friction"
    if abs(aside) >= 0.05:
        place += f", {abs(aside):.1f} mm to the {'left' if aside > 0 else 'right'}"
    return f"turns on a radius of {MM * sketch.turning_radius:.1f} mm or more; flat point {place}"


def _write(page: Drawing, lines: Sequence[str], x: float, last: float, colour: str) -> None:
    """Lines of which the last has its base line at a height [pt]."""
    for k, line in enumerate(reversed(lines)):
        page.add(d.Text(x, last - 11 * k, line, 8.0, colour), 20)


def _draw_contact(panel: Panel, scene: Scene, sketch: PushSketch) -> None:
    """[Zhou2017] Fig. 1: friction cone, motion cone, pushing direction u with its rotation centre, push frame."""
    _object(panel, scene, sketch)
    if sketch.steers:
        _rotation_centres(panel, sketch, pointers=False)
    cones = [
        (sketch.force_left, sketch.force_right, palette.FORCE, 1.0),
        (sketch.motion_left, sketch.motion_right, palette.MOTION, 0.72),
    ]
    angles = [float(np.arctan2(e[1], e[0])) for left, right, *_ in cones for e in (left, right)]
    length = MM * cone_length(scene, sketch.contact, [a for a in angles if np.isfinite(a)])
    tip = MM * sketch.contact
    edges = []
    for left, right, colour, share in cones:
        if not np.all(np.isfinite([left, right])):
            continue
        low = float(np.arctan2(right[1], right[0]))
        wide = (float(np.arctan2(left[1], left[0])) - low) % (2 * np.pi)
        edge = d.arc_points(tip, share * length, low, low + wide)
        panel.area(np.concatenate([tip[None], edge]), Look(fill=colour, fill_opacity=0.12), 5)
        for end in edge[[0, -1]]:
            panel.arrow(tip, end, colour, 1.1, 6)
            edges.append(np.stack([tip, end]))
    panel.line(np.stack([tip, MM * sketch.cof]), LEVER, 6)
    frame = _push_frame(scene, sketch)
    lines = [MM * np.stack([sketch.cof, head]) for _, head in frame] + edges
    outline = MM * scene.object.outline.polyline()
    lines.append(np.concatenate([outline, outline[:1]]))
    along = sketch.drive / np.linalg.norm(sketch.drive)
    head = tip + 1.35 * length * along
    if np.all(np.isfinite(head)):
        lines.append(np.stack([tip, head]))
    symbols = MM * np.stack([sketch.cof, sketch.contact, sketch.flat_point, sketch.drive_centre])
    labels = Labels(panel, np.concatenate([symbols, *(dense(line, panel.unit(3.0)) for line in lines)]))
    if np.all(np.isfinite(head)):
        panel.arrow(tip, head, palette.DRIVE, 1.5, 6.4)
        _name(panel, labels, head, along, "u", palette.DRIVE)
        _drive_centre(panel, sketch)
    for name, head in frame:
        panel.arrow(MM * sketch.cof, MM * head, INK, 0.9, 6.5)
        _name(panel, labels, MM * head, head - sketch.cof, name, INK)


def _draw_centres(panel: Panel, scene: Scene, sketch: PushSketch) -> None:
    """[Zhou2017] Fig. 2: rotation-centre line, rays, flat point, and the direction of the straight motion."""
    _object(panel, scene, sketch)
    _rotation_centres(panel, sketch, pointers=True)
    _drive_centre(panel, sketch)
    panel.arrow(MM * sketch.flat_point, MM * _ahead(scene, sketch), palette.STRAIGHT, 1.8, 8)


def _ahead(scene: Scene, sketch: PushSketch) -> Array:
    """The head of the arrow of the straight motion, in O."""
    unit = sketch.straight / np.linalg.norm(sketch.straight)
    return np.asarray(sketch.flat_point + 0.4 * scene.object.outline.size * unit)


def _drive_centre(panel: Panel, sketch: PushSketch) -> None:
    """The rotation centre that goes with u, and the arm to the contact, on which u stands upright."""
    centre = MM * sketch.drive_centre
    if np.all(np.isfinite(centre)):
        panel.line(np.stack([MM * sketch.contact, centre]), DRIVE_ARM, 3.2)
        if panel.holds(centre):
            panel.disc(centre, 3.0, Look("#ffffff", 0.7, fill=palette.DRIVE), 9.2)


def _object(panel: Panel, scene: Scene, sketch: PushSketch) -> None:
    panel.area(MM * scene.object.outline.polyline(), BODY, 1)
    tips, points = np.atleast_2d(sketch.fingertips), np.atleast_2d(sketch.contact_points)
    if len(tips) == 2:
        panel.line(MM * tips, Look(palette.PUSHER, 1.2), 3.9)
    for tip, point in zip(MM * tips, MM * points, strict=True):
        panel.disc(tip, tip_size(panel, scene), Look(palette.PUSHER, 0.8, fill="#bdbdbd"), 4)
        panel.disc(point, 1.3, Look(fill=INK), 8)
    # Of a size that leaves the flat point beside it visible.
    middle = panel.at(MM * sketch.cof)
    radius = min(DOT + 0.6, max(panel.length(0.03 * MM * scene.object.outline.size), 2.0))
    draw_mass(panel.page, middle, radius, 7, panel.frame)


def _rotation_centres(panel: Panel, sketch: PushSketch, pointers: bool) -> None:
    """The line, its two rays or regions and their ends; pointers to what lies outside the axes."""
    left, right = MM * sketch.left_centre, MM * sketch.right_centre
    along = (left - right) / np.linalg.norm(left - right)
    x0, y0, x1, y1 = panel.box
    reach = 4 * (x1 - x0 + y1 - y0) + float(np.linalg.norm(left - right))
    panel.line(np.stack([left + reach * along, right - reach * along]), LINE, 2)
    turns = ((1, left, palette.COUNTER_CLOCKWISE), (-1, right, palette.CLOCKWISE))
    if sketch.region is not None:
        _regions(panel, sketch)
    elif len(sketch.centres):
        senses = sense(sketch)
        for sign, _, colour in turns:
            panel.line(
                np.where((senses == sign)[:, None], MM * sketch.centres, np.nan), Look(colour, 2.0), 2.6
            )
    else:
        for sign, centre, colour in turns:
            panel.line(np.stack([centre, centre + sign * reach * along]), Look(colour, 2.0), 2.6)
    for sign, centre, colour in turns:
        if panel.holds(centre):
            panel.sign(centre, sign > 0, colour, SIGN, 9)
        elif pointers:
            _pointer(panel, centre, "+" if sign > 0 else "−", colour)
    panel.disc(MM * sketch.flat_point, DOT, Look("#ffffff", 0.8, fill=palette.FLAT), 9)


def _regions(panel: Panel, sketch: PushSketch) -> None:
    """The centres that keep two contacts, light; those that do so under any pressure, dark."""
    assert sketch.region is not None
    x, y = sketch.cof
    box = (panel.box[0] / MM - x, panel.box[1] / MM - y, panel.box[2] / MM - x, panel.box[3] / MM - y)
    for sign, colour in ((1, palette.COUNTER_CLOCKWISE), (-1, palette.CLOCKWISE)):
        corners = sketch.region.polygon(sign, box)
        if len(corners) > 2:
            panel.area(MM * (corners + sketch.cof), Look(colour, 0.8, fill=colour, fill_opacity=0.16), 1.5)
        dark = np.empty((0, 2)) if sketch.any_pressure is None else sketch.any_pressure.polygon(sign, box)
        if len(dark) > 2:
            panel.area(MM * (dark + sketch.cof), Look(fill=colour, fill_opacity=0.3), 1.6)


def sense(sketch: PushSketch) -> Array:
    """+1 for a counter-clockwise centre, −1 for a clockwise one, 0 for nan: a turn about it must push."""
    arm = sketch.contact - sketch.centres
    pushing = perpendicular(arm) @ np.asarray(sketch.normal)
    return np.where(np.isfinite(pushing), np.sign(pushing), 0.0)


def _pointer(panel: Panel, place: Array, sign: str, colour: str) -> None:
    """An arrow to a centre outside the axes, where the line from the middle leaves them, and where it is."""
    x0, y0, x1, y1 = panel.box
    middle, half = np.array([x0 + x1, y0 + y1]) / 2, np.array([x1 - x0, y1 - y0]) / 2
    away = place - middle
    border = middle + away / float(np.max(np.abs(away) / (0.97 * half)))
    panel.arrow(border - 0.12 * (border - middle), border, colour, 1.4, 9)
    text = f"{sign} at ({place[0]:.0f}, {place[1]:.0f}) mm".replace("-", "−")
    panel.text(border - 0.16 * (border - middle), text, colour, 7.5, "end" if away[0] > 0 else "start")


def _push_frame(scene: Scene, sketch: PushSketch) -> list[tuple[str, Array]]:
    """Names and heads in O of the axes of P: origin at the centre of friction, +y from the contact towards it."""
    towards = sketch.cof - sketch.contact
    distance = float(np.linalg.norm(towards))
    if distance == 0:
        return []
    y = towards / distance
    length = 0.2 * scene.object.outline.size
    return [("x of P", sketch.cof - length * perpendicular(y)), ("y of P", sketch.cof + length * y)]


def _name(panel: Panel, labels: Labels, head: Array, along: Array, name: str, colour: str) -> None:
    """A short name at the head of an arrow, where it covers no other name and no symbol."""
    width, height = d.text_width(name, 7.5), 7.5
    step = np.array([along[0], -along[1]])
    aside = np.array([-step[1], step[0]])
    half = 0.5 * np.array([width, height])
    ways = (step, step + aside, step - aside, aside, -aside)
    middles = [panel.at(head) + w / np.linalg.norm(w) * (far + half) for far in (4.0, 9.0) for w in ways]
    x, y = labels.place(width, height, middles)
    panel.page.add(d.Text(float(x), float(y) + 2.7, name, 7.5, colour, "middle", halo=True), 10, panel.frame)


def _contact_box(scene: Scene, sketch: PushSketch) -> Box:
    tips = np.atleast_2d(sketch.fingertips)
    shown = [scene.object.outline.polyline(), tips - sketch.tip_radius, tips + sketch.tip_radius]
    return _box(shown, 0.08 * scene.object.outline.size)


def _centres_box(scene: Scene, sketch: PushSketch) -> Box:
    outline, cof, size = scene.object.outline.polyline(), sketch.cof, scene.object.outline.size
    shown = [outline, sketch.fingertips - sketch.tip_radius, sketch.fingertips + sketch.tip_radius]
    shown.append(_ahead(scene, sketch)[None])
    for place in (sketch.left_centre, sketch.right_centre, sketch.flat_point, sketch.drive_centre):
        if np.all(np.isfinite(place)) and np.linalg.norm(place - cof) <= MOST_SIZES * size:
            # Beyond a centre there must be room to see where its ray goes.
            shown.append((cof + 1.15 * (place - cof))[None])
    if sketch.region is not None:
        # Room for the centres that are far away, where the darker regions are.
        along = (sketch.left_centre - sketch.right_centre) * REGION * size
        along /= max(float(np.linalg.norm(sketch.left_centre - sketch.right_centre)), 1e-300)
        shown.append(cof + np.stack([along, -along]))
    return _box(shown, 0.1 * size)


def _box(shown: list[Array], border: float) -> Box:
    points = np.concatenate(shown)
    low, high = points.min(axis=0), points.max(axis=0)
    border = max(border, 0.06 * float(np.max(high - low)))
    low, high = MM * (low - border), MM * (high + border)
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def _has_dark(scene: Scene, sketch: PushSketch) -> bool:
    """Whether centres that keep both contacts under any pressure are seen."""
    if sketch.any_pressure is None:
        return False
    box = np.array(_centres_box(scene, sketch)) / MM - np.tile(sketch.cof, 2)
    x0, y0, x1, y1 = box.tolist()
    return any(len(sketch.any_pressure.polygon(sign, (x0, y0, x1, y1))) > 2 for sign in (1, -1))


def _legend(scene: Scene, sketches: Sequence[PushSketch]) -> list[Entry]:
    """Only what is drawn."""
    force, motion = palette.FORCE, palette.MOTION
    entries = [
        Entry(words.FRICTION_CONE, Look(force, fill=force, fill_opacity=0.12), "box"),
        Entry("motion cone of the contact", Look(motion, fill=motion, fill_opacity=0.12), "box"),
        Entry("centre of friction", Look(INK), "mass"),
        Entry("contact to centre of friction", LEVER),
    ]
    steering = [s for s in sketches if s.steers]
    if not steering:
        return entries
    turns = (
        ("centres of left turns (+)", palette.COUNTER_CLOCKWISE),
        ("centres of right turns (−)", palette.CLOCKWISE),
    )
    if any(s.region is None for s in steering):
        entries += [Entry(label, Look(colour, 2.0)) for label, colour in turns]
    if any(s.region is not None for s in steering):
        entries += [Entry(label, Look(c, 0.8, fill=c, fill_opacity=0.16), "box") for label, c in turns]
    if any(_has_dark(scene, s) for s in steering):
        entries.append(Entry("darker: whatever the pressure", Look(fill="#8a8a8a"), "box"))
    entries += [
        Entry("line through the two centres", LINE),
        Entry("flat point (their middle)", Look(palette.FLAT), "dot"),
        Entry("straight motion", Look(palette.STRAIGHT, 1.8)),
    ]
    if any(np.all(np.isfinite(s.drive)) for s in steering):
        entries.append(Entry("u: a push to the left", Look(palette.DRIVE, 1.5)))
        entries.append(Entry("its rotation centre", Look(palette.DRIVE, 0.9, (3.0, 2.0)), "line and dot"))
    return entries
