"""How near object and fingertips come to obstacles and bounds, between samples included."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import compose, exp, transform
from ..geometry.pose import Array
from ..problem import Scene, Segment, TransitSegment
from .pieces import Piece, pieces

# The least clearance is known to within this [m]; what is returned is the lower end.
RESOLUTION = 1e-5
PAIRS = 1_000_000  # of shapes and obstacles that are compared at a time
Places = NDArray[np.intp]


def clearance_of(scene: Scene, segments: Sequence[Segment], need: float = -np.inf) -> float | None:
    """The least distance [m] of object and fingertips to obstacles and bounds over a whole plan; None without either.

    A lower bound, at most 10 µm below the true value; the search ends early where less than `need` [m] is found.
    Negative where something overlaps or leaves the bounds. No motion between samples is missed: a piece in which
    nothing moves further than m cannot come nearer than its ends' distances less m/2, and is halved until that settles
    it. A lifted pusher is free of obstacles, not of bounds.
    """
    if scene.workspace.bounds is None and not scene.workspace.obstacles:
        return None
    world = _World(scene)
    if not segments:
        return float(world.object_distances(scene.start_pose[None])[0])
    motion = _Motion(scene, segments)
    which = np.arange(len(motion.travel))
    low, high = np.zeros(len(which)), np.ones(len(which))
    a, b = (motion.distances(world, which, ends) for ends in (low, high))
    best, floor = float(min(a.min(), b.min())), np.inf
    while best >= need and len(which):
        least = 0.5 * (a + b - (high - low) * motion.travel[which])
        open_ = least < best - RESOLUTION
        floor = min(floor, float(np.min(least, where=~open_, initial=np.inf)))
        which, low, high, a, b = which[open_], low[open_], high[open_], a[open_], b[open_]
        middle = 0.5 * (low + high)
        m = motion.distances(world, which, middle)
        best = min(best, float(np.min(m, initial=np.inf)))
        which = np.concatenate([which, which])
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        a, b = np.concatenate([a, m]), np.concatenate([m, b])
    return best if best < need else min(best, floor)


def object_distances(scene: Scene) -> Callable[[Array], Array] | None:
    """What gives the distance of the object alone to obstacles and bounds at poses X_WO (n, 3) [m]; None without."""
    if scene.workspace.bounds is None and not scene.workspace.obstacles:
        return None
    return _World(scene).object_distances


class _Motion:
    """All pieces of a plan, as arrays."""

    def __init__(self, scene: Scene, segments: Sequence[Segment]) -> None:
        hands = [s.fingers for s in segments if not isinstance(s, TransitSegment)]
        listed: list[Piece] = []
        held: list[Array] = []
        push = 0
        for piece in pieces(segments, scene.start_pose):
            push = piece.push if piece.push is not None else push
            listed.append(piece)
            held.append(hands[push])
        self.object, self.object_step, self.pusher, self.pusher_step = (
            np.array([getattr(piece, name) for piece in listed], dtype=float)
            for name in ("object", "object_step", "pusher", "pusher_step")
        )
        self.body = np.array([piece.body for piece in listed])
        # On its way up and down the pusher is among the obstacles still.
        lift = scene.pusher.lift * (1 - 1e-9)
        self.lifted = np.array([piece.lifted and piece.height >= lift for piece in listed])
        self.hand = np.array(held)
        # The most that any point of object or fingertips moves in each piece [m].
        tips = np.max(np.linalg.norm(self.hand, axis=2), axis=1) + scene.pusher.tip_radius
        reach = scene.object.outline.radius_about((0.0, 0.0))
        self.travel = np.maximum(_travel(self.object_step, reach), _travel(self.pusher_step, tips))

    def distances(self, world: "_World", which: Places, at: Array) -> Array:
        """The distance at a fraction of each of some pieces."""
        objects = self._moved(self.object, self.object_step, which, at)
        pushers = self._moved(self.pusher, self.pusher_step, which, at)
        found = world.object_distances(objects)
        for finger in range(self.hand.shape[1]):
            tips = transform(pushers, self.hand[which, finger])
            found = np.minimum(found, world.tip_distances(tips, self.lifted[which]))
        return found

    def _moved(self, poses: Array, steps: Array, which: Places, at: Array) -> Array:
        pose, step = poses[which], at[:, None] * steps[which]
        return np.where(self.body[which, None], compose(pose, exp(step)), pose + step)


def _travel(step: Array, reach: Any) -> Array:
    most: Array = np.hypot(step[:, 0], step[:, 1]) + np.abs(step[:, 2]) * reach
    return most


class _World:
    """Obstacles and bounds as shapely sees them, and the distances of many poses."""

    def __init__(self, scene: Scene) -> None:
        import shapely

        self.shapely: Any = shapely
        self.outline, self.tip = scene.object.outline, scene.pusher.tip_radius
        self.bounds = scene.workspace.bounds
        # A circle is its centre with the radius taken off every distance.
        obstacles = scene.workspace.obstacles
        self.radii = np.array([o.radius if o.is_circle else 0.0 for o in obstacles])
        self.solids = np.array(
            [shapely.Point(o.centre) if o.is_circle else shapely.Polygon(o.vertices) for o in obstacles],
            dtype=object,
        )
        shapely.prepare(self.solids)
        self.boxes = shapely.bounds(self.solids).reshape(-1, 4)

    def object_distances(self, poses: Array) -> Array:
        outline = self.outline
        if outline.is_circle:
            return self._discs(transform(poses, outline.centre), outline.radius)
        corners = transform(poses[:, None], outline.vertices)
        gaps = self._gaps(self.shapely.polygons(corners), corners.min(axis=1), corners.max(axis=1))
        return np.minimum(gaps, self._inside(corners.min(axis=1), corners.max(axis=1)))

    def tip_distances(self, tips: Array, lifted: NDArray[np.bool_]) -> Array:
        found = self._inside(tips, tips) - self.tip
        found[~lifted] = np.minimum(found[~lifted], self._discs(tips[~lifted], self.tip))
        return found

    def _discs(self, centres: Array, radius: float) -> Array:
        gaps = self._gaps(self.shapely.points(centres), centres, centres)
        return np.minimum(gaps, self._inside(centres, centres)) - radius

    def _inside(self, low: Array, high: Array) -> Array:
        """How far within the bounds boxes lie."""
        if self.bounds is None:
            return np.full(len(low), np.inf)
        xmin, ymin, xmax, ymax = self.bounds
        return np.minimum(low - (xmin, ymin), (xmax, ymax) - high).min(axis=1)

    def _gaps(self, shapes: Any, low: Array, high: Array) -> Array:
        """The distance of each shape, with its box, to the nearest obstacle."""
        found = np.full(len(low), np.inf)
        size = max(1, PAIRS // max(1, len(self.solids)))
        for first in range(0, len(low) if len(self.solids) else 0, size):
            part = slice(first, first + size)
            found[part] = self._nearest(np.atleast_1d(shapes)[part], low[part], high[part])
        return found

    def _nearest(self, shapes: Any, low: Array, high: Array) -> Array:
        """The same; obstacles whose boxes are further away than what is nearest so far are passed over."""
        apart = np.maximum(self.boxes[:, :2] - high[:, None], low[:, None] - self.boxes[:, 2:])
        gap = np.hypot(*np.moveaxis(np.maximum(apart, 0.0), -1, 0)) - self.radii
        every, first = np.arange(len(shapes)), np.argmin(gap, axis=1)
        best = self._between(shapes, first)
        near = (gap < best[:, None]) | (gap <= 0.0)
        near[every, first] = False
        rows, columns = np.nonzero(near)
        np.minimum.at(best, rows, self._between(shapes[rows], columns))
        return best

    def _between(self, shapes: Any, obstacles: Places) -> Array:
        """The distance of each shape to its obstacle; an overlap is negative, how far one lies inside the other."""
        solids = self.solids[obstacles]
        gaps: Array = self.shapely.distance(solids, shapes)
        over = gaps <= 0.0
        gaps[over] = 0.0 - np.sqrt(self.shapely.area(self.shapely.intersection(shapes[over], solids[over])))
        return gaps - self.radii[obstacles]
