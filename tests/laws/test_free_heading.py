"""The cheapest heading at a place: never dearer than any that is tried, and of the form that the theory says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flatpush.errors import InputError
from flatpush.geometry import transform
from flatpush.steering import dubins
from flatpush.steering.fleet import Fleet
from flatpush.steering.free_heading import cheapest_headings
from flatpush.steering.three_twist import shortest_word

DENSE = 3600  # headings that are tried one by one
# Both sides accept a word that ends so near to the goal; at a jump the costs of what they accept differ by as much.
NEAR = 1e-8

number = st.floats(-3.0, 3.0, allow_nan=False).map(lambda x: round(x, 6))
weight = st.floats(0.2, 2.0).map(lambda x: round(x, 6))


@st.composite
def fleets(draw: st.DrawFn, timed: bool) -> Fleet:
    """One car with any centres, the left one to the left, and any weights; with a time law if asked."""
    middle = np.array([draw(number), draw(number)])
    half = draw(st.floats(0.2, 1.5))
    tilt, heading = draw(st.floats(-0.6, 0.6)), draw(st.floats(-3.0, 3.0))
    across = np.array([-np.sin(heading), np.cos(heading)])
    ahead = np.array([[np.cos(heading + tilt), np.sin(heading + tilt)]])
    laws = (np.full((1, 3), draw(weight)), np.full((1, 3), draw(weight))) if timed else ()
    left, right = (middle + s * half * across for s in (1, -1))
    none = np.full((1, 3), np.inf)
    speeds, ups = laws or (none, none)
    rates = np.array([[draw(weight), draw(weight), draw(weight)]])
    return Fleet(left[None], right[None], ahead, rates, speeds, ups, np.zeros((1, 1)))


def _cost(fleet: Fleet, word: str, amounts: np.ndarray) -> float:
    total = 0.0
    for letter, amount in zip(word, amounts, strict=True):
        k = "LSR".index(letter)
        way, v, up = fleet.rates[0, k] * amount, fleet.speeds[0, k], fleet.accelerations[0, k]
        total += way if np.isinf(v) else way / v + v / up if way * up >= v**2 else 2 * np.sqrt(way / up)
    return total


@pytest.mark.parametrize("timed", [False, True])
@settings(max_examples=200, deadline=None)
@given(data=st.data(), x=number, y=number, start=st.tuples(number, number, number))
def test_no_heading_is_cheaper(
    timed: bool, data: st.DataObject, x: float, y: float, start: tuple[float, float, float]
) -> None:
    from flatpush.steering.lengths import fleet_lengths

    fleet = data.draw(fleets(timed))
    about, within = data.draw(number), data.draw(st.sampled_from([0.0, 0.01, 0.5, np.pi]))
    costs, headings = cheapest_headings(fleet, start, [x, y], about, within)
    assert abs(headings[0, 0] - about) <= within + 1e-12
    dense = about + within * np.linspace(-1, 1, DENSE + 1)
    tried = fleet_lengths(
        fleet, start, np.column_stack([np.full(DENSE + 1, x), np.full(DENSE + 1, y), dense])
    )
    assert costs[0, 0] <= tried.min() + NEAR
    if not timed:  # the plain twin finds a word with this heading that costs as much
        goal = (x, y, headings[0, 0])
        word = shortest_word(fleet.left[0], fleet.right[0], fleet.direction[0], start, goal, fleet.rates[0])
        assert word.cost == pytest.approx(costs[0, 0], abs=NEAR)
        assert _cost(fleet, word.word, word.parameters) == pytest.approx(costs[0, 0], abs=NEAR)


@settings(deadline=None)
@given(x=number, y=number)
def test_a_dubins_car_comes_to_its_place_with_two_pieces(x: float, y: float) -> None:
    """[Bui1994]: with a free heading the shortest paths are CS where the place is outside the turning circles, else CC.

    The length of CS is that of the tangent, computed here from the triangle of centre, tangent point and place.
    """
    fleet = Fleet(
        np.array([[0.0, 1.0]]), np.array([[0.0, -1.0]]), np.array([[1.0, 0.0]]), np.ones((1, 3)),
        np.full((1, 3), np.inf), np.full((1, 3), np.inf), np.zeros((1, 1)),
    )  # fmt: skip
    costs, headings = cheapest_headings(fleet, (0, 0, 0), [x, y])
    away = np.hypot(x, abs(y) - 1.0)  # from the nearer centre
    path = dubins.shortest_path((0, 0, 0), (x, y, headings[0, 0]), 1.0)
    assert path.length == pytest.approx(costs[0, 0], abs=NEAR)
    pieces = [length for length in path.lengths if length > 1e-5]
    assert len(pieces) <= 2
    if away > 1.0:
        straight = np.sqrt(away**2 - 1.0)
        bearing = np.arctan2(
            x, 1.0 - abs(y)
        )  # of the place, from the centre, counted from the start along the turn
        turn = (bearing - np.arctan2(straight, 1.0)) % (2 * np.pi)
        assert costs[0, 0] == pytest.approx(turn + straight, abs=1e-6) or turn > 2 * np.pi - 1e-6


def test_places_and_cars_are_independent() -> None:
    """What a table of places gives is what each place gives alone, and what each car gives alone."""
    rng = np.random.default_rng(3)
    left, right = (rng.normal(size=(3, 2)) + np.array([0, s]) for s in (2.0, -2.0))
    ahead, none = np.array([[1.0, 0.0]] * 3), np.full((3, 3), np.inf)
    fleet = Fleet(left, right, ahead, rng.uniform(0.5, 2, (3, 3)), none, none, np.zeros((3, 3)))
    start, places = (0.3, -0.2, 1.0), rng.normal(size=(4, 2)) * 3
    costs, headings = cheapest_headings(fleet, start, places)
    for k in range(3):
        one = Fleet(*(a[k : k + 1] for a in (left, right, ahead, fleet.rates, none, none)), np.zeros((1, 1)))
        for m in range(4):
            cost, heading = cheapest_headings(one, start, places[m])
            assert cost[0, 0] == pytest.approx(costs[k, m], abs=NEAR)
            assert transform((0, 0, heading[0, 0]), [1.0, 0.0]) == pytest.approx(
                transform((0, 0, headings[k, m]), [1.0, 0.0]), abs=1e-4
            )


def test_what_is_no_place_is_refused() -> None:
    fleet = Fleet(*(np.zeros((1, n)) for n in (2, 2, 2, 3, 3, 3)), np.zeros((1, 1)))
    for start, places, within in (
        ((0, 0), [0, 0], 1.0),
        ((0, 0, 0), [0, np.nan], 1.0),
        ((0, 0, 0), [1, 1], -1.0),
    ):
        with pytest.raises(InputError):
            cheapest_headings(fleet, start, places, 0.0, within)
