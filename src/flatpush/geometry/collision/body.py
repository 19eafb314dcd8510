"""A rigid body of an outline and discs, as the arrays that collision checks work on."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..outline import Outline
from ..pose import Array

# A corner or a disc: place and radius [m], and 1/length² of the edge that follows the corner [1/m²].
POINT = np.dtype([("x", "f8"), ("y", "f8"), ("radius", "f8"), ("inverse", "f8")], align=True)


class BodyArrays(NamedTuple):
    """A body as kernels see it, in its own frame.

    Attributes:
        points: of POINT; corners: how many of them, the first ones, are corners.
        x, y, reach: middle and radius of a circle around it all [m].
    """

    points: np.ndarray
    corners: int
    x: float
    y: float
    reach: float


@dataclass(frozen=True, eq=False)
class Body:
    """An outline with discs that move along with it, such as the fingertips of a push; all in the frame O.

    Attributes:
        outline: polygon, convex or not, or circle.
        discs: centres of the discs, shape (k, 2) [m]; they may touch or overlap the outline.
        radius: of each disc [m].
    """

    outline: Outline
    discs: Array
    radius: float = 0.0

    @classmethod
    def of(cls, outline: Outline, discs: ArrayLike = (), radius: float = 0.0) -> "Body":
        """A body of an outline and discs, centres of shape (k, 2) [m] and one radius [m]."""
        return cls(outline, np.asarray(discs, dtype=float).reshape(-1, 2), float(radius))

    @cached_property
    def arrays(self) -> "BodyArrays":
        """What the kernels take: the corners, then the discs (a round outline is one)."""
        corners = self.outline.vertices
        k = len(corners)
        round_ = int(self.outline.is_circle)
        points = np.zeros(k + round_ + len(self.discs), POINT)
        points["x"][:k], points["y"][:k] = corners.T
        points["inverse"][:k] = 1.0 / np.sum((np.roll(corners, -1, axis=0) - corners) ** 2, axis=1)
        if round_:
            points["x"][k], points["y"][k] = self.outline.centre
            points["radius"][k] = self.outline.radius
        points["x"][k + round_ :], points["y"][k + round_ :] = self.discs.T
        points["radius"][k + round_ :] = self.radius
        places = np.column_stack([points["x"], points["y"]])
        radii = points["radius"][:, None]
        middle = 0.5 * (places - radii).min(axis=0) + 0.5 * (places + radii).max(axis=0)
        reach = np.max(np.linalg.norm(places - middle, axis=1) + points["radius"])
        return BodyArrays(points, k, float(middle[0]), float(middle[1]), float(reach))
