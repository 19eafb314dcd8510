"""Poses for the graph: spread evenly over a region, denser near the goal."""

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array, wrap_angle

# Shares of the poses and how far they lie from the goal, as a fraction of the way to the region's border and
# of half a turn.
RINGS = ((0.5, 1.0), (0.3, 0.5), (0.2, 0.2))
GOLDEN = 1.2207440846057596  # x⁴ = x + 1: its powers make the most even additive sequence in three axes


def pose_samples(count: int, goal: ArrayLike, region: float | ArrayLike, seed: int = 0) -> Array:
    """Poses around a goal: an additive low-discrepancy sequence (the R₃ sequence), shifted by a seed.

    Half of them fill the region with all headings, the others boxes around the goal that are half and a fifth
    as large in each coordinate. The first poses of a longer list are those of a shorter one.

    Args:
        count: how many, ≥ 0.
        goal: pose, shape (3,).
        region: half the side of a square about the goal [m], or bounds xmin, ymin, xmax, ymax that contain the goal.
        seed: the same seed, the same poses.

    Returns:
        shape (count, 3), angles in (-π, π].

    Raises:
        InputError: if the goal is not finite or not inside the region, or the count is negative.

    >>> pose_samples(4, [0, 0, 0], 0.2).shape
    (4, 3)
    """
    centre = np.asarray(goal, dtype=float)
    if centre.shape != (3,) or not np.all(np.isfinite(centre)):
        raise InputError("a goal is three finite numbers", value=goal)
    if count < 0:
        raise InputError("the number of poses is 0 or more", value=count)
    bounds = np.asarray(region, dtype=float)
    rule = "the region is half a side or four bounds, finite, and contains the goal"
    if bounds.shape not in ((), (4,)) or not np.all(np.isfinite(bounds)):
        raise InputError(rule, value=region)
    if bounds.ndim == 0:
        bounds = np.concatenate([centre[:2] - bounds, centre[:2] + bounds])
    low, high = bounds[:2] - centre[:2], bounds[2:] - centre[:2]
    if not np.all((low <= 0) & (high >= 0) & (low < high)):
        raise InputError(rule, value=region)

    steps = GOLDEN ** -np.arange(1.0, 4.0)
    shift = np.random.default_rng(seed).random(3)
    which = np.searchsorted(np.cumsum([share for share, _ in RINGS]), _spread(count), side="right")
    size = np.array([size for _, size in RINGS])[which]
    order = np.empty(count)  # each ring goes through the sequence on its own
    for ring in range(len(RINGS)):
        mine = which == ring
        order[mine] = np.arange(np.count_nonzero(mine))
    unit = np.remainder((order[:, None] + 1.0) * steps + shift + 0.5 * which[:, None], 1.0)
    box_low, box_high = np.append(low, -np.pi), np.append(high, np.pi)
    poses = centre + size[:, None] * (box_low + unit * (box_high - box_low))
    poses[:, 2] = wrap_angle(poses[:, 2])
    return poses


def _spread(count: int) -> Array:
    """0.5, then evenly on between 0 and 1: deals the poses out to the rings in turn."""
    return np.remainder(0.5 + np.arange(count) * 0.6180339887498949, 1.0)
