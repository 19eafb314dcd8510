"""Frames from files, from a video, or from a camera that is plugged in."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Self

import numpy as np

from ..errors import InputError
from .extra import opencv
from .eyes import Frame
from .tags import Picture

VIDEOS = (".mp4", ".avi", ".mkv", ".mov", ".webm")
# A camera that gives no frame for so long is gone [s].
SILENT = 2.0
# Frames that wait to be taken; older ones are dropped.
WAITING = 4


def read_picture(path: str | Path) -> Picture:
    """The picture in a file, in grey levels, shape (height, width).

    Raises:
        InputError: if there is none.
    """
    cv2 = opencv()
    if not Path(path).is_file():
        raise InputError("the file cannot be read (no such file)", source=str(path))
    try:
        content = np.frombuffer(Path(path).read_bytes(), dtype=np.uint8)
        picture = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if len(content) else None
    except (OSError, cv2.error) as error:
        raise InputError(f"the file cannot be read ({error})", source=str(path)) from None
    if picture is None:
        raise InputError("this file holds no picture", source=str(path), hint="Give .png or .jpg files.")
    return np.asarray(picture, dtype=np.uint8)


def recorded(paths: Sequence[str | Path], rate: float = 30.0) -> Iterator[Frame]:
    """The frames of picture files, in their order at a rate [Hz], or of one video file with its own times [s].

    Raises:
        InputError: for a file that is none, and a video without frames.
    """
    if len(paths) == 1 and Path(paths[0]).suffix.lower() in VIDEOS:
        yield from _video(str(paths[0]), rate)
        return
    for k, path in enumerate(paths):
        yield Frame(k / rate, read_picture(path))


def _video(path: str, rate: float) -> Iterator[Frame]:
    cv2 = opencv()
    if not Path(path).is_file():
        raise InputError("the file cannot be read (no such file)", source=path)
    film = cv2.VideoCapture(path)
    try:
        number = 0
        own = float(film.get(cv2.CAP_PROP_FPS)) or rate
        while True:
            there, picture = film.read()
            if not there:
                break
            yield Frame(number / own, _grey(picture))
            number += 1
        if not number:
            raise InputError("this video has no frame that can be read", source=path)
    finally:
        film.release()


class Device:
    """A camera that is plugged in; a thread takes its frames as they come.

    Args:
        number: of the camera, as the system counts them. latency: from the exposure of a frame to its arrival here [s].
        size: of its pictures [px], which is asked of it. now: a clock of this machine [s], for the age of frames.

    Raises:
        InputError: on entering, for a camera that is not there.
    """

    def __init__(
        self,
        number: int,
        latency: float,
        size: tuple[int, int] | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._number, self._now, self._latency, self._size = number, now, latency, size
        self._waiting: list[Frame] = []
        self._lock, self._over = threading.Lock(), threading.Event()
        self._last = 0.0
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        cv2 = opencv()
        self._camera = cv2.VideoCapture(self._number)
        if not self._camera.isOpened():
            raise InputError("there is no such camera", key="camera", value=self._number)
        if self._size is not None:
            self._camera.set(cv2.CAP_PROP_FRAME_WIDTH, self._size[0])
            self._camera.set(cv2.CAP_PROP_FRAME_HEIGHT, self._size[1])
        self._last = self._now()
        self._thread = threading.Thread(target=self._take, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join(SILENT)
        self._camera.release()

    def _take(self) -> None:
        while not self._over.is_set():
            there, picture = self._camera.read()
            if there:
                stamp = self._now() - self._latency
                with self._lock:
                    self._waiting = [*self._waiting[1 - WAITING :], Frame(stamp, _grey(picture))]
                    self._last = self._now()
            else:
                self._over.wait(0.01)

    def taken(self, until: float) -> Iterator[Frame]:
        """The frames that have come, with stamps on the clock whose time is `until` now [s].

        Raises:
            InputError: if none has come for too long.
        """
        with self._lock:
            frames, self._waiting = self._waiting, []
            now = self._now()
            silent = now - self._last
        if not frames and silent > SILENT:
            raise InputError(f"the camera gave no frame for {silent:.1f} s", key="camera", value=self._number)
        for frame in frames:
            yield Frame(until + frame.stamp - now, frame.picture)


def _grey(picture: Picture) -> Picture:
    if picture.ndim == 2:
        return picture
    cv2 = opencv()
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
