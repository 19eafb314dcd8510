"""Steering a car to a place with any last heading, or with one of an interval: which heading is the cheapest.

For one car the cost of the cheapest word, as a function of the angle θ with which it ends at a place X, is smooth
but where a piece of a word vanishes, and there it may jump by a full turn. So the least is either

* at the end of a word of two pieces, of which there are at most a dozen, in closed form (complex numbers, the start is
  the identity, c is the centre of an arc, d the straight direction; lengths give one amount, arguments the rest):

      arc A, straight:  X - c_A = exp(iα) (t d - c_A)
      straight, arc B:  X - c_B - t d = -exp(iβ) c_B
      arc A, arc B:     X - c_A = exp(iα) (c_B - c_A - exp(iβ) c_B)

* or where the cost is stationary. The force of the maximum principle then passes through the object's origin at X,
  because turning about it is free. For arc A, straight, arc A with weights w_A and w_S per radian and metre it is
  parallel to the straight piece, whose line has the distance w_A / w_S from the centre: closed form again. For a Dubins
  car and a place of its flat point, w_A / w_S is the radius, the last arc vanishes, and what is left are CS and CC
  ([Bui1994]). For the other words, and costs with a time law, the stationary headings are bracketed among HEADINGS and
  closed in on.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..geometry.pose import Array, wrap_angle
from .fleet import Fleet

Complex = NDArray[np.complexfloating]
HEADINGS = 72  # headings that are compared before the best are closed in on
BRACKETS = 3  # how many of them are
ROUNDING = 1e-12  # part of a cost by which a heading must be cheaper than one in closed form
ZOOM, LEVELS = (
    16,
    5,
)  # each level divides a bracket by so much: after five it is below 1e-7 rad, the cost's error 1e-14


def cheapest_headings(
    fleet: Fleet, start: ArrayLike, places: ArrayLike, about: float = 0.0, within: float = np.pi
) -> tuple[Array, Array]:
    """For every car the cheapest heading with which it brings the object's origin to each of some places.

    Args:
        fleet: k cars, with the rates and time laws that say what their motions cost.
        start: pose X_WO, shape (3,) [m, m, rad].
        places: of the origin of O on the table, shape (m, 2) [m].
        about, within: the heading is within this much of that, up to half a turn [rad].

    Returns:
        costs and headings θ of X_WO, shape (k, m): in the fleet's unit, and [rad]; no heading is cheaper.

    Raises:
        InputError: for poses of another shape or not finite, or an interval that is negative.
    """
    from .lengths import fleet_lengths

    X, Y = np.asarray(start, dtype=float), np.atleast_2d(np.asarray(places, dtype=float))
    if (
        X.shape != (3,)
        or Y.ndim != 2
        or Y.shape[1] != 2
        or not (np.isfinite(X).all() and np.isfinite(Y).all())
    ):
        raise InputError("a start is one finite pose, places are finite points of shape (m, 2)", value=places)
    if not within >= 0:
        raise InputError("headings lie within 0 or more of a heading", value=within)

    def costs(headings: Array) -> Array:
        """Of all cars at headings of shape (m, n), shape (k, m, n)."""
        poses = np.concatenate(
            [np.broadcast_to(Y[:, None], (*headings.shape, 2)), headings[..., None]], axis=2
        )
        return fleet_lengths(fleet, X, poses)

    within = min(within, np.pi)
    grid = about + within * np.linspace(-1.0, 1.0, HEADINGS + 1)
    special = np.concatenate([h for car in range(fleet.size) for h in _special(fleet, car, X, Y)], axis=0).T
    special = about + np.clip(wrap_angle(special - about), -within, within)
    tried = np.concatenate([special, np.broadcast_to(grid, (len(Y), len(grid)))], axis=1)
    found = costs(tried)
    at = np.argmin(found, axis=2)
    best = np.take_along_axis(found, at[..., None], axis=2)[..., 0]
    heading = np.take_along_axis(np.broadcast_to(tried, found.shape), at[..., None], axis=2)[..., 0]

    # The best of the grid, each closed in on for itself.
    step = 2 * within / HEADINGS
    places_of_best = np.argsort(found[..., -len(grid) :], axis=2, kind="stable")[..., :BRACKETS]
    middle = grid[places_of_best]  # (k, m, BRACKETS)
    for _ in range(LEVELS if step > 0 else 0):
        near = middle[..., None] + step * np.linspace(-1.0, 1.0, 2 * ZOOM + 1)
        near = np.clip(near, about - within, about + within)
        for car in range(fleet.size):
            values = costs(near[car].reshape(len(Y), -1))[car].reshape(near[car].shape)
            nearest = np.argmin(values, axis=2)[..., None]
            middle[car] = np.take_along_axis(near[car], nearest, axis=2)[..., 0]
            least = np.take_along_axis(values, nearest, axis=2)[..., 0]
            one = np.argmin(least, axis=1)[:, None]
            cheaper = np.take_along_axis(least, one, axis=1)[:, 0]
            better = cheaper < best[car] * (1 - ROUNDING)
            best[car] = np.where(better, cheaper, best[car])
            heading[car] = np.where(better, np.take_along_axis(middle[car], one, axis=1)[:, 0], heading[car])
        step /= ZOOM
    return best, heading


def _special(fleet: Fleet, car: int, start: Array, places: Array) -> Iterator[Array]:
    """Headings at places of shape (m, 2) where a piece vanishes or the cost is stationary, each of shape (n, m) [rad].

    Some belong to no word, because an amount is negative; comparing costs sorts them out.
    """
    turned = np.exp(-1j * start[2])
    X = ((places - start[:2]) @ np.array([1.0, 1.0j])) * turned
    d = complex(*fleet.direction[car])
    centres = {+1: complex(*fleet.left[car]), -1: complex(*fleet.right[car])}
    rates, linear = fleet.rates[car], bool(np.all(np.isinf(fleet.speeds[car])))
    for sense, a in centres.items():
        away = X - a  # from the centre of the start to the place
        along = (a * d.conjugate()).real
        for sign in (1.0, -1.0):
            # Arc, straight: t² - 2 t Re(c d̄) + |c|² - |X - c|² = 0.
            t = along + sign * _root(along**2 - abs(a) ** 2 + abs(away) ** 2)
            yield _angles(start, away, t * d - a)
            # Straight, arc.
            ahead = (away * d.conjugate()).real
            t = ahead + sign * _root(ahead**2 - abs(away) ** 2 + abs(a) ** 2)
            yield _angles(start, away - t * d, -a)
            # Arc, the other arc: a triangle of three known sides.
            b = centres[-sense]
            sides = 2 * abs(b - a) * abs(b)
            bend = np.arccos(
                np.clip((abs(b - a) ** 2 + abs(b) ** 2 - abs(away) ** 2) / max(sides, 1e-300), -1, 1)
            )
            last = np.exp(1j * (sign * bend + np.angle(b - a) - np.angle(b)))
            yield _angles(start, away * last, (b - a) - last * b)
            # Arc, straight, the same arc: the straight line passes at the distance w_A / w_S from the centre.
            if not linear or rates[1] == 0.0:
                continue
            side = -sense * rates[1 - sense] / rates[1]
            first = away * (_root(abs(away) ** 2 - side**2) - 1j * side)  # along d, turned by the first arc
            yield _angles(start, first * (sign * _root(abs(a) ** 2 - side**2) + 1j * side), -a)


def _root(square: Array) -> Array:
    return np.sqrt(np.maximum(square, 0.0))


def _angles(start: Array, to: Complex, of: Complex | complex) -> Array:
    """Headings on the table after a turn that takes one vector into the direction of another, shape (1, m)."""
    return (start[2] + np.angle(to * np.conj(of)))[None]
