"""How far the motions of two fingers stay inside their composite cone, under the plan's limit surface."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..contact import PointContact, WrenchCone
from ..contact.two_point import composite_margins, spacing_margins
from ..contact.wrench_cone import CLOSED
from ..friction.surface import LimitSurface
from ..geometry import rotate, velocity_at
from ..geometry.pose import Array
from .margins import Margins

# Motions looked at on the way out of the cone, so many at a time, before the first one outside is found by refining.
STEPS, LOOK = 64, 8
# No cone turns an object more tightly than this many times another motion that matters.
TIGHTEST = 64.0
# The first motion outside is found to within this part of the way [rad, or of the logarithm of ω].
RESOLVED = 1e-12
# Depth at which a motion counts as on the edge of the cone, above rounding.
ON_EDGE = 1e-13
# The third of the three ways out; the others turn the velocity to the left and to the right.
TIGHTER = 2
Places = NDArray[np.intp]


def cone_margins(
    surface: LimitSurface, pairs: Sequence[Sequence[PointContact]], points: Array, twists: Array
) -> list[Margins]:
    """The margins of twists (n, 3) about the COF, all of them negative outside the cone.

    The velocity of the middle may turn by `motion` while ω stays; `curvature` is 1 - ω / the largest ω of its sign with
    the same velocity of the middle.

    Args:
        pairs: of each twist the two contacts that make it, about the COF.
        points: their middles (n, 2), whose velocities are turned and kept [m].
    """
    wrenches = surface.wrench_sets(twists)
    frictions, spacings = composite_margins(pairs, wrenches), spacing_margins(pairs, wrenches)
    motions, curvatures = np.full(len(pairs), -np.pi), np.full(len(pairs), -np.inf)
    within = [i for i, friction in enumerate(frictions) if friction >= -CLOSED]
    if within:
        cones = [WrenchCone.of(pairs[i]) for i in within]
        left, right, tighter = _ends(surface, cones, points[within], twists[within])
        motions[within] = np.minimum(left, right)
        curvatures[within] = np.where(twists[within, 2] != 0, 1 - np.exp(-tighter), 1.0)
    found = []
    for i, contacts in enumerate(pairs):
        mu, friction = contacts[0].friction, frictions[i]
        found.append(
            Margins(
                friction=friction,
                degrees=math.degrees(math.atan(mu) - math.atan(mu * max(1 - friction, 0.0))),
                spacing=spacings[i],
                motion=math.degrees(motions[i]),
                curvature=float(curvatures[i]),
            )
        )
    return found


def _ends(surface: LimitSurface, cones: Sequence[WrenchCone], points: Array, twists: Array) -> Array:
    """How far motions inside their cones may turn left and right [rad], and ω grow [its logarithm], shape (3, n)."""
    count, most = len(cones), max(len(cone.faces) for cone in cones)
    faces = np.zeros((count, most, 3))  # a face of zeros is no limit
    for own, cone in zip(faces, cones, strict=True):
        own[: len(cone.faces)] = cone.faces / [1.0, 1.0, cone.lever]
    levers = np.array([cone.lever for cone in cones])
    u = velocity_at(twists, points)

    def depths(values: Array, ways: Places) -> Array:
        """At values (k, m) on ways (k,): of motions turned left, of those turned right, of those that turn tighter."""
        kind, i = np.divmod(ways, count)
        velocities = rotate(np.array([1.0, -1.0, 0.0])[kind, None] * values, u[i, None])
        omega = twists[i, 2:] * np.where(kind[:, None] == TIGHTER, np.exp(values), 1.0)
        x, y = points[i, 0, None], points[i, 1, None]
        W = surface.wrench(
            np.stack([velocities[..., 0] + omega * y, velocities[..., 1] - omega * x, omega], axis=2)
        )
        sizes = np.sqrt(W[..., 0] ** 2 + W[..., 1] ** 2 + (W[..., 2] / levers[i, None]) ** 2)
        return np.min(W @ np.swapaxes(faces[i], 1, 2), axis=2) / sizes + CLOSED

    return _reach(depths, np.repeat([np.pi, np.pi, np.log(TIGHTEST)], count)).reshape(3, count)


def _reach(depths: Callable[[Array, Places], Array], limits: Array) -> Array:
    """The first values from 0 on several ways (m,) at which a depth becomes negative, up to a limit each.

    Looked for in equal steps, some at a time, then by the Illinois form of the false position on all ways at once.

    Args:
        depths: at values (k, n) on some ways, whose numbers (k,) are given, shape (k, n).
    """
    low, high = np.zeros(len(limits)), limits.copy()
    ahead = np.arange(len(limits))
    at_low, at_high = depths(low[:, None], ahead)[:, 0], np.zeros(len(limits))
    for step in range(1, STEPS, LOOK):
        values = limits[ahead, None] * np.arange(step, step + LOOK) / STEPS
        found = depths(values, ahead)
        outside = found < 0
        ends, first = outside.any(axis=1), outside.argmax(axis=1)
        rows, before = np.arange(len(ahead)), np.where(ends, first - 1, LOOK - 1)
        moved = before >= 0
        low[ahead[moved]], at_low[ahead[moved]] = (x[rows, before][moved] for x in (values, found))
        high[ahead[ends]], at_high[ahead[ends]] = (x[rows, first][ends] for x in (values, found))
        ahead = ahead[~ends]
        if not len(ahead):
            break
    open_ = at_low > 0
    open_[ahead] = False
    side = np.zeros(len(limits))
    for _ in range(100):
        open_ &= high - low > RESOLVED * limits
        ways = np.flatnonzero(open_)
        if not len(ways):
            break
        a, b, at_a, at_b = (x[ways] for x in (low, high, at_low, at_high))
        middle = np.clip((a * at_b - b * at_a) / (at_b - at_a), a, b)
        at = depths(middle[:, None], ways)[:, 0]
        inside, arrived = at >= 0, np.abs(at) <= ON_EDGE
        # The end that stayed twice running counts half, so that the bracket closes from both sides.
        at_low[ways] = np.where(inside, at, np.where(side[ways] == -1, 0.5 * at_a, at_a))
        at_high[ways] = np.where(inside, np.where(side[ways] == 1, 0.5 * at_b, at_b), at)
        low[ways], high[ways] = np.where(inside | arrived, middle, a), np.where(inside & ~arrived, b, middle)
        side[ways] = np.where(inside, 1, -1)
    return low
