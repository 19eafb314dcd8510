"""Clearance of moving bodies: what the kernels say is what shapely measures on dense samples, and nothing is jumped."""

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tests.strategies import outlines, poses, reals, vectors

from flatpush.geometry import Outline, compose, exp, transform
from flatpush.geometry.collision import Body, World, path_clearance, pose_clearance
from flatpush.geometry.collision.kernels import twist_gap
from flatpush.geometry.collision.plain import twist_clearance

ROUNDING = 1e-9  # [m], of lengths of about one
STEP = 1e-3  # between dense samples [m]; a hundredth of the way of most cases


@st.composite
def cases(draw: st.DrawFn, least: int = 0, most: int = 6) -> tuple[World, Body, np.ndarray, np.ndarray]:
    """A room of about 0.4 m with a body of about 5 cm: world, body, start and a step."""
    things = draw(st.lists(outlines(0.05, 0.2), min_size=least, max_size=most))
    bounds = draw(st.sampled_from([None, (-0.2, -0.22, 0.21, 0.2)]))
    discs = draw(st.lists(vectors(0.05), max_size=2))
    body = Body.of(draw(outlines(0.04, 0.01)), np.array(discs).reshape(-1, 2), 0.0025)
    turn = draw(st.one_of(st.just(0.0), reals(-0.5, 0.5), reals(-6.2, 6.2)))
    step = np.array([*(draw(vectors(0.1)) * (1 + 2 * abs(turn))), turn])
    return World.of(bounds, things), body, draw(poses(0.15)), step


def measured(world: World, body: Body, pose: np.ndarray) -> float:
    """Clearance of a pose by shapely; negative, of no exact size, where shapes overlap."""
    shapes = []
    if body.outline.is_circle:
        shapes.append((shapely.Point(*transform(pose, body.outline.centre)), body.outline.radius))
    else:
        shapes.append((shapely.Polygon(transform(pose, body.outline.vertices)), 0.0))
    shapes += [(shapely.Point(*tip), body.radius) for tip in transform(pose, body.discs)]
    best = np.inf
    for shape, r in shapes:
        xmin, ymin, xmax, ymax = shape.bounds
        low, high = world.bounds[:2], world.bounds[2:]
        best = min(best, np.min(np.array([xmin, ymin]) - low) - r, np.min(high - np.array([xmax, ymax])) - r)
        for o in world.obstacles:
            other, more = (
                (shapely.Point(*o.centre), o.radius) if o.is_circle else (shapely.Polygon(o.vertices), 0.0)
            )
            overlap = shape.intersection(other).area > 0 or (
                shape.distance(other) == 0 and min(r, more) == 0 < max(r, more)
            )
            best = min(best, -1.0 if overlap else shape.distance(other) - r - more)
    return float(best)


@given(cases())
@settings(max_examples=60, deadline=None)
def test_a_pose_has_the_clearance_that_shapely_measures(case) -> None:
    world, body, start, _ = case
    found, expected = pose_clearance(world, body, start), measured(world, body, start)
    if expected < -ROUNDING or found < -ROUNDING:
        assert found < 0
        assert expected < 0
    else:
        assert found == pytest.approx(expected, abs=ROUNDING)


# Few obstacles are all looked at, many through the grid.
@pytest.mark.parametrize(("least", "most"), [(0, 2), (5, 8)], ids=["few", "many"])
@given(data=st.data())
@settings(max_examples=8, deadline=None)
def test_a_path_has_the_least_clearance_of_dense_samples(least: int, most: int, data: st.DataObject) -> None:
    """The exact least clearance is at most that of any sample and at most half a step's way below the least of them."""
    world, body, start, step = data.draw(cases(least, most))
    B = body.arrays
    far = B.reach + np.hypot(B.x, B.y)
    way = np.hypot(*step[:2]) + abs(step[2]) * far
    n = int(np.ceil(way / STEP)) + 1
    samples = [compose(start, exp(t * step)) for t in np.linspace(0, 1, n + 1)]
    least = min(measured(world, body, X) for X in samples)
    found = path_clearance(world, body, start, [step])
    if least < 0:
        assert found.distance < 0
    elif found.distance > 0:
        assert least - way / n - ROUNDING <= found.distance <= least + ROUNDING
        at = measured(world, body, compose(start, exp(found.fraction * step)))
        assert at == pytest.approx(found.distance, abs=1e-7)
    else:  # it touches between samples: then the samples come near
        assert least <= way / n + ROUNDING


@given(st.one_of(cases(), cases(5, 8)))
@settings(max_examples=12, deadline=None)
def test_the_compiled_clearance_is_the_plain_one(case) -> None:
    world, body, start, step = case
    assume(pose_clearance(world, body, start) >= 0)
    found = twist_gap(world.arrays, body.arrays, start, step, 1e3, -np.inf)
    expected, _, _ = twist_clearance(world, body, start, step)
    # Where shapes overlap on the way both are zero or less; how much less depends on which pairs are looked at.
    assert max(found, 0.0) == pytest.approx(min(max(expected, 0.0), 1e3), abs=ROUNDING)


