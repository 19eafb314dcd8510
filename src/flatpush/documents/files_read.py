"""Which files a scene and a plan were read from: what no output may overwrite."""

import os
from collections.abc import Mapping
from pathlib import Path

from .reading import read_mapping


def scene_files(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """The scene file and all files that it refers to, which no output may overwrite.

    Raises:
        InputError: if the scene file cannot be read.
    """
    found = [Path(path)]

    def visit(value: object) -> None:
        if isinstance(value, Mapping):
            for key, item in value.items():
                if key == "file" and isinstance(item, str):
                    found.append(Path(path).parent / item)
                visit(item)
        elif isinstance(value, list):
            for item in value:
                visit(item)

    visit(read_mapping(path))
    return tuple(found)


def as_read(scene: str | os.PathLike[str], plan: str | os.PathLike[str]) -> list[str]:
    """The files of a scene as seen from the folder of a plan file: what the plan's `run` has under "read".

    Raises:
        InputError: as scene_files.
    """
    folder = Path(os.path.realpath(plan)).parent
    return [_seen_from(folder, os.path.realpath(path)) for path in scene_files(scene)]


def plan_files(plan: str | os.PathLike[str], run: Mapping[str, object]) -> tuple[Path, ...]:
    """A plan file and all files that its scene was read from, as its `run` tells; no output may overwrite them."""
    names = run.get("read")
    folder = Path(os.path.realpath(plan)).parent
    read = [name for name in names if isinstance(name, str)] if isinstance(names, list) else []
    return Path(plan), *(folder / name for name in read)


def _seen_from(folder: Path, path: str) -> str:
    try:
        return os.path.relpath(path, folder)
    except ValueError:  # on another drive
        return path
