"""A query as the kernels among obstacles see it."""

from typing import NamedTuple

import numpy as np

from ..geometry.collision.world import WorldArrays
from ..geometry.pose import Array

# How many points are corners, and a circle around all points, in O [m].
HULL = np.dtype([("corners", "i8"), ("x", "f8"), ("y", "f8"), ("reach", "f8")], align=True)


class QueryArrays(NamedTuple):
    """A query as kernels see it; the first axis is the push.

    Attributes:
        world: bounds and obstacles.
        points, hulls: object and fingertips; tips, hands: the fingertips alone. Of POINT (k, n) and HULL (k,).
        backs: where the fingertips land, from where they push, in O, shape (k, 2) [m].
        cars: of six_words.CAR, shape (k,).
        switching: cost of changing from one push to another, shape (k, k).
        last: whether a push may end at the goal, shape (k,).
        offsets: displacements of switch poses for the cost of replanning, shape (16, 3) [m, m, rad]; none where a path
            is judged by its own cost.
        goal, slack: where a path ends, and how far from that it may, half a turn for any angle; both (3,) [m, rad].
        need, room, inside: Query.clearance, Query.room, Query.inside.
    """

    world: WorldArrays
    points: np.ndarray
    hulls: np.ndarray
    tips: np.ndarray
    hands: np.ndarray
    backs: Array
    cars: np.ndarray
    switching: Array
    last: np.ndarray
    offsets: Array
    goal: Array
    slack: Array
    need: float
    room: float
    inside: bool
