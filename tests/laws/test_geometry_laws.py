"""Poses, twists and outlines: what holds for every input."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flatpush.errors import InputError
from flatpush.geometry import (
    Outline,
    compose,
    exp,
    inverse,
    log,
    pose_error,
    relative,
    shift_twist,
    transform,
    velocity_at,
    wrap_angle,
)

numbers = st.floats(-3, 3)
poses = st.tuples(numbers, numbers, numbers).map(np.array)


@given(poses, poses)
def test_compose_with_the_inverse_gives_the_relative_pose(X, Y):
    assert np.allclose(compose(X, relative(X, Y)), Y, atol=1e-12)
    assert np.allclose(compose(X, inverse(X)), 0, atol=1e-12)


@given(poses)
def test_exp_and_log_are_inverse(V):
    assert np.allclose(log(exp(V)), V, atol=1e-9)


@given(poses, st.floats(1e-12, 1e-6))
def test_exp_is_accurate_for_small_turns(V, tiny):
    twist = np.array([V[0], V[1], tiny])
    assert np.allclose(exp(twist), [V[0] - tiny * V[1] / 2, V[1] + tiny * V[0] / 2, tiny], atol=1e-11)


@given(poses, numbers, numbers)
def test_a_constant_twist_composes_with_itself(V, s, t):
    assert np.allclose(compose(exp(s * V), exp(t * V)), exp((s + t) * V), atol=1e-9)


@given(poses, st.tuples(numbers, numbers).map(np.array))
def test_points_move_with_the_velocity_of_the_twist(V, p):
    h = 1e-6
    moved = (transform(exp(h * V), p) - transform(exp(-h * V), p)) / (2 * h)
    assert np.allclose(moved, velocity_at(V, p), atol=1e-8)
    assert np.allclose(shift_twist(V, p)[:2], velocity_at(V, p))


@given(st.floats(-50, 50))
def test_wrapped_angles_lie_in_the_half_open_turn(angle):
    wrapped = float(wrap_angle(angle))
    assert -np.pi < wrapped <= np.pi
    assert np.isclose(np.exp(1j * wrapped), np.exp(1j * angle))


def test_pose_error_wraps_the_angle():
    assert np.allclose(pose_error([0, 0, np.pi - 0.1], [0, 0, -np.pi + 0.1]), [0, 0, -0.2])


L_SHAPE = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], dtype=float)


@pytest.mark.parametrize("vertices", [L_SHAPE, L_SHAPE[::-1]])
def test_normals_point_inward_for_either_sense(vertices):
    outline = Outline.polygon(vertices)
    for edge in range(len(vertices)):
        at = outline.at(edge, 0.5)
        assert outline.contains(at.point + 1e-3 * at.normal)
        assert not outline.contains(at.point - 1e-3 * at.normal)
    assert outline.area == pytest.approx(5.0)
    assert outline.centroid == pytest.approx([1.1, 1.1])
    assert outline.size == pytest.approx(np.hypot(3, 3))


@given(st.floats(-1, 4), st.floats(-1, 4))
def test_nearest_is_the_nearest_of_many_points(x, y):
    outline = Outline.polygon(L_SHAPE)
    found = outline.nearest((x, y))
    edge = np.repeat(np.arange(6), 2001)
    along = np.tile(np.linspace(0, 1, 2001), 6)[:, None]
    dense = outline.edges[edge, 0] + along * (outline.edges[edge, 1] - outline.edges[edge, 0])
    assert abs(found.distance) == pytest.approx(np.min(np.hypot(*(dense - (x, y)).T)), abs=1e-3)
    assert (found.distance < 0) == outline.contains((x, y)) or abs(found.distance) < 1e-9


def test_a_circle_is_an_outline():
    circle = Outline.circle(2.0, centre=(1.0, 0.0))
    at = circle.nearest((4.0, 0.0))
    assert at.point.tolist() == [3.0, 0.0]
    assert at.normal.tolist() == [-1.0, 0.0]
    assert at.distance == pytest.approx(1.0)
    ring = circle.polyline(1e-3)
    assert np.max(np.abs(np.hypot(*(ring - [1, 0]).T) - 2)) < 1e-9


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        ([(0, 0), (1, 0)], "at least three different corners"),
        ([(0, 0), (1, 0), (0.5, 0), (1, 0)], "encloses an area"),
        ([(0, 0), (1, 0), (2, 0)], "encloses an area"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "cross"),
        ([(0, 0), (2, 2), (2, 0), (0, 1)], "cross"),
        ([(0, 0), (1, 0), (float("nan"), 1)], "finite"),
    ],
)
def test_bad_outlines_are_refused(vertices, words):
    with pytest.raises(InputError, match=words):
        Outline.polygon(vertices)


def test_repeated_corners_are_dropped():
    outline = Outline.polygon([(0, 0), (0, 0), (1, 0), (1, 1), (1, 1), (0, 1), (0, 0)])
    assert outline.vertices.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]  # edge 0 still starts at the first
    assert outline.area == pytest.approx(1.0)
