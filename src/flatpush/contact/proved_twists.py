"""The car of two fingers for all that is uncertain of them and the table, or which of the bounds leaves none."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from numpy.typing import ArrayLike

from ..errors import NoDubinsReduction
from ..friction.support import Support
from ..geometry.pose import Array
from .cone_twists import OFF_CENTRE
from .point_contact import PointContact
from .set_twists import has_car, set_twists
from .table_set import TableSet, side_along
from .wrench_cone import WrenchCone, narrowed

# The value of a bound up to which a car remains is told in two figures. It is sought until it is known to this share,
# in so many halvings at most.
SHARE, HALVINGS = 0.002, 16


@dataclass(frozen=True)
class Bounds:
    """What is uncertain: loads by a share, the least friction of the fingers, an offset of the grasp [m]."""

    loads: float
    friction: float
    offset: float


class NothingProved(NoDubinsReduction):
    """No motions are proved for a set. What it says of the bounds is worked out when it is first read."""

    def __init__(self, message: str, bounds: Callable[[], str]) -> None:
        super().__init__(message)
        self._bounds: Callable[[], str] | str = bounds

    def __str__(self) -> str:
        if not isinstance(self._bounds, str):
            self._bounds = self._bounds()
        return f"{super().__str__()}; {self._bounds}"


def proved_twists(
    support: Support, contacts: Sequence[PointContact], reserve: float, nominal: ArrayLike, bounds: Bounds
) -> Array:
    """The twists of set_twists, (3, 3), for all tables and fingers within bounds, and turns that are off by OFF_CENTRE.

    Args:
        support: nominal.
        contacts: nominal, about the centre of friction.
        reserve: the friction margin, as of narrowed.
        nominal: as of set_twists.
        bounds: of the set.

    Raises:
        InputError: as TableSet.of and side_along.
        NothingProved: if every car is lost on some table; it names the bound that does it.
    """
    tables = replace(TableSet.of(support, bounds.loads), aside=OFF_CENTRE)

    def within(b: Bounds) -> tuple[tuple[TableSet, ...], WrenchCone]:
        held = replace(tables, share=b.loads).held(side_along(contacts, b.offset), b.offset)
        return held, narrowed([replace(c, friction=b.friction) for c in contacts], reserve)

    def possible(b: Bounds) -> bool:
        return has_car(*within(b), nominal)

    try:
        return set_twists(*within(bounds), nominal)
    except NoDubinsReduction as error:
        message = str(error)
    raise NothingProved(message, partial(_broken, possible, bounds, Bounds(0.0, contacts[0].friction, 0.0)))


def _broken(possible: Callable[[Bounds], bool], bounds: Bounds, exact: Bounds) -> str:
    """Which bounds, taken off alone, leave a car, and up to which value of each one remains."""
    wide = [key for key in TOLD if getattr(bounds, key) != getattr(exact, key)]
    alone = [key for key in wide if possible(replace(bounds, **{key: getattr(exact, key)}))]
    if alone:
        told = [TOLD[key](_most(possible, bounds, exact, key), getattr(bounds, key)) for key in alone]
        return f"with all else as it is, a car remains with {', or with '.join(told)}"
    if not possible(exact):
        return "there is no car even where nothing is uncertain; less margin or a wider spacing would help"
    return f"{', '.join(wide[:-1])} and {wide[-1]} break it together: taking off one of them leaves no car"


def _most(possible: Callable[[Bounds], bool], bounds: Bounds, exact: Bounds, key: str) -> float:
    """The farthest that a bound may be from exact so that a car remains, in two figures, rounded to where one does."""
    good, bad = getattr(exact, key), getattr(bounds, key)
    for _ in range(HALVINGS):
        if abs(bad - good) <= SHARE * max(good, bad):
            break
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if possible(replace(bounds, **{key: middle})) else (good, middle)
    if good == getattr(exact, key):
        return float(good)
    places = 1 - math.floor(math.log10(good))
    toward = math.ceil if good > bad else math.floor
    rounded = toward(round(good * 10**places, 6)) / 10**places
    return min(rounded, exact.friction) if key == "friction" else rounded


TOLD: dict[str, Callable[[float, float], str]] = {
    "loads": lambda value, asked: f"loads within {100 * value:.3g} % instead of {100 * asked:.3g} %",
    "friction": lambda value, asked: f"friction from {value:.3g} instead of {asked:.3g} up",
    "offset": lambda value, asked: f"an offset up to {1000 * value:.3g} mm instead of {1000 * asked:.3g} mm",
}
