"""From a scene to a plan: push points, one push, timing."""

from .candidates import automatic_pushes
from .describe import PushDescription, describe
from .options import PushOption, push_options
from .plan import plan

__all__ = ["PushDescription", "PushOption", "automatic_pushes", "describe", "plan", "push_options"]
