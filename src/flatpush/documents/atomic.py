"""Writes a file whole or not at all."""

import os
from pathlib import Path
from uuid import uuid4

from ..errors import InputError


def write_atomically(path: str | os.PathLike[str], data: str | bytes) -> None:
    """Writes text (UTF-8) or bytes to a file that appears complete or not at all, and keeps an old one until
    then.

    The data go to a temporary file in the same folder, which then takes the name; it is removed if anything
    fails, an interrupt or a full disk included. What is not a regular file (a pipe, /dev/stdout) is written
    to directly.

    Raises:
        InputError: if the file cannot be written; it says why.
    """
    content = data.encode("utf-8") if isinstance(data, str) else data
    target = Path(os.path.realpath(path))
    part = target.with_name(f".{target.name[:100]}.{uuid4().hex[:8]}.part")
    try:
        if target.exists() and not target.is_file() and not target.is_dir():
            target.write_bytes(content)
            return
        if target.is_dir():
            raise IsADirectoryError(21, "it is a directory")
        try:
            with open(part, "xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            if target.exists():
                os.chmod(part, target.stat().st_mode & 0o7777)
            os.replace(part, target)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
    except (OSError, ValueError) as error:
        raise _refusal(path, getattr(error, "strerror", None) or str(error)) from error


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuses a place that write_atomically could not write to, before work is spent on what goes there.

    Raises:
        InputError: if it is a directory, or its folder does not exist or may not be written to.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise _refusal(path, "it is a directory")
    if not target.parent.is_dir():
        raise _refusal(path, "no such folder")
    if not os.access(target if target.exists() and not target.is_file() else target.parent, os.W_OK):
        raise _refusal(path, "permission denied")


def _refusal(path: str | os.PathLike[str], reason: str) -> InputError:
    folder = Path(path).parent
    hint = "Choose another place or free some space."
    if not folder.is_dir():
        hint = f"There is no folder {str(folder)!r}."
    return InputError(
        f"this file cannot be written ({reason.lower()}); nothing was written",
        source=os.fspath(path),
        hint=hint,
    )
