"""Which sets of pushes move an object freely."""

import numpy as np
import pytest

from flatpush.contact import PointContact
from flatpush.friction import Ellipsoid, Exact, Support
from flatpush.planning.controllability import controllability
from flatpush.steering.car import Car

SQUARE = Exact(Support.polygon([(0.02, -0.02), (0.02, 0.02), (-0.02, 0.02), (-0.02, -0.02)]))
A = Ellipsoid(np.diag([1.0, 1.0, 1 / 3e-4]))


def car(angle: float, surface=SQUARE) -> Car:
    out = np.array([np.cos(angle), np.sin(angle)])
    return Car.of(PointContact(-0.02 * out, out, 0.3), surface)


@pytest.mark.parametrize("surface", [SQUARE, A])
def test_one_push_reaches_all_by_detours_and_two_opposite_ones_are_free(surface):
    """Two opposite pushes with friction are enough (methods 1.13)."""
    assert controllability([]) == "none"
    assert controllability([car(0.0, surface)]) == "detours"
    assert controllability([car(0.0, surface), car(np.pi, surface)]) == "free"
    assert controllability([car(0.0, surface), car(np.pi / 2, surface)]) == "detours"


def test_three_directions_that_span_the_plane_are_free():
    """[Lynch1996] Thm. 7."""
    assert controllability([car(a) for a in (0.0, 2 * np.pi / 3, -2 * np.pi / 3)]) == "free"
    assert controllability([car(a) for a in (0.0, 0.5, -0.5)]) == "detours"


def test_a_detour_is_a_detour():
    """One push reaches a place beside it only by a way that is long against the distance."""
    from flatpush.steering.three_twist import shortest_word

    single = car(np.pi / 2)
    sideways = np.array([0.1 * single.radius, 0.0, 0.0])
    word = shortest_word(
        single.left_centre,
        single.right_centre,
        single.direction,
        np.zeros(3),
        sideways,
        single.weights("flat"),
    )
    assert word.cost > 3 * single.radius
