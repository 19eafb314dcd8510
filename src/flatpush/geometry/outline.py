"""The outline of an object: a simple polygon or a circle, in the frame it is drawn in."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import is_finite, numbers, vector
from ..errors import InputError
from .pose import Array, cross, perpendicular

# Differences below this part of the size are none, so that rounding decides nothing.
_EQUAL = 1e-7
# A direction in which corners of equal shapes seldom lie equally far.
_GENERIC = np.array([np.cos(0.3), np.sin(0.3)])


@dataclass(frozen=True, eq=False)
class OutlinePoint:
    """A point of an outline.

    Attributes:
        point: shape (2,) [m].
        normal: inward unit normal, shape (2,); at a corner, that of the edge it was found on.
        edge: number of the polygon's edge, from 0; 0 for a circle.
        along: place on the edge, 0 to 1; for a circle the polar angle / 2π.
        distance: from the point asked for, positive outside, negative inside [m].
        corner: whether the point is a corner of the polygon.
    """

    point: Array
    normal: Array
    edge: int
    along: float
    distance: float = 0.0
    corner: bool = False


@dataclass(frozen=True, eq=False)
class Outline:
    """A simple polygon (corners as written, either sense, convex or not) or a circle.

    Build with Outline.polygon or Outline.circle. Edge k runs from corner k to corner k + 1, in the order written.

    >>> square = Outline.polygon([(0, 0), (2, 0), (2, 2), (0, 2)])
    >>> square.area, square.centroid.tolist(), square.nearest((-0.5, 1.0)).normal.tolist()
    (4.0, [1.0, 1.0], [1.0, 0.0])

    Attributes:
        vertices: corners of the polygon in the frame it was drawn in, shape (n, 2) [m]; none for a circle.
        centre: of the circle in that frame, shape (2,) [m].
        radius: of the circle [m]; 0 for a polygon.
    """

    vertices: Array
    centre: Array
    radius: float

    @classmethod
    def polygon(cls, vertices: ArrayLike) -> "Outline":
        """A simple polygon from its corners, shape (n, 2) [m]. Repeated corners are dropped.

        Raises:
            InputError: if it has fewer than three corners, no area, or crosses itself.
        """
        points = numbers(vertices, "an outline is a list of [x, y] corners")
        if points.ndim != 2 or points.shape[1] != 2:
            raise InputError("an outline is a list of [x, y] corners", value=vertices)
        if not np.all(np.isfinite(points)):
            raise InputError("the corners of an outline are finite numbers", value=vertices)
        extent = float(np.max(np.ptp(points, axis=0))) if len(points) else 0.0
        points = _different(points, 1e-9 * extent)
        if len(points) < 3:
            raise InputError("an outline has at least three different corners", value=len(points))
        from shapely import Polygon

        shape = Polygon(points)
        if shape.convex_hull.area < 1e-9 * extent**2:
            raise InputError("an outline encloses an area", hint="Its corners lie on one line.")
        if not shape.is_valid:
            raise InputError(
                "an outline does not cross or touch itself", hint="Check the order of its corners."
            )
        points.setflags(write=False)
        return cls(points, np.zeros(2), 0.0)

    @classmethod
    def circle(cls, radius: float, centre: ArrayLike = (0.0, 0.0)) -> "Outline":
        """A circle of the given radius [m] about a centre, shape (2,) in O [m].

        Raises:
            InputError: for a radius that is not positive and finite.
        """
        if not (is_finite(radius) and radius > 0):
            raise InputError("the radius of a circle is positive and finite", value=radius)
        middle = vector(centre, 2, "the centre of a circle is a point [x, y] of finite numbers")
        return cls(np.empty((0, 2)), middle, float(radius))

    @property
    def is_circle(self) -> bool:
        """Whether it is a circle rather than a polygon."""
        return self.radius > 0

    @cached_property
    def sense(self) -> float:
        """+1 if the corners run counter-clockwise, -1 if clockwise."""
        return 1.0 if self.is_circle or _shoelace(self.vertices) > 0 else -1.0

    @cached_property
    def area(self) -> float:
        return float(np.pi * self.radius**2) if self.is_circle else abs(_shoelace(self.vertices))

    @cached_property
    def centroid(self) -> Array:
        if self.is_circle:
            return self.centre
        # About the first corner, so that far-away coordinates do not cancel.
        origin = self.vertices[0]
        p = self.vertices - origin
        q = np.roll(p, -1, axis=0)
        c = cross(p, q)
        return origin + ((p + q) * c[:, None]).sum(axis=0) / (3 * c.sum())

    @cached_property
    def size(self) -> float:
        """The largest distance between two of its points [m]."""
        if self.is_circle:
            return 2 * self.radius
        from shapely import Polygon
        from shapely.geometry.polygon import orient

        # The farthest two are antipodal corners of the convex hull: at an end of one of its edges, and at the corner
        # that is farthest on the side where this edge's normal points away from.
        hull = np.array(orient(Polygon(self.vertices).convex_hull).exterior.coords)[:-1]
        edges = np.roll(hull, -1, axis=0) - hull
        angles = np.unwrap(np.arctan2(edges[:, 1], edges[:, 0]))
        turned = angles[0] + (angles + np.pi - angles[0]) % (2 * np.pi)
        opposite = np.searchsorted(angles, turned)  # edges before this one run that way or less far round
        near = np.arange(len(hull))
        pairs = [(near + i, opposite + j) for i in (0, 1) for j in (-1, 0, 1)]
        ends = np.hstack([hull[a % len(hull)] - hull[b % len(hull)] for a, b in pairs])
        return float(np.max(np.linalg.norm(ends.reshape(-1, 2), axis=1)))

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """Numbers of the edges counter-clockwise from a corner that does not depend on how the outline is written.

        It is the corner farthest from the centroid; of several, the one farthest east, a little north.
        """
        about = self.vertices - self.centroid
        distance = np.hypot(*about.T)
        farthest = distance >= distance.max() - _EQUAL * self.size
        east = np.where(farthest, about @ _GENERIC, -np.inf)
        first = int(np.argmax(east))
        count = np.arange(len(about))
        return (first + count) % len(about) if self.sense > 0 else (first - 1 - count) % len(about)

    def simplified(self, tolerance: float) -> "Outline":
        """A polygon with fewer corners, all of them corners of this one, that stays within the tolerance of it [m].

        It is written counter-clockwise from the same corner, however this one is written. This one itself if there is
        no such polygon.
        """
        if self.is_circle:
            return self
        corners = self.vertices[self.order if self.sense > 0 else (self.order + 1) % len(self.vertices)]
        closed = np.concatenate([corners, corners[:1]])
        last = len(corners)
        kept = [0]
        while kept[-1] < last:
            # As far as a straight line may go: first by doubling, then by halving what is between.
            here = kept[-1]
            good, step = here + 1, 2
            while here + step <= last and _near_chord(closed[here : here + step + 1], tolerance):
                good, step = here + step, 2 * step
            bad = min(here + step, last + 1)
            while bad - good > 1:
                middle = (good + bad) // 2
                if _near_chord(closed[here : middle + 1], tolerance):
                    good = middle
                else:
                    bad = middle
            kept.append(good)
        try:
            return Outline.polygon(corners[kept[:-1]])
        except InputError:
            return self

    @cached_property
    def edges(self) -> Array:
        """Starts and ends of the edges, shape (n, 2, 2); empty for a circle."""
        return np.stack([self.vertices, np.roll(self.vertices, -1, axis=0)], axis=1)

    @cached_property
    def edge_normals(self) -> Array:
        """Inward unit normals of the edges, shape (n, 2)."""
        d = self.edges[:, 1] - self.edges[:, 0]
        return self.sense * perpendicular(d) / np.linalg.norm(d, axis=1, keepdims=True)

    def radius_about(self, point: ArrayLike) -> float:
        """The largest distance of the outline from a point [m]."""
        p = np.asarray(point, dtype=float)
        if self.is_circle:
            return float(np.linalg.norm(p - self.centre) + self.radius)
        return float(np.max(np.linalg.norm(self.vertices - p, axis=1)))

    def at(self, edge: int, along: float) -> OutlinePoint:
        """The point at a place, 0 to 1, on an edge of a number (polygon), or at the angle 2π · along (circle).

        Raises:
            InputError: for an edge that there is not, or a place that is not finite.
        """
        if not is_finite(along):
            raise InputError("a place along an edge is a finite number", value=along)
        if self.is_circle:
            angle = 2 * np.pi * along
            out = np.array([np.cos(angle), np.sin(angle)])
            return OutlinePoint(self.centre + self.radius * out, -out, 0, float(along % 1.0))
        if not (is_finite(edge) and edge == int(edge) and 0 <= edge < len(self.vertices)):
            raise InputError(f"edges count from 0 to {len(self.vertices) - 1}", value=edge)
        start, end = self.edges[edge]
        corner = along <= 1e-9 or along >= 1 - 1e-9
        return OutlinePoint(
            start + along * (end - start), self.edge_normals[edge], edge, float(along), 0.0, corner
        )

    def nearest(self, point: ArrayLike) -> OutlinePoint:
        """The nearest point of the outline; its distance is negative for a point inside."""
        p = np.asarray(point, dtype=float)
        if self.is_circle:
            offset = p - self.centre
            distance = float(np.hypot(*offset))
            out = offset / distance if distance > 0 else np.array([1.0, 0.0])
            along = float(np.arctan2(out[1], out[0]) / (2 * np.pi)) % 1.0
            return OutlinePoint(
                self.centre + self.radius * out, -out, 0, along, distance - self.radius, False
            )
        start, d = self.edges[:, 0], self.edges[:, 1] - self.edges[:, 0]
        length2 = np.einsum("ij,ij->i", d, d)
        along_all = np.clip(np.einsum("ij,ij->i", p - start, d) / length2, 0.0, 1.0)
        feet = start + along_all[:, None] * d
        gaps = np.linalg.norm(feet - p, axis=1)
        edge = int(np.argmin(gaps))
        along = float(along_all[edge])
        sign = -1.0 if self.contains(p) else 1.0
        tolerance = 1e-9 * self.size / np.sqrt(length2[edge])
        corner = min(along, 1 - along) <= tolerance
        return OutlinePoint(
            feet[edge], self.edge_normals[edge], edge, along, sign * float(gaps[edge]), bool(corner)
        )

    def contains(self, point: ArrayLike) -> bool:
        """Whether the point lies strictly inside (the outline itself may go either way)."""
        p = np.asarray(point, dtype=float)
        if self.is_circle:
            return bool(np.hypot(*(p - self.centre)) < self.radius)
        a, b = self.edges[:, 0] - p, self.edges[:, 1] - p
        upward = (a[:, 1] <= 0) & (b[:, 1] > 0)
        downward = (a[:, 1] > 0) & (b[:, 1] <= 0)
        left = cross(a, b)
        return bool((np.sum(upward & (left > 0)) - np.sum(downward & (left < 0))) != 0)

    def polyline(self, tolerance: float | None = None) -> Array:
        """Its corners, or those of a polygon around the circle's centre that stays within the tolerance [m]."""
        if not self.is_circle:
            return self.vertices
        sag = 1e-3 * self.radius if tolerance is None else min(tolerance, self.radius)
        n = max(16, int(np.ceil(np.pi / np.arccos(1 - sag / self.radius))))
        angles = 2 * np.pi * np.arange(n) / n
        return self.centre + self.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)

    def translated(self, offset: ArrayLike) -> "Outline":
        """The same outline, moved."""
        d = np.asarray(offset, dtype=float)
        return Outline(self.vertices + d, self.centre + d if self.is_circle else self.centre, self.radius)


def _near_chord(points: Array, tolerance: float) -> bool:
    """Whether points (n, 2) stay within the tolerance of the line from the first to the last of them."""
    d = points[-1] - points[0]
    away = points[1:-1] - points[0]
    length2 = float(d @ d)
    along = np.clip(away @ d / length2, 0.0, 1.0) if length2 > 0 else np.zeros(len(away))
    return bool(np.hypot(*(away - along[:, None] * d).T).max(initial=0.0) <= tolerance)


def _different(points: Array, tolerance: float) -> Array:
    """The corners without those that repeat the one before, or, at the end, the first."""
    if len(points) < 2:
        return points
    step = np.hypot(*(points - np.roll(points, -1, axis=0)).T)
    if np.all(step > tolerance):
        return points
    kept: list[Array] = []
    for point in points:
        if not kept or np.hypot(*(point - kept[-1])) > tolerance:
            kept.append(point)
    while len(kept) > 1 and np.hypot(*(kept[-1] - kept[0])) <= tolerance:
        kept.pop()
    return np.array(kept).reshape(-1, 2)


def _shoelace(p: Array) -> float:
    q = p - p[0]
    return 0.5 * float(np.sum(cross(q, np.roll(q, -1, axis=0))))
