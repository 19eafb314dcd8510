"""What is asked and what is answered, as plain values."""

from .certificate import CarCentres, Certificate
from .plan import Arc, Plan, PushSegment, Rollout, Segment, SlideSegment, TableSegment, TransitSegment
from .scene import Object, Planning, Push, Pusher, Scene, StartRegion, Uncertainty, Workspace

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
    "Segment",
    "SlideSegment",
    "StartRegion",
    "TableSegment",
    "TransitSegment",
    "Uncertainty",
    "Workspace",
]
