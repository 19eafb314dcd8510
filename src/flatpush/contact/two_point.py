"""Two fingertips at once: does the object keep both, under the composite wrench cone ([Zhou2017] Sec. 4.2)?"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ..friction.surface import LimitSurface, WrenchSet
from ..geometry import cross
from ..geometry.pose import Array
from .point_contact import PointContact
from .wrench_cone import CLOSED, shared


def two_point_sticks(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> bool:
    """Whether some wrench of the twist lies in the closed composite cone of the contacts.

    Then the object keeps the body twist (3,) that the hand imposes. Contacts, surface and twist share one frame
    with its origin at the centre of friction. A rotation about a support point leaves that point's friction
    free: any of the wrenches will do.
    """
    return _inside(contacts, surface.wrench_set(twist))


def composite_margin(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> float:
    """The fraction of the contacts' friction that can be lost before the twist no longer sticks.

    1 if the twist sticks without friction, 0 on the cone's boundary, negative (down to -9) if it takes more friction
    than there is.
    """
    wrenches = surface.wrench_set(twist)

    def sticks(fraction: float) -> bool:
        return _inside([replace(c, friction=fraction * c.friction) for c in contacts], wrenches)

    if sticks(0.0):
        return 1.0
    low, high = (0.0, 1.0) if sticks(1.0) else (1.0, 10.0)
    if high > 1 and not sticks(high):
        return -9.0
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (low, middle) if sticks(middle) else (middle, high)
    return 1.0 - high


def spacing_margin(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> float:
    """The fraction of their distance by which two fingers could move together before the twist no longer sticks.

    1 where they could stand at one place, 0 on the cone's boundary, negative (down to -9) if they stand too close. On
    curved sides, where moving would change the normals: twice the part of the load that the lighter one bears at
    least (see wrench_cone.shared).
    """
    wrenches = surface.wrench_set(twist)

    def sticks(fraction: float) -> bool:
        return shared(contacts, 0.5 * fraction).depths(wrenches)[1] >= -CLOSED

    if sticks(1.0):
        return 1.0
    low, high = (0.0, 1.0) if sticks(0.0) else (-9.0, 0.0)
    if low < 0 and not sticks(low):
        return -9.0
    while high - low > 1e-10:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sticks(middle) else (low, middle)
    return low


def _inside(contacts: Sequence[PointContact], wrenches: WrenchSet) -> bool:
    # Torques in units of the lever, so that all three components compare.
    lever = max(float(np.max([np.hypot(*c.point) for c in contacts])), 1e-300)
    scale = np.array([1.0, 1.0, 1.0 / lever])
    rays = np.array([c.wrench(f) * scale for c in contacts for f in c.force_edges()])
    F = wrenches.centre * scale
    if _in_cone(rays, F):
        return True
    if wrenches.radius == 0:
        return False
    # Free force g at the support point: about that point the torque stays, the force may differ by |g| ≤ radius.
    p = wrenches.point / lever
    torque = F[2] - cross(p, F[:2])
    torques = rays[:, 2] - cross(p, rays[:, :2])
    return _distance(rays[:, :2], torques, F[:2], float(torque)) <= wrenches.radius + CLOSED


def _in_cone(rays: Array, F: Array) -> bool:
    """By Carathéodory: F is a non-negative combination of at most three rays."""
    size = float(np.linalg.norm(F))
    for triple in (c for k in (3, 2) for c in combinations(range(len(rays)), k)):
        G = rays[list(triple)].T
        weights, *_ = np.linalg.lstsq(G, F, rcond=1e-12)
        weights = np.maximum(weights, 0.0)
        if np.linalg.norm(G @ weights - F) <= CLOSED * size:
            return True
    return False


def _distance(forces: Array, torques: Array, force: Array, torque: float) -> float:
    """The distance of a force from the forces that the cone can make with a given torque: a convex region of the plane.

    Its corners come from single rays with the torque's sign, its open sides from pairs of rays whose torques cancel.
    The force itself is known to lie outside, so the nearest point is on a side between two corners or on an open side.
    """
    small = 1e-12 * max(1.0, abs(torque))
    corners = [f * torque / t for f, t in zip(forces, torques, strict=True) if t * torque > small * small]
    if abs(torque) <= small:
        corners = [np.zeros(2)]
    sides = [f for f, t in zip(forces, torques, strict=True) if abs(t) <= small]
    for (f, t), (g, s) in combinations(list(zip(forces, torques, strict=True)), 2):
        if t * s < 0:
            sides.append(abs(s) * f + abs(t) * g)
    best = np.inf
    for i, a in enumerate(corners):
        best = min(best, float(np.hypot(*(force - a))))
        for b in corners[i + 1 :]:
            d = b - a
            along = np.clip((force - a) @ d / max(float(d @ d), 1e-300), 0.0, 1.0)
            best = min(best, float(np.hypot(*(force - a - along * d))))
        for d in sides:
            along = max(0.0, float((force - a) @ d) / max(float(d @ d), 1e-300))
            best = min(best, float(np.hypot(*(force - a - along * d))))
    return best
