"""The margins of the motions that a plan makes, many motions at a time, each worked out once."""

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..contact import Placement, PointContact
from ..friction.surface import LimitSurface
from ..geometry.pose import Array
from ..problem import Object, Scene
from ..problem.mechanics import contacts_of
from .cone_margins import cone_margins
from .margins import Margins, contact_margins, two_finger_margins, worse_of

# Motions that are judged at a time: each is some two hundred twists, which together stay within a few megabytes.
TOGETHER = 32
DIGITS = 14  # of the direction of a twist; the rest is rounding
KEPT = 1000  # motions of an object that are remembered


class JudgedMotion(NamedTuple):
    """One motion of a push, whose margins a certificate states.

    Attributes:
        placement: of the fingers; surface: of the planning model.
        cone: whether it is a motion of two fingers' composite cone, or else of one contact.
        at: that contact, or the middle of the two, about the COF.
        direction: of the twist about the COF, on which alone margins depend: its numbers in SI over their root sum
            square, rounded so that the same motion of two plans is the same.
    """

    placement: Placement
    surface: LimitSurface
    cone: bool
    at: PointContact
    direction: tuple[float, float, float]

    @classmethod
    def of(
        cls, placement: Placement, surface: LimitSurface, cone: bool, at: PointContact, twist: Array
    ) -> "JudgedMotion":
        """Of a twist (3,) about the COF."""
        x, y, turn = (np.round(twist / max(float(np.linalg.norm(twist)), 1e-300), DIGITS) + 0.0).tolist()
        return cls(placement, surface, cone, at, (x, y, turn))


_known: WeakKeyDictionary[Object, dict[JudgedMotion, Margins]] = WeakKeyDictionary()


def margins_of(scene: Scene, motions: Sequence[JudgedMotion]) -> list[Margins]:
    """The margins of motions, of two fingers the worse of all that hold of both. Plans of one object share them."""
    known = _known.setdefault(scene.object, {})
    new = [motion for motion in dict.fromkeys(motions) if motion not in known]
    if len(known) + len(new) > KEPT:
        known.clear()
        new = list(dict.fromkeys(motions))
    for first in range(0, len(new), TOGETHER):
        some = new[first : first + TOGETHER]
        known.update(zip(some, _judged(scene, some), strict=True))
    return [known[motion] for motion in motions]


def _judged(scene: Scene, motions: Sequence[JudgedMotion]) -> list[Margins]:
    twists = np.array([m.direction for m in motions])
    found = [
        Margins() if m.cone else contact_margins(scene, m.surface, m.at, twist)
        for m, twist in zip(motions, twists, strict=True)
    ]
    for surface in {id(m.surface): m.surface for m in motions if m.cone}.values():
        those = [i for i, m in enumerate(motions) if m.cone and m.surface is surface]
        pairs = [contacts_of(scene, motions[i].placement) for i in those]
        points = np.array([motions[i].at.point for i in those])
        for i, margins in zip(those, cone_margins(surface, pairs, points, twists[those]), strict=True):
            found[i] = margins
    both = [i for i, m in enumerate(motions) if len(m.placement.points) == 2]
    if both:
        placements = [motions[i].placement for i in both]
        for i, margins in zip(both, two_finger_margins(scene, placements, twists[both]), strict=True):
            found[i] = worse_of(found[i], margins)
    return found
