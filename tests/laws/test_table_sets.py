"""The proof for a set of tables against linear programs, drawn loads, and the plant."""

import re
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from scipy.optimize import linprog

import flatpush as fp
from flatpush.contact import WrenchCone, narrowed
from flatpush.contact.cone_twists import cone_twists
from flatpush.contact.proved_twists import SHARE, Bounds, NothingProved, proved_twists
from flatpush.contact.set_twists import WIDE, set_twists
from flatpush.contact.table_set import TableSet
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
    order = np.argsort(-wanted)
    room = 2 * share * weights[order]
    given = np.diff(np.minimum(np.cumsum(room), share * np.sum(weights)), prepend=0.0)
    loads = (1 - share) * weights
    loads[order] += given
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
    points, weights, reach, along = patches(support.pressure, 400)
    assert np.sum(weights) == pytest.approx(1)
    assert weights @ points == pytest.approx(np.zeros(2), abs=1e-9)
    size = np.max(reach, initial=0.0)
    assert np.max(np.abs((points * weights[:, None]).T @ points - support.covariance)) <= size**2
    drawn = points if name == "feet" else inside(support, name, np.random.default_rng(1))
    away = np.linalg.norm(drawn[:, None] - points[None], axis=2)
    assert np.all(np.any(away <= reach + 1e-12, axis=1))
    assert np.all(np.linalg.norm(along, axis=1) == pytest.approx(float(name == "rim")))


@pytest.mark.parametrize("name", ["face", "rim", "disc", "ring"])
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_coarse_patches_never_promise_more_than_the_pressure_keeps(name, share):
    """Their margin is below the least over the faces by a knapsack on very fine loads, and by second order only."""
    rng = np.random.default_rng(8)
    cone, support = WrenchCone.of(fingers()), SUPPORTS[name].centred()
    points, weights, *_ = patches(support.pressure, 10_000)
    gaps = []
    twists = turning(rng, 20)
    for V in twists:
        v = V[:2] + V[2] * perpendicular(points)
        unit = v / np.linalg.norm(v, axis=1)[:, None]
        rows = np.column_stack([unit, (points[:, 0] * unit[:, 1] - points[:, 1] * unit[:, 0]) / cone.lever])
        size = np.linalg.norm(weights @ rows)
        least = min(vertex(weights, share, -rows @ n) @ rows @ n for n in cone.faces) / size
        coarse = [float(TableSet.of(support, share, count).margin(cone, V)) for count in (40, 400)]
        assert max(coarse) <= least + 1e-5
        gaps.append(least - coarse)
    far = np.median(gaps, axis=0)
    assert far[1] < (0.05 if name in ("rim", "ring") else 0.3) * far[0] + 1e-6


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
    points, weights, *_ = patches(SUPPORTS[name].centred().pressure, 3000)
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


@pytest.mark.parametrize("name", SUPPORTS)
def test_a_turn_is_kept_about_all_points_near_its_centre(name):
    """As straight lines between samples turn the object; the margin of the turn alone would promise more."""
    rng = np.random.default_rng(9)
    cone, near = WrenchCone.of(fingers()), 5e-4
    tables, finer = (TableSet.of(SUPPORTS[name], 0.2, count) for count in (100, 200))
    centres = rng.uniform(-0.06, 0.06, (2_000, 2))
    angles = 2 * np.pi * np.arange(8) / 8
    around = near * np.stack([np.cos(angles), np.sin(angles)], axis=1)

    def turns(middles):
        sense = np.sign(middles[..., :1])  # the side is pushed upwards: to the left about a point on the left
        return np.concatenate([-sense * middles[..., 1:], sense * middles[..., :1], -sense], axis=-1)

    centres = centres[tables.margin(cone, turns(centres)) >= 0]
    kept = replace(tables, aside=near).margin(cone, turns(centres)) >= 0
    held = np.all([finer.margin(cone, turns(centres + way)) >= -1e-9 for way in around], axis=0)
    assert np.all(held[kept])
    assert not np.all(held)
    assert np.sum(kept) > 0.5 * np.sum(held)


@pytest.mark.parametrize("name", SUPPORTS)
def test_the_greatest_mean_is_that_of_the_worst_loads_and_no_less_on_few_patches(name):
    """Of a linear function, whose mean over a patch is its value in the middle: loads differ within a patch as well."""
    fine, coarse = (TableSet.of(SUPPORTS[name], 0.3, count) for count in (4_000, 12))
    n, none = np.array([0.6, 0.8]), np.zeros(1)
    most = float(vertex(fine.weights, 0.3, fine.points @ n) @ fine.points @ n)
    assert float(fine.most(fine.points @ n, none, none)) == pytest.approx(most, rel=1e-9)
    said = float(coarse.most(coarse.points @ n, coarse.reach, np.zeros_like(coarse.reach)))
    assert said == pytest.approx(most, rel=1e-9) if name == "feet" else most < said < 1.4 * most


