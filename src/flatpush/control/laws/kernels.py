"""The laws of laws.plain, compiled from the same source."""

from types import FunctionType
from typing import Any

import numba as nb

from . import plain

_compiled = nb.njit(cache=True, nogil=True, error_model="numpy")

wrapped = _compiled(plain.wrapped)
linearised = _compiled(plain.linearised)
along_path = _compiled(plain.along_path)
point_velocity = _compiled(plain.point_velocity)
place = _compiled(plain.place)


def _calling(function: Any, **names: Any) -> Any:
    """The same function, which finds compiled ones under these names."""
    return FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)


nearest = _compiled(_calling(plain.nearest, place=place))
