"""What holds for every support, surface, twist and wrench."""

import warnings

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tests.strategies import directions, reals, stars, supports, twists, vectors

from flatpush.friction import Ellipsoid, Exact, Quartic, Support, fit_surface
from flatpush.geometry import cross, perpendicular, rotate

ROUNDING = 1e-9  # of the load, with the radius as the unit of torque: what Support promises
SOLVED = 1e-8  # of inverses: rounding of a twist beside a foot costs more than that of a wrench
examples = settings(max_examples=40, deadline=None, derandomize=True)


def shifted(wrench: np.ndarray, to: np.ndarray) -> np.ndarray:
    """The wrench about another origin."""
    out = np.array(wrench)
    out[..., 2] -= to[0] * out[..., 1] - to[1] * out[..., 0]
    return out


@examples
@given(st.data(), supports())
def test_dissipation_is_maximal_and_equals_the_support_function(
    data: st.DataObject, support: Support
) -> None:
    V = data.draw(twists(support))
    W = support.wrench(V)
    power = W @ V.T  # [i, j]: wrench of i, twist j
    h = support.dissipation(V)
    speed = np.hypot(*(V[:, :2] + V[:, 2:] * perpendicular(support.centre)).T)
    scale = speed + np.abs(V[:, 2]) * (support.radius + np.hypot(*support.centre))
    assert np.all(np.abs(np.diag(power) - h) <= ROUNDING * scale)
    assert np.all(power <= np.diag(power) + ROUNDING * scale)


@examples
@given(st.data(), supports(), reals(-6, 6))
def test_friction_is_even_scale_free_and_monotone(
    data: st.DataObject, support: Support, power: float
) -> None:
    V = data.draw(twists(support))
    W = support.wrench(V)
    np.testing.assert_allclose(support.wrench(-V), -W, atol=1e-12)
    np.testing.assert_allclose(support.wrench(V * 10.0**power), W, atol=1e-8)
    rise = np.sum((W[:, None] - W) * (V[:, None] - V), axis=2)
    assert rise.min() >= -ROUNDING * np.abs(V).max()
    np.testing.assert_allclose(support.wrench(V, friction=0.3, load=5.0), 1.5 * W, rtol=1e-14, atol=1e-15)


@examples
@given(st.data(), supports(), vectors(5.0))
def test_the_place_of_the_frame_does_not_matter(
    data: st.DataObject, support: Support, offset: np.ndarray
) -> None:
    V = data.draw(twists(support))
    moved = support.translated(offset)
    V_moved = np.array(V)
    V_moved[:, :2] -= V[:, 2:] * perpendicular(offset)
    np.testing.assert_allclose(shifted(moved.wrench(V_moved), offset), support.wrench(V), atol=2e-8)
    np.testing.assert_allclose(moved.centred().centre, 0.0)


@examples
@given(st.data(), stars(), vectors(2.0), reals(-np.pi, np.pi))
def test_the_direction_of_the_frame_does_not_matter(
    data: st.DataObject, corners: np.ndarray, place: np.ndarray, turn: float
) -> None:
    corners = corners + place
    support = Support.polygon(corners)
    V = data.draw(twists(support))
    V_turned = np.concatenate([rotate(turn, V[:, :2]), V[:, 2:]], axis=1)
    W = support.wrench(V)
    expected = np.concatenate([rotate(turn, W[:, :2]), W[:, 2:]], axis=1)
    np.testing.assert_allclose(Support.polygon(rotate(turn, corners)).wrench(V_turned), expected, atol=1e-9)


@examples
@given(supports(), vectors(2.0))
def test_the_derivatives_of_the_dissipation_are_wrench_and_curvature(
    support: Support, aside: np.ndarray
) -> None:
    centre = support.centre + support.radius * aside
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
@given(st.data(), supports(), st.lists(directions(), min_size=1, max_size=4), reals(-2, 1))
def test_the_exact_twist_of_a_wrench_is_its_own(
    data: st.DataObject, support: Support, wrenches: list[np.ndarray], power: float
) -> None:
    surface = Exact(support)
    F = np.array(wrenches) * [1, 1, support.radius * 10.0**power]
    V = surface.twist(F)
    for f, v in zip(F, V, strict=True):
        assert missing(surface, f, v) <= SOLVED
    np.testing.assert_allclose(surface.value(F / surface.value(F)[:, None]), 1.0, rtol=1e-10)
    W = surface.wrench(data.draw(twists(support)))
    assert np.all(np.abs(surface.value(W) - 1) <= 1e-8)


