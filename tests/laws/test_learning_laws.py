"""What must be true of learning while pushing: no bias, an honest covariance, estimates that move with the contact."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tests.strategies import directions, reals, vectors

from flatpush import InputError
from flatpush.control.learning.belief import SteeringBelief, SteeringEstimate, sticking_displacement
from flatpush.control.learning.friction_bounds import FrictionBounds

COF, RHO = np.array([0.0012, -0.0007]), 3.1e-4
CONTACTS = np.array([[-0.025, 0.002], [0.003, -0.0175], [0.025, -0.004]])


def twist_of(matrix, point, force):
    """V = A Jᵀ f about the origin."""
    return matrix @ np.array([*force, point[0] * force[1] - point[1] * force[0]])


def matrix_of(cof, rho):
    """diag(1, 1, 1/ρ) about a centre, as a matrix about the origin."""
    T = np.array(
        [[1, 0, -cof[1]], [0, 1, cof[0]], [0, 0, 1]]
    )  # velocity at the centre of a twist at the origin
    return np.linalg.inv(T) @ np.diag([1, 1, 1 / rho]) @ np.linalg.inv(T).T


def pushed(rng, point, count, noise, length=0.02, cof=COF, rho=RHO):
    """Displacements of a contact under forces about the direction to the COF, with noise, and the true ones."""
    A, d = matrix_of(cof, rho), (cof - point) / np.hypot(*(cof - point))
    for _ in range(count):
        angle = rng.uniform(-0.25, 0.25)
        c, s = np.cos(angle), np.sin(angle)
        V = twist_of(A, point, [c * d[0] - s * d[1], s * d[0] + c * d[1]])
        yield length * V / np.hypot(
            V[0] - V[2] * point[1], V[1] + V[2] * point[0]
        ) + noise * rng.standard_normal(3)


@settings(max_examples=60, deadline=None)
@given(
    vectors(0.03),
    st.integers(-5, -3).map(lambda k: 10.0**k),
    vectors(0.09),
    st.lists(directions(2), min_size=1),
)
def test_b_is_the_null_vector_of_all_sticking_motions(c, rho, p, forces):
    """[methods 1.6] b · A Jᵀ f = 0 for every force, and the axle's heading and offset are where the centres lie."""
    assume(np.hypot(*(c - p)) > 0.005)  # a contact at the centre of friction has no axle
    estimate = SteeringEstimate(c, rho, np.zeros((3, 3)))
    axle = estimate.axle(p)
    for force in forces:
        V = twist_of(matrix_of(c, rho), p, force)
        if abs(V[2]) < 1e-6 * np.hypot(
            *V[:2]
        ):  # a force through the COF turns nothing: the centre is nowhere
            assert abs(estimate.b(p) @ V) <= 1e-12 * np.linalg.norm(estimate.b(p)) * np.linalg.norm(V)
            continue
        scale = np.linalg.norm(estimate.b(p) * V)
        assert abs(estimate.b(p) @ V) <= 1e-12 * scale
        centre = np.array([-V[1], V[0]]) / V[2]
        assert abs(axle.heading @ (centre - p) - axle.offset) <= 1e-9 * np.hypot(*(centre - p))
        u = np.array([V[0] - V[2] * p[1], V[1] + V[2] * p[0]])
        assert estimate.turn(p, u) == pytest.approx(V[2], rel=1e-9)


def test_one_contact_identifies_any_positive_definite_model():
    """The axle of a full matrix, which no COF and ρ describe elsewhere, comes out at the contact that was pushed."""
    rng = np.random.default_rng(1)
    for _ in range(10):
        root = rng.standard_normal((3, 3)) + 2 * np.eye(3)
        A = root @ root.T
        A[2, :] *= 40.0
        A[:, 2] *= 40.0
        p = np.array([-0.022, 0.003])
        b = np.linalg.solve(A, [p[1], -p[0], 1.0])
        belief = SteeringBelief.prior([0, 0], 4e-4, sd_cof=1.0, sd_rho=1.0)
        for force in ([1.0, 0.3], [1.0, -0.2], [0.9, 0.05]):
            V = twist_of(A, p, force)
            belief = belief.observed(p, 0.02 * V / np.hypot(*V[:2]), np.diag([1e-14, 1e-14, 1e-12]))
        found = belief.estimate().b(p)
        assert np.allclose(
            found / np.linalg.norm(found), b / np.linalg.norm(b) * np.sign(b @ found), atol=1e-4
        )


def test_what_is_learned_at_one_contact_holds_at_another():
    rng = np.random.default_rng(2)
    noise = np.array([1e-5, 1e-5, 5e-4])
    belief = SteeringBelief.prior([0, 0], 4e-4, 1e-3, 1e-4)
    for point in CONTACTS[:2]:
        for Y in pushed(rng, point, 60, noise):
            belief = belief.observed(point, Y, np.diag(noise**2))
    there = CONTACTS[2]
    truth = SteeringEstimate(COF, RHO, np.zeros((3, 3))).axle(there)
    prior = SteeringBelief.prior([0, 0], 4e-4, 1e-3, 1e-4).estimate().axle(there)
    axle = belief.estimate().axle(there)
    assert belief.better_than_prior(there)
    error = np.arccos(np.clip(axle.heading @ truth.heading, -1, 1))
    assert error < 0.2 * np.arccos(prior.heading @ truth.heading)
    assert error < 3 * axle.heading_sd
    assert abs(axle.offset - truth.offset) < 3 * axle.offset_sd


