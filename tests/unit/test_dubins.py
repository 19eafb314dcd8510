"""Named Dubins cases, shapes, and what is refused."""

import numpy as np
import pytest
from tests.waiting import python

from flatpush.errors import InputError
from flatpush.steering import dubins, shortest_word


@pytest.mark.parametrize(
    ("goal", "length"),
    [
        ([0, 0, 0], 0),
        ([0, 0, 2 * np.pi], 0),
        ([4, 0, 0], 4),
        ([0, 2, np.pi], np.pi),
        ([0, -2, -np.pi], np.pi),
        ([1, 1, np.pi / 2], np.pi / 2),
        ([2, 2, 0], np.pi),
        ([1, -1, 3 * np.pi / 2], np.pi / 2),
        ([0, 0, np.pi], 7 * np.pi / 3),  # RLR or LRL: π/3 + 5π/3 + π/3
    ],
)
def test_known_lengths(goal, length):
    path = dubins.shortest_path([0, 0, 0], goal, 1.0)
    assert path.length == pytest.approx(length, abs=1e-12)
    assert float(dubins.shortest_length([[0, 0, 0]], goal, 1.0)[0]) == pytest.approx(length, abs=1e-12)


def test_words_turn_the_way_they_say():
    assert dubins.shortest_path([0, 0, 0], [5, 5, np.pi / 2], 1.0).word == "LSL"
    assert dubins.shortest_path([0, 0, 0], [5, -5, -np.pi / 2], 1.0).word == "RSR"
    assert dubins.shortest_path([0, 0, 0], [8, 4, 0], 1.0).word == "LSR"
    assert dubins.shortest_path([0, 0, 0], [8, -4, 0], 1.0).word == "RSL"


def test_pose_at_is_clipped_and_broadcasts():
    path = dubins.shortest_path([1, 2, 0.5], [4, -1, 2], 0.7)
    poses = path.pose_at(np.linspace(-1, path.length + 1, 12).reshape(3, 4))
    assert poses.shape == (3, 4, 3)
    np.testing.assert_array_equal(poses[0, 0], [1, 2, 0.5])
    np.testing.assert_allclose(poses[-1, -1], path.end)


def test_lengths_broadcast_like_a_table():
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-3, 3, (5, 3)), rng.uniform(-3, 3, (7, 3))
    table = dubins.shortest_length(a[:, None], b[None], 0.8)
    assert table.shape == (5, 7)
    expected = [[dubins.shortest_path(x, y, 0.8).length for y in b] for x in a]
    np.testing.assert_allclose(table, expected, rtol=1e-12)
    np.testing.assert_array_equal(
        dubins.shortest_length(a[:, None, None], b[None, :, None], 0.8)[..., 0], table
    )
    assert dubins.shortest_length(a[:0], a[:0], 1.0).shape == (0,)


def test_long_rows_cross_tiles():
    rng = np.random.default_rng(2)
    a, b = rng.uniform(-3, 3, (1500, 3)), rng.uniform(-3, 3, (1500, 3))
    whole = dubins.shortest_length(a, b, 1.0)
    parts = np.concatenate(
        [dubins.shortest_length(a[i : i + 7], b[i : i + 7], 1.0) for i in range(0, 1500, 7)]
    )
    np.testing.assert_allclose(whole, parts, rtol=1e-13)


def test_large_headings():
    turns = 2 * np.pi * np.array([0, 5, -1000, 100_000])
    goals = np.stack([np.full(4, 2.0), np.full(4, 1.0), 0.7 + turns], axis=-1)
    lengths = dubins.shortest_length([0, 0, 0.1], goals, 1.0)
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-9)


@pytest.mark.parametrize("radius", [0, -1, np.nan, np.inf, "1", True, None, [1.0]])
def test_radius_is_refused(radius):
    with pytest.raises(InputError, match="radius"):
        dubins.shortest_path([0, 0, 0], [1, 0, 0], radius)
    with pytest.raises(InputError, match="radius"):
        dubins.shortest_length([[0, 0, 0]], [[1, 0, 0]], radius)


@pytest.mark.parametrize("pose", [[0, 0], [0, 0, np.nan], [np.inf, 0, 0], "abc", 3.0, [[0, 0, 0], [1, 1, 1]]])
def test_pose_is_refused(pose):
    with pytest.raises(InputError):
        dubins.shortest_path([0, 0, 0], pose, 1.0)


def test_shapes_that_do_not_broadcast_are_refused():
    with pytest.raises(InputError, match="broadcast"):
        dubins.shortest_length(np.zeros((2, 3)), np.zeros((4, 3)), 1.0)


def test_the_compiler_is_not_loaded_for_one_path():
    code = (
        "import sys; from flatpush.steering import dubins, shortest_word;"
        "dubins.shortest_path([0,0,0],[1,1,1],1.0); dubins.shortest_length([0,0,0],[1,1,1],1.0);"
        "shortest_word([0,1],[0,-1],[1,0],[0,0,0],[1,1,1]);"
        "sys.exit('numba' in sys.modules)"
    )
    assert python("-c", code).returncode == 0


@pytest.mark.parametrize("radius", [1e-154, 1e10, 0.0, np.inf, np.nan, True, "1"])
def test_radii_without_digits_are_refused(radius):
    """1e-154 overflowed inside, and 1e10 took a goal beside the start for the start itself."""
    with pytest.raises(InputError, match="the radius"):
        dubins.shortest_path((0, 0, 0), (0, 1e-3, 0), radius)


@pytest.mark.parametrize(
    "pose", [(0, 0, "0"), (0, 0, True), np.ones(3, bool), ["a", "b", "c"], (10**400, 0, 0)]
)
def test_strings_and_booleans_are_no_numbers(pose):
    with pytest.raises(InputError, match="numbers"):
        dubins.shortest_path(pose, (1, 0, 0), 1.0)
    with pytest.raises(InputError, match="3 finite numbers"):
        shortest_word((0, 1), (0, -1), (1, 0), pose, (1, 0, 0))
