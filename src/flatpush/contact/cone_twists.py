"""The three motions of a two-finger push that turn an object tightest within the fingers' true composite cone."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import NoDubinsReduction
from ..friction.exact import Exact
from ..friction.support import Support
from ..friction.surface import LimitSurface
from ..geometry import cross, perpendicular, velocity_at
from ..geometry.pose import Array
from .point_contact import PointContact
from .wrench_cone import CLOSED, WrenchCone, narrowed, straight_wrenches

Cost = Literal["flat", "pusher", "time"]
# Wrenches between two edges of the narrowed cone that are tried beside the edges.
ON_FACE = 1
# Fingers that go straight from sample to sample turn the object about points up to so far from the planned one [m]:
# planning.segments samples turns so finely. Feet so near to the centre may then resist in any direction.
OFF_CENTRE = 2.5e-4
# In such turns a force may miss the cone by this angle [rad], or less with a margin, from RESERVE on by nothing: what
# motions without a margin miss it by, which slip a little. A turn about a foot, or where a quartic or a local ellipsoid
# bends as sharply, misses it by far more.
MISSED, RESERVE = math.radians(1.0), 0.02
# Directions [rad] in which the turning centre is off under a smooth surface, and beside the worst of them.
AROUND, BESIDE = np.pi / 4 * np.arange(8), np.pi / 14 * np.array([-1.0, -0.5, 0.5, 1.0])
# How far a wrench is moved at once, of its way to the straight one, and how exactly the end of that is found.
MOVED, FOUND = 1 / 64, 1 / 1024
# Choices that differ by less than this part are equal; the first is taken, so that rounding does not decide.
EQUAL = 1e-7


def cone_twists(
    contacts: Sequence[PointContact],
    surface: LimitSurface,
    margin: float,
    hand: Array,
    cost: Cost = "flat",
    *,
    quick: bool = False,
) -> Array:
    """Left turn, straight motion and right turn of a two-finger push, as twists about the COF, shape (3, 3).

    The turns have ω = 1 and ω = -1, the straight motion has unit speed. Each has a wrench in the composite cone less
    the margin (see wrench_cone.narrowed). The turning centres are chosen among those that the edges and faces of
    the narrowed cone make: closest together for the cost "flat", closest to the hand for "pusher", to its farther
    finger for "time".

    The straight motion is square to the line of the centres: then it is a sum of the two turns, and the push is a
    Dubins car whatever the limit surface. Where the narrowed cone does not reach that far, it is the nearest direction
    that it reaches.

    Args:
        contacts: the two, about the COF.
        margin: friction margin, in [0, 1).
        hand: the places whose paths count, about the COF, shape (k, 2): the middle of the hand, or its fingertips.
        quick: only the edges of the narrowed cone are tried, where the best centres nearly always are.

    Raises:
        NoDubinsReduction: if every force of the fingers turns the object the same way, or, less the margin, does.
        InputError: if the fingers squeeze the object, or have no friction.
    """
    cone = WrenchCone.of(contacts)
    if straight_wrenches(cone, surface) is None:
        raise NoDubinsReduction(
            _beside(
                cone, ". A place nearer to the line of the normal through the centre of friction would help"
            )
        )
    inner = narrowed(contacts, margin)
    pair = straight_wrenches(inner, surface)
    if pair is None:
        kept = np.floor(1000 * _most_kept(contacts, surface, margin)) / 10
        raise NoDubinsReduction(
            _beside(
                inner, f" with {100 * margin:g} % of μ and of the spacing in reserve; it can keep {kept:g} %"
            )
        )
    towards = np.asarray(sum(F / np.linalg.norm(F[:2]) for F in pair))
    missed = math.sin(MISSED) * max(0.0, 1 - margin / RESERVE)
    lefts, rights = _turns(cone, inner, surface, towards, 0 if quick else ON_FACE, missed)
    left, right = _tightest(lefts, rights, hand, cost)
    straight = _between(inner, surface, left, right, pair)
    a, b = _centres(np.stack([left, right]))
    if cross(straight[:2], a - b) <= 0:
        raise NoDubinsReduction("the turning centres of this push do not lie on either side of its way")
    return np.stack([left, straight, right])


def _most_kept(contacts: Sequence[PointContact], surface: LimitSurface, too_much: float) -> float:
    """The greatest margin with which the fingers can push straight; 0 can, too_much cannot."""
    low, high = 0.0, too_much
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        able = straight_wrenches(narrowed(contacts, middle), surface) is not None
        low, high = (middle, high) if able else (low, middle)
    return low


def _beside(cone: WrenchCone, rest: str) -> str:
    """Why a cone cannot steer: which way all its forces turn the object, and how near to the COF they come."""
    wrenches = cone.wrenches
    levers = wrenches[:, 2] / np.linalg.norm(wrenches[:, :2], axis=1)
    way = "counter-clockwise" if levers[0] > 0 else "clockwise"
    least = 1000 * float(np.min(np.abs(levers)))
    return (
        f"every force that the two fingers have together turns the object {way}: the nearest one's line passes the"
        f" centre of friction at {least:.1f} mm, so the push cannot go straight{rest}"
    )


def _turns(
    cone: WrenchCone, inner: WrenchCone, surface: LimitSurface, towards: Array, between: int, missed: float
) -> tuple[Array, Array]:
    """Twists of wrenches on the narrowed cone, left turns (ω = 1) and right turns (ω = -1).

    A wrench whose turn the whole cone does not hold where its centre is off by little is moved towards the straight one
    until it does.
    """
    rays = inner.wrenches[inner.order()]
    rays = rays / np.linalg.norm(rays[:, :2], axis=1, keepdims=True)
    nexts = np.roll(rays, -1, axis=0)
    parts = np.arange(between + 1) / (between + 1)
    wrenches = np.concatenate([(1 - s) * rays + s * nexts for s in parts])
    twists = surface.twist(wrenches)
    for i in np.flatnonzero(~_held(cone, surface, twists, missed)):
        twists[i] = _nearer(cone, surface, wrenches[i], towards, missed)
    kept = twists[:, 2] != 0
    turns = twists[kept] / np.abs(twists[kept, 2:])
    lefts, rights = turns[turns[:, 2] > 0], turns[turns[:, 2] < 0]
    if not len(lefts) or not len(rights):
        raise NoDubinsReduction("the two fingers cannot turn the object both ways and keep it")
    return lefts, rights


def _nearer(cone: WrenchCone, surface: LimitSurface, F: Array, towards: Array, missed: float) -> Array:
    """The twist of the nearest wrench on the way from F to the straight one that is held; zero if none is."""

    def twist(way: float) -> Array:
        return surface.twist((1 - way) * F + way * towards)

    low, high, step = 0.0, MOVED, MOVED
    while not _held(cone, surface, twist(high)[None], missed)[0]:
        step *= 2
        low, high = high, high + step
        if high >= 1:
            return np.zeros(3)
    while high - low > FOUND:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _held(cone, surface, twist(middle)[None], missed)[0] else (middle, high)
    return twist(high)


def _held(cone: WrenchCone, surface: LimitSurface, twists: Array, missed: float) -> NDArray[np.bool_]:
    """Whether a cone holds the turns about all points within OFF_CENTRE of those of twists (n, 3), shape (n,).

    Of a surface without feet, to within a part `missed` of the wrench.
    """
    turns = twists[:, 2] != 0
    held = np.ones(len(twists), dtype=bool)  # an exact surface without feet changes little so near
    if isinstance(surface, Exact) and surface.has_facets:
        held[turns] = [_held_by_feet(cone, surface.support, V) for V in twists[turns]]
    elif not isinstance(surface, Exact) and turns.any():

        def depths(directions: Array) -> Array:
            off = OFF_CENTRE * np.stack([np.sin(directions), -np.cos(directions), 0 * directions], axis=-1)
            return cone.depth(surface.wrench(twists[turns, None] + twists[turns, None, 2:] * off))

        found = depths(np.broadcast_to(AROUND, (int(turns.sum()), len(AROUND))))
        near = depths(AROUND[np.argmin(found, axis=1), None] + BESIDE)
        held[turns] = np.minimum(found.min(axis=1), near.min(axis=1)) >= -max(missed, CLOSED)
    return held


def _held_by_feet(cone: WrenchCone, support: Support, V: Array) -> bool:
    """As _held, of feet: each takes the direction, of those that it has in such turns, that is worst for a face."""
    points, weights = support.feet
    u = velocity_at(V, points)
    gaps = np.hypot(u[:, 0], u[:, 1]) / abs(V[2])
    spread = np.where(gaps > OFF_CENTRE, np.arcsin(OFF_CENTRE / np.maximum(gaps, OFF_CENTRE)), np.pi)
    # What a force at each foot adds to the height above each face, shape (faces, feet, 2).
    lifts = cone.faces[:, None, :2] + cone.faces[:, None, 2:] * perpendicular(points) / cone.lever
    angles = np.abs(np.arctan2(cross(lifts, u), np.sum(lifts * u, axis=2)))
    heights = np.hypot(lifts[..., 0], lifts[..., 1]) * np.cos(np.minimum(np.pi, angles + spread))
    return bool(np.min(heights @ weights) >= -CLOSED)


def _tightest(lefts: Array, rights: Array, hand: Array, cost: Cost) -> tuple[Array, Array]:
    """The pair of turns that the cost likes best."""
    a, b = _centres(lefts), _centres(rights)
    if cost == "flat":
        apart = np.linalg.norm(a[:, None] - b[None], axis=2)
    else:
        to_left, to_right = (np.max(np.linalg.norm(c[:, None] - hand[None], axis=2), axis=1) for c in (a, b))
        apart = to_left[:, None] + to_right[None]
    best = int(np.flatnonzero(apart.ravel() <= np.min(apart) * (1 + EQUAL))[0])
    return lefts[best // len(rights)], rights[best % len(rights)]


def _between(
    inner: WrenchCone, surface: LimitSurface, left: Array, right: Array, pair: tuple[Array, Array]
) -> Array:
    """The straight motion: the sum of the turns, or the nearest that the narrowed cone reaches."""
    V = np.array([*(left + right)[:2], 0.0])
    V = V / np.hypot(V[0], V[1])
    if inner.depth(surface.wrench(V)) >= 0:
        return V
    ends = surface.twist(np.array(pair))[:, :2]
    ends = ends / np.linalg.norm(ends, axis=1, keepdims=True)
    v = max(ends, key=lambda end: float(end @ V[:2]))
    return np.array([*v, 0.0])


def _centres(twists: Array) -> Array:
    return np.asarray(perpendicular(twists[:, :2]) / twists[:, 2:])
