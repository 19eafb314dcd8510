"""The one door to numba: how a kernel is compiled, and by what it is recognised when it was compiled before.

Nothing else imports numba, kernel_pipeline.py excepted, and kernel files are imported only when they are needed, so
that reading a file, printing help or drawing never pays for a compiler.

numba's own cache knows a kernel by its file alone: it does not notice that a function in another file changed, dies of
a damaged file and needs a folder that it can write. Here a kernel is known by what it computes: its code, that of every
function it calls, wherever they stand, and the constants they read. Comments and other functions of a file do not
count. Where compiled kernels are kept: kernel_store.py.
"""

import enum
import hashlib
import pickle
import platform
from collections.abc import Callable, Iterator, Mapping
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar

import llvmlite
import numba as nb
import numpy as np
from llvmlite import binding, ir
from numba.core import caching, compiler, event, serialize, sigutils, types
from numba.core.ccallback import CFunc
from numba.core.dispatcher import Dispatcher
from numba.core.runtime.nrt import rtsys
from numba.extending import intrinsic, overload

from . import compiling, kernel_store
from .formulas import CHOICES, FORMULAS
from .kernel_pipeline import Direct, Vectorised, Within

F = TypeVar("F", bound=Callable[..., object])

_PLAIN = {"error_model": "numpy"}
_LENT = {"_nrt": False}  # no counting of references: arrays are the caller's, and nothing is allocated
_WITHIN = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": Within}
_FUSED = {
    "fastmath": {"contract"}
}  # contraction to multiply-and-add is the only liberty with floats that is taken


def kernel(signature: object = None, *, fused: bool = False, lent: bool = False) -> Callable[[F], F]:
    """Decorates a function that Python calls: kept on disk, without the interpreter's lock.

    With a signature it is compiled (or read from disk) when its module is imported, without one when it is called.
    It may be `fused` (multiply and add at once), and counts no references to arrays, which all are `lent` to it.
    """
    _learn_formulas()
    options = _PLAIN | (_FUSED if fused else {}) | (_LENT if lent else {})

    def decorate(function: F) -> F:
        pipeline = Vectorised if fused else Direct
        made = nb.njit(nogil=True, no_cfunc_wrapper=True, pipeline_class=pipeline, **options)(function)
        if isinstance(made, Dispatcher):  # NUMBA_DISABLE_JIT leaves functions as they are
            made._cache = _Kept(made)  # type: ignore[attr-defined]
            if signature is not None:
                made.compile(signature)
                made.disable_compile()
        return made

    return decorate


def inner(function: F) -> F:
    """Decorates a function that only kernels call: nothing is generated for Python."""
    return nb.njit(**_PLAIN, **_WITHIN)(function)


def block(function: F) -> F:
    """Decorates a piece of a loop that LLVM vectorises: inlined before it looks for vectors."""
    return nb.njit(forceinline=True, **_PLAIN, **_FUSED, **_WITHIN)(function)


def shared(returns: object, *examples: object, fused: bool = False) -> Callable[[F], F]:
    """Decorates a large function that many kernels call: compiled once, and called by its address.

    numba copies whatever a kernel calls into it and optimises it there anew, which for large callees is most of what
    compiling costs. Only kernels can call it; it must not raise. It is compiled, or read from disk, when its module is
    imported.

    Args:
        returns, examples: a value of the type that it returns, and of that of each argument.
        fused: multiply and add at once.
    """
    _learn_formulas()

    def decorated(function: F) -> F:
        signature = nb.typeof(returns)(*(nb.typeof(example) for example in examples))
        made = _Shared(
            function,
            (signature.args, signature.return_type),
            locals={},
            options=_PLAIN | (_FUSED if fused else {}),
            pipeline_class=Direct,
        )
        made._cache = _Kept(made)  # type: ignore[attr-defined]
        made.compile()
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
        found.symbol = symbol, signature
        return found

    return decorated


class _Shared(CFunc):
    """A function that is compiled by itself; who listens hears of it as of a kernel."""

    def _compile_uncached(self) -> Any:
        _begin(self)
        try:
            return super()._compile_uncached()  # type: ignore[misc]
        finally:
            compiling.end()


class _Kept(caching.NullCache):
    """What a compiled function asks before it compiles and tells when it has, once for each set of argument types."""

    def __init__(self, compiled: Any) -> None:
        self._compiled = compiled  # a Dispatcher or a CFunc

    @property
    def cache_path(self) -> str:
        return str(kernel_store.folder())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(
            target_context
        )  # all that code from disk needs; a refresh would load what compiling needs
        compiling.begin("", 0, quiet=True)
        try:
            name = self._name(sig, target_context.codegen())
            found = self._load(name, target_context)
            if found is not None:
                return found
            free = kernel_store.claim(name)
        finally:
            compiling.end()
        if not free:
            _begin(self._compiled)
            try:
                kernel_store.claim(name, kernel_store.WAIT)
            finally:
                compiling.end()
        found = self._load(name, target_context)  # another process may have made it just now
        if found is not None:
            kernel_store.release(name)
        return found

    def _load(self, name: str, target_context: Any) -> Any:
        data = kernel_store.load(name)
        if data is None:
            return None
        try:
            return compiler.CompileResult._rebuild(target_context, *pickle.loads(data))
        except Exception:  # another version wrote it: whatever it is that fails, it is compiled again
            kernel_store.discard(name)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        compiling.begin("", 0, quiet=True)
        try:
            name = self._name(sig, data.codegen)
            if not data._asdict()["library"].has_dynamic_globals:
                kernel_store.save(name, serialize.dumps(_reduced(data)))
            for environment in data._find_referenced_environments():  # of what was linked into it
                data.codegen.set_env(environment.env_name, environment)
            kernel_store.release(name)
        finally:
            compiling.end()

    def _name(self, sig: Any, codegen: Any) -> str:
        """Name of the file for a signature, readable at its beginning."""
        arguments, _ = sigutils.normalize_signature(sig)
        versions = nb.__version__, llvmlite.__version__, platform.python_version(), codegen.magic_tuple()
        key = hashlib.sha256(repr((versions, *map(_spelled, arguments))).encode())
        key.update(_meaning(self._compiled))
        return f"{self._compiled.__name__}-{type(self._compiled).__name__}-{key.hexdigest()[:32]}"


