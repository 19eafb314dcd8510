"""The car that a sticking push makes of an object: left about one point, right about another, or straight on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..contact import PointContact, WrenchCone, steering_forces
from ..contact.wrench_cone import CLOSED
from ..errors import InputError, NoDubinsReduction
from ..friction.surface import LimitSurface
from ..geometry import cross, perpendicular, rotate, shift_twist, velocity_at
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
            margin taken off; the right one turns left. With a cone: the sums of both fingers' forces in these motions.
        cof: origin of B in O.
        cone: composite wrench cone of two fingers, if its motions are taken from it; the contact is then their middle.
    """

    left_centre: Array
    right_centre: Array
    direction: Array
    pusher: Array
    contact: PointContact
    surface: LimitSurface
    forces: Array
    cof: Array
    cone: WrenchCone | None = None

    @classmethod
    def of_two(
        cls,
        contacts: Sequence[PointContact],
        surface: LimitSurface,
        twists: ArrayLike,
        *,
        cof: ArrayLike = (0.0, 0.0),
        pusher: ArrayLike = (0.0, 0.0, 0.0),
    ) -> "Car":
        """The car of two fingers that makes given motions of their composite cone.

        Args:
            twists: left turn, straight motion and right turn about the COF, shape (3, 3); see contact.cone_twists.
        """
        V = np.asarray(twists, dtype=float)
        offset = np.asarray(cof, dtype=float)
        middle = PointContact(
            np.mean([c.point for c in contacts], axis=0),
            np.mean([c.normal for c in contacts], axis=0),
            contacts[0].friction,
            hook=True,
        )
        forces = np.array([surface.wrench(v)[:2] for v in V[::-1]])
        return cls(
            perpendicular(V[0, :2]) / V[0, 2] + offset,
            perpendicular(V[2, :2]) / V[2, 2] + offset,
            V[1, :2],
            np.asarray(pusher, dtype=float),
            middle,
            surface,
            forces / np.linalg.norm(forces, axis=1, keepdims=True),
            offset,
            WrenchCone.of(contacts),
        )

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
            margin: fraction of μ that every motion keeps in reserve (see contact.steering_forces).

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

        Found on the limit surface itself, by bisection on the force. Two fingers with their cone: the sum of the
        straight motion and of a turn that has this curvature, with which the flat point is one exactly; where the
        limit surface bulges out of the cone there, the twist of the sum of their wrenches instead.

        Raises:
            InputError: if the curvature is beyond what the friction cone, less the margin, allows.
        """
        if abs(curvature) * self.radius > 1 + 1e-9:
            raise InputError(f"a curvature is at most {1 / self.radius:.6g} per metre", value=curvature)
        if self.cone is not None:
            return self._twist_of_two(self.cone, curvature)
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

    def _twist_of_two(self, cone: WrenchCone, curvature: float) -> Array:
        extreme = self.left if curvature > 0 else self.right
        V, W = (shift_twist(v, self.cof) for v in (self.straight, extreme))
        flat = self.flat_point - self.cof
        F, G = (self.surface.wrench(v) for v in (V, W))
        F, G = F / np.linalg.norm(F[:2]), G / np.linalg.norm(G[:2])

        def planar(s: float) -> Array:
            return np.asarray((1 - s) * V + s * W)

        def bent(s: float) -> Array:
            return self.surface.twist((1 - s) * F + s * G)

        def at(motion: Callable[[float], Array]) -> Array:
            low, high = 0.0, 1.0
            if abs(curvature) * self.radius >= 1 - 1e-12:
                return W
            for _ in range(60):
                s = 0.5 * (low + high)
                v = motion(s)
                turn = abs(float(v[2])) / float(np.hypot(*velocity_at(v, flat)))
                low, high = (s, high) if turn < abs(curvature) else (low, s)
            return motion(0.5 * (low + high))

        found = V if curvature == 0 else at(planar)
        if cone.depths(self.surface.wrench_set(found))[1] < -CLOSED:
            found = at(bent)
        return shift_twist(found / np.hypot(*velocity_at(found, flat)), -self.cof)

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
