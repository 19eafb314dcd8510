"""Whether what every plan assumes holds: that friction decides and not inertia, and that the object does not tip."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import is_finite, vector
from ..errors import InputError
from ..friction import Support
from ..friction.pressure import Edges, Feet, Round

GRAVITY = 9.81  # [m/s²]
# An object that coasts less than this is pushed quasi-statically; plans are checked to the same [m].
COASTS = 5e-5


def coasting(speed: float, table_friction: float) -> float:
    """How far [m] an object slides on when the pusher stops at once: v² / (2 μ g).

    Args:
        speed: of the object [m/s]. table_friction: Coulomb coefficient between object and table.

    Raises:
        InputError: for a speed that is negative or friction that is not positive.

    >>> round(1000 * coasting(0.02, 0.25), 3)  # mm
    0.082
    """
    if not (is_finite(speed) and speed >= 0):
        raise InputError("a speed is finite and 0 or more", key="speed", value=speed)
    return speed**2 / (2 * _positive(table_friction) * GRAVITY)


def quasi_static_speed(table_friction: float) -> float:
    """The speed [m/s] below which an object coasts less than COASTS."""
    return float(np.sqrt(2 * _positive(table_friction) * GRAVITY * COASTS))


def tipping_height(support: Support, direction: ArrayLike, table_friction: float) -> float:
    """The height [m] above the table at and above which a push tips the object instead of sliding it: d / μ.

    At a height h the moment of the force that slides the object, μ times its weight, moves the pressure forward by μ h;
    it tips when that reaches the border of the convex hull of the support, at the distance d ahead of the centre of
    friction. The centre of mass is taken to lie above that.

    Args:
        direction: of the push, in the frame of the support, shape (2,), any length.
        table_friction: as for coasting.

    Raises:
        InputError: for a direction without length, or friction that is not positive.

    >>> side = Support.polygon([(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)])
    >>> round(1000 * tipping_height(side, [0.0, 1.0], 0.5), 6)  # mm
    35.0
    """
    import shapely

    friction = _positive(table_friction)
    along = vector(direction, 2, "a direction is [x, y], finite numbers")
    length = float(np.hypot(*along))
    if length == 0:
        raise InputError("a direction has a length", value=direction)
    pressure = support.pressure
    if isinstance(pressure, Round):
        return pressure.radius / friction
    if not isinstance(pressure, Feet | Edges):
        raise InputError("the border of this pressure is not known", value=type(pressure).__name__)
    points = pressure.points if isinstance(pressure, Feet) else pressure.vertices
    ray = shapely.LineString([(0.0, 0.0), 3 * support.radius * along / length])
    return float(shapely.MultiPoint(points).convex_hull.intersection(ray).length) / friction


def _positive(table_friction: float) -> float:
    if not (is_finite(table_friction) and table_friction > 0):
        raise InputError(
            "friction between object and table is finite and positive",
            key="table_friction",
            value=table_friction,
        )
    return table_friction
