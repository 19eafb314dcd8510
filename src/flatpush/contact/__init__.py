"""What a pusher can do: friction cone, motion cone, stick, slide or separate, with one fingertip or two."""

from .cone_twists import cone_twists
from .lynch_mason import StableRegion, beyond_slider, stable_region
from .placement import Placement, place_fingers
from .point_contact import ContactMode, Motion, PointContact
from .stable_centres import StableCentres
from .straight import kept_angle, steering_forces, straight_force
from .two_point import composite_margin, spacing_margin, two_point_sticks
from .wrench_cone import WrenchCone, narrowed

__all__ = [
    "ContactMode",
    "Motion",
    "Placement",
    "PointContact",
    "StableCentres",
    "StableRegion",
    "WrenchCone",
    "beyond_slider",
    "composite_margin",
    "cone_twists",
    "kept_angle",
    "narrowed",
    "place_fingers",
    "spacing_margin",
    "stable_region",
    "steering_forces",
    "straight_force",
    "two_point_sticks",
]
