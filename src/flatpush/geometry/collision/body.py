"""A rigid body of an outline and discs, as the arrays that collision checks work on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..outline import Outline
from ..pose import Array


@dataclass(frozen=True, eq=False)
class Body:
    """An outline with discs that move along with it, such as the fingertips of a push; all in the frame O.

    Attributes:
        outline: polygon, convex or not, or circle.
        discs: centres, shape (k, 2) [m]; radius: of each disc [m]. They may touch or overlap the outline.
    """

    outline: Outline
    discs: Array
    radius: float = 0.0

    @classmethod
    def of(cls, outline: Outline, discs: ArrayLike = (), radius: float = 0.0) -> "Body":
        return cls(outline, np.asarray(discs, dtype=float).reshape(-1, 2), float(radius))

    @cached_property
    def arrays(self) -> tuple[Array, tuple[int, float, float, float]]:
        """What the kernels take.

        Points (n, 4): the corners, then the discs (a round outline is one), rows (x, y, radius, 1/length² of the
        edge that follows); and (number of corners, x, y, radius of a circle around it all).
        """
        corners = self.outline.vertices
        inverse = 1.0 / np.sum((np.roll(corners, -1, axis=0) - corners) ** 2, axis=1)
        rows = [np.column_stack([corners, np.zeros(len(corners)), inverse])]
        if self.outline.is_circle:
            rows.append(np.array([[*self.outline.centre, self.outline.radius, 0.0]]))
        k = len(self.discs)
        rows.append(np.column_stack([self.discs, np.full(k, self.radius), np.zeros(k)]))
        points = np.ascontiguousarray(np.concatenate(rows))
        middle = 0.5 * (points[:, :2] - points[:, 2:3]).min(axis=0) + 0.5 * (
            points[:, :2] + points[:, 2:3]
        ).max(axis=0)
        reach = float(np.max(np.linalg.norm(points[:, :2] - middle, axis=1) + points[:, 2]))
        return points, (len(corners), float(middle[0]), float(middle[1]), reach)
