"""The picture of limit surfaces fitted to pairs of wrench and twist: one in space, and sections of all of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..documents.atomic import write_atomically
from ..friction.pairs import Pairs
from ..friction.report import twist_angles
from ..friction.surface import LimitSurface
from ..geometry.pose import Array
from . import palette
from .canvas import INK, SOFT, drawing_style, figure_bytes, headline, legend_below, new_figure
from .figure import check_ending

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

ENDINGS = (".svg", ".png")
COLOURS = {"ellipsoid": palette.PUSHES[1], "quartic": palette.GOAL, "loads": palette.PUSHES[0]}
_NEAR = np.sin(np.radians(20.0))  # data this close to a plane stand beside its section
_COARSE, _FINE = (15, 24), 121


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
    ending = check_ending(path, ENDINGS)
    with drawing_style():
        figure = new_figure(width=9.6, height=8.4)
        headline(figure, title or "limit surfaces from data", subtitle)
        grid = figure.add_gridspec(2, 2)
        _legend(figure, surfaces)
        space = figure.add_subplot(grid[0, 0], projection="3d")
        _draw_space(space, *next(iter(surfaces.values())), pairs, length)
        reach = _reach(surfaces, pairs, length)
        for cell, (i, j) in zip((grid[0, 1], grid[1, 0], grid[1, 1]), ((0, 1), (0, 2), (1, 2)), strict=True):
            _draw_section(figure.add_subplot(cell), surfaces, pairs, length, i, j, reach)
        write_atomically(path, figure_bytes(figure, ending, title or "limit surfaces from data"))


_NAMES = ("force along x [N]", "force along y [N]", "torque / ℓ [N]")
_PLANES = {(0, 1): "without torque", (0, 2): "without force along y", (1, 2): "without force along x"}


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


def _draw_space(axes: "Axes3D", surface: LimitSurface, size: float, pairs: Pairs, length: float) -> None:
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    lat, lon = np.linspace(-np.pi / 2, np.pi / 2, _COARSE[0]), np.linspace(-np.pi, np.pi, _COARSE[1])
    B, L = np.meshgrid(lat, lon, indexing="ij")
    d = np.stack([np.cos(B) * np.cos(L), np.cos(B) * np.sin(L), np.sin(B)], axis=-1)
    P = _boundary(surface, size, d.reshape(-1, 3), length).reshape(d.shape)
    axes.plot_surface(
        *np.moveaxis(P, -1, 0),
        rstride=1,
        cstride=1,
        color="#9fc2e8",
        alpha=0.28,
        linewidth=0.25,
        edgecolor="#5d86b3",
    )
    F, V = _data(pairs, length)
    angles = np.degrees(twist_angles(surface.twist(pairs.wrenches), pairs.twists, length))
    dots = axes.scatter(*F.T, c=angles, cmap="viridis_r", vmin=0, vmax=30, s=16, depthshade=False, zorder=5)
    reach = float(np.max(np.abs(P)))
    lines = Line3DCollection(np.stack([F, F + 0.3 * reach * V], axis=1), colors=INK, linewidths=0.7, zorder=6)
    axes.add_collection3d(lines)
    axes.set(xlabel="fx [N]", ylabel="fy [N]", zlabel="τ / ℓ [N]")
    axes.set_box_aspect((1, 1, 1), zoom=1.1)
    limit = max(reach, float(np.percentile(np.abs(F), 97))) * 1.08
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit), zlim=(-limit, limit))
    axes.view_init(elev=22, azim=-55)
    axes.tick_params(pad=-1, labelsize=7.5)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1, 1, 1, 0))
        axis.labelpad = -4
        axis.set_major_locator(MaxNLocator(4))
    bar = axes.figure.colorbar(dots, ax=axes, shrink=0.62, pad=0.0, extend="max", location="left")
    bar.set_label("twist predicted off by [°]", fontsize=8.5)
    bar.ax.tick_params(labelsize=7.5)
    bar.outline.set_linewidth(0.4)


def _draw_section(
    axes: "Axes",
    surfaces: Mapping[str, tuple[LimitSurface, float]],
    pairs: Pairs,
    length: float,
    i: int,
    j: int,
    reach: float,
) -> None:
    """The curve of H = 1 in a coordinate plane, and the data near it with their twists."""
    k = 3 - i - j
    t = np.linspace(0, 2 * np.pi, _FINE)
    d = np.zeros((_FINE, 3))
    d[:, i], d[:, j] = np.cos(t), np.sin(t)
    for name, (surface, size) in surfaces.items():
        P = _boundary(surface, size, d, length)
        axes.plot(P[:, i], P[:, j], color=COLOURS.get(name, INK), linewidth=1.6, zorder=3)
    F, V = _data(pairs, length)
    near = np.abs(F[:, k]) <= _NEAR * np.linalg.norm(F, axis=1)
    axes.quiver(
        F[near, i], F[near, j], V[near, i], V[near, j],
        angles="xy", scale_units="xy", scale=1 / (0.22 * reach), color=SOFT, width=0.0045, headwidth=4, zorder=5,
    )  # fmt: skip
    axes.plot(F[near, i], F[near, j], "o", color=INK, markersize=3.4, mec="white", mew=0.4, zorder=6)
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel=_NAMES[i], ylabel=_NAMES[j])
    axes.set_title(f"section {_PLANES[i, j]}", loc="left", color=SOFT)
    axes.set_aspect("equal", adjustable="box")
    axes.grid(True, color="#ececec", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _legend(figure: "Figure", surfaces: Mapping[str, tuple[LimitSurface, float]]) -> None:
    from matplotlib.lines import Line2D

    entries = [
        Line2D([], [], color=COLOURS.get(name, INK), linewidth=1.8, label=_LABELS.get(name, name))
        for name in surfaces
    ]
    entries += [
        Line2D(
            [],
            [],
            linestyle="",
            marker="o",
            color=INK,
            markersize=4,
            label="measured wrench (sections: within 20°)",
        ),
        Line2D([], [], color=SOFT, linewidth=0.9, label="direction of its twist"),
    ]
    legend_below(figure, entries)


_LABELS = {
    "ellipsoid": "ellipsoid",
    "quartic": "convex quartic",
    "loads": "Coulomb friction at known places, fitted loads",
}
