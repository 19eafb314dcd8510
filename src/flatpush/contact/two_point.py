"""Two fingertips at once: does the object keep both, under the composite wrench cone ([Zhou2017] Sec. 4.2)?"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import finite
from ..friction.surface import LimitSurface, WrenchSet
from ..geometry import cross
from ..geometry.pose import Array
from .point_contact import PointContact
from .wrench_cone import CLOSED, axis_wrenches, edge_wrenches, lever_of, shared

Contacts = Sequence[PointContact]


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
    """
    return composite_margins([contacts], [surface.wrench_set(twist)])[0]


def composite_margins(pairs: Sequence[Contacts], twists: Sequence[WrenchSet]) -> list[float]:
    """composite_margin of pairs of contacts, each with all wrenches of its twist.

    The forces of two contacts that make a wrench have one parameter left, a squeeze. With normal parts a and
    tangential parts b they need the friction max |b| / a, the least of which over all squeezes is what counts.
    """

    def by_halving(contacts: Contacts, wrenches: WrenchSet) -> float:
        def weaker(margin: float) -> list[PointContact]:
            return [replace(c, friction=(1 - margin) * c.friction) for c in contacts]

        return _last(lambda margin: _inside(weaker(margin), wrenches))

    def by_squeezing(contacts: list[Contacts], parts: Array) -> list[float]:
        a, b = parts[:, 0::2], parts[:, 1::2]
        least = -_greatest_least(np.concatenate([b, -b], axis=1), np.concatenate([a, a], axis=1))
        margins = []
        for pair, needed in zip(contacts, least.tolist(), strict=True):
            mu = pair[0].friction
            margins.append(1 - needed / mu if mu > 0 else (1.0 if needed <= CLOSED else -np.inf))
        return margins

    return _margins(pairs, twists, by_halving, axis_wrenches, by_squeezing)


def spacing_margin(contacts: Sequence[PointContact], surface: LimitSurface, twist: ArrayLike) -> float:
    """The fraction of their distance by which two fingers could move together before the twist (3,) no longer sticks.

    1 where they could stand at one place, 0 on the cone's boundary, negative if they stand too close, -inf where no
    distance is enough (for a rotation about a support point: ten times the distance). On curved sides, where moving
    would change the normals: twice the part of the load that the lighter one bears at least (see wrench_cone.shared).
    """
    return spacing_margins([contacts], [surface.wrench_set(twist)])[0]


def spacing_margins(pairs: Sequence[Contacts], twists: Sequence[WrenchSet]) -> list[float]:
    """spacing_margin of pairs of contacts, each with all wrenches of its twist."""

    def by_halving(contacts: Contacts, wrenches: WrenchSet) -> float:
        return _last(lambda margin: shared(contacts, 0.5 * margin).depths(wrenches)[1] >= -CLOSED)

    def by_squeezing(contacts: list[Contacts], parts: Array) -> list[float]:
        # Each pair of like edges (both left, both right) is shared: the lesser part over the sum, at its greatest.
        both = parts[:, :2] + parts[:, 2:]
        greatest = _greatest_least(parts, np.concatenate([both, both], axis=1))
        return [min(1.0, 2 * share) for share in greatest.tolist()]

    return _margins(pairs, twists, by_halving, edge_wrenches, by_squeezing)


def _margins(
    pairs: Sequence[Contacts],
    twists: Sequence[WrenchSet],
    by_halving: Callable[[Contacts, WrenchSet], float],
    rays_of: Callable[[Contacts], Array],
    by_squeezing: Callable[[list[Contacts], Array], list[float]],
) -> list[float]:
    """Margins of pairs of contacts: by halving where a twist has many wrenches, else from the forces that make its one.

    Args:
        rays_of: the four wrenches of a pair whose multiples are the forces.
        by_squeezing: margins from what _forces tells of some pairs.
    """
    found = [-np.inf] * len(pairs)
    single = [i for i, wrenches in enumerate(twists) if wrenches.radius == 0]
    for i in set(range(len(pairs))).difference(single):
        found[i] = by_halving(pairs[i], twists[i])
    if single:
        levers = np.array([lever_of(pairs[i]) for i in single])
        rays, wrenches = (
            np.array([rays_of(pairs[i]) for i in single]),
            np.array([twists[i].centre for i in single]),
        )
        parts, made = _forces(rays, wrenches, levers)
        some = [i for i, is_made in zip(single, made, strict=True) if is_made]
        for i, margin in zip(
            some, by_squeezing([pairs[i] for i in some], parts[made]) if some else [], strict=True
        ):
            found[i] = margin
    return found


