"""Compiled lengths and costs of many pairs against the plain twins, and that they are computed side by side."""

import re

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.geometry import compose
from flatpush.steering import dubins, shortest_word, words
from flatpush.steering.fleet import Fleet
from flatpush.steering.lengths import axle, dubins_lengths, fleet_lengths, timed_car
from flatpush.steering.three_twist import Word, end_pose

SAME = 1e-9
ROOT = 1e-7  # near tangent circles a rounding of 1e-16 moves the length by its square root [radii]


def random_poses(rng, *shape, reach=2.0):
    return np.concatenate([rng.uniform(-reach, reach, (*shape, 2)), rng.uniform(-7, 7, (*shape, 1))], axis=-1)


def random_fleet(rng, size, tilt=1.3, timed=False):
    """Unequal centres; the straight directions up to `tilt` away from their perpendicular."""
    left, right = rng.uniform(-1, 1, (2, size, 2))
    angle = np.arctan2(*(left - right).T[::-1]) - np.pi / 2 + rng.uniform(-tilt, tilt, size)
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    speeds, accelerations = (
        (rng.uniform(0.1, 2, (size, 3)), rng.uniform(0.1, 2, (size, 3)))
        if timed
        else (np.full((size, 3), np.inf),) * 2
    )
    return Fleet(
        left, right, direction, rng.uniform(0.1, 2, (size, 3)), speeds, accelerations, np.zeros((size, size))
    )


def dubins_fleet(radius, mid):
    """One car whose midpoint of the centres has the pose mid in the object frame, with the flat cost."""
    left, right = (compose(mid, [0, side * radius, 0])[:2] for side in (1, -1))
    return Fleet(
        left[None],
        right[None],
        np.array([[np.cos(mid[2]), np.sin(mid[2])]]),
        np.array([[radius, 1.0, radius]]),
        np.full((1, 3), np.inf),
        np.full((1, 3), np.inf),
        np.zeros((1, 1)),
    )


def plain_cost(fleet, car, start, goal):
    """The cheapest of three_twist.words under the fleet's time law."""
    rates, v, a = fleet.rates[car], fleet.speeds[car], fleet.accelerations[car]

    def cost(word):
        total = 0.0
        for letter, parameter in zip(word.word, word.parameters, strict=True):
            k = "LSR".index(letter)
            way = rates[k] * parameter
            if np.isinf(v[k]):
                total += way
            else:
                total += way / v[k] + v[k] / a[k] if way > v[k] ** 2 / a[k] else 2 * np.sqrt(way / a[k])
        return total

    return min(map(cost, words(fleet.left[car], fleet.right[car], fleet.direction[car], start, goal)))


def driven_pairs(rng, car, count):
    """Pairs joined by one or two pieces, whole angles among them, or none."""
    for _ in range(count):
        start = random_poses(rng)
        name = ("LSL", "RSR", "LSR", "RSL", "LRL", "RLR")[rng.integers(6)]
        driven = rng.choice([np.pi / 2, np.pi, 0.3, rng.uniform(0.1, 5)], 3) * (
            rng.permutation(3) < rng.integers(3)
        )
        goal = end_pose(Word(name, driven, 0.0), *car, start)
        goal[2] += rng.choice([-1, 0, 1]) * 2 * np.pi
        yield start, goal, name, driven


@pytest.mark.parametrize("radius", [1e-6, 0.03, 1.0, 1e5])
@pytest.mark.parametrize("reach", [1e-3, 1.0, 3.0, 100.0])
def test_dubins_lengths_at_every_scale(radius, reach):
    rng = np.random.default_rng(1)
    starts, goals = (random_poses(rng, 150, reach=reach) * [radius, radius, 1] for _ in "ab")
    expected = [dubins.shortest_path(a, b, radius).length for a, b in zip(starts, goals, strict=True)]
    np.testing.assert_allclose(dubins_lengths(starts, goals, radius), expected, rtol=SAME)


def test_special_pairs_in_every_lane():
    """Aligned, touching and coinciding poses, all in one batch: no lane takes a turn too many."""
    grid = np.array([-4, -2, -1, 0, 1, 2, 4], dtype=float)
    headings = np.pi * np.array([0, 0.5, 1, 1.5, 2, -0.5, 1e-13, -1e-13])
    goals = np.stack(np.meshgrid(grid, grid, headings, indexing="ij"), axis=-1).reshape(-1, 3)
    for start in ([0, 0, 0], [1, -1, np.pi / 2], [0.5, 0.25, -np.pi]):
        start = np.array(start, dtype=float)
        expected = [dubins.shortest_path(start, goal, 1.0).length for goal in goals]
        np.testing.assert_allclose(dubins_lengths(start, goals, 1.0), expected, atol=ROOT)


