"""Two-finger pushes that are stable whatever the pressure on the table: the procedure STABLE ([Lynch1996] Sec. 3.2).

Coulomb friction at a support point p resists a rotation about c with a force square to p - c. Hence, for forces that
the hand applies and every pressure with its centre of friction at the origin, inside the outline and within r of it:

* the force lies to the right of a direction e while the object turns counter-clockwise about c if c is further along e
  than the whole outline, and to the left of it if c is less far than the whole outline;
* it passes a point q on the counter-clockwise side if c is nearer to q than to the COF, and on the other if c lies
  further than r²/|q| behind the COF as seen from q.

The conditions on c are half-planes, two for the directions of friction and two for the end points of the contact. They
are sufficient, not necessary: some tight turns are missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import cross, perpendicular, rotate
from ..geometry.pose import Array
from .point_contact import PointContact

# Normals that differ by less make a line contact [rad].
PARALLEL = 1e-9


@dataclass(frozen=True, eq=False)
class StableRegion:
    """Rotation centres {c : normals @ c ≤ offsets} about the COF, for both senses; empty ones have no normals.

    Attributes:
        left, right: (normals (4, 2), offsets (4,)) of counter-clockwise and of clockwise turns; None where the friction
            cones of the contacts have no direction in common.
    """

    left: tuple[Array, Array] | None
    right: tuple[Array, Array] | None

    def contains(self, centres: ArrayLike, sense: int) -> Array:
        """Whether rotation centres (..., 2) are inside, for the sense +1 (counter-clockwise) or -1."""
        c = np.asarray(centres, dtype=float)
        half_planes = self.left if sense > 0 else self.right
        if half_planes is None:
            return np.zeros(c.shape[:-1], dtype=bool)
        normals, offsets = half_planes
        return np.asarray(np.all(c @ normals.T <= offsets, axis=-1))

    def polygon(self, sense: int, box: Sequence[float]) -> Array:
        """The part of the region inside a box (xmin, ymin, xmax, ymax) [m], corners in order, shape (n, 2) [m].

        Args:
            sense: +1 for rotations counter-clockwise, -1 for those clockwise.
        """
        half_planes = self.left if sense > 0 else self.right
        if half_planes is None:
            return np.empty((0, 2))
        x0, y0, x1, y1 = box
        corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)
        for normal, offset in zip(*half_planes, strict=True):
            corners = clipped(corners, offset - corners @ normal)
        return corners


def stable_region(contacts: Sequence[PointContact], outline: ArrayLike, radius: float) -> StableRegion:
    """Lynch and Mason's conservative region of rotation centres that keep two contacts, whatever the pressure.

    Contacts whose normals differ are taken with the directions that both friction cones share: a force between the two
    points in such a direction is a sum of forces that they can exert.

    Args:
        contacts: two, about the COF.
        outline: corners that enclose every support point, about the COF, shape (n, 2).
        radius: the largest distance of a support point from the COF [m].
    """
    first, second = _in_order(contacts)
    low, high = _shared_angles(first, second)
    if high <= low:
        return StableRegion(None, None)
    e_left, e_right = rotate(high, first.normal), rotate(low, first.normal)
    along_left, along_right = (np.asarray(outline, dtype=float) @ e for e in (e_left, e_right))
    rows: dict[int, tuple[Array, Array]] = {}
    for sense, q, other in ((1, first.point, second.point), (-1, second.point, first.point)):
        near, far = float(np.hypot(*q)), float(np.hypot(*other))
        if near == 0 or far == 0:
            return StableRegion(None, None)
        if sense > 0:
            directions = ([-e_left, -np.max(along_left)], [e_right, np.min(along_right)])
        else:
            directions = ([e_left, np.min(along_left)], [-e_right, -np.max(along_right)])
        ends = ([-q / near, -0.5 * near], [other / far, -(radius**2) / far])
        every = (*directions, *ends)
        rows[sense] = (np.array([n for n, _ in every]), np.array([o for _, o in every], dtype=float))
    return StableRegion(rows[1], rows[-1])


def beyond_slider(contacts: Sequence[PointContact], outline: ArrayLike, twist: ArrayLike) -> float | None:
    """How far a rotation centre lies outside the strip square to the contact that encloses the object [m].

    Where that is positive and the twist can stick, it is the only motion that can happen, whatever the pressure
    ([Lynch1996] Theorem 4). Inside the strip other motions may be consistent too. Infinite for translations; None
    where the two contacts are no line contact, as on curved sides.
    """
    V = np.asarray(twist, dtype=float)
    first, second = _in_order(contacts)
    t = second.point - first.point
    length = float(np.hypot(*t))
    if abs(float(cross(first.normal, second.normal))) > PARALLEL or length == 0:
        return None
    t = t / length
    if abs(float(t @ first.normal)) > PARALLEL:
        return None
    if V[2] == 0:
        return float("inf")
    along = np.asarray(outline, dtype=float) @ t
    c = float(np.array([-V[1], V[0]]) @ t) / float(V[2])
    return max(float(np.min(along)) - c, c - float(np.max(along)))


def _in_order(contacts: Sequence[PointContact]) -> tuple[PointContact, PointContact]:
    """The left and the right one, as seen along the inward normals."""
    a, b = contacts
    left = perpendicular(a.normal + b.normal)
    return (a, b) if float((a.point - b.point) @ left) >= 0 else (b, a)


def _shared_angles(first: PointContact, second: PointContact) -> tuple[float, float]:
    """The directions that both friction cones hold, as angles from the first one's normal."""
    turn = float(first.force_angles(second.normal))
    low = max(-first.half_angle, turn - second.half_angle)
    high = min(first.half_angle, turn + second.half_angle)
    return low, high


def clipped(corners: Array, heights: Array) -> Array:
    """The part of a convex polygon where a linear function, given at its corners, is not negative."""
    found = []
    for i in range(len(corners)):
        j = (i + 1) % len(corners)
        if heights[i] >= 0:
            found.append(corners[i])
        if (heights[i] >= 0) != (heights[j] >= 0):
            s = heights[i] / (heights[i] - heights[j])
            found.append(corners[i] + s * (corners[j] - corners[i]))
    return np.array(found).reshape(-1, corners.shape[1])
