"""What is asked of poses and radii that are given to the steering; each raises InputError in the caller's terms."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import is_number, numbers
from ..errors import InputError
from ..geometry.pose import Array

# Radii that are told apart from nothing and from a straight line [m]: below, squares underflow; above, the tolerance
# of where a path ends is more than a metre, so that poses beside each other would count as one.
RADII = 1e-100, 1e9


def finite_poses(values: ArrayLike, name: str) -> Array:
    """Finite poses of shape (..., 3)."""
    poses = shaped_poses(values, name)
    if not np.isfinite(poses).all():
        raise InputError(f"{name}: poses are finite", value=poses[~np.isfinite(poses).all(axis=-1)])
    return poses


def shaped_poses(values: ArrayLike, name: str) -> Array:
    """Poses of shape (..., 3), finite or not."""
    poses = numbers(values, f"{name}: poses are numbers (x, y, heading)")
    if poses.ndim == 0 or poses.shape[-1] != 3:
        raise InputError(f"{name}: poses have the shape (..., 3)", value=poses.shape)
    return poses


def checked_radius(radius: float) -> float:
    """A turning radius [m]."""
    if not is_number(radius):
        raise InputError("the radius is a number", value=radius)
    if not RADII[0] <= radius <= RADII[1]:
        raise InputError(
            f"the radius is positive and finite [m], from {RADII[0]:g} to {RADII[1]:g}", value=radius
        )
    return float(radius)
