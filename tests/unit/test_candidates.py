"""Automatic pushes: the same for the same object however it is written, and quick for many corners."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import placement
from flatpush.geometry import Outline
from flatpush.geometry.pose import Array
from flatpush.planning.candidates import automatic_pushes, stretches
from flatpush.problem import Object, Pusher, Scene

# Of the size: what may differ between ways to write one outline.
SAME = 1e-6


def bean(n: int) -> Array:
    """A smooth closed curve with a hollow side, about 75 mm across, n corners counter-clockwise."""
    t = 2 * np.pi * np.arange(n) / n
    r = 0.03 * (1 + 0.25 * np.cos(2 * t + 0.4) + 0.12 * np.sin(3 * t))
    return np.column_stack([r * np.cos(t), r * np.sin(t)])


def eight_ways(corners: Array) -> Iterator[tuple[Array, Array]]:
    """Ways to write an outline, each with how far it is moved."""
    zero, near, far = np.zeros(2), np.array([0.05, -0.02]), np.array([1e3, 1e4])
    yield corners, zero
    yield corners[::-1], zero
    yield np.roll(corners, 37, axis=0), zero
    yield np.roll(corners[::-1], 11, axis=0), zero
    yield np.concatenate([corners, corners[:1]]), zero
    yield corners + near, near
    yield corners[::-1] + near, near
    yield np.roll(corners, 5, axis=0) + far, far


def pushes(corners: Array, fingers: int = 1) -> list[tuple[str, Array, Array]]:
    pusher = Pusher(fingers, 0.015 if fingers == 2 else 0.0)
    found, _ = automatic_pushes(Scene(Object(corners), (0, 0, 0), (0.1, 0, 0), pusher))
    return [(push.name, push.at.point, push.at.normal) for push in found]


@pytest.mark.slow
@pytest.mark.parametrize("fingers", [1, 2])
@pytest.mark.parametrize("shape", ["bean", "round"])
def test_an_outline_in_eight_ways_has_the_same_pushes(shape: str, fingers: int) -> None:
    """Where the corners began, and which way they ran, decided where stretches ended; rounding broke ties."""
    t = 2 * np.pi * np.arange(300) / 300
    corners = bean(300) if shape == "bean" else 0.03 * np.column_stack([np.cos(t), np.sin(t)])
    found = [(pushes(written, fingers), moved) for written, moved in eight_ways(corners)]
    first, _ = found[0]
    assert len(first) >= 4
    for other, moved in found[1:]:
        assert [name for name, *_ in other] == [name for name, *_ in first]
        for (_, point, normal), (_, here, there) in zip(first, other, strict=True):
            np.testing.assert_allclose(here - moved, point, atol=SAME * 0.075)
            np.testing.assert_allclose(there, normal, atol=SAME)


def test_a_polygon_in_eight_ways_has_the_same_stretches() -> None:
    corners = np.array([(0, 0), (60, 0), (60, 40), (30, 50), (20, 49), (10, 46), (0, 40)]) * 1e-3
    middles = []
    for written, moved in eight_ways(corners):
        outline = Outline.polygon(written)
        middles.append([(len(s.edges), *(s.at(outline, 0.3).point - moved)) for s in stretches(outline)])
    for other in middles[1:]:
        np.testing.assert_allclose(other, middles[0], atol=SAME * 0.075)


@pytest.mark.parametrize("n", [1000, 10_000])
def test_a_simplified_outline_keeps_its_tolerance_and_lies_on_the_true_one(n: int) -> None:
    outline = Outline.polygon(bean(n))
    tolerance = 5e-4 * outline.size
    simple = outline.simplified(tolerance)
    assert len(simple.vertices) < 120
    assert max(abs(outline.nearest(p).distance) for p in simple.vertices) < 1e-12
    assert max(abs(simple.nearest(p).distance) for p in outline.vertices[:: n // 200]) <= tolerance * (
        1 + 1e-9
    )


def test_many_corners_have_the_pushes_of_the_smooth_shape() -> None:
    """Contacts lie on the outline itself, and each steers there: 1000 corners once took 16 s."""
    corners = bean(1000)
    found = pushes(corners)
    outline = Outline.polygon(corners)
    assert len(found) == 5
    assert {name for name, *_ in found} >= {"north side", "west side"}  # the hollow, and where it ends
    for _, point, normal in found:
        near = outline.nearest(point)
        assert abs(near.distance) < 1e-12
        np.testing.assert_allclose(near.normal, normal)


def test_the_size_is_the_largest_distance_of_two_corners() -> None:
    rng = np.random.default_rng(3)
    for n in (3, 4, 5, 7, 40):
        for _ in range(20):
            angles = np.sort(rng.uniform(0, 2 * np.pi, n)) + np.arange(n) * 1e-3
            radii = rng.uniform(0.3, 1.0, n)[:, None]
            corners = radii * np.column_stack([np.cos(angles), np.sin(angles)])
            try:
                outline = Outline.polygon(corners)
            except fp.InputError:
                continue
            each = np.linalg.norm(corners[:, None] - corners[None], axis=2)
            assert outline.size == pytest.approx(each.max(), rel=1e-14)


def test_edges_that_cannot_be_met_are_passed_over_without_a_difference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng = np.random.default_rng(0)
    outline = Outline.polygon(bean(400) + rng.normal(0, 1e-5, (400, 2)))
    met = 0
    for spread in (0.0, 1e-6, 0.01, 0.3, 0.8) * 8:
        angles = rng.uniform(0, 2 * np.pi) + np.linspace(-spread, spread, rng.integers(1, 20))
        x = np.column_stack([np.cos(angles), np.sin(angles)])
        starts = rng.normal(0, 0.02, 2) - 0.15 * x + rng.normal(0, 0.001, x.shape)
        ways, touched = placement.travels(outline, starts, x, 0.0025)
        with monkeypatch.context() as patch:
            patch.setattr(placement, "MANY", 10**9)
            all_ways, all_touched = placement.travels(outline, starts, x, 0.0025)
        finite = np.isfinite(all_ways)
        met += int(finite.sum())
        np.testing.assert_array_equal(ways, all_ways)
        np.testing.assert_array_equal(touched[finite], all_touched[finite])
    assert met > 100


def test_an_origin_ten_kilometres_away_changes_nothing() -> None:
    """The plan took 85 s and then failed its own verification."""
    triangle = np.array([(19.667, -9.5), (19.667, 19.0), (-39.333, -9.5)]) * 1e-3
    far = np.array([3e3, -1e4])
    start, goal = np.array([0.03, 0.05, 0.8]), np.zeros(3)
    plans = []
    for moved in (np.zeros(2), far):
        ends = []
        for pose in (start, goal):
            c, s = np.cos(pose[2]), np.sin(pose[2])
            ends.append(pose - [c * moved[0] - s * moved[1], s * moved[0] + c * moved[1], 0.0])
        outline = Outline.polygon(triangle + moved)
        push = fp.Push("long edge", outline.at(2, 0.6), 2, 0.018)
        plans.append(fp.plan(Scene(Object(outline), ends[0], ends[1], Pusher(2, 0.018), (push,))))
    near, distant = plans
    assert near.status == distant.status == "solved"
    assert distant.cost == pytest.approx(near.cost, rel=SAME)
    assert distant.certificate.friction_margin == pytest.approx(near.certificate.friction_margin, rel=SAME)
    assert fp.verify(distant).ok
    assert np.hypot(*distant.scene.object.outline.centroid) < 1e-9


def test_a_push_is_called_after_the_side_where_it_pushes() -> None:
    """Top, rounded corner and right side are one stretch, whose middle looks north-east; it is pushed on the top."""
    turn = np.linspace(np.pi / 2, 0, 21)
    arc = np.column_stack([0.055 + 0.005 * np.cos(turn), 0.015 + 0.005 * np.sin(turn)])
    corners = np.concatenate([[(-0.02, 0.02)], arc, [(0.06, -0.02), (-0.02, -0.02)]])
    for name, _, normal in pushes(corners, fingers=2):
        winds = {"east": (1, 0), "north": (0, 1), "west": (-1, 0), "south": (0, -1)}
        looks = sum(np.array(winds[wind]) for wind in name.split()[0].split("-"))
        assert -normal @ looks / np.linalg.norm(looks) > np.cos(np.deg2rad(22.6)), name


def test_places_are_compared_by_the_turns_that_are_proved() -> None:
    """Where the nominal table turns tightest a set of tables may not: the first place that was proved was taken."""
    feet = fp.Support.points(
        [(0.02, 0.012), (-0.018, 0.014), (-0.02, -0.012), (0.004, -0.014)], [1.0, 0.7, 1.2, 0.9]
    )
    outline = [(0.03, -0.02), (0.03, 0.02), (-0.03, 0.02), (-0.03, -0.02)]
    thing = fp.Object(outline, feet, friction=0.4, uncertainty=fp.Uncertainty(0.2))
    radii = {}
    for proof in ("set", "nominal"):
        scene = fp.Scene(
            thing,
            (0.1, 0.0, 0.0),
            pusher=fp.Pusher(fingers=2, spacing=0.014),
            planning=fp.Planning(proof=proof),
        )
        pushes, _ = automatic_pushes(scene)
        proved = fp.Planner(dataclasses.replace(scene, pushes=pushes, planning=fp.Planning(proof="set")))
        radii[proof] = {option.push.name: option.car.radius for option in proved.usable}
    assert set(radii["nominal"]) <= set(radii["set"])
    ratios = [radii["set"][name] / radius for name, radius in radii["nominal"].items()]
    assert max(ratios) <= 1 + 1e-9
    assert min(ratios) < 0.9
