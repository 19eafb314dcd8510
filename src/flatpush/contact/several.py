"""Several fingertips at once: the object's motion by going through all combinations of contact modes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..friction.surface import LimitSurface, WrenchSet
from ..geometry import cross, perpendicular, velocity_at
from ..geometry.pose import Array
from .point_contact import ContactMode, PointContact

CLOSED = 1e-9  # relative slack of what must not be negative
_SCAN = 65
_CLOSEST = 4 * np.finfo(float).eps  # relative: how near a root is taken


@dataclass(frozen=True, eq=False)
class SeveralMotion:
    """The answer of several_motion.

    Attributes:
        modes: of each contact.
        twist: of the object, shape (3,), in the contacts' frame.
        jammed: no motion agrees with the fingers': they hold the object between them, and cannot all move on.
    """

    modes: tuple[ContactMode, ...]
    twist: Array
    jammed: bool = False


def several_motion(
    contacts: Sequence[PointContact], surface: LimitSurface, velocities: ArrayLike
) -> SeveralMotion:
    """The quasi-static motion of an object that touches any number of fingers, each with its velocity, shape (k, 2).

    Each contact sticks, slides to a side with its force on that edge, or parts. What is sought is a twist V that keeps
    all normal velocities, n·(J V - u) ≥ 0 (= 0 where a force acts), and of which some wrench is a sum of the forces
    allowed. Coulomb contacts need not have one answer only; the first of these is taken: all stick, then as many as
    possible do; sliding only; one finger alone. A wrench is a sum of at most three forces, so more need not be looked
    at, but for all that stick together as points of one body. No answer at all means that some forces cancel (then the
    problem has a ray instead of a solution): the object is jammed.

    Contacts, surface and velocities share one frame with its origin at the centre of friction.
    """
    u = np.asarray(velocities, dtype=float)
    if u.shape != (len(contacts), 2) or not np.isfinite(u).all():
        raise InputError("each contact has a velocity of two finite numbers", value=velocities)
    if not np.any(u):
        return SeveralMotion((ContactMode.REST,) * len(contacts), np.zeros(3))
    if len(contacts) == 1:
        motion = contacts[0].motion(surface, u[0])
        return SeveralMotion((motion.mode,), motion.twist)
    speed = float(np.max(np.hypot(u[:, 0], u[:, 1])))
    closing = np.array([c.normal @ v for c, v in zip(contacts, u, strict=True)])
    if np.all(closing < -1e-12 * speed):
        return SeveralMotion((ContactMode.SEPARATION,) * len(contacts), np.zeros(3))
    for V, pushing, sticking in _answers(contacts, surface, u, speed):
        if all(_opening(c, V, v) >= -CLOSED * speed for c, v in zip(contacts, u, strict=True)):
            modes = [
                ContactMode.STICKING
                if i in sticking
                else _side(c, V, v)
                if i in pushing
                else ContactMode.SEPARATION
                for i, (c, v) in enumerate(zip(contacts, u, strict=True))
            ]
            return SeveralMotion(tuple(modes), V)
    if np.all(closing <= CLOSED * speed):
        still = np.zeros(3)
        modes = [
            ContactMode.SEPARATION if a < -1e-12 * speed else _side(c, still, v)
            for a, c, v in zip(closing, contacts, u, strict=True)
        ]
        return SeveralMotion(tuple(modes), still)
    return SeveralMotion((ContactMode.REST,) * len(contacts), np.zeros(3), jammed=True)


def _opening(contact: PointContact, V: Array, u: Array) -> float:
    return float(contact.normal @ (velocity_at(V, contact.point) - u))


def _slip(contact: PointContact, V: Array, u: Array) -> float:
    return float(perpendicular(contact.normal) @ (u - velocity_at(V, contact.point)))


def _side(contact: PointContact, V: Array, u: Array) -> ContactMode:
    return ContactMode.SLIDING_LEFT if _slip(contact, V, u) > 0 else ContactMode.SLIDING_RIGHT


def _edge(contact: PointContact, left: bool) -> Array:
    return contact.wrench(contact.force_edges()[0 if left else 1])


def _rows(contact: PointContact, sticking: bool) -> Array:
    """The normal velocity at a contact as a row that a twist is multiplied with; of a sticking one both directions."""
    axes = [contact.normal, perpendicular(contact.normal)] if sticking else [contact.normal]
    return np.array([[*a, cross(contact.point, a)] for a in axes])


def _answers(
    contacts: Sequence[PointContact], surface: LimitSurface, u: Array, speed: float
) -> Iterator[tuple[Array, tuple[int, ...], tuple[int, ...]]]:
    """Twists with a wrench that the pushing contacts make, which of them push, and which of those stick."""
    everyone = range(len(contacts))
    lever = max(float(np.max([np.hypot(*c.point) for c in contacts])), 1e-300)
    units = np.array([1.0, 1.0, 1 / lever])  # so that rows and twists compare

    def fixed(pushing: tuple[int, ...], sticking: tuple[int, ...]) -> Array | None:
        """The twist that the velocities fix, if they do and agree, and friction allows it."""
        rows = np.concatenate([_rows(contacts[i], i in sticking) for i in pushing]) * units
        wanted = np.concatenate([_rows_of(contacts[i], u[i], i in sticking) for i in pushing])
        V, _, rank, _ = np.linalg.lstsq(rows, wanted, rcond=1e-10)
        if rank < 3 or np.max(np.abs(rows @ V - wanted)) > CLOSED * speed:
            return None
        V = V * units
        if np.max(np.abs(V / units)) <= 1e-12 * speed:
            return None
        rays = []
        for i in pushing:
            if i in sticking:
                rays += [_edge(contacts[i], True), _edge(contacts[i], False)]
            else:
                rays.append(_edge(contacts[i], _slip(contacts[i], V, u[i]) > 0))
        return V if _made(np.array(rays), surface.wrench_set(V), lever) else None

    rough = [i for i in everyone if contacts[i].friction > 0]
    for size in range(len(rough), 1, -1):
        for sticking in combinations(rough, size):
            V = fixed(sticking, sticking)
            if V is not None:
                yield V, sticking, sticking
    for i in rough:
        for j in everyone:
            if i != j:
                V = fixed((i, j), (i,))
                if V is not None:
                    yield V, (i, j), (i,)
    for three in combinations(everyone, 3):
        V = fixed(three, ())
        if V is not None:
            yield V, three, ()
    for pair in combinations(everyone, 2):
        for V in _sliding([contacts[i] for i in pair], surface, u[list(pair)], speed):
            yield V, pair, ()
    alone = [(i, contacts[i].motion(surface, u[i])) for i in everyone]
    for wanted in (True, False):
        for i, motion in alone:
            sticks = motion.mode is ContactMode.STICKING
            if sticks == wanted and np.any(motion.twist):
                yield motion.twist, (i,), (i,) if sticks else ()


def _made(rays: Array, wrenches: WrenchSet, lever: float) -> bool:
    """Whether a non-negative sum of the rays (m, 3) is one of the wrenches.

    Of a rotation about a foot, the torque about that foot is as it is, and the force may differ by what the foot bears.
    """
    from scipy.optimize import nnls

    p = wrenches.point if wrenches.radius > 0 else np.zeros(2)
    G, F = rays.copy(), wrenches.centre.copy()
    for W in (G, F):
        W[..., 2] -= cross(p, W[..., :2])
    G[:, 2] /= lever
    F[2] /= lever
    stiff = np.array([1.0, 1.0, 1e4 if wrenches.radius > 0 else 1.0])
    size = np.linalg.norm(G, axis=1)
    shares, _ = nnls((G / size[:, None] * stiff).T, F * stiff, maxiter=200)
    missing = shares @ (G / size[:, None]) - F
    free = wrenches.radius + CLOSED * float(np.linalg.norm(F))
    return bool(
        np.hypot(*missing[:2]) <= free and abs(missing[2]) <= 1e-7 * float(np.linalg.norm(F)) + CLOSED
    )


def _rows_of(contact: PointContact, u: Array, sticking: bool) -> Array:
    a = float(contact.normal @ u)
    return np.array([a, float(perpendicular(contact.normal) @ u)] if sticking else [a])


def _sliding(
    contacts: Sequence[PointContact], surface: LimitSurface, u: Array, speed: float
) -> Iterator[Array]:
    """Twists under two sliding contacts, by a scan over the mixtures of their forces and roots between."""
    from scipy.optimize import brentq

    a, b = (float(c.normal @ v) for c, v in zip(contacts, u, strict=True))
    for left in ((x, y) for x in (True, False) for y in (True, False)):
        first, second = (_edge(c, side) for c, side in zip(contacts, left, strict=True))
        if not _may_slide(contacts, surface, u, left, np.array([a, b])):
            continue

        def twist(
            share: ArrayLike, first: Array = first, second: Array = second
        ) -> tuple[Array, Array, Array]:
            part = np.asarray(share)[..., None]
            V = surface.twist((1 - part) * first + part * second)
            p, q = (velocity_at(V, c.point) @ c.normal for c in contacts)
            return V, p, q

        def off(share: ArrayLike) -> Array:
            _, p, q = twist(share)
            return np.asarray((p * b - q * a) / np.hypot(p, q))

        if np.linalg.norm(first + second) < 1e-9 * np.linalg.norm(first):
            continue
        # Dense near both ends, where one finger hardly presses.
        shares = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SCAN))
        values = off(shares)
        for k in np.flatnonzero(values[:-1] * values[1:] <= 0):
            V, p, q = twist(brentq(off, shares[k], shares[k + 1], xtol=1e-300, rtol=_CLOSEST, disp=False))
            square = p * p + q * q
            scale = (p * a + q * b) / square
            if scale <= 0 or np.hypot(scale * p - a, scale * q - b) > 1e-7 * speed:
                continue
            V = scale * V
            slips = [_slip(c, V, v) for c, v in zip(contacts, u, strict=True)]
            if all(
                (s > 0) == side or c.friction == 0 for c, s, side in zip(contacts, slips, left, strict=True)
            ):
                yield V


def _may_slide(
    contacts: Sequence[PointContact], surface: LimitSurface, u: Array, left: tuple[bool, bool], closing: Array
) -> bool:
    """Whether a wrench may cross the plane of two sliding forces: a cheap look, since most pairs do not slide.

    The twists that keep both normal velocities are V₀ + ω k; those of them that slide to the sides given lie between
    or beyond the two ω at which a slip vanishes.
    """
    rows = np.concatenate([_rows(c, False) for c in contacts])
    V0, k = np.linalg.lstsq(rows, closing, rcond=1e-12)[0], np.cross(rows[0], rows[1])
    if not np.any(k):
        return True
    k = k / np.linalg.norm(k)
    slips = np.array([[_slip(c, V0, v), _slip(c, k, 0 * v)] for c, v in zip(contacts, u, strict=True)])
    turning = np.abs(slips[:, 1]) > 1e-12
    zeros = np.sort(-slips[turning, 0] / slips[turning, 1]) if np.any(turning) else np.zeros(1)
    span = max(float(zeros[-1] - zeros[0]), 1e-9)
    away = span * np.logspace(-6, 9, 61)
    inner = zeros[0] + span * (0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 41)))
    w = np.concatenate([zeros[0] - away[::-1], inner, zeros[-1] + away])
    middle = 0.5 * (w[1:] + w[:-1])
    slide = slips[:, :1] + slips[:, 1:] * middle
    there = np.all((slide > 0) == np.array(left)[:, None], axis=0)
    first, second = (_edge(c, side) for c, side in zip(contacts, left, strict=True))
    off = surface.wrench(V0 + w[:, None] * k) @ np.cross(first, second)
    return bool(np.any(there & (off[1:] * off[:-1] <= 0)))
