"""Two fingers that push together: closed form, regions and cars of their composite cone, on seeded cases."""

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import (
    PointContact,
    StableCentres,
    WrenchCone,
    beyond_slider,
    cone_twists,
    stable_region,
    two_point_sticks,
)
from flatpush.experiments.cone import CASES, kept, scene, starts
from flatpush.friction import Ellipsoid, Exact, Support
from flatpush.geometry import velocity_at
from flatpush.planning import Planner
from flatpush.steering.car import Car

A, B = 1.02, 1936.0


def pair(m: float, h: float, w: float, mu: float) -> list[PointContact]:
    """Two contacts on a flat edge at y = -h with normal +y, spacing w about x = m."""
    return [PointContact([m + s * w / 2, -h], [0, 1], mu) for s in (-1, 1)]


def three_feet(rng: np.random.Generator) -> Exact:
    """Exact friction of random feet with random loads, centre of friction at the origin."""
    loads = rng.uniform(0.2, 1.0, 4)
    feet = rng.uniform(-0.02, 0.02, (4, 2))
    return Exact(Support.points(feet - loads @ feet / np.sum(loads), loads))


def rotation(centre: np.ndarray, sense: float = 1.0) -> np.ndarray:
    return sense * np.array([centre[1], -centre[0], 1.0])


def test_a_flat_edge_and_an_ellipsoid_match_the_closed_form():
    rng = np.random.default_rng(5)
    surface, rho = Ellipsoid(np.diag([A, A, B])), A / B
    inside = 0
    for _ in range(400):
        m, h, w = rng.uniform(-0.01, 0.01), rng.uniform(0.005, 0.03), rng.uniform(0.005, 0.03)
        mu = rng.uniform(0.1, 0.8)
        cx, cy = rng.uniform(-0.15, 0.15), rng.uniform(-0.03, 0.03)
        omega = rng.choice([-1.0, 1.0])
        gaps = (-cx * omega, mu * abs(cx) - abs(cy), 0.5 * w * abs(cx) - abs(rho + m * cx - h * cy))
        if min(abs(g) for g in gaps) < 1e-9:
            continue
        expected = min(gaps) > 0
        twist = rotation(np.array([cx, cy]), omega)
        contacts = pair(m, h, w, mu)
        assert two_point_sticks(contacts, surface, twist) == expected
        assert (WrenchCone.of(contacts).depth(surface.wrench(twist)) > 0) == expected
        inside += expected
    assert inside > 40


def test_straight_motions_match_the_closed_form():
    rng = np.random.default_rng(6)
    surface = Ellipsoid(np.diag([A, A, B]))
    for _ in range(200):
        h, w, mu, slope = *rng.uniform([0.005, 0.005, 0.1], [0.03, 0.03, 0.8]), rng.uniform(-1, 1)
        limit = min(mu, w / (2 * h))
        assert two_point_sticks(pair(0.0, h, w, mu), surface, [slope, 1.0, 0.0]) == (abs(slope) < limit)


def test_faces_and_rays_agree_under_coulomb_friction():
    rng = np.random.default_rng(7)
    found = np.zeros(2, dtype=int)
    for _ in range(30):
        surface, contacts = three_feet(rng), pair(0.0, 0.02, 0.02, rng.uniform(0.1, 0.8))
        cone = WrenchCone.of(contacts)
        for twist in rng.normal(size=(20, 3)) * [1, 1, 50] + [0, 1, 0]:
            wrenches = surface.wrench_set(twist)
            low, high = cone.depths(wrenches)
            assert low <= high + 1e-12
            if abs(high) > 1e-9:
                sticks = two_point_sticks(contacts, surface, twist)
                assert sticks == (high > 0)
                found[int(sticks)] += 1
    assert np.all(found > 30)


