"""The composite wrench cone of fingertips that push together, as its rays and its faces ([Zhou2017] Sec. 4.2)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..friction.ellipsoid import Ellipsoid
from ..friction.exact import Exact
from ..friction.surface import LimitSurface, WrenchSet
from ..geometry.pose import Array
from .point_contact import PointContact

# Relative slack of the closed cone, above rounding and below any physical meaning.
CLOSED = 1e-9
# Twice the area, over the extent squared, of a triangle whose middle corner rounding alone has put off an edge.
_ON_EDGE = 1e-13


@dataclass(frozen=True, eq=False)
class WrenchCone:
    """All wrenches that contacts can exert together, K = cone(w_1, ..., w_n), about the centre of friction.

    Torques are divided by `lever`, so that the three components of a wrench compare.

    Attributes:
        rays: unit wrenches of the edges of the friction cones, two for each contact (left, right), shape (n, 3).
        faces: inward unit normals; a wrench F lies in K when faces @ F ≥ 0, shape (m, 3).
        lever: unit of length for torques: the distance of the farthest contact from the centre of friction [m].

    >>> contacts = [PointContact([x, -0.02], [0, 1], 0.3) for x in (-0.009, 0.009)]
    >>> cone = WrenchCone.of(contacts)
    >>> bool(cone.depth([0.0, 1.0, 0.0]) > 0), bool(cone.depth([1.0, 1.0, 0.0]) < 0)
    (True, True)
    """

    rays: Array
    faces: Array
    lever: float

    @classmethod
    def of(cls, contacts: Sequence[PointContact]) -> "WrenchCone":
        """The cone of contacts in one frame, whose origin is the centre of friction."""
        return cls.spanned(edge_wrenches(contacts), lever_of(contacts))

    @classmethod
    def spanned(cls, wrenches: ArrayLike, lever: float) -> "WrenchCone":
        """The cone of given wrenches, shape (n, 3), with the unit of length `lever` [m] for torques."""
        rays = np.asarray(wrenches, dtype=float) / [1.0, 1.0, lever]
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        return cls(rays, _faces(rays), lever)

    @property
    def wrenches(self) -> Array:
        """The rays as wrenches in SI, shape (n, 3), up to size."""
        return self.rays * [1.0, 1.0, self.lever]

    def depth(self, wrench: ArrayLike) -> Array:
        """How far wrenches (..., 3), taken as unit vectors, are inside: the distance to the nearest face.

        Positive inside, 0 on the boundary, and outside minus the distance to the face most missed. In the units of
        the cone's lever it is the sine of an angle.
        """
        F = np.asarray(wrench, dtype=float) / [1.0, 1.0, self.lever]
        size = np.linalg.norm(F, axis=-1)
        if len(self.faces) == 0:
            return np.ones(F.shape[:-1])
        return np.min(F @ self.faces.T, axis=-1) / np.where(size > 0, size, 1.0)

    def depths(self, wrenches: WrenchSet) -> tuple[float, float]:
        """The least and the greatest depth among all the wrenches of one twist, as shares of the middle one's size.

        The greatest is at least 0 when the twist sticks ("some wrench lies in the cone"); the least is, when it does so
        whatever the support point under the rotation centre does.
        """
        middle = float(self.depth(wrenches.centre))
        if wrenches.radius == 0 or len(self.faces) == 0:
            return middle, middle
        # On a face n the wrench centre + J_pᵀ g has the height n·centre + a·g, with |g| ≤ radius.
        F = wrenches.centre / [1.0, 1.0, self.lever]
        x, y = wrenches.point / self.lever
        n, r = self.faces, wrenches.radius
        a = n[:, :2] + n[:, 2:] * np.array([-y, x])
        b = n @ F
        least = float(np.min(b - r * np.linalg.norm(a, axis=1)))
        tries = np.array(_candidates(a, b, r))
        greatest = float(np.max(np.min(b + tries @ a.T, axis=1)))
        size = float(np.linalg.norm(F))
        return least / size, greatest / size

    def order(self) -> Array:
        """Numbers, shape (k,), of the rays that are edges of the cone, counter-clockwise about its axis.

        Raises:
            InputError: if the cone holds a wrench and its opposite (fingers that squeeze), or lies in a plane.
        """
        return self._order

    @cached_property
    def _order(self) -> Array:
        axis = self.axis
        least = int(np.argmin(np.abs(axis)))
        x = np.eye(3)[least] - axis[least] * axis
        y = [
            axis[1] * x[2] - axis[2] * x[1],
            axis[2] * x[0] - axis[0] * x[2],
            axis[0] * x[1] - axis[1] * x[0],
        ]
        flat = self.rays @ np.stack([y, -x], axis=1) / (self.rays @ axis)[:, None]
        edges = _hull(flat.tolist())
        if len(edges) < 3:
            raise InputError(
                "the forces of the fingers lie in one plane: without friction, or at one place, two fingers have no"
                " region of motions"
            )
        return np.array(edges)

    @property
    def axis(self) -> Array:
        """A unit wrench well inside, shape (3,), in the cone's units.

        Raises:
            InputError: if the cone holds a wrench and its opposite.
        """
        axis = np.sum(self.rays, axis=0)
        size = float(np.linalg.norm(axis))
        if size < 1e-9 or np.min(self.rays @ axis) <= 1e-9:
            raise InputError(
                "the two fingers can squeeze the object between them, so that no push is determined there"
            )
        return axis / size


def _hull(points: list[list[float]]) -> list[int]:
    """Numbers of the corners of the convex hull of points, counter-clockwise; of points on a line its two ends.

    By monotone chains. For the few rays of a cone scipy's would take half a second to be imported.
    """
    sizes = [max(values) - min(values) for values in zip(*points, strict=True)]
    flat = _ON_EDGE * max(sizes) ** 2
    order = sorted(range(len(points)), key=points.__getitem__)
    chains: list[list[int]] = []
    for way in (order, order[::-1]):
        chain: list[int] = []
        for i in way:
            while len(chain) > 1:
                (x0, y0), (x1, y1), (x2, y2) = points[chain[-2]], points[chain[-1]], points[i]
                if (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1) > flat:
                    break
                chain.pop()
            chain.append(i)
        chains.append(chain[:-1])
    return chains[0] + chains[1]


def edge_wrenches(contacts: Sequence[PointContact], margin: float = 0.0) -> Array:
    """Wrenches of unit forces on the edges of contacts' friction cones, two for each (left, right), shape (n, 3).

    The cones are those of (1 - margin) μ. Row by row c.wrench(f) for c in contacts for f in c.force_edges().
    """
    found = []
    for contact in contacts:
        nx, ny = contact.normal.tolist()
        mu = (1 - margin) * contact.friction
        cosine = 1 / math.hypot(1.0, mu)
        for side in (mu, -mu):
            found.append(_wrench(contact, cosine * (nx - side * ny), cosine * (ny + side * nx)))
    return np.array(found)


def axis_wrenches(contacts: Sequence[PointContact]) -> Array:
    """Wrenches of unit forces along the inward normal and to its left, two for each of the contacts, shape (n, 3)."""
    axes = [(contact, *contact.normal.tolist()) for contact in contacts]
    return np.array([_wrench(c, *force) for c, nx, ny in axes for force in ((nx, ny), (-ny, nx))])


def _wrench(contact: PointContact, fx: float, fy: float) -> list[float]:
    x, y = contact.point.tolist()
    return [fx, fy, x * fy - y * fx]


def narrowed(contacts: Sequence[PointContact], margin: float) -> WrenchCone:
    """The composite cone of two contacts less a friction margin, a share in [0, 1).

    It is that of contacts with (1 - margin) μ, each finger's force shared with the other, 1 - margin/2 to margin/2: the
    lighter finger keeps margin/2 of the load at least. Under parallel normals that is the cone of two contacts that
    stand at (1 - margin) × spacing.

    Raises:
        InputError: for a margin outside of [0, 1).
    """
    if not 0 <= margin < 1:
        raise InputError("the friction margin is at least 0 and less than 1", value=margin)
    return _shared(contacts, edge_wrenches(contacts, margin), 0.5 * margin)


def shared(contacts: Sequence[PointContact], share: float) -> WrenchCone:
    """The composite cone of two contacts of which each bears at least a share (0 to 1/2) of the push."""
    return _shared(contacts, edge_wrenches(contacts), share)


def _shared(contacts: Sequence[PointContact], edges: Array, share: float) -> WrenchCone:
    first, second = edges[:2], edges[2:]
    wrenches = np.concatenate([(1 - share) * first + share * second, share * first + (1 - share) * second])
    return WrenchCone.spanned(wrenches, lever_of(contacts))


def straight_wrenches(cone: WrenchCone, surface: LimitSurface) -> tuple[Array, Array] | None:
    """The two wrenches on the cone's boundary that push straight (ω = 0); None if every force turns the same way."""
    rays = cone.wrenches[cone.order()]
    turns = turn_of(surface, rays)
    found = []
    for i in range(len(rays)):
        j = (i + 1) % len(rays)
        if (turns[i] > 0) != (turns[j] > 0):
            found.append(_straight_between(surface, rays[i], rays[j]))
    return (found[0], found[1]) if len(found) == 2 else None


