"""Pushes that slide: straight pushes rolled out once, and sequences of them that lead from pose to pose.

Without friction between finger and object no push steers like a car. What such a push does is known all the same: the
object's displacement does not depend on where the object is, so a push that was rolled out once holds at every pose,
and a sequence of pushes is a product of displacements.
"""

from .exact import SlidePlan, SlidePlanner, SlidePush
from .mixed import mixed_segments
from .sequences import Sequence, SlideSearch
from .slides import SlideLibrary, slide_library
from .timed import slide_planner, slide_plans, slide_segments

__all__ = [
    "Sequence",
    "SlideLibrary",
    "SlidePlan",
    "SlidePlanner",
    "SlidePush",
    "SlideSearch",
    "mixed_segments",
    "slide_library",
    "slide_planner",
    "slide_plans",
    "slide_segments",
]
