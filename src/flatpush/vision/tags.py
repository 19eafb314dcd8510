"""AprilTags of the family 36h11: how one looks, and where they are in a picture."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry.pose import Array
from .extra import apriltags

Picture = NDArray[np.uint8]

FAMILY = "tag36h11"
# Sides of a tag in cells: of its black border, whose outside is its size, and with the white rim around it.
BLACK, WHOLE = 8, 10
# Lines are sought in a picture of half the size; edges are then refined in the whole.
DECIMATE = 2.0
# AprilTag has the middle of the first pixel at (0.5, 0.5).
HALF_PIXEL = 0.5
# A tag is believed if at most so many of its 36 bits are wrong and its cells are told apart so well [grey levels].
# Any two tags differ in 11 bits or more; with 1 wrong bit a random square passes for a given tag in 4 · 37 of 2³⁶.
WRONG_BITS, CONTRAST = 1, 15.0


@dataclass(frozen=True, eq=False)
class Detected:
    """A tag in a picture.

    Attributes:
        id: its number. corners: of its black border, in the order of CORNERS, shape (4, 2) [px].
        contrast: how well its cells are told apart [grey levels].
    """

    id: int
    corners: Array
    contrast: float


# Corners of a tag of size 1 in its own frame, x right and y up as it is printed, in the order of Detected.corners.
CORNERS = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


@lru_cache(maxsize=1)
def _codes() -> tuple[list[int], list[tuple[int, int]]]:
    """Codes of all tags, and the place (x, y) of each bit in the black border, y down."""
    family = _detector().tag_families[FAMILY].contents
    bits = [(family.bit_x[k], family.bit_y[k]) for k in range(family.nbits)]
    return [family.codes[k] for k in range(family.ncodes)], bits


@lru_cache(maxsize=1)
def _detector():  # type: ignore[no-untyped-def]  # a library without types
    return apriltags().Detector(families=FAMILY, nthreads=1, quad_decimate=DECIMATE, refine_edges=1)


def count() -> int:
    """How many tags the family has."""
    return len(_codes()[0])


def cells(number: int) -> NDArray[np.bool_]:
    """Which cells of a tag are white, as it is printed: rows from the top, shape (10, 10), the white rim included.

    Raises:
        InputError: for a number that no tag has.
    """
    codes, places = _codes()
    if not 0 <= number < len(codes):
        raise InputError(f"tags of {FAMILY} have numbers from 0 to {len(codes) - 1}", key="tag", value=number)
    white = np.ones((WHOLE, WHOLE), dtype=bool)
    white[1:-1, 1:-1] = False
    for k, (x, y) in enumerate(places):
        white[y + 1, x + 1] = codes[number] >> (len(places) - 1 - k) & 1
    return white


def detect(picture: Picture, window: tuple[int, int, int, int] | None = None) -> list[Detected]:
    """The tags in a grey picture, shape (height, width), or in a window (left, top, right, bottom) of it [px]."""
    left, top, right, bottom = window or (0, 0, picture.shape[1], picture.shape[0])
    part = np.ascontiguousarray(picture[top:bottom, left:right])
    found = []
    for one in _detector().detect(part):
        if one.hamming <= WRONG_BITS and one.decision_margin >= CONTRAST:
            corners = np.asarray(one.corners, dtype=float) + np.array([left - HALF_PIXEL, top - HALF_PIXEL])
            found.append(Detected(int(one.tag_id), corners, float(one.decision_margin)))
    return found
