"""What the sketch of one push shows, after [Zhou2017] Figs. 1 and 2: cones, rotation centres, flat point."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.pose import Array

if TYPE_CHECKING:
    from ..contact import StableCentres, StableRegion


@dataclass(frozen=True, eq=False)
class PushSketch:
    """One push as it is sketched. Everything in the drawing's frame O, lengths [m]; directions of any size.

    Left and right edges of the cones are those seen along the inward normal, so the force at the left edge
    turns the object clockwise, about right_centre: left_centre belongs to the left, counter-clockwise turn.

    Attributes:
        name: of the push.
        contact_points: on the outline, shape (k, 2), one or two.
        normal: inward, of the (virtual) contact, which is the middle of the contact points; shape (2,).
        fingertips: centres, shape (k, 2).
        tip_radius: of a fingertip [m].
        friction: Coulomb coefficient, for the caption.
        cof: centre of friction, shape (2,).
        force_left, force_right: edges of the friction cone, shape (2,).
        motion_left, motion_right: edges of the motion cone, shape (2,).
        left_centre, right_centre: rotation centres of the two extreme turns, shape (2,); nan if refused.
        flat_point: their midpoint, shape (2,); nan if refused.
        straight: direction of the motion without turning, shape (2,); nan if refused.
        refusal: why the push cannot steer; empty if it can.
        centres: rotation centres between the edges of the cone, in order, shape (n, 2): the curve that stands
            for the line under a general surface; empty for a line.
        region: two fingers with their composite cone: all rotation centres that keep both contacts, about the COF.
        any_pressure: the part of them that does so whatever the pressure on the table, after Lynch and Mason.
        drive: the pushing direction u of Fig. 1, one that turns the object left half as tightly as it could; shape
            (2,), nan if refused.
        drive_centre: the rotation centre of the object's motion under it, shape (2,); nan if refused.
    """

    name: str
    contact_points: Array
    normal: Array
    fingertips: Array
    tip_radius: float
    friction: float
    cof: Array
    force_left: Array
    force_right: Array
    motion_left: Array
    motion_right: Array
    left_centre: Array
    right_centre: Array
    flat_point: Array
    straight: Array
    refusal: str = ""
    centres: Array = field(default_factory=lambda: np.empty((0, 2)))
    region: "StableCentres | None" = None
    any_pressure: "StableRegion | None" = None
    drive: Array = field(default_factory=lambda: np.full(2, np.nan))
    drive_centre: Array = field(default_factory=lambda: np.full(2, np.nan))

    @property
    def steers(self) -> bool:
        """Whether the push can steer; `refusal` says why not."""
        return not self.refusal

    @property
    def contact(self) -> Array:
        """The (virtual) contact point: the middle of the contact points, shape (2,)."""
        return np.mean(np.atleast_2d(self.contact_points), axis=0)

    @property
    def turning_radius(self) -> float:
        """Half the distance between the turning centres [m]."""
        return 0.5 * float(np.linalg.norm(self.left_centre - self.right_centre))
