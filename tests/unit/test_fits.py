"""Fits of ellipsoids and quartics: what they recover, report and refuse."""

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.friction import (
    Ellipsoid,
    Exact,
    Quartic,
    Support,
    fit_ellipsoid,
    fit_quartic,
    fit_surface,
    sized,
)

# The solver's own tolerance is 1e-9; the norm in the objective pulls by about its weight.
TINY = 1e-6
A = np.array([[1.0, 0.1, 4.0], [0.1, 1.4, -3.0], [4.0, -3.0, 2500.0]])
TRIANGLE = Support.polygon([(0.0, 0.0), (0.059, 0.0), (0.0, 0.0285)])


def pairs(surface: Ellipsoid | Quartic | Exact, n: int = 60, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    V = np.random.default_rng(seed).normal(size=(n, 3)) * [1.0, 1.0, 50.0]
    return surface.wrench(V), V


def test_an_ellipsoid_is_recovered_from_its_pairs() -> None:
    W, V = pairs(Ellipsoid(A))
    fitted = fit_ellipsoid(W, V, regularisation=TINY)
    np.testing.assert_allclose(fitted.matrix, A, rtol=1e-4, atol=1e-4)
    report = fitted.fit
    assert report is not None
    assert report.n == 60
    assert report.worst <= 1e-4
    # The characteristic length is √(a/b), up to what the ellipsoid's asymmetry does to a median.
    assert report.length == pytest.approx(np.sqrt(1 / 2500), rel=0.3)


def test_a_quartic_is_recovered_from_its_pairs() -> None:
    original = fit_surface(TRIANGLE, "quartic")
    assert isinstance(original, Quartic)
    W, V = pairs(original)
    fitted = fit_quartic(W, V, regularisation=TINY)
    F = np.random.default_rng(1).normal(size=(50, 3)) * [1.0, 1.0, 0.02]
    np.testing.assert_allclose(fitted.value(F), original.value(F), rtol=1e-3)
    assert np.linalg.eigvalsh(fitted.gram)[0] >= -1e-9
    assert fitted.fit is not None
    assert fitted.fit.worst <= 1e-3


def test_units_and_sizes_of_twists_do_not_matter() -> None:
    W, V = pairs(Exact(TRIANGLE.centred()))
    for fit in (fit_ellipsoid, fit_quartic):
        metres = fit(W, V)
        millimetres = fit(W * [1, 1, 1000], V * [7, 7, 7 / 1000])
        F = np.array([[0.5, 0.2, 0.003], [0.1, 0.0, 0.01]])
        np.testing.assert_allclose(millimetres.value(F * [1, 1, 1000]), metres.value(F), rtol=1e-5)
        newtons = fit(5 * W, V)
        np.testing.assert_allclose(newtons.value(5 * F), metres.value(F), rtol=1e-5)


def test_the_report_speaks_of_the_result() -> None:
    W, V = pairs(Exact(TRIANGLE.centred()), 40)
    fitted = fit_ellipsoid(W, V, length=0.015, regularisation=0.01)
    report = fitted.fit
    assert report is not None
    a, b = (x * [1, 1, 0.015] for x in (fitted.twist(W), V))
    cosine = np.sum(a * b, axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    np.testing.assert_allclose(report.angles, np.arccos(cosine), atol=1e-7)
    assert (report.length, report.regularisation) == (0.015, 0.01)
    assert report.mean == pytest.approx(np.mean(report.angles))
    assert report.median == pytest.approx(np.median(report.angles))
    assert report.worst == np.max(report.angles)


@pytest.mark.parametrize("kind", ["ellipsoid", "quartic"])
def test_a_fitted_support_keeps_its_symmetries_and_is_the_same_every_time(kind: str) -> None:
    square = Support.polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    one, other = (fit_surface(square, kind) for _ in range(2))  # type: ignore[arg-type]
    F = np.array([0.3, 0.8, -0.4])
    assert one.value(F) == other.value(F)
    for mirrored in ([-0.3, 0.8, 0.4], [0.8, 0.3, 0.4], [-0.8, 0.3, -0.4]):
        assert one.value(mirrored) == pytest.approx(one.value(F), rel=1e-5)
    # A support drawn elsewhere, and turned, gives the same surface, turned.
    c, s = np.cos(0.7), np.sin(0.7)
    turned = Support.polygon((np.array([[0, 0], [0.059, 0], [0, 0.0285]]) @ [[c, s], [-s, c]]) + 3)
    straight, turned_fit = fit_surface(TRIANGLE, kind), fit_surface(turned, kind)  # type: ignore[arg-type]
    F = np.array([0.3, 0.8, 0.004])
    assert turned_fit.value([c * 0.3 - s * 0.8, s * 0.3 + c * 0.8, 0.004]) == pytest.approx(
        straight.value(F), rel=1e-4
    )


def test_a_quartic_is_much_nearer_to_a_uniform_patch_than_an_ellipsoid() -> None:
    square = Support.polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    ellipsoid, quartic = (fit_surface(square, kind).fit for kind in ("ellipsoid", "quartic"))  # type: ignore[arg-type]
    assert ellipsoid is not None
    assert quartic is not None
    assert np.degrees(ellipsoid.mean) == pytest.approx(5.2, abs=0.5)
    assert np.degrees(quartic.mean) == pytest.approx(0.98, abs=0.2)


def test_any_surface_can_be_fitted() -> None:
    original = Ellipsoid(A)
    fitted = fit_surface(original, "ellipsoid", regularisation=TINY)
    assert isinstance(fitted, Ellipsoid)
    np.testing.assert_allclose(fitted.matrix, A, rtol=1e-3, atol=1e-3)
    with pytest.raises(InputError, match="quartic"):
        fit_surface(original, "sextic")  # type: ignore[arg-type]


W, V = pairs(Ellipsoid(A), 20)


@pytest.mark.parametrize(
    ("wrenches", "twists", "options", "message"),
    [
        (W[:5], V[:5], {}, "at least 6 pairs, got 5"),
        (W, V[:-1], {}, "same shape"),
        (W[:, :2], V[:, :2], {}, "same shape"),
        (W * [1, 1, np.nan], V, {}, "finite"),
        (W * [1, 1, 0], V, {}, "forces as well as torques"),
        (W, V * [1, 1, 0], {}, "all three directions"),
        (np.repeat(W[:1], 20, axis=0), V, {}, "all three directions"),
        (W, V * (np.arange(20) > 0)[:, None], {}, "zero"),
        (W, V, {"length": -1.0}, "length is positive"),
        (W, V, {"force": np.inf}, "force is positive"),
    ],
)
def test_pairs_that_do_not_determine_a_surface(
    wrenches: np.ndarray, twists: np.ndarray, options: dict[str, float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        fit_ellipsoid(wrenches, twists, **options)  # type: ignore[arg-type]


def test_a_quartic_needs_more_pairs() -> None:
    with pytest.raises(InputError, match="at least 15 pairs, got 14"):
        fit_quartic(W[:14], V[:14])


def test_a_sized_surface_has_half_of_the_wrenches_inside_and_the_same_twists():
    rng = np.random.default_rng(4)
    twists = rng.normal(size=(41, 3)) * [1, 1, 30]
    wrenches = Exact(Support.disc(0.05)).wrench(twists) * 7.0
    for fit in (fit_ellipsoid, fit_quartic):
        fitted = fit(wrenches, twists)
        surface = sized(fitted, wrenches)
        assert np.median(surface.value(wrenches)) == pytest.approx(1)
        size = np.linalg.norm(surface.twist(wrenches), axis=1) / np.linalg.norm(
            fitted.twist(wrenches), axis=1
        )
        assert np.ptp(size) < 1e-9 * size[0]
