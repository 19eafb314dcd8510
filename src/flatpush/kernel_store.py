"""Where compiled kernels are kept between runs: a file each, which is whole and unharmed or does not count.

The folder is `flatpush-kernels` in `NUMBA_CACHE_DIR` if that is set, else in the user's folder for caches
(`XDG_CACHE_HOME`, by default ~/.cache). A file begins with a digest of the rest. What one process compiles, others that
want the same wait for and read: see `claim`.
"""

import hashlib
import os
import tempfile
import time
import warnings
from contextlib import suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: two processes then may compile the same
    fcntl = None  # type: ignore[assignment]

DIGEST_BYTES = 16
DAY = 86400.0  # [s]
KEPT = 60 * DAY  # unused for so long, a file is removed

WAIT = 300.0  # for another process that compiles the same [s]; the longest kernel takes a tenth of it
GLANCE = 0.02  # between two looks whether it is ready [s]

_told = False
_claims: dict[str, int] = {}  # name → handle of the locked file


def folder() -> Path | None:
    """The folder, which need not exist; None where the user has no home."""
    named = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    with suppress(RuntimeError):
        return Path(named or Path.home() / ".cache") / "flatpush-kernels"
    return None


def load(name: str) -> bytes | None:
    """What was kept under a name; None if nothing was, or if it is damaged: then it is thrown away."""
    place = folder()
    if place is None:
        return None
    path = place / name
    try:
        content = path.read_bytes()
        if time.time() - path.stat().st_mtime > DAY:
            with suppress(OSError):
                os.utime(path)
    except OSError:
        return None
    digest, data = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
    if digest == _digest(data):
        return data
    discard(name)
    return None


def save(name: str, data: bytes) -> None:
    """Keeps data under a name, whole or not at all. Where nothing can be kept, one warning says so."""
    place = folder()
    try:
        if place is None:
            raise OSError("there is no home folder")
        place.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=place)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(_digest(data) + data)
            os.replace(temporary, place / name)
        except BaseException:
            os.unlink(temporary)
            raise
        _prune(place)
    except OSError as error:
        _tell_once(place, error)


def claim(name: str, patience: float = 0.0) -> bool:
    """Asks to be the one process that makes what is kept under a name; the claim ends with `release` or the process.

    Args:
        patience: how long to wait while another process has it [s].

    Returns:
        False if another process still has it. Where files cannot be locked everyone may.
    """
    place = folder()
    if fcntl is None or place is None or name in _claims:
        return True
    try:
        place.mkdir(parents=True, exist_ok=True)
        handle = os.open(place / f"{name}.lock", os.O_CREAT | os.O_RDWR)
    except OSError:
        return True
    until = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() < until:
                time.sleep(GLANCE)
                continue
            os.close(handle)
            return False
        except OSError:  # a file system without locks
            os.close(handle)
            return True
        _claims[name] = handle
        return True


def release(name: str) -> None:
    """Ends a claim, if there is one."""
    handle = _claims.pop(name, None)
    if handle is not None:
        discard(f"{name}.lock")
        fcntl.flock(handle, fcntl.LOCK_UN)
        os.close(handle)


def discard(name: str) -> None:
    """Forgets what was kept under a name."""
    place = folder()
    if place is not None:
        with suppress(OSError):
            (place / name).unlink()


def _digest(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=DIGEST_BYTES).digest()


def _prune(place: Path) -> None:
    """Removes what no run has used for a long time, such as kernels of former versions."""
    for path in place.iterdir():
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > KEPT:
                path.unlink()


def _tell_once(place: Path | None, error: OSError) -> None:
    global _told
    if not _told:
        _told = True
        warnings.warn(
            f"compiled kernels cannot be kept in {place} ({error.strerror or error}), so each run compiles them;"
            " set NUMBA_CACHE_DIR to a folder that can be written",
            RuntimeWarning,
            stacklevel=2,
        )
