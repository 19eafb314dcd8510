"""How a load of 1 is spread over the table, about its own centre, and what it resists to a motion.

With c the rotation centre and r = p - c, all a motion needs are three integrals over the pressure dN:
U(c) = ∫ |r| dN, G(c) = ∫ r/|r| dN and M(c) = ∫ r rᵀ/|r|³ dN. Force, torque, dissipation and its curvature
follow from them; each shape of pressure knows them in closed form.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..geometry.pose import Array

# A rotation centre within this part of the radius from a foot counts as lying on it: the foot rests.
ON_FOOT = 1e-9
# Beyond this many radii the integrand is smooth: the cubature (degree 9) is exact to 1e-13 there, whereas the
# torque U + c·G of the closed forms loses digits to cancellation.
POINT_LIKE = 16.0
_DEGREE = 9
_TINY = 1e-30


class Pressure(ABC):
    """A pressure of load 1 whose centre is the origin.

    Attributes:
        radius: largest distance of a pressed point from the origin [m].
    """

    radius: float

    @property
    @abstractmethod
    def nodes(self) -> tuple[Array, Array]:
        """Points (n, 2) and weights (n,) that integrate polynomials up to degree 9 over the pressure."""

    @abstractmethod
    def integrals(self, centre: Array) -> tuple[Array, Array, Array]:
        """U (m,), G (m, 2) and M (m, 2, 2) of the rotation centres (m, 2), which are not far away."""

    @cached_property
    def covariance(self) -> Array:
        points, weights = self.nodes
        return (points * weights[:, None]).T @ points

    @abstractmethod
    def scaled(self, factor: float) -> "Pressure":
        """The same pressure in another unit of length."""

    def resist(self, twist: Array) -> tuple[Array, Array, Array]:
        """h (m,), ∇h (m, 3) and ∇²h (m, 3, 3) of the twists (m, 3), none of them zero: h(V) = ∫ |v| dN."""
        V = twist
        far = V[:, 0] ** 2 + V[:, 1] ** 2 >= (POINT_LIKE * self.radius * V[:, 2]) ** 2
        if far.all():
            return _by_nodes(*self.nodes, 0.0, V)
        if not far.any():
            return self._by_integrals(V)
        h, W, K = np.empty(len(V)), np.empty((len(V), 3)), np.empty((len(V), 3, 3))
        h[far], W[far], K[far] = _by_nodes(*self.nodes, 0.0, V[far])
        h[~far], W[~far], K[~far] = self._by_integrals(V[~far])
        return h, W, K

    def wrench(self, twist: Array) -> Array:
        """∇h of the twists (m, 3), shape (m, 3), as resist has it."""
        V = twist
        far = V[:, 0] ** 2 + V[:, 1] ** 2 >= (POINT_LIKE * self.radius * V[:, 2]) ** 2
        W = np.empty((len(V), 3))
        if far.any():
            W[far] = _forces_at_nodes(*self.nodes, 0.0, V[far])[1]
        if not far.all():
            W[~far] = self._by_integrals(V[~far])[1]
        return W

    def _by_integrals(self, V: Array) -> tuple[Array, Array, Array]:
        w = V[:, 2:]
        lever = -V[:, :2] / w  # the rotation centre c turned by +90°: (-cy, cx)
        c = np.stack([lever[:, 1], -lever[:, 0]], axis=1)
        U, G, M = self.integrals(c)
        size = np.abs(w)
        # v̂ = ± r̂ turned by +90°, and p = c + r, so the torque is ± ∫ p·r̂ dN.
        W = np.stack([-G[:, 1], G[:, 0], U + np.einsum("mi,mi->m", c, G)], axis=1) * (w / size)
        # I - v̂v̂ᵀ = r̂r̂ᵀ and p × r̂ = c × r̂: ∇²h = [1, lever]ᵀ M [1, lever] / |ω|.
        K = np.empty((len(V), 3, 3))
        K[:, :2, :2] = M
        K[:, :2, 2] = K[:, 2, :2] = side = np.einsum("mij,mj->mi", M, lever)
        K[:, 2, 2] = np.einsum("mi,mi->m", side, lever)
        return size[:, 0] * U, W, K / size[:, :, None]


@dataclass(frozen=True, eq=False)
class Feet(Pressure):
    """Point loads."""

    points: Array  # (n, 2)
    weights: Array  # (n,)
    near: float = ON_FOOT  # feet within this part of the radius from the rotation centre rest

    @cached_property
    def radius(self) -> float:  # type: ignore[override]
        return float(np.max(np.hypot(self.points[:, 0], self.points[:, 1])))

    @property
    def nodes(self) -> tuple[Array, Array]:
        return self.points, self.weights

    def scaled(self, factor: float) -> "Feet":
        return Feet(factor * self.points, self.weights, self.near)

    def integrals(self, centre: Array) -> tuple[Array, Array, Array]:
        raise NotImplementedError  # point loads need none: resist sums over them

    def resist(self, twist: Array) -> tuple[Array, Array, Array]:
        return _by_nodes(self.points, self.weights, self.near * self.radius, twist)

    def wrench(self, twist: Array) -> Array:
        return _forces_at_nodes(self.points, self.weights, self.near * self.radius, twist)[1]


@dataclass(frozen=True, eq=False)
class Edges(Pressure):
    """Uniform pressure along the edges of a polygon (filled: over its inside), corners in either sense.

    Derivation: r = d n + t e with e along the edge, n normal to it, d the signed distance of c from it. Along
    the edge ∫ dt/|r| = L = [asinh(t/|d|)], ∫ r̂ dt = d L n + [|r|] e, ∫ |r| dt = ½[t |r| + d² L] and ∫
    r̂r̂ᵀ/|r| dt = [t/|r|] nnᵀ - [d/|r|] (neᵀ + enᵀ) + (L - [t/|r|]) eeᵀ. The signed triangle from c over
    the edge has dA = ρ dρ · d dt/|r|², so that its integrals are those of the edge times d/2, d/3 and d.
    """

    vertices: Array  # (n, 2)
    filled: bool

    @cached_property
    def radius(self) -> float:  # type: ignore[override]
        return float(np.max(np.hypot(self.vertices[:, 0], self.vertices[:, 1])))

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Of the edges, as seen from the origin, and the sums over them.

        t of their starts and ends (2, n); d (n,); the matrix (2, 2n) from a rotation centre to the changes of
        these; those that sum Gn, Ge to G (2n, 2), nn, ne, ee to M (3n, 4) and U (n,).
        """
        step = np.roll(self.vertices, -1, axis=0) - self.vertices
        length = np.hypot(step[:, 0], step[:, 1])
        e = step / length[:, None]
        n = np.stack([e[:, 1], -e[:, 0]], axis=1)
        t, d = np.sum(self.vertices * e, axis=1), np.sum(self.vertices * n, axis=1)
        mixed = n[:, :, None] * e[:, None, :]
        products = [
            n[:, :, None] * n[:, None, :],
            mixed + np.swapaxes(mixed, 1, 2),
            e[:, :, None] * e[:, None, :],
        ]
        size = float(np.sum(d * length) / 2 if self.filled else np.sum(length))
        to_G, to_M = np.concatenate([n, e]) / size, np.concatenate(products).reshape(-1, 4) / size
        return (
            np.stack([t, t + length]),
            d,
            np.concatenate([e, n]).T.copy(),
            to_G,
            to_M,
            np.full(len(d), 0.5 / size),
        )

    @cached_property
    def nodes(self) -> tuple[Array, Array]:
        points, weights = edge_nodes(self.vertices, self.filled)
        return _compressed(points, weights / np.sum(weights), self.radius)

    def scaled(self, factor: float) -> "Edges":
        return Edges(factor * self.vertices, self.filled)

    def integrals(self, centre: Array) -> tuple[Array, Array, Array]:
        t0, d0, axes, to_G, to_M, to_U = self._edges
        seen = centre @ axes  # (m, 2n)
        count = len(d0)
        t = t0 - seen[:, None, :count]  # (m, 2, n): starts and ends
        d = d0 - seen[:, count:]
        gap = np.maximum(np.abs(d), _TINY * self.radius)[:, None]
        r = np.hypot(t, gap)
        L, Ge, nn, ne = (x[:, 1] - x[:, 0] for x in (np.arcsinh(t / gap), r, t / r, -d[:, None] / r))
        Gn = d * L
        U = t[:, 1] * r[:, 1] - t[:, 0] * r[:, 0] + d * Gn
        G, M = np.concatenate([Gn, Ge], axis=1), np.concatenate([nn, ne, L - nn], axis=1)
        if self.filled:
            U, half = U * d / 3, 0.5 * d
            G *= np.concatenate([half, half], axis=1)
            M *= np.concatenate([d, d, d], axis=1)
        return U @ to_U, G @ to_G, (M @ to_M).reshape(-1, 2, 2)


