"""[Zhou2017] Figs. 1 and 2, Proposition 1 and Theorem 1 as pictures, each with the number that proves it.

The object is the paper's rectangle with its fitted matrix; one finger pushes at the middle of a side (symmetric), and
beside it (general).
"""

from pathlib import Path

import numpy as np

from ..contact import PointContact
from ..friction import Ellipsoid
from ..geometry import compose, exp, pose_error, rotate, transform
from ..geometry.pose import Array
from ..problem import Object, Planning, Push, Scene
from ..steering import flat_output
from .finding import Finding, Row, drawn

HALF = np.array([0.0255, 0.018])  # of the rectangle [m]
CORNERS = HALF * [(-1, -1), (1, -1), (1, 1), (-1, 1)]
SURFACE = Ellipsoid(np.diag([1.0215, 1.0215, 1936.73]))
FRICTION = 0.3
PLACES = {"middle of the side": (0.0, -0.018), "2 mm beside it": (0.002, -0.018)}
FORCES = 9  # drawn across the friction cone
# Body twists of the path that is drawn for Theorem 1: shares of the tightest turn to the left, and flat lengths [m].
PATH = ((0.8, 0.12), (-0.9, 0.1), (0.0, 0.03))


def contact(place: tuple[float, float]) -> PointContact:
    """The finger at a place of the lower side; the centre of friction is the middle of the rectangle."""
    return PointContact(np.array(place), np.array([0.0, 1.0]), FRICTION)


def scene() -> Scene:
    thing = Object(CORNERS, "outline", FRICTION, SURFACE, name="rectangle")
    pushes = tuple(Push(name, thing.outline.nearest(place)) for name, place in PLACES.items())
    return Scene(thing, (0.0, 0.0, 0.0), pushes=pushes, planning=Planning(friction_margin=0.0))


def centres(at: PointContact) -> tuple[Array, Array]:
    """Forces across the friction cone, shape (n, 2), and the rotation centre that each causes, shape (n, 2)."""
    edges = at.force_edges()
    left, right = (float(np.arctan2(f[1], f[0])) for f in (edges.left, edges.right))
    # An even number, so that none of them drives straight.
    angles = np.linspace(right, left, FORCES + FORCES % 2)
    forces = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    twists = np.array([SURFACE.matrix @ at.wrench(force) for force in forces])
    return forces, np.stack([-twists[:, 1], twists[:, 0]], axis=1) / twists[:, 2:]


def line_errors() -> dict[str, float]:
    """How far [m] rotation centres lie off the line that Proposition 1 gives: at ρ/r from the COF, upright on r."""
    rho, found = SURFACE.matrix[0, 0] / SURFACE.matrix[2, 2], {}
    for name, place in PLACES.items():
        at = contact(place)
        r = float(np.hypot(*at.point))
        found[name] = float(np.max(np.abs(centres(at)[1] @ (-at.point / r) - rho / r)))
    return found


def path() -> tuple[Array, Array]:
    """A path of the object, poses (n, 3), and the body twist at each, shape (n, 3)."""
    flat = flat_output(contact(PLACES["middle of the side"]), SURFACE)
    pose, poses, twists = np.zeros(3), [], []
    for share, length in PATH:
        w = share / flat.min_radius
        ahead = rotate(flat.heading_offset, [1.0, 0.0])
        V = np.array([ahead[0] + w * flat.flat_point[1], ahead[1] - w * flat.flat_point[0], w])
        steps = np.linspace(0, length, 60)
        poses.append(compose(pose, exp(steps[:, None] * V)))
        twists.append(np.tile(V, (len(steps), 1)))
        pose = poses[-1][-1]
    return np.concatenate(poses), np.concatenate(twists)


def points() -> dict[str, float]:
    """Points of the line of rotation centres, as abscissae [m]: the middle, and one to each side of it."""
    flat = flat_output(contact(PLACES["middle of the side"]), SURFACE)
    return {"the middle": flat.along, "left of it": 0.6 * flat.c_right, "right of it": 0.6 * flat.c_left}


