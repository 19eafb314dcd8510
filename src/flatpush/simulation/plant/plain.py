"""The plant's steps written plainly, for any number of contacts and any limit surface: what the steps are held to.

As simulation.plant.steps, but for the speed: contacts move the object as contact.several says.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...contact import ContactMode, PointContact
from ...contact.several import several_motion
from ...friction.surface import LimitSurface
from ...geometry import Outline, compose, exp, inverse, perpendicular, rotate, shift_twist, transform
from ...geometry.pose import Array
from .contacts import LEVER, TOUCH
from .facing import OVERLAP
from .steps import CORNER_STEP, HALVINGS, LOOKS, SETTLES, SHARP_STEP, STEP

Held = set[tuple[int, int]]  # fingers that touch, with the number of the place


@dataclass(frozen=True, eq=False)
class NearContact:
    """A place where a fingertip is near the outline: gap [m], point and inward normal in O, finger, feature, slot."""

    gap: float
    point: Array
    normal: Array
    finger: int
    feature: tuple[int, bool]
    slot: int


@dataclass(frozen=True, eq=False)
class Fingers:
    """Round fingers and the object they push; arguments as Plant's."""

    outline: Outline
    surface: LimitSurface
    cof: Array
    friction: float
    radius: float
    tips: Array

    def near(self, q: Array, hands: Array) -> list[NearContact]:
        """Each finger's nearest place on the outline, and in a hollow the next one that faces it."""
        found = []
        for i, f in enumerate(self.tips):
            tip = transform(inverse(q), transform(hands[i if len(hands) > 1 else 0], f))
            for slot, (d, point, normal, feature) in enumerate(facing(self.outline, tip)[:2]):
                found.append(NearContact(d - self.radius, point, normal, i, feature, slot))
        # By their features: which of two places in a hollow is nearer changes with the rounding.
        return sorted(found, key=lambda place: (place.finger, place.feature))

    def advance(
        self, q: Array, hands: Array, step: Array, body: bool = False
    ) -> tuple[str, Array, Array, list[str], list[set[str]]]:
        """Moves hands (h, 3) by steps (h, 3), and the object with them.

        Returns:
            why it stopped on the way or "", the object's and the hands' poses, each finger's mode in the last step and
            all its modes on the way.
        """
        size = self.outline.size
        modes = [ContactMode.REST.value] * len(self.tips)
        seen: list[set[str]] = [set() for _ in self.tips]
        if any(t.gap < -OVERLAP * size for t in self.near(q, hands)):
            return "starts inside", q, hands, modes, seen
        reach = np.hypot(*self.tips.T) + size
        turns = np.abs(step[:, 2]) * (reach if len(step) > 1 else np.max(reach))
        travel = float(np.max(np.hypot(step[:, 0], step[:, 1]) + turns))
        s = 0.0
        while s < 1:
            touching = [t for t in self.near(q, _moved(hands, step, body, s)) if t.gap <= TOUCH * size]
            held = {(t.finger, t.slot) for t in touching}
            twist, now, jammed = self._twist(q, hands, step, body, s, held)
            if jammed:
                still = np.all(step == 0, axis=1)
                return "jammed" if np.any(still) else "grasped", q, _moved(hands, step, body, s), modes, seen
            stretch = STEP * size
            if any(t.feature[1] for t in touching):
                stretch = min(stretch, max(CORNER_STEP * self.radius, SHARP_STEP * size))
            h = (1 - s) / max(1.0, np.ceil((1 - s) * travel / stretch - 1e-9))
            shortest, settled = h / 2**HALVINGS, 0
            while True:
                mean, changed, last = self._slope(q, hands, step, body, s, h, held, touching, twist, now)
                if changed and h > 1.5 * shortest:
                    h *= 0.5
                    continue
                if settled == SETTLES:
                    break

                def gap(
                    f: float, mean: Array = mean, h: float = h, s: float = s, q: Array = q, held: Held = held
                ) -> float:
                    places = self.near(compose(q, exp(f * h * mean)), _moved(hands, step, body, s + f * h))
                    return min((t.gap for t in places if (t.finger, t.slot) not in held), default=np.inf)

                before, hit = 0.0, None
                for look in np.arange(1, LOOKS + 1) / LOOKS:
                    if gap(look) < 0:
                        hit = look
                        break
                    before = look
                if hit is None:
                    break
                while hit - before > 1e-12:
                    middle = 0.5 * (before + hit)
                    before, hit = (before, middle) if gap(middle) < 0 else (middle, hit)
                h, settled = max(before, 1e-9) * h, settled + 1
            q = compose(q, exp(h * mean))
            s = 1.0 if s + h > 1 - 1e-12 else s + h
            if held:
                q = self.settle(q, _moved(hands, step, body, s), held, last)
            for i in range(len(self.tips)):
                words = [w for t, w in zip(touching, now, strict=True) if t.finger == i]
                modes[i] = _together(words)
                seen[i].add(modes[i])
        return "", q, _moved(hands, step, body, 1.0), modes, seen

    def _twist(
        self, q: Array, hands: Array, step: Array, body: bool, s: float, held: Held
    ) -> tuple[Array, list[str], bool]:
        """Body twist of the object in O per whole step, the contacts' modes, and whether it is jammed."""
        at = _moved(hands, step, body, s)
        touching = [t for t in self.near(q, at) if (t.finger, t.slot) in held]
        if len(touching) != len(held):
            return np.zeros(3), [], False
        if not touching:
            return np.zeros(3), [], False
        velocities, contacts = [], []
        for t in touching:
            k = t.finger if len(hands) > 1 else 0
            v = rotate(at[k, 2], step[k, :2]) if body else step[k, :2]
            lever = transform(q, t.point) - at[k, :2]
            velocities.append(rotate(-q[2], v + step[k, 2] * perpendicular(lever)))
            contacts.append(PointContact(t.point - self.cof, t.normal, self.friction, hook=True))
        motion = several_motion(contacts, self.surface, velocities)
        return shift_twist(motion.twist, -self.cof), [m.value for m in motion.modes], motion.jammed

    def _slope(
        self,
        q: Array,
        hands: Array,
        step: Array,
        body: bool,
        s: float,
        h: float,
        held: Held,
        touching: Sequence[NearContact],
        twist: Array,
        now: list[str],
    ) -> tuple[Array, bool, list[str]]:
        """Mean twist of a Runge-Kutta-Munthe-Kaas step, whether modes or features change on it, and the last modes."""
        slopes, last, changed = [twist], now, False
        if held:
            for share in (0.5, 0.5, 1.0):
                moved = share * h * slopes[-1]
                X = compose(q, exp(moved))
                V, last, jammed = self._twist(X, hands, step, body, s + share * h, held)
                if jammed or len(last) != len(now):
                    return twist, True, now
                slopes.append(_log_rate(moved, V))
                there = [
                    t
                    for t in self.near(X, _moved(hands, step, body, s + share * h))
                    if (t.finger, t.slot) in held
                ]
                changed |= last != now or [t.feature for t in there] != [t.feature for t in touching]
        else:
            slopes *= 4
        k1, k2, k3, k4 = slopes
        return (k1 + 2 * k2 + 2 * k3 + k4) / 6, changed, last

    def settle(self, q: Array, hands: Array, held: Held, last: list[str]) -> Array:
        """Moves the object the least so that what touches does so exactly, and what has parted does not overlap."""
        ell = LEVER * self.outline.size
        for _ in range(3):
            places = [t for t in self.near(q, hands) if (t.finger, t.slot) in held]
            parted = (ContactMode.SEPARATION.value, ContactMode.REST.value)
            loose = [k < len(last) and last[k] in parted for k in range(len(places))]
            places = [t for t, free in zip(places, loose, strict=True) if t.gap < 0 or not free]
            if not places:
                break
            gaps = -np.array([t.gap for t in places])
            if len(places) == 1:
                move = np.array([*(gaps[0] * places[0].normal), 0.0])
            else:
                levers = [t.point - self.cof for t in places]
                rows = np.array(
                    [
                        [*t.normal, (p[0] * t.normal[1] - p[1] * t.normal[0]) / ell]
                        for t, p in zip(places, levers, strict=True)
                    ]
                )
                move = np.linalg.lstsq(rows, gaps, rcond=1e-6)[0] / np.array([1.0, 1.0, ell])
            move = shift_twist(move, -self.cof)
            q = q + np.array([*rotate(q[2], move[:2]), move[2]])
        return q


