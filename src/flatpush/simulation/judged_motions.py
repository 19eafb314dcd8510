"""The margins of the motions that a plan makes, many motions at a time."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..contact import Placement, PointContact
from ..friction.surface import LimitSurface
from ..geometry.pose import Array
from ..problem import Scene
from ..problem.mechanics import contacts_of
from .cone_margins import cone_margins
from .margins import Margins, contact_margins, two_finger_margins

# Motions that are judged at a time: each is some two hundred twists, which together stay within a few megabytes.
TOGETHER = 32


class JudgedMotion(NamedTuple):
    """One motion of a push, whose margins a certificate states.

    Attributes:
        placement: of the fingers; surface: of the planning model.
        cone: whether it is a motion of two fingers' composite cone, or else of one contact.
        at: that contact, or the middle of the two, about the COF; twist: shape (3,), about the COF.
    """

    placement: Placement
    surface: LimitSurface
    cone: bool
    at: PointContact
    twist: Array


def margins_of(scene: Scene, motions: Sequence[JudgedMotion]) -> list[Margins]:
    """The margins of motions of a plan, of two fingers all that hold of both."""
    found = [contact_margins(scene, m.surface, m.at, m.twist) for m in motions if not m.cone]
    for first in range(0, len(motions), TOGETHER):
        some = motions[first : first + TOGETHER]
        for surface in {id(m.surface): m.surface for m in some}.values():
            those = [m for m in some if m.cone and m.surface is surface]
            if those:
                pairs = [contacts_of(scene, m.placement) for m in those]
                points, twists = (
                    np.array(x) for x in zip(*((m.at.point, m.twist) for m in those), strict=True)
                )
                found += cone_margins(surface, pairs, points, twists)
        both = [m for m in some if len(m.placement.points) == 2]
        if both:
            found += two_finger_margins(scene, [m.placement for m in both], np.array([m.twist for m in both]))
    return found
