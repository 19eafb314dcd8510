"""A scene as the page holds it: a scene document in millimetres and degrees that refers to no file."""

import math
from collections.abc import Mapping
from typing import Any

from ..documents import scene_document
from ..documents.scene_reader import LENGTHS
from ..errors import InputError
from ..problem import Scene

DIGITS = 10  # that a number in millimetres is written with: no dust of the conversion, and nothing lost


def scene_in_mm(scene: Scene) -> dict[str, object]:
    """The document of a scene, everything filled in, in mm and degrees (a surface stays in SI)."""
    found: dict[str, Any] = scene_document(scene)
    thing, pusher, planning = found["object"], found["pusher"], found["planning"]
    thing["outline"] = _mm(thing["outline"])
    if isinstance(thing["support"], dict):
        feet = thing["support"].get("points")
        thing["support"] = (
            {"points": [[*_mm(foot[:2]), foot[2]] for foot in feet]} if feet else _mm(thing["support"])
        )
    if "uncertainty" in thing:
        known = thing["uncertainty"]
        known["offset"] = _mm(known["offset"])
        if "start" in known:
            known["start"] = {
                "position": _mm(known["start"]["position"]), "angle": _degrees(known["start"]["angle"])
            }  # fmt: skip
    for key in LENGTHS:
        pusher[key] = _mm(pusher[key])
    pusher["turn_rate"] = _degrees(pusher["turn_rate"])
    if found["pushes"] != "auto":
        for push in found["pushes"]:
            push["at"], push["spacing"] = _mm(push["at"]), _mm(push["spacing"])
            for key in ("fingers", "spacing"):  # what a push has as all have it follows the pusher's
                if push[key] == pusher[key]:
                    del push[key]
    for key in ("start", "goal"):
        x, y, angle = found[key]
        found[key] = [_mm(x), _mm(y), angle if angle == "free" else _degrees(angle)]
    found["workspace"] = _mm(found.get("workspace", {}))
    if planning["cost"] != "time":
        planning["switch_cost"] = _mm(planning["switch_cost"])
    planning["margin"]["clearance"] = _mm(planning["margin"]["clearance"])
    x, y, angle = planning["goal_tolerance"]
    planning["goal_tolerance"] = [_mm(x), _mm(y), _degrees(angle)]
    found["units"] = {"length": "mm", "angle": "deg"}
    return found


def refuse_files(value: object, key: str = "") -> None:
    """Refuses a document that names a file: what comes over a connection may not read this machine's.

    Raises:
        InputError: for the first key `file`.
    """
    if isinstance(value, Mapping):
        if "file" in value:
            raise InputError(
                "a scene that comes from a page names no files",
                key=f"{key}.file".lstrip("."),
                value=value["file"],
                hint="Drop the drawing itself on the page.",
            )
        for name, item in value.items():
            refuse_files(item, f"{key}.{name}".lstrip("."))
    elif isinstance(value, list):
        for item in value:
            refuse_files(item, key)


def _mm(value: Any) -> Any:
    """Every number of a value in mm instead of m."""
    if isinstance(value, dict):
        return {key: _mm(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_mm(item) for item in value]
    return _clean(1000.0 * value)


def _degrees(value: float) -> float:
    return _clean(math.degrees(value))


def _clean(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
