"""Bodies among obstacles: how much clearance a pose, or a path of constant twists, keeps."""

from .body import Body
from .clearance import Clearance, path_clearance, pose_clearance
from .world import World

__all__ = ["Body", "Clearance", "World", "path_clearance", "pose_clearance"]
