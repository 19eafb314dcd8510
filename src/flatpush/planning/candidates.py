"""Automatic push points: on each edge or smooth stretch, the contact with the smallest turning radius."""

from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..contact.placement import SMOOTH_CORNER
from ..geometry import Outline, OutlinePoint
from ..geometry.pose import Array
from ..problem import Object, Push, Scene
from .options import PushOption, push_option

# A stretch ends where its normal has turned this far, so that a smooth outline gets pushes from all sides.
STRETCH = np.deg2rad(90.0)
COARSE, REFINED = 9, 8
MOST = 8
# What of how to plan makes a push a good one.
ASKED = "model", "two_finger", "friction_margin", "cost"
Found = tuple[tuple[Push, ...], tuple[PushOption, ...]]
_known: WeakKeyDictionary[Object, dict[tuple[Any, ...], Found]] = WeakKeyDictionary()


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

    def square_to(self, outline: Outline, cof: Array) -> Array:
        """Fractions at which the normal passes through the COF: contacts that steer with the least friction."""
        if outline.is_circle:
            x, y = cof - outline.centre
            if np.hypot(x, y) < 1e-9 * outline.radius:
                return np.empty(0)
            turns = np.array([0.0, 0.5]) + np.arctan2(y, x) / (2 * np.pi)
            fractions = 4 * ((turns - self.offset) % 1.0)
            return fractions[fractions < 1]
        edges = outline.edges[list(self.edges)]
        d = edges[:, 1] - edges[:, 0]
        along = np.einsum("ij,ij->i", cof - edges[:, 0], d) / self.lengths**2
        on = (along > 1e-6) & (along < 1 - 1e-6)
        before = np.cumsum(self.lengths) - self.lengths
        return ((before + along * self.lengths) / self.lengths.sum())[on]


def automatic_pushes(scene: Scene) -> Found:
    """A small set of pushes that is worth switching between, and those left out, with the reason.

    One push of each edge or smooth stretch; of more than MOST, those are kept that push in different
    directions, smaller turning radii first. They are sought once for an object: scenes that differ only in their
    poses, their workspace or how the search is done share them.
    """
    asked = scene.pusher, *(getattr(scene.planning, key) for key in ASKED)
    known = _known.setdefault(scene.object, {})
    if asked not in known:
        known[asked] = _automatic_pushes(scene)
    return known[asked]


def _automatic_pushes(scene: Scene) -> Found:
    found: list[PushOption] = []
    refused: list[PushOption] = []
    for stretch in stretches(scene.object.outline):
        option = _best(scene, stretch)
        if option is None:
            continue
        (refused if option.car is None else found).append(option)
    kept = _spread(found)
    refused += [
        replace(o, car=None, refusal="left out: other pushes in nearly this direction turn tighter")
        for o in found
        if o not in kept
    ]
    return tuple(option.push for option in kept), tuple(refused)


def _spread(options: list[PushOption]) -> list[PushOption]:
    """The tightest car, then again and again the one that adds most: angle to the nearest kept one, over its radius."""
    if len(options) <= MOST:
        return options
    radii = np.array([o.car.radius for o in options if o.car])
    directions = np.array([o.car.direction for o in options if o.car])
    kept = [int(np.argmin(radii))]
    while len(kept) < MOST:
        angles = np.arccos(np.clip(directions @ directions[kept].T, -1.0, 1.0)).min(axis=1)
        worth = angles / np.sqrt(radii)
        worth[kept] = -1.0
        kept.append(int(np.argmax(worth)))
    return [options[i] for i in sorted(kept)]


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
        option = push_option(scene, push, quick=True)
        tried[fraction] = option
        return option.car.radius if option.car is not None else np.inf

    grid = (np.arange(COARSE) + 0.5) / COARSE
    grid = grid[np.argsort(np.abs(grid - 0.5), kind="stable")]  # of equals, the one in the middle
    grid = np.concatenate([stretch.square_to(scene.object.outline, scene.object.cof), grid])
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
