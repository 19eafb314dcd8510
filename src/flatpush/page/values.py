"""Values that come in a message."""

from collections.abc import Mapping

from ..arguments import vector
from ..errors import InputError
from ..geometry.pose import Array


def numbers_of(value: Mapping[str, object], key: str, count: int) -> Array:
    """So many finite numbers; InputError for anything else."""
    return vector(value.get(key), count, f"{count} finite numbers are needed", key)  # type: ignore[arg-type]


def number_of(value: Mapping[str, object], key: str) -> float:
    """A finite number; InputError for anything else."""
    return float(vector([value.get(key)], 1, "a finite number is needed", key)[0])  # type: ignore[arg-type]


def whole_of(value: Mapping[str, object], key: str, least: int, most: int) -> int:
    """A whole number in a range; InputError for anything else."""
    found = value.get(key)
    if isinstance(found, bool) or not isinstance(found, int) or not least <= found <= most:
        raise InputError(f"a whole number from {least} to {most} is needed", key=key, value=found)
    return found


def scene_of(value: Mapping[str, object]) -> dict[str, object]:
    """The document of a scene; InputError for anything else."""
    found = value.get("scene")
    if not isinstance(found, dict):
        raise InputError("a scene is a mapping of keys to values", key="scene", value=found)
    return found
