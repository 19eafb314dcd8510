"""Writes a drawing as an SVG or a PNG file; the ending of the file name says which."""

from pathlib import Path

from ..documents.atomic import write_atomically
from ..errors import InputError
from .drawing import Drawing

ENDINGS = (".svg", ".png")


def save_picture(drawing: Drawing, path: str | Path) -> None:
    """Writes a drawing, whole or not at all.

    Raises:
        InputError: if the ending is another, or the file cannot be written.
    """
    write_atomically(path, encoded(drawing, check_ending(path, ENDINGS)))


def encoded(drawing: Drawing, ending: str) -> bytes:
    """The drawing as ".svg" or ".png"."""
    if ending == ".svg":
        from .svg import svg_text

        return svg_text(drawing).encode("utf-8")
    from .raster import png_bytes

    return png_bytes(drawing)


def check_ending(path: str | Path, endings: tuple[str, ...] = ENDINGS) -> str:
    """The ending of a file name in lower case, if it is one of these."""
    ending = Path(path).suffix.lower()
    if ending not in endings:
        raise InputError(
            f"the name of a figure ends in {', '.join(endings[:-1])} or {endings[-1]}",
            source=str(path),
            value=ending or "no ending",
        )
    return ending
