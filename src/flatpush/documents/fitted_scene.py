"""A scene file with another support and friction, everything else as it was written."""

import os
from pathlib import Path
from typing import Any

import yaml

from ..friction import Support
from .atomic import write_atomically
from .context import PER_METRE
from .reading import read_mapping


def save_fitted_scene(
    scene: str | os.PathLike[str],
    path: str | os.PathLike[str],
    support: Support,
    friction: float,
    note: str = "",
) -> None:
    """Writes the scene of a file with a support on feet and a friction that were found, in the file's own units.

    A known limit surface is dropped, as the support now says it; paths stay those of the same files.

    Args:
        scene: the file that is changed. path: what is written.
        support: on feet, in O [m]. friction: between fingertip and object.
        note: comments at the top, lines.

    Raises:
        InputError: if the scene cannot be read or the file not be written.
    """
    document: dict[str, Any] = dict(read_mapping(scene))
    units = document.get("units") or {}
    per_metre = PER_METRE[units.get("length", "m")]
    thing = dict(document["object"])
    thing.pop("surface", None)
    points, weights = support.feet
    total = float(weights.sum())
    thing["support"] = {
        "points": [
            [round(float(x) * per_metre, 9), round(float(y) * per_metre, 9), float(f"{w / total:.6g}")]
            for (x, y), w in zip(points, weights, strict=True)
        ]
    }
    thing["friction"] = float(f"{friction:.6g}")
    outline = thing.get("outline")
    if isinstance(outline, dict) and "file" in outline:
        drawing = Path(scene).parent / str(outline["file"])
        thing["outline"] = {**outline, "file": os.path.relpath(drawing, Path(path).parent)}
    document["object"] = thing
    head = "".join(f"# {line}\n" for line in note.splitlines())
    text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)
    write_atomically(path, head + text)
