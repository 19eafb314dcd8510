"""How far the motions of a push are from their limits."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from ..contact import Placement, PointContact, beyond_slider
from ..contact.two_point import composite_margins
from ..friction.surface import LimitSurface
from ..geometry import rotate, velocity_at
from ..geometry.pose import Array
from ..problem import Scene
from ..problem.mechanics import contacts_of, slider_of, true_surface

# Forces of the whole friction cone among which the tightest turn is looked for.
CONE_SAMPLES = 33


@dataclass(frozen=True)
class Margins:
    """The margins of one twist, or the worst of several; None where one does not apply. See problem.Certificate.

    Attributes:
        friction, spacing, curvature, composite: fractions.
        degrees, motion: angles [deg].
        unique: distance of the turning centre beyond the object [m].
        offset: how far the believed line of force passes from the contact [m]; the only one that is worse if greater.
    """

    friction: float | None = None
    degrees: float | None = None
    spacing: float | None = None
    motion: float | None = None
    curvature: float | None = None
    composite: float | None = None
    unique: float | None = None
    offset: float | None = None


def worse_of(a: Margins, b: Margins) -> Margins:
    """Of each margin the worse; what applies to one of them only is that one's."""
    found = {}
    for name in (field.name for field in fields(Margins)):
        given = [value for value in (getattr(a, name), getattr(b, name)) if value is not None]
        found[name] = (max if name == "offset" else min)(given, default=None)
    return Margins(**found)


def contact_margins(scene: Scene, surface: LimitSurface, contact: PointContact, twist: Array) -> Margins:
    """The margins of one twist (3,) about the COF, made by one contact."""
    forces = contact.forces(surface.wrench_set(twist))
    angle = float(np.max(np.abs(contact.force_angles(forces))))
    mu = contact.friction
    u = velocity_at(twist, contact.point)
    left, right = contact.motion_cone(surface)
    lean = abs(float(contact.force_angles(u)))
    true = true_surface(scene.object)
    W = true.wrench(twist)
    lever = W[2] - (contact.point[0] * W[1] - contact.point[1] * W[0])
    size = float(np.hypot(W[0], W[1]))
    unique_wrench = true.wrench_set(twist).radius == 0
    return Margins(
        friction=1 - (float(np.tan(angle)) if angle < 0.5 * np.pi else np.inf) / mu if mu > 0 else None,
        degrees=float(np.rad2deg(contact.half_angle - angle)),
        motion=float(np.rad2deg(min(_angle(right, u), _angle(u, left), 0.5 * np.pi - lean))),
        curvature=_curvature_margin(surface, contact, twist),
        offset=float(abs(lever) / size) if size > 0 and unique_wrench else 0.0,
    )


def two_finger_margins(scene: Scene, placements: Sequence[Placement], twists: Array) -> list[Margins]:
    """What both contacts make of twists (n, 3) about the COF under the believed surface, and whatever the pressure."""
    pairs, slider = [contacts_of(scene, placement) for placement in placements], slider_of(scene.object)
    composites = composite_margins(pairs, true_surface(scene.object).wrench_sets(twists))
    found = []
    for contacts, composite, twist in zip(pairs, composites, twists, strict=True):
        beyond = beyond_slider(contacts, slider, twist)
        known = beyond if beyond is not None and np.isfinite(beyond) else None
        found.append(Margins(composite=composite, unique=known))
    return found


def _curvature_margin(surface: LimitSurface, contact: PointContact, twist: Array) -> float:
    """1 - turn per travel of the contact / the most that forces in the whole cone make on the same side.

    The most need not be at the cone's edge, so the cone is sampled. -inf if no force turns to that side.
    """
    if twist[2] == 0:
        return 1.0
    angles = np.linspace(-contact.half_angle, contact.half_angle, CONE_SAMPLES)
    V = surface.twist(contact.wrench(rotate(angles, np.tile(contact.normal, (CONE_SAMPLES, 1)))))
    turns = V[:, 2] / np.linalg.norm(velocity_at(V, contact.point), axis=1)
    turn = float(twist[2]) / float(np.hypot(*velocity_at(twist, contact.point)))
    most = float(np.max(turns) if turn > 0 else np.min(turns))
    return 1 - turn / most if most * turn > 0 else -np.inf


def _angle(a: Array, b: Array) -> float:
    """From a counter-clockwise to b."""
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))