def _forces(rays: Array, wrenches: Array, levers: Array) -> tuple[Array, NDArray[np.bool_]]:
    """All coefficients x = x₀ + s z of four wrenches (n, 4, 3) that add up to one (n, 3), as (x₀, z).

    Returns:
        x₀ and z, shape (n, 4, 2), and whether there are such, shape (n,).
    """
    scale = np.stack([np.ones_like(levers), np.ones_like(levers), 1 / levers], axis=1)
    G, F = np.swapaxes(rays * scale[:, None], 1, 2), wrenches * scale
    U, sizes, V = np.linalg.svd(G)
    flat = sizes[:, 2] <= CLOSED * sizes[:, 0]
    along = np.einsum("nij,ni->nj", U, F) / np.where(flat[:, None], 1.0, sizes)
    x = np.einsum("nij,ni->nj", V[:, :3], along)
    z = np.linalg.norm(x, axis=1)[:, None] * V[:, 3]
    for i in np.flatnonzero(flat):
        x[i], z[i] = np.linalg.pinv(G[i], rcond=CLOSED) @ F[i], V[i, 3]
    made = ~flat | (
        np.linalg.norm(np.einsum("nij,nj->ni", G, x) - F, axis=1) <= CLOSED * np.linalg.norm(F, axis=1)
    )
    return np.stack([x, z], axis=2), made


def _greatest_least(numerators: Array, denominators: Array) -> Array:
    """The greatest over s of the least of n(s) / d(s) among linear functions, where all d(s) ≥ 0; -inf if nowhere.

    Each ratio is monotone in s, so it is where two are equal, or at infinity. A 0 / 0 demands nothing.

    Args:
        numerators, denominators: values at s = 0 and slopes, shape (m, k, 2): of k functions in each of m cases.

    Returns:
        of each case, shape (m,).
    """
    n, d = numerators, denominators
    i, j = np.triu_indices(n.shape[1], 1)
    (ni, nj), (di, dj) = (
        (np.moveaxis(n, 2, 0)[:, :, k] for k in (i, j)),
        (np.moveaxis(d, 2, 0)[:, :, k] for k in (i, j)),
    )
    constant = ni[0] * dj[0] - nj[0] * di[0]
    linear = ni[0] * dj[1] + ni[1] * dj[0] - nj[0] * di[1] - nj[1] * di[0]
    square = ni[1] * dj[1] - nj[1] * di[1]
    root = np.sqrt(np.maximum(linear**2 - 4 * square * constant, 0.0))
    q = -0.5 * (linear + np.where(linear < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.concatenate([np.zeros((len(n), 1)), q / square, constant / q], axis=1)
    s[~np.isfinite(s)] = 0.0
    # In homogeneous coordinates (1, s), unit length; infinity is (0, ±1).
    at = np.stack([np.ones_like(s), s], axis=1) / np.hypot(1.0, s)[:, None]
    at = np.concatenate([at, np.broadcast_to([[0.0, 0.0], [1.0, -1.0]], (len(n), 2, 2))], axis=2)
    N, D = n @ at, d @ at
    tiny = CLOSED * np.maximum(np.abs(n).max(axis=(1, 2)), np.abs(d).max(axis=(1, 2)))[:, None, None]
    none = tiny >= D
    ratio = np.where(none, np.where(np.abs(N) <= tiny, np.inf, -np.inf), N / np.where(none, 1.0, D))
    ratio = np.where(-tiny > D, -np.inf, ratio)
    greatest: Array = ratio.min(axis=1).max(axis=1)
    return greatest


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
