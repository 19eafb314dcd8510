"""The flat output of a sticking push: the body point whose path tells pose and force ([Zhou2017] Sec. 3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import finite, is_finite, numbers
from ..contact import PointContact, straight_force
from ..errors import InputError, NoDubinsReduction
from ..friction.ellipsoid import Ellipsoid
from ..geometry import cross, perpendicular, rotate, transform
from ..geometry.pose import Array


@dataclass(frozen=True, eq=False)
class FlatOutput:
    """A flat output of a sticking push; see flat_output.

    Attributes:
        flat_point: in the contact's frame, whose origin is the centre of friction (COF), shape (2,) [m].
        min_radius: the tightest turn that the flat point can follow to both sides [m].
        heading_offset: angle from that frame's +x to the heading of the flat point [rad].
        c_left: where on the rotation-centre line the object turns under the force on the left edge of the friction
            cone, the centre of the *right* turn [m]; usually positive. From the foot of the COF's perpendicular, + to
            the right of the heading.
        c_right: the same for the right edge: the centre of the left turn, less than c_left [m].
        along: the flat point, on the same line [m].
        contact, ellipsoid: of the push.
    """

    flat_point: Array
    min_radius: float
    heading_offset: float
    c_left: float
    c_right: float
    along: float
    contact: PointContact
    ellipsoid: Ellipsoid

    def position(self, pose: ArrayLike) -> Array:
        """Where the flat point is, z of shape (..., 2), for poses of the contact's frame, shape (..., 3).

        [Zhou2017] Eqs. 19, 20 and 30.
        """
        return transform(finite(pose, "poses are three finite numbers"), self.flat_point)

    def recover(self, z: ArrayLike, dz: ArrayLike, ddz: ArrayLike) -> tuple[Array, Array]:
        """Pose and force from the flat point's motion; all shapes (..., 2), broadcasting.

        [Zhou2017] Eqs. 24-28 and 31-33, the latter corrected (docs/errata.md rows 1 and 6), for any
        ellipsoid.

        A flat point between c_right and c_left only runs forward, along its heading, and the answer is
        unique. One outside runs backward while the object turns about a centre between it and the nearer of
        the two; then the same path also belongs to a forward motion, with the centre mirrored in the flat
        point, which the friction cone always admits too. That one is returned.

        Returns:
            The poses of the contact's frame, shape (..., 3), and the forces in the push frame P (origin COF,
            +y from the contact to the COF), shape (..., 2), of the size for which the body twist is V = A Jᵀ
            f.

        Raises:
            InputError: where the velocity is zero: the heading is undefined there.
        """
        z, dz, ddz = (numbers(v, "z, dz and ddz are arrays of numbers") for v in (z, dz, ddz))
        for name, value in (("z", z), ("dz", dz), ("ddz", ddz)):
            if value.ndim == 0 or value.shape[-1] != 2 or not np.isfinite(value).all():
                raise InputError(f"{name} is an array of finite numbers of shape (..., 2)", value=value)
        speed = np.hypot(dz[..., 0], dz[..., 1])
        if np.any(speed == 0):
            raise InputError(
                "the flat velocity is not zero", value=0.0, hint="The heading is undefined at rest."
            )
        omega = cross(dz, ddz) / speed**2
        theta = np.arctan2(dz[..., 1], dz[..., 0]) - self.heading_offset  # Eq. 31
        q = z - rotate(theta, self.flat_point)  # Eq. 32
        theta = np.broadcast_to(theta, q.shape[:-1])
        return np.concatenate([q, theta[..., None]], axis=-1), self._to_push_frame(self._force(speed, omega))

    def _force(self, speed: Array, omega: Array) -> Array:
        """The force, in the contact's frame, that moves the flat point forward at a speed and turns at ω."""
        heading = rotate(self.heading_offset, [1.0, 0.0])
        v = speed[..., None] * heading - omega[..., None] * perpendicular(self.flat_point)
        V = np.concatenate([v, omega[..., None]], axis=-1)
        # V = A Jᵀ f, and the first two entries of the wrench Jᵀ f are the force itself.
        return np.linalg.solve(self.ellipsoid.matrix, V[..., None])[..., :2, 0]

    def _to_push_frame(self, force: Array) -> Array:
        p = self.contact.point
        return rotate(0.5 * np.pi - np.arctan2(-p[1], -p[0]), force)


