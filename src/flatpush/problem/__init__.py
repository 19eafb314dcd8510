"""What is asked and what is answered, as plain values."""

from .plan import Arc, Certificate, Plan, PushSegment, Rollout, TransitSegment
from .scene import Object, Planning, Push, Pusher, Scene, Workspace

__all__ = [
    "Arc",
    "Certificate",
    "Object",
    "Plan",
    "Planning",
    "Push",
    "PushSegment",
    "Pusher",
    "Rollout",
    "Scene",
    "TransitSegment",
    "Workspace",
]
