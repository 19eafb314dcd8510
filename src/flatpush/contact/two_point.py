"""Two fingertips at once: does the object keep both, under the composite wrench cone ([Zhou2017] Sec. 4.2)?"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import finite
from ..friction.surface import LimitSurface, WrenchSet
from ..geometry import cross, perpendicular
from ..geometry.pose import Array
from .point_contact import PointContact
from .wrench_cone import CLOSED, lever_of, shared


def two_point_sticks(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> bool:
    """Whether some wrench of the twist lies in the closed composite cone of the contacts.

    Then the object keeps the body twist (3,) that the hand imposes. Contacts, surface and twist share one frame
    with its origin at the centre of friction. A rotation about a support point leaves that point's friction
    free: any of the wrenches will do.
    """
    return _inside(contacts, surface.wrench_set(finite(twist, "a twist is three finite numbers")))


def composite_margin(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> float:
    """The fraction of the two contacts' friction that can be lost before the twist (3,) no longer sticks.

    1 if the twist sticks without friction, 0 on the cone's boundary, negative if it takes more friction than there
    is; -inf if no friction is enough (or, for a rotation about a support point, ten times the friction).

    The forces of two contacts that make a wrench have one parameter left, a squeeze. With normal parts a and
    tangential parts b they need the friction max |b| / a, the least of which over all squeezes is what counts.
    """
    wrenches = surface.wrench_set(twist)
    if wrenches.radius > 0:
        return _last(
            lambda margin: _inside(
                [replace(c, friction=(1 - margin) * c.friction) for c in contacts], wrenches
            )
        )
    rays = [c.wrench(f) for c in contacts for f in (c.normal, perpendicular(c.normal))]
    parts = _forces(rays, wrenches.centre, lever_of(contacts))
    if parts is None:
        return -np.inf
    a, b = parts[0::2], parts[1::2]
    needed = -_greatest_least(np.concatenate([b, -b]), np.concatenate([a, a]))
    mu = contacts[0].friction
    return 1 - needed / mu if mu > 0 else (1.0 if needed <= CLOSED else -np.inf)


def spacing_margin(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> float:
    """The fraction of their distance by which two fingers could move together before the twist (3,) no longer sticks.

    1 where they could stand at one place, 0 on the cone's boundary, negative if they stand too close, -inf where no
    distance is enough (for a rotation about a support point: ten times the distance). On curved sides, where moving
    would change the normals: twice the part of the load that the lighter one bears at least (see wrench_cone.shared).
    """
    wrenches = surface.wrench_set(twist)
    if wrenches.radius > 0:
        return _last(lambda margin: shared(contacts, 0.5 * margin).depths(wrenches)[1] >= -CLOSED)
    parts = _forces(
        [c.wrench(f) for c in contacts for f in c.force_edges()], wrenches.centre, lever_of(contacts)
    )
    if parts is None:
        return -np.inf
    # Each pair of like edges (both left, both right) is shared: the lesser part over the sum, at its greatest.
    both = parts[:2] + parts[2:]
    return min(1.0, 2 * _greatest_least(parts, np.concatenate([both, both])))


def _forces(rays: Sequence[Array], wrench: Array, lever: float) -> Array | None:
    """All coefficients x = x₀ + s z of four wrenches that add up to one, as (x₀, z), shape (4, 2); None if none do."""
    scale = np.array([1.0, 1.0, 1.0 / lever])
    G, F = (np.array(rays) * scale).T, wrench * scale
    U, sizes, V = np.linalg.svd(G)
    if sizes[2] <= CLOSED * sizes[0]:
        x = np.linalg.pinv(G, rcond=CLOSED) @ F
        return None if np.linalg.norm(G @ x - F) > CLOSED * np.linalg.norm(F) else np.stack([x, V[3]], axis=1)
    x = V[:3].T @ ((U.T @ F) / sizes)
    return np.stack([x, float(np.linalg.norm(x)) * V[3]], axis=1)


def _greatest_least(numerators: Array, denominators: Array) -> float:
    """The greatest over s of the least of n(s) / d(s) among linear functions, where all d(s) ≥ 0; -inf if nowhere.

    Each ratio is monotone in s, so it is where two are equal, or at infinity. A 0 / 0 demands nothing.

    Args:
        numerators, denominators: values at s = 0 and slopes, shape (k, 2).
    """
    n, d = numerators, denominators
    i, j = np.triu_indices(len(n), 1)
    constant = n[i, 0] * d[j, 0] - n[j, 0] * d[i, 0]
    linear = n[i, 0] * d[j, 1] + n[i, 1] * d[j, 0] - n[j, 0] * d[i, 1] - n[j, 1] * d[i, 0]
    square = n[i, 1] * d[j, 1] - n[j, 1] * d[i, 1]
    root = np.sqrt(np.maximum(linear**2 - 4 * square * constant, 0.0))
    q = -0.5 * (linear + np.where(linear < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.concatenate([q / square, constant / q])
    s = np.concatenate([[0.0], s[np.isfinite(s)]])
    # In homogeneous coordinates (1, s), unit length; infinity is (0, ±1).
    at = np.concatenate(
        [np.stack([np.ones_like(s), s], axis=1) / np.hypot(1.0, s)[:, None], [[0, 1], [0, -1]]]
    )
    N, D = n @ at.T, d @ at.T
    tiny = CLOSED * max(float(np.max(np.abs(n))), float(np.max(np.abs(d))))
    none = tiny >= D
    ratio = np.where(none, np.where(np.abs(N) <= tiny, np.inf, -np.inf), N / np.where(none, 1.0, D))
    ratio = np.where(-tiny > D, -np.inf, ratio)
    return float(np.max(np.min(ratio, axis=0)))


def _last(holds: Callable[[float], bool]) -> float:
    """The greatest margin in (-9, 1] for which something holds, by halving; -inf if it does not even for -9."""
    if holds(1.0):
        return 1.0
    low, high = (0.0, 1.0) if holds(0.0) else (-9.0, 0.0)
    if low < 0 and not holds(low):
        return -np.inf
    while high - low > 1e-11:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _inside(contacts: Sequence[PointContact], wrenches: WrenchSet) -> bool:
    # Torques in units of the lever, so that all three components compare.
    lever = lever_of(contacts)
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
