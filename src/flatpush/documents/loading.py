"""Opens the documents that commands begin with, a scene and a plan.

A file that cannot be read or parsed is refused before geometry, friction and the models are imported: only a document
that can be needs them. Commands import what they do with it after it is read, for the same reason.
"""

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from .reading import MOST_BYTES_OF_SCENE, read_mapping

if TYPE_CHECKING:
    from ..problem import Plan, Scene

# Samples make plans longer than scenes.
MOST_BYTES_OF_PLAN = 200_000_000


def load_scene(
    path: str | os.PathLike[str], changes: Mapping[str, object] | None = None, *, unknown: bool = False
) -> "Scene":
    """The scene in a YAML or JSON file, in SI.

    Args:
        path: of the file.
        changes: keys of the document that take the place of the file's, in the file's units, as
            {"start": [60, 20, 135], "planning": {"seed": 3}}; mappings replace only the keys that they hold.
        unknown: whether a scene is read that does not know where the object presses (support: unknown).

    Raises:
        InputError: for anything wrong with the file; it names the file, key, value, rule and a hint.
        MissingExtra: if the outline is a drawing and the extra "shapes" is not installed.
    """
    document = _merged(read_mapping(path, MOST_BYTES_OF_SCENE), changes or {})
    from .scene_reader import parse_scene

    return parse_scene(document, os.fspath(path), unknown=unknown)


def load_plan(path: str | os.PathLike[str]) -> "Plan":
    """The plan in a file that save_plan wrote. Its claims are not checked: that is verify's task.

    Raises:
        InputError: for anything wrong with the file; it names the file, the key, the value, the rule and a
            hint.
    """
    document = read_mapping(path, MOST_BYTES_OF_PLAN, MOST_BYTES_OF_PLAN)
    from .plan_file import parse_plan

    return parse_plan(document, os.fspath(path))


def _merged(document: Any, changes: Mapping[str, object]) -> Any:
    result = dict(document)
    for key, value in changes.items():
        old = result.get(key)
        result[key] = _merged(old, value) if isinstance(old, dict) and isinstance(value, Mapping) else value
    return result
