"""A scene file with another support and friction, everything else as it was written."""

import os
from pathlib import Path
from typing import Any

import yaml

from ..friction import LimitSurface, Support
from .atomic import write_atomically
from .context import PER_METRE
from .reading import read_mapping
from .surface_file import surface_form


def save_fitted_scene(
    scene: str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    support: Support | None = None,
    friction: float | None = None,
    surface: LimitSurface | None = None,
    loads: float = 0.0,
    note: str = "",
) -> None:
    """Writes the scene of a file with what was found of its friction, in the file's own units.

    A limit surface takes the place of a known one, and a support too, as it now says it; paths stay those of the same
    files.

    Args:
        scene: the file that is changed. path: what is written.
        support: on feet, in O [m]. friction: coefficient between fingertip and object.
        surface: about the centre of friction, SI.
        loads: the share by which the loads may differ, see Uncertainty.
        note: comments at the top, lines.

    Raises:
        InputError: if the scene cannot be read or the file not be written.
    """
    document: dict[str, Any] = dict(read_mapping(scene))
    units = document.get("units") or {}
    per_metre = PER_METRE[units.get("length", "m")]
    thing = dict(document["object"])
    if support is not None or surface is not None:
        thing.pop("surface", None)
    if surface is not None:
        thing["surface"] = surface_form(surface)
    if support is not None:
        thing["support"] = _feet(support, per_metre)
    if friction is not None:
        thing["friction"] = float(f"{friction:.6g}")
        known = dict(thing.get("uncertainty") or {})
        if known.get("friction"):  # a range holds the coefficient
            low, high = known["friction"]
            known["friction"] = [min(low, thing["friction"]), max(high, thing["friction"])]
        if loads > 0:
            known["loads"] = loads
        if known:
            thing["uncertainty"] = known
    outline = thing.get("outline")
    if isinstance(outline, dict) and "file" in outline:
        drawing = Path(scene).parent / str(outline["file"])
        thing["outline"] = {**outline, "file": os.path.relpath(drawing, Path(path).parent)}
    document["object"] = thing
    head = "".join(f"# {line}\n" for line in note.splitlines())
    text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)
    write_atomically(path, head + text)


def _feet(support: Support, per_metre: float) -> dict[str, Any]:
    points, weights = support.feet
    shares = weights / weights.sum()
    table = [
        [round(float(x) * per_metre, 9), round(float(y) * per_metre, 9), float(f"{share:.6g}")]
        for (x, y), share in zip(points, shares, strict=True)
    ]
    return {"points": table}
