"""The laws of laws.formulas, compiled from the same source."""

from collections.abc import Callable
from types import FunctionType

from ...compiled import inner
from . import formulas

wrapped = inner(formulas.wrapped)
linearised = inner(formulas.linearised)
along_path = inner(formulas.along_path)
point_velocity = inner(formulas.point_velocity)
place = inner(formulas.place)


def calling(function: Callable[..., object], names: dict[str, object]) -> FunctionType:
    """The same function, which finds compiled ones under these names."""
    assert isinstance(function, FunctionType)
    return FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)


nearest = inner(calling(formulas.nearest, {"place": place}))