@dataclass(frozen=True, eq=False)
class Round(Pressure):
    """Uniform pressure along a circle (filled: over its disc).

    U depends on |c| alone. With a the radius, s = max(a, |c|), k = min/max of the two, m = k² and the
    complete elliptic integrals B = (E - (1 - m) K)/m and D = (K - E)/m (both positive, without cancellation),
    the circle has U = (2s/π)((1 + m) B + (1 - m) D); its first two derivatives, and the disc's by U' = -∮ |r|
    cos φ dφ/(π a) and Euler's relation, are sums of the same two.
    """

    radius: float
    filled: bool

    @cached_property
    def nodes(self) -> tuple[Array, Array]:
        angles = np.arange(_DEGREE + 3) * (2 * np.pi / (_DEGREE + 3))
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        x, w = np.polynomial.legendre.leggauss(3) if self.filled else (np.ones(1), np.full(1, 2.0))
        radii, shares = self.radius * np.sqrt((1 + x) / 2), w / 2
        points = (radii[:, None, None] * ring).reshape(-1, 2)
        return points, np.repeat(shares / len(ring), len(ring))

    def scaled(self, factor: float) -> "Round":
        return Round(factor * self.radius, self.filled)

    def integrals(self, centre: Array) -> tuple[Array, Array, Array]:
        a, c = self.radius, np.hypot(centre[:, 0], centre[:, 1])
        s = np.maximum(a, c)
        inside = c <= a
        k = np.minimum(a, c) / s
        m, k1 = k * k, np.abs(a - c) * (a + c) / (s * s)  # k1 = 1 - m
        B, D = _elliptic(m, k1)
        if self.filled:
            f = 4 / (3 * np.pi)
            U = f * s / 3 * np.where(inside, (3 + 5 * m) * B + (3 + m) * k1 * D, (5 + 3 * m) * B + 4 * k1 * D)
            over = f / s * (2 * B + k1 * D)  # U'/c
            second = f / s * np.where(inside, B + 2 * k1 * D, B - k1 * D)  # U''
        else:
            f = 2 / np.pi
            U = f * s * ((1 + m) * B + k1 * D)
            over = f / s * np.where(inside, B, B + k1 * D)
            second = f / s * np.where(inside, D, m * D)
        G = -over[:, None] * centre
        # ∇²U = ∫ (I - r̂r̂ᵀ)/r, so M = tr(∇²U) I - ∇²U.
        x, y = (centre / np.where(c > 0, c, 1.0)[:, None]).T
        M = np.empty((len(centre), 2, 2))
        M[:, 0, 0] = over * x * x + second * (1 - x * x)
        M[:, 1, 1] = over * y * y + second * (1 - y * y)
        M[:, 0, 1] = M[:, 1, 0] = (over - second) * x * y
        return U, G, M


