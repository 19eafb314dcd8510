"""Arrays as the lists of numbers that a page is told."""

import numpy as np
from numpy.typing import ArrayLike


def plain(values: ArrayLike, digits: int) -> list[object]:
    """Rounded, no zero of them negative."""
    return np.round(np.asarray(values, dtype=float) + 0.0, digits).tolist()
