"""The car that a sticking push makes of an object: left about one point, right about another, or straight on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..contact import PointContact, steering_forces
from ..errors import InputError, NoDubinsReduction
from ..friction.surface import LimitSurface
from ..geometry import cross, rotate, shift_twist, velocity_at
from ..geometry.pose import Array


@dataclass(frozen=True, eq=False)
class Car:
    """The extreme motions of one push, in the object frame O.

    The flat point is the midpoint of the two turning centres; every twist below moves it with unit speed, so the
    time spent on a twist is the length of the flat path. With an ellipsoidal limit surface the flat point is the
    paper's, the straight direction is perpendicular to the line of the centres, and the car is a Dubins car
    ([Zhou2017] Sec. 3.2); in general the centres are unequal and the direction is tilted.

    Attributes:
        left_centre, right_centre: centres of the counter-clockwise and the clockwise turn, shape (2,) [m].
        direction: of the straight motion, a unit vector.
        pusher: X_OE, shape (3,).
        contact, surface: in B (origin at the COF).
        forces: unit forces at the contact on the left edge, straight and on the right edge, shape (3, 2), with the
            margin taken off; the right one turns left.
        cof: origin of B in O.
    """

    left_centre: Array
    right_centre: Array
    direction: Array
    pusher: Array
    contact: PointContact
    surface: LimitSurface
    forces: Array
    cof: Array

    @classmethod
    def of(
        cls,
        contact: PointContact,
        surface: LimitSurface,
        *,
        cof: ArrayLike = (0.0, 0.0),
        pusher: ArrayLike = (0.0, 0.0, 0.0),
        margin: float = 0.0,
    ) -> "Car":
        """The car of a contact under a limit surface.

        Args:
            margin: fraction of the angle by which each edge of the friction cone is moved towards the straight force
                (see contact.steering_forces).

        Raises:
            NoDubinsReduction: if the push cannot turn both ways (docs/errata.md row 9).
        """
        left, straight, right = forces = steering_forces(contact, surface, margin)
        centres = []
        for force, sign in ((right, 1.0), (left, -1.0)):
            V = surface.twist(contact.wrench(force))
            if sign * V[2] <= 0:
                raise NoDubinsReduction(
                    "an edge of the friction cone does not turn the object the way it should"
                )
            centres.append(np.array([-V[1], V[0]]) / V[2])
        v = surface.twist(contact.wrench(straight))[:2]
        direction = v / np.hypot(*v)
        if cross(direction, centres[0] - centres[1]) <= 0:
            raise NoDubinsReduction("the turning centres of this push do not lie on either side of its way")
        offset = np.asarray(cof, dtype=float)
        return cls(
            centres[0] + offset,
            centres[1] + offset,
            direction,
            np.asarray(pusher, dtype=float),
            contact,
            surface,
            forces,
            offset,
        )

    @property
    def radius(self) -> float:
        """Turning radius of the flat point [m]."""
        return 0.5 * float(np.hypot(*(self.left_centre - self.right_centre)))

    @property
    def flat_point(self) -> Array:
        """The midpoint of the turning centres, shape (2,)."""
        return 0.5 * (self.left_centre + self.right_centre)

    @property
    def is_dubins(self) -> bool:
        """Whether the straight direction is perpendicular to the line of the centres, so that flatness is exact."""
        span = self.left_centre - self.right_centre
        return bool(abs(self.direction @ span) <= 1e-9 * np.hypot(*span))

    @property
    def left(self) -> Array:
        """Body twist in O at O's origin of the left (counter-clockwise) turn."""
        return _about(self.left_centre, 1.0 / self.radius)

    @property
    def right(self) -> Array:
        """Body twist of the right (clockwise) turn."""
        return _about(self.right_centre, -1.0 / self.radius)

    @property
    def straight(self) -> Array:
        """Body twist of the straight motion."""
        return np.array([*self.direction, 0.0])

    def twist(self, curvature: float) -> Array:
        """The body twist with a given turn per length of the flat path, from -1/radius (right) to 1/radius (left).

        Found on the limit surface itself, by bisection on the force.

        Raises:
            InputError: if the curvature is beyond what the friction cone, less the margin, allows.
        """
        if abs(curvature) * self.radius > 1 + 1e-9:
            raise InputError(f"a curvature is at most {1 / self.radius:.6g} per metre", value=curvature)
        left, _, right = self.contact.force_angles(self.forces)
        turn = -np.inf
        V = np.zeros(3)
        for _ in range(60):
            angle = 0.5 * (left + right)
            force = rotate(angle, self.contact.normal)
            V = shift_twist(self.surface.twist(self.contact.wrench(force)), -self.cof)
            V = V / np.hypot(*velocity_at(V, self.flat_point))
            turn = float(V[2])
            left, right = (angle, right) if turn < curvature else (left, angle)
        return V

    def weights(self, cost: str) -> tuple[float, float, float]:
        """Cost of a radian to the left, a metre straight and a radian to the right, for the cost "flat" or "pusher"."""
        if cost == "flat":
            return self.radius, 1.0, self.radius
        point = self.pusher[:2]
        return (
            float(np.hypot(*(point - self.left_centre))),
            1.0,
            float(np.hypot(*(point - self.right_centre))),
        )


def _about(centre: Array, omega: float) -> Array:
    return np.array([omega * centre[1], -omega * centre[0], omega])
