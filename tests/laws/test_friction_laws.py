"""What holds for every support, surface, twist and wrench."""

import warnings

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flatpush.friction import Ellipsoid, Exact, Quartic, Support, fit_surface
from flatpush.geometry import cross, perpendicular, rotate

ROUNDING = 1e-9  # of the load, with the radius as the unit of torque: what Support promises
SOLVED = 1e-8  # of inverses: rounding of a twist beside a foot costs more than that of a wrench
seeds = st.integers(0, 2**32 - 1)
kinds = st.sampled_from(["feet", "few feet", "polygon", "outline", "disc", "ring"])
examples = settings(max_examples=60, deadline=None, derandomize=True)


def star(rng: np.random.Generator) -> np.ndarray:
    """A random simple polygon, convex or not."""
    n = int(rng.integers(3, 9))
    angles = 2 * np.pi * (np.arange(n) + rng.uniform(0.05, 0.95, n)) / n
    return rng.uniform(0.3, 1.0, n)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def draw(kind: str, seed: int) -> tuple[Support, np.random.Generator]:
    """A support of radius about 1, not centred, and a generator for what else is random."""
    rng = np.random.default_rng(seed)
    place = rng.normal(size=2)
    if kind in ("feet", "few feet"):
        n = int(rng.integers(6, 30)) if kind == "feet" else int(rng.integers(3, 6))
        return Support.points(rng.uniform(-1, 1, (n, 2)) + place, rng.uniform(0.05, 1, n)), rng
    if kind == "polygon":
        return Support.polygon(star(rng) + place), rng
    if kind == "outline":
        return Support.outline(star(rng) + place), rng
    return (Support.disc if kind == "disc" else Support.ring)(rng.uniform(0.2, 1.0), place), rng


def twists(support: Support, rng: np.random.Generator, n: int) -> np.ndarray:
    """Twists about centres near and far, some exactly on feet, and translations."""
    V = rng.normal(size=(n, 3)) * np.stack([np.ones(n), np.ones(n), 10.0 ** rng.uniform(-4, 3, n)], axis=1)
    V[rng.random(n) < 0.1, 2] = 0.0
    points, _ = support.feet
    if len(points):
        about = rng.integers(0, len(points), n)
        on = rng.random(n) < 0.3
        rotations = np.stack([points[about, 1], -points[about, 0], np.ones(n)], axis=1)
        V[on] = (rotations * rng.choice([-1, 1], n)[:, None])[on]
    return V


def shifted(wrench: np.ndarray, to: np.ndarray) -> np.ndarray:
    """The wrench about another origin."""
    out = np.array(wrench)
    out[..., 2] -= to[0] * out[..., 1] - to[1] * out[..., 0]
    return out