@pytest.mark.parametrize("timed", [False, True])
def test_fleet_lengths_are_the_cheapest_words(timed):
    rng = np.random.default_rng(2)
    fleet = random_fleet(rng, 12, timed=timed)
    starts, goals = random_poses(rng, 60), random_poses(rng, 60)
    costs = fleet_lengths(fleet, starts, goals)
    expected = [
        [plain_cost(fleet, car, a, b) for a, b in zip(starts, goals, strict=True)] for car in range(12)
    ]
    np.testing.assert_allclose(costs, expected, rtol=SAME)
    if not timed:
        best = shortest_word(
            fleet.left[3], fleet.right[3], fleet.direction[3], starts[0], goals[0], fleet.rates[3]
        )
        assert costs[3, 0] == pytest.approx(best.cost, rel=SAME)


def test_the_flat_points_of_a_fleet_go_the_shortest_dubins_paths():
    """By the matrices of the poses, in the plane of complex numbers, and one path at a time."""
    rng = np.random.default_rng(5)
    fleet = random_fleet(rng, 4)
    starts, goals = random_poses(rng, 6), random_poses(rng, 5)
    costs = fleet_lengths(fleet, starts[:, None], goals, flat=True)
    for car in range(4):
        point, heading = complex(*0.5 * (fleet.left[car] + fleet.right[car])), complex(*fleet.direction[car])
        for i, j in np.ndindex(6, 5):
            places = [complex(*X[:2]) + np.exp(1j * X[2]) * point for X in (starts[i], goals[j])]
            turns = [X[2] + np.angle(heading) for X in (starts[i], goals[j])]
            ends = [(z.real, z.imag, turn) for z, turn in zip(places, turns, strict=True)]
            radius = 0.5 * abs(complex(*(fleet.left[car] - fleet.right[car])))
            assert costs[car, i, j] == pytest.approx(dubins.shortest_path(*ends, radius).length, rel=SAME)


@pytest.mark.parametrize("timed", [False, True])
def test_fleet_lengths_make_no_spurious_turn(timed):
    rng = np.random.default_rng(3)
    for _ in range(20):
        fleet = random_fleet(rng, 1, tilt=1.0, timed=timed)
        car = (fleet.left[0], fleet.right[0], fleet.direction[0])
        pairs = list(driven_pairs(rng, car, 16))
        starts, goals = (np.array([pair[side] for pair in pairs]) for side in (0, 1))
        costs = fleet_lengths(fleet, starts, goals)[0]
        for (start, goal, _, _), cost in zip(pairs, costs, strict=True):
            # An arc off by a rounding of 1e-8 costs its root with a time law.
            assert cost == pytest.approx(plain_cost(fleet, 0, start, goal), abs=1e-3 if timed else 1e-6)


def test_both_straight_lengths_of_a_car_that_leans_back():
    rng = np.random.default_rng(4)
    car = tuple(map(np.array, ([0.5, 0.2], [-2.0, -0.2], [1.0, 0.0])))
    far = np.full((1, 3), np.inf)
    fleet = Fleet(*(v[None] for v in car), np.ones((1, 3)), far, far, np.zeros((1, 1)))
    goals = np.array(
        [
            end_pose(Word("LSR", np.array([t, s, u]), 0.0), *car, [0, 0, 0])
            for t, s, u in rng.uniform(0.1, 1.2, (60, 3))
        ]
    )
    expected = [shortest_word(*car, [0, 0, 0], goal).cost for goal in goals]
    np.testing.assert_allclose(fleet_lengths(fleet, np.zeros(3), goals)[0], expected, rtol=SAME)

    def takes_the_shorter(goal):
        both = [w.parameters[1] for w in words(*car, [0, 0, 0], goal) if w.word == "LSR"]
        best = shortest_word(*car, [0, 0, 0], goal)
        return len(both) == 2 and best.word == "LSR" and best.parameters[1] < max(both) - 0.1

    assert any(map(takes_the_shorter, goals))


def test_a_dubins_car_costs_its_dubins_length():
    rng = np.random.default_rng(5)
    for radius in (0.02, 1.3):
        mid = np.array([0.3, -0.2, rng.uniform(-4, 4)])
        fleet = dubins_fleet(radius, mid)
        assert fleet.is_dubins
        starts, goals = random_poses(rng, 300, reach=4 * radius), random_poses(rng, 300, reach=4 * radius)
        lengths = dubins_lengths(compose(starts, mid), compose(goals, mid), radius)
        np.testing.assert_allclose(fleet_lengths(fleet, starts, goals)[0], lengths, rtol=SAME)


def test_time_laws_meet_at_the_knee():
    fleet = random_fleet(np.random.default_rng(6), 1, timed=True)
    car = timed_car(fleet, 0)[1]
    for slope, ramp, root, knee in (car.left, car.straight, car.right):
        assert slope * knee + ramp == pytest.approx(np.sqrt(root * knee))
    assert np.hypot(*axle(fleet, 0)[2:]) == pytest.approx(1.0)


