"""Where the fingertips of a push stand: both touch the outline, and neither overlaps it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import Outline, OutlinePoint, cross, perpendicular, rotate, wrap_angle
from ..geometry.pose import Array

# A fingertip may rest on a corner only where the outline is nearly smooth there.
SMOOTH_CORNER = np.deg2rad(20.0)
# Two fingers turn until both touch: how finely and how far is looked for that.
STEP, SCAN = np.deg2rad(2.0), 22
# Of an outline with more edges, those that cannot be touched first are passed over.
MANY = 200


@dataclass(frozen=True, eq=False)
class Placement:
    """Fingertips at an outline, in the outline's frame O.

    Attributes:
        points: of the outline that the tips touch, shape (k, 2) [m].
        normals: inward unit normals there, shape (k, 2).
        tips: centres of the fingertips, shape (k, 2) [m].
        pose: X_OE, shape (3,) [m, m, rad]: midway between the tips, +x the push direction.
    """

    points: Array
    normals: Array
    tips: Array
    pose: Array

    @property
    def virtual_point(self) -> Array:
        """The contact point in O, or the midpoint of two ([Zhou2017] Sec. 4.2), shape (2,) [m]."""
        return self.points.mean(axis=0)

    @property
    def virtual_normal(self) -> Array:
        """The inward normal in O, or the average of two, a unit vector (2,)."""
        n = self.normals.mean(axis=0)
        return n / np.hypot(*n)


def place_fingers(
    outline: Outline, at: OutlinePoint, fingers: int, spacing: float, tip_radius: float
) -> Placement:
    """Places one or two round fingertips at a point of an outline.

    Two fingers straddle the inward normal at the point; the hand is advanced along its push direction and turned until
    both tips touch, so that it also fits into concave sides.

    Args:
        fingers: how many, 1 or 2. spacing: between the centres of two fingertips [m]. tip_radius: [m].

    Raises:
        InputError: if a tip would overlap the outline, rest on a sharp corner, or not touch at all.
    """
    if fingers == 1:
        tip = at.point - tip_radius * at.normal
        if outline.nearest(tip).distance < tip_radius - 1e-9 * outline.size:
            raise InputError(
                f"the fingertip does not fit at {_told(at.point)} without overlapping the outline",
                hint="A thinner fingertip or another place would help.",
            )
        pose = np.array([*tip, np.arctan2(at.normal[1], at.normal[0])])
        return Placement(at.point[None], at.normal[None], tip[None], pose)

    heading = float(np.arctan2(at.normal[1], at.normal[0]))

    def reach(angles: Array) -> tuple[Array, Array]:
        """How far the left and the right tip travel, shape (2, m), and where they touch, shape (2, m, 2)."""
        x = np.column_stack([np.cos(angles), np.sin(angles)])
        y = perpendicular(x)
        back = at.point - 2 * outline.size * x
        starts = np.concatenate([back + spacing / 2 * y, back - spacing / 2 * y])
        if len(outline.vertices) > MANY:  # each tip by itself meets fewer edges
            m = len(x)
            left, right = (travels(outline, q, x, tip_radius) for q in (starts[:m], starts[m:]))
            return np.stack([left[0], right[0]]), np.stack([left[1], right[1]])
        ways, touched = travels(outline, starts, np.concatenate([x, x]), tip_radius)
        return ways.reshape(2, -1), touched.reshape(2, -1, 2)

    def imbalance(angles: Array) -> Array:
        left, right = reach(angles)[0]
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(left) & np.isfinite(right), left - right, np.nan)

    angle = _balance(imbalance, heading, 1e-12 * outline.size)
    if angle is None:
        raise InputError(
            f"only one of the fingers, {1000 * spacing:.4g} mm apart, meets the outline at {_told(at.point)}",
            hint="A smaller spacing would help.",
        )
    ways, touched = reach(np.array([angle]))
    left, right = float(ways[0, 0]), float(ways[1, 0])
    if not np.isfinite(left + right) or abs(left - right) > 1e-7 * outline.size:
        raise InputError(
            f"two fingers, {1000 * spacing:.4g} mm apart, cannot both touch the outline at {_told(at.point)}",
            hint="Another place or spacing would help.",
        )
    x = rotate(angle, [1.0, 0.0])
    y = perpendicular(x)
    middle = at.point - 2 * outline.size * x + 0.5 * (left + right) * x
    tips = np.stack([middle + spacing / 2 * y, middle - spacing / 2 * y])
    points = touched[:, 0]
    if np.max(np.linalg.norm(points - at.point, axis=1)) > 2 * spacing + 2 * tip_radius:
        raise InputError(
            f"another part of the outline is in the fingers' way at {_told(at.point)}",
            hint="Another place, or thinner or closer fingers, would help.",
        )
    normals = np.stack([_normal(outline, p, t) for p, t in zip(points, tips, strict=True)])
    return Placement(points, normals, tips, np.array([*middle, wrap_angle(angle)]))


def travels(outline: Outline, starts: Array, directions: Array, tip_radius: float) -> tuple[Array, Array]:
    """How far discs travel along directions until they touch the outline, and where they then touch.

    Args:
        starts: of the centres, outside, with the outline ahead, shape (m, 2); directions: unit vectors, (m, 2).

    Returns:
        ways (m,) [m], infinite where a disc never touches, and points (m, 2).
    """
    q = np.asarray(starts, dtype=float)
    if outline.is_circle:
        ways = _ray_circles(q, directions, outline.centre[None], outline.radius + tip_radius)[:, 0]
        out = q + np.where(np.isfinite(ways), ways, 0.0)[:, None] * directions - outline.centre
        return ways, outline.centre + outline.radius * out / np.linalg.norm(out, axis=1)[:, None]
    a, b = outline.edges[:, 0], outline.edges[:, 1]
    inward = outline.edge_normals
    if len(a) > MANY:
        met = _in_the_way(outline, q, directions, tip_radius)
        a, b, inward = a[met], b[met], inward[met]
        if not len(a):
            return np.full(len(q), np.inf), q.copy()
    d = b - a
    closing = directions @ inward.T
    gap = np.sum(inward * (a - tip_radius * inward), axis=1) - q @ inward.T
    with np.errstate(divide="ignore", invalid="ignore"):
        to_edges = np.where(closing > 1e-12, gap / closing, np.inf)
    along = q @ d.T - np.sum(a * d, axis=1)
    along += np.where(closing > 1e-12, to_edges, 0.0) * (directions @ d.T)
    to_edges = np.where((along >= 0) & (along <= np.sum(d * d, axis=1)), to_edges, np.inf)
    to_corners = _ray_circles(q, directions, a, tip_radius)
    rows = np.arange(len(q))
    edge, corner = np.argmin(to_edges, axis=1), np.argmin(to_corners, axis=1)
    first = to_edges[rows, edge]
    on_edge = first <= to_corners[rows, corner]
    ways = np.where(on_edge, first, to_corners[rows, corner])
    there = q + np.where(np.isfinite(first), first, 0.0)[:, None] * directions + tip_radius * inward[edge]
    return ways, np.where(on_edge[:, None], there, a[corner])


def _in_the_way(outline: Outline, q: Array, directions: Array, tip_radius: float) -> NDArray[np.intp]:
    """Numbers of the edges that the discs of a narrow fan of ways may touch first, with their neighbours."""
    middle = directions[len(q) // 2]
    across = perpendicular(middle)
    offsets = (q - q[0]) @ across
    turned = np.abs(cross(middle, directions)).max()
    if np.min(directions @ middle) <= 0:
        return np.arange(len(outline.vertices))
    lateral = (outline.vertices - q[0]) @ across
    reach = np.abs((outline.vertices - q[0]) @ middle).max() + np.ptp(offsets) + tip_radius
    room = tip_radius + turned * reach / np.min(directions @ middle) + 1e-9 * outline.size
    other = np.roll(lateral, -1)
    beside = np.minimum(lateral, other) <= offsets.max() + room
    beside &= np.maximum(lateral, other) >= offsets.min() - room
    # A disc first touches edges that face it, or their corners.
    faces = outline.edge_normals @ middle > -turned - 1e-12
    met = beside & faces
    return np.flatnonzero(met | np.roll(met, 1))


def _ray_circles(q: Array, directions: Array, centres: Array, radius: float) -> Array:
    """Ways until rays (m,) enter circles (k,), shape (m, k); infinite where they do not."""
    offset = centres[None] - q[:, None]
    middle = np.einsum("mki,mi->mk", offset, directions)
    inside = radius**2 - cross(directions[:, None], offset) ** 2
    return np.where(inside >= 0, middle - np.sqrt(np.maximum(inside, 0.0)), np.inf)


def _normal(outline: Outline, point: Array, tip: Array) -> Array:
    """The inward normal at a touched point: the outline's, or, on a nearly smooth corner, away from the tip."""
    found = outline.nearest(point)
    if not found.corner:
        return found.normal
    n = len(outline.vertices)
    corner = found.edge if found.along < 0.5 else (found.edge + 1) % n
    before, after = outline.edge_normals[corner - 1], outline.edge_normals[corner]
    if np.arccos(np.clip(before @ after, -1.0, 1.0)) > SMOOTH_CORNER:
        raise InputError(
            f"a fingertip would rest on a corner of the outline, at {_told(point)}",
            hint="A place further from the corner would help.",
        )
    away = point - tip
    return away / np.hypot(*away) if np.hypot(*away) > 0 else (before + after) / np.hypot(*(before + after))


