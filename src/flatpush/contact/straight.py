"""The forces at a contact that steer an object: straight on, and the most to either side that a margin leaves."""

import numpy as np

from ..errors import InputError, NoDubinsReduction
from ..friction.ellipsoid import Ellipsoid
from ..friction.exact import Exact
from ..friction.surface import LimitSurface
from ..geometry import rotate, velocity_at
from ..geometry.pose import Array
from .point_contact import PointContact

# Where an edge cannot be used, the forces used stay off its replacement by at least this fraction.
PAST_EDGE = 0.01


def steering_forces(contact: PointContact, surface: LimitSurface, margin: float) -> Array:
    """Unit forces on the left edge, straight, and on the right edge of the friction cone less a margin, shape (3, 2).

    The cone is that of (1 - margin) μ: motions whose forces it holds stick for every coefficient from there up. Two
    kinds of edge cannot be used, and the cone then counts as ending earlier:

    * Where the twist of the edge is a rotation about a support point, many forces share it. If some of them lie
      outside the cone, the contact would lose its reserve.
    * Where the contact point would have to move against the inward normal, the fingertip would leave it.

    Raises:
        InputError: if the margin is not in [0, 1).
        NoDubinsReduction: as straight_force, where the straight force does not lie strictly inside the cone less the
            margin (it says the reserve that could be kept), and where one of the forces has many twists.
    """
    half = kept_angle(contact.friction, margin)
    straight = straight_force(contact, surface)
    base = float(contact.force_angles(straight))
    if abs(base) >= half - 1e-9:
        raise NoDubinsReduction(
            f"the force that pushes straight takes so much friction that this push can keep"
            f" {_percent(1 - np.tan(abs(base)) / contact.friction)} of μ in reserve at most, not {_percent(margin)}"
            f" (planning: margin: friction). {_help(base, margin)}",
            float(np.rad2deg(abs(base) - half)),
        )
    forces = []
    for side in (1.0, -1.0):
        angle = side * half
        wrenches = surface.wrench_set(_twist(contact, surface, angle))
        shared = side * contact.force_angles(contact.forces(wrenches))
        if wrenches.radius > 0 and np.max(shared) > half:
            inner = side * float(np.min(shared))
            angle = inner + PAST_EDGE * (base - inner)
        if _leaves(contact, surface, angle):
            inside, outside = base, angle
            while abs(outside - inside) > 1e-12:
                middle = 0.5 * (inside + outside)
                inside, outside = (inside, middle) if _leaves(contact, surface, middle) else (middle, outside)
            angle = inside + max(margin, PAST_EDGE) * (base - inside)
        forces.append(rotate(angle, contact.normal))
    steering = np.stack([forces[0], straight, forces[1]])
    if any(surface.is_vertex(contact.wrench(force)) for force in steering):
        raise NoDubinsReduction(
            "the support points lie on one line and a force of this push is square to it: many motions go with that"
            " force (a vertex of the limit surface), so it cannot steer. Push at another place"
        )
    return steering


def kept_angle(friction: float, margin: float) -> float:
    """Half the opening angle of the friction cone that is left when a part of μ is kept in reserve [rad].

    Args:
        friction: the coefficient μ.
        margin: the fraction of it that is kept in reserve.

    Raises:
        InputError: if the margin is not in [0, 1).
    """
    if not 0 <= margin < 1:
        raise InputError("the friction margin is at least 0 and less than 1", value=margin)
    return float(np.arctan((1 - margin) * friction))


def _percent(share: float) -> str:
    # Rounded down: what is named can be asked for.
    return f"{np.floor(1000 * share) / 10:g} %"


def _twist(contact: PointContact, surface: LimitSurface, angle: float) -> Array:
    return surface.twist(contact.wrench(rotate(angle, contact.normal)))


def _leaves(contact: PointContact, surface: LimitSurface, angle: float) -> bool:
    """Whether the contact point moves against the inward normal under a force at an angle from it."""
    return bool(velocity_at(_twist(contact, surface, angle), contact.point) @ contact.normal <= 0)


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
        raise NoDubinsReduction(
            "without friction the contact has one force only, and the object cannot be steered"
        )
    if miss >= -1e-9:
        raise NoDubinsReduction(
            f"the friction cone does not strictly contain the force that pushes straight (off by"
            f" {np.rad2deg(max(miss, 0.0)):.1f}°): every sticking motion turns the same way. {_help(angle)}",
            float(np.rad2deg(max(miss, 0.0))),
        )
    return force


def _help(angle: float, margin: float = 0.0) -> str:
    contact = "a contact nearer to the normal through the centre of friction would help"
    if abs(angle) > np.deg2rad(80):
        return f"No sensible friction would do; {contact}"
    return f"Friction above {np.tan(abs(angle)) / (1 - margin):.2f} or {contact}"


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
