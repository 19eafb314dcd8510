"""The limit surface of a support under Coulomb friction, neither fitted nor sampled."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import finite, vector
from ..errors import InputError
from ..geometry.pose import Array
from .least import least_dissipation
from .pressure import ON_FOOT, Feet, Pressure
from .root_step import root_step
from .support import ON_LINE, Support
from .surface import LimitSurface, WrenchSet

# A force that misses a facet by less than this part of the load lies on it: a twist beside the rim would
# turn about a point so near the foot that its own rounding decides the direction of the foot's force.
TIE = 1e-10
_MAX_STEPS = 200


@dataclass(frozen=True, eq=False)
class Exact(LimitSurface):
    """The support's own limit surface: the body of wrenches whose support function is h(V) = ∫ |v| dN.

    H is its gauge, of degree 1, with friction = load = 1. Feet make facets (a rotation about a foot has many
    wrenches); collinear feet also make vertices (a wrench that has many twists). Wrenches and twists are
    about the origin of the support's coordinates; centre the support to have them about the centre of
    friction.

    >>> Exact(Support.disc(1.0)).twist([0, 2, 0]).tolist()
    [0.0, 1.0, 0.0]
    """

    support: Support
    degree = 1

    @property
    def has_facets(self) -> bool:
        """Whether it stands on feet."""
        return isinstance(self.support.pressure, Feet)

    def value(self, wrench: ArrayLike) -> Array:
        """H(F) = max F·V / h(V), shape (...); exact to second order in the error of the twist."""
        F = _vectors(wrench, "a wrench")
        if not np.any(F):
            return np.zeros(F.shape[:-1])
        zero = ~np.any(F != 0, axis=-1)
        V = self.twist(np.where(zero[..., None], np.array([1.0, 0.0, 0.0]), F))
        return np.sum(F * V, axis=-1) / self.support.dissipation(V)

    def twist(self, wrench: ArrayLike) -> Array:
        """The twist of least dissipation with F·V given, shape (..., 3).

        Scaled to |(v, ℓ ω)| = 1, ℓ the gyration radius. Of a vertex (collinear feet): the rotation about the
        middle of the gap between two feet, or the translation.

        Raises:
            InputError: for a zero wrench.
        """
        F = _vectors(wrench, "a wrench")
        c, ell = self.support.centre, self._length
        flat = F.reshape(-1, 3).copy()
        if not np.all(np.any(flat != 0, axis=1)):
            raise InputError("a zero wrench has no twist of its own", value=wrench)
        flat[:, 2] = (flat[:, 2] - c[0] * flat[:, 1] + c[1] * flat[:, 0]) / ell
        return self._about_origin(self._twists(flat)).reshape(F.shape)

    def is_vertex(self, wrench: ArrayLike) -> bool:
        """Whether a wrench (3,) has many twists, as collinear feet have for a push square to their line."""
        F, c = np.array(_vectors(wrench, "a wrench")), self.support.centre
        F[2] = (F[2] - c[0] * F[1] + c[1] * F[0]) / self._length
        return bool(np.any(F)) and self._vertex(F / np.sqrt(F @ F)) is not None

    def wrench(self, twist: ArrayLike) -> Array:
        """The Coulomb wrench at friction = load = 1, shape (..., 3); see Support.wrench."""
        return self.support.wrench(twist)

    def wrench_set(self, twist: ArrayLike) -> WrenchSet:
        """All wrenches of one twist (3,): a facet where it turns about a foot, within 1e-9 of the radius."""
        V = _vectors(twist, "a twist")
        points, weights = self.support.feet
        if V[2] != 0 and len(points):
            gaps = np.hypot(V[0] - V[2] * points[:, 1], V[1] + V[2] * points[:, 0])
            k = int(np.argmin(gaps))
            if gaps[k] <= ON_FOOT * self.support.radius * abs(V[2]):
                return WrenchSet(self.wrench(V), points[k], float(weights[k]))
        return WrenchSet(self.wrench(V), np.zeros(2), 0.0)

    def stick(self, point: ArrayLike, velocity: ArrayLike) -> Array:
        """The twist V of the body whose point p (2,) is held to the velocity u (2,) by a force through p.

        With k the rotation about p, V = V₀ + ω k, where h is least along that line: k·∇h = 0.
        """
        rule = "a point and its velocity are two finite numbers each"
        p, u = vector(point, 2, rule), vector(velocity, 2, rule)
        speed = float(np.hypot(u[0], u[1]))
        if speed == 0:
            return np.zeros(3)
        q = (p - self.support.centre) / self._length
        return self._about_origin(speed * self._stick(q, u / speed))

    @cached_property
    def _length(self) -> float:
        """The gyration radius of the pressure, the unit of length inside."""
        return float(np.sqrt(np.trace(self.support.covariance)))

    @cached_property
    def _unit(self) -> Pressure:
        pressure = self.support.pressure.scaled(1 / self._length)
        # A solution may lie within the distance at which a foot counts as resting.
        return replace(pressure, near=1e-15) if isinstance(pressure, Feet) else pressure

    @cached_property
    def _facets(self) -> tuple[Array, Array, Array, Array, Array]:
        """Of the feet, in units: points, weights, turns about them, the others' wrenches, dissipations."""
        assert isinstance(self._unit, Feet)
        points, weights = self._unit.points, self._unit.weights
        turns = np.stack([points[:, 1], -points[:, 0], np.ones(len(points))], axis=1)
        h, W, _ = self._unit.resist(turns)
        return points, weights, turns, W, h

    @cached_property
    def _vertices(self) -> tuple[Array, Array]:
        """Of collinear feet, in units: vertices (n, 3) and their middle twists; their opposites are more."""
        if not self.support.collinear:
            return np.empty((0, 3)), np.empty((0, 3))
        points, weights, _, _, _ = self._facets
        e = points[int(np.argmax(np.hypot(*points.T)))]
        e = e / np.hypot(*e)
        n = np.array([-e[1], e[0]])
        order = np.argsort(points @ e)
        x, w = (points @ e)[order], weights[order]
        wrenches, twists = [[n[0], n[1], 0.0]], [[n[0], n[1], 0.0]]
        for j in range(1, len(x)):
            side = np.where(np.arange(len(x)) < j, -w, w)  # rotation between the feet j - 1 and j
            middle = (x[j - 1] + x[j]) / 2 * e
            wrenches.append([*(n * side.sum()), float(x @ side)])
            twists.append([middle[1], -middle[0], 1.0])
        return np.array(wrenches), np.array(twists)

    def _about_origin(self, V: Array) -> Array:
        """Twists (..., 3) in units about the centre, to SI about the origin."""
        out, c = np.array(V), self.support.centre
        out[..., 2] /= self._length
        out[..., 0] += c[1] * out[..., 2]
        out[..., 1] -= c[0] * out[..., 2]
        return out

    def _vertex(self, F: Array) -> Array | None:
        """The middle twist of the vertex that a unit wrench points at, in units; None elsewhere."""
        if isinstance(self._unit, Feet):
            for W, V in zip(*self._vertices, strict=True):
                away = np.cross(F, W / np.sqrt(W @ W))
                if away @ away <= ON_LINE**2:
                    return np.asarray(V * (np.sign(F @ W) / np.sqrt(V @ V)))
        return None

    def _twists(self, wrenches: Array) -> Array:
        """The unit twists of wrenches, both (n, 3) in units."""
        wrenches = wrenches / np.sqrt(np.sum(wrenches * wrenches, axis=1))[:, None]
        found = (
            [self._at_feet(F) for F in wrenches] if isinstance(self._unit, Feet) else [None] * len(wrenches)
        )
        twists = np.array([np.zeros(3) if V is None else V for V in found])
        free = np.array([V is None for V in found])
        if free.any():
            twists[free] = least_dissipation(self._unit, wrenches[free])
        return twists / np.sqrt(np.sum(twists * twists, axis=1))[:, None]

    def _at_feet(self, F: Array) -> Array | None:
        """The twist of a unit wrench that points at a vertex, or of the facet that it lies on; None elsewhere."""
        vertex = self._vertex(F)
        if vertex is not None:
            return vertex
        _, weights, turns, wrenches, h = self._facets
        power = turns @ F
        with np.errstate(divide="ignore", invalid="ignore"):
            g = (h / power)[:, None] * F[:2] - wrenches[:, :2]
            on = np.flatnonzero((power != 0) & (np.hypot(g[:, 0], g[:, 1]) <= weights + TIE))
        return turns[on[0]] * np.sign(power[on[0]]) if len(on) else None

    def _stick(self, p: Array, u: Array) -> Array:
        k = np.array([p[1], -p[0], 1.0])
        if isinstance(self._unit, Feet):
            resting = self._rests(p, u, k)
            if resting is not None:
                return resting
        V0 = np.array([u[0], u[1], 0.0])
        arm = float(np.sqrt(k @ k))
        # From the ellipsoid diag(1, 1, 1): a push straight at the centre starts, and stays, at ω = 0.
        w = float(p[0] * u[1] - p[1] * u[0]) / arm**2
        low, high, before = -np.inf, np.inf, np.inf
        for _ in range(_MAX_STEPS):
            _, W, K = self._unit.resist((V0 + w * k)[None])
            slope, bend = float(k @ W[0]), float(k @ K[0] @ k)
            if abs(slope) <= 4e-16 * arm:
                break
            low, high = (w, high) if slope < 0 else (low, w)
            step, done = root_step(w, slope, bend, low, high, before, arm)
            w += step
            if done:
                break
            before = abs(slope)
        return V0 + w * k

    def _rests(self, p: Array, u: Array, k: Array) -> Array | None:
        """The rotation about a foot, if that foot can supply what is missing to a force through p."""
        points, weights, turns, wrenches, _ = self._facets
        arms = p - points
        lengths = np.hypot(arms[:, 0], arms[:, 1])
        near = np.flatnonzero((np.abs(arms @ u) <= ON_FOOT * self._unit.radius) & (lengths > ON_LINE))
        for j in near:
            w = float(arms[j, 0] * u[1] - arms[j, 1] * u[0]) / lengths[j] ** 2
            if abs(k @ wrenches[j]) <= weights[j] * lengths[j] + TIE:
                return w * turns[j]
        return None


def _vectors(values: ArrayLike, what: str) -> Array:
    vectors = finite(values, f"{what} is three finite numbers")
    if vectors.shape[-1:] != (3,):
        raise InputError(f"{what} is three finite numbers", value=values)
    return vectors
