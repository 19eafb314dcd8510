"""How the pusher gets from one contact to the next: over the object, or around it on the table."""

import heapq
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ..contact import Placement
from ..errors import FlatpushError
from ..geometry import Outline, compose, wrap_angle
from ..geometry.pose import Array
from ..problem import Pusher, Scene, TransitSegment
from ..steering.time_law import Trapezoid
from .segments import SAG, SAG_ANGLE

# On the table the fingers keep at least this distance from the object while they go around it [m].
LEAST_GAP = 0.001
ARC_SEGMENTS = 8  # of a quarter of the way around a corner
# Chords of a rounded corner cut into the exact offset; widening the offset by this factor makes up for it.
WIDER = 1 / np.cos(np.pi / (4 * ARC_SEGMENTS))


@dataclass(frozen=True, eq=False)
class PusherPath:
    """Straight stretches of the pusher beside an object at rest: poses X_OE (n, 3) and heights (n,), from rest to rest.

    Attributes:
        reach: distance of the fingertips from E [m]; turning by an angle moves them by angle × reach.
    """

    poses: Array
    heights: Array
    reach: float

    @property
    def lengths(self) -> Array:
        """Way of the fastest fingertip on each stretch, at most, shape (n - 1,) [m]."""
        step = np.diff(self.poses, axis=0)
        flat = np.hypot(step[:, 0], step[:, 1]) + np.abs(step[:, 2]) * self.reach
        # A hand of one finger that only turns on its place: its turn counts as a way of 1 mm/rad.
        flat = np.where(flat + np.abs(np.diff(self.heights)) > 0, flat, 1e-3 * np.abs(step[:, 2]))
        return np.hypot(flat, np.diff(self.heights))

    @property
    def pusher_length(self) -> float:
        """Length of the way of E's origin, heights included [m]."""
        step = np.column_stack([np.diff(self.poses[:, :2], axis=0), np.diff(self.heights)])
        return float(np.sum(np.linalg.norm(step, axis=1)))

    def duration(self, pusher: Pusher) -> float:
        """Time from rest to rest on every stretch [s]."""
        return float(sum(law.duration for law in self.laws(pusher)))

    def laws(self, pusher: Pusher) -> list[Trapezoid]:
        """The time law of each stretch: on the table with speed and acceleration, lifted with those of travel.

        A fingertip of a turning hand has, beside that of its way, an acceleration towards the middle of the hand,
        which may have the same direction: each gets half of the limit.
        """
        laws = []
        turns = np.abs(np.diff(self.poses[:, 2]))
        lifted = np.maximum(self.heights[:-1], self.heights[1:]) > 0
        for length, turn, up in zip(self.lengths, turns, lifted, strict=True):
            speed = pusher.travel_speed if up else pusher.speed
            most = pusher.travel_acceleration if up else pusher.acceleration
            if turn > 0:
                most = 0.5 * most
                speed = min(speed, pusher.turn_rate * length / turn)
                if self.reach > 0:
                    speed = min(speed, float(np.sqrt(most / self.reach)) * length / turn)
            laws.append(Trapezoid(float(length), float(speed), most))
        return laws

    def reversed(self) -> "PusherPath":
        return PusherPath(self.poses[::-1].copy(), self.heights[::-1].copy(), self.reach)

    def segment(self, pusher: Pusher, X_WO: Array) -> TransitSegment:
        """The way beside an object at a pose, timed."""
        times, poses, heights = _timed(self, pusher)
        return TransitSegment(times, compose(X_WO, poses), heights)


