"""Dubins lengths against OMPL, on random pairs and on those that textbook code gets wrong by a full turn."""

import numpy as np
import pytest
from tests.extras import extra

from flatpush.steering.dubins import DubinsPath, shortest_length, shortest_path

base = pytest.importorskip("ompl.base", reason=extra("test"))

RANDOM_PAIRS = 100_000
DEGENERATE_PAIRS = [2_000, pytest.param(10_000, marks=pytest.mark.slow)]
PLAIN_PAIRS = 2_000
RELATIVE = 1e-9  # rounding of both; a wrong word is off by far more
FULL_TURN = 1e-6  # [radii] OMPL itself snaps arcs within 5e-7 of a turn
END = 1e-9  # per radius + distance


class Ompl:
    """Distances of OMPL's DubinsStateSpace with radius 1."""

    def __init__(self) -> None:
        self.space = base.DubinsStateSpace(1.0)
        bounds = base.RealVectorBounds(2)
        bounds.setLow(-1e12)
        bounds.setHigh(1e12)
        self.space.setBounds(bounds)
        self.start, self.goal = self.space.allocState(), self.space.allocState()

    def length(self, start, goal) -> float:
        for state, pose in ((self.start, start), (self.goal, goal)):
            state.setXY(float(pose[0]), float(pose[1]))
            state.setYaw(float(pose[2]))
        return self.space.distance(self.start, self.goal)


def test_random_pairs_agree():
    rng = np.random.default_rng(20240131)
    reach = 10.0 ** rng.uniform(-1, 2, (RANDOM_PAIRS, 1))
    starts, goals = (
        np.concatenate(
            [reach * rng.uniform(-1, 1, (RANDOM_PAIRS, 2)), rng.uniform(-7, 7, (RANDOM_PAIRS, 1))], axis=1
        )
        for _ in range(2)
    )
    lengths = shortest_length(starts, goals, 1.0)
    ompl = Ompl()
    expected = np.array([ompl.length(a, b) for a, b in zip(starts, goals, strict=True)])
    np.testing.assert_allclose(lengths, expected, rtol=RELATIVE)
    plain = [shortest_path(a, b, 1.0).length for a, b in zip(starts[:PLAIN_PAIRS], goals, strict=False)]
    np.testing.assert_allclose(plain, expected[:PLAIN_PAIRS], rtol=RELATIVE)


def degenerate_pairs(rng, count):
    """Pairs (start, goal, radius) joined by a path some of whose pieces vanish, or with special headings."""
    angles = [
        0,
        np.pi,
        -np.pi,
        np.pi / 2,
        -np.pi / 2,
        2 * np.pi,
        1.0,
        2 * np.pi - 1e-12,
        2 * np.pi - 1e-9,
        -1e-12,
        4.7,
    ]
    for _ in range(count):
        radius = 10.0 ** rng.integers(-9, 7)
        at = radius * rng.choice([0, 1, -2.5, 10.0 * rng.normal()], 2)
        start = np.array([*at, rng.choice(angles)])
        t, u, v = (rng.choice([0, np.pi / 2, np.pi, 1.5 * np.pi, 1.0, rng.uniform(0, 6.2)]) for _ in range(3))
        word, arcs = [
            ("SSS", (0, 0, 0)),  # identical
            ("SSS", (rng.choice([1e-4, 0.5, 1, 2, 4, 5, 1e3, 1e6]), 0, 0)),  # collinear
            ("LSS", (t, u, 0)),
            ("RSS", (t, 0, 0)),  # on the turning circle
            ("SRS", (t, u, 0)),
            ("LRS", (t, u, 0)),  # tangent circles
            ("RLS", (t, u, 0)),
            ("LSL", (np.pi, u, 0)),  # U-turns
            ("RSR", (np.pi / 2, u, np.pi / 2)),
            ("LRL", (t, np.pi + u, 0)),
            ("RLR", (t, np.pi, v)),
        ][rng.integers(11)]
        goal = DubinsPath(word, radius * np.array(arcs, dtype=float), start, radius).end
        goal[2] += rng.choice([0, 2 * np.pi, -2 * np.pi])
        yield start, goal, radius


def check(start, goal, radius, ompl):
    path = shortest_path(start, goal, radius)
    distance = np.hypot(*(goal - start)[:2])
    assert np.all(path.lengths >= 0)
    missed = path.end - goal
    assert np.hypot(*missed[:2]) <= END * (radius + distance)
    assert abs(np.angle(np.exp(1j * missed[2]))) <= END
    if ompl is not None:
        units = np.array([radius, radius, 1.0])
        expected = ompl.length(start / units, goal / units)
        assert path.length / radius <= expected * (1 + RELATIVE) + FULL_TURN, (start, goal, radius, path)
    compiled = shortest_length(start[None], goal[None], radius)[0]
    # Near tangent circles a rounding of 1e-16 moves the length by its square root.
    assert abs(compiled - path.length) <= 1e-7 * radius + RELATIVE * path.length


@pytest.mark.parametrize("count", DEGENERATE_PAIRS)
def test_degenerate_pairs_make_no_spurious_turn(count):
    rng = np.random.default_rng(7)
    ompl = Ompl()
    for start, goal, radius in degenerate_pairs(rng, count):
        check(start, goal, radius, ompl)


def test_special_goals_at_every_scale():
    """Unit radius, offsets from 1e-9 to 1e6; OMPL is no judge of pairs not farther apart than 1e-5 but not equal.

    The power of ten may round to either side of 1e-5, differently on different processors.
    """
    ompl = Ompl()
    headings = [0.0, np.pi, -np.pi, np.pi / 2, 2 * np.pi, 2 * np.pi - 1e-12, 2 * np.pi - 1e-3, 1e-3]
    for scale in 10.0 ** np.arange(-9, 7):
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1), (0, 2), (1, 1), (3, -4)):
            for h0 in headings:
                for h1 in headings:
                    start = np.array([0.0, 0.0, h0])
                    goal = np.array([x * scale, y * scale, h1])
                    near = np.hypot(x, y) * scale < 1.1e-5 and abs(np.angle(np.exp(1j * (h1 - h0)))) < 1e-5
                    check(start, goal, 1.0, None if near else ompl)
