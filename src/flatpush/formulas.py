"""Formulas that have one source: Python runs them as they stand, and kernels compile them.

Nothing here needs a compiler; flatpush.compiled hands it what is collected here before it compiles a kernel.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
R = TypeVar("R")

if TYPE_CHECKING:

    class Record:
        """One record of an array with named columns, which numpy's own types do not know."""

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...

else:
    Record = np.void

FORMULAS: list[Callable[..., object]] = []
CHOICES: list[tuple[Callable[..., object], Mapping[object, Callable[..., object]]]] = []


def formula(function: Callable[P, R]) -> Callable[P, R]:
    """Decorates a function of numbers, NamedTuples and rows with named columns that kernels may call."""
    FORMULAS.append(function)
    return function


def by_type(ways: Mapping[Any, Callable[..., Any]]) -> Callable[..., Any]:
    """The function that goes the way of its first argument's class, a NamedTuple, or, of rows in a kernel, their dtype.

    A kernel compiles only that way.
    """

    def chosen(first: object, *others: object) -> object:
        return ways[type(first)](first, *others)

    CHOICES.append((chosen, ways))
    return chosen
