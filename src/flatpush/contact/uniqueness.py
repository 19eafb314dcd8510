"""Whether sticking is the only motion that can happen, on every table of a set, of two fingers at a straight side.

A motion of the hand in which both fingers stick may have rivals: other motions of the object that the friction of table
and fingers allows as well. Let e be a unit vector along the side and n its inward normal, V the twist of the hand, W(V)
the wrench that the table asks for, T and N its parts along e and n. While both fingers touch without sticking they slip
at one speed σ, and the object moves with V_σ = V - σ e. Such a rival has T = μ N, e being the way of the slip, and
neither finger pulls. To exclude these is enough:

* One finger alone, the other having left, is excluded with them. The force of one finger turns the way that its point's
  velocity does, so that T/N falls while σ grows. And the moment about it grows with the turn, which is further than the
  hand's when the other leaves: so it vanishes only at slips at which, in V_σ, the other would have to pull. Where the
  other's force vanishes first, T/N is less than μ if no V_σ up to there was a rival, and less still at all later slips.
* Both leave, and the object rests, only where neither moves against the side.

The turning centre of V_σ goes square to the side, from that of V to infinity. All along, some face has to have the
wrenches of all tables behind it: friction (T < μ N), or one of the fingers', N being positive.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import perpendicular, velocity_at
from ..geometry.pose import Array
from .point_contact import PointContact
from .table_set import TableSet, is_straight
from .wrench_cone import lever_of

# Places of the turning centre, as angles seen from so far beside its way as the support's radius; and, of few feet, as
# angles seen from each.
PLACES, NEAR, FEW = 32, 8, 12
# The least that a depth can be: where a finger moves away from the side, nothing is said.
UNKNOWN = -1.0


def rivals_depth(
    tables: Sequence[TableSet], contacts: Sequence[PointContact], twists: ArrayLike
) -> float | None:
    """How far all rivals of sticking are from being possible, on every table: above 0, sticking alone can happen.

    It is the least depth, as of TableSet.margin, at which their wrenches lie behind faces that exclude them. At 0 or
    below it is not shown that there are none.

    Args:
        tables: at every place that they may have in the hand (see TableSet.held).
        contacts: two, about the nominal centre of friction, with the least friction.
        twists: of the hand, about the same point, each keeping both contacts on every table, shape (m, 3).

    Returns:
        None for fingers that do not push one straight side.
    """
    if not is_straight(contacts):
        return None
    a, b = contacts
    n, lever = a.normal, lever_of(contacts)
    left = perpendicular(n)
    pulls = [_pull(c, d, left, lever) for c, d in ((a, b), (b, a))]
    least = np.inf
    for V in np.asarray(twists, dtype=float):
        if min(float(velocity_at(V, c.point) @ n) for c in contacts) <= 0:
            return UNKNOWN
        for e in (left, -left):
            rivals = _rivals(tables[0], V, e)
            sticks = _heights(tables, np.array([[*(a.friction * n - e), 0.0]]), lever, rivals)[:, 0]
            if np.min(sticks) <= 0:
                first, second, presses = _heights(tables, np.array([*pulls, [*n, 0.0]]), lever, rivals).T
                sticks = np.maximum(sticks, np.minimum(np.maximum(first, second), presses))
            least = min(least, float(np.min(sticks)))
    return least


def _heights(tables: Sequence[TableSet], faces: Array, lever: float, rivals: Array) -> Array:
    """The least heights at all places in the hand, of each rival and those to the next, shape (m - 1, k)."""
    faces = faces / np.linalg.norm(faces, axis=1, keepdims=True)
    return np.asarray(np.min([place.heights_between(faces, lever, rivals) for place in tables], axis=0))


def _pull(finger: PointContact, other: PointContact, left: Array, lever: float) -> Array:
    """The normal of the face behind which a finger would press, from the moment about the other one, shape (3,)."""
    x, y = other.point
    # A force N n at a distance d to the left of the other has the moment -d N about it.
    sense = np.sign((finger.point - other.point) @ left)
    return np.asarray(sense * np.array([y, -x, lever]))


def _rivals(tables: TableSet, V: Array, e: Array) -> Array:
    """Twists of the object while the hand slips along e, from none to any speed, shape (m, 3)."""
    if V[2] == 0:
        return np.array([V, V])  # while it slips the force only turns away from the edge of friction
    v, turn = V[:2] / abs(V[2]), np.sign(V[2])
    slips = tables.radius * np.tan(0.5 * np.pi * (np.arange(PLACES) / PLACES) ** 2)
    if len(tables.points) <= FEW:
        at = v + turn * perpendicular(tables.points)  # the velocities of feet that do not slip
        angles = np.tan(0.5 * np.pi * np.arange(1 - NEAR, NEAR) / NEAR)
        slips = np.concatenate([slips, (at @ e + np.abs(at @ perpendicular(e)) * angles[:, None]).ravel()])
    slips = np.sort(slips[slips >= 0])
    moved = np.column_stack([v - slips[:, None] * e, np.full(len(slips), turn)])
    return np.concatenate([moved, [[*-e, 0.0]]])
