"""How a finger moves to learn the steering of a push it knows nothing of."""

import numpy as np
from numpy.typing import ArrayLike

from ...geometry import rotate
from ...geometry.pose import Array


def probing_velocity(normal: ArrayLike, travelled: float, speed: float, swing: float, angle: float) -> Array:
    """Velocity (2,) of a finger that probes: along the inward normal, swung to its left and right in turn.

    Two motions of different curvature determine b (b = Y_1 × Y_2); the swing starts with half a stretch, so that the
    object weaves about its way.

    Args:
        normal: inward, shape (2,).
        travelled: so far [m].
        speed: [m/s].
        swing: length of one stretch [m].
        angle: of the swing [rad]; within the friction cone the contact sticks.
    """
    n = np.asarray(normal, dtype=float)
    side = 1.0 if int((travelled + 0.5 * swing) // swing) % 2 == 0 else -1.0
    return rotate(side * angle, speed * n / float(np.hypot(*n)))
