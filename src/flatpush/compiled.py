"""The one door to numba: how a kernel is compiled, and where what was compiled is kept.

Nothing else imports numba, and kernel files are imported only when they are needed, so that reading a file, printing
help or drawing never pays for a compiler.
"""

from collections.abc import Callable
from typing import TypeVar

import numba as nb

F = TypeVar("F", bound=Callable[..., object])

_PLAIN = {"error_model": "numpy"}
_WITHIN = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_FUSED = {
    "fastmath": {"contract"}
}  # contraction to multiply-and-add is the only liberty with floats that is taken


def kernel(signature: object = None, *, fused: bool = False) -> Callable[[F], F]:
    """Decorates a function that Python calls: kept on disk, without the interpreter's lock.

    With a signature it is compiled (or read from disk) when its module is imported, without one when it is called.
    """
    options = _PLAIN | (_FUSED if fused else {})
    return nb.njit(signature, cache=True, nogil=True, **options)


def inner(function: F) -> F:
    """Decorates a function that only kernels call: nothing is generated for Python."""
    return nb.njit(**_PLAIN, **_WITHIN)(function)


def block(function: F) -> F:
    """Decorates a piece of a loop that LLVM vectorises: inlined before it looks for vectors."""
    return nb.njit(forceinline=True, **_PLAIN, **_FUSED)(function)
