"""How near object and fingertips come to obstacles and bounds, between samples included."""

import heapq
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..geometry import transform
from ..geometry.pose import Array
from ..problem import PushSegment, Scene, TransitSegment
from .pieces import Piece, pieces

# The least clearance is known to within this [m]; what is returned is the lower end.
RESOLUTION = 1e-5


def clearance_of(
    scene: Scene, segments: Sequence[PushSegment | TransitSegment], need: float = -np.inf
) -> float | None:
    """The least distance [m] of object and fingertips to obstacles and bounds over a whole plan; None without either.

    A lower bound, at most 10 µm below the true value; the search ends early where less than `need` is found. Negative
    where something overlaps or leaves the bounds. No motion between samples is missed: a piece in which nothing moves
    further than m cannot come nearer than its ends' distances less m/2, and is halved until that settles it. A lifted
    pusher is free of obstacles, not of bounds.
    """
    if scene.workspace.bounds is None and not scene.workspace.obstacles:
        return None
    world = _World(scene)
    fingers = [s.fingers for s in segments if isinstance(s, PushSegment)]
    best = np.inf
    heap: list[tuple[float, int, Piece, float, float, float, float]] = []
    count, push = 0, 0
    for piece in pieces(segments, np.asarray(scene.start, dtype=float)):
        push = piece.push if piece.push is not None else push
        hand = fingers[push]
        a, b = (world.distance(piece, hand, f) for f in (0.0, 1.0))
        best = min(best, a, b)
        if best < need:
            return float(best)
        heapq.heappush(heap, (0.5 * (a + b - world.travel(piece, hand)), count, piece, 0.0, 1.0, a, b))
        count += 1
    while heap and best >= need and heap[0][0] < best - RESOLUTION:
        _, _, piece, low, high, a, b = heapq.heappop(heap)
        hand = fingers[piece.push or 0]
        middle = 0.5 * (low + high)
        m = world.distance(piece, hand, middle)
        best = min(best, m)
        half = 0.5 * (high - low) * world.travel(piece, hand)
        for lo, hi, x, y in ((low, middle, a, m), (middle, high, m, b)):
            heapq.heappush(heap, (0.5 * (x + y - half), count, piece, lo, hi, x, y))
            count += 1
    if not segments:
        best = world.object_distance(np.asarray(scene.start, dtype=float))
    return float(min(best, heap[0][0])) if heap and best >= need else float(best)


class _World:
    """Obstacles and bounds as shapely sees them, and the distances of one pose."""

    def __init__(self, scene: Scene) -> None:
        import shapely

        self.shapely: Any = shapely
        self.scene = scene
        self.outline = scene.object.outline
        self.ring = self.outline.vertices
        # A circle is its centre with the radius taken off every distance.
        self.obstacles = [
            (shapely.Point(o.centre), o.radius) if o.is_circle else (shapely.Polygon(o.vertices), 0.0)
            for o in scene.workspace.obstacles
        ]
        for obstacle, _ in self.obstacles:
            shapely.prepare(obstacle)
        self.bounds = scene.workspace.bounds

    def travel(self, piece: Piece, hand: Array) -> float:
        """The most that any point of object or fingertips moves in the piece [m]."""
        most = 0.0
        reach = self.outline.radius_about((0.0, 0.0))
        tips = float(np.max(np.hypot(*hand.T))) + self.scene.pusher.tip_radius
        for step, radius in ((piece.object_step, reach), (piece.pusher_step, tips)):
            most = max(most, float(np.hypot(*step[:2])) + abs(float(step[2])) * radius)
        return most

    def distance(self, piece: Piece, hand: Array, fraction: float) -> float:
        tips = transform(piece.pusher_at(fraction), hand)
        radius = self.scene.pusher.tip_radius
        return min(
            self.object_distance(piece.object_at(fraction)),
            *(self._disc(tip, radius, lifted=piece.lifted) for tip in tips),
        )

    def object_distance(self, pose: Array) -> float:
        if self.outline.is_circle:
            return self._disc(transform(pose, self.outline.centre), self.outline.radius)
        corners = transform(pose, self.ring)
        best = self._inside(corners, 0.0)
        if self.obstacles:
            shape = self.shapely.Polygon(corners)
            best = min(best, *(self._gap(shape, o) - r for o, r in self.obstacles))
        return best

    def _disc(self, centre: Array, radius: float, lifted: bool = False) -> float:
        best = self._inside(centre[None], radius)
        if self.obstacles and not lifted:
            point = self.shapely.Point(centre)
            best = min(best, *(self._gap(point, o) - radius - r for o, r in self.obstacles))
        return best

    def _inside(self, points: Array, radius: float) -> float:
        if self.bounds is None:
            return float("inf")
        xmin, ymin, xmax, ymax = self.bounds
        low = points - np.array([xmin, ymin])
        high = np.array([xmax, ymax]) - points
        return float(min(low.min(), high.min())) - radius

    def _gap(self, shape: Any, obstacle: Any) -> float:
        gap = float(shape.distance(obstacle))
        if gap > 0:
            return gap
        # An overlap as a negative number: how far a part of one lies inside the other.
        overlap = shape.intersection(obstacle)
        return -float(np.sqrt(overlap.area)) if overlap.area > 0 else 0.0
