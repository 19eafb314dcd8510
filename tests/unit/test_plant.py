"""The plant: fingers and an object, step by step, compiled; its parts against their plain versions."""

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import PointContact
from flatpush.errors import InputError
from flatpush.friction import Exact, LimitSurface
from flatpush.simulation.plant import MODES, Plant, facing, steps
from flatpush.simulation.plant import runner as module
from flatpush.simulation.plant.arrays import interpreted, outline_arrays, surface_arrays
from flatpush.simulation.plant.contact_modes import one
from flatpush.simulation.plant.facing import nearest
from flatpush.simulation.plant.resistance import stick_of, twist_of, wrench_of

TRIANGLE = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
HOOK = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.04), (0.04, 0.04), (0.04, 0.02), (0.0, 0.02)]


def surfaces() -> dict[str, LimitSurface]:
    rng = np.random.default_rng(5)
    feet = fp.Support.points([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)])
    many = fp.Support.points(rng.normal(size=(60, 2)) * 0.02, rng.uniform(0.2, 1.0, 60))
    found: dict[str, LimitSurface] = {
        "three feet": Exact(feet.centred()),
        "sixty feet": Exact(many.centred()),
        "polygon": Exact(fp.Support.polygon(TRIANGLE).centred()),
        "outline": Exact(fp.Support.outline(TRIANGLE).centred()),
        "disc": Exact(fp.Support.disc(0.03)),
        "ring": Exact(fp.Support.ring(0.03)),
        "moved": Exact(fp.Support.polygon(TRIANGLE).centred().translated((0.002, -0.003))),
        "ellipsoid": fp.Ellipsoid(np.array([[1.0, 0.1, 3.0], [0.1, 1.3, 5.0], [3.0, 5.0, 1800.0]])),
        "quartic": fp.Quartic([1, 1.2, 3e6, 0.1, 9, 0, 0, 0, 0, 2, 4e3, 4e3, 0, 0, 0]),
    }
    return found


@pytest.mark.parametrize("name", list(surfaces()))
def test_arrays_resist_as_the_surfaces_they_were_made_of(name):
    surface = surfaces()[name]
    arrays = interpreted(surface_arrays(surface))
    ell = arrays.unit
    units = np.array([1.0, 1.0, ell])
    rng = np.random.default_rng(1)

    def unit(x):
        return x / np.linalg.norm(x)

    for _ in range(100):
        x = rng.normal(size=3) * 10 ** rng.uniform(-2, 2, 3)
        F = np.array(wrench_of(arrays, *map(float, x))[:3])
        assert unit(F) == pytest.approx(unit(surface.wrench(x / units) / units), abs=1e-10)
        V = np.array(twist_of(arrays, *map(float, x)))
        assert unit(V) == pytest.approx(unit(surface.twist(x * units) * units), abs=1e-9)
        p, u = rng.normal(size=2) * 1.5, rng.normal(size=2)
        V = np.array(stick_of(arrays, *map(float, [*p, *u])))
        assert pytest.approx(surface.stick(p * ell, u) * units, abs=1e-10) == V


def test_where_the_facet_of_a_foot_ends_the_object_still_turns_about_the_foot():
    """There the foot's own friction is all used: Newton's method, for wrenches beside facets, is good to 1e-8 only."""
    arrays = interpreted(surface_arrays(surfaces()["three feet"]))
    for foot in arrays.feet:
        about = np.array([foot.y, -foot.x, 1.0])
        for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
            gx, gy = foot.weight * np.cos(angle), foot.weight * np.sin(angle)
            F = [foot.fx + gx, foot.fy + gy, foot.t + foot.x * gy - foot.y * gx]
            V = np.array(twist_of(arrays, *map(float, F)))
            assert V / np.linalg.norm(V) == pytest.approx(about / np.linalg.norm(about), abs=1e-12)
            # A contact at a distance r from the foot, pushed square to the arm: the moment of the rotation's wrench
            # about it, m + r k, is what the foot's friction can balance with that arm.
            c, s = np.cos(angle), np.sin(angle)
            m, k = foot.t - foot.x * foot.fy + foot.y * foot.fx, s * foot.fx - c * foot.fy
            for sign in (1.0, -1.0):
                r = m / (sign * foot.weight - k)
                if r > 0:
                    p, u = [foot.x + r * c, foot.y + r * s], [-s, c]
                    V = np.array(stick_of(arrays, *map(float, [*p, *u])))
                    assert pytest.approx(about / r, abs=1e-12 * (1 + 1 / r)) == V


