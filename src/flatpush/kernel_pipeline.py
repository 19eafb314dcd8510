"""How numba compiles kernels: without passes that they do not need, and what only kernels call no further than needed.

By itself numba optimises a function that only kernels call, generates machine code for it that nobody calls, and
optimises it again in each kernel that it is linked into. That, and looking up anew for each `a + b` which of a hundred
additions it is, was a third of what compiling cost.
"""

import importlib
from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering, NopythonRewrites
from numba.core.types.containers import BaseTuple
from numba.core.types.functions import BaseFunction
from numba.core.untyped_passes import InlineClosureLikes
from numba.np import linalg

_VALUES = types.Number, types.Boolean, types.Literal, types.Array, BaseTuple, types.Record


class Direct(Compiler):
    """Compiles a kernel, in which there are no closures or comprehensions, and no arithmetic of whole arrays."""

    lowering: type[NativeLowering]

    def define_pipelines(self) -> list[PassManager]:
        (usual,) = super().define_pipelines()
        own = PassManager("kernel")
        own.passes = [
            (self.lowering if step is NativeLowering else step, text)
            for step, text in usual.passes
            if step not in (InlineClosureLikes, NopythonRewrites)
        ]
        own.finalize()
        return [own]


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lower(NativeLowering):
    """Makes machine code, optimised once."""

    _name = "lowering_of_kernels"

    def run_pass(self, state: Any) -> bool:
        state["library"] = _Once(state.targetctx.codegen(), state.func_id.func_qualname)
        state["library"].enable_object_caching()
        return super().run_pass(state)


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


class Within(Direct):
    """Compiles a function that only kernels call."""

    lowering = _LowerWithin


class Vectorised(Direct):
    """Compiles a kernel whose loops become vectors, for which numba's own two rounds of optimising do better."""

    lowering = NativeLowering


Direct.lowering = _Lower


class _Once(JITCodeLibrary):
    """Machine code that is optimised when all of it is there, and only then."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        made = self._codegen._module_pass_manager()
        passes, *builder = made if isinstance(made, tuple) else (made,)  # by itself before numba 0.62
        passes.run(self._final_module, *builder)


class _Linked(_Once):
    """Code that is optimised, and becomes machine code, only in who links it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


def _remember_operators() -> None:
    """Lets numba look up once what an operator or a builtin gives for numbers, arrays and tuples of given types."""
    look_up, found = BaseFunction.get_call_type, {}

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        of_python = getattr(self.typing_key, "__module__", "") in ("_operator", "builtins")
        if not of_python or kws or not all(isinstance(arg, _VALUES) for arg in args):
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