@examples
@given(st.data(), supports())
def test_the_twists_of_many_wrenches_are_those_of_each(data: st.DataObject, support: Support) -> None:
    surface = Exact(support)
    W = support.wrench(data.draw(twists(support)))
    assume(np.all(np.any(W != 0, axis=1)))
    each = support.wrench(np.array([surface.twist(F) for F in W]))
    np.testing.assert_allclose(support.wrench(surface.twist(W)), each, atol=SOLVED)


@examples
@given(supports(), directions(2))
def test_a_force_through_the_centre_of_friction_translates_along_itself(
    support: Support, f: np.ndarray
) -> None:
    V = Exact(support.centred()).twist([f[0], f[1], 0.0])
    np.testing.assert_allclose(V, [*(f / np.hypot(*f)), 0.0], atol=1e-13)


@examples
@given(supports(), vectors(2.0), directions(2), st.booleans())
def test_sticking_keeps_the_velocity_and_passes_its_force_through_the_point(
    support: Support, aside: np.ndarray, u: np.ndarray, about_a_foot: bool
) -> None:
    surface, p = Exact(support), support.centre + support.radius * aside
    points, _ = support.feet
    if about_a_foot and len(points):
        u = perpendicular(p - points[0])
        assume(np.hypot(*u) > 0.05)
    V = surface.stick(p, u)
    np.testing.assert_allclose(V[:2] + V[2] * perpendicular(p), u, atol=1e-8)
    set_ = surface.wrench_set(V)
    torque = abs(set_.centre[2] - float(cross(p, set_.centre[:2])))
    assert torque <= set_.radius * np.hypot(*(set_.point - p)) + SOLVED * support.radius
    np.testing.assert_allclose(surface.stick(p, 3 * u), 3 * V, atol=1e-6)


@examples
@given(twists(Support.disc(1.0)))
def test_a_many_gon_becomes_a_disc(V: np.ndarray) -> None:
    angles = 2 * np.pi * np.arange(720) / 720
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # The sag of the chords is 1e-5 of the radius.
    np.testing.assert_allclose(Support.polygon(corners).wrench(V), Support.disc(1.0).wrench(V), atol=3e-5)
    np.testing.assert_allclose(Support.outline(corners).wrench(V), Support.ring(1.0).wrench(V), atol=3e-4)


@st.composite
def surfaces(draw: st.DrawFn) -> Exact | Ellipsoid | Quartic:
    kind = draw(st.sampled_from(["exact", "matrix", "quartic", "ellipsoid"]))
    if kind == "matrix":
        L = np.array([draw(vectors(2.0, 3)) for _ in range(3)])
        return Ellipsoid(L @ L.T + 0.1 * np.eye(3))
    if kind == "exact":
        return Exact(draw(supports(("polygon",))).centred())
    return fit_surface(draw(supports(("feet", "polygon"))), kind)  # type: ignore[arg-type]


several = st.lists(directions(), min_size=2, max_size=5).map(np.array)


@examples
@given(surfaces(), several, several, reals(-2, 2), vectors(2.0), directions(2))
def test_every_surface_obeys_the_laws_of_the_interface(
    surface: Exact | Ellipsoid | Quartic,
    F: np.ndarray,
    V: np.ndarray,
    power: float,
    p: np.ndarray,
    u: np.ndarray,
) -> None:
    H, scale = surface.value(F), 10.0**power
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
    stuck = surface.stick(p, u)
    np.testing.assert_allclose(stuck[:2] + stuck[2] * perpendicular(p), u, atol=1e-9)
    W = surface.wrench(stuck)
    assert abs(W[2] - float(cross(p, W[:2]))) <= 1e-8 * np.linalg.norm(W)


@examples
@given(
    st.lists(st.tuples(reals(-1, 1), reals(0.1, 1)), min_size=2, max_size=5, unique_by=lambda foot: foot[0]),
    *(directions(2), directions(), reals(-9, -1), directions()),
)
def test_collinear_feet_have_a_twist_for_every_wrench(
    feet: list[tuple[float, float]], along: np.ndarray, wrench: np.ndarray, power: float, off: np.ndarray
) -> None:
    places, weights = np.array(feet).T
    assume(np.ptp(places) > 0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        support = Support.points(places[:, None] * along, weights).centred()
    surface = Exact(support)
    normal = perpendicular(along) / np.hypot(*along)
    for F in (wrench, [*normal, 0.0] + 10.0**power * off):
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
