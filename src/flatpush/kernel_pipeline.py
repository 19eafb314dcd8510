"""How numba compiles a function that only kernels call: as far as its callers need it, and no further.

By itself numba optimises such a function, generates machine code for it that nobody calls, and optimises it again in
each kernel that it is linked into. That, and looking up anew for each `a + b` which of a hundred additions it is, was
a quarter of what compiling cost.
"""

import importlib
from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.types.functions import BaseFunction
from numba.np import linalg


class Within(Compiler):
    """Compiles a function that only kernels call."""

    def define_pipelines(self) -> list[PassManager]:
        (usual,) = super().define_pipelines()
        own = PassManager("within kernels")
        own.passes = [(_LowerWithin if step is NativeLowering else step, text) for step, text in usual.passes]
        own.finalize()
        return [own]


@register_pass(mutates_CFG=True, analysis_only=False)
class _LowerWithin(NativeLowering):
    """Makes code that can be linked into a caller, and tells the target how to call it."""

    _name = "lowering_within_kernels"

    def run_pass(self, state: Any) -> bool:
        library = state["library"] = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        entry = object().__reduce__  # numba wants a builtin to know the function by; nobody calls it
        state.cr = state.cr._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, state.cr.fndesc, [library])
        return True


class _Linked(JITCodeLibrary):
    """Code that is optimised, and becomes machine code, only in who links it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


def _remember_operators() -> None:
    """Lets numba look up once what an operator gives for numbers of given types."""
    look_up, found = BaseFunction.get_call_type, {}

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        plain = all(type(arg) in (types.Float, types.Integer, types.Boolean) for arg in args)
        if not plain or getattr(self.typing_key, "__module__", "") != "_operator":
            return look_up(self, context, args, kws)
        key = self, context, tuple(args)
        if key not in found:
            found[key] = look_up(self, context, args, kws)
        return found[key]

    BaseFunction.get_call_type = get_call_type  # type: ignore[method-assign]


def _ask_for_blas_when_needed() -> None:
    """Imports numba's functions of arrays without scipy.linalg, a tenth of a warm start.

    While it is imported numba only wants to know that scipy is there; functions that use BLAS ask again.
    """
    ask, linalg.ensure_blas = linalg.ensure_blas, lambda: None
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = ask


_remember_operators()
_ask_for_blas_when_needed()
