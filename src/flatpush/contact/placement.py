"""Where the fingertips of a push stand: both touch the outline, and neither overlaps it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry import Outline, OutlinePoint, cross, perpendicular, rotate, wrap_angle
from ..geometry.pose import Array

# A fingertip may rest on a corner only where the outline is nearly smooth there.
SMOOTH_CORNER = np.deg2rad(20.0)


@dataclass(frozen=True, eq=False)
class Placement:
    """Fingertips at an outline, in the outline's frame O.

    Attributes:
        points: of the outline that the tips touch, shape (k, 2).
        normals: inward unit normals there, shape (k, 2).
        tips: centres of the fingertips, shape (k, 2).
        pose: X_OE, shape (3,): midway between the tips, +x the push direction.
    """

    points: Array
    normals: Array
    tips: Array
    pose: Array

    @property
    def virtual_point(self) -> Array:
        """The contact point, or the midpoint of two ([Zhou2017] Sec. 4.2)."""
        return self.points.mean(axis=0)

    @property
    def virtual_normal(self) -> Array:
        """The inward normal, or the average of two."""
        n = self.normals.mean(axis=0)
        return n / np.hypot(*n)


def place_fingers(
    outline: Outline, at: OutlinePoint, fingers: int, spacing: float, tip_radius: float
) -> Placement:
    """Places one or two round fingertips at a point of an outline.

    Two fingers straddle the inward normal at the point; the hand is advanced along its push direction and turned until
    both tips touch, so that it also fits into concave sides.

    Raises:
        InputError: if a tip would overlap the outline, rest on a sharp corner, or not touch at all.
    """
    if fingers == 1:
        tip = at.point - tip_radius * at.normal
        if outline.nearest(tip).distance < tip_radius - 1e-9 * outline.size:
            raise InputError(
                "the fingertip does not fit there without overlapping the outline", value=at.point
            )
        pose = np.array([*tip, np.arctan2(at.normal[1], at.normal[0])])
        return Placement(at.point[None], at.normal[None], tip[None], pose)

    heading = float(np.arctan2(at.normal[1], at.normal[0]))

    def reach(angle: float) -> list[tuple[float, Array] | None]:
        x, y = rotate(angle, [1.0, 0.0]), rotate(angle, [0.0, 1.0])
        back = at.point - 2 * outline.size * x
        return [travel(outline, back + side * spacing / 2 * y, x, tip_radius) for side in (1, -1)]

    def imbalance(angle: float) -> float:
        left, right = reach(angle)
        if left is None or right is None:
            raise InputError("only one of the fingers meets the outline there", value=at.point)
        return left[0] - right[0]

    angle = _balance(imbalance, heading, 1e-12 * outline.size)
    left, right = reach(angle)
    if left is None or right is None or abs(left[0] - right[0]) > 1e-7 * outline.size:
        raise InputError("the two fingers cannot both touch the outline there", value=at.point)
    x = rotate(angle, [1.0, 0.0])
    y = perpendicular(x)
    middle = at.point - 2 * outline.size * x + 0.5 * (left[0] + right[0]) * x
    tips = np.stack([middle + spacing / 2 * y, middle - spacing / 2 * y])
    points = np.stack([left[1], right[1]])
    if np.max(np.linalg.norm(points - at.point, axis=1)) > 2 * spacing + 2 * tip_radius:
        raise InputError("another part of the outline is in the fingers' way there", value=at.point)
    normals = np.stack([_normal(outline, p, t) for p, t in zip(points, tips, strict=True)])
    return Placement(points, normals, tips, np.array([*middle, wrap_angle(angle)]))


def travel(
    outline: Outline, start: ArrayLike, direction: Array, tip_radius: float
) -> tuple[float, Array] | None:
    """How far a disc travels along a direction until it touches the outline, and where it then touches.

    None if it never does. The start lies outside, with the outline ahead.
    """
    q = np.asarray(start, dtype=float)
    if outline.is_circle:
        s = _ray_circle(q, direction, outline.centre[None], outline.radius + tip_radius)[0]
        if not np.isfinite(s):
            return None
        out = q + s * direction - outline.centre
        return float(s), outline.centre + outline.radius * out / np.hypot(*out)
    a, b = outline.edges[:, 0], outline.edges[:, 1]
    inward = outline.edge_normals
    shifted = a - tip_radius * inward
    closing = inward @ direction
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.einsum("ij,ij->i", inward, shifted - q) / closing
    d = b - a
    along = np.einsum("ij,ij->i", q + np.where(closing > 0, s, 0.0)[:, None] * direction - a, d)
    length2 = np.einsum("ij,ij->i", d, d)
    s = np.where((closing > 1e-12) & (along >= 0) & (along <= length2), s, np.inf)
    corners = _ray_circle(q, direction, a, tip_radius)
    edge, corner = int(np.argmin(s)), int(np.argmin(corners))
    if not np.isfinite(min(s[edge], corners[corner])):
        return None
    if s[edge] <= corners[corner]:
        return float(s[edge]), q + s[edge] * direction + tip_radius * inward[edge]
    return float(corners[corner]), a[corner].copy()


def _ray_circle(q: Array, direction: Array, centres: Array, radius: float) -> Array:
    offset = centres - q
    middle = offset @ direction
    inside = radius**2 - cross(direction, offset) ** 2
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
        raise InputError("a fingertip would rest on a corner of the outline", value=point)
    away = point - tip
    return away / np.hypot(*away) if np.hypot(*away) > 0 else (before + after) / np.hypot(*(before + after))


def _balance(imbalance: Callable[[float], float], start: float, tolerance: float) -> float:
    """A zero of the imbalance near the start angle: outward scan for a change of sign, then bisection."""
    value = imbalance(start)
    if abs(value) <= tolerance:
        return start
    step = np.deg2rad(2.0)
    for k in range(1, 23):
        for side in (1, -1):
            far, near = start + side * k * step, start + side * (k - 1) * step
            try:
                low, high = imbalance(near), imbalance(far)
            except InputError:
                continue
            if low == 0 or low * high < 0:
                for _ in range(60):
                    middle = 0.5 * (near + far)
                    m = imbalance(middle)
                    near, far, low = (middle, far, m) if m * low > 0 else (near, middle, low)
                return 0.5 * (near + far)
    return start
