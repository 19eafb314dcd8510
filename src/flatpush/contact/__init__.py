"""What a pusher can do: friction cone, motion cone, stick, slide or separate, with one fingertip or two."""

from .placement import Placement, place_fingers
from .point_contact import ContactMode, Motion, PointContact
from .straight import steering_forces, straight_force
from .two_point import composite_margin, two_point_sticks

__all__ = [
    "ContactMode",
    "Motion",
    "Placement",
    "PointContact",
    "composite_margin",
    "place_fingers",
    "steering_forces",
    "straight_force",
    "two_point_sticks",
]
