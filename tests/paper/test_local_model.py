"""[Zhou2017] Eqs. 2-3: the local model of a straight push, printed and corrected (docs/errata.md row 7)."""

import numpy as np
import pytest

from flatpush.errors import InputError
from flatpush.friction import Ellipsoid, Exact, Quartic, Support, fit_surface, local_ellipsoid
from flatpush.friction.surface import LimitSurface

SQUARE = Support.polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def ratio(surface: Ellipsoid) -> float:
    return float(surface.matrix[0, 0] / surface.matrix[2, 2])


def printed(hessian: np.ndarray) -> float:
    """a/b of the printed Eqs. 2-3: a is the mean of both diagonal entries of the force."""
    return float((hessian[0, 0] + hessian[1, 1]) / 2 / hessian[2, 2])


def test_the_printed_form_doubles_rho_for_a_quartic_that_is_an_ellipsoid() -> None:
    # (x² + y² + 3z²)²
    quartic = Quartic([1, 1, 9, 0, 0, 0, 0, 0, 0, 2, 6, 6, 0, 0, 0])
    for direction in ([0.0, 1.0], [1.0, 0.0], [0.6, -0.8]):
        assert ratio(local_ellipsoid(quartic, direction)) == pytest.approx(1 / 3)
        assert printed(quartic.hessian([*direction, 0.0])) == pytest.approx(2 / 3)


def test_an_isotropic_ellipsoid_is_its_own_local_model() -> None:
    ellipsoid = Ellipsoid(np.diag([2.0, 2.0, 7.0]))
    np.testing.assert_allclose(local_ellipsoid(ellipsoid, [0.3, 1.0]).matrix, ellipsoid.matrix)
    # Of diag(a1, a2, b) the entry across the push counts: it decides how a sideways force turns the motion.
    assert ratio(local_ellipsoid(Ellipsoid(np.diag([2.0, 3.0, 6.0])), [0.0, 1.0])) == pytest.approx(2 / 6)


def slope(surface: LimitSurface, direction: np.ndarray) -> float:
    """ρ by its meaning: beside a straight push f_t = V_t and τ = ρ ω, for a forward speed of 1."""
    n, t = direction, np.array([-direction[1], direction[0]])
    step = 1e-5
    sideways = surface.wrench([*(n + step * t), 0.0]) - surface.wrench([*n, 0.0])
    turning = surface.wrench([*n, step]) - surface.wrench([*n, 0.0])
    return float(turning[2] / (sideways[:2] @ t))


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.2, 2.8])
def test_rho_is_what_the_surface_does_beside_a_straight_push(angle: float) -> None:
    n = np.array([np.cos(angle), np.sin(angle)])
    rng = np.random.default_rng(1)
    feet = Support.points(rng.normal(size=(300, 2)) * [2.0, 0.7]).centred()
    for support in (SQUARE, Support.polygon([(0, 0), (4, 0), (0, 2)]).centred(), Support.ring(1.0), feet):
        rho = ratio(local_ellipsoid(support, 3 * n))
        assert rho == pytest.approx(float(n @ support.covariance @ n))
        assert rho == pytest.approx(ratio(local_ellipsoid(Exact(support), n)))
        assert rho == pytest.approx(slope(Exact(support), n), rel=1e-3)
    # Methods of Eqs. 2-3 on a quartic agree with the same meaning, when the push does not turn it by itself.
    quartic = fit_surface(SQUARE, "quartic")
    straight = np.array([0.0, 1.0])
    assert ratio(local_ellipsoid(quartic, straight)) == pytest.approx(slope(quartic, straight), rel=1e-3)


def test_rho_of_a_rectangle_is_the_square_of_its_length_along_the_push_over_twelve() -> None:
    rectangle = Support.polygon([(0, 0), (6, 0), (6, 2), (0, 2)])
    assert ratio(local_ellipsoid(rectangle, [1, 0])) == pytest.approx(36 / 12)
    assert ratio(local_ellipsoid(rectangle, [0, 1])) == pytest.approx(4 / 12)


@pytest.mark.parametrize(
    ("angle", "height"),
    [
        (1.0, 0.334),
        (4.9, 0.345),
        (10.5, 0.378),
        (14.7, 0.409),
        (19.3, 0.446),
        (24.6, 0.489),
        (33.9, 0.558),
        (45.7, 0.613),
    ],
)
def test_the_axle_of_a_real_surface_moves_with_the_force(angle: float, height: float) -> None:
    """Height of the rotation centre over the centre of friction, by the angle of the force [deg].

    A uniform square of half width 1 is pushed at the middle of an edge. An ellipsoid's is constant.
    """
    f = np.array([np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    V = Exact(SQUARE).twist([*f, f[0]])  # torque of a force at (0, -1)
    # The rotation centre is (-vy, vx)/ω.
    assert V[0] / V[2] == pytest.approx(height, abs=1.5e-3)


def test_the_local_model_gives_the_axle_of_the_straight_push() -> None:
    rho = ratio(local_ellipsoid(SQUARE, [0, 1]))
    V = Exact(SQUARE).twist([1e-4, 1.0, 1e-4])
    assert V[0] / V[2] == pytest.approx(rho, rel=1e-5)  # ρ/r with r = 1


def test_a_direction_is_needed() -> None:
    with pytest.raises(InputError, match="direction"):
        local_ellipsoid(SQUARE, [0.0, 0.0])
    with pytest.raises(InputError, match="an exact surface"):
        local_ellipsoid("square", [0.0, 1.0])  # type: ignore[arg-type]