def _balance(imbalance: Callable[[Array], Array], start: float, tolerance: float) -> float | None:
    """A zero of the imbalance near the start angle: outward scan for a change of sign, then ever finer scans.

    Where there is none, the start; None if there is no value even there.
    """
    value = float(imbalance(np.array([start]))[0])
    if np.isnan(value):
        return None
    if abs(value) <= tolerance:
        return start
    k = np.arange(-SCAN, SCAN + 1)
    values = imbalance(start + STEP * k)
    for j in range(1, SCAN + 1):
        for side in (1, -1):
            near, far = SCAN + side * (j - 1), SCAN + side * j
            if values[near] == 0 or values[near] * values[far] < 0:
                return _finer(imbalance, start + STEP * k[near], start + STEP * k[far])
    return start


def _finer(imbalance: Callable[[Array], Array], near: float, far: float) -> float:
    """The first change of sign between two angles, to the last digits."""
    for _ in range(14):
        angles = np.linspace(near, far, 18)
        values = imbalance(angles)
        if values[0] == 0:
            return near
        after = np.flatnonzero(~(values * values[0] > 0))
        if not len(after):
            return far
        near, far = float(angles[after[0] - 1]), float(angles[after[0]])
        if abs(far - near) <= 4e-16 * max(1.0, abs(near)):
            break
    return 0.5 * (near + far)


def _told(point: Array) -> str:
    """A point of the drawing, for messages."""
    x, y = 1000 * point + 0.0
    return f"({x:.2f}, {y:.2f}) mm"
