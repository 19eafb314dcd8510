"""Whether two scenes are the same: a digest of one, and the differences of two."""

import hashlib
import json
import math
from typing import Any, NamedTuple

from ..problem import Scene
from .reading import join
from .scene_writer import scene_document

# Units and drawings bring numbers back to rounding.
RELATIVE, ABSOLUTE = 1e-12, 1e-15

EFFORT = ("seed", "iterations", "time_limit")


class SceneDifference(NamedTuple):
    """A key of the scene document with what one scene and the other have there, in SI; None where it has nothing."""

    key: str
    found: object
    wanted: object


def scene_digest(scene: Scene) -> str:
    """The SHA-256 of the scene as a document, in hexadecimal.

    Raises:
        InputError: for a scene that no document can hold.
    """
    text = json.dumps(scene_document(scene), sort_keys=True, ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def scene_differences(found: Scene, wanted: Scene) -> list[SceneDifference]:
    """All places in which two scenes differ.

    How long and with what seed a plan is sought says nothing of the plan and is not compared. Where the wanted scene
    leaves the pushes to the planner ("auto"), any places are right, with the fingers and the spacing of its pusher.
    """
    a: dict[str, Any] = scene_document(found)
    b: dict[str, Any] = scene_document(wanted)
    if b["pushes"] == "auto" and a["pushes"] != "auto":
        spacing = wanted.pusher.spacing if wanted.pusher.fingers == 2 else 0.0
        b["pushes"] = [{**p, "fingers": wanted.pusher.fingers, "spacing": spacing} for p in a["pushes"]]
    for key in EFFORT:
        del a["planning"][key], b["planning"][key]
    differences: list[SceneDifference] = []
    _compare(a, b, "", differences)
    return differences


def _compare(a: Any, b: Any, key: str, differences: list[SceneDifference]) -> None:
    if isinstance(a, dict) and isinstance(b, dict):
        for name in dict.fromkeys([*a, *b]):
            _compare(a.get(name), b.get(name), join(key, name), differences)
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            _compare(x, y, join(key, i), differences)
    elif not _same(a, b):
        differences.append(SceneDifference(key, a, b))


def _same(a: Any, b: Any) -> bool:
    numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (a, b))
    return math.isclose(a, b, rel_tol=RELATIVE, abs_tol=ABSOLUTE) if numbers else bool(a == b)
