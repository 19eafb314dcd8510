"""The rest of a push, planned again in closed form from where the flat point now is to where it shall end."""

import math
from typing import Literal, NamedTuple

import numpy as np

from ...steering.dubins import DubinsPath, shortest_path
from .formulas import wrapped

#: "even": two arcs, none tighter than with the reserve; "planned": a Dubins path with the reserve; "tight": one with
#: the widest turns that lead there, as far as feedback may use them; "closing": none leads there without a loop, and
#: what is left of the errors is spread by two arcs or, near the end, by the turn after which least is missed; "path":
#: along a path that was found among things; "past": the end is abeam or behind, or the planned length is used up.
How = Literal["even", "planned", "tight", "closing", "path", "past"]

# A rest longer than what should be left by more than this is another path: a loop [radii].
LONGER = 0.15
# Far from the end, in radii of what is left of the last, it may grow by a radius.
FAR = 4.0
# In a tick what should be left follows what was found by so much of the difference.
SHARE = 0.05
# Halvings of what lies between the tightest turns and those with the reserve.
HALVINGS = 4
# Two arcs are for headings that differ from the way straight to the goal by less than this [rad].
EVEN = 1.0
# The last stretch is shorter than this [radii] and within this of the heading [rad].
CLOSE, SKEW = 0.5, 0.6


class Rest(NamedTuple):
    """What to do now: turn per length of the flat path [1/m], length of the rest [m], and how it was found."""

    curvature: float
    length: float
    how: How

    def due(self, before: float) -> float:
        """What should be left [m], by what should have been before it was found: it follows slowly, since what noise
        makes shorter is no promise."""
        return self.length if math.isinf(before) else before + SHARE * (self.length - before)


def rest_of_path(
    flat: tuple[float, float, float],
    goal: tuple[float, float, float],
    radius: float,
    left: float,
    right: float,
    before: float,
    step: float = 0.0005,
    lever: float = 0.0,
    tolerance: tuple[float, float] = (0.002, 0.035),
) -> Rest:
    """The rest from a flat pose to a goal (x, y, heading).

    Args:
        radius: of the turns with the reserve [m]. left, right: most turn per length to either side [1/m].
        before: what should be left of the push by now [m]: what was due at the last tick, less what was driven since;
            infinite if there was none.
        step: what is driven of it now: the turn of a Dubins path is the mean one over that [m].
        lever: how far the flat point lies ahead of the object's origin [m].
        tolerance: of the object's place [m] and angle [rad], by which errors compare where both cannot be met.

    >>> rest_of_path((0, 0, 0), (0.1, 0, 0), 0.04, 30, 30, 0.1)
    Rest(curvature=0.0, length=0.1, how='even')
    """
    c, s = math.cos(goal[2]), math.sin(goal[2])
    ahead = c * (goal[0] - flat[0]) + s * (goal[1] - flat[1])
    off = c * (flat[1] - goal[1]) - s * (flat[0] - goal[0])
    skew = wrapped(flat[2] - goal[2])
    near = before < radius and abs(skew) < SKEW
    if before <= 0 or (near and ahead <= 0):
        return Rest(0.0, 0.0, "past")
    # With most of a way still to go a longer one is better than to close in what is left of a loop.
    most = before + (1.0 if before > FAR * radius else LONGER) * radius
    sight = math.atan2(goal[1] - flat[1], goal[0] - flat[0])
    if max(abs(wrapped(flat[2] - sight)), abs(wrapped(goal[2] - sight))) < EVEN:
        kappa, other, length = biarc(flat, goal)
        if max(abs(kappa), abs(other)) * radius <= 1 and length <= most:
            return Rest(kappa, length, "even")
    path = shortest_path(np.array(flat), np.array(goal), radius)
    if path.length <= most:
        return _begun(path, radius, step, "planned", left, right)
    # Of the turns that do the widest: what is left of the reserve is for what comes later.
    found, wide, tight = None, radius, 1 / min(left, right)
    for _ in range(HALVINGS):
        turning = tight if found is None else 0.5 * (tight + wide)
        path = shortest_path(np.array(flat), np.array(goal), turning)
        if path.length <= most:
            found, tight = _begun(path, turning, step, "tight", left, right), turning
        elif found is None:
            break
        else:
            wide = turning
    if found is not None:
        return found
    if near and ahead < CLOSE * radius:
        kappa, length = _least_miss(ahead, off, skew, lever, tolerance), ahead / max(0.5, math.cos(skew))
    else:
        kappa, _, length = biarc(flat, goal)
    return Rest(min(max(kappa, -right), left), min(length, before), "closing")


