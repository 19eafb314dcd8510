"""What is asked and what is answered, as plain values."""

from .certificate import CarCentres, Certificate
from .plan import Arc, Plan, PushSegment, Rollout, TransitSegment
from .scene import Object, Planning, Push, Pusher, Scene, Uncertainty, Workspace

__all__ = [
    "Arc",
    "CarCentres",
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
    "Uncertainty",
    "Workspace",
]