@lru_cache(maxsize=256)  # plans for one object have the same ways beside it
def _timed(path: PusherPath, pusher: Pusher) -> tuple[Array, Array, Array]:
    """Times, poses X_OE and heights of the samples of a way."""
    times, poses, heights = [np.zeros(1)], [path.poses[:1]], [path.heights[:1]]
    clock = 0.0
    for i, law in enumerate(path.laws(pusher)):
        turn = abs(float(path.poses[i + 1, 2] - path.poses[i, 2]))
        steps = [np.sqrt(8 * SAG / law.acceleration)]
        if turn > 0:
            steps.append(np.sqrt(8 * SAG_ANGLE * law.length / turn / law.acceleration))
        t, f = law.samples(float(min(steps)), 1)
        times.append(clock + t[1:])
        poses.append(path.poses[i] + f[1:, None] * (path.poses[i + 1] - path.poses[i]))
        heights.append(path.heights[i] + f[1:] * (path.heights[i + 1] - path.heights[i]))
        clock += law.duration
    found = np.concatenate(times), np.concatenate(poses), np.concatenate(heights)
    for array in found:
        array.setflags(write=False)
    return found


def backs_off(outline: Outline, placement: Placement, back: Array, tip_radius: float) -> bool:
    """Whether the fingertips stay off the object while the hand goes straight from a contact to a pose X_OE."""
    import shapely

    shape = shapely.Point(outline.centre) if outline.is_circle else shapely.Polygon(outline.vertices)
    ways = shapely.linestrings(
        np.stack([placement.tips, placement.tips + (back - placement.pose)[:2]], axis=1)
    )
    return bool(np.all(shapely.distance(shape, ways) >= tip_radius + outline.radius - 1e-9))


class Transits:
    """The pusher's ways around one object, in O.

    Args:
        scene: whose object, pusher and clearance hold.
    """

    def __init__(self, scene: Scene) -> None:
        self.pusher, self.outline = scene.pusher, scene.object.outline
        self.gap = max(scene.clearance, LEAST_GAP)

    def landing(self, placement: Placement) -> PusherPath:
        """From above the landing place (planar: from beside) onto the contact, straight along the push direction.

        A finger that keeps its direction comes square to the outline where it touches.

        Raises:
            FlatpushError: if a part of the object is in the way.
        """
        back = self._back(placement, self.pusher.approach)
        poses, heights = [back, placement.pose], [0.0, 0.0]
        if self.pusher.transit == "lift":
            poses, heights = [back, *poses], [self.pusher.lift, *heights]
        return PusherPath(np.array(poses), np.array(heights), self._reach(placement))

    def between(self, first: Placement, second: Placement) -> PusherPath:
        """From one contact to another.

        Raises:
            FlatpushError: if there is no way on the table, or a part of the object is in the way.
        """
        reach = max(self._reach(first), self._reach(second))
        a, b = (self._back(placement, self.pusher.approach) for placement in (first, second))
        turn = float(wrap_angle(b[2] - a[2]))
        b = np.array([b[0], b[1], a[2] + turn])
        end = np.array([*second.pose[:2], b[2]])
        if self.pusher.transit == "lift":
            up = self.pusher.lift
            over = np.array([first.pose, a, a, b, b, end])
            return PusherPath(over, np.array([0.0, 0.0, up, up, 0.0, 0.0]), reach)
        away, before = self._clear(first, reach), self._clear(second, reach)
        points = self._around(away[:2], before[:2], reach)
        steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        share = steps / steps[-1] if steps[-1] > 0 else np.linspace(0, 1, len(points))
        middle = np.column_stack([points, a[2] + turn * share])
        poses = np.concatenate([[first.pose], middle, [end]])
        return PusherPath(poses, np.zeros(len(poses)), reach)

    def _back(self, placement: Placement, distance: float) -> Array:
        """The pose X_OE at a distance straight back from a contact."""
        if self.pusher.turns:
            return compose(placement.pose, [-distance, 0.0, 0.0])
        # The finger has rolled along, so that its own direction says nothing, nor what was checked of its push.
        normal = self.outline.nearest(placement.pose[:2]).normal
        back = placement.pose - distance * np.array([*normal, 0.0])
        self._check(placement, back)
        return back

    def _check(self, placement: Placement, back: Array) -> None:
        if not backs_off(self.outline, placement, back, self.pusher.tip_radius):
            raise FlatpushError("a part of the object is in the fingers' way when they back away")

    def _reach(self, placement: Placement) -> float:
        return float(np.max(np.linalg.norm(placement.tips - placement.pose[:2], axis=1)))

    def _clear(self, placement: Placement, reach: float) -> Array:
        """Straight back from a contact until the hand may turn freely beside the object."""
        need = WIDER * (reach + self.pusher.tip_radius + self.gap)
        distance, pose = 0.0, placement.pose
        while self.outline.nearest(pose[:2]).distance < need + 1e-9:
            distance += 0.25 * self.gap + max(0.0, 0.5 * (need - self.outline.nearest(pose[:2]).distance))
            if distance > 4 * self.outline.size + 2 * need:
                raise FlatpushError("the fingers cannot back away from the object far enough to turn")
            pose = self._back(placement, distance)
        self._check(placement, pose)
        return pose

    @cached_property
    def _networks(self) -> dict[float, "Network"]:
        return {}

    def _around(self, a: Array, b: Array, reach: float) -> Array:
        radius = reach + self.pusher.tip_radius + self.gap
        if radius not in self._networks:
            self._networks[radius] = Network(self.outline, radius)
        return self._networks[radius].shortest(a, b)


