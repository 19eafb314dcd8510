"""The picture of limit surfaces fitted to pairs of wrench and twist: one in space, and sections of all of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..friction.pairs import Pairs
from ..friction.report import twist_angles
from ..friction.surface import LimitSurface
from ..geometry.pose import Array
from . import drawing as d
from . import palette
from .drawing import INK, PAGE, SOFT, Box, Drawing, Look
from .legend import EDGE, Entry, draw_legend, draw_title, legend_height, title_height
from .panel import BOTTOM, LEFT, Panel, number, ticks
from .picture import check_ending, save_picture

COLOURS = {"ellipsoid": palette.PUSHES[1], "quartic": palette.GOAL, "loads": palette.PUSHES[0]}
# Of angles from 0 to WORST: after the map viridis of S. van der Walt and N. Smith, from light to dark.
SHADES = ("#fde725", "#90d743", "#35b779", "#21918c", "#31688e", "#443983", "#440154")
WORST = 30.0  # [°]
NEAR_PLANE = np.sin(np.radians(20.0))  # data this close to a plane stand beside its section
COARSE, FINE = (15, 25), 121
VIEW = np.radians(22.0), np.radians(-55.0)  # from which the surface is seen: elevation, azimuth
SKIN = Look("#5d86b3", 0.3, opacity=0.7, fill="#9fc2e8", fill_opacity=0.24)
NAMES = ("force along x [N]", "force along y [N]", "torque / ℓ [N]")
SHORT = ("fx [N]", "fy [N]", "τ / ℓ [N]")
PLANES = {(0, 1): "without torque", (0, 2): "without force along y", (1, 2): "without force along x"}
LABELS = {
    "ellipsoid": "ellipsoid",
    "quartic": "convex quartic",
    "loads": "Coulomb friction at known places, fitted loads",
}


def surface_figure(
    surfaces: Mapping[str, tuple[LimitSurface, float]],
    pairs: Pairs,
    length: float,
    path: str | Path,
    *,
    title: str = "",
    subtitle: str = "",
) -> None:
    """Draws limit surfaces with the data they were fitted to, as ".svg" or ".png".

    Torques are divided by the length, so that all axes are in newtons and a twist (v, length · ω) stands normal on
    the surface of its wrench.

    Args:
        surfaces: name → surface and the size of the wrenches with H = 1 [N] (1 where the surface is in N itself).
            The first one is drawn in space.
        pairs: the data.
        length: characteristic length [m].

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    check_ending(path)
    drawn = draw_surfaces(surfaces, pairs, length, title or "limit surfaces from data", subtitle)
    save_picture(drawn, path)


def draw_surfaces(
    surfaces: Mapping[str, tuple[LimitSurface, float]], pairs: Pairs, length: float, title: str, subtitle: str
) -> Drawing:
    """The same as a drawing."""
    entries = _legend(surfaces)
    top, side = title_height(title, subtitle) + 16, (PAGE - 2 * EDGE) / 2 - LEFT - 8
    rows = [top, top + side + BOTTOM + 22]
    below = rows[1] + side + BOTTOM
    page = Drawing(PAGE, below + legend_height(entries, PAGE - 2 * EDGE) + EDGE, title)
    draw_title(page, title, subtitle)
    draw_legend(page, entries, EDGE, below, PAGE - 2 * EDGE)
    columns = [EDGE + LEFT, EDGE + 2 * LEFT + side + 16]
    reach = _reach(surfaces, pairs, length)
    _draw_space(
        page,
        (columns[0], rows[0], columns[0] + side, rows[0] + side),
        *next(iter(surfaces.values())),
        pairs,
        length,
    )
    for (column, row), (i, j) in zip(((1, 0), (0, 1), (1, 1)), PLANES, strict=True):
        x, y = columns[column], rows[row]
        panel = Panel(page, (x, y, x + side, y + side), (-reach, -reach, reach, reach))
        _draw_section(panel, surfaces, pairs, length, i, j, reach)
    return page


def _boundary(surface: LimitSurface, size: float, directions: Array, length: float) -> Array:
    """The points with H = 1 along unit directions (n, 3), in newtons."""
    F = directions * [1.0, 1.0, length]
    return size * directions / np.asarray(surface.value(F))[:, None] ** (1 / surface.degree)


def _data(pairs: Pairs, length: float) -> tuple[Array, Array]:
    """Wrenches in newtons and unit twists."""
    V = pairs.twists * [1.0, 1.0, length]
    return pairs.wrenches / [1.0, 1.0, length], V / np.linalg.norm(V, axis=1, keepdims=True)


def _reach(surfaces: Mapping[str, tuple[LimitSurface, float]], pairs: Pairs, length: float) -> float:
    """Half the width of the axes: what the surfaces and nearly all data need."""
    F, _ = _data(pairs, length)
    sizes = [
        np.max(
            np.abs(_boundary(surface, size, np.vstack([np.eye(3), np.eye(3)[[1, 2, 0]] + np.eye(3)]), length))
        )
        for surface, size in surfaces.values()
    ]
    return 1.4 * max(float(np.percentile(np.abs(F), 97)), *map(float, sizes))


