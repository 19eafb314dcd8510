"""The libraries of the extra `vision`, loaded where they are needed."""

import os
from types import ModuleType

from ..errors import MissingExtra

HINT = 'a camera needs OpenCV and AprilTag: pip install "flatpush[vision]"'


def opencv() -> ModuleType:
    """OpenCV.

    Raises:
        MissingExtra: if it is not installed.
    """
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")  # what goes wrong is told in our words
    try:
        import cv2
    except ImportError:
        raise MissingExtra(HINT) from None
    return cv2


def apriltags() -> ModuleType:
    """pyapriltags.

    Raises:
        MissingExtra: if it is not installed.
    """
    try:
        import pyapriltags
    except ImportError:
        raise MissingExtra(HINT) from None
    return pyapriltags