@pytest.mark.parametrize("name", list(surfaces()))
def test_one_contact_moves_as_point_contact_says(name):
    surface = surfaces()[name]
    arrays = interpreted(surface_arrays(surface))
    ell = arrays.unit
    rng = np.random.default_rng(2)
    for i in range(100):
        p, u, n = rng.normal(size=2) * ell * 1.5, rng.normal(size=2), rng.normal(size=2)
        n = n / np.hypot(*n)
        mu = 0.0 if i % 9 == 0 else rng.uniform(0, 1.5)
        want = PointContact(p, n, mu, hook=True).motion(surface, u)
        mode, *V, slip = one(arrays, *map(float, [*(p / ell), *n, *u]), mu)
        assert MODES[mode] == want.mode.value
        assert np.array(V) == pytest.approx(
            want.twist * [1, 1, ell], abs=1e-8 * (1 + np.abs(want.twist[:2]).max())
        )
        assert slip == pytest.approx(want.slip, abs=1e-8 * (1 + abs(want.slip)))


def test_outlines_are_seen_as_outline_nearest_sees_them():
    rng = np.random.default_rng(3)
    for outline in (
        fp.Outline.polygon(HOOK),
        fp.Outline.polygon(TRIANGLE[::-1]),
        fp.Outline.circle(0.02, (0.01, 0)),
    ):
        arrays = interpreted(outline_arrays(outline))
        for point in rng.uniform(-0.03, 0.08, (300, 2)):
            want = outline.nearest(point)
            d, px, py, nx, ny, feature = nearest(arrays, *map(float, point))
            assert d == pytest.approx(want.distance, abs=1e-15)
            assert [px, py] == pytest.approx(want.point, abs=1e-15)
            if feature % 2 == 0:
                assert [nx, ny] == pytest.approx(want.normal, abs=1e-15)
            else:  # from the corner on
                assert np.array([px, py]) - d * np.array([nx, ny]) == pytest.approx(point, abs=1e-12)


@pytest.fixture(scope="module")
def square():
    return fp.Object([(-1, -1), (1, -1), (1, 1), (-1, 1)], friction=0.5)


def test_a_straight_push_through_the_centre_translates(square):
    plant = Plant(square, [[0.0, 0.0]], 0.1)
    state = plant.start([0, 0, 0.3], np.array([-1.3 * np.cos(0.3), -1.3 * np.sin(0.3), 0.3]))
    assert state.modes == ("separation",)
    for _ in range(10):
        state = plant.step(state, [np.cos(0.3), np.sin(0.3), 0.0], 0.1)
    assert state.modes == ("sticking",)
    assert state.object == pytest.approx([0.8 * np.cos(0.3), 0.8 * np.sin(0.3), 0.3], abs=1e-9)
    assert state.gaps[0] == pytest.approx(0, abs=1e-9)


def test_a_start_inside_is_an_outcome_or_is_pushed_out(square):
    plant = Plant(square, [[0.0, 0.3], [0.0, -0.3]], 0.1)
    inside = plant.start([0, 0, 0], [-1.0, 0.0, 0.0], push_out=False)
    assert inside.outcome == "starts inside"
    assert plant.step(inside, [1, 0, 0], 1.0) is inside
    out = plant.start([0, 0, 0], [-1.0, 0.0, 0.0])
    assert out.outcome == ""
    assert out.object == pytest.approx([0.1, 0, 0], abs=1e-9)
    assert plant.follow([0, 0, 0], [[-1.0, 0, 0], [-0.5, 0, 0]], push_out=False).outcome == "starts inside"


