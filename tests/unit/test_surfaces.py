"""Limit surfaces: facets, vertices, kinks, and the checks of ellipsoids and quartics."""

import re

import numpy as np
import pytest
from tests.waiting import python

from flatpush.errors import InputError
from flatpush.friction import CollinearSupportWarning, Ellipsoid, Exact, Quartic, Support, fit_surface
from flatpush.friction.sos import MONOMIALS, gram_defect, tensor

FEET = Support.points([(1.0, 0.0), (-1.0, 1.0), (-1.0, -1.0), (0.5, 0.5)], [1, 2, 3, 4]).centred()


def rotation(point: np.ndarray) -> np.ndarray:
    return np.array([point[1], -point[0], 1.0])


def at(point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The wrench of a force at a point."""
    return np.array([force[0], force[1], point[0] * force[1] - point[1] * force[0]])


def test_a_facet_is_the_disc_of_its_foots_force() -> None:
    surface = Exact(FEET)
    points, weights = FEET.feet
    for point, weight in zip(points, weights, strict=True):
        set_ = surface.wrench_set(rotation(point))
        assert set_.radius == pytest.approx(weight)
        np.testing.assert_allclose(set_.point, point)
        for angle in (0.0, 2.0, 4.0):
            for size in (0.0, 0.5, 0.999):
                g = size * weight * np.array([np.cos(angle), np.sin(angle)])
                F = set_.centre + at(point, g)
                V = surface.twist(F)
                np.testing.assert_allclose(V / V[2], rotation(point), atol=1e-14)
                assert V[2] > 0
                np.testing.assert_allclose(surface.twist(-F), -V)
                assert surface.value(F) == pytest.approx(1, abs=1e-14)
            # Beyond the rim it is another twist, and a larger wrench.
            F = set_.centre + at(point, 1.5 * weight * g / np.hypot(*g))
            assert surface.value(F) > 1 + 1e-3
            assert np.max(np.abs(surface.twist(F) / surface.twist(F)[2] - rotation(point))) > 1e-3


def test_a_twist_beside_a_foot_has_one_wrench() -> None:
    surface = Exact(FEET)
    point = FEET.feet[0][0]
    assert surface.wrench_set(rotation(point + np.array([1e-10, 0]))).radius > 0
    assert surface.wrench_set(rotation(point + np.array([1e-7, 0]))).radius == 0
    assert surface.wrench_set([1.0, 0.0, 0.0]).radius == 0
    assert Exact(Support.disc(1.0)).wrench_set([0.0, 0.0, 1.0]).radius == 0


@pytest.mark.parametrize("overshoot", [1e-8, 1e-5, 1e-2])
def test_newton_arrives_beside_a_foot(overshoot: float) -> None:
    """A wrench just outside a facet's rim: the curvature there is 1/overshoot, and plain Newton zigzags."""
    surface = Exact(FEET)
    for point, weight in zip(*FEET.feet, strict=True):
        for angle in np.linspace(0, 5, 4):
            g = weight * (1 + overshoot) * np.array([np.cos(angle), np.sin(angle)])
            F = surface.wrench(rotation(point)) + at(point, g)
            V = surface.twist(F)
            np.testing.assert_allclose(surface.wrench(V) * surface.value(F), F, atol=1e-7)


def test_many_feet_crowd_the_rotation_centre() -> None:
    side = np.linspace(-1, 1, 41)[:-1]
    ring = np.concatenate(
        [
            np.stack(np.broadcast_arrays(a, b), axis=1)
            for a, b in ((side, -1.0), (1.0, side), (-side, 1.0), (-1.0, -side))
        ]
    )
    surface = Exact(Support.points(ring))
    F = np.random.default_rng(0).normal(size=(40, 3)) * [1, 1, 2]
    V = surface.twist(F)
    for f, v in zip(F, V, strict=True):
        set_ = surface.wrench_set(v)
        gap = f / surface.value(f) - set_.centre
        assert np.hypot(*gap[:2]) <= set_.radius + 1e-9


def test_collinear_feet_make_vertices() -> None:
    with pytest.warns(CollinearSupportWarning):
        bar = Support.points([(-1, 0), (0, 0), (3, 0)], [3, 1, 2]).centred()
    surface = Exact(bar)
    x = bar.feet[0][np.argsort(bar.feet[0][:, 0]), 0]
    np.testing.assert_allclose(surface.twist([0, 2, 0]), [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(surface.twist([0, -2, 0]), [0, -1, 0], atol=1e-15)
    for left, right in ((x[0], x[1]), (x[1], x[2])):
        inside = surface.wrench(rotation(np.array([left + 0.1, 0])))
        np.testing.assert_allclose(inside, surface.wrench(rotation(np.array([right - 0.1, 0]))), atol=1e-12)
        V = surface.twist(inside)
        np.testing.assert_allclose([-V[1] / V[2], V[0] / V[2]], [(left + right) / 2, 0], atol=1e-12)
        assert V[2] > 0
        assert surface.twist(-inside)[2] < 0


@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
@pytest.mark.parametrize("angle", [0.3, 2.4, 4.4])
def test_sticking_settles_on_a_foot_for_every_force_of_its_facet(share: float, angle: float) -> None:
    surface = Exact(FEET)
    for point, weight in zip(*FEET.feet, strict=True):
        V = rotation(point)
        g = share * weight * np.array([np.cos(angle), np.sin(angle)])
        F = surface.wrench(V) + at(point, g)
        # A contact on the force's line of action, moved as the rotation about the foot moves it.
        p = F[2] / (F[0] ** 2 + F[1] ** 2) * np.array([F[1], -F[0]]) + 0.3 * F[:2]
        u = V[:2] + V[2] * np.array([-p[1], p[0]])
        np.testing.assert_allclose(surface.stick(p, u), V, atol=1e-13)
        # Turned slightly, the rotation centre leaves the foot; the velocity is kept all the same.
        aside = u + 1e-3 * np.array([-u[1], u[0]])
        turned = surface.stick(p, aside)
        assert surface.wrench_set(turned).radius == 0
        np.testing.assert_allclose(turned[:2] + turned[2] * np.array([-p[1], p[0]]), aside, atol=1e-12)


@pytest.mark.parametrize("distance", [1e-8, 1e-6, 1e-4])
def test_sticking_arrives_beside_a_foot(distance: float) -> None:
    """The torque about the contact then is a step of that width, and a small Newton step proves nothing."""
    surface = Exact(FEET)
    for point in FEET.feet[0]:
        for angle in np.linspace(0, 6, 25):
            V = rotation(point + distance * np.array([np.cos(angle), np.sin(angle)]))
            F = surface.wrench(V)
            p = F[2] / (F[0] ** 2 + F[1] ** 2) * np.array([F[1], -F[0]]) + 0.3 * F[:2]
            stuck = surface.stick(p, V[:2] + V[2] * np.array([-p[1], p[0]]))
            set_ = surface.wrench_set(stuck)
            W, free = set_.centre, set_.radius * np.hypot(*(set_.point - p))
            # Rounding: the twist is good to 1e-16 |p|, which turns the foot's force by 1e-16 |p| / distance.
            missed = abs(W[2] - (p[0] * W[1] - p[1] * W[0])) - free
            assert missed <= (1e-15 / distance + 1e-12) * (1 + p @ p)


def test_sticking_at_the_edges() -> None:
    ellipsoid = Ellipsoid(np.diag([1.0, 1.0, 3.0]))
    for surface in (Exact(FEET), Exact(Support.disc(1.0)), ellipsoid, fit_surface(FEET, "quartic")):
        np.testing.assert_allclose(surface.stick([0.3, -1.0], [0.0, 0.0]), 0)
        assert surface.stick([0.0, 0.0], [1.0, 2.0])[:2] == pytest.approx([1, 2])
    # Straight at the centre of friction: no turn at all.
    assert Exact(FEET).stick([0.0, -0.7], [0.0, 2.0]) == pytest.approx([0, 2, 0], abs=1e-14)
    # On a foot itself: that foot must slide.
    p = FEET.feet[0][0]
    V = Exact(FEET).stick(p, [0.0, 1.0])
    assert V[:2] + V[2] * np.array([-p[1], p[0]]) == pytest.approx([0, 1])


def test_exact_surfaces_refuse_what_has_no_answer() -> None:
    surface = Exact(FEET)
    for call in (
        lambda: surface.twist([0, 0, 0]),
        lambda: surface.wrench([0, 0, 0]),
        lambda: surface.twist([0, np.nan, 1]),
        lambda: surface.stick([0, 0], [np.inf, 0]),
        lambda: surface.stick([0, 0, 1], [1, 0]),
    ):
        with pytest.raises(InputError):
            call()
    assert surface.value([0, 0, 0]) == 0
    assert surface.value([[0, 0, 0], [1, 0, 0]]).tolist() == pytest.approx([0, 1])


def test_an_ellipsoid_is_linear() -> None:
    A = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 5.0]])
    surface = Ellipsoid(A)
    np.testing.assert_allclose(surface.twist([1, 2, 3]), A @ [1, 2, 3])
    assert surface.value([1, 2, 3]) == pytest.approx(np.array([1, 2, 3]) @ A @ [1, 2, 3])
    p, f = np.array([0.3, -0.8]), np.array([0.5, 1.0])
    J = np.array([[1, 0, -p[1]], [0, 1, p[0]]])
    np.testing.assert_allclose(surface.stick(p, J @ A @ J.T @ f), A @ J.T @ f)  # Eq. 13
    with pytest.raises(ValueError, match="read-only"):
        surface.matrix[0, 0] = 3


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.diag([1.0, 1.0, -1.0]), "positive definite"),
        (np.diag([1.0, 1.0, 0.0]), "positive definite"),
        (np.ones((3, 3)), "positive definite"),
        (np.eye(3) + np.eye(3, k=1) * 0.1, "symmetric"),
        (np.eye(2), "3 × 3"),
        (np.diag([1.0, 1.0, np.nan]), "finite"),
        ("A", "numbers"),
    ],
)
def test_no_ellipsoid(matrix: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Ellipsoid(matrix)  # type: ignore[arg-type]


def test_a_millimetre_object_is_no_degenerate_ellipsoid() -> None:
    # b = a/ρ is 1e6 times a there; the conditioning is a matter of units.
    assert Ellipsoid(np.diag([1.0, 1.0, 1e9])).wrench([0, 0, 1])[2] == pytest.approx(1e9**-0.5)


def squared(A: np.ndarray) -> np.ndarray:
    """Coefficients of (FᵀAF)²."""
    T = np.einsum("ij,kl->ijkl", A, A)
    out = []
    for monomial in MONOMIALS:
        exponents = sorted(monomial)
        places = np.ndindex(3, 3, 3, 3)
        out.append(sum(T[i] for i in places if sorted("xyz"[k] for k in i) == exponents))
    return np.array(out)


def test_a_squared_ellipsoid_is_a_quartic() -> None:
    A = np.array([[1.0, 0.1, 3.0], [0.1, 1.3, -4.0], [3.0, -4.0, 2500.0]])
    ellipsoid, quartic = Ellipsoid(A), Quartic(squared(A))
    rng = np.random.default_rng(0)
    F = rng.normal(size=(20, 3)) * [1, 1, 0.02]
    np.testing.assert_allclose(quartic.value(F), ellipsoid.value(F) ** 2, rtol=1e-12)
    np.testing.assert_allclose(
        quartic.twist(F), 4 * ellipsoid.value(F)[:, None] * ellipsoid.twist(F), rtol=1e-10
    )
    V = rng.normal(size=(20, 3)) * [1, 1, 50]
    np.testing.assert_allclose(quartic.wrench(V), ellipsoid.wrench(V), rtol=1e-9, atol=1e-12)
    for p, u in rng.normal(size=(10, 2, 2)) * [[[0.02], [1.0]]]:
        np.testing.assert_allclose(quartic.stick(p, u), ellipsoid.stick(p, u), rtol=1e-8, atol=1e-9)


def test_a_quartic_comes_with_the_proof_that_it_is_convex() -> None:
    for quartic in (
        fit_surface(FEET, "quartic"),
        Quartic(squared(np.diag([1.0, 2.0, 3.0]))),
        Quartic([1] * 3 + [0] * 12),
    ):
        Q = quartic.gram
        assert np.linalg.eigvalsh(Q)[0] >= -1e-9
        assert gram_defect(Q, tensor(quartic.coefficients)) <= 1e-9 * np.max(np.abs(Q))
        y, F = np.random.default_rng(1).normal(size=(2, 3))
        m = np.outer(y, F).ravel()
        assert m @ Q @ m == pytest.approx(y @ quartic.hessian(F) @ y)


def test_a_quartic_that_is_nearly_flat_can_be_inverted() -> None:
    """x⁴ + y⁴ + z⁴ has a singular Hessian on every axis."""
    quartic = Quartic([1] * 3 + [0] * 12)
    np.testing.assert_allclose(quartic.wrench([0, 2, 0]), [0, 1, 0], atol=1e-9)
    F = quartic.wrench([1.0, 8.0, 1e-3])
    np.testing.assert_allclose(F / F[0], [1, 2, 0.1], rtol=1e-6)


@pytest.mark.parametrize(
    ("coefficients", "message"),
    [
        ([1, 1, 1] + [0] * 6 + [-1.9, 0, 0, 0, 0, 0], "SOS-convex"),
        ([1, 1, 1] + [0] * 6 + [7, 0, 0, 0, 0, 0], "SOS-convex"),
        ([1, 1, 0] + [0] * 12, "positive"),
        (squared(np.ones((3, 3))), "bounds every wrench"),
        ([1] * 14, "15"),
        ([1] * 14 + [np.inf], "15 finite"),
        (["a"] * 15, "15 finite"),
    ],
)
def test_no_quartic(coefficients: list[float], message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        Quartic(coefficients)  # type: ignore[arg-type]


def test_no_gram_matrix() -> None:
    sphere = Quartic(squared(np.eye(3)))
    with pytest.raises(InputError, match="belongs to"):
        Quartic(sphere.coefficients, gram=2 * sphere.gram)
    with pytest.raises(InputError, match="SOS-convex"):
        Quartic(sphere.coefficients, gram=indefinite(sphere.gram))


def indefinite(gram: np.ndarray) -> np.ndarray:
    """The same quartic's Gram matrix, moved along a minor until it is not positive."""
    out = np.array(gram)
    for a, b, sign in ((0, 4, 1.0), (1, 3, -1.0)):
        out[a, b] += sign * 100
        out[b, a] += sign * 100
    return out


def test_importing_the_package_is_light() -> None:
    heavy = "('scipy', 'clarabel', 'shapely', 'numba')"
    code = f"import sys, flatpush.friction; print([m for m in {heavy} if m in sys.modules])"
    done = python("-c", code)
    assert done.stdout.strip() == "[]", done.stderr
