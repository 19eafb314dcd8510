"""From a scene to a plan: push points, one push or many, transits, timing."""

from .candidates import automatic_pushes
from .description import PushDescription, describe
from .freedom import freedom
from .options import PushOption, push_options
from .planner import Planner, plan

__all__ = [
    "Planner",
    "PushDescription",
    "PushOption",
    "automatic_pushes",
    "describe",
    "freedom",
    "plan",
    "push_options",
]
