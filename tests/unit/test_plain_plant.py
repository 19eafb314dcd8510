"""The plain plant: the compiled one is held to it, and it takes any number of fingers."""

import numpy as np
import pytest

import flatpush as fp
from flatpush.simulation.plant import MODES, Plant
from flatpush.simulation.plant.runner import Runner

TRIANGLE = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
HOOK = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.04), (0.04, 0.04), (0.04, 0.02), (0.0, 0.02)]
SHAPES = {
    "convex": fp.Outline.polygon(TRIANGLE),
    "concave": fp.Outline.polygon(HOOK),
    "circle": fp.Outline.circle(0.02, (0.01, 0.0)),
}
TIPS = {1: [[0.0, 0.0]], 2: [[0.0, 0.009], [0.0, -0.009]]}
# Both stop at a touch within 2e-8 of the size, and halve steps at a change of mode: [m] and [rad].
AGREE = 3e-7


def push(shape: str, k: int, seed: int) -> tuple[fp.Object, np.ndarray, str]:
    """An object and a hand that wanders across it from a free place, so that it touches, passes corners and leaves."""
    rng = np.random.default_rng(seed)
    model = "ellipsoid" if k == 2 or seed % 2 else "exact"
    feet = np.array([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)]) + rng.normal(size=2) * 0.004
    thing = fp.Object(SHAPES[shape], fp.Support.points(feet), friction=rng.uniform(0.0, 0.6))
    a = rng.uniform(-np.pi, np.pi)
    aim = thing.cof + rng.normal(size=2) * 0.012
    way = [np.array([*(aim - 0.07 * np.array([np.cos(a), np.sin(a)])), a])]
    for _ in range(12):
        noise = rng.normal(size=3) * [0.001, 0.001, 0.05]
        way.append(way[-1] + np.array([0.008 * np.cos(a), 0.008 * np.sin(a), 0.0]) + noise)
    return thing, np.array(way), model


FAST = [(1, 0), (2, 1)]  # with exact friction, and with two fingers
SLOW = [(k, seed) for k in (1, 2) for seed in range(4) if (k, seed) not in FAST]


@pytest.mark.parametrize(("k", "seed"), [*FAST, *(pytest.param(*s, marks=pytest.mark.slow) for s in SLOW)])
@pytest.mark.parametrize("shape", list(SHAPES))
def test_the_compiled_plant_moves_as_the_plain_one(shape, k, seed):
    thing, way, model = push(shape, k, seed)
    fast, slow = (Plant(thing, TIPS[k], 0.0025, model=model, plain=plain) for plain in (False, True))
    want, got = slow.follow([0, 0, 0], way), fast.follow([0, 0, 0], way)
    assert got.outcome == want.outcome
    assert got.object == pytest.approx(want.object, abs=AGREE)
    assert got.points == pytest.approx(want.points, abs=AGREE)
    assert got.gaps == pytest.approx(want.gaps, abs=AGREE)
    assert np.array_equal(got.modes, want.modes)


def test_the_pushes_that_are_compared_show_every_event():
    """Touch, loss, both slips, sticking, and corners passed: the comparison above is about something."""
    seen: set[str] = set()
    corners = 0
    for shape in SHAPES:
        for k in (1, 2):
            for seed in range(4):
                thing, way, model = push(shape, k, seed)
                run = Plant(thing, TIPS[k], 0.0025, model=model).follow([0, 0, 0], way)
                words = np.array(MODES)[run.modes]
                seen |= set(words.ravel())
                free = words == "separation"
                seen |= {"touch"} if np.any(free[:-1] & ~free[1:]) else set()
                seen |= {"loss"} if np.any(~free[:-1] & free[1:]) else set()
                if shape != "circle":
                    edges = [[thing.outline.nearest(p).edge for p in run.points[:, i]] for i in range(k)]
                    corners += sum(len(set(np.array(e)[~free[:, i]])) > 1 for i, e in enumerate(edges))
    assert {"touch", "loss", "sticking", "sliding_left", "sliding_right", "separation"} <= seen
    assert corners >= 2


