"""Automatic push points: on each edge or smooth stretch, the contact with the smallest turning radius."""

from dataclasses import dataclass

import numpy as np

from ..contact.placement import SMOOTH_CORNER
from ..geometry import Outline, OutlinePoint
from ..geometry.pose import Array
from ..problem import Push, Scene
from .options import PushOption, push_option

# A stretch ends where its normal has turned this far, so that a smooth outline gets pushes from all sides.
STRETCH = np.deg2rad(90.0)
COARSE, REFINED = 11, 14


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of an outline without sharp corners, as edges and lengths along it."""

    name: str
    edges: tuple[int, ...]
    lengths: Array  # of the edges [m]; for a circle one quarter of the turn
    offset: float = 0.0  # where a circle's quarter starts, as a fraction of a turn

    def at(self, outline: Outline, fraction: float) -> OutlinePoint:
        """The point at a fraction of the stretch's length."""
        if outline.is_circle:
            return outline.at(0, self.offset + 0.25 * fraction)
        ends = np.cumsum(self.lengths)
        s = fraction * ends[-1]
        k = min(int(np.searchsorted(ends, s, side="right")), len(self.edges) - 1)
        along = (s - (ends[k] - self.lengths[k])) / self.lengths[k]
        return outline.at(self.edges[k], float(np.clip(along, 0.0, 1.0)))


def automatic_pushes(scene: Scene) -> tuple[tuple[Push, ...], tuple[PushOption, ...]]:
    """The pushes worth trying, and the best refused one of each stretch that has none."""
    found, refused = [], []
    for stretch in stretches(scene.object.outline):
        option = _best(scene, stretch)
        if option is None:
            continue
        if option.car is None:
            refused.append(option)
        else:
            found.append(option.push)
    return tuple(found), tuple(refused)


def stretches(outline: Outline) -> list[Stretch]:
    """Edges of an outline, joined where the corner between them is nearly smooth and the normal has not turned far."""
    if outline.is_circle:
        return [Stretch(f"side {k + 1}", (0,), np.ones(1), k / 4 - 1 / 8) for k in range(4)]
    normals = outline.edge_normals
    n = len(normals)
    turns = np.arccos(np.clip(np.einsum("ij,ij->i", np.roll(normals, 1, axis=0), normals), -1.0, 1.0))
    sharp = np.flatnonzero(turns > SMOOTH_CORNER)
    first = int(sharp[0]) if len(sharp) else 0
    lengths = np.linalg.norm(outline.edges[:, 1] - outline.edges[:, 0], axis=1)
    found: list[list[int]] = []
    turned = 0.0
    for k in range(n):
        edge = (first + k) % n
        turned += float(turns[edge])
        if not found or turns[edge] > SMOOTH_CORNER or turned > STRETCH:
            found.append([])
            turned = 0.0
        found[-1].append(edge)
    return [Stretch(f"edge {g[len(g) // 2]}", tuple(g), lengths[g]) for g in found]


def _best(scene: Scene, stretch: Stretch) -> PushOption | None:
    """Coarse search over the stretch, then golden section around its best."""
    tried: dict[float, PushOption] = {}

    def radius(fraction: float) -> float:
        at = stretch.at(scene.object.outline, fraction)
        if at.corner:
            return np.inf
        pusher = scene.pusher
        push = Push(stretch.name, at, pusher.fingers, pusher.spacing if pusher.fingers == 2 else 0.0)
        option = push_option(scene, push)
        tried[fraction] = option
        return option.car.radius if option.car is not None else np.inf

    grid = (np.arange(COARSE) + 0.5) / COARSE
    grid = grid[np.argsort(np.abs(grid - 0.5), kind="stable")]  # of equals, the one in the middle
    radii = [radius(float(f)) for f in grid]
    k = int(np.argmin(radii))
    if np.isfinite(radii[k]):
        centre, width, best = float(grid[k]), 1.0 / COARSE, radii[k]
        for _ in range(REFINED):
            width *= 0.618
            for f in (centre - width, centre + width):
                if 0 < f < 1 and (value := radius(f)) < best - 1e-9 * best:
                    centre, best = f, value
                    break
        return tried[centre]
    reasons = [o for o in tried.values() if o.refusal]
    return reasons[0] if reasons else None
