"""Random limit surfaces: convex every time, and nominal on average."""

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.friction import Ellipsoid, Exact, Quartic, Support, fit_quartic, fit_surface
from flatpush.friction.draws import SurfaceDraws, draw_loads, wishart
from flatpush.friction.sos import gram_defect, tensor

FEET = [(-0.02, -0.01), (0.02, -0.01), (0.0, 0.02)]
A = np.array([[1.0, 0.1, 4.0], [0.1, 1.4, -3.0], [4.0, -3.0, 2500.0]])
V = np.random.default_rng(0).normal(size=(40, 3)) * [1.0, 1.0, 60.0]


def quartics() -> dict[str, Quartic]:
    """Of a square, of three feet, and one whose Gram matrix nearly has a null space (noisy data)."""
    square = Support.polygon([(-0.02, -0.02), (0.02, -0.02), (0.02, 0.02), (-0.02, 0.02)])
    F = Exact(Support.points(FEET)).wrench(V)
    noisy = fit_quartic(F + 0.25 * np.random.default_rng(1).normal(size=F.shape) * [1, 1, 0.016], V)
    found = {"square": fit_surface(square, "quartic"), "feet": fit_surface(Support.points(FEET), "quartic")}
    return {**found, "noisy": noisy}  # type: ignore[dict-item]


QUARTICS = quartics()


def test_the_wishart_draw_has_its_moments() -> None:
    """Mean I; variances 2/df on the diagonal and 1/df beside it. 4000 draws: the mean to 4 √(2/(50 · 4000))."""
    rng = np.random.default_rng(0)
    S = np.array([wishart(3, 50.0, rng) for _ in range(4000)])
    np.testing.assert_allclose(S.mean(axis=0), np.eye(3), atol=0.013)
    np.testing.assert_allclose(S.var(axis=0), np.where(np.eye(3) > 0, 2 / 50, 1 / 50), rtol=0.12)


def test_ellipsoids_have_the_moments_of_their_law() -> None:
    """sd(A_ij)² = (A_ij² + A_ii A_jj)/df, in every unit."""
    rng = np.random.default_rng(1)
    draws = SurfaceDraws(Ellipsoid(A), 50.0)
    drawn = np.array([draws.draw(rng).matrix for _ in range(4000)])
    scale = np.sqrt(np.outer(np.diag(A), np.diag(A)))
    np.testing.assert_allclose(drawn.mean(axis=0) / scale, A / scale, atol=0.013)
    variance = (A**2 + np.outer(np.diag(A), np.diag(A))) / 50
    np.testing.assert_allclose(drawn.var(axis=0) / variance, 1.0, atol=0.12)


@pytest.mark.parametrize("name", QUARTICS)
@pytest.mark.parametrize("df", [9.0, 50.0])
def test_every_quartic_drawn_is_convex_and_their_mean_is_the_nominal_one(name: str, df: float) -> None:
    """Convexity is proved by each draw's Gram matrix, and seen in its Hessian. At df = 9 many draws are cut."""
    nominal, rng = QUARTICS[name], np.random.default_rng(2)
    draws = SurfaceDraws(nominal, df)
    coefficients = []
    F = nominal.wrench(V)
    for k in range(600):
        drawn = draws.draw(rng)
        coefficients.append(drawn.coefficients)
        if k < 50:
            size = drawn.gram / np.sqrt(np.outer(np.diag(drawn.gram), np.diag(drawn.gram)))
            assert np.linalg.eigvalsh(size)[0] >= -1e-8
            scale = np.max(np.abs(drawn.gram))
            assert gram_defect(drawn.gram, tensor(drawn.coefficients)) <= 1e-9 * scale
            H = drawn.hessian(F) / np.sqrt(nominal.hessian(F[0])[2, 2])
            units = np.array([1, 1, 1 / 0.016])
            assert np.min(np.linalg.eigvalsh(H / np.outer(units, units))) >= -1e-9
    # H of fixed wrenches is linear in the coefficients; its mean lies within four standard errors.
    values = np.array([Quartic.value(nominal, f) for f in F[:5]])
    monomials = np.array([_values(c, F[:5], nominal) for c in coefficients])
    error = monomials.std(axis=0) / np.sqrt(len(monomials))
    assert np.all(np.abs(monomials.mean(axis=0) - values) <= 4 * error)
    assert np.all(monomials.std(axis=0) >= 0.05 * values)  # they do vary


def _values(coefficients: np.ndarray, F: np.ndarray, nominal: Quartic) -> np.ndarray:
    T = tensor(coefficients)
    return np.einsum("ijkl,ni,nj,nk,nl->n", T, F, F, F, F)


def test_few_draws_are_cut_at_the_default() -> None:
    rng = np.random.default_rng(0)
    for nominal in QUARTICS.values():
        draws = SurfaceDraws(nominal)
        assert np.mean([draws.move(rng)[1] for _ in range(300)]) <= 0.05


def test_draws_do_not_depend_on_the_units() -> None:
    nominal = QUARTICS["feet"]
    units = np.array([1.0, 1.0, 1000.0])
    T = np.einsum("ijkl,i,j,k,l->ijkl", tensor(nominal.coefficients), *[1 / units] * 4)
    from flatpush.friction.sos import coefficients_of

    mixed = np.outer(1 / units, 1 / units).ravel()
    in_mm = Quartic(coefficients_of(T), gram=nominal.gram * np.outer(mixed, mixed))
    one = SurfaceDraws(nominal).draw(np.random.default_rng(5))
    other = SurfaceDraws(in_mm).draw(np.random.default_rng(5))
    F = nominal.wrench(V)
    np.testing.assert_allclose(other.value(F * units), one.value(F), rtol=1e-6)


def test_the_same_stream_gives_the_same_surface() -> None:
    for nominal in (Ellipsoid(A), QUARTICS["square"]):
        one, other = (
            SurfaceDraws(nominal).draw(np.random.default_rng(3)).value([1, 2, 0.01]) for _ in range(2)
        )
        assert one == other
        near = SurfaceDraws(nominal, 1e8).draw(np.random.default_rng(3)).value([1, 2, 0.01])
        assert near == pytest.approx(nominal.value([1, 2, 0.01]), rel=1e-2)


def test_loads_vary_within_their_part() -> None:
    support = Support.points(FEET, [1, 2, 3])
    rng = np.random.default_rng(0)
    ratios = np.array([draw_loads(support, rng, 0.3).feet[1] for _ in range(200)]) / support.feet[1]
    assert np.all(ratios.max(axis=0) / ratios.min(axis=0) <= 1.3**2 / 0.7**2)
    assert np.all(ratios.std(axis=0) > 0.05)


@pytest.mark.parametrize(
    ("surface", "df", "message"),
    [
        (Exact(Support.points(FEET)), 50.0, "about an ellipsoid or a quartic"),
        (Ellipsoid(A), 2.0, "at least 3 degrees"),
        (Ellipsoid(A), np.nan, "at least 3 degrees"),
        (QUARTICS["feet"], 5.0, "at least 9 degrees"),
    ],
)
def test_what_cannot_be_drawn(surface, df, message) -> None:
    with pytest.raises(InputError, match=message):
        SurfaceDraws(surface, df).draw(np.random.default_rng(0))


def test_loads_that_cannot_be_drawn() -> None:
    with pytest.raises(InputError, match="on feet"):
        draw_loads(Support.disc(1.0), np.random.default_rng(0), 0.1)
    with pytest.raises(InputError, match="0 to below 1"):
        draw_loads(Support.points(FEET), np.random.default_rng(0), 1.0)