def test_what_lies_inside_another_overlaps() -> None:
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    big, small = Outline.polygon(10 * square), Outline.polygon(square)
    disc, dot = Outline.circle(10.0), Outline.circle(1.0)
    for outer in (big, disc):
        for inner in (small, dot):
            for obstacle, thing in ((outer, inner), (inner, outer)):
                world = World.of(None, [obstacle])
                assert pose_clearance(world, Body.of(thing), (0.3, -0.2, 0.4)) < 0
    # A finger inside an obstacle that the object is clear of; overlapping obstacles do not cancel each other.
    world = World.of(None, [big, Outline.polygon(10 * square + 3.0)])
    assert pose_clearance(world, Body.of(small, [(-19.0, 0.0)], 0.5), (20.0, 1.0, 0.0)) < 0
    assert pose_clearance(world, Body.of(small), (2.0, 2.0, 0.0)) < 0


def test_a_cross_without_a_corner_inside_the_other_overlaps() -> None:
    bar = np.array([(-2, -0.1), (2, -0.1), (2, 0.1), (-2, 0.1)], dtype=float)
    world, body = World.of(None, [Outline.polygon(bar)]), Body.of(Outline.polygon(bar))
    assert pose_clearance(world, body, (0.0, 0.0, np.pi / 2)) < 0
    assert pose_clearance(world, body, (0.0, 3.0, 0.0)) == pytest.approx(2.8)


def test_what_is_crossed_does_not_only_touch() -> None:
    """A way through a wall once had the clearance 0 of one that touches it, and was free where 0 is asked for."""
    wall = Outline.polygon([(4, -5), (4.001, -5), (4.001, 5), (4, 5)])
    world, body = World.of(None, [wall]), Body.of(Outline.polygon([(0, 0), (1, 0), (1, 1), (0, 1)]))
    for through in ([(6, 0, 0)], [(3.5, 0, 0)], [(3.001, 0, 0)], [(0, -7.0, 1.5)]):
        found = path_clearance(world, body, (0, 0, 0), through)
        assert found.distance < 0
        assert found.obstacle == 0
        assert found.fraction > 0
    for along in ([(3, 0, 0)], [(3, 0, 0), (0, 2, 0), (-1, 0, 0)]):
        assert path_clearance(world, body, (0, 0, 0), along).distance == 0


@pytest.mark.parametrize("thickness", [1e-3, 1e-6])
def test_nothing_is_jumped_however_thin(thickness: float) -> None:
    """A wall thinner than any step: the straight way through it and the turn through it are both found out."""
    wall = [(-thickness, -5), (thickness, -5), (thickness, 5), (-thickness, 5)]
    world, body = World.of(None, [Outline.polygon(wall)]), Body.of(Outline.circle(0.1))
    assert path_clearance(world, body, (-1, 0, 0), [(2, 0, 0)]).distance < 0
    assert path_clearance(world, body, (-1, 0, 0.5), [(0, -3.0, np.pi)]).distance < 0
    free = path_clearance(world, body, (-1, 0, 0), [(0, 2, 0)])
    assert free.distance == pytest.approx(0.9 - thickness)
    assert free.obstacle == 0


def test_what_is_far_away_is_as_far_as_it_is_and_nothing_is_infinitely_far() -> None:
    """Beyond a thousand times the world's own extent clearances were cut off, and of an empty world 1000 m."""
    body, far = Body.of(Outline.circle(1.0)), (1e5, 0.0, 0.0)
    assert pose_clearance(World.of(), body, far) == np.inf
    assert path_clearance(World.of(), body, far, [(1, 0, 0)]).distance == np.inf
    world = World.of(None, [Outline.circle(1.0)])
    assert pose_clearance(world, body, far) == pytest.approx(1e5 - 2)
    assert path_clearance(world, body, far, [(1e5, 0, 0)]).distance == pytest.approx(1e5 - 2)


def test_touching_is_clearance_zero_and_the_place_is_named() -> None:
    world = World.of((0, 0, 10, 10), [Outline.polygon([(4, 0), (6, 0), (6, 3), (4, 3)])])
    body = Body.of(Outline.polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)]))
    over = path_clearance(world, body, (1, 5, 0), [(8, 0, 0), (0, 0, 0)])
    assert over.distance == 0.0
    assert over.obstacle == -1  # the side on which it starts
    nearer = path_clearance(world, body, (2, 7, 0), [(3, -2.5, 0), (3, 2.5, 0)])
    assert nearer.distance == pytest.approx(0.5)
    assert (nearer.piece, nearer.obstacle) == (0, 0)
    assert nearer.fraction == pytest.approx(1.0)
    assert path_clearance(World.of(), body, (0, 0, 0), [(1, 0, 0)]).obstacle == -2