def _begun(path: DubinsPath, radius: float, step: float, how: How, left: float, right: float) -> Rest:
    """A Dubins path, by its mean turn over the first stretch."""
    rest = stretch = min(step, path.length)
    turn = 0.0
    for letter, length in zip(path.word, path.lengths, strict=True):
        part = min(rest, float(length))
        turn += {"L": part, "S": 0.0, "R": -part}[letter] / radius
        rest -= part
    kappa = turn / stretch if stretch > 0 else 0.0
    return Rest(min(max(kappa, -right), left), path.length, how)


def _least_miss(ahead: float, off: float, skew: float, lever: float, tolerance: tuple[float, float]) -> float:
    """The one turn per length over all that is left after which the object's errors, by the tolerance, are least.

    After a way d with a turn κ the flat point is off by e + ψ d + κ d²/2 and the heading by ψ + κ d; the object's
    origin lies a lever behind the flat point.
    """
    d = max(ahead, 1e-6)
    place, turned = 0.5 * d * d - lever * d, d  # by κ
    wide, skewed = off + skew * d - lever * skew, skew
    a, b = place / tolerance[0], turned / tolerance[1]
    return -(a * wide / tolerance[0] + b * skewed / tolerance[1]) / (a * a + b * b)


def biarc(start: tuple[float, float, float], goal: tuple[float, float, float]) -> tuple[float, float, float]:
    """Curvatures of two arcs that lead smoothly from pose to pose, and the length of both.

    Of all pairs it is the one with tangents of equal length d: |v|² = 2 d v·(t₀ + t₁) + 2 d² (1 - t₀·t₁).

    >>> first, second, length = biarc((0, 0, 0), (1, 1, math.pi / 2))
    >>> round(first, 9), round(second, 9), round(length, 9) == round(math.pi / 2, 9)
    (1.0, 1.0, True)
    """
    vx, vy = goal[0] - start[0], goal[1] - start[1]
    ax, ay, bx, by = math.cos(start[2]), math.sin(start[2]), math.cos(goal[2]), math.sin(goal[2])
    square = vx * vx + vy * vy
    if square == 0:
        return 0.0, 0.0, 0.0
    along, bent = vx * (ax + bx) + vy * (ay + by), 1 - (ax * bx + ay * by)
    # The positive root, in the form that does not cancel.
    root = math.sqrt(along * along + 2 * bent * square)
    d = square / (along + root) if along > 0 else (root - along) / (2 * bent) if bent > 1e-12 else 0.5 * root
    mx, my = 0.5 * (vx + d * (ax - bx)), 0.5 * (vy + d * (ay - by))
    first, one = _arc(ax, ay, mx, my)
    second, two = _arc(-bx, -by, mx - vx, my - vy)
    return first, -second, one + two


def _arc(tx: float, ty: float, wx: float, wy: float) -> tuple[float, float]:
    """Curvature and length of the arc that leaves along a unit vector and ends at a chord w."""
    chord = math.hypot(wx, wy)
    if chord == 0:
        return 0.0, 0.0
    half = math.atan2(tx * wy - ty * wx, tx * wx + ty * wy)
    curvature = 2 * math.sin(half) / chord
    return curvature, chord if abs(half) < 1e-9 else chord * half / math.sin(half)
