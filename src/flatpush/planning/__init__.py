"""From a scene to a plan: push points, one push or many, transits."""

from .candidates import automatic_pushes
from .controllability import controllability
from .description import PushDescription, describe
from .options import PushOption, push_options
from .planner import Planner, plan

__all__ = [
    "Planner",
    "PushDescription",
    "PushOption",
    "automatic_pushes",
    "controllability",
    "describe",
    "plan",
    "push_options",
]