@pytest.mark.parametrize("name", ["face", "rim", "disc", "ring"])
def test_within_a_patch_powers_leave_their_bounds_nowhere(name):
    """Patches are sampled through and through; the bounds hold for each, and are not idle."""
    rng = np.random.default_rng(2)
    cone, tables = WrenchCone.of(fingers()), TableSet.of(SUPPORTS[name], 0.2, 30)
    if name == "rim":
        t = np.linspace(-1, 1, 401)[:, None, None]
        places = tables.points + t * (tables.reach[:, None] * tables.along)
    elif name == "face":  # whole cells of a grid, as they were cut
        half = 0.5 * np.array(
            [np.ptp(RECTANGLE[:, i]) / len(np.unique(tables.points[:, i].round(9))) for i in (0, 1)]
        )
        assert np.hypot(*half) == pytest.approx(tables.reach)
        grid = np.stack(np.meshgrid(*2 * [(np.arange(41) - 20) / 20.5], indexing="ij"), axis=-1).reshape(
            -1, 1, 2
        )
        places = tables.points + grid * half
    else:
        radii, angles = np.hypot(*tables.points.T), np.arctan2(*tables.points.T[::-1])
        places = []
        for r, angle in zip(radii, angles, strict=True):
            ring = np.abs(radii - r) < 1e-9
            half = np.pi / np.sum(ring)
            u, v = (
                k.ravel()
                for k in np.meshgrid((np.arange(40) + 0.5) / 40, (np.arange(50) - 24.5) / 25, indexing="ij")
            )
            inner, outer = 0.025, 0.025
            if name == "disc":
                rings = len(np.unique(radii.round(9)))
                k = np.searchsorted(np.unique(radii.round(9)), round(r, 9))
                inner, outer = 0.025 * k / rings, 0.025 * (k + 1) / rings
            rho = np.sqrt(inner**2 + u * (outer**2 - inner**2))
            places.append(np.stack([rho * np.cos(angle + v * half), rho * np.sin(angle + v * half)], axis=1))
        places = np.array(places).transpose(1, 0, 2)
    first_used, second_used = [], []
    for V in turning(rng, 40):
        g, first, second = (values[0] for values in tables._powers(cone.lever, V[None], cone.faces)[:3])
        v = V[:2] + V[2] * perpendicular(places)
        unit = v / np.linalg.norm(v, axis=-1)[..., None]
        torque = (places[..., 0] * unit[..., 1] - places[..., 1] * unit[..., 0]) / cone.lever
        there = np.einsum("ki,sni->skn", cone.faces, np.concatenate([unit, torque[..., None]], axis=-1))
        change, mean = np.max(np.abs(there - g), axis=0), np.abs(np.mean(there, axis=0) - g)
        assert np.all(change <= first + 1e-9)
        assert np.all(mean <= second + 2e-4)  # as good as the samples
        far = np.isfinite(second) & (second > 1e-3)
        first_used.append(np.max(change[far] / first[far], initial=0.0))
        second_used.append(np.max(mean[far] / second[far], initial=0.0))
    assert max(first_used) > 0.8
    assert max(second_used) > (0.05 if name in ("face", "disc") else 0.2)


@pytest.mark.parametrize("name", SUPPORTS)
def test_the_largest_share_is_where_the_margin_vanishes(name):
    rng = np.random.default_rng(4)
    cone, tables = WrenchCone.of(fingers()), TableSet.of(SUPPORTS[name], 0.1, 60)
    twists = np.column_stack([rng.uniform(-0.3, 0.3, 40), np.ones(40), rng.uniform(-25, 25, 40)])
    largest = tables.largest(cone, twists)
    inside = (largest > 1e-3) & (largest < 0.99)
    assert np.sum(inside) > 5
    for share, V in zip(largest[inside], twists[inside], strict=True):
        below, above = (replace(tables, share=share + d).margin(cone, V) for d in (-1e-6, 1e-6))
        assert above < 0 < below
    never = tables.margin(cone, twists) < 0
    assert np.all(largest[never] < 0.1)
    assert np.all(largest[~never] >= 0.1)


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


@pytest.mark.parametrize(
    ("name", "radii"), [("rim", (32.7, 39.2, 45.9, 106.0)), ("face", (22.5, 24.8, 27.3, 38.2))]
)
def test_turning_radii_of_a_rectangle(name, radii):
    """As tight as a prototype's (loads ± 0, 10, 20, 40 %; a fifth of μ and spacing in reserve), and really kept."""
    support = SUPPORTS[name].centred()
    nominal = cone_twists(fingers(), fp.Exact(support), 0.2, np.zeros((1, 2)))
    reserve = WrenchCone.of(fingers(0.8 * 0.018, 0.8 * 0.3))
    found = []
    for share in (0.0, 0.1, 0.2, 0.4):
        left, straight, right = set_twists([TableSet.of(support, share)], reserve, nominal)
        finer = TableSet.of(support, share, 1500)
        for turn in (left, right):
            s = np.linspace(0, 1, 40)[:, None]
            assert np.min(finer.margin(reserve, (1 - s) * straight + s * turn)) >= -1e-9
        found.append(500 * np.linalg.norm(perpendicular(left[:2]) + perpendicular(right[:2])))
    assert np.all(np.array(found) <= 1.03 * np.array(radii))
    assert np.all(np.diff(found) > 0)