@examples
@given(kinds, seeds)
def test_dissipation_is_maximal_and_equals_the_support_function(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    V = twists(support, rng, 12)
    W = support.wrench(V)
    power = W @ V.T  # [i, j]: wrench of i, twist j
    h = support.dissipation(V)
    speed = np.hypot(*(V[:, :2] + V[:, 2:] * perpendicular(support.centre)).T)
    scale = speed + np.abs(V[:, 2]) * (support.radius + np.hypot(*support.centre))
    assert np.all(np.abs(np.diag(power) - h) <= ROUNDING * scale)
    assert np.all(power <= np.diag(power) + ROUNDING * scale)


@examples
@given(kinds, seeds)
def test_friction_is_even_scale_free_and_monotone(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    V = twists(support, rng, 8)
    W = support.wrench(V)
    np.testing.assert_allclose(support.wrench(-V), -W, atol=1e-12)
    np.testing.assert_allclose(support.wrench(V * 10.0 ** rng.uniform(-6, 6)), W, atol=1e-8)
    assert np.sum((W[:-1] - W[1:]) * (V[:-1] - V[1:]), axis=1).min() >= -ROUNDING * np.abs(V).max()
    np.testing.assert_allclose(support.wrench(V, friction=0.3, load=5.0), 1.5 * W, rtol=1e-14, atol=1e-15)


@examples
@given(kinds, seeds)
def test_the_frame_does_not_matter(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    V, offset = twists(support, rng, 8), rng.normal(size=2) * 3
    moved = support.translated(offset)
    V_moved = np.array(V)
    V_moved[:, :2] -= V[:, 2:] * perpendicular(offset)
    np.testing.assert_allclose(shifted(moved.wrench(V_moved), offset), support.wrench(V), atol=2e-8)
    np.testing.assert_allclose(moved.centred().centre, 0.0)
    if kind != "polygon":
        return
    turn = rng.uniform(-np.pi, np.pi)
    corners = support.pressure.vertices + support.centre  # type: ignore[attr-defined]
    V_turned = np.concatenate([rotate(turn, V[:, :2]), V[:, 2:]], axis=1)
    W = support.wrench(V)
    expected = np.concatenate([rotate(turn, W[:, :2]), W[:, 2:]], axis=1)
    np.testing.assert_allclose(Support.polygon(rotate(turn, corners)).wrench(V_turned), expected, atol=1e-9)


@examples
@given(kinds, seeds)
def test_the_derivatives_of_the_dissipation_are_wrench_and_curvature(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    centre = support.centre + rng.normal(size=2) * support.radius
    V = np.array([centre[1], -centre[0], 1.0])
    points, _ = support.feet
    assume(not len(points) or np.min(np.hypot(*(points - centre).T)) >= 0.05)  # for finite differences
    step = 1e-6
    rows = step * np.eye(3)
    slope = (support.dissipation(V + rows) - support.dissipation(V - rows)) / (2 * step)
    np.testing.assert_allclose(slope, support.wrench(V), atol=1e-7)
    bend = (support.wrench(V + rows) - support.wrench(V - rows)) / (2 * step)
    K = support.curvature(V)
    assert np.max(np.abs(bend - K)) <= 1e-3 * (1 + np.max(np.abs(K)))
    np.testing.assert_allclose(K @ V, 0.0, atol=1e-12 * (1 + np.max(np.abs(K))))


def missing(surface: Exact, F: np.ndarray, V: np.ndarray) -> float:
    """How far F, scaled to the surface, is from the wrenches of V; torque over the radius."""
    support = surface.support
    set_ = surface.wrench_set(V)
    gap = F * (support.dissipation(V) / (F @ V)) - set_.centre
    torque = gap[2] - float(cross(support.centre, gap[:2]))
    if set_.radius == 0:
        return float(np.max(np.abs([*gap[:2], torque / support.radius])))
    over = max(0.0, float(np.hypot(*gap[:2])) - set_.radius)
    torque -= float(cross(set_.point - support.centre, gap[:2]))
    return max(over, abs(torque) / support.radius)


@examples
@given(kinds, seeds)
def test_the_exact_twist_of_a_wrench_is_its_own(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    surface = Exact(support)
    F = rng.normal(size=(4, 3)) * [1, 1, support.radius * 10.0 ** rng.uniform(-2, 1)]
    V = surface.twist(F)
    for f, v in zip(F, V, strict=True):
        assert missing(surface, f, v) <= SOLVED
    np.testing.assert_allclose(surface.value(F / surface.value(F)[:, None]), 1.0, rtol=1e-10)
    W = surface.wrench(twists(support, rng, 4))
    assert np.all(np.abs(surface.value(W) - 1) <= 1e-8)


@examples
@given(kinds, seeds)
def test_a_force_through_the_centre_of_friction_translates_along_itself(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    support = support.centred()
    f = rng.normal(size=2)
    V = Exact(support).twist([f[0], f[1], 0.0])
    np.testing.assert_allclose(V, [*(f / np.hypot(*f)), 0.0], atol=1e-13)


@examples
@given(kinds, seeds)
def test_sticking_keeps_the_velocity_and_passes_its_force_through_the_point(kind: str, seed: int) -> None:
    support, rng = draw(kind, seed)
    surface, u = Exact(support), rng.normal(size=2)
    p = support.centre + rng.normal(size=2) * support.radius
    points, _ = support.feet
    if len(points) and rng.random() < 0.5:
        u = perpendicular(p - points[0])  # asks for a rotation about a foot
    V = surface.stick(p, u)
    np.testing.assert_allclose(V[:2] + V[2] * perpendicular(p), u, atol=1e-8)
    set_ = surface.wrench_set(V)
    torque = abs(set_.centre[2] - float(cross(p, set_.centre[:2])))
    assert torque <= set_.radius * np.hypot(*(set_.point - p)) + SOLVED * support.radius
    np.testing.assert_allclose(surface.stick(p, 3 * u), 3 * V, atol=1e-6)


@examples
@given(seeds)
def test_a_many_gon_becomes_a_disc(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * np.arange(720) / 720
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    V = twists(Support.disc(1.0), rng, 6)
    # The sag of the chords is 1e-5 of the radius.
    np.testing.assert_allclose(Support.polygon(corners).wrench(V), Support.disc(1.0).wrench(V), atol=3e-5)
    np.testing.assert_allclose(Support.outline(corners).wrench(V), Support.ring(1.0).wrench(V), atol=3e-4)


def surfaces(seed: int) -> list[Exact | Ellipsoid | Quartic]:
    support, rng = draw("polygon", seed)
    L = rng.normal(size=(3, 3))
    return [
        Exact(support.centred()),
        Ellipsoid(L @ L.T + 0.1 * np.eye(3)),
        fit_surface(support, "quartic"),
        fit_surface(draw("few feet", seed)[0], "ellipsoid"),
    ]


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seeds)
def test_every_surface_obeys_the_laws_of_the_interface(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for surface in surfaces(seed):
        F, V = rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
        H, scale = surface.value(F), 10.0 ** rng.uniform(-2, 2)
        np.testing.assert_allclose(surface.value(-F), H, rtol=1e-9)
        np.testing.assert_allclose(surface.value(-scale * F), scale**surface.degree * H, rtol=1e-9)
        W = surface.wrench(V)
        np.testing.assert_allclose(surface.value(W), 1.0, rtol=1e-9)
        back = surface.twist(W)
        cosine = np.sum(back * V, axis=1) / np.linalg.norm(back, axis=1) / np.linalg.norm(V, axis=1)
        np.testing.assert_allclose(cosine, 1.0, atol=1e-9)
        on = F / H[:, None] ** (1 / surface.degree)
        assert np.all(on @ V.T <= np.sum(W * V, axis=1) + 1e-9)
        middle = surface.value((on[:-1] + on[1:]) / 2)
        assert np.all(middle <= 1 + 1e-9)
        # The twist is the gradient's direction.
        step = 1e-5
        slope = (surface.value(F[0] + step * np.eye(3)) - surface.value(F[0] - step * np.eye(3))) / (2 * step)
        twist = surface.twist(F[0])
        np.testing.assert_allclose(slope / np.linalg.norm(slope), twist / np.linalg.norm(twist), atol=1e-6)
        p, u = rng.normal(size=2), rng.normal(size=2)
        stuck = surface.stick(p, u)
        np.testing.assert_allclose(stuck[:2] + stuck[2] * perpendicular(p), u, atol=1e-9)
        W = surface.wrench(stuck)
        assert abs(W[2] - float(cross(p, W[:2]))) <= 1e-8 * np.linalg.norm(W)


@examples
@given(seeds)
def test_collinear_feet_have_a_twist_for_every_wrench(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, along = int(rng.integers(2, 6)), rng.normal(size=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        support = Support.points(rng.uniform(-1, 1, n)[:, None] * along, rng.uniform(0.1, 1, n)).centred()
    surface = Exact(support)
    normal = perpendicular(along) / np.hypot(*along)
    near = [*normal, 0.0] + 10.0 ** rng.uniform(-9, -1) * rng.normal(size=3)
    for F in (rng.normal(size=3), near):
        assert missing(surface, np.asarray(F), surface.twist(F)) <= 1e-7
    np.testing.assert_allclose(surface.twist([*(2 * normal), 0.0]), [*normal, 0.0], atol=1e-12)


@pytest.mark.parametrize("kind", ["disc", "ring"])
def test_round_supports_have_round_surfaces(kind: str) -> None:
    rng = np.random.default_rng(3)
    support = getattr(Support, kind)(0.7)
    V, turn = rng.normal(size=(20, 3)), 1.1
    turned = np.concatenate([rotate(turn, V[:, :2]), V[:, 2:]], axis=1)
    W = support.wrench(V)
    expected = np.concatenate([rotate(turn, W[:, :2]), W[:, 2:]], axis=1)
    np.testing.assert_allclose(support.wrench(turned), expected, atol=1e-14)