def test_threads_change_nothing():
    rng = np.random.default_rng(7)
    starts, goals = random_poses(rng, 1111), random_poses(rng, 1111)
    one = dubins_lengths(starts, goals, 0.7, threads=1)
    for threads in (2, 3, 7):
        np.testing.assert_array_equal(dubins_lengths(starts, goals, 0.7, threads=threads), one)
    fleet = random_fleet(rng, 2)
    table = fleet_lengths(fleet, starts[:, None], goals[:101], threads=1)
    np.testing.assert_array_equal(fleet_lengths(fleet, starts[:, None], goals[:101], threads=3), table)
    many = dubins_lengths(
        starts[:, None], goals[:101], 0.7
    )  # over 100 000: as many threads as there are cores
    np.testing.assert_array_equal(many, dubins_lengths(starts[:, None], goals[:101], 0.7, threads=1))


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ((5, 1), (7,)),
        ((7,), (5, 1)),
        ((5, 7), (5, 7)),
        ((5, 7), (7,)),
        ((2, 1, 3, 1), (4, 1, 5)),
        ((3, 1, 1), (1, 4, 1)),
        ((), (6,)),
        ((6, 1), ()),
        ((1, 1), (1,)),
        ((), ()),
        ((0,), (1,)),
        ((4, 1), (0,)),
    ],
)
def test_shapes_broadcast(a, b):
    rng = np.random.default_rng(8)
    starts, goals = random_poses(rng, *a), random_poses(rng, *b)
    lengths = dubins_lengths(starts, goals, 0.5)
    assert lengths.shape == np.broadcast_shapes(a, b)
    full = [np.broadcast_to(poses, (*lengths.shape, 3)).reshape(-1, 3) for poses in (starts, goals)]
    np.testing.assert_array_equal(lengths.ravel(), dubins_lengths(*full, 0.5))
    fleet = random_fleet(rng, 2)
    costs = fleet_lengths(fleet, starts, goals)
    assert costs.shape == (2, *lengths.shape)
    np.testing.assert_array_equal(costs.reshape(2, -1), fleet_lengths(fleet, *full))


def test_poses_may_be_views_and_read_only():
    rng = np.random.default_rng(9)
    wide = rng.uniform(-2, 2, (40, 6))
    wide.flags.writeable = False
    np.testing.assert_array_equal(
        dubins_lengths(wide[::2, ::2], wide[1::2, 1::2].tolist(), 1.0),
        dubins_lengths(wide[::2, ::2].copy(), wide[1::2, 1::2].copy(), 1.0),
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("which", [0, 1])
def test_a_pose_that_is_not_finite_is_refused(value, place, which):
    poses = np.random.default_rng(10).uniform(-2, 2, (2, 30, 3))
    poses[which, 17, place] = value
    with pytest.raises(InputError, match="finite"):
        dubins_lengths(*poses, 1.0)
    with pytest.raises(InputError, match="finite"):
        fleet_lengths(dubins_fleet(1.0, np.array([0.1, 0.2, 0.3])), *poses)
    with pytest.raises(InputError, match="broadcast"):
        dubins_lengths(np.zeros((2, 3)), np.zeros((4, 3)), 1.0)


@pytest.mark.slow
def test_the_loops_are_vectorised():
    """One branch or library call in a block would make the loops ten times slower and nothing else would tell."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    if not (features.get("avx512f") or features.get("avx2")):
        pytest.skip("this machine has neither AVX-512 nor AVX2")
    register = "zmm" if features.get("avx512f") else "ymm"
    from flatpush.steering.kernels import Frame, Law, Timed, Weighted
    from flatpush.steering.lengths import kernels

    # Compiled afresh, because a cached kernel keeps no assembly.
    poses, table = np.zeros((1, 8, 3)), np.zeros((1, 8))
    here, law = Frame(0.0, 0.0, 1.0, 0.0, 0.0), Law(1.0, 1.0, 1.0, 1.0)
    scratch = kernels.Bounds(0, 1, 0, 8), kernels.Tiles.new(), table
    for kernel, arguments in (
        (kernels.dubins_costs, (poses, poses, here, kernels.Round(1.0), *scratch)),
        (kernels.three_twist_costs, (poses, poses, here, Weighted(1.0, 1.0, 0.0, 1.0, 1.0, 1.0), *scratch)),
        (kernels.timed_costs, (poses, poses, here, Timed(1.0, 1.0, 0.0, law, law, law), *scratch)),
    ):
        fresh = type(kernel)(kernel.py_func, targetoptions=kernel.targetoptions)
        fresh(*arguments)
        (assembly,) = fresh.inspect_asm().values()
        for operation in ("vsqrtpd", "vmulpd", "vdivpd"):
            assert re.search(rf"{operation}\b.*%{register}", assembly), (kernel.__name__, operation)
