"""The twist of least dissipation for a wrench: the inverse of Coulomb friction."""

import numpy as np
from numpy.typing import NDArray

from ..errors import FlatpushError
from ..geometry.pose import Array
from .pressure import Feet, Pressure

_MAX_STEPS = 60
_BEFORE_FEET = (
    8  # Newton steps; one that has not arrived by then is caught by a foot near the rotation centre
)
_DONE = 4e-15  # residual of the wrench
_GOOD = 1e-12  # accepted if rounding lets it get no better
_POOR = 1e-6  # refused; beside a foot at the relative distance ε the rounding of the twist costs 1e-16/ε


def least_dissipation(pressure: Pressure, wrenches: Array) -> Array:
    """The V of least h(V) = ∫ |v| dN over F·V = 1, for unit wrenches F (n, 3) that lie on no facet, shape (n, 3).

    Their wrenches are multiples of F, to about 1e-14. The pressure has a gyration radius of about 1, so that
    forces and torques compare.

    Raises:
        FlatpushError: if it does not converge.
    """
    if len(wrenches) == 1:
        return _alone(pressure, wrenches[0], wrenches[0])[None]
    V, arrived = _newton_together(pressure, wrenches)
    for i in np.flatnonzero(~arrived):
        V[i] = _alone(pressure, wrenches[i], V[i])
    return V