def test_what_overlaps_a_little_more_than_it_may_is_pushed_out(square):
    """Deeper than a start may be, and no deeper than twice that."""
    deep = 1.5 * facing.OVERLAP * square.outline.size
    plant = Plant(square, [[0.0, 0.0]], 0.1)
    hand = [-1.1 + deep, 0.2, 0.0]
    assert plant.start([0, 0, 0], hand, push_out=False).outcome == "starts inside"
    state = plant.start([0, 0, 0], hand)
    assert state.outcome == ""
    assert state.object == pytest.approx([deep, 0, 0], abs=1e-12)


def test_a_finger_on_its_way_neither_creeps_nor_leaps(monkeypatch):
    """Before it touches it goes most of the gap at once, and yet it meets a needle that it would pass in a leap."""
    monkeypatch.setattr(module, "PATIENCE", 1e9)
    monkeypatch.setattr(module, "_ready", set())
    looked = []
    real = steps._first_touch
    monkeypatch.setattr(steps, "_first_touch", lambda *args: (looked.append(1), real(*args))[1])
    needle = fp.Object([(0, 0), (0.04, 0), (0.04, 0.001), (0, 0.001)], friction=0.3)
    plant = Plant(needle, [[0.0, 0.0]], 0.0002)
    run = plant.follow([0, 0, 0], [[0.039, -0.43, np.pi / 2], [0.039, 0.4, np.pi / 2]])
    assert abs(run.object[-1][2]) > 0.1
    looked.clear()
    assert np.array_equal(
        plant.follow([0, 0, 0], [[0.0, -2.0, 0.0], [0.0, -0.02, 0.0]]).object[-1], np.zeros(3)
    )
    assert len(looked) < 60  # 3000 steps of a sixtieth of the object


def test_a_finger_that_never_touches_leaves_the_object_alone(square):
    run = Plant(square, [[0.0, 0.0]], 0.1).follow([0, 0, 0], [[-3.0, 0, 0], [-3.0, 5.0, 0], [3.0, 5.0, 0]])
    assert run.outcome == ""
    assert np.all(run.object == 0)
    assert np.all(run.modes == MODES.index("separation"))


def test_two_fingers_on_opposite_sides_grasp_and_one_that_stands_still_jams(square):
    plant = Plant(square, [[0.0, 0.0], [0.0, 0.0]], 0.1)
    state = plant.start([0, 0, 0], [[-1.1, 0, 0], [1.2, 0, 0]])
    state = plant.step(state, [[1.0, 0, 0], [-1.0, 0, 0]], 1.0)
    assert state.outcome == "grasped"
    assert state.object == pytest.approx([0.05, 0, 0], abs=1e-7)
    state = plant.start([0, 0, 0], [[-1.1, 0, 0], [1.2, 0, 0]])
    state = plant.step(state, [[1.0, 0, 0], [0.0, 0, 0]], 1.0)
    assert state.outcome == "jammed"
    assert state.object == pytest.approx([0.1, 0, 0], abs=1e-7)


def test_many_runs_are_the_single_runs(square):
    rng = np.random.default_rng(0)
    starts = rng.normal(size=(12, 3)) * 0.02
    angle = np.linspace(0, 0.5, 20)
    hand = np.stack([-1.2 + 2 * np.sin(angle), 2 * (1 - np.cos(angle)), angle], axis=1)
    mus = rng.uniform(0.2, 0.6, 12)
    cofs = rng.normal(size=(12, 2)) * 0.1
    drawn = [fp.Ellipsoid(np.diag([1, 1, rng.uniform(1, 2)])) for _ in range(12)]
    for fingers in ([[0.0, 0.0]], [[0.0, 0.4], [0.0, -0.4]]):
        plant = Plant(square, fingers, 0.1)
        runs = plant.many(starts, hand, friction=mus, surfaces=drawn, cofs=cofs, record=True)
        for i in range(12):
            one = Plant(square, fingers, 0.1, surface=drawn[i], friction=mus[i], cof=cofs[i])
            run = one.follow(starts[i], hand)
            assert np.array_equal(run.object, runs.object[i])
            assert np.array_equal(run.modes, runs.modes[i])
            assert np.array_equal(runs.final[i], run.object[-1])


