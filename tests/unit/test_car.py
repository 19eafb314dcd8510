"""The car of a push."""

from dataclasses import replace

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


def test_the_margin_is_kept_of_the_coefficient():
    car = Car.of(CONTACT, SQUARE, margin=0.25)
    angles = CONTACT.force_angles(car.forces)
    assert np.tan(angles[[0, 2]]) == pytest.approx([0.75 * CONTACT.friction, -0.75 * CONTACT.friction])
    assert angles[1] == pytest.approx(CONTACT.force_angles(Car.of(CONTACT, SQUARE).forces)[1])
    # With so much less friction, and no margin, the car is the same.
    less = Car.of(replace(CONTACT, friction=0.75 * CONTACT.friction), SQUARE)
    assert car.left_centre == pytest.approx(less.left_centre)
    assert car.right_centre == pytest.approx(less.right_centre)


def test_a_push_that_cannot_keep_its_margin_says_what_it_could_keep():
    """Its straight force takes 0.2 of 0.3: a third of μ is left."""
    leaning = PointContact([0.004, -0.02], [0.0, 1.0], 0.3)
    assert Car.of(leaning, SQUARE, margin=0.333).radius > 0
    with pytest.raises(NoDubinsReduction, match=r"33\.3 % of μ in reserve at most, not 40 %"):
        Car.of(leaning, SQUARE, margin=0.4)


def test_a_cone_beside_the_centre_of_friction_is_refused():
    with pytest.raises(NoDubinsReduction, match="off by"):
        Car.of(PointContact([0.012, -0.02], [0.0, 1.0], 0.3), SQUARE)
    with pytest.raises(NoDubinsReduction, match="without friction"):
        Car.of(PointContact([0.0, -0.02], [0.0, 1.0], 0.0), SQUARE)
