"""A fingertip that touches an object at one point: which forces it can exert and which motion it causes."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import is_finite, numbers, vector
from ..errors import InputError
from ..friction.surface import LimitSurface, WrenchSet
from ..geometry import cross, perpendicular, rotate, velocity_at
from ..geometry.pose import Array


class ContactMode(StrEnum):
    """What the fingertip does at the contact. sliding_left: it slips to the left, seen along the inward normal."""

    STICKING = "sticking"
    SLIDING_LEFT = "sliding_left"
    SLIDING_RIGHT = "sliding_right"
    SEPARATION = "separation"
    REST = "rest"


class Motion(NamedTuple):
    """The answer of PointContact.motion.

    Attributes:
        mode: see ContactMode.
        twist: of the object, shape (3,), in the contact's frame.
        slip: tangential velocity of the pusher minus the object's, + to the left [m/s].
        force: direction of the contact force, shape (2,); zero where there is none.
    """

    mode: ContactMode
    twist: Array
    slip: float
    force: Array


class ConeEdges(NamedTuple):
    """The left and the right edge of a cone, as seen along the inward normal."""

    left: Array
    right: Array


@dataclass(frozen=True, eq=False)
class PointContact:
    """A frictional point contact, in a frame with its origin at the centre of friction.

    Args:
        point: of the outline, shape (2,) [m].
        normal: inward normal, shape (2,); any length, kept as a unit vector.
        friction: Coulomb coefficient μ ≥ 0.
        hook: allows a normal that points away from the centre of friction, as inside a hook.

    Raises:
        InputError: for a zero or non-finite normal, one that points outward, or negative friction.

    >>> contact = PointContact(point=[0.0, -0.02], normal=[0.0, 1.0], friction=0.5)
    >>> contact.force_edges().left.round(3).tolist()
    [-0.447, 0.894]
    """

    point: Array
    normal: Array
    friction: float
    hook: bool = False

    def __post_init__(self) -> None:
        point = vector(self.point, 2, "the point of a contact is two finite numbers")
        normal = vector(self.normal, 2, "the normal of a contact is two finite numbers")
        length = float(np.hypot(*normal))
        if length == 0:
            raise InputError("the normal of a contact is not zero", value=self.normal)
        if not (is_finite(self.friction) and self.friction >= 0):
            raise InputError("friction is a finite number, 0 or more", value=self.friction)
        normal = normal / length
        if not self.hook and float(point @ normal) > 1e-9 * float(np.hypot(*point)):
            raise InputError(
                "the normal of a contact points inward, not away from the centre of friction",
                value=self.normal,
                hint="Turn it round; inside a hook, where it does point away, pass hook=True.",
            )
        point.setflags(write=False)
        normal.setflags(write=False)
        object.__setattr__(self, "point", point)
        object.__setattr__(self, "normal", normal)

    @property
    def half_angle(self) -> float:
        """Half the opening angle of the friction cone [rad]."""
        return float(np.arctan(self.friction))

    def force_edges(self) -> ConeEdges:
        """Unit forces on the edges of the friction cone ([Zhou2017] Eq. 10, corrected in docs/errata.md row 8)."""
        return ConeEdges(rotate(self.half_angle, self.normal), rotate(-self.half_angle, self.normal))

    def wrench(self, force: ArrayLike) -> Array:
        """J_pᵀ f: the wrench of forces of shape (..., 2) at the contact point."""
        f = numbers(force, "a force is two numbers")
        return np.concatenate([f, cross(self.point, f)[..., None]], axis=-1)

    def motion_cone(self, surface: LimitSurface) -> ConeEdges:
        """Velocities of the contact point under the forces of the cone's edges, up to size ([Zhou2017] Eq. 14)."""
        left, right = (velocity_at(surface.twist(self.wrench(f)), self.point) for f in self.force_edges())
        return ConeEdges(left, right)

    def motion(self, surface: LimitSurface, pusher_velocity: ArrayLike) -> Motion:
        """The quasi-static motion of the object when the fingertip moves with a velocity (2,) [m/s].

        The contact sticks when the force that carries the contact point along lies in the closed friction cone,
        which is so exactly when the velocity lies in the motion cone ([Zhou2017] Sec. 2; methods: the map from
        force to velocity is monotone). Otherwise it slides with the force on the near edge, and the twist of
        that edge is scaled to the pusher's normal velocity.
        """
        u = vector(pusher_velocity, 2, "a pusher velocity is two finite numbers")
        still, none = np.zeros(3), np.zeros(2)
        tangent = perpendicular(self.normal)
        if not np.any(u):
            return Motion(ContactMode.REST, still, 0.0, none)
        approach = float(u @ self.normal)
        if approach < 0:
            return Motion(ContactMode.SEPARATION, still, float(u @ tangent), none)
        if approach <= 1e-12 * float(np.hypot(*u)):  # along the edge: nothing presses the object
            mode = ContactMode.SLIDING_LEFT if u @ tangent > 0 else ContactMode.SLIDING_RIGHT
            if self.friction == 0 or not self._drags(surface, mode):
                return Motion(mode, still, float(u @ tangent), none)
        V = surface.stick(self.point, u)
        forces = self.forces(surface.wrench_set(V))
        angles = self.force_angles(forces)
        if np.max(angles) >= -self.half_angle - 1e-12 and np.min(angles) <= self.half_angle + 1e-12:
            inside = np.clip(np.mean(angles), -self.half_angle, self.half_angle)
            return Motion(ContactMode.STICKING, V, 0.0, rotate(inside, self.normal))
        left = np.min(angles) > 0
        force = self.force_edges()[0 if left else 1]
        V = surface.twist(self.wrench(force))
        u_edge = velocity_at(V, self.point)
        V = V * (approach / float(u_edge @ self.normal))
        slip = float((u - velocity_at(V, self.point)) @ tangent)
        return Motion(ContactMode.SLIDING_LEFT if left else ContactMode.SLIDING_RIGHT, V, slip, force)

    def forces(self, wrenches: WrenchSet) -> Array:
        """The contact forces, shape (2, 2), between which all those lie that make one of the wrenches.

        For a unique wrench both are its force. Where a support point p_k is the centre of rotation, its own friction
        g is free: the wrench must pass through the contact, (p_k - p) × g = -torque about p, a chord of |g| ≤ radius.
        """
        force = wrenches.centre[:2]
        if wrenches.radius == 0:
            return np.stack([force, force])
        torque = wrenches.centre[2] - cross(self.point, force)
        d = wrenches.point - self.point
        distance = float(np.hypot(*d))
        if distance < 1e-9 * (1 + float(np.hypot(*self.point))):
            spread = np.arcsin(min(1.0, wrenches.radius / max(float(np.hypot(*force)), 1e-300)))
            return np.stack([rotate(spread, force), rotate(-spread, force)])
        least = -float(torque) / distance
        half = np.sqrt(max(0.0, wrenches.radius**2 - least**2))
        nearest = force + np.clip(least, -wrenches.radius, wrenches.radius) * perpendicular(d) / distance
        return np.stack([nearest + half * d / distance, nearest - half * d / distance])

    def force_angles(self, forces: ArrayLike) -> Array:
        """Angles of forces (..., 2) from the inward normal, + to the left [rad]."""
        f = np.asarray(forces, dtype=float)
        return np.arctan2(cross(self.normal, f), f @ self.normal)

    def _drags(self, surface: LimitSurface, mode: ContactMode) -> bool:
        """Whether friction alone can carry the object along its edge: the motion cone reaches past it."""
        left, right = self.motion_cone(surface)
        return float((left if mode is ContactMode.SLIDING_LEFT else right) @ self.normal) < 0
