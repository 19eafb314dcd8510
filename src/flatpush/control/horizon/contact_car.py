"""The car of one finger where it now touches, in closed form: cheap enough for every tick."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...contact import kept_angle
from ...geometry import cross, perpendicular, rotate, shift_twist, velocity_at
from ...geometry.pose import Array
from ...steering.car import Car
from ..laws.steering_model import SteeringModel

# The contact has to lie so far from the centre of friction, by the tip's own size of it, to have an axle.
_LEAST = 1e-9
# Places at which the drift is computed.
_SAMPLES = 21


@dataclass(frozen=True, eq=False)
class ContactCar:
    """What a finger at a contact makes of an object that slides under diag(1, 1, 1/ρ) about a centre of friction.

    With φ the angle of the force from the way to the centre of friction, counter-clockwise, r the distance to it and β
    the angle of the inward normal, the object turns about the point ρ/r beyond the centre and -ρ cot φ / r to the left
    (docs/errata.md, general closed forms); the contact sticks while |φ - β| ≤ arctan μ.

    Attributes:
        model: flat point midway between the turning centres with the reserve; its turns are the limits.
        radius: turning radius with the reserve [m].
        contact, normal: of the outline, in O, shape (2,).
        leeway: angle from the straight force to the nearer edge of the friction cone, by the cone's half angle: 1 in
            its middle, 0 on an edge.
    """

    model: SteeringModel
    radius: float
    contact: Array
    normal: Array
    leeway: float
    _force: tuple[float, float, float]  # ρ/r, the flat point's way to the left of the centre, β

    @property
    def centres(self) -> Array:
        """Turning centres with the reserve, left and right, in O, shape (2, 2)."""
        n = self.radius * perpendicular(self.model.direction)
        return np.stack([self.model.flat_point + n, self.model.flat_point - n])

    def ratio(self, curvature: float) -> float:
        """|tangential| / normal force that a turn per length of the flat path asks for."""
        level, along, beta = self._force
        phi = 0.0 if curvature == 0 else -math.atan(level / (1 / curvature + along))
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
    sides: tuple[float, float] = (1.0, 1.0),
    edges: tuple[float, float] = (1.0, 1.0),
    drift: Array | None = None,
    turns: bool = True,
) -> ContactCar | None:
    """The car of a contact, or None where it cannot turn both ways.

    Args:
        contact, normal: point of the outline and inward unit normal there, in O, shape (2,).
        cof: centre of friction in O, shape (2,). rho: a/b [m²].
        friction: between finger and object.
        reserve: fraction of μ that plans keep in reserve.
        edge: the same fraction for what feedback may use.
        sides, edges: how much farther than that the turning centres lie on the left and on the right, with the reserve
            and at the edge: limit surfaces are no ellipsoids. See sides_of.

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

    def centres(margin: float, share: tuple[float, float]) -> tuple[float, float]:
        kept = kept_angle(friction, margin)
        return -share[0] * level / math.tan(beta - kept), -share[1] * level / math.tan(beta + kept)

    far, near = centres(reserve, sides)
    along, radius = 0.5 * (far + near), 0.5 * (far - near)
    most_left, most_right = centres(edge, edges)
    if not most_right < along < most_left:
        return None
    point = np.array([cx + level * hx - along * hy, cy + level * hy + along * hx])
    pusher = np.array([px - tip_radius * nx, py - tip_radius * ny, math.atan2(ny, nx)])
    model = SteeringModel(
        point,
        math.atan2(hy, hx),
        1 / (most_left - along),
        1 / (along - most_right),
        np.array([px, py]),
        pusher,
        turns,
        drift,
    )
    return ContactCar(
        model, radius, np.array([px, py]), np.array([nx, ny]), min(left, -right) / half, (level, along, beta)
    )


def sides_of(car: Car, friction: float, margin: float) -> tuple[float, tuple[float, float]]:
    """ρ such that the axle of diag(1, 1, 1/ρ) is that of a car, and how much farther its turning centres are.

    Args:
        car: with a margin of its friction cone.
    """
    to = -car.contact.point
    r = float(np.hypot(*to))
    h, kept = to / r, kept_angle(friction, margin)
    rho = r * float((car.flat_point - car.cof) @ h)
    beta = float(np.arctan2(cross(h, car.contact.normal), h @ car.contact.normal))
    shares = []
    for centre, angle in ((car.left_centre, beta - kept), (car.right_centre, beta + kept)):
        left = float(cross(h, centre - car.cof))
        shares.append(left * r / (-rho / math.tan(angle)))
    return rho, (shares[0], shares[1])


def drift_of(car: Car, model: SteeringModel) -> Array:
    """How far the flat point of a model moves to its left, per length, at turns evenly from -right to left, shape (n,).

    Args:
        car: of the same push, with a margin no greater than that of the model's limits.
    """
    first, _, last = car.contact.force_angles(car.forces)
    h, turns, drifts = model.direction, [], []
    for share in np.linspace(0.0, 1.0, _SAMPLES):
        force = rotate(last + share * (first - last), car.contact.normal)
        V = shift_twist(car.surface.twist(car.contact.wrench(force)), -car.cof)
        v = velocity_at(V, model.flat_point)
        ahead = float(v @ h)
        turns.append(float(V[2]) / ahead)
        drifts.append(float(cross(h, v)) / ahead)
    order = np.argsort(turns)
    curvatures = np.linspace(-model.right, model.left, _SAMPLES)
    return np.interp(curvatures, np.array(turns)[order], np.array(drifts)[order])
