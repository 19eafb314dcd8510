"""What holds for every quasi-static push: no overlap, symmetry, no preferred frame, no time."""

from itertools import pairwise

import numpy as np
import pytest

import flatpush as fp
from flatpush.geometry import compose, wrap_angle
from flatpush.simulation.plant import Plant

HOOK = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.04), (0.04, 0.04), (0.04, 0.02), (0.0, 0.02)]
TRIANGLE = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
SHAPES = {"convex": TRIANGLE, "concave": HOOK, "circle": None}
TIPS = {1: np.array([[0.0, 0.0]]), 2: np.array([[0.0, 0.009], [0.0, -0.009]])}
MIRROR = np.array([1.0, -1.0, -1.0])
SAME = 1e-7  # [m] and [rad]


def outline(shape: str, flip: bool = False) -> fp.Outline:
    side = -1 if flip else 1
    if SHAPES[shape] is None:
        return fp.Outline.circle(0.02, (0.01, 0.004 * side))
    return fp.Outline.polygon([(x, side * y) for x, y in SHAPES[shape]])


def case(shape: str, seed: int, flip: bool = False) -> tuple[fp.Object, np.ndarray, float]:
    """An object on three feet and a hand that wanders across it; flipped, their mirror image in the x axis."""
    rng = np.random.default_rng(seed)
    side = np.array([1.0, -1.0]) if flip else np.ones(2)
    feet = np.array([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)]) + rng.normal(size=2) * 0.004
    mu = rng.uniform(0.0, 0.6)
    thing = fp.Object(outline(shape, flip), fp.Support.points(feet * side, [1, 2, 1.5]), mu)
    a = rng.uniform(-np.pi, np.pi)
    aim = thing.cof * side + rng.normal(size=2) * 0.012
    way = [np.array([*(aim - 0.07 * np.array([np.cos(a), np.sin(a)])), a])]
    for _ in range(15):
        noise = rng.normal(size=3) * [0.001, 0.001, 0.05]
        way.append(way[-1] + np.array([0.007 * np.cos(a), 0.007 * np.sin(a), 0.0]) + noise)
    return thing, np.array(way) * (MIRROR if flip else 1.0), mu


CASES = [(shape, k, seed) for shape in SHAPES for k in (1, 2) for seed in range(3)]


@pytest.mark.parametrize("model", ["ellipsoid", "exact"])
@pytest.mark.parametrize(("shape", "k", "seed"), CASES)
def test_nothing_overlaps(shape, k, seed, model):
    thing, way, _ = case(shape, seed)
    run = Plant(thing, TIPS[k], 0.0025, model=model).follow([0, 0, 0], way)
    assert np.min(run.gaps) > -1e-6
    assert np.any(run.object[-1] != 0)


@pytest.mark.parametrize(("shape", "k", "seed"), CASES)
def test_a_mirror_image_moves_as_the_mirror_image(shape, k, seed):
    thing, way, _ = case(shape, seed)
    run = Plant(thing, TIPS[k], 0.0025).follow([0, 0, 0], way)
    other, back, _ = case(shape, seed, flip=True)
    mirrored = Plant(other, TIPS[k] * [1, -1], 0.0025).follow([0, 0, 0], back)
    assert mirrored.object == pytest.approx(run.object * MIRROR, abs=SAME)


@pytest.mark.parametrize(("shape", "k", "seed"), CASES)
def test_the_table_has_no_preferred_place_or_direction(shape, k, seed):
    thing, way, _ = case(shape, seed)
    X = np.array([0.4, -0.7, 2.2])
    plant = Plant(thing, TIPS[k], 0.0025)
    here = plant.follow([0, 0, 0], way)
    there = plant.follow(X, compose(X, way))
    want = compose(X, here.object)
    assert there.object[:, :2] == pytest.approx(want[:, :2], abs=SAME)
    assert wrap_angle(there.object[:, 2] - want[:, 2]) == pytest.approx(0, abs=SAME)


@pytest.mark.parametrize(("shape", "k", "seed"), CASES)
def test_time_does_not_matter(shape, k, seed):
    """Twice as fast in one step for each pose, or slowly in two: the object ends at the same place."""
    thing, way, _ = case(shape, seed)
    plant = Plant(thing, TIPS[k], 0.0025)
    run = plant.follow([0, 0, 0], way)
    finer = np.repeat(way, 2, axis=0)[:-1]
    finer[1::2] = 0.5 * (way[1:] + way[:-1])
    away = np.abs(plant.follow([0, 0, 0], finer).object[::2] - run.object)
    assert np.all(away < [2e-5, 2e-5, np.deg2rad(0.01)])  # steps end elsewhere; most cases agree within 1e-8


@pytest.mark.parametrize("k", [1, 2])
def test_the_object_moves_only_while_it_is_touched(k):
    thing, way, _ = case("convex", 5)
    plant = Plant(thing, TIPS[k], 0.0025)
    state = plant.start([0, 0, 0], way[0])
    pushed = 0
    for a, b in pairwise(way):
        for _ in range(10):
            new = plant.step(state, (b - a) / 0.1, 0.01)
            moved = np.hypot(*(new.object - state.object)[:2]) > 0
            touching = new.gaps < 1e-8
            assert np.any(touching) or not moved
            pushed += int(moved)
            state = new
    assert pushed > 20
