"""What holds for every quasi-static push: no overlap, symmetry, no preferred frame, no time."""

from itertools import islice, pairwise

import numpy as np
import pytest
from scipy.optimize import nnls

import flatpush as fp
from flatpush.contact import PointContact
from flatpush.geometry import compose, inverse, log, shift_twist, transform, velocity_at, wrap_angle
from flatpush.simulation.plant import MODES, Plant
from flatpush.simulation.plant.plain import facing

HOOK = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.04), (0.04, 0.04), (0.04, 0.02), (0.0, 0.02)]
TRIANGLE = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
SHAPES = {"convex": TRIANGLE, "concave": HOOK, "circle": None}
TIPS = {1: np.array([[0.0, 0.0]]), 2: np.array([[0.0, 0.009], [0.0, -0.009]])}
MIRROR = np.array([1.0, -1.0, -1.0])
TOUCHING = {"sticking", "sliding_left", "sliding_right"}
SCALE = np.array([1.0, 1.0, 0.02])  # of a wrench: forces, and torques at the size of these objects
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


def body_twists(run, cof):
    """Between poses of a run, about the centre of friction, shape (n - 1, 3)."""
    steps = log(compose(inverse(run.object[:-1]), run.object[1:]))
    return np.array([shift_twist(V, cof) for V in steps])


@pytest.mark.parametrize("model", ["ellipsoid", "exact"])
@pytest.mark.parametrize(("shape", "k", "seed"), CASES)
def test_the_fingers_can_give_the_wrench_that_friction_takes(shape, k, seed, model):
    """Within the friction cones, at the edge where a finger slides, and never for free (seen in small steps)."""
    thing, way, mu = case(shape, seed)
    fine = np.concatenate([np.linspace(a, b, 400, endpoint=False) for a, b in pairwise(way)])
    plant = Plant(thing, TIPS[k], 0.0025, model=model, friction=max(mu, 0.05))
    run = plant.follow([0, 0, 0], fine)
    modes = np.array(MODES)[run.modes]
    checked = 0
    steps = zip(body_twists(run, plant.cof), modes[:-1], modes[1:], run.object[1:], fine[1:], strict=True)
    for twist, before, after, object_, hand in islice(steps, 0, None, 11):
        feet = np.hypot(*velocity_at(twist, thing.support.pressure.points).T)
        still = np.min(feet) < 0.05 * np.max(feet)  # a foot that stands may take any of many forces
        if np.hypot(*twist[:2]) < 1e-6 or still or np.any(before != after) or not set(after) & TOUCHING:
            continue
        wrench = plant.surface.wrench(twist)
        assert wrench @ twist > 0
        edges = []
        for tip, mode in zip(transform(inverse(object_), transform(hand, TIPS[k])), after, strict=True):
            places = [place for place in facing(thing.outline, tip) if place[0] < 0.0025 + 1e-7]
            for _, point, normal, _ in places:
                contact = PointContact(point - plant.cof, normal, plant.friction, hook=True)
                for force, slip in zip(contact.force_edges(), ("sliding_left", "sliding_right"), strict=True):
                    if mode in {"sticking", slip} or len(places) > 1:
                        edges.append(contact.wrench(force) / SCALE)
        _, off = nnls(np.array(edges).T, wrench / SCALE)
        # Of the step's order: at a corner the normal turns by the way that the tip makes, by its radius.
        assert off < 0.01 * np.linalg.norm(wrench / SCALE)
        checked += 1
    assert checked > 30


@pytest.mark.parametrize("radius", [0.0, 0.003, 0.01])
def test_a_finger_that_does_not_turn_rolls(radius):
    """While it sticks, the contact goes along the edge by the radius times the turn of object and finger."""
    thing = fp.Object([(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)], friction=2.0)
    way = np.linspace([0.008, -0.02 - radius, 0.0], [0.012, 0.0, 0.3], 101)
    run = Plant(thing, [[0.0, 0.0]], radius).follow([0, 0, 0], way)
    assert {MODES[m] for m in run.modes[1:, 0]} == {"sticking"}
    turn = run.object[-1, 2] - way[-1, 2]
    assert abs(turn) > 0.1
    moved = run.points[-1, 0, 0] - run.points[0, 0, 0]
    assert moved == pytest.approx(-radius * turn, abs=1e-9)