def turn_of(surface: LimitSurface, wrenches: Array) -> Array:
    """A number with the sign of ω for wrenches (..., 3); for Coulomb friction and ellipsoids linear in them."""
    if isinstance(surface, Exact):
        c = surface.support.centre
        return np.asarray(wrenches[..., 2] - c[0] * wrenches[..., 1] + c[1] * wrenches[..., 0])
    if isinstance(surface, Ellipsoid):
        return np.asarray(wrenches @ surface.matrix[2])
    return np.asarray(surface.twist(wrenches)[..., 2])


def _straight_between(surface: LimitSurface, F: Array, G: Array) -> Array:
    """The wrench with ω = 0 between two that turn opposite ways: linear, or by bisection."""
    f, g = turn_of(surface, np.stack([F, G]))
    if isinstance(surface, Exact | Ellipsoid):
        return np.asarray((f * G - g * F) / (f - g))
    low, high = (F, G) if f < 0 else (G, F)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if turn_of(surface, middle) < 0 else (low, middle)
    return 0.5 * (low + high)


def lever_of(contacts: Sequence[PointContact]) -> float:
    """The unit of length for torques: the distance of the farthest contact from the centre of friction [m]."""
    return max(*(math.hypot(*c.point.tolist()) for c in contacts), 1e-300)