@pytest.mark.parametrize("body", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_only_where_fingers_touch_in_three_places_does_a_run_go_the_plain_way(monkeypatch, body):
    """Two fingers come down on the hook's inner side, one of them in its corner, push, and leave the corner again."""
    thing = fp.Object(
        SHAPES["concave"], fp.Support.points([(0.01, 0.01), (0.05, 0.01), (0.05, 0.03)]), friction=0.3
    )
    down = [[0.028, 0.03 - 0.001 * k, -np.pi / 2] for k in range(8)]
    into = [[0.028 + 0.0004 * k, 0.0223 - 0.0003 * k, -np.pi / 2] for k in range(8)]
    back = [[0.0305 - 0.0006 * k, 0.0202 - 0.0004 * k, -np.pi / 2 - 0.01 * k] for k in range(8)]
    way, starts = np.array(down + into + back), [[0, 0, 0], [0.001, 0, 0], [0, 0.2, 0]]
    plain = []
    real = Runner._plainly
    monkeypatch.setattr(
        Runner, "_plainly", lambda *args: (plain.append(len(args[1].hands[0])), real(*args))[1]
    )
    fast, slow = (Plant(thing, TIPS[2], 0.0025, model="ellipsoid", plain=p) for p in (False, True))
    got = fast.many(starts, way, record=True, body=body)
    assert 0 < sum(n - 1 for n in plain) < 0.5 * len(way) * len(starts)
    last = fast.many(starts, way, body=body)
    want = slow.many(starts, way, record=True, body=body)
    assert np.array_equal(got.outcome, want.outcome)
    assert got.object == pytest.approx(want.object, abs=AGREE)
    assert np.array_equal(got.modes, want.modes)
    assert np.array_equal(got.stuck, want.stuck)
    assert np.array_equal(last.final, got.final)
    assert np.array_equal(last.stuck, got.stuck)
    # By itself, step by step, too.
    state = fast.start(starts[1], way[0])
    for k in range(1, len(way)):
        state = fast.step(state, way[k] - way[k - 1], 1.0)
    if not body:
        assert state.object == pytest.approx(want.final[1], abs=AGREE)


@pytest.fixture(scope="module")
def square() -> fp.Object:
    return fp.Object([(-1, -1), (1, -1), (1, 1), (-1, 1)], friction=0.5)


def test_three_fingers_in_a_row_push_as_the_outer_two(square):
    start, way = [0.0, 0.0, 0.2], [[-1.4, 0.1, 0.2], [-0.9, 0.2, 0.25], [-0.4, 0.3, 0.3]]
    three = Plant(square, [[0.0, 0.5], [0.0, 0.0], [0.0, -0.5]], 0.1, model="ellipsoid").follow(start, way)
    two = Plant(square, [[0.0, 0.5], [0.0, -0.5]], 0.1, model="ellipsoid").follow(start, way)
    assert three.outcome == two.outcome == ""
    assert three.object == pytest.approx(two.object, abs=1e-7)


def test_three_fingers_that_close_grasp_and_hold(square):
    """Fingers of their own come from the left, from the right and from below: nothing can move any more."""
    plant = Plant(square, np.zeros((3, 2)), 0.1, model="ellipsoid")
    state = plant.start([0, 0, 0], [[-1.2, 0, 0], [1.3, 0, 0], [0, -1.15, 0]])
    state = plant.step(state, [[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0]], 1.0)
    assert state.outcome == "grasped"
    assert state.object == pytest.approx([0.05, 0.0, 0.0], abs=0.11)
    assert np.all(state.gaps[:2] > -1e-6)
    assert plant.step(state, np.ones((3, 3)), 1.0) is state


def test_a_plain_plant_has_the_whole_interface(square):
    fast, slow = (Plant(square, [[0.0, 0.0]], 0.1, model="ellipsoid", plain=p) for p in (False, True))
    way = np.array([[-1.0, 0.1, 0.0], [-0.8, 0.1, 0.0], [-0.6, 0.12, 0.0]])
    starts, mus = [[0, 0, 0], [0.05, 0, 0.1]], [0.2, 0.6]
    want, got = (p.many(starts, way, friction=mus, record=True, body=True) for p in (fast, slow))
    assert got.object == pytest.approx(want.object, abs=1e-7)
    assert np.array_equal(got.modes, want.modes)
    assert np.array_equal(got.stuck, want.stuck)
    assert np.array_equal(got.outcome, want.outcome)
    assert slow.start([0, 0, 0], [-1.0, 0, 0], push_out=False).outcome == "starts inside"
    assert slow.start([0, 0, 0], [-1.0, 0, 0]).object == pytest.approx([0.1, 0, 0], abs=1e-7)


def test_collinear_feet_go_the_plain_way():
    """The kernels do not know them; a push through the middle, along their line, keeps the object straight."""
    with pytest.warns(UserWarning, match="one line"):
        support = fp.Support.points([(-0.5, 0.0), (0.0, 0.0), (0.5, 0.0)])
    thing = fp.Object([(-1, -1), (1, -1), (1, 1), (-1, 1)], support, 0.5)
    plant, way = Plant(thing, [[0.0, 0.0]], 0.1), [[-1.1, 0.0, 0.0], [-0.9, 0.0, 0.0], [-0.7, 0.0, 0.0]]
    run = plant.follow([0, 0, 0], way)
    assert run.outcome == ""
    assert run.object[-1] == pytest.approx([0.4, 0.0, 0.0], abs=1e-6)
    many = plant.many([[0, 0, 0], [0.1, 0, 0]], way, surfaces=[plant.surface] * 2)
    assert many.final == pytest.approx(np.array([[0.4, 0, 0], [0.4, 0, 0]]), abs=1e-6)
    aside = plant.follow([0, 0, 0], np.add(way, [0.0, 0.2, 0.0]))
    assert aside.object[-1, 2] < -0.01  # pushed left of its middle, it turns clockwise
    state = plant.step(plant.start([0, 0, 0], way[0]), [1.0, 0.0, 0.0], 0.1)
    assert state.object == pytest.approx([0.1, 0.0, 0.0], abs=1e-6)
