"""What recorded motion says of the table and of the finger, and which pushes would say more."""

from .fit import MotionFit, fit_motion
from .motion import Seen, look
from .radii import Radius, radii, turning_radius
from .suggest import Suggestion, suggest
from .summary import Summary, summarise

__all__ = [
    "MotionFit",
    "Radius",
    "Seen",
    "Suggestion",
    "Summary",
    "fit_motion",
    "look",
    "radii",
    "suggest",
    "summarise",
    "turning_radius",
]