def _reduced(data: Any) -> Any:
    """What is kept of a compiled kernel.

    Raises:
        KeyboardInterrupt: if Ctrl-C came while LLVM handed the code over: Python drops what such a callback raises.
    """
    try:
        return data._reduce()
    except RuntimeError as error:
        raise KeyboardInterrupt from error


def _spelled(kind: Any) -> str:
    """A type of an argument in full: numba's own text leaves out what the fields of a named tuple are called."""
    fields = getattr(kind, "fields", ())
    return f"{kind}{fields if isinstance(fields, tuple) else ''}" + "".join(
        map(_spelled, getattr(kind, "types", ()) or ())
    )


_meanings: dict[Any, bytes] = {}


def _meaning(function: Any) -> bytes:
    """Digest of what a function computes: its code, what it calls, what it reads. A recursive call adds nothing."""
    if function not in _meanings:
        _meanings[function] = b""
        plain = getattr(function, "__wrapped__", function)
        digest = hashlib.sha256(repr(getattr(function, "targetoptions", "")).encode())
        digest.update(repr(list(_code(plain.__code__))).encode())
        for name, value in _read(plain):
            digest.update(name.encode() + _value(value))
        for cell in plain.__closure__ or ():
            digest.update(_value(cell.cell_contents))
        _meanings[function] = digest.digest()
    return _meanings[function]


def _code(code: CodeType) -> Iterator[object]:
    yield from (code.co_code, code.co_names, code.co_varnames, code.co_freevars)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant)
        else:
            yield constant


def _names(code: CodeType) -> set[str]:
    inside = (_names(constant) for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*inside)


def _read(function: FunctionType) -> list[tuple[str, object]]:
    """The global names that a function may read, with their values; of our own modules, what is read of them."""
    names, found = _names(function.__code__), []
    for name in sorted(names):
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType) and value.__name__.startswith("flatpush"):
            found += [(f"{name}.{n}", vars(value)[n]) for n in sorted(names) if n in vars(value)]
        elif name in function.__globals__:
            found.append((name, value))
    return found


def _value(value: Any) -> bytes:
    if isinstance(value, Dispatcher | FunctionType):
        return _meaning(value)
    if hasattr(value, "symbol"):  # of a shared function only its address is known to who calls it
        return repr(value.symbol).encode()
    if isinstance(value, np.ndarray):
        return repr((value.dtype, value.shape)).encode() + value.tobytes()
    if isinstance(value, type):
        members = list(value.__members__.items()) if issubclass(value, enum.Enum) else ()
        return repr((value.__qualname__, getattr(value, "_fields", ()), members)).encode()
    if isinstance(value, ModuleType):
        return value.__name__.encode()
    if isinstance(value, tuple | list):
        return repr(type(value)).encode() + b"".join(map(_value, value))
    if isinstance(value, dict):  # the ways of a choice by type
        return b"".join(_value(part) for item in value.items() for part in item)
    known = isinstance(value, int | float | complex | str | bytes | np.generic | np.dtype | None)
    return repr(value).encode() if known or isinstance(value, nb.types.Type) else repr(type(value)).encode()


def _begin(function: Any) -> None:
    plain = function.__wrapped__
    needed = 0
    if not compiling.busy():
        needed = sum(not isinstance(f, Dispatcher) or not f.overloads for f in _needs(function))
    compiling.begin(f"{plain.__module__.removeprefix('flatpush.')}.{plain.__name__}", needed)


def _needs(function: Any, seen: set[Any] | None = None) -> set[Any]:
    """The compiled functions that one calls, directly or not, itself included."""
    seen = set() if seen is None else seen
    if isinstance(function, Dispatcher | CFunc) and function not in seen:
        seen.add(function)
        for _, value in _read(function.__wrapped__):  # type: ignore[union-attr]
            _needs(value, seen)
    return seen


class _Watch(event.Listener):
    """Passes on when the compiler begins and ends."""

    def on_start(self, event: Any) -> None:
        _begin(event.data["dispatcher"])

    def on_end(self, event: Any) -> None:
        compiling.end()


event.register("numba:compile", _Watch())


def _learn_formulas() -> None:
    """Tells the compiler of the formulas and choices collected since it was last told."""
    for function in FORMULAS:
        overload(function, jit_options=_PLAIN | _WITHIN | _LENT, strict=False)(_itself(function))
    for chosen, ways in CHOICES:
        overload(chosen, jit_options=_PLAIN | _WITHIN | _LENT, strict=False)(_way_of(ways))
    FORMULAS.clear()
    CHOICES.clear()


def _itself(function: Callable[..., object]) -> Callable[..., object]:
    def source(*_: object) -> Callable[..., object]:
        return function

    return source


def _way_of(ways: Mapping[Any, Callable[..., object]]) -> Callable[..., object]:
    def source(first: Any, *_: object) -> Callable[..., object]:
        return ways[first.dtype.dtype if isinstance(first, types.Array) else first.instance_class]

    return source
