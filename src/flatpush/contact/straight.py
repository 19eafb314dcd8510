"""The force at a contact that moves an object without turning it."""

import numpy as np

from ..errors import NoDubinsReduction
from ..friction.ellipsoid import Ellipsoid
from ..friction.exact import Exact
from ..friction.surface import LimitSurface
from ..geometry import rotate
from ..geometry.pose import Array
from .point_contact import PointContact


def straight_force(contact: PointContact, surface: LimitSurface) -> Array:
    """The unit force at the contact for which ω = 0, shape (2,).

    Under Coulomb friction, and under diag(a, a, b), it points at the centre of friction ([Lynch1996] Sec. 3.1.1);
    under other surfaces it need not.

    Raises:
        NoDubinsReduction: if the contact lies at the centre of friction, or if the force does not lie strictly
            inside the friction cone: then every sticking motion turns the same way (docs/errata.md row 9).
    """
    p = contact.point
    distance = float(np.hypot(*p))
    if distance == 0:
        raise NoDubinsReduction("the contact lies at the centre of friction; no force there turns the object")
    if isinstance(surface, Exact):
        force = -p / distance
    elif isinstance(surface, Ellipsoid):
        # Third row of A Jᵀ f = 0 is linear in f.
        row = surface.matrix[2]
        g = row[:2] + row[2] * np.array([-p[1], p[0]])
        force = np.array([g[1], -g[0]]) / np.hypot(*g)
        force = force if force @ contact.normal > 0 else -force
    else:
        force = _root(contact, surface)
    angle = float(contact.force_angles(force))
    miss = abs(angle) - contact.half_angle
    if contact.friction == 0:
        raise NoDubinsReduction("without friction the contact has one force only, and the object cannot be steered")
    if miss >= -1e-9:
        raise NoDubinsReduction(
            f"the friction cone does not strictly contain the force that pushes straight: it lies"
            f" {np.rad2deg(abs(angle)):.1f}° from the normal, the cone's edge {np.rad2deg(contact.half_angle):.1f}°"
            f" (off by {np.rad2deg(max(miss, 0.0)):.1f}°), so every sticking motion turns the same way."
            f" More friction than {np.tan(min(abs(angle), 1.55)):.2f} or a contact nearer to the line of the"
            " normal through the centre of friction would help",
            float(np.rad2deg(max(miss, 0.0))),
        )
    return force


def _root(contact: PointContact, surface: LimitSurface) -> Array:
    """Bisection on the angle of the force: the turn grows with its lever, left forces turn clockwise."""

    def turn(angle: float) -> float:
        return float(surface.twist(contact.wrench(rotate(angle, contact.normal)))[2])

    low, high = -0.5 * np.pi, 0.5 * np.pi  # right of the normal (counter-clockwise), left of it (clockwise)
    if turn(low) <= 0 or turn(high) >= 0:
        side = high if turn(low) > 0 else low
        return rotate(side, contact.normal)
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if turn(middle) > 0 else (low, middle)
        if high - low < 1e-15:
            break
    return rotate(0.5 * (low + high), contact.normal)
