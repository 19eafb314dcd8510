"""What a plan looks like: figures, animations and sketches of pushes. matplotlib is imported only to draw."""

from .describe import PushSketch, describe_figure
from .figure import check_figure, save_figure
from .snapshots import check_snapshots, save_snapshots

__all__ = [
    "PushSketch",
    "check_figure",
    "check_snapshots",
    "describe_figure",
    "save_figure",
    "save_snapshots",
]
