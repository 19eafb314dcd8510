"""How far the motions of two fingers stay inside their composite cone, under the plan's limit surface."""

from collections.abc import Callable, Sequence

import numpy as np

from ..contact import PointContact, WrenchCone, composite_margin, spacing_margin
from ..contact.wrench_cone import CLOSED
from ..friction.surface import LimitSurface
from ..geometry import rotate, velocity_at
from ..geometry.pose import Array
from .margins import Margins

# Motions looked at on the way out of the cone, before the first one outside is found by refining.
STEPS = 64
# No cone turns an object more tightly than this many times another motion that matters.
TIGHTEST = 64.0
# The first motion outside is found to within this part of the way [rad, or of the logarithm of ω].
RESOLVED = 1e-12


def cone_margins(
    contacts: Sequence[PointContact], surface: LimitSurface, point: Array, twist: Array
) -> Margins:
    """The margins of one twist (3,) about the COF, all of them negative outside the cone.

    The velocity of the middle may turn by `motion` while ω stays; `curvature` is 1 - ω / the largest ω of its sign with
    the same velocity of the middle.

    Args:
        contacts: the two, about the COF.
        point: their middle (2,), whose velocity is turned and kept [m].
    """
    mu = contacts[0].friction
    cone = WrenchCone.of(contacts)
    friction = composite_margin(contacts, surface, twist)
    u = velocity_at(twist, point)

    def depths(ways: Array) -> Array:
        """Of the motions turned left and right by an angle, and turning more tightly by a logarithm, (3, n)."""
        left, right, log = ways
        velocities = np.concatenate([rotate(left, u), rotate(-right, u), np.tile(u, (len(log), 1))])
        omega = twist[2] * np.concatenate([np.ones(2 * len(log)), np.exp(log)])
        return cone.depth(surface.wrench(_about(point, velocities, omega))).reshape(3, -1) + CLOSED

    if friction >= -CLOSED:
        left, right, tighter = _reach(depths, np.array([np.pi, np.pi, np.log(TIGHTEST)]))
        motion = min(left, right)
        curvature = 1 - float(np.exp(-tighter)) if twist[2] != 0 else 1.0
    else:
        motion, curvature = -np.pi, -np.inf
    return Margins(
        friction=friction,
        degrees=float(np.rad2deg(np.arctan(mu) - np.arctan(mu * max(1 - friction, 0.0)))),
        spacing=spacing_margin(contacts, surface, twist),
        motion=float(np.rad2deg(motion)),
        curvature=curvature,
    )


def _reach(depths: Callable[[Array], Array], limits: Array) -> Array:
    """The first values from 0 on several ways (m,) at which a depth becomes negative, up to a limit each.

    Looked for in equal steps, then by the Illinois form of the false position on all ways at once.
    """
    values = limits[:, None] * np.arange(1, STEPS + 1) / STEPS
    found = depths(values)
    outside = found < 0
    first = np.where(outside.any(axis=1), outside.argmax(axis=1), STEPS - 1)
    ways = np.arange(len(limits))
    high, at_high = values[ways, first], found[ways, first]
    low = np.where(first > 0, values[ways, first - 1], 0.0)
    at_low = np.where(first > 0, found[ways, first - 1], depths(np.zeros((len(limits), 1)))[:, 0])
    open_ = outside.any(axis=1) & (at_low > 0)
    low = np.where(outside.any(axis=1), low, limits)
    side = np.zeros(len(limits))
    for _ in range(100):
        if not np.any(open_ & (high - low > RESOLVED * limits)):
            break
        middle = np.where(
            open_, (low * at_high - high * at_low) / np.where(open_, at_high - at_low, 1.0), low
        )
        middle = np.clip(middle, low, high)
        at = depths(middle[:, None])[:, 0]
        inside = at >= 0
        # The end that stayed twice running counts half, so that the bracket closes from both sides.
        at_low = np.where(inside, at, np.where(side == -1, 0.5 * at_low, at_low))
        at_high = np.where(inside, np.where(side == 1, 0.5 * at_high, at_high), at)
        low, high = np.where(inside & open_, middle, low), np.where(~inside & open_, middle, high)
        side = np.where(inside, 1, -1)
        open_ = open_ & (np.abs(at) > 1e-15)
    return low


def _about(point: Array, velocities: Array, omega: Array) -> Array:
    """Twists about the COF that give a point velocities (n, 2) at turns ω (n,)."""
    return np.column_stack([velocities[:, 0] + omega * point[1], velocities[:, 1] - omega * point[0], omega])
