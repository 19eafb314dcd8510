"""From the corners of a tag to the pose of the object that wears it, with its covariance, or why there is none."""

from dataclasses import dataclass

import numpy as np

from ..geometry import compose, inverse, perpendicular, rotate, transform
from ..geometry.pose import Array
from ..geometry.table_camera import TableCamera
from .tags import CORNERS, Detected
from .worn import Tag

# Standard deviation of a corner that is expected [px], and for how many corners' worth of evidence that counts.
CORNER, EXPECTED = 0.03, 5
# A corner has two coordinates; four corners leave so many beyond pose and size.
FREE = 4
# A blurred edge is seen beside where it is, and its neighbours alike: what all corners of a tag share [px].
SHARED = 0.05
# A square may look larger or smaller than it is by this share: more is another tag, or another height.
SIZE = 0.03
# Corners may miss the square by so much, root mean square, in parts of its side, and at least [px].
SQUARE, SQUARE_PX = 0.006, 0.25


@dataclass(frozen=True, eq=False)
class Sighting:
    """Where an object was seen.

    Attributes:
        stamp: of the exposure [s]. pose: X_WO, shape (3,) [m, m, rad].
        covariance: of that, from the scatter of the corners and a part that they share, shape (3, 3); errors of the
            calibration are not in it.
        middle, side: of the tag in the picture, (2,) and a number [px].
    """

    stamp: float
    pose: Array
    covariance: Array
    middle: Array
    side: float


@dataclass(frozen=True)
class Refused:
    """A tag that is not believed. why: in words. size: whether its size is what is wrong."""

    why: str
    size: bool = False


def sighting(camera: TableCamera, tag: Tag, seen: Detected, stamp: float) -> Sighting | Refused:
    """The object that wears a tag, from the tag's corners: the square of the tag's size that lies nearest to where they
    are on the plane of its height.

    Args:
        stamp: of the exposure [s].
    """
    corners = seen.corners
    # The corners on the plane, and how they move there with the picture.
    shifts = np.array([[0.0, 0.0], [0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]])
    placed = camera.on_plane(corners[None] + shifts[:, None], tag.height)
    at = placed[0]
    slopes = np.stack([placed[1] - placed[2], placed[3] - placed[4]], axis=-1)  # (4, 2, 2) [m/px]
    if not np.all(np.isfinite(placed)):
        return Refused("it is seen beyond the horizon of the table")
    pixel = float(np.sqrt(np.mean(np.abs(np.linalg.det(slopes)))))  # [m] of a pixel
    square = CORNERS * tag.size
    middle = at.mean(axis=0)
    spread = at - middle
    # The turn that brings the square nearest to the corners, and how much larger they are.
    c = float(np.sum(square * spread))
    s = float(np.sum(square[:, 0] * spread[:, 1] - square[:, 1] * spread[:, 0]))
    turn, grown = float(np.arctan2(s, c)), float(np.hypot(c, s) / np.sum(square**2))
    if abs(grown - 1) > SIZE:
        return Refused(
            f"tag {tag.number} looks {1000 * grown * tag.size:.2f} mm large at a height of {1000 * tag.height:g} mm,"
            f" not {1000 * tag.size:g} mm: its size or its height is another",
            size=True,
        )
    X_WT = np.array([*middle, turn])
    off = at - transform([*middle, turn], grown * square)
    rms = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
    if rms > max(SQUARE * tag.size, SQUARE_PX * pixel):
        return Refused(
            f"the corners of tag {tag.number} miss a square by {1000 * rms:.2f} mm: it is covered in part, or not flat"
        )
    variance = (EXPECTED * CORNER**2 + float(np.sum(off**2)) / pixel**2) / (EXPECTED + FREE)  # [px²]
    # Least squares over the corners: δ = M Σ Aᵀ (slopes · δpixels).
    A = np.zeros((4, 2, 3))
    A[:, 0, 0] = A[:, 1, 1] = 1.0
    A[:, :, 2] = perpendicular(rotate(turn, square))
    M = np.linalg.inv(np.einsum("kia,kib->ab", A, A))
    gain = np.einsum("ab,kib,kij->akj", M, A, slopes)
    of_tag = variance * np.einsum("akj,bkj->ab", gain, gain)
    of_tag += SHARED**2 * np.diag([pixel**2, pixel**2, (pixel / tag.size) ** 2])
    X_WO = compose(X_WT, inverse(tag.pose))
    # The object's origin is moved by the tag's turn.
    arm = perpendicular(X_WO[:2] - X_WT[:2])
    moved = np.eye(3)
    moved[:2, 2] = arm
    side = float(np.mean(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)))
    return Sighting(stamp, X_WO, moved @ of_tag @ moved.T, corners.mean(axis=0), side)