def flat_output(contact: PointContact, ellipsoid: Ellipsoid, along: float | None = None) -> FlatOutput:
    """The flat output of a push that sticks, and the car it reduces to.

    All rotation centres that forces at the contact can cause lie on one line ([Zhou2017] Proposition 1), and
    any point of it is a flat output (Theorem 1). The midpoint of the two centres at the edges of the friction
    cone drives like a Dubins car ([Zhou2017] Sec. 3.2.2). With k the rotation about the contact point and b =
    A⁻¹ k, b·V = 0 for every force, whatever the positive-definite matrix A, so the line is {c : -b₁ c_y + b₂
    c_x = b₃}.

    Args:
        contact: in a frame with its origin at the COF.
        ellipsoid: the limit surface H = FᵀAF in the same frame.
        along: another point of the line, as its abscissa [m]; by default the midpoint.

    Raises:
        NoDubinsReduction: if the push cannot turn both ways: the force that goes straight does not lie
            strictly inside the friction cone (ω(f_left) < 0 < ω(f_right) fails), there is no friction, or the
            contact is at the COF (docs/errata.md row 9).
        InputError: if `along` is not finite.

    >>> from flatpush.contact import PointContact
    >>> from flatpush.friction import Ellipsoid
    >>> contact = PointContact([0.0, -0.02], [0.0, 1.0], 0.5)
    >>> flat = flat_output(contact, Ellipsoid([[1, 0, 0], [0, 1, 0], [0, 0, 2500]]))
    >>> flat.flat_point.round(9).tolist(), round(flat.min_radius, 9)  # (0, ρ/r), ρ/(r μ)
    ([0.0, 0.02], 0.04)
    """
    if along is not None and not is_finite(along):
        raise InputError("along is a finite abscissa on the rotation-centre line [m]", value=along)
    A, p = ellipsoid.matrix, contact.point
    size = np.sqrt(
        np.trace(A[:2, :2]) / (2 * A[2, 2])
    )  # the unit of length, [Zhou2017] Sec. 3.1 (errata row 4)
    if np.hypot(*p) < 1e-9 * size:
        raise NoDubinsReduction(
            "the contact lies at the centre of friction: its forces do not turn the object. Push away from it"
        )
    straight = straight_force(contact, ellipsoid)
    edges = contact.force_edges()
    V_left, V_0, V_right = (A @ contact.wrench(f) for f in (edges.left, straight, edges.right))
    if not V_left[2] < 0 < V_right[2]:
        raise NoDubinsReduction(
            "the contact lies beyond the centre of friction, where forces on the left turn the object left:"
            " it cannot be pushed like a car from there. Push from the other side",
            180.0 - float(np.rad2deg(contact.half_angle + abs(contact.force_angles(straight)))),
        )
    h = V_0[:2] / np.hypot(*V_0[:2])
    b = np.linalg.solve(A, [p[1], -p[0], 1.0])
    foot = b[2] * np.array([b[1], -b[0]]) / (b[0] ** 2 + b[1] ** 2)
    right_of_heading = -perpendicular(h)
    c_left, c_right = (float(np.array([-V[1], V[0]]) / V[2] @ right_of_heading) for V in (V_left, V_right))
    c = 0.5 * (c_left + c_right) if along is None else float(along)
    return FlatOutput(
        flat_point=foot + c * right_of_heading,
        min_radius=max(c - c_right, c_left - c),
        heading_offset=float(np.arctan2(h[1], h[0])),
        c_left=c_left,
        c_right=c_right,
        along=c,
        contact=contact,
        ellipsoid=ellipsoid,
    )