def test_it_is_unbiased_where_least_squares_is_not_and_its_covariance_is_honest():
    """Monte Carlo without a useful prior, noise a fifth of the turns: the mean error is within its own scatter,
    ordinary least squares is off by many times that, and the normalised error squared (NEES) averages 3."""
    rng = np.random.default_rng(3)
    noise = np.array([2e-4, 2e-4, 0.03])
    errors, nees, ordinary = [], [], []
    truth = np.array([*COF, RHO + COF @ COF])
    for _ in range(100):
        belief = SteeringBelief.prior([0, 0], 4e-4, sd_cof=0.3, sd_rho=1.0)
        for point in CONTACTS:
            for Y in pushed(rng, point, 40, noise):
                belief = belief.observed(point, Y, np.diag(noise**2))
        found = belief.estimate()
        e = np.array([*found.cof, found.moment]) - truth
        errors.append(e)
        nees.append(e @ np.linalg.solve(found.covariance, e))
        M = sum(place.moments for place in belief.places)
        ordinary.append(np.linalg.solve(M[:3, :3], -M[:3, 3]) - truth)
    errors, ordinary = np.array(errors), np.array(ordinary)
    spread = errors.std(axis=0) / np.sqrt(len(errors))
    assert np.all(np.abs(errors.mean(axis=0)) < 3.5 * spread)
    assert abs(ordinary[:, 2].mean()) > 8 * spread[2]
    # 100 values of chi-squared with 3 degrees of freedom: mean 3, standard error 0.25.
    assert 2.25 < np.mean(nees) < 3.75


def test_consistent_more_pushes_know_more():
    rng = np.random.default_rng(4)
    noise = np.array([3e-4, 3e-4, 0.007])
    belief, sizes = SteeringBelief.prior([0, 0], 4e-4, 1e-2, 4e-4), []
    for k, Y in enumerate(pushed(rng, CONTACTS[0], 1600, noise)):
        belief = belief.observed(CONTACTS[0], Y, np.diag(noise**2))
        if k + 1 in (100, 400, 1600):
            sizes.append(belief.estimate().axle(CONTACTS[0]).heading_sd)
    assert sizes[0] > 1.7 * sizes[1] > 1.7**2 * sizes[2]


def test_noise_alone_teaches_nothing():
    """An object that rests gives displacements of pure noise; the estimate stays with the prior."""
    rng = np.random.default_rng(5)
    noise = np.array([3e-4, 3e-4, 0.005])
    before = SteeringBelief.prior([0.001, 0], 4e-4, 1e-3, 1e-4)
    belief = before
    for _ in range(200):
        belief = belief.observed(CONTACTS[0], noise * rng.standard_normal(3), np.diag(noise**2))
    found, prior = belief.estimate(), before.estimate()
    assert np.all(np.abs(found.cof - prior.cof) < 1e-3)
    assert abs(found.rho - prior.rho) < 1e-4


@settings(max_examples=60, deadline=None)
@given(vectors(0.09), vectors(0.06), reals(-0.3, 0.3))
def test_a_finger_that_sticks_leaves_noise_in_the_turn_only(p, way, turn):
    Y, covariance = sticking_displacement(p, way, turn, 0.007)
    assert np.allclose(Y[:2] + turn * np.array([-p[1], p[0]]), way, atol=1e-15)
    assert np.linalg.matrix_rank(covariance) == 1
    assert covariance[2, 2] == pytest.approx(0.007**2)


def test_bounds_of_friction_only_tighten_and_never_cross():
    bounds = FrictionBounds()
    for ratio in (0.1, 0.2, 0.15):
        bounds = bounds.stuck(ratio)
    assert bounds.low == 0.2
    bounds = bounds.slipped(0.28)
    assert (bounds.clip(0.1), bounds.clip(0.25), bounds.clip(0.4)) == (0.2, 0.25, 0.28)
    assert bounds.slipped(0.15).high == 0.2
    assert bounds.stuck(0.5).low == 0.28


def test_what_is_refused():
    belief = SteeringBelief.prior([0, 0], 4e-4, 1e-3, 1e-4)
    for bad in ([np.nan, 0, 0], [np.inf, 0, 0], [0, 0]):
        with pytest.raises(InputError):
            belief.observed([0.01, 0], bad, np.eye(3))
    with pytest.raises(InputError, match="noise"):
        belief.observed([0.01, 0], [0.01, 0, 0], np.zeros((3, 3)))
    with pytest.raises(InputError):
        SteeringBelief.prior([0, 0], -1.0, 1e-3, 1e-4)
    with pytest.raises(InputError):
        belief.faded(1.5)
    assert np.array_equal(
        belief.observed([0.01, 0], [0.01, 0, 0.1], np.eye(3)).faded(0.0).estimate().cof, [0, 0]
    )