def refused(bounds, name="feet", beside=0.0):
    """What is said where nothing is proved, and the values up to which a car remains, by the bound.

    Fingers whose span has the centre of friction beside it need friction to push straight.
    """
    support = SUPPORTS[name].centred()
    contacts = [replace(c, point=c.point + np.array([beside, 0.0])) for c in fingers()]
    nominal = cone_twists(contacts, fp.Exact(support), 0.2, np.zeros((1, 2)))
    with pytest.raises(NothingProved) as raised:
        proved_twists(support, contacts, 0.2, nominal, bounds)
    text = str(raised.value)
    values = {
        key: unit * float(found[1])
        for key, unit, pattern in (
            ("loads", 0.01, r"loads within ([\d.]+) % instead"),
            ("friction", 1.0, r"friction from ([\d.]+) instead"),
            ("offset", 0.001, r"an offset up to ([\d.]+) mm instead"),
        )
        if (found := re.search(pattern, text))
    }
    return text, values, support, contacts, nominal


def least_depth(twists, support, contacts, bounds):
    """The least depth of twists (n, 3) over the vertices of the loads of feet and the ends of the offset, (n,)."""
    cone, feet = (
        narrowed([replace(c, friction=bounds.friction) for c in contacts], 0.2),
        TableSet.of(support, 0.0),
    )
    tables = [
        fp.Support.points(
            feet.points + np.array([way, 0.0]), vertex(feet.weights, bounds.loads, np.array(order))
        )
        for order in permutations(range(len(feet.weights)))
        for way in {-bounds.offset, 0.0, bounds.offset}
    ]
    return np.min([cone.depth(table.wrench(twists)) for table in tables], axis=0)


@pytest.mark.parametrize(
    ("bounds", "beside", "named"),
    [
        (Bounds(0.4, 0.2, 0.003), 0.0, {"loads", "offset"}),
        (Bounds(0.6, 0.3, 0.0), 0.0, {"loads"}),
        (Bounds(0.0, 0.2, 0.009), 0.0, {"offset"}),
        (Bounds(0.02, 0.1, 0.0), 0.009, {"friction"}),
    ],
)
def test_a_refusal_names_the_bound_that_breaks_it_and_how_far_it_may_go(bounds, beside, named):
    """Against the vertices of the loads: a car at the value that is said, and one figure beyond it none, as some table
    slips in all straight motions, or in all turns to one side as wide as any that is looked at."""
    _, values, support, contacts, nominal = refused(bounds, beside=beside)
    assert set(values) == named
    ways = np.deg2rad(np.linspace(-30, 30, 601)) + np.pi / 2
    turns = np.array([-1.0, 0.0, 1.0])[:, None] / (WIDE * support.radius)
    motions = np.stack(np.broadcast_arrays(np.cos(ways), np.sin(ways), turns), axis=-1)
    for key, value in values.items():
        good = replace(bounds, **{key: value})
        car = proved_twists(support, contacts, 0.2, nominal, good)
        assert np.min(least_depth(car, support, contacts, good)) >= -1e-9
        figure = 10.0 ** (np.floor(np.log10(value * (1 + 1e-9))) - 1)
        beyond = replace(bounds, **{key: value - figure if key == "friction" else value + figure})
        kept = least_depth(motions.reshape(-1, 3), support, contacts, beyond).reshape(3, -1) >= 0
        assert not np.all(np.any(kept, axis=1))


def test_a_refusal_says_where_bounds_break_it_together():
    text, values, support, contacts, nominal = refused(Bounds(0.6, 0.3, 0.009))
    assert not values
    assert "loads and offset break it together" in text
    proved_twists(support, contacts, 0.2, nominal, Bounds(0.0, 0.3, 0.0))


# How exactly it is known where cars end, on either side.
KNOWN = 1 + 2 * SHARE


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "bounds"),
    [
        ("face", Bounds(0.4, 0.2, 0.003)),
        ("rim", Bounds(0.4, 0.3, 0.003)),
        ("face", Bounds(0.2, 0.0001, 0.0)),
        ("ring", Bounds(0.5, 0.2, 0.004)),
    ],
)
def test_bounds_that_a_refusal_names_are_those_at_which_cars_end(name, bounds):
    """Of spread pressure, against the whole search for a car on either side of what is said."""
    _, values, support, contacts, nominal = refused(bounds, name)
    assert values
    for key, value in values.items():
        proved_twists(support, contacts, 0.2, nominal, replace(bounds, **{key: value}))
        figure = 10.0 ** (np.floor(np.log10(value * (1 + 1e-9))) - 1)
        # Where cars end is known to a share, so one may lie just beyond a round figure.
        beyond = (value - figure) / KNOWN if key == "friction" else (value + figure) * KNOWN
        with pytest.raises(NothingProved):
            proved_twists(support, contacts, 0.2, nominal, replace(bounds, **{key: beyond}))