def _faces(rays: Array) -> Array:
    """Normals of the planes through two rays that have all others on one side; of a flat cone also its own edges."""
    few = rays.tolist()
    found = _supporting([_cross(*pair) for pair in combinations(few, 2)], few)
    if found and all(abs(_dot(ray, found[0])) <= 1e-12 for ray in few):  # all rays in one plane
        found += _supporting([_cross(found[0], ray) for ray in few], few)
    return np.array(found).reshape(-1, 3)


def _supporting(normals: list[list[float]], rays: list[list[float]]) -> list[list[float]]:
    """Those of ± the normals, as unit vectors, that no ray is behind."""
    found = []
    for normal in normals:
        size = math.sqrt(_dot(normal, normal))
        if size > 1e-12:
            unit = [x / size for x in normal]
            depths = [_dot(unit, ray) for ray in rays]
            found += [unit] if min(depths) >= -1e-12 else []
            found += [[-x for x in unit]] if max(depths) <= 1e-12 else []
    return found


def _dot(a: list[float], b: list[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _candidates(a: Array, b: Array, radius: float) -> list[Array]:
    """Where min(b + a·g) over |g| ≤ radius can be greatest: on the rim, or where two or three of the planes meet."""
    found = [np.zeros(2)]
    for row in a:
        size = float(np.hypot(*row))
        if size > 0:
            found.append(radius * row / size)
    for i, j in combinations(range(len(a)), 2):
        d = a[i] - a[j]
        size = float(np.hypot(*d))
        if size <= 1e-15:
            continue
        foot = d * (b[j] - b[i]) / size**2
        rest = radius**2 - float(foot @ foot)
        if rest >= 0:
            along = np.sqrt(rest) * np.array([-d[1], d[0]]) / size
            found += [foot + along, foot - along]
    for i, j, k in combinations(range(len(a)), 3):
        M = np.array([a[i] - a[j], a[i] - a[k]])
        if abs(np.linalg.det(M)) > 1e-15:
            g = np.linalg.solve(M, np.array([b[j] - b[i], b[k] - b[i]]))
            if np.hypot(*g) <= radius:
                found.append(g)
    return found
