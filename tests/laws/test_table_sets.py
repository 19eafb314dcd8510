"""The proof for a set of tables against linear programs, drawn loads, and the plant."""

import numpy as np
import pytest
from scipy.optimize import linprog

import flatpush as fp
from flatpush.contact import WrenchCone
from flatpush.contact.cone_twists import cone_twists
from flatpush.contact.table_set import TableSet, set_twists
from flatpush.friction.patches import patches
from flatpush.geometry import perpendicular

RECTANGLE = np.array([(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)])
SUPPORTS = {
    "feet": fp.Support.points([(-0.02, -0.012), (0.021, -0.01), (0.003, 0.015)], [1, 2, 1.5]),
    "face": fp.Support.polygon(RECTANGLE),
    "rim": fp.Support.outline(RECTANGLE),
    "disc": fp.Support.disc(0.025),
    "ring": fp.Support.ring(0.025),
}


def fingers(spacing=0.018, friction=0.3):
    return [fp.PointContact([x, -0.0175], [0, 1], friction) for x in (-0.5 * spacing, 0.5 * spacing)]


def inside(support, name, rng):
    """Random points of a pressure that is no feet, about its centre."""
    if name in ("disc", "ring"):
        r = 0.025 * (np.sqrt(rng.uniform(size=500)) if name == "disc" else np.ones(500))
        angle = rng.uniform(0, 2 * np.pi, 500)
        return np.column_stack([r * np.cos(angle), r * np.sin(angle)])
    points = rng.uniform(RECTANGLE.min(axis=0), RECTANGLE.max(axis=0), (500, 2))
    if name == "rim":
        side = rng.integers(2, size=500)
        points[np.arange(500), side] = np.sign(points[np.arange(500), side]) * RECTANGLE.max(axis=0)[side]
    return points


def vertex(weights, share, wanted):
    """Loads at the ends of their ranges, most where `wanted` is greatest, that sum to the nominal load."""
    loads, rest = (1 - share) * weights, share * np.sum(weights)
    for i in np.argsort(-wanted):
        more = min(2 * share * weights[i], rest)
        loads[i], rest = loads[i] + more, rest - more
    return loads


def turning(rng, n):
    """Twists of every kind: about near and far centres, both ways, translations."""
    centres, sense = rng.normal(size=(n, 2)) * 0.04, rng.choice([-1.0, 1.0], n)
    V = np.column_stack([sense * centres[:, 1], -sense * centres[:, 0], sense])
    V[: n // 5, 2] = 0.0
    return V


@pytest.mark.parametrize("name", SUPPORTS)
def test_patches_cover_the_pressure(name):
    """Their loads have the pressure's moments, and points drawn from it lie within reach of some patch."""
    support = SUPPORTS[name].centred()
    points, weights, reach = patches(support.pressure, 400)
    assert np.sum(weights) == pytest.approx(1)
    assert weights @ points == pytest.approx(np.zeros(2), abs=1e-9)
    size = np.max(reach, initial=0.0)
    assert np.max(np.abs((points * weights[:, None]).T @ points - support.covariance)) <= size**2
    drawn = points if name == "feet" else inside(support, name, np.random.default_rng(1))
    away = np.linalg.norm(drawn[:, None] - points[None], axis=2)
    assert np.all(np.any(away <= reach + 1e-12, axis=1))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.4])
def test_the_least_margin_of_feet_is_that_of_a_linear_program(share):
    rng = np.random.default_rng(3)
    cone = WrenchCone.of(fingers())
    feet = fp.Support.points(rng.normal(size=(6, 2)) * 0.02, rng.uniform(0.5, 2, 6)).centred()
    tables = TableSet.of(feet, share)
    points, weights = feet.feet
    for V in turning(rng, 40):
        v = V[:2] + V[2] * perpendicular(points)
        unit = v / np.linalg.norm(v, axis=1)[:, None]
        rows = np.column_stack([unit, (points[:, 0] * unit[:, 1] - points[:, 1] * unit[:, 0]) / cone.lever])
        size = np.linalg.norm(weights @ rows)
        bounds = np.stack([(1 - share) * weights, (1 + share) * weights], axis=1)
        least = min(
            linprog(rows @ n, A_eq=np.ones((1, 6)), b_eq=[1.0], bounds=bounds, method="highs").fun
            for n in cone.faces
        )
        assert tables.margin(cone, V) == pytest.approx(least / size, abs=1e-9)
        worst = tables.worst(cone, V)
        assert np.sum(worst.loads) == pytest.approx(1)
        assert np.all(np.abs(worst.loads - weights) <= share * weights + 1e-12)
        assert (worst.loads @ rows) @ worst.face / size == pytest.approx(worst.margin, abs=1e-9)


