"""Writes a file whole or not at all."""

import os
from collections.abc import Sequence
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


def check_outputs(
    inputs: Sequence[str | os.PathLike[str] | None], outputs: Sequence[str | os.PathLike[str] | None]
) -> None:
    """Refuses outputs that would take the place of an input or of each other, through links too; None is no file.

    Raises:
        InputError: for the first of them, and as check_writable.
    """
    taken = {_identity(path): "an input of this command" for path in inputs if path is not None}
    for path in outputs:
        if path is None:
            continue
        check_writable(path)
        place = _identity(path)
        if place in taken and place is not None:
            raise InputError(
                f"this file is {taken[place]} too; nothing was written",
                source=os.fspath(path),
                hint="Choose another place.",
            )
        taken[place] = "another output"


def _identity(path: str | os.PathLike[str]) -> object:
    """What two names of one file share; None for what is no file (a pipe, /dev/stdout)."""
    real = Path(os.path.realpath(path))
    if real.exists() and not real.is_file():
        return None
    try:
        found = real.stat()
        return found.st_dev, found.st_ino
    except OSError:
        return str(real)


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
