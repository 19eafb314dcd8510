"""Supports: their accuracy in the hard places, their values in the easy ones, and what they refuse."""

import re
from itertools import pairwise

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.friction import CollinearSupportWarning, Support

PROMISED = 1e-9  # of the load; of load times radius for the torque
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
ELL = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])


def about(centre: tuple[float, float]) -> np.ndarray:
    return np.array([centre[1], -centre[0], 1.0])


def ends_first(n: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Tanh-sinh points and weights on [0, 1]: blind to singular ends."""
    k = np.arange(-n, n + 1) * (4.0 / n)
    u = np.pi * np.sinh(k)
    x = 1 / (1 + np.exp(-u))
    return x, (4.0 / n) * np.pi * np.cosh(k) * x * (1 - x)


def by_quadrature(corners: np.ndarray, filled: bool, V: np.ndarray) -> np.ndarray:
    """The wrench, summed over signed triangles from the rotation centre whose bases are cut at its foot."""
    c = np.array([-V[1], V[0]]) / V[2]
    x, w = ends_first()
    total, size = np.zeros(3), 0.0
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        d = q - p
        cut = float(np.clip((c - p) @ d / (d @ d), 0, 1))
        for low, high in ((0.0, cut), (cut, 1.0)):
            if high <= low:
                continue
            base, weights = p + (low + (high - low) * x)[:, None] * d, w * (high - low)
            if filled:
                double = float((p - c)[0] * (q - c)[1] - (p - c)[1] * (q - c)[0])
                rho, v = np.polynomial.legendre.leggauss(4)
                rho, v = (1 + rho) / 2, v / 2
                points = (c + rho[:, None, None] * (base - c)).reshape(-1, 2)
                weights = ((v * rho)[:, None] * weights * double).ravel()
            else:
                points, weights = base, weights * np.hypot(*d)
            r = points - c
            length = np.hypot(*r.T)
            v_hat = np.stack([-r[:, 1], r[:, 0]], axis=1) / np.where(length > 0, length, 1.0)[:, None]
            moment = points[:, 0] * v_hat[:, 1] - points[:, 1] * v_hat[:, 0]
            total += [v_hat[:, 0] @ weights, v_hat[:, 1] @ weights, moment @ weights]
            size += float(weights.sum())
    return total / size


CENTRES = {
    "inside": (0.3, 0.2),
    "centre": (0.0, 0.0),
    "on an edge": (1.0, 0.3),
    "beside an edge": (1.0, 1e-9),
    "on a vertex": (1.0, 1.0),
    "beside a vertex": (1.0 + 1e-9, 1.0),
    "on the line of an edge": (1.0, 2.5),
    "outside": (4.0, -3.0),
    "where the cubature takes over": (30.0, 20.0),
}


@pytest.mark.parametrize("filled", [True, False], ids=["polygon", "outline"])
@pytest.mark.parametrize("corners", [SQUARE, ELL], ids=["square", "L"])
@pytest.mark.parametrize("centre", CENTRES.values(), ids=CENTRES.keys())
def test_the_wrench_is_right_wherever_the_rotation_centre_lies(
    centre: tuple[float, float], corners: np.ndarray, filled: bool
) -> None:
    support = Support.polygon(corners) if filled else Support.outline(corners)
    V = about(centre)
    np.testing.assert_allclose(support.wrench(V), by_quadrature(corners, filled, V), atol=PROMISED)


@pytest.mark.parametrize("distance", [0.0, 1e-9, 0.4, 1 - 1e-6, 1.0, 1 + 1e-6, 3.0, 15.9, 16.1, 1e6])
def test_discs_and_rings_agree_with_plain_sums(distance: float) -> None:
    # The periodic trapezium rule on the ring; the disc as rings, cut at the rotation centre.
    n = 200_000
    angles = 2 * np.pi * (np.arange(n) + 0.5) / n

    def ring(radius: float) -> np.ndarray:
        x, y = radius * np.cos(angles) - distance, radius * np.sin(angles)
        r = np.hypot(x, y)
        return np.array([0.0, np.mean(x / r), np.mean((radius * np.cos(angles) * x + y * y) / r)])

    V = about((distance, 0.0))
    # At the ring itself the integrand jumps; the rule is good to 1/n there.
    tolerance = PROMISED if abs(distance - 1) > 0.1 else 2e-5
    np.testing.assert_allclose(Support.ring(1.0).wrench(V), ring(1.0), atol=tolerance)
    if distance in (0.4, 3.0):
        n = 4_000
        angles = 2 * np.pi * (np.arange(n) + 0.5) / n
        x, w = ends_first(60)
        cuts = [0.0, distance, 1.0] if distance < 1 else [0.0, 1.0]
        total = np.zeros(3)
        for low, high in pairwise(cuts):
            for t, share in zip(x, w, strict=True):
                radius = low + (high - low) * t
                if abs(radius - distance) > 1e-12:
                    total += share * (high - low) * 2 * radius * ring(radius)
        np.testing.assert_allclose(Support.disc(1.0).wrench(V), total, atol=1e-6)


def test_the_disc_is_a_mean_of_rings() -> None:
    x, w = ends_first(100)
    for distance in (0.0, 0.4, 1.0, 3.0, 40.0):
        V = about((distance, 0.0))
        total = np.zeros(3)
        cuts = [0.0, min(distance, 1.0), 1.0]
        for low, high in pairwise(cuts):
            for t, share in zip(low + (high - low) * x, w * (high - low), strict=True):
                if t > 1e-12:
                    total += 2 * t * share * Support.ring(float(t)).wrench(V)
        np.testing.assert_allclose(Support.disc(1.0).wrench(V), total, atol=1e-9)


def test_known_values() -> None:
    turn, slide = [0.0, 0.0, 2.0], [0.0, -3.0, 0.0]
    for support, mean_radius in (
        (Support.disc(3.0), 2.0),
        (Support.ring(3.0), 3.0),
        (Support.points([(3, 0), (-3, 0), (0, 3), (0, -3)]), 3.0),
        # Mean distance from the centre of a square of half width 1: (√2 + asinh 1)/3.
        (Support.polygon(SQUARE), (np.sqrt(2) + np.arcsinh(1)) / 3),
        (Support.outline(SQUARE), (np.sqrt(2) + np.arcsinh(1)) / 2),
    ):
        np.testing.assert_allclose(support.wrench(turn), [0, 0, mean_radius], atol=1e-14)
        np.testing.assert_allclose(support.wrench(slide), [0, -1, 0], atol=1e-14)
        assert support.dissipation([0.0, 0.0, 0.0]) == 0


def test_centre_radius_and_second_moments() -> None:
    feet = Support.points([(0, 0), (4, 0), (0, 4)], [2, 1, 1])
    np.testing.assert_allclose(feet.centre, [1, 1])
    assert feet.radius == pytest.approx(np.sqrt(10))
    np.testing.assert_allclose(feet.covariance, [[3, -1], [-1, 3]])
    points, weights = feet.feet
    np.testing.assert_allclose(sorted(points.tolist()), [[0, 0], [0, 4], [4, 0]])
    assert weights.sum() == pytest.approx(1)
    # 1e6 diameters away: nothing is lost to cancellation.
    far = Support.polygon(ELL + 1e6)
    np.testing.assert_allclose(far.centre - 1e6, Support.polygon(ELL).centre, atol=1e-9)
    np.testing.assert_allclose(far.covariance, Support.polygon(ELL).covariance, atol=1e-8)
    for support, expected in (
        (Support.polygon(SQUARE * [3, 1]), [3, 1 / 3]),
        (Support.outline(SQUARE), [2 / 3, 2 / 3]),
        (Support.disc(2.0, (5, 6)), [1, 1]),
        (Support.ring(2.0), [2, 2]),
    ):
        np.testing.assert_allclose(support.covariance, np.diag(expected), atol=1e-14)
        assert len(support.feet[0]) == 0
    assert Support.polygon(ELL[::-1]).wrench([1, 2, 3]) == pytest.approx(
        Support.polygon(ELL).wrench([1, 2, 3])
    )
    np.testing.assert_allclose(feet.centred().centre, 0)
    np.testing.assert_allclose(feet.translated([1, 2]).centre, [2, 3])


def test_a_foot_at_the_rotation_centre_adds_nothing() -> None:
    feet = Support.points([(0, 0), (1, 0), (0, 1)])
    np.testing.assert_allclose(feet.wrench([0, 0, 1]), [-1 / 3, 1 / 3, 2 / 3], atol=1e-15)
    # Also where the coordinates hide the zero: 0.1 + 0.2 is not 0.3.
    shifted = feet.translated([0.1, 0.2]).translated([0.2, 0.1])
    np.testing.assert_allclose(shifted.wrench(about((0.3, 0.3)))[:2], [-1 / 3, 1 / 3], atol=1e-12)


def test_equal_feet_are_one_and_weightless_ones_none() -> None:
    feet = Support.points([(0, 0), (0, 0), (1, 0), (0, 1), (9, 9)], [1, 1, 2, 2, 0])
    points, weights = feet.feet
    assert len(points) == 3
    np.testing.assert_allclose(weights, 1 / 3)


def test_collinear_feet_warn_once_when_they_are_made() -> None:
    with pytest.warns(CollinearSupportWarning, match="one line"):
        bar = Support.points([(0, 0), (1, 1), (3, 3)])
    assert bar.collinear
    assert bar.centred().translated([1, 0]).collinear  # no further warning: those are errors here
    assert not Support.points([(0, 0), (1, 1), (3, 3.001)]).collinear
    assert not Support.disc(1.0).collinear


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Support.points([(0, 0), (1, 0), (0, 1)], [1, -1, 2]), "not negative"),
        (lambda: Support.points([(0, 0), (1, 0), (0, 1)], [0, 0, 0]), "positive sum"),
        (lambda: Support.points([(0, 0), (1, 0), (0, 1)], [1, 2]), "as many weights"),
        (lambda: Support.points([(0, 0), (1, 0), (0, np.nan)]), "finite"),
        (lambda: Support.points([(0, 0), (1, 0)], [1, np.inf]), "finite"),
        (lambda: Support.points([(2, 3)]), "two different places"),
        (lambda: Support.points([(2, 3), (2, 3)]), "two different places"),
        (lambda: Support.points([(2, 3), (1, 1)], [1, 0]), "two different places"),
        (lambda: Support.points([]), r"list of \[x, y\]"),
        (lambda: Support.points([(1, 2, 3)]), r"list of \[x, y\]"),
        (lambda: Support.points([("a", 2)]), "numbers"),
        (lambda: Support.polygon([(0, 0), (1, 0)]), "three"),
        (lambda: Support.polygon([(0, 0), (2, 2), (2, 0), (0, 1)]), "cross"),
        (lambda: Support.outline([(0, 0), (1, 0), (2, 0)]), "area"),
        (lambda: Support.disc(0.0), "positive"),
        (lambda: Support.ring(-1.0), "positive"),
        (lambda: Support.disc(np.nan), "positive"),
        (lambda: Support.disc(1.0, (1, 2, 3)), r"\[x, y\]"),
        (lambda: Support.disc(1.0).wrench([0, 0, 0]), "zero twist"),
        (lambda: Support.disc(1.0).curvature([0, 0, 0]), "zero twist"),
        (lambda: Support.disc(1.0).wrench([0, np.nan, 0]), "finite"),
        (lambda: Support.disc(1.0).wrench([0, 1]), "three"),
        (lambda: Support.disc(1.0).wrench([0, 1, 0], friction=-1), "not negative"),
    ],
)
def test_what_is_refused(make: object, message: str) -> None:
    with pytest.raises(InputError) as refused:
        make()  # type: ignore[operator]
    assert re.search(message, str(refused.value))


def test_twists_broadcast() -> None:
    V = np.random.default_rng(0).normal(size=(2, 5, 3))
    V[0, 0, 2] = 0.0
    for support in (Support.disc(1.0), Support.polygon(ELL), Support.points(SQUARE)):
        W = support.wrench(V)
        assert W.shape == V.shape
        assert support.dissipation(V).shape == (2, 5)
        assert support.curvature(V).shape == (2, 5, 3, 3)
        np.testing.assert_allclose(W[1, 3], support.wrench(V[1, 3]), atol=1e-15)
