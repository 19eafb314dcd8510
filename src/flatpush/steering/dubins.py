"""Shortest paths of bounded curvature between two poses ([Dubins1957]), for a car that only drives forward.

A shortest path is one of six words: LSL, RSR, LSR, RSL (arc, straight, arc) and LRL, RLR (three arcs), L
turning counter-clockwise. Each word is solved from the centres of its circles, in the frame of the start with
the radius as the unit of length; complex numbers stand for plane vectors.

Poses that are aligned, touch circles or coincide make an arc of zero come out as -1e-17, and a plain modulo
then adds a full turn. So each word is also tried with the heading of its middle piece equal to that of the
start and of the goal, and whatever is tried is accepted by where it ends, never by the signs that led to it.
"""

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.pose import Array, compose, exp
from .checked import checked_radius, finite_poses, shaped_poses

# A path is accepted if it ends within this of the goal, per (radius + city-block distance of start and goal).
# The heading is always met. It lies above the rounding of sane input and below the 1e-9 that is promised.
TOLERANCE = 4e-10
SENSE = {"L": 1.0, "S": 0.0, "R": -1.0}
_MIRROR = str.maketrans("LR", "RL")


@dataclass(frozen=True, eq=False)
class DubinsPath:
    """A shortest path.

    Attributes:
        word: its three pieces, such as "LSR"; L turns left (counter-clockwise), R right, S goes straight.
        lengths: of the pieces, shape (3,), none negative [m].
        start: pose, shape (3,) [m, m, rad].
        radius: of the turns [m].
    """

    word: str
    lengths: Array
    start: Array
    radius: float

    @property
    def length(self) -> float:
        """Of the whole path [m]."""
        return float(np.sum(self.lengths))

    @property
    def end(self) -> Array:
        """The pose at the end, found by driving the path, shape (3,)."""
        return self.pose_at(self.length)

    def pose_at(self, distance: ArrayLike) -> Array:
        """Poses after driving distances of shape (...) [m], shape (..., 3); clipped to the path."""
        left = np.asarray(distance, dtype=float)
        pose = np.broadcast_to(self.start, (*left.shape, 3))
        for letter, length in zip(self.word, self.lengths, strict=True):
            driven = np.clip(left, 0.0, length)
            pose = compose(pose, exp(driven[..., None] * np.array([1.0, 0.0, SENSE[letter] / self.radius])))
            left = left - driven
        return pose


def shortest_path(start: ArrayLike, goal: ArrayLike, radius: float) -> DubinsPath:
    """The shortest path from one pose to another with turns no tighter than the radius.

    Args:
        start, goal: poses (x, y, heading), shape (3,) [m, m, rad]; the heading is the direction of travel.
        radius: > 0 [m].

    Returns:
        A path that ends within 1e-9 (radius + distance) of the goal, with no negative piece.

    Raises:
        InputError: for poses of another shape or not finite, or a radius that is not positive and finite (from 1e-100
            to 1e9 m).

    >>> path = shortest_path([0, 0, 0], [3, 0, 0], 1.0)
    >>> path.lengths.round(9).tolist()
    [0.0, 3.0, 0.0]
    >>> shortest_path([1, 2, 3], [1, 2, 3], 0.1).length
    0.0
    """
    X, Y = finite_poses(start, "start"), finite_poses(goal, "goal")
    for name, pose in (("start", X), ("goal", Y)):
        if pose.shape != (3,):
            raise InputError(f"the {name} is one pose (x, y, heading)", value=pose.shape)
    word, arcs = _shortest(X, Y, checked_radius(radius))
    return DubinsPath(word, radius * np.array(arcs), X, float(radius))


def shortest_length(starts: ArrayLike, goals: ArrayLike, radius: float) -> Array:
    """Lengths of the shortest paths between many poses, compiled [m].

    Args:
        starts, goals: poses of shape (..., 3); leading axes broadcast, so starts[:, None] and goals[None]
        make a table.
        radius: > 0 [m].

    Returns:
        Array of the broadcast leading shape. One pair alone is not worth a compiler and takes the plain way.

    Raises:
        InputError: as in shortest_path.

    >>> float(shortest_length([0, 0, 0], [0, 2, np.pi], 1.0)) == np.pi
    True
    """
    from .lengths import dubins_lengths

    X, Y = shaped_poses(starts, "starts"), shaped_poses(goals, "goals")
    if X.ndim == Y.ndim == 1:
        return np.asarray(shortest_path(X, Y, radius).length)
    return dubins_lengths(X, Y, radius)


def _shortest(start: Array, goal: Array, radius: float) -> tuple[str, tuple[float, float, float]]:
    """Word and arcs of the shortest path, in units of the radius."""
    w = complex(*(goal[:2] - start[:2])) * cmath.exp(-1j * start[2]) / radius
    delta = float(goal[2] - start[2]) % math.tau
    tolerance = TOLERANCE * (1 + abs(w.real) + abs(w.imag))
    candidates = [(word, arcs) for word, arcs in _words(w, delta) if abs(_end(word, arcs) - w) <= tolerance]
    return min(candidates, key=lambda candidate: sum(candidate[1]))


def _words(w: complex, delta: float) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """All candidates from (0, 0, 0) to (w, delta). Words with R first are mirror images of those with L."""
    yield from _left_words(w, delta)
    for word, arcs in _left_words(w.conjugate(), -delta % math.tau):
        yield word.translate(_MIRROR), arcs


def _left_words(w: complex, delta: float) -> Iterator[tuple[str, tuple[float, float, float]]]:
    e = cmath.exp(1j * delta)
    D = (w + 1j * e) - 1j  # from the left circle of the start to that of the goal
    straight = abs(D)
    for heading in (cmath.phase(D), 0.0, delta):
        yield "LSL", (heading % math.tau, straight, (delta - heading) % math.tau)

    # The middle circle touches both from outside; the arc on it takes the long way round ([Shkel2001]).
    apex = 2 * np.arcsin(min(1.0, straight / 4))
    middle = math.tau - apex
    for heading in (cmath.phase(D) + middle / 2, 0.0, delta + middle):
        yield "LRL", (heading % math.tau, middle, (delta + middle - heading) % math.tau)

    D = (w - 1j * e) - 1j  # to the right circle of the goal: D = (straight - 2i) exp(i heading)
    straight = max(0.0, abs(D) ** 2 - 4) ** 0.5
    for heading in (cmath.phase(D * (straight + 2j)), 0.0, delta):
        yield "LSR", (heading % math.tau, straight, (heading - delta) % math.tau)


def _end(word: str, arcs: tuple[float, float, float]) -> complex:
    """Where a car of unit radius ends that starts at 0 along the real axis."""
    position, direction = 0j, 1 + 0j
    for letter, arc in zip(word, arcs, strict=True):
        if letter == "S":
            position += arc * direction
        else:
            centre = position + 1j * SENSE[letter] * direction
            turn = cmath.exp(1j * SENSE[letter] * arc)
            position, direction = centre + (position - centre) * turn, direction * turn
    return position