class Network:
    """Shortest ways around an outline that is widened by a radius: straight between its convex corners."""

    def __init__(self, outline: Outline, radius: float) -> None:
        import shapely

        self.shapely: Any = shapely
        wide = WIDER * radius
        shape = shapely.Polygon(outline.polyline()).buffer(wide, quad_segs=ARC_SEGMENTS)
        ring = np.array(shape.exterior.coords)[:-1]
        self.inside = shapely.Polygon(ring).buffer(-1e-6 * wide)
        shapely.prepare(self.inside)
        hull = np.array(shapely.Polygon(ring).convex_hull.exterior.coords)[:-1]
        self.corners = ring if len(ring) <= 200 else hull
        self.graph = self._visible(self.corners, self.corners)

    def _visible(self, first: Array, second: Array) -> Array:
        """Distances between points that see each other, inf between others, shape (n, m)."""
        pairs = np.stack(np.broadcast_arrays(first[:, None], second[None, :]), axis=2)
        lines = self.shapely.linestrings(pairs.reshape(-1, 2, 2))
        blocked = self.shapely.intersects(self.inside, lines).reshape(len(first), len(second))
        distance = np.linalg.norm(first[:, None] - second[None, :], axis=-1)
        return np.where(blocked, np.inf, distance)

    def shortest(self, a: Array, b: Array) -> Array:
        """The points of the shortest way from a to b, shape (n, 2)."""
        direct = self._visible(a[None], b[None])[0, 0]
        if np.isfinite(direct):
            return np.stack([a, b])
        from_a, to_b = self._visible(a[None], self.corners)[0], self._visible(self.corners, b[None])[:, 0]
        cost, before = from_a.copy(), np.full(len(self.corners), -1)
        heap = [(c, int(i)) for i, c in enumerate(cost) if np.isfinite(c)]
        heapq.heapify(heap)
        while heap:
            c, i = heapq.heappop(heap)
            if c > cost[i]:
                continue
            shorter = c + self.graph[i] < cost - 1e-15
            for j in np.flatnonzero(shorter):
                cost[j], before[j] = c + self.graph[i, j], i
                heapq.heappush(heap, (float(cost[j]), int(j)))
        last = int(np.argmin(cost + to_b))
        if not np.isfinite(cost[last] + to_b[last]):
            raise FlatpushError("there is no way around the object on the table")
        points, i = [b], last
        while i >= 0:
            points.append(self.corners[i])
            i = int(before[i])
        return np.array([a, *points[:0:-1], b])