def test_the_region_of_centres_is_the_set_of_twists_that_stick():
    rng = np.random.default_rng(8)
    found = np.zeros(2, dtype=int)
    for _ in range(10):
        surface = Ellipsoid(np.diag([A, rng.uniform(0.8, 1.2), B]))
        contacts = pair(rng.uniform(-0.004, 0.004), 0.018, 0.018, 0.3)
        region = StableCentres.of(WrenchCone.of(contacts), surface)
        box = (-0.2, -0.2, 0.2, 0.2)
        for sense in (1, -1):
            from matplotlib.path import Path

            polygon = Path(region.polygon(sense, box))
            for centre in rng.uniform(-0.12, 0.12, (40, 2)):
                depth = WrenchCone.of(contacts).depth(surface.wrench(rotation(centre, sense)))
                if abs(depth) > 2e-3:  # the boundary is drawn by chords
                    assert polygon.contains_point(centre) == (depth > 0)
                    found[int(depth > 0)] += 1
    assert np.all(found > 20)


def test_stable_whatever_the_pressure_is_stable_under_each():
    """[Lynch1996]: their region for every pressure with this centre of friction lies in that of each of them."""
    rng = np.random.default_rng(9)
    box = np.array([[-0.02, -0.02], [0.02, -0.02], [0.02, 0.02], [-0.02, 0.02]])
    radius = float(np.hypot(0.02, 0.02))
    tried = 0
    for _ in range(40):
        # Feet anywhere in the square, COF in its middle: pairs of opposite feet bear equal loads.
        half = rng.uniform(-0.02, 0.02, (3, 2))
        loads = rng.uniform(0.1, 1.0, 3)
        surface = Exact(Support.points(np.concatenate([half, -half]), np.concatenate([loads, loads])))
        contacts = pair(rng.uniform(-0.005, 0.005), 0.02, rng.uniform(0.01, 0.03), rng.uniform(0.2, 0.8))
        region = stable_region(contacts, box, radius)
        for sense in (1, -1):
            centres = rng.uniform(-0.6, 0.6, (200, 2))
            for centre in centres[region.contains(centres, sense)]:
                assert two_point_sticks(contacts, surface, rotation(centre, sense))
                tried += 1
    assert tried > 200


def test_the_band_of_unique_motions_is_the_strip_beside_the_object():
    box = np.array([[-0.02, -0.02], [0.03, -0.02], [0.03, 0.02], [-0.02, 0.02]])
    contacts = pair(0.0, 0.02, 0.018, 0.3)
    assert beyond_slider(contacts, box, rotation(np.array([0.05, 0.3]))) == pytest.approx(0.02)
    assert beyond_slider(contacts, box, rotation(np.array([-0.05, -0.3]))) == pytest.approx(0.03)
    assert beyond_slider(contacts, box, rotation(np.array([0.0, 0.0]))) == pytest.approx(-0.02)
    assert beyond_slider(contacts, box, [0.0, 1.0, 0.0]) == np.inf
    round_side = [PointContact([s * 0.01, -0.02], [-s * 0.3, 1.0], 0.3) for s in (-1, 1)]
    assert beyond_slider(round_side, box, rotation(np.array([0.05, 0.0]))) is None


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("cost", ["flat", "pusher"])
def test_a_cone_car_keeps_both_contacts_in_all_its_motions(exact, cost):
    rng = np.random.default_rng(10)
    for _ in range(12):
        surface = three_feet(rng) if exact else Ellipsoid(np.diag([A, A, B]))
        contacts = pair(rng.uniform(-0.003, 0.003), 0.018, 0.018, rng.uniform(0.2, 0.6))
        margin = rng.uniform(0, 0.5)
        try:
            twists = cone_twists(contacts, surface, margin, np.array([[0.0, -0.0205]]), cost)
        except fp.NoDubinsReduction:
            continue
        car = Car.of_two(contacts, surface, twists)
        cone = WrenchCone.of(contacts)
        for curvature in np.linspace(-1, 1, 9) / car.radius:
            V = car.twist(curvature)
            assert np.hypot(*velocity_at(V, car.flat_point)) == pytest.approx(1.0)
            assert V[2] == pytest.approx(curvature, abs=1e-6 / car.radius)
            assert cone.depths(surface.wrench_set(V))[1] >= -1e-7


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_plans_of_the_cone_are_shorter_and_keep_both_contacts(case):
    for start in starts(4):
        cone = Planner(scene(case, start, "cone", 0.25)).plan()
        middle = Planner(scene(case, start, "middle", 0.25)).plan()
        assert cone.cost < middle.cost
        assert kept(cone)
        assert cone.certificate.composite_margin > 0.2
        assert cone.certificate.spacing_margin > 0.2
