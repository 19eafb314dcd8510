"""Numbers that a caller hands over: strings, truth values and what is not finite are none.

NumPy reads "0" and True as numbers; a caller who passes them means something else.
"""

from typing import TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

Array = NDArray[np.float64]


def numbers(values: ArrayLike, rule: str, key: str = "") -> Array:
    """A new array of numbers, infinite and undefined ones among them.

    Raises:
        InputError: with the rule, for strings, truth values, complex numbers, ragged lists and anything else.
    """
    try:
        found = np.array(values)
        mixed = found.dtype.kind in "iuf" and not isinstance(values, np.ndarray) and _has_truth(values)
        if found.dtype.kind not in "iuf" or mixed:
            raise TypeError(f"{found.dtype} is no number")
        return found.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(rule, key=key, value=values) from error


def finite(values: ArrayLike, rule: str, key: str = "") -> Array:
    """A new array of finite numbers.

    Raises:
        InputError: as numbers, and for what is not finite.
    """
    found = numbers(values, rule, key)
    if not np.isfinite(found).all():
        raise InputError(rule, key=key, value=values)
    return found


def vector(values: ArrayLike, size: int, rule: str, key: str = "") -> Array:
    """A new array of so many finite numbers, shape (size,).

    Raises:
        InputError: as finite, and for another shape.
    """
    found = finite(values, rule, key)
    if found.shape != (size,):
        raise InputError(rule, key=key, value=values)
    return found


def made_of(kind: type, value: object, load: str) -> None:
    """Refuses what is no scene or plan, such as the path of a file of one.

    Raises:
        InputError: naming the function that reads such a file.
    """
    if not isinstance(value, kind):
        name = kind.__name__.lower()
        raise InputError(f"a {name} is asked, which fp.{load} reads from a file", value=value)


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is one real number; True, "1" and [1] are none."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def is_finite(value: object) -> TypeGuard[float]:
    """Whether a value is one finite real number."""
    return is_number(value) and bool(np.isfinite(value))


def _has_truth(values: object) -> bool:
    """Whether True or False stands somewhere in nested sequences, where numpy makes a number of it."""
    if isinstance(values, list | tuple):
        return any(_has_truth(value) for value in values)
    return isinstance(values, bool | np.bool_)
