"""Eyes: where objects are, by tags that a calibrated camera sees; a drawn camera for trying it end to end.

OpenCV and AprilTag (extra `vision`) are loaded when a picture is looked at or drawn.
"""

from .calibrate import Board, Calibrated, Fiducials, calibrate
from .eyes import DrawnEyes, Frame, Source, TagEyes
from .filter import Track, TwistFilter
from .sighting import Sighting
from .sources import Device, read_picture, recorded
from .synthetic import Spoil, SyntheticCamera
from .tracker import Seen, Tracker, TrackerState
from .worn import Tag

__all__ = [
    "Board",
    "Calibrated",
    "Device",
    "DrawnEyes",
    "Fiducials",
    "Frame",
    "Seen",
    "Sighting",
    "Source",
    "Spoil",
    "SyntheticCamera",
    "Tag",
    "TagEyes",
    "Track",
    "Tracker",
    "TrackerState",
    "TwistFilter",
    "calibrate",
    "read_picture",
    "recorded",
]
