"""Sequences of pushes whose plans a bound is sought of, each with a box that holds where its legs end."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...geometry.pose import Array

MOST_LEGS = 3
SIDES = 3 * MOST_LEGS  # x, y, θ of the end of every leg


class Chains(NamedTuple):
    """Sequences of pushes, n of them.

    Attributes:
        legs: how many each has, shape (n,); pushes: their cars, shape (n, MOST_LEGS).
        switching: cost of the changes, shape (n,); least: what a plan costs at least, shape (n,).
        start: pose, shape (3,).
        middle, half: of the first box, shape (n, SIDES) [m, m, rad, ...].
        lever: cost of a side's unit, by which the longest side is found, shape (n, SIDES).
        at: reference points of the legs' ends, in the object frame, shape (n, MOST_LEGS, 2) [m].
    """

    legs: NDArray[np.int64]
    pushes: NDArray[np.int64]
    switching: Array
    least: Array
    start: Array
    middle: Array
    half: Array
    lever: Array
    at: Array


NO_CHAINS = Chains(
    legs=np.zeros(0, np.int64),
    pushes=np.zeros((0, MOST_LEGS), np.int64),
    switching=np.zeros(0),
    least=np.zeros(0),
    start=np.zeros(3),
    middle=np.zeros((0, SIDES)),
    half=np.zeros((0, SIDES)),
    lever=np.zeros((0, SIDES)),
    at=np.zeros((0, MOST_LEGS, 2)),
)