def recovered() -> dict[str, tuple[float, float]]:
    """What is recovered from the path of each point alone: how far poses lie off the true ones, mm and degrees alike,
    and how far what the force makes of the table lies off the true twist, as a share of that."""
    poses, twists = path()
    at, found = contact(PLACES["middle of the side"]), {}
    for name, along in points().items():
        flat = flat_output(at, SURFACE, along)
        z, p, w = flat.position(poses), flat.flat_point, twists[:, 2:]
        dz = rotate(poses[:, 2], twists[:, :2] + w * np.array([-p[1], p[0]]))
        ddz = w * np.stack([-dz[:, 1], dz[:, 0]], axis=1)
        back, forces = flat.recover(z, dz, ddz)
        off = np.max(np.abs(pose_error(back, poses)) * [1000, 1000, 180 / np.pi])
        driven = at.wrench(forces) @ SURFACE.matrix - twists  # P has the axes of O here
        found[name] = float(off), float(np.max(np.abs(driven)) / np.max(np.abs(twists)))
    return found


def find(quick: bool = False, data: Path | None = None) -> Finding:
    """Both are quick, and need no data."""
    flat = {name: flat_output(contact(place), SURFACE) for name, place in PLACES.items()}
    rho = SURFACE.matrix[0, 0] / SURFACE.matrix[2, 2]
    middle = flat["middle of the side"]
    rows = [
        Row(
            "Figs. 1 and 2a: turning radius of the symmetric push, ρ/(r μ)",
            f"{1000 * rho / (0.018 * FRICTION):.2f} mm by its formula",
            f"{1000 * middle.min_radius:.2f} mm",
            "No difference; the authors add the fingertip's radius to r, where the force does not act.",
        ),
        Row(
            "Fig. 2b: the same, 2 mm beside the middle",
            "by its general formulas",
            f"{1000 * flat['2 mm beside it'].min_radius:.2f} mm, flat point "
            f"{1000 * flat['2 mm beside it'].along:+.2f} mm beside the foot of the perpendicular",
            "The reduction needs the straight force strictly inside the cone, which the paper does not say.",
        ),
        *(
            Row(
                f"Proposition 1, {name}: rotation centres off one line at ρ/r from the centre of friction",
                "0, by proof",
                f"{1000 * off:.1e} mm for {FORCES + FORCES % 2} forces across the cone",
                "Rounding; Eq. 15 prints r as the distance of the line of force, which is r |fx| / |f|.",
            )
            for name, off in line_errors().items()
        ),
        *(
            Row(
                f"Theorem 1, {name}: poses and forces recovered from the path of that point alone",
                "exact, by proof",
                f"within {off:.1e} mm and degrees; forces within {share:.1e} of themselves",
                "Rounding; the general formula of the force is corrected (Eq. 33).",
            )
            for name, (off, share) in recovered().items()
        ),
    ]
    return Finding(tuple(rows), drawn(draw, ("figs1_2.svg",)))


def run(folder: Path | None = None) -> str:
    """The rows; with a folder, also figs1_2.svg, proposition1.svg and theorem1.svg."""
    return find().saved(folder)


def draw(folder: Path) -> None:
    """The three figures."""
    from ..planning import describe
    from ..view import describe_figure
    from ..view.sketches import sketches

    query = scene()
    describe_figure(query, sketches(query, describe(query)), folder / "figs1_2.svg")
    _draw_line(folder / "proposition1.svg")
    _draw_points(folder / "theorem1.svg")