def edge_nodes(vertices: Array, filled: bool) -> tuple[Array, Array]:
    """Gauss points and weights, exact to degree 9, of a polygon's edges or inside (sum: length or area)."""
    x, w = np.polynomial.legendre.leggauss(_DEGREE // 2 + 1)
    x, w = (1 + x) / 2, w / 2
    p, q = vertices, np.roll(vertices, -1, axis=0)
    along = p[:, None] + x[:, None] * (q - p)[:, None]  # (n, 5, 2)
    if not filled:
        length = np.hypot(*(q - p).T)
        return along.reshape(-1, 2), (length[:, None] * w).ravel()
    # Signed triangles from the first corner, shrunk towards it by ρ: dA = |2 area| ρ dρ dx.
    o = vertices[0]
    rho, v = np.polynomial.legendre.leggauss(_DEGREE // 2 + 2)
    rho, v = (1 + rho) / 2, v / 2
    double = (p - o)[:, 0] * (q - o)[:, 1] - (p - o)[:, 1] * (q - o)[:, 0]
    points = o + rho[:, None, None, None] * (along - o)
    weights = (v * rho)[:, None, None] * double[:, None] * w
    return points.reshape(-1, 2), weights.ravel()


def _compressed(points: Array, weights: Array, radius: float) -> tuple[Array, Array]:
    """A rule of 100 points with the same moments up to degree 9, if there are more points than that."""
    if len(points) <= (_DEGREE + 1) ** 2:
        return points, weights
    legendre = np.polynomial.legendre
    x, w = legendre.leggauss(_DEGREE + 1)
    Px, Py = (legendre.legvander(points[:, i] / radius, _DEGREE) for i in (0, 1))
    order = np.arange(_DEGREE + 1)
    moments = (Px * weights[:, None]).T @ Py * np.outer(2 * order + 1, 2 * order + 1) / 4
    moments[order[:, None] + order > _DEGREE] = 0.0
    P = legendre.legvander(x, _DEGREE)
    shares = P @ moments @ P.T * np.outer(w, w)
    X, Y = np.meshgrid(radius * x, radius * x, indexing="ij")
    return np.stack([X.ravel(), Y.ravel()], axis=1), shares.ravel()


def _by_nodes(points: Array, weights: Array, near: float, V: Array) -> tuple[Array, Array, Array]:
    """Sums over point loads. Those within the distance `near` of the rotation centre rest and add nothing."""
    h, W, along, inverse = _forces_at_nodes(points, weights, near, V)
    # n × the Jacobian with n normal to the velocity: (-uy, ux, p·u).
    across = np.empty_like(along)
    across[:, 0], across[:, 1] = -along[:, 1], along[:, 0]
    across[:, 2] = points[:, 0] * along[:, 0] + points[:, 1] * along[:, 1]
    return h, W, (across * (weights * inverse)[:, None, :]) @ np.swapaxes(across, 1, 2)


def _forces_at_nodes(
    points: Array, weights: Array, near: float, V: Array
) -> tuple[Array, Array, Array, Array]:
    """h, ∇h, the directions of the forces of n points with their moments (m, 3, n), and one over the speeds (m, n)."""
    x, y = points.T
    w = V[:, 2:]
    vx, vy = V[:, :1] - w * y, V[:, 1:2] + w * x
    speed = np.hypot(vx, vy)
    if near > 0:
        rests = speed <= near * np.abs(w)
        inverse = np.where(rests, 0.0, 1.0 / np.where(rests, 1.0, speed)) if rests.any() else 1.0 / speed
    else:
        inverse = 1.0 / speed
    ux, uy = vx * inverse, vy * inverse
    along = np.stack([ux, uy, x * uy - y * ux], axis=1)
    return speed @ weights, along @ weights, along, inverse


def _elliptic(m: Array, k1: Array) -> tuple[Array, Array]:
    """B and D of the parameter m, k1 = 1 - m, by the arithmetic-geometric mean."""
    if m.size == 1:
        B, D = _mean(float(m[0]), max(float(k1[0]), 1e-40))
        return np.array([B]), np.array([D])
    return _mean(m, np.maximum(k1, 1e-40))


def _mean(m: Any, k1: Any) -> tuple[Any, Any]:
    """The same for numbers as well as arrays; plain numbers are many times faster one by one."""
    a, b = 1.0, k1**0.5
    # K - E = K/2 · Σ 2ⁿ cₙ² with c₀² = m; `share` is cₙ²/m, and cₙ₊₁ = cₙ²/(4 aₙ₊₁).
    share, total, power = m / (4 * (1 + b) ** 2), 0.0, 2.0
    for _ in range(8):
        total = total + power * share
        a, b, square = (a + b) / 2, (a * b) ** 0.5, ((a - b) / 2) ** 2
        power *= 2
        share = share * square / (4 * (a + b) ** 2)
    K = np.pi / (a + b)
    D = K * (1 + total) / 2
    return K - D, D
