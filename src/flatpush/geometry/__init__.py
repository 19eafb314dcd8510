"""Poses, twists and outlines: transform, distance, sweep."""

from .outline import Outline, OutlinePoint
from .pose import (
    compose,
    cross,
    exp,
    inverse,
    log,
    perpendicular,
    pose_error,
    relative,
    rotate,
    shift_twist,
    transform,
    velocity_at,
    wrap_angle,
)

__all__ = [
    "Outline",
    "OutlinePoint",
    "compose",
    "cross",
    "exp",
    "inverse",
    "log",
    "perpendicular",
    "pose_error",
    "relative",
    "rotate",
    "shift_twist",
    "transform",
    "velocity_at",
    "wrap_angle",
]