def patient(monkeypatch, interpreted_steps):
    """As in a new process that interprets so many steps before it compiles."""
    monkeypatch.setattr(module, "PATIENCE", interpreted_steps)
    monkeypatch.setattr(module, "_interpreted", {})
    monkeypatch.setattr(module, "_spent", {})
    monkeypatch.setattr(module, "_ready", set())


COMPILED_ANYWAY = ["three feet", "ellipsoid"]


def test_what_takes_too_long_to_interpret_is_broken_off_and_compiled(square, monkeypatch):
    """A run in which fingers just slide takes minutes by the interpreter, and its length does not tell."""
    patient(monkeypatch, 1e9)
    monkeypatch.setattr(module, "ENOUGH", 0.01)
    angle = np.linspace(0, 0.5, 200)
    hand = np.stack([-1.2 + 2 * np.sin(angle), 2 * (1 - np.cos(angle)), angle], axis=1)
    plant = Plant(square, [[0.0, 0.4], [0.0, -0.4]], 0.1, surface=surfaces()["three feet"])
    starts = np.zeros((3, 3))
    broken_off = plant.many(starts, hand, record=True)
    assert module._ready
    monkeypatch.setattr(module, "ENOUGH", 1e9)
    monkeypatch.setattr(module, "_ready", set())
    interpreted = plant.many(starts, hand, record=True)
    assert not module._ready
    assert np.array_equal(broken_off.object, interpreted.object)
    assert np.array_equal(broken_off.modes, interpreted.modes)


@pytest.mark.parametrize("threads", [1, None])
def test_runs_that_differ_forget_those_before_and_do_not_depend_on_threads(square, threads):
    """What runs have of their own is kept for the next task, which has other coefficients or centres, or the same."""
    plant, starts = Plant(square, [[0.0, 0.0]], 0.1), np.zeros((40, 3))
    hand = np.column_stack([np.linspace(-1.2, 0.0, 200), np.full(200, 0.4), np.zeros(200)])
    slippery, rough = np.linspace(0.0, 0.1, 40), np.linspace(0.5, 0.9, 40)
    centres = np.tile([0.0, 0.1], (40, 1))
    asked = [(slippery, None), (rough, None), (rough, centres), (slippery, None)]
    ends = [plant.many(starts, hand, friction=mu, cofs=c, threads=threads).final for mu, c in asked]
    np.testing.assert_array_equal(ends[0], ends[3])
    for (mu, c), found in zip(asked, ends, strict=True):
        fresh = Plant(square, [[0.0, 0.0]], 0.1)
        one = fresh.many(starts[:1], hand, friction=mu[-1:], cofs=None if c is None else c[:1]).final
        np.testing.assert_array_equal(found[-1], one[0])
    assert len({tuple(np.round(found[-1], 6)) for found in ends}) == 3


@pytest.mark.parametrize(
    "name",
    [*COMPILED_ANYWAY, *(pytest.param(n, marks=pytest.mark.slow) for n in ("polygon", "disc", "quartic"))],
)
def test_a_first_run_is_every_later_run_to_the_last_bit(monkeypatch, name):
    """What is interpreted before the kernels are there and what they compute then are the same numbers."""
    thing = fp.Object(HOOK, friction=0.35)
    hand = [[0.05, -0.01, 1.5], [0.05, 0.02, 1.6], [0.045, 0.04, 1.9], [0.0, 0.06, 2.4]]
    plant = Plant(thing, [[0.0, 0.009], [0.0, -0.009]], 0.0025, surface=surfaces()[name])
    runs = []
    for patience in (1e9, 0.0):
        patient(monkeypatch, patience)
        runs.append(plant.follow([0, 0, 0], hand, body=True))
        assert bool(module._ready) == (patience == 0.0)
    assert np.array_equal(runs[0].object, runs[1].object)
    assert np.array_equal(runs[0].modes, runs[1].modes)
    assert np.any(runs[0].object[-1] != 0)


