"""Stores the arrays of a tree under the key of what it was built for: in a file of the user's, or in the cache.

A file is a numpy archive (.npz, nothing pickled) with the format, the key and the arrays. The cache is a
folder of such files named by their keys: `FLATPUSH_CACHE` if set, else the platform's folder for caches
(`XDG_CACHE_HOME`). Whatever happens to it costs time only: what cannot be read is built again, and what
cannot be written is not kept.
"""

import io
import os
import sys
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from .atomic import write_atomically

FORMAT = "flatpush tree/1"
LIMIT = 200e6  # of the cache [bytes]; the files not used for longest go first
Arrays = Mapping[str, np.ndarray]


def save_arrays(arrays: Arrays, path: str | os.PathLike[str], key: str) -> None:
    """Writes arrays and their key to a file that appears whole or not at all.

    Raises:
        InputError: if it cannot be written.
    """
    buffer = io.BytesIO()
    np.savez(buffer, format=np.array(FORMAT), key=np.array(key), **arrays)  # type: ignore[arg-type]
    write_atomically(path, buffer.getvalue())


def load_arrays(path: str | os.PathLike[str], key: str) -> dict[str, np.ndarray]:
    """The arrays in a file that save_arrays wrote with the same key.

    Raises:
        InputError: if the file cannot be read, is no tree or is damaged, or belongs to another key.
    """
    source = os.fspath(path)
    hint = "Give another file, or delete it: it will be built again."
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"this file cannot be read ({reason})", source=source) from error
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            found = {name.removesuffix(".npy"): _array(archive.read(name)) for name in archive.namelist()}
    except (
        OSError,
        ValueError,
        KeyError,
        EOFError,
        zipfile.BadZipFile,
        zlib.error,
        NotImplementedError,
    ) as error:
        raise InputError("this file is damaged, or not a tree", source=source, hint=hint) from error
    form, owner = (str(found.pop(name, "")) for name in ("format", "key"))
    if form != FORMAT:
        raise InputError(f"a tree file has the format {FORMAT!r}", source=source, value=form, hint=hint)
    if owner != key:
        raise InputError(
            "this tree was built for another scene, goal, cost, set of poses or version",
            source=source,
            hint=hint,
        )
    return found


def cached_arrays(key: str, build: Callable[[], Arrays]) -> Arrays:
    """The arrays that the cache keeps under a key; built, and kept, if it has none or they cannot be read.

    Several processes may use the cache at once: files appear whole, and the last one to build writes.
    """
    file = cache_folder() / "trees-1" / f"{key}.npz"
    try:
        arrays: Arrays = load_arrays(file, key)
        os.utime(file)
        return arrays
    except (InputError, OSError):
        pass
    arrays = build()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        save_arrays(arrays, file, key)
        _shrink(file.parent, keep=file)
    except (InputError, OSError):
        pass  # a full or read-only disk
    return arrays


def cache_folder() -> Path:
    """Where flatpush keeps what it can build again."""
    own, shared = os.environ.get("FLATPUSH_CACHE"), os.environ.get("XDG_CACHE_HOME")
    if own:
        return Path(own)
    if shared and os.path.isabs(shared):
        return Path(shared) / "flatpush"
    if sys.platform == "win32":
        return (
            Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "flatpush" / "Cache"
        )
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "flatpush"
    return Path.home() / ".cache" / "flatpush"


def _array(content: bytes) -> np.ndarray:
    return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)


def _shrink(folder: Path, keep: Path) -> None:
    """Removes the files not used for longest until the folder is within its limit; another process may be at it too."""
    files = []
    for file in folder.iterdir():
        try:
            about = file.stat()
        except OSError:
            continue
        files.append((about.st_mtime, about.st_size, file))
    total = sum(size for _, size, _ in files)
    for _, size, file in sorted(files):
        if total <= LIMIT:
            return
        if file != keep:
            file.unlink(missing_ok=True)
            total -= size
