"""What a plan looks like: figures, animations and sketches of pushes. matplotlib is imported only to draw."""

from .describe import PushSketch, describe_figure
from .figure import check_figure, save_figure

__all__ = ["PushSketch", "check_figure", "describe_figure", "save_figure"]