def test_a_finger_in_a_hollow_is_not_watched_step_by_step(monkeypatch):
    """Its two contacts swapped places with the rounding, taken for a change of what is touched: every step was
    halved to the least, and such a push cost a thousand times what others cost."""
    feet = np.array([(10.19, -16.89), (-10.32, -1.77), (10.04, 7.51)]) / 1000
    corners = [
        (24.25, 9.57), (-18.72, 22.76), (-31.14, 1.14), (-18.80, -8.63), (-18.97, -23.40), (16.09, -23.50),
        (18.04, -10.12),
    ]  # fmt: skip
    thing = fp.Object(np.array(corners) / 1000, fp.Support.points(feet, [0.131, 0.311, 0.558]), 0.33)
    taken = []
    real = steps.close_gaps
    monkeypatch.setattr(steps, "close_gaps", lambda *args: (taken.append(args[2]), real(*args)))
    patient(monkeypatch, 1e9)
    way = np.array([[-24.35, -7.81, 0.0], [46.13, 63.13, 0.0]]) / 1000
    run = Plant(thing, [[0.0, 0.0]], 0.0025).follow([0, 0, 0], way)
    assert run.outcome == ""
    assert 60 < len(taken) < 300
    assert run.object[-1] == pytest.approx([0.028853, 0.012481, -1.579406], abs=2e-6)


def test_what_makes_no_sense_is_refused(square):
    for wrong in ([], [[0.0, 0.0, 0.0]], [[0.0, np.nan]]):
        with pytest.raises(InputError, match="fingers are"):
            Plant(square, wrong, 0.1)
    for keys in ({"friction": -0.1}, {"model": "local"}, {"cof": [0.0]}):
        with pytest.raises(InputError):
            Plant(square, [[0.0, 0.0]], 0.1, **keys)
    with pytest.raises(InputError, match="1000 times the object's size"):
        Plant(square, [[1e9, 0.0]], 0.1)
    plant = Plant(square, [[0.0, 0.0]], 0.1)
    with pytest.raises(InputError, match="20000 times the object's size"):
        plant.follow([0, 0, 0], [[-1.2, 0, 0], [1e9, 0, 0]])
    state = plant.start([0, 0, 0], [-1.1, 0, 0])
    with pytest.raises(InputError, match="20000 times the object's size"):
        plant.step(state, [1e9, 0, 0], 1.0)
    for velocity, dt in (([1, 0], 0.1), ([np.nan, 0, 0], 0.1), ([1, 0, 0], -0.1)):
        with pytest.raises(InputError):
            plant.step(state, velocity, dt)
    with pytest.raises(InputError, match="one for each of 2 runs"):
        plant.many(np.zeros((2, 3)), [[-1.1, 0, 0]], friction=[0.1, 0.2, 0.3])
    with pytest.raises(InputError, match="threads are 1 or more"):
        plant.many(np.zeros((2, 3)), [[-1.1, 0, 0]], threads=-1)


@pytest.mark.parametrize("far", [1e9, 1e308])
def test_what_is_too_far_away_for_contacts_is_refused(square, far):
    """Where places are rounded by more than contacts are exact, a push would not end."""
    plant, there, way = Plant(square, [[0.0, 0.0]], 0.1), [far, 0, 0], [[far - 1.2, 0, 0], [far, 0, 0]]
    for made in (
        lambda: plant.start(there, [0, 0, 0]),
        lambda: plant.start([0, 0, 0], there),
        lambda: plant.follow(there, way),
        lambda: plant.many([there], way),
    ):
        with pytest.raises(InputError, match="times the object's size from the origin"):
            made()
