"""Where to land next: the first push of the best way of many pushes, with the cars as they are known now."""

from collections.abc import Sequence
from itertools import islice

import numpy as np

from ...geometry.pose import Array
from ...planning.query import Query
from ...steering.fleet import Fleet
from .contact_car import ContactCar


def next_push(
    cars: Sequence[ContactCar | None], pose: Array, goal: Array, switching: float, seed: int = 0
) -> tuple[int, Array, float] | None:
    """The push to begin with, X_WO where it shall end, and the length of its flat path; None if no push has a car.

    Args:
        cars: of the pushes; None where one cannot be steered.
        pose, goal: X_WO; the goal's angle is NaN where any will do.
        switching: what another landing costs [m]. seed: of the search.
    """
    from ...planning.refine import improvements  # its kernels are needed by no other controller

    usable = [k for k, car in enumerate(cars) if car is not None]
    if not usable:
        return None
    known = [car for car in cars if car is not None]
    centres = np.array([car.centres for car in known])
    radii = np.array([car.radius for car in known])
    n = len(known)
    fleet = Fleet(
        centres[:, 0],
        centres[:, 1],
        np.array([car.model.direction for car in known]),
        np.stack([radii, np.ones(n), radii], axis=1),
        np.full((n, 3), np.inf),
        np.full((n, 3), np.inf),
        np.where(np.eye(n) > 0, 0.0, switching),
    )
    query = Query(fleet, pose, np.nan_to_num(goal), free=bool(np.isnan(goal[2])))
    *_, best = islice(improvements(query, seed=seed), 2)
    i = int(best.pushes[0])
    weights = dict(zip("LSR", (radii[i], 1.0, radii[i]), strict=True))
    length = sum(weights[x] * float(a) for x, a in zip(best.words[0], best.amounts[0], strict=True))
    return usable[i], best.poses[1], length
