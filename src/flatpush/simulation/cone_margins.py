"""How far the motions of two fingers stay inside their composite cone, under the plan's limit surface."""

from collections.abc import Callable, Sequence

import numpy as np

from ..contact import PointContact, WrenchCone, composite_margin, spacing_margin
from ..contact.wrench_cone import CLOSED
from ..friction.surface import LimitSurface
from ..geometry import rotate, velocity_at
from ..geometry.pose import Array

# Motions looked at on the way out of the cone, before the first one outside is found by refining.
STEPS, ROUNDS = 64, 6
# No cone turns an object more tightly than this many times another motion that matters.
TIGHTEST = 64.0


def cone_margins(
    contacts: Sequence[PointContact], surface: LimitSurface, point: Array, twist: Array
) -> dict[str, float]:
    """The margins of one twist about the COF; all of them negative outside the cone.

    Args:
        contacts: the two, about the COF.
        point: their middle, whose velocity is turned and kept.

    Returns:
        friction: fraction of μ that can be lost; degrees: the same as an angle of the friction cones' edges.
        spacing: fraction of the fingers' distance that can be lost.
        motion: angle by which the velocity of the middle may turn while ω stays [deg].
        curvature: 1 - ω / the largest ω of its sign with the same velocity of the middle.
    """
    mu = contacts[0].friction
    cone = WrenchCone.of(contacts)
    friction = composite_margin(contacts, surface, twist)
    kept = np.arctan(mu * min(max(1 - friction, 0.0), 10.0))
    u = velocity_at(twist, point)

    def depth(V: Array) -> Array:
        return cone.depth(surface.wrench(V))

    def left(angles: Array) -> Array:
        return depth(_about(point, np.array([rotate(a, u) for a in angles]), np.full(len(angles), twist[2])))

    def right(angles: Array) -> Array:
        return left(-angles)

    def tighter(logs: Array) -> Array:
        return _about(point, np.tile(u, (len(logs), 1)), twist[2] * np.exp(logs))

    sticks = friction >= -1e-9
    motion = min(_reach(left, np.pi), _reach(right, np.pi)) if sticks else -np.pi
    curvature = 1.0
    if twist[2] != 0:
        curvature = (
            1 - float(np.exp(-_reach(lambda t: depth(tighter(t)), np.log(TIGHTEST)))) if sticks else -9.0
        )
    return {
        "friction": friction,
        "degrees": float(np.rad2deg(np.arctan(mu) - kept)),
        "spacing": spacing_margin(contacts, surface, twist),
        "motion": float(np.rad2deg(motion)),
        "curvature": curvature,
    }


def _reach(depth: Callable[[Array], Array], limit: float) -> float:
    """The first value from 0 at which a depth becomes negative, up to a limit."""
    low, high = 0.0, limit
    for _ in range(ROUNDS):
        values = np.linspace(low, high, STEPS + 1)[1:]
        outside = np.flatnonzero(depth(values) < -CLOSED)
        if len(outside) == 0:
            return high
        k = int(outside[0])
        low, high = (low if k == 0 else float(values[k - 1])), float(values[k])
    return low


def _about(point: Array, velocities: Array, omega: Array) -> Array:
    """Twists about the COF that give a point velocities (n, 2) at turns ω (n,)."""
    return np.column_stack([velocities[:, 0] + omega * point[1], velocities[:, 1] - omega * point[0], omega])
