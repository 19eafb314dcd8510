"""What a plan looks like: figures, animations and sketches of pushes."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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

# Loaded when asked for: who draws a plan needs nothing of the others.
_HOME = {
    "PushSketch": "push_sketch",
    "check_figure": "figure",
    "check_snapshots": "snapshots",
    "describe_figure": "push_figure",
    "save_figure": "figure",
    "save_snapshots": "snapshots",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)