def _draw_space(
    page: Drawing, frame: Box, surface: LimitSurface, size: float, pairs: Pairs, length: float
) -> None:
    """The surface as seen from VIEW, its faces and the data from the back to the front, and the axes through it."""
    lat, lon = np.linspace(-np.pi / 2, np.pi / 2, COARSE[0]), np.linspace(-np.pi, np.pi, COARSE[1])
    B, L = np.meshgrid(lat, lon, indexing="ij")
    unit = np.stack([np.cos(B) * np.cos(L), np.cos(B) * np.sin(L), np.sin(B)], axis=-1)
    P = _boundary(surface, size, unit.reshape(-1, 3), length).reshape(unit.shape)
    F, V = _data(pairs, length)
    limit = 1.08 * max(float(np.max(np.abs(P))), float(np.percentile(np.abs(F), 97)))
    panel = Panel(page, frame, (-1.25 * limit, -1.25 * limit, 1.25 * limit, 1.25 * limit))
    page.add(d.Text(frame[0], frame[1] - 5, "the first surface in space", 8.0, SOFT, bold=True), 20)
    for axis in range(3):
        ends = limit * np.eye(3)[axis] * np.array([[-1.0], [1.0]])
        panel.line(_seen(ends), Look("#999999", 0.7), 1)
        for value in ticks(-limit, limit, 4):
            if value and abs(value) < 0.8 * limit:
                at = _seen(value * np.eye(3)[axis])
                panel.disc(at, 0.9, Look(fill="#999999"), 1)
                panel.text(at + panel.unit(1.0) * np.array([0.0, -7.0]), number(value), SOFT, 6.5, z=1.5)
        panel.text(_seen(1.15 * ends[1]), SHORT[axis], SOFT, 8.0)
    quads = np.stack([P[:-1, :-1], P[1:, :-1], P[1:, 1:], P[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    for quad in quads[np.argsort(_depth(quads.mean(axis=1)))]:
        panel.area(_seen(quad), SKIN, 3)
    angles = np.degrees(twist_angles(surface.twist(pairs.wrenches), pairs.twists, length))
    for k in np.argsort(_depth(F)):
        panel.line(_seen(np.stack([F[k], F[k] + 0.3 * limit * V[k]])), Look(INK, 0.7), 5)
        panel.disc(_seen(F[k]), 2.2, Look("#ffffff", 0.3, fill=_shade(float(angles[k]))), 6)
    _bar(page, frame)


def _bar(page: Drawing, frame: Box) -> None:
    """What the colours of the data mean."""
    left, bottom, wide = frame[0] + 4, frame[3] - 4, 90.0
    for k in range(30):
        x = left + wide * k / 30
        corners = np.array(
            [(x, bottom - 6), (x + wide / 30, bottom - 6), (x + wide / 30, bottom), (x, bottom)]
        )
        page.add(d.Line(corners, Look(fill=_shade(k)), closed=True), 5)
    for value in (0, 10, 20, 30):
        text = f"{value}°" if value < WORST else f"{value}° or more"
        anchor: d.Anchor = "middle" if value < WORST else "start"
        page.add(
            d.Text(left + wide * value / WORST - (value == WORST) * 6, bottom + 8, text, 6.5, SOFT, anchor),
            20,
        )
    page.add(d.Text(left, bottom - 10, "twist predicted off by", 7.0, SOFT), 20)


def _shade(angle: float) -> str:
    """The colour of an angle [°]."""
    place = min(angle / WORST, 1.0) * (len(SHADES) - 1)
    k = min(int(place), len(SHADES) - 2)
    low, high = (np.array([int(c[i : i + 2], 16) for i in (1, 3, 5)]) for c in SHADES[k : k + 2])
    return "#" + "".join(f"{round(v):02x}" for v in low + (place - k) * (high - low))


def _seen(points: Array) -> Array:
    """Where points (..., 3) are seen from VIEW, far away: (..., 2), to the right and up."""
    up, around = VIEW
    right = np.array([-np.sin(around), np.cos(around), 0.0])
    above = np.array([-np.sin(up) * np.cos(around), -np.sin(up) * np.sin(around), np.cos(up)])
    return points @ np.stack([right, above], axis=1)


def _depth(points: Array) -> Array:
    """How near points (n, 3) are to the eye."""
    up, around = VIEW
    return points @ np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])


def _draw_section(
    panel: Panel,
    surfaces: Mapping[str, tuple[LimitSurface, float]],
    pairs: Pairs,
    length: float,
    i: int,
    j: int,
    reach: float,
) -> None:
    """The curve of H = 1 in a coordinate plane, and the data near it with their twists."""
    panel.axes(NAMES[i], NAMES[j])
    head = f"section {PLANES[i, j]}"
    panel.page.add(d.Text(panel.frame[0], panel.frame[1] - 5, head, 8.0, SOFT, bold=True), 20)
    t = np.linspace(0, 2 * np.pi, FINE)
    directions = np.zeros((FINE, 3))
    directions[:, i], directions[:, j] = np.cos(t), np.sin(t)
    for name, (surface, size) in surfaces.items():
        P = _boundary(surface, size, directions, length)
        panel.line(P[:, [i, j]], Look(COLOURS.get(name, INK), 1.6), 3)
    F, V = _data(pairs, length)
    near = np.abs(F[:, 3 - i - j]) <= NEAR_PLANE * np.linalg.norm(F, axis=1)
    for force, twist in zip(F[near][:, [i, j]], V[near][:, [i, j]], strict=True):
        panel.arrow(force, force + 0.22 * reach * twist, SOFT, 0.9, 5)
        panel.disc(force, 2.2, Look("#ffffff", 0.4, fill=INK), 6)


def _legend(surfaces: Mapping[str, tuple[LimitSurface, float]]) -> list[Entry]:
    entries = [Entry(LABELS.get(name, name), Look(COLOURS.get(name, INK), 1.8)) for name in surfaces]
    return [
        *entries,
        Entry("measured wrench (sections: within 20°)", Look(INK), "dot"),
        Entry("direction of its twist", Look(SOFT, 0.9)),
    ]
