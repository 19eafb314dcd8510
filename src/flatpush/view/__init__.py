"""What a plan looks like: figures, animations and sketches of pushes."""

from .figure import check_figure, save_figure
from .push_figure import describe_figure
from .push_sketch import PushSketch
from .snapshots import check_snapshots, save_snapshots

__all__ = [
    "PushSketch",
    "check_figure",
    "check_snapshots",
    "describe_figure",
    "save_figure",
    "save_snapshots",
]