def _newton_together(pressure: Pressure, wrenches: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The damped steps of _newton for many wrenches (n, 3) at once: the twists (n, 3), and which have arrived."""
    V, Z = wrenches.copy(), np.array([_plane(F) for F in wrenches])
    arrived = np.zeros(len(V), dtype=bool)
    which, fraction = np.arange(len(V)), np.ones(len(V))
    h, g, H = _on_planes(pressure, V, Z)
    size = np.sum(g * g, axis=1)
    for _ in range(2 * _BEFORE_FEET if isinstance(pressure, Feet) else 2 * _MAX_STEPS):
        arrived[which] = done = size <= (_DONE * h) ** 2
        if done.any():
            which, Z, fraction, h, g, H, size = (x[~done] for x in (which, Z, fraction, h, g, H, size))
        if not len(which):
            break
        a, b, c = H[:, 0, 0], H[:, 0, 1], H[:, 1, 1]
        lift = 1e-14 * (a + c) + 1e-300
        a, c = a + lift, c + lift
        det = a * c - b * b
        step = np.stack([b * g[:, 1] - c * g[:, 0], b * g[:, 0] - a * g[:, 1]], axis=1) / det[:, None]
        V1 = V[which] + np.einsum("nij,nj->ni", Z, fraction[:, None] * step)
        h1, g1, H1 = _on_planes(pressure, V1, Z)
        size1, slope, descent = (np.sum(x, axis=1) for x in (g1 * g1, g1 * step, g * step))
        level = (slope <= -0.5 * descent) & (h1 <= h * (1 + 1e-12)) & (size1 < size)
        moved = (slope <= 0) | (h1 <= h + 1e-4 * fraction * descent) | level
        rounded = (size <= (_GOOD * h) ** 2) & (~moved | (size1 >= size))
        arrived[which[rounded]] = True
        moved &= ~rounded
        V[which[moved]] = V1[moved]
        fraction = np.where(moved, 1.0, 0.5 * fraction)
        h, size = np.where(moved, h1, h), np.where(moved, size1, size)
        g, H = np.where(moved[:, None], g1, g), np.where(moved[:, None, None], H1, H)
        on = ~rounded & (det > 0)
        if not on.all():
            which, Z, fraction, h, g, H, size = (x[on] for x in (which, Z, fraction, h, g, H, size))
    return V, arrived


def _alone(pressure: Pressure, F: Array, V: Array) -> Array:
    """The same for one wrench (3,), from a twist (3,) with F·V = 1."""
    Z = _plane(F)
    feet = isinstance(pressure, Feet)
    V, residual = _newton(pressure, V, Z, _BEFORE_FEET if feet else _MAX_STEPS)
    if residual > _DONE and isinstance(pressure, Feet):
        V, residual = _past_feet(pressure, V, Z)
        if residual > _GOOD:
            V, residual = _newton(pressure, V, Z, _MAX_STEPS)
    if residual > _POOR:
        raise FlatpushError(f"the twist of the wrench {F.tolist()} was not found (residual {residual:.1e})")
    return V


def _newton(pressure: Pressure, V: Array, Z: Array, steps: int) -> tuple[Array, float]:
    """Damped Newton on the plane V + Z y, exact curvature: the twist and the residual of its wrench."""
    h, g, H = _on_plane(pressure, V, Z)
    for _ in range(steps):
        size = float(np.sqrt(g @ g))
        if size <= _DONE * h:
            break
        step = _solve(H, -g)
        descent = float(g @ step)
        fraction, moved = 1.0, False
        while fraction > 1e-9:
            V1 = V + Z @ (fraction * step)
            h1, g1, H1 = _on_plane(pressure, V1, Z)
            # h is convex: where it still falls along the step, it has fallen. Near the end h no longer
            # shows progress beyond its rounding, but the slope does.
            slope = float(g1 @ step)
            if slope <= 0 or h1 <= h + 1e-4 * fraction * descent:
                moved = True
            elif slope <= -descent / 2 and h1 <= h * (1 + 1e-12):
                moved = float(g1 @ g1) < size**2
            if moved or size <= _GOOD * h:
                break
            fraction *= 0.5
        if not moved or (size <= _GOOD * h and float(g1 @ g1) >= size**2):
            break
        V, h, g, H = V1, h1, g1, H1
    return V, float(np.sqrt(g @ g)) / h


def _past_feet(feet: Feet, V: Array, Z: Array) -> tuple[Array, float]:
    """The same minimum where feet lie so near the rotation centre that their curvature misleads Newton.

    Primal-dual Newton for a sum of norms (Andersen, Christiansen, Conn, Overton: SIAM J. Sci. Comput. 22,
    2000): the speeds are smoothed by μ → 0, and the directions u of the feet's forces are variables of
    their own.
    """
    x, y = feet.points.T
    A = Z[:2] + np.stack([-y, x], axis=1)[:, :, None] * Z[2]  # (n, 2, 2): velocity of each foot by the step
    w = feet.weights
    v = V[:2] + V[2] * np.stack([-y, x], axis=1)
    mu = 0.3 * float(w @ np.hypot(v[:, 0], v[:, 1]))
    u = v / np.sqrt(np.sum(v * v, axis=1) + mu**2)[:, None]
    best, least = V, np.inf
    for _ in range(2 * _MAX_STEPS):
        s = np.sqrt(np.sum(v * v, axis=1) + mu**2)
        g = np.einsum("nij,ni,n->j", A, v, w / s)
        B = -u[:, :, None] * (v / s[:, None])[:, None, :]
        B[:, 0, 0] += 1.0
        B[:, 1, 1] += 1.0
        H = np.einsum("nia,nij,njb,n->ab", A, (B + np.swapaxes(B, 1, 2)) / 2, A, w / s)
        step = _solve(H, -g)
        dv = A @ step
        du = v / s[:, None] - u + np.einsum("nij,nj->ni", B, dv) / s[:, None]
        fraction, h, descent = 1.0, float(w @ s), float(g @ step)
        while fraction > 1e-9:
            v1 = v + fraction * dv
            s1 = np.sqrt(np.sum(v1 * v1, axis=1) + mu**2)
            if float(w @ s1) <= h * (1 + 1e-14) + 1e-4 * fraction * descent:
                break
            fraction *= 0.5
        V = V + Z @ (fraction * step)
        v = V[:2] + V[2] * np.stack([-y, x], axis=1)
        u = u + fraction * du
        u /= np.maximum(1.0, np.hypot(u[:, 0], u[:, 1]))[:, None]
        speed = np.hypot(v[:, 0], v[:, 1])
        if np.all(speed > 0):
            force = np.einsum("nij,ni,n->j", A, v, w / speed)
            residual = float(np.sqrt(force @ force) / (w @ speed))
            if residual < least:
                best, least = V, residual
            if residual <= _DONE:
                break
        mu = max(mu * (0.2 if fraction == 1.0 else 0.8), 1e-9 * float(speed.min()))
    return best, least


def _plane(F: Array) -> Array:
    """An orthonormal basis (3, 2) of the vectors normal to the unit vector F."""
    axis = np.zeros(3)
    axis[int(np.argmin(np.abs(F)))] = 1.0
    a = axis - F * (F @ axis)
    a /= np.sqrt(a @ a)
    b = np.array([F[1] * a[2] - F[2] * a[1], F[2] * a[0] - F[0] * a[2], F[0] * a[1] - F[1] * a[0]])
    return np.stack([a, b], axis=1)


def _on_planes(pressure: Pressure, V: Array, Z: Array) -> tuple[Array, Array, Array]:
    h, W, K = pressure.resist(V)
    return h, np.einsum("ni,nij->nj", W, Z), np.swapaxes(Z, 1, 2) @ K @ Z


def _on_plane(pressure: Pressure, V: Array, Z: Array) -> tuple[float, Array, Array]:
    h, W, K = pressure.resist(V[None])
    return float(h[0]), W[0] @ Z, Z.T @ K[0] @ Z


def _solve(H: Array, g: Array) -> Array:
    """H⁻¹ g (2,), with H lifted where it is nearly singular."""
    a, b, c = float(H[0, 0]), float(H[0, 1]), float(H[1, 1])
    lift = 1e-14 * (a + c) + 1e-300
    a, c = a + lift, c + lift
    det = a * c - b * b
    if det <= 0:
        return g / (a + c)
    return np.array([c * g[0] - b * g[1], a * g[1] - b * g[0]]) / det
