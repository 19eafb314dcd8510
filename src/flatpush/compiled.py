"""The one door to numba: how a kernel is compiled, and where what was compiled is kept.

Nothing else imports numba, and kernel files are imported only when they are needed, so that reading a file, printing
help or drawing never pays for a compiler.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba as nb
from llvmlite import binding, ir  # type: ignore[import-untyped]
from numba.core import types
from numba.extending import intrinsic

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


def shared(returns: object, *examples: object) -> Callable[[F], F]:
    """Decorates a large function that many kernels call: compiled once, and called by its address.

    numba copies whatever a kernel calls into it and optimises it there anew, which for large callees is most of what
    compiling costs. Only kernels can call it; it must not raise. It is compiled, or read from disk, when its module is
    imported.

    Args:
        returns, examples: a value of the type that it returns, and of that of each argument.
    """

    def decorated(function: F) -> F:
        signature = nb.typeof(returns)(*(nb.typeof(example) for example in examples))
        made = nb.cfunc(signature, cache=True, **_PLAIN)(function)
        symbol = f"{function.__module__}.{function.__qualname__}"
        binding.add_symbol(symbol, made.address)

        def call(typingctx: object, *arguments: object) -> object:
            given = types.StarArgTuple.from_types(arguments)  # type: ignore[attr-defined]

            def generate(context: Any, builder: Any, types_: Any, values: Any) -> object:
                passed = [
                    context.cast(builder, builder.extract_value(values[0], i), have, want)
                    for i, (have, want) in enumerate(zip(types_.args[0], signature.args, strict=True))
                ]
                kind = ir.FunctionType(
                    context.get_value_type(signature.return_type),
                    [context.get_value_type(want) for want in signature.args],
                )
                known = builder.module.globals.get(symbol)
                return builder.call(known or ir.Function(builder.module, kind, symbol), passed)

            return signature.return_type(given), generate

        found = intrinsic(call)
        found.made = made  # its code must outlive its callers
        return found

    return decorated
