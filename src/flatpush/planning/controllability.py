"""Whether a set of pushes can move the object freely, or reaches poses by detours only ([Lynch1996] Props. 1-4)."""

from collections.abc import Sequence
from itertools import combinations
from typing import Literal

import numpy as np

from ..geometry import shift_twist
from ..geometry.pose import Array
from ..steering.car import Car

Controllability = Literal["free", "detours", "none"]

WORDS = {
    "free": "these pushes move the object freely: any small displacement is reached by small motions",
    "detours": "these pushes reach every pose, but some near ones only by a detour",
    "none": "no push can steer the object",
}


def controllability(cars: Sequence[Car]) -> Controllability:
    """What the cars of an object can do together.

    "free" is small-time local controllability: the twists positively span a great circle of the velocity sphere that
    is not ω = 0 ([Lynch1996] Prop. 4), that is, the largest linear space inside their cone has two dimensions or more.
    It is never the plane of translations alone: with that a car's turn to one side undoes its turn to the other. Any
    single car already reaches every pose ("detours", Props. 1-2).
    """
    if not cars:
        return "none"
    length = float(np.mean([car.radius for car in cars]))
    twists = np.array([shift_twist(V, car.cof) for car in cars for V in (car.left, car.straight, car.right)])
    rays = twists * [1.0, 1.0, length]
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    both_ways = rays[_inside(rays, -rays)]
    if len(both_ways) == 0:
        return "detours"
    rank = int(np.linalg.matrix_rank(both_ways, tol=1e-6))
    return "free" if rank >= 2 else "detours"


def _inside(rays: Array, vectors: Array) -> Array:
    """Which vectors (m, 3) lie in the closed cone of the rays (n, 3): by Carathéodory, over all triples and pairs."""
    found = np.zeros(len(vectors), dtype=bool)
    for size in (2, 3):
        groups = np.array(list(combinations(range(len(rays)), size)))
        G = np.moveaxis(rays[groups], 1, 2)  # (g, 3, size)
        weights = np.linalg.pinv(G, rcond=1e-9) @ vectors.T
        miss = np.linalg.norm(G @ weights - vectors.T, axis=1)
        found |= np.any((miss < 1e-9) & np.all(weights > -1e-9, axis=1), axis=0)
    return found
