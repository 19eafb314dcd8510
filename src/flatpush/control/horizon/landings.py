"""Where to land next: the first push of the best path of many pushes, with the cars as they are known now."""

from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from ...geometry.pose import Array
from ...planning.path import Path
from ...planning.query import Query
from ...steering.fleet import Fleet
from .contact_car import ContactCar
from .push_path import PushPath


class Landing(NamedTuple):
    """The push to begin with, X_WO where it shall end, and the length of its flat path [m]; among things, its path."""

    push: int
    target: Array
    length: float
    path: PushPath | None = None


def next_push(
    cars: Sequence[ContactCar | None], pose: Array, goal: Array, switching: float, seed: int = 0
) -> Landing | None:
    """The push to begin with where nothing is in the way; None if no push has a car.

    Args:
        cars: of the pushes; None where one cannot be steered.
        pose, goal: X_WO; the goal's angle is NaN where any will do.
        switching: what another landing costs [m]. seed: of the search.
    """
    usable = [k for k, car in enumerate(cars) if car is not None]
    if not usable:
        return None
    fleet = fleet_of_contacts([car for car in cars if car is not None], switching)
    query = Query(fleet, pose, np.nan_to_num(goal), free=bool(np.isnan(goal[2])))
    path = free_path(query, seed)
    first = PushPath.of(path, 0.0)
    return Landing(usable[path.pushes[0]], first.poses[-1], float(first.left[0]))


def free_path(query: Query, seed: int) -> Path:
    """The best path of a query that one round finds where nothing is in the way."""
    from ...planning.refine import improvements  # its kernels are needed by no other controller

    *_, best = islice(improvements(query, seed=seed), 2)
    pieces = [
        (int(push), "LSR".index(letter), float(amount))
        for push, word, amounts in zip(best.pushes, best.words, best.amounts, strict=True)
        for letter, amount in zip(word, amounts, strict=True)
    ]
    return Path.of(query.fleet, query.start, pieces)


def fleet_of_contacts(cars: Sequence[ContactCar], switching: float) -> Fleet:
    """The cars of contacts side by side; a change costs as much as `switching` [m] of the flat path."""
    centres, n = np.array([car.centres for car in cars]), len(cars)
    radii = np.array([car.radius for car in cars])
    return Fleet(
        centres[:, 0],
        centres[:, 1],
        np.array([car.model.direction for car in cars]),
        np.stack([radii, np.ones(n), radii], axis=1),
        np.full((n, 3), np.inf),
        np.full((n, 3), np.inf),
        np.where(np.eye(n) > 0, 0.0, switching),
    )