def _draw_line(target: Path) -> None:
    """Forces across the cone, and the line on which their rotation centres lie."""
    from ..view import drawing as d
    from ..view import legend, palette
    from ..view.panel import Panel
    from ..view.picture import save_picture

    at = contact(PLACES["2 mm beside it"])
    forces, found = centres(at)
    title = "Proposition 1: forces through one contact turn the object about centres on one line"
    subtitle = (
        "each force and its centre share a shade; the line stands upright on the way from contact to centre"
    )
    entries = [
        legend.Entry("force", d.Look(palette.FORCE, 1.4)),
        legend.Entry("its rotation centre", d.Look(palette.DRIVE), "dot"),
        legend.Entry("centre of friction", d.Look(d.INK), "mass"),
        legend.Entry("the line at ρ/r", d.Look("#888888", 0.9, (4.0, 2.5))),
    ]
    reach = 1.15 * float(np.max(np.abs(found[[0, -1], 0])))
    box = (-1000 * reach, -50.0, 1000 * reach, 75.0)
    frame, below = legend.frame_and_legend(box, entries, legend.title_height(title, subtitle))
    page = d.Drawing(d.PAGE, below[1] + legend.legend_height(entries, below[2]) + legend.EDGE, title)
    legend.draw_title(page, title, subtitle)
    legend.draw_legend(page, entries, *below)
    panel = Panel(page, frame, box)
    panel.axes()
    panel.area(1000 * CORNERS, d.Look(d.INK, 1.4, fill="#f1f1ef"), 1)
    foot = -at.point / (at.point @ at.point) * SURFACE.matrix[0, 0] / SURFACE.matrix[2, 2]
    along = np.array([-foot[1], foot[0]]) / np.hypot(*foot)
    panel.line(1000 * (foot + np.array([[-1.0], [1.0]]) * along), d.Look("#888888", 0.9, (4.0, 2.5)), 2)
    panel.line(1000 * np.stack([at.point, foot]), d.Look(d.INK, 0.8, (1.0, 1.5)), 2)
    for k, (force, centre) in enumerate(zip(forces, found, strict=True)):
        shade = 0.35 + 0.65 * k / (len(forces) - 1)
        colour = _mixed(palette.FORCE, shade), _mixed(palette.DRIVE, shade)
        panel.arrow(1000 * at.point, 1000 * at.point + 60 * force, colour[0], 1.1)
        panel.line(1000 * np.stack([at.point, centre]), d.Look(colour[1], 0.5, opacity=0.6), 2)
        panel.disc(1000 * centre, 3.2, d.Look("#ffffff", 0.6, fill=colour[1]), 7)
    legend.draw_mass(page, panel.at(np.zeros(2)), 4.0, 8)
    save_picture(page, target)


def _draw_points(target: Path) -> None:
    """The object on its way, and the paths of three points of the line."""
    from ..view import drawing as d
    from ..view import legend, palette
    from ..view.panel import Panel
    from ..view.picture import save_picture

    poses, _ = path()
    at = contact(PLACES["middle of the side"])
    title = "Theorem 1: any point of the line of rotation centres is a flat output"
    subtitle = (
        "each path tells the whole motion: its tangent is the object's heading, its curvature the force"
    )
    colours = {"the middle": palette.FLAT, "left of it": palette.PUSHES[0], "right of it": palette.PUSHES[2]}
    entries = [legend.Entry(name, d.Look(colour, 1.6)) for name, colour in colours.items()]
    entries.append(legend.Entry("line of rotation centres", d.Look("#888888", 0.9, (4.0, 2.5))))
    outlines = [1000 * transform(pose, CORNERS) for pose in poses[:: len(poses) // 6]]
    flats = {name: flat_output(at, SURFACE, along) for name, along in points().items()}
    lines = {name: 1000 * flat.position(poses) for name, flat in flats.items()}
    every = np.concatenate([*outlines, *lines.values()])
    low, high = every.min(axis=0) - 5, every.max(axis=0) + 5
    box = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    frame, below = legend.frame_and_legend(box, entries, legend.title_height(title, subtitle))
    last = max(frame[3] + 34, below[1] + legend.legend_height(entries, below[2])) + legend.EDGE
    page = d.Drawing(d.PAGE, last, title)
    legend.draw_title(page, title, subtitle)
    legend.draw_legend(page, entries, *below)
    panel = Panel(page, frame, box)
    panel.axes()
    for k, corners in enumerate(outlines):
        colour = palette.START if k == 0 else "#9a9a9a"
        panel.area(corners, d.Look(colour, 1.4 if k == 0 else 0.7), 2)
    for pose in (poses[0], poses[len(poses) // 2]):
        ends = np.stack([flats[name].position(pose) for name in ("left of it", "right of it")])
        panel.line(1000 * ends, d.Look("#888888", 0.9, (4.0, 2.5)), 3)
    for name, line in lines.items():
        panel.line(line, d.Look(colours[name], 1.5), 4)
        for k in (0, len(poses) // 2):
            panel.disc(line[k], 3.0, d.Look("#ffffff", 0.6, fill=colours[name]), 6)
    save_picture(page, target)


def _mixed(colour: str, share: float) -> str:
    """A colour on white: 1 is the colour itself."""
    parts = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(255 + share * (part - 255)):02x}" for part in parts)
