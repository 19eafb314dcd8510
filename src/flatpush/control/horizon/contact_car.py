"""The car of one finger where it now touches, in closed form: cheap enough for every tick."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...contact import kept_angle
from ...geometry import perpendicular
from ...geometry.pose import Array
from ..laws.steering_model import SteeringModel
from .turning import Turning

# The contact has to lie so far from the centre of friction, by the tip's own size of it, to have an axle.
_LEAST = 1e-9
# Turns at which the drift is computed.
_SAMPLES = 21


@dataclass(frozen=True, eq=False)
class ContactCar:
    """What a finger at a contact makes of an object that slides under diag(1, 1, 1/ρ) about a centre of friction.

    With φ the angle of the force from the way to the centre of friction, counter-clockwise, r the distance to it and β
    the angle of the inward normal, the object turns about the point ρ/r beyond the centre and -ρ cot φ / r to the left
    (docs/errata.md, general closed forms); the contact sticks while |φ - β| ≤ arctan μ. Other limit surfaces have their
    own function of φ in place of the tangent, see Turning.

    Attributes:
        model: flat point midway between the turning centres with the reserve; its turns are the limits.
        radius: turning radius with the reserve [m]. reserve: the fraction of μ that this is.
        contact, normal: of the outline, in O, shape (2,).
        leeway: angle from the straight force to the nearer edge of the friction cone, by the cone's half angle: 1 in
            its middle, 0 on an edge.
    """

    model: SteeringModel
    radius: float
    reserve: float
    contact: Array
    normal: Array
    leeway: float
    _force: tuple[float, float, float]  # ρ/r, the flat point's way to the left of the centre, β
    _turning: Turning | None

    @property
    def centres(self) -> Array:
        """Turning centres with the reserve, left and right, in O, shape (2, 2)."""
        n = self.radius * perpendicular(self.model.direction)
        return np.stack([self.model.flat_point + n, self.model.flat_point - n])

    def ratio(self, curvature: float) -> float:
        """|tangential| / normal force that a turn per length of the flat path asks for."""
        level, along, beta = self._force
        tangent = 0.0 if curvature == 0 else -level / (1 / curvature + along)
        phi = math.atan(tangent) if self._turning is None else float(self._turning.angle(tangent, beta))
        return abs(math.tan(phi - beta))


def contact_car(
    contact: ArrayLike,
    normal: ArrayLike,
    cof: ArrayLike,
    rho: float,
    friction: float,
    tip_radius: float,
    *,
    reserve: float = 0.4,
    edge: float = 0.2,
    turning: Turning | None = None,
    turns: bool = True,
) -> ContactCar | None:
    """The car of a contact, or None where it cannot turn both ways.

    Args:
        contact, normal: point of the outline and inward unit normal there, in O, shape (2,).
        cof: centre of friction in O, shape (2,). rho: a/b [m²].
        friction: between finger and object.
        reserve: fraction of μ that plans keep in reserve.
        edge: the same fraction for what feedback may use.
        turning: of a limit surface that is no ellipsoid.
        turns: whether the pusher turns with the object.

    >>> car = contact_car([0, -0.02], [0, 1], [0, 0], 2e-4, 0.5, 0.0, reserve=0.0, edge=0.0)
    >>> round(car.radius, 9), car.model.flat_point.round(9).tolist()  # ρ/(μ r), (0, ρ/r)
    (0.02, [0.0, 0.01])
    """
    px, py = (float(v) for v in np.asarray(contact, dtype=float))
    nx, ny = (float(v) for v in np.asarray(normal, dtype=float))
    cx, cy = (float(v) for v in np.asarray(cof, dtype=float))
    dx, dy = cx - px, cy - py
    r = math.hypot(dx, dy)
    half = math.atan(friction)
    if r < _LEAST or rho <= 0:
        return None
    hx, hy = dx / r, dy / r
    beta = math.atan2(hx * ny - hy * nx, hx * nx + hy * ny)
    left, right = beta + half, beta - half  # angles of the forces on the edges of the cone
    if not right < 0 < left or max(left, -right) >= 0.5 * math.pi:
        return None
    level = rho / r

    # With its reserve the cone must still hold the force that pushes straight.
    if abs(beta) >= kept_angle(friction, max(reserve, edge)):
        return None

    def centres(margin: float) -> tuple[float, float] | None:
        kept = kept_angle(friction, margin)
        low, high = (
            math.tan(a) if turning is None else turning.tangent(a) for a in (beta - kept, beta + kept)
        )
        return (-level / low, -level / high) if low < 0 < high else None

    planned, limits = centres(reserve), centres(edge)
    if planned is None or limits is None:
        return None
    along, radius = 0.5 * (planned[0] + planned[1]), 0.5 * (planned[0] - planned[1])
    if not limits[1] < along < limits[0]:
        return None
    most_left, most_right = 1 / (limits[0] - along), 1 / (along - limits[1])
    drift = None
    if turning is not None:
        turn = np.linspace(-most_right, most_left, _SAMPLES)
        tangents = -level * turn / (1 + turn * along)
        drift = turning.drift(tangents, beta) / (1 + tangents * along / level)
    point = np.array([cx + level * hx - along * hy, cy + level * hy + along * hx])
    pusher = np.array([px - tip_radius * nx, py - tip_radius * ny, math.atan2(ny, nx)])
    model = SteeringModel(
        point,
        math.atan2(hy, hx),
        most_left,
        most_right,
        np.array([px, py]),
        pusher,
        turns,
        drift,
    )
    return ContactCar(
        model,
        radius,
        reserve,
        np.array([px, py]),
        np.array([nx, ny]),
        min(left, -right) / half,
        (level, along, beta),
        turning,
    )
