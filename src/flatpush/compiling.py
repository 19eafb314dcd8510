"""Compiling while a program runs: a clock that stands still meanwhile, and who wants to hear of it.

This file does not import numba; compiled.py tells it when the compiler works.
"""

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass

_spent = 0.0  # in the compiler, without the work in progress [s]
_depth = 0
_since = 0.0  # when the work in progress began
_collects = False  # whether it was begun with garbage collection


@dataclass(frozen=True)
class Work:
    """What is being compiled.

    Attributes:
        kernel: its name, such as "simulation.plant.kernels.roll".
        done: functions that are compiled; of: functions it is known to need, itself included.
        over: whether this is the last word on it.
    """

    kernel: str
    done: int
    of: int
    over: bool = False


_listeners: list[Callable[[Work], None]] = []
_work = Work("", 0, 0)


def clock() -> float:
    """time.perf_counter() without the time in which kernels were compiled or read from disk [s].

    Limits of a search are measured with it, so that the first run gives the plan of every later one.
    """
    now = time.perf_counter()
    return now - _spent - (now - _since if _depth else 0.0)


def listen(listener: Callable[[Work], None]) -> Callable[[], None]:
    """Calls the listener when a kernel begins to be compiled, at each function within it, and when it is ready.

    Returns:
        what ends it.
    """
    _listeners.append(listener)
    return lambda: _listeners.remove(listener)


def unheard() -> None:
    """Nobody is told any more: who listened did so in the process that this one was forked from."""
    _listeners.clear()


def busy() -> bool:
    """Whether something is being compiled just now."""
    return _depth > 0


def begin(kernel: str, needed: int, quiet: bool = False) -> None:
    """The compiler begins with a kernel, or with a function that it needs; what begins ends.

    Meanwhile garbage is not collected: the compiler keeps nearly all that it makes, and going through it again and
    again costs a twentieth of its time.
    """
    global _depth, _since, _work, _collects
    _depth += 1
    if _depth == 1:
        _collects = gc.isenabled()
        gc.disable()
        _since = time.perf_counter()
        _work = Work("" if quiet else kernel, 0, needed)
        _tell()


def end() -> None:
    global _depth, _spent, _work
    _depth -= 1
    done = _work.done + 1
    _work = Work(_work.kernel, done, max(_work.of, done), over=_depth == 0)
    _tell()
    if _depth == 0:
        if _collects:
            gc.enable()
        _spent += time.perf_counter() - _since


def _tell() -> None:
    if _work.kernel:
        for listener in _listeners:
            listener(_work)
