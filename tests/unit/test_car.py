"""The car of a push."""

import numpy as np
import pytest

from flatpush.contact import PointContact
from flatpush.errors import InputError, NoDubinsReduction
from flatpush.friction import Ellipsoid, Exact, Support
from flatpush.geometry import cross, velocity_at
from flatpush.steering import flat_output
from flatpush.steering.car import Car

A = Ellipsoid(np.diag([1.0, 1.0, 1 / 3e-4]))
CONTACT = PointContact([0.004, -0.02], [0.0, 1.0], 0.4)
SQUARE = Exact(Support.polygon([(0.02, -0.02), (0.02, 0.02), (-0.02, 0.02), (-0.02, -0.02)]))


def test_left_is_counter_clockwise_about_a_centre_on_the_left():
    for surface in (A, SQUARE):
        car = Car.of(CONTACT, surface)
        assert car.left[2] > 0 > car.right[2]
        assert velocity_at(car.left, car.left_centre) == pytest.approx([0, 0], abs=1e-12)
        assert velocity_at(car.right, car.right_centre) == pytest.approx([0, 0], abs=1e-12)
        assert cross(car.direction, car.left_centre - car.right_centre) > 0


def test_the_flat_point_moves_with_unit_speed():
    for surface in (A, SQUARE):
        car = Car.of(CONTACT, surface)
        for twist in (car.left, car.straight, car.right):
            assert np.hypot(*velocity_at(twist, car.flat_point)) == pytest.approx(1)


def test_under_an_ellipsoid_it_is_the_paper_s_dubins_car():
    car, flat = Car.of(CONTACT, A), flat_output(CONTACT, A)
    assert car.is_dubins
    assert car.flat_point == pytest.approx(flat.flat_point)
    assert car.radius == pytest.approx(flat.min_radius)
    assert np.arctan2(*car.direction[::-1]) == pytest.approx(flat.heading_offset)


def test_under_the_exact_surface_of_an_asymmetric_contact_it_is_not():
    car = Car.of(CONTACT, SQUARE)
    assert not car.is_dubins
    # Straight motion is exactly from the contact to the centre of friction (methods 1.17).
    assert car.direction == pytest.approx(-CONTACT.point / np.hypot(*CONTACT.point), abs=1e-13)


def test_every_curvature_has_its_twist_and_a_force_inside_the_cone():
    for surface in (A, SQUARE):
        car = Car.of(CONTACT, surface)
        for share in np.linspace(-1, 1, 9):
            twist = car.twist(share / car.radius)
            assert twist[2] == pytest.approx(share / car.radius, abs=1e-9 / car.radius)
            forces = CONTACT.forces(surface.wrench_set(twist))
            assert np.all(np.abs(CONTACT.force_angles(forces)) <= CONTACT.half_angle + 1e-9)
        assert car.twist(1 / car.radius) == pytest.approx(car.left)
        with pytest.raises(InputError, match="curvature"):
            car.twist(1.01 / car.radius)


def test_the_margin_moves_the_edges_towards_the_straight_force():
    whole, shrunk = (Car.of(CONTACT, SQUARE, margin=m) for m in (0.0, 0.25))
    left, straight, right = CONTACT.force_angles(whole.forces)
    angles = CONTACT.force_angles(shrunk.forces)
    assert angles[0] == pytest.approx(left + 0.25 * (straight - left))
    assert angles[1] == pytest.approx(straight)
    assert angles[2] == pytest.approx(right + 0.25 * (straight - right))
    assert shrunk.radius > whole.radius


def test_a_cone_beside_the_centre_of_friction_is_refused():
    with pytest.raises(NoDubinsReduction, match="off by"):
        Car.of(PointContact([0.012, -0.02], [0.0, 1.0], 0.3), SQUARE)
    with pytest.raises(NoDubinsReduction, match="without friction"):
        Car.of(PointContact([0.0, -0.02], [0.0, 1.0], 0.0), SQUARE)