@pytest.mark.parametrize("name", SUPPORTS)
def test_no_table_of_the_set_slips_where_it_is_proved(name):
    """Loads drawn at the set's corners and inside, on a finer division of the pressure than the proof's."""
    rng = np.random.default_rng(5)
    cone, share = WrenchCone.of(fingers()), 0.2
    tables = TableSet.of(SUPPORTS[name], share)
    points, weights, _ = patches(SUPPORTS[name].centred().pressure, 3000)
    tilt, turn = rng.uniform(-0.4, 0.4, 400), rng.uniform(-30, 30, 400)
    twists = np.column_stack([np.sin(tilt), np.cos(tilt), turn])
    proved = twists[tables.margin(cone, twists) >= 0]
    assert len(proved) > 20
    halves = [vertex(weights, share, points @ rng.normal(size=2)) for _ in range(40)]
    mixed = [vertex(weights, share, rng.normal(size=len(weights))) for _ in range(10)]
    loads = np.array(halves + mixed)
    for V in proved:
        v = V[:2] + V[2] * perpendicular(points)
        unit = v / np.linalg.norm(v, axis=1)[:, None]
        rows = np.column_stack([unit, points[:, 0] * unit[:, 1] - points[:, 1] * unit[:, 0]])
        assert np.min(cone.depth(loads @ rows)) >= -1e-6


def test_a_foot_under_the_rotation_centre_may_resist_in_any_direction():
    feet = SUPPORTS["feet"].centred()
    cone, tables = WrenchCone.of(fingers()), TableSet.of(feet, 0.0)
    for x, y in feet.feet[0]:
        resting = fp.Exact(feet).wrench_set([y, -x, 1.0])
        angles = np.linspace(0, 2 * np.pi, 2000)
        free = resting.radius * np.column_stack([np.cos(angles), np.sin(angles)])
        moments = resting.point[0] * free[:, 1] - resting.point[1] * free[:, 0]
        heights = ((resting.centre + np.column_stack([free, moments])) / [1, 1, cone.lever]) @ cone.faces.T
        size = np.linalg.norm(resting.centre / [1, 1, cone.lever])
        assert tables.margin(cone, [y, -x, 1.0]) == pytest.approx(np.min(heights) / size, rel=1e-5)


def test_the_margin_falls_as_the_set_grows_and_bounds_close_with_smaller_patches():
    cone, V = WrenchCone.of(fingers()), np.array([0.0, 1.0, 8.0])
    shares = [float(TableSet.of(SUPPORTS["face"], s).margin(cone, V)) for s in (0.0, 0.1, 0.2, 0.4)]
    assert np.all(np.diff(shares) < 0)
    finer = [float(TableSet.of(SUPPORTS["face"], 0.2, n).margin(cone, V)) for n in (100, 400, 1600, 6400)]
    steps = np.diff(finer)
    assert np.all(steps > 0)
    assert np.all(steps[1:] < 0.6 * steps[:-1])


@pytest.mark.parametrize(("name", "radii"), [("rim", (32.7, 39.2, 45.9)), ("face", (22.5, 24.8, 27.3))])
def test_turning_radii_of_a_rectangle(name, radii):
    """As tight as a prototype's (loads ± 0, 10, 20 %; a fifth of μ and spacing in reserve), and really kept."""
    support = SUPPORTS[name].centred()
    nominal = cone_twists(fingers(), fp.Exact(support), 0.2, np.zeros((1, 2)))
    reserve = WrenchCone.of(fingers(0.8 * 0.018, 0.8 * 0.3))
    found = []
    for share in (0.0, 0.1, 0.2):
        left, straight, right = set_twists(TableSet.of(support, share), [reserve], nominal)
        finer = TableSet.of(support, share, 3000)
        for turn in (left, right):
            s = np.linspace(0, 1, 40)[:, None]
            assert np.min(finer.margin(reserve, (1 - s) * straight + s * turn)) >= -1e-9
        found.append(500 * np.linalg.norm(perpendicular(left[:2]) + perpendicular(right[:2])))
    assert np.all(np.array(found) <= 1.03 * np.array(radii))
    assert np.all(np.diff(found) > 0)