def facing(outline: Outline, tip: Array) -> list[tuple[float, Array, Array, tuple[int, bool]]]:
    """Places where the outline faces a point, nearest first: signed distance, point, inward normal, feature.

    A feature is an edge, or (with True) the corner at its start. Corners count where they are nearer than both edges,
    hollow ones only as the nearest place of a point inside.
    """
    found = outline.nearest(tip)
    if outline.is_circle:
        return [(found.distance, found.point, found.normal, (0, False))]
    start = outline.vertices if outline.sense > 0 else outline.vertices[::-1]
    d = np.roll(start, -1, axis=0) - start
    length = np.hypot(*d.T)
    e = d / length[:, None]
    n = perpendicular(e)
    r = tip - start
    along, off = np.sum(r * e, axis=1), -np.sum(r * n, axis=1)
    before = np.roll(e, 1, axis=0)
    convex = before[:, 0] * e[:, 1] - before[:, 1] * e[:, 0] >= 0
    places: list[tuple[float, Array, Array, tuple[int, bool]]] = []
    for i in range(len(start)):
        if 0 <= along[i] <= length[i]:
            places.append((float(off[i]), start[i] + along[i] * e[i], n[i], (i, False)))
        elif along[i] < 0 and along[i - 1] > length[i - 1]:
            away = float(np.hypot(*r[i]))
            sign = 1.0 if convex[i] else -1.0
            normal = -sign * r[i] / away if away > 1e-12 * outline.size else n[i]
            places.append((sign * away, start[i], normal, (i, True)))
    places.sort(key=lambda place: abs(place[0]))
    return places[:1] + [
        p for p in places[1:] if p[0] > -OVERLAP * outline.size and not outline_convex(convex)
    ]


def outline_convex(convex: Array) -> bool:
    """Whether all corners of an outline are convex: then a round finger meets it at one place only."""
    return bool(np.all(convex))


def _moved(hands: Array, step: Array, body: bool, s: float) -> Array:
    return compose(hands, exp(s * step)) if body else hands + s * step


def _log_rate(moved: Array, twist: Array) -> Array:
    """Rate of the displacement's logarithm when the body, displaced by exp(moved), has a body twist."""

    def bracket(a: Array, b: Array) -> Array:
        return np.array([*(a[2] * perpendicular(b[:2]) - b[2] * perpendicular(a[:2])), 0.0])

    first = bracket(moved, twist)
    return twist + 0.5 * first + bracket(moved, first) / 12


def _together(words: list[str]) -> str:
    """The mode of a finger with two contacts: it sticks if one does, it slides if one does."""
    for word in (ContactMode.STICKING.value, ContactMode.SLIDING_LEFT.value, ContactMode.SLIDING_RIGHT.value):
        if word in words:
            return word
    return words[0] if words else ContactMode.SEPARATION.value
