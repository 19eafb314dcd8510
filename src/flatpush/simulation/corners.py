"""Whether contacts went round a corner of the outline."""

import numpy as np
from numpy.typing import NDArray

from ..contact.placement import SMOOTH_CORNER
from ..geometry import Outline
from ..geometry.pose import Array

AT = 1e-7  # of the outline's size: so near to a corner a contact is on it


def passed_a_corner(outline: Outline, points: Array, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether a contact was on a sharp corner, or went from one side of it to the other, shape (n,).

    A corner at which the outline turns by less than contact.placement.SMOOTH_CORNER is not one.

    Args:
        points: of the outline, along the way of each finger, shape (n, m, k, 2) [m].
        touching: where the finger touches, shape (n, m, k).
    """
    if outline.is_circle:
        return np.zeros(len(points), dtype=bool)
    normals = outline.edge_normals
    turns = np.arccos(np.clip(np.einsum("ij,ij->i", np.roll(normals, 1, axis=0), normals), -1.0, 1.0))
    sharp = turns > SMOOTH_CORNER
    if not sharp.any():
        return np.zeros(len(points), dtype=bool)
    side_of_edge = np.cumsum(sharp)  # one number from sharp corner to sharp corner
    side_of_edge[side_of_edge == 0] = side_of_edge[-1]
    start, d = outline.edges[:, 0], outline.edges[:, 1] - outline.edges[:, 0]
    passed = np.zeros(len(points), dtype=bool)
    for run in range(len(points)):
        for finger in range(points.shape[2]):
            p = points[run, touching[run, :, finger], finger]
            if not len(p):
                continue
            offset = p[:, None] - start
            along = np.clip(np.einsum("mij,ij->mi", offset, d) / np.einsum("ij,ij->i", d, d), 0.0, 1.0)
            gaps = np.linalg.norm(offset - along[..., None] * d, axis=2)
            sides = side_of_edge[np.argmin(gaps, axis=1)]
            near = np.linalg.norm(p[:, None] - start[sharp], axis=2).min(axis=1) < AT * outline.size
            passed[run] |= bool(near.any() or np.any(sides != sides[0]))
    return passed
