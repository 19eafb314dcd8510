"""What the physics cell looks like while a plan runs: a film without ffmpeg, or a window where there is a display."""

import base64
import io
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ...documents.atomic import write_atomically
from ...errors import InputError
from ..run import Cycle

if TYPE_CHECKING:
    from .robot import CellRobot

ENDINGS = (".gif", ".html")
SIZE = (480, 640)  # of a film [px]
# A picture comes so often, and is shown so long: three times as fast as it was [s]. A window is drawn so often [s].
EVERY, SHOWN, DRAWN = 0.24, 0.08, 1 / 30


def check_film(path: Path) -> None:
    """Refuses the name of a film that is none."""
    if path.suffix.lower() not in ENDINGS:
        raise InputError("a film of the cell ends in .gif or .html", source=str(path))


@contextmanager
def film(robot: "CellRobot", path: Path) -> Iterator[Callable[[Cycle], None]]:
    """What run() is to tell each cycle; afterwards, also of a run that was broken off, the film is written.

    Raises:
        InputError: for another ending than .gif and .html, or a place that cannot be written to.
    """
    from PIL import Image

    check_film(path)
    images: list[Image.Image] = []
    with robot.pictures(*SIZE) as drawn:

        def told(cycle: Cycle) -> None:
            if cycle.time >= EVERY * len(images):
                picture = Image.fromarray(drawn())
                images.append(picture.quantize(dither=Image.Dither.NONE))

        try:
            yield told
        finally:
            if images:
                file = io.BytesIO()
                how = {"duration": round(1000 * SHOWN), "loop": 0}
                images[0].save(file, format="GIF", save_all=True, append_images=images[1:], **how)
                write_atomically(path, _page(path, file.getvalue()))


def _page(path: Path, gif: bytes) -> str | bytes:
    """The film itself, or a page with it that needs no other file."""
    if path.suffix.lower() == ".gif":
        return gif
    data = base64.b64encode(gif).decode("ascii")
    title = escape(path.stem)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
        f'<img alt="A plan in the physics cell" src="data:image/gif;base64,{data}"></html>\n'
    )


@contextmanager
def window(robot: "CellRobot") -> Iterator[Callable[[Cycle], None]]:
    """What run() is to tell each cycle, so that a window shows the cell, no faster than it would be.

    Raises:
        InputError: where there is no display.
    """
    with robot.viewer() as shown:
        begun, last = time.monotonic(), -DRAWN

        def told(cycle: Cycle) -> None:
            nonlocal last
            if cycle.time - last >= DRAWN:
                last = cycle.time
                shown()
                time.sleep(max(0.0, begun + cycle.time - time.monotonic()))

        yield told
