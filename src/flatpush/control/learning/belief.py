"""Learning while pushing: the two numbers that steer a sticking push, from measured motion, with their uncertainty.

Every sticking motion V of a contact p satisfies b · V = 0 with b = A⁻¹ k, k = (p_y, -p_x, 1): the wrench A⁻¹ V that
made it has no moment about p. Of b only the direction matters: two numbers, the axle line
{x : b_1 x_y - b_2 x_x + b_3 = 0} on which every centre of rotation lies. With A = diag(1, 1, 1/ρ) about a centre of
friction c,

    b(p) = (p_y - c_y, c_x - p_x, m - p · c),    m = ρ + |c|²,

is linear in φ = (c_x, c_y, m), so that what was seen at different contacts adds up, and the estimate moves with the
contact. The equations b · Y = 0 have noise in Y, not in a right-hand side: ordinary least squares would be biased.
Total least squares keeps the moments M = Σ w y yᵀ with y = Tᵀ Y, b = T (φ, 1), and what noise alone adds to them,
N = Σ w Tᵀ Σ_Y T, with w = 1 / bᵀ Σ_Y b. Along b itself M is all noise; along what the motions had in them it stands out
of N, and M - N there is the information on φ (the eigen-gap: a push that never turned leaves one direction of it
open). A prior adds to it, and both are solved together.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry import perpendicular
from ...geometry.pose import Array

# The prior of every controller: standard deviations of each coordinate of the centre of friction, by the object's size,
# and of ρ, by itself.
SD_COF, SD_RHO = 0.015, 0.15
# Weights depend on the estimate, which depends on the weights: so many rounds.
ROUNDS = 4
# Contacts this near to each other share their weight [m].
SAME_PLACE = 0.002
# Moments below this share of the largest are rounding.
FLAT = 1e-12
# A direction whose moments exceed what noise gives by this many standard deviations carries a signal.
STANDS_OUT = 4.0
# The estimate counts as better than the prior when it knows the heading of the axle this much better.
BETTER = 0.8
# An estimate farther from the prior than this is not believed, by the prior's standard deviations.
MOST_DEVIATIONS = 3.0


class Axle(NamedTuple):
    """The axle line of a contact, on which all centres of rotation lie.

    Attributes:
        heading: unit vector across it, shape (2,): the way every point of the line moves.
        offset: of the line from the contact, along the heading [m].
        heading_sd: standard deviation of the heading [rad].
        offset_sd: standard deviation of the offset [m].
    """

    heading: Array
    offset: float
    heading_sd: float
    offset_sd: float


@dataclass(frozen=True, eq=False)
class SteeringEstimate:
    """A centre of friction and a ρ, in the belief's frame, with their covariance.

    Attributes:
        cof: shape (2,) [m].
        rho: a/b [m²].
        covariance: of (c_x, c_y, m), m = ρ + |c|², shape (3, 3).
    """

    cof: Array
    rho: float
    covariance: Array

    def b(self, point: ArrayLike) -> Array:
        """The vector with b · V = 0 for every sticking twist V of a contact, up to size, shape (3,)."""
        return _map(np.asarray(point, dtype=float)) @ np.array([*self.cof, self.moment, 1.0])

    @property
    def moment(self) -> float:
        """m = ρ + |c|² [m²]."""
        return self.rho + float(self.cof @ self.cof)

    @property
    def rho_sd(self) -> float:
        """Standard deviation of ρ [m²]."""
        g = np.array([-2 * self.cof[0], -2 * self.cof[1], 1.0])
        return float(np.sqrt(float(g @ self.covariance @ g)))

    def believable(self, prior: "SteeringEstimate") -> bool:
        """Whether it is not far outside a prior; a finger that slipped unseen gives nonsense."""
        sd = np.sqrt(np.diag(prior.covariance)[:2])
        near = bool(np.hypot(*((self.cof - prior.cof) / sd)) <= MOST_DEVIATIONS)
        return near and abs(self.rho - prior.rho) <= MOST_DEVIATIONS * prior.rho_sd and self.rho > 0

    def axle(self, point: ArrayLike) -> Axle:
        """The axle of a contact, with what is known of it.

        Raises:
            InputError: for a contact at the centre of friction, which has none.
        """
        p = np.asarray(point, dtype=float)
        d = self.cof - p
        r = float(np.hypot(*d))
        if r == 0:
            raise InputError("a contact at the centre of friction has no axle", value=point)
        heading, offset = d / r, float(self.b(p) @ _rotation_about(p)) / r
        cov = self.covariance
        across = perpendicular(heading)
        slope = np.array([*(-2 * p - offset * heading), 1.0]) / r  # of the offset, by c_x, c_y and m
        return Axle(
            heading,
            offset,
            float(np.sqrt(max(0.0, float(across @ cov[:2, :2] @ across)))) / r,
            float(np.sqrt(max(0.0, float(slope @ cov @ slope)))),
        )

    def turn(self, point: ArrayLike, velocity: ArrayLike) -> float:
        """ω of the object whose contact point sticks to a finger of a velocity (2,), all in the belief's frame."""
        p, u = np.asarray(point, dtype=float), np.asarray(velocity, dtype=float)
        b = self.b(p)
        return -float(b[:2] @ u) / float(b @ _rotation_about(p))


@dataclass(frozen=True, eq=False)
class SteeringBelief:
    """All that is known of the steering of one object. Build with SteeringBelief.prior; observed() returns a new one.

    Attributes:
        places: what was seen at each contact, see Place.
        information: of the prior, on (c_x, c_y, m), shape (3, 3).
        before: the prior's mean (c_x, c_y, m), shape (3,).
        count: number of stretches seen.

    >>> belief = SteeringBelief.prior(cof=[0, 0], rho=3e-4, sd_cof=1e-3, sd_rho=6e-5)
    >>> seen = belief.observed([-0.02, 0], [0.01, 0.0005, 0.03], np.diag([1e-8, 1e-8, 1e-6]))
    >>> bool(seen.estimate().axle([-0.02, 0]).heading_sd < belief.estimate().axle([-0.02, 0]).heading_sd)
    True
    """

    places: tuple["Place", ...]
    information: Array
    before: Array
    count: int = 0

    @classmethod
    def prior(cls, cof: ArrayLike, rho: float, sd_cof: float, sd_rho: float) -> "SteeringBelief":
        """What is believed before the first push; large standard deviations where nothing is known.

        Args:
            cof: centre of friction, shape (2,) [m], in the frame of all points and displacements.
            rho: a/b [m²].
            sd_cof, sd_rho: standard deviations, of each coordinate [m] and of ρ [m²].

        Raises:
            InputError: for numbers that are not finite, or not positive where they must be.
        """
        c = np.asarray(cof, dtype=float)
        if c.shape != (2,) or not np.all(np.isfinite(c)):
            raise InputError("a centre of friction is two finite numbers", value=cof)
        for name, value in (("rho", rho), ("sd_cof", sd_cof), ("sd_rho", sd_rho)):
            if not (np.isfinite(value) and value > 0):
                raise InputError("a positive, finite number is needed", key=name, value=value)
        # m = ρ + |c|²; to first order about the mean.
        J = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2 * c[0], 2 * c[1], 1.0]])
        covariance = J @ np.diag([sd_cof**2, sd_cof**2, sd_rho**2]) @ J.T
        information = np.asarray(np.linalg.inv(covariance), dtype=float)
        return cls((), information, np.array([*c, rho + float(c @ c)]))

    def observed(self, point: ArrayLike, displacement: ArrayLike, covariance: ArrayLike) -> "SteeringBelief":
        """The belief after a stretch of sticking.

        Args:
            point: the contact, shape (2,) [m].
            displacement: Y = ∫ V dt of the body twist about the frame's origin, shape (3,) [m, m, rad]; where the
                twist is constant, the logarithm of the displacement.
            covariance: of Y's noise, shape (3, 3); it may be singular.

        Raises:
            InputError: for values that are not finite, or without any noise along b (nothing to weigh it by).
        """
        p, Y = np.asarray(point, dtype=float), np.asarray(displacement, dtype=float)
        S = np.asarray(covariance, dtype=float)
        if p.shape != (2,) or Y.shape != (3,) or S.shape != (3, 3):
            raise InputError("a point (2,), a displacement (3,) and a covariance (3, 3) are needed", value=Y)
        if not (np.all(np.isfinite(p)) and np.all(np.isfinite(Y)) and np.all(np.isfinite(S))):
            raise InputError("an observation is finite", value=(point, displacement))
        T = _map(p)
        if float(np.trace(S)) <= 0:
            raise InputError("an observation has some noise", key="covariance", value=covariance)
        y, n = T.T @ Y, T.T @ S @ T
        places = list(self.places)
        for i, place in enumerate(places):
            if np.hypot(*(p - place.point)) <= SAME_PLACE:
                places[i] = Place(
                    place.point, place.moments + np.outer(y, y), place.noise + n, place.stretches + 1
                )
                break
        else:
            places.append(Place(p, np.outer(y, y), n, 1.0))
        return replace(self, places=tuple(places), count=self.count + 1)

    def faded(self, share: float) -> "SteeringBelief":
        """The belief with what was seen counting only by a share in [0, 1], for objects that wear or change.

        Raises:
            InputError: for a share outside of [0, 1].
        """
        if not 0 <= share <= 1:
            raise InputError("a share is between 0 and 1", value=share)
        faded = tuple(
            Place(p.point, share * p.moments, share * p.noise, share * p.stretches) for p in self.places
        )
        return replace(self, places=faded if share > 0 else (), count=self.count if share > 0 else 0)

    def estimate(self) -> SteeringEstimate:
        """The most likely centre of friction and ρ, and how well they are known."""
        mean, covariance = self._solved
        return SteeringEstimate(mean[:2], float(mean[2] - mean[:2] @ mean[:2]), covariance)

    def better_than_prior(self, point: ArrayLike) -> bool:
        """Whether the heading of a contact's axle is known clearly better than it was before the first push."""
        if self.count == 0:
            return False
        before = replace(self, places=(), count=0).estimate()
        return self.estimate().axle(point).heading_sd < BETTER * before.axle(point).heading_sd

    @cached_property
    def _solved(self) -> tuple[Array, Array]:
        """Mean and covariance of (c_x, c_y, m)."""
        mean = self.before
        if not self.places:
            return mean, np.asarray(np.linalg.inv(self.information), dtype=float)
        moments = np.array([place.moments for place in self.places])
        noises = np.array([place.noise for place in self.places])
        counts = np.array([place.stretches for place in self.places])
        for _ in range(ROUNDS):
            full = np.array([*mean, 1.0])
            weights = counts / np.maximum(np.einsum("i,nij,j->n", full, noises, full), 1e-300)
            M, N = np.tensordot(weights, moments, 1), np.tensordot(weights, noises, 1)
            signal, share = _signal(M, N, float(np.sum(counts)))
            S = self.information + signal[:3, :3]
            mean = np.asarray(np.linalg.solve(S, self.information @ self.before - signal[:3, 3]), dtype=float)
        inverse = np.linalg.inv(S)
        # To first order the residuals scatter by the signal; the noise in y itself adds its own (errors in variables).
        return mean, np.asarray(inverse @ (S + share[:3, :3]) @ inverse, dtype=float)


class Place(NamedTuple):
    """What was seen at one contact; the weight of it depends on the estimate, so it is applied when that is asked for.

    Attributes:
        point: where it began, shape (2,).
        moments: Σ y yᵀ, shape (4, 4).
        noise: Σ Tᵀ Σ_Y T, shape (4, 4).
        stretches: how many of them that counts for.
    """

    point: Array
    moments: Array
    noise: Array
    stretches: float


def _map(p: Array) -> Array:
    """T with b(p) = T (c_x, c_y, m, 1), shape (3, 4)."""
    return np.array([[0.0, -1.0, 0.0, p[1]], [1.0, 0.0, 0.0, -p[0]], [-p[0], -p[1], 1.0, 0.0]])


def _rotation_about(p: Array) -> Array:
    """k, the twist of a rotation about a point."""
    return np.array([p[1], -p[0], 1.0])


def _signal(M: Array, N: Array, count: float) -> tuple[Array, Array]:
    """What of the moments M is signal, and the noise that was taken off it, both (4, 4).

    In the basis in which M is the identity and N diagonal (ν), a direction carries a signal 1 - ν if it stands out of
    the noise; b's own direction, in which there is nothing but noise (ν about 1), carries none.
    """
    scale = 1 / np.sqrt(np.maximum(np.diag(M), 1e-300))
    m, n = M * np.outer(scale, scale), N * np.outer(scale, scale)
    sizes, vectors = np.linalg.eigh(m)
    kept = sizes > FLAT * sizes[-1]  # at one contact y fills three dimensions of the four
    B = vectors[:, kept] / np.sqrt(sizes[kept])
    nu, U = np.linalg.eigh(B.T @ n @ B)
    stands_out = nu * (1 + STANDS_OUT * np.sqrt(2 / count)) < 1
    modes = (m @ B @ U) / scale[:, None]
    signal = (modes * np.where(stands_out, 1 - nu, 0.0)) @ modes.T
    return signal, (modes * np.where(stands_out, nu, 0.0)) @ modes.T


def sticking_displacement(
    point: ArrayLike, travel: ArrayLike, turn: float, angle_sd: float
) -> tuple[Array, Array]:
    """Y and its covariance for a stretch in which a finger of known motion stuck at a point.

    The contact point went along with the finger, so only the turn carries the camera's noise: an error of it turns
    the object about the contact.

    Args:
        point: the contact in the body frame, shape (2,) [m].
        travel: ∫ of the contact point's velocity in the body frame, shape (2,) [m].
        turn: of the object, as measured [rad].
        angle_sd: standard deviation of the turn's error [rad].
    """
    p, way = np.asarray(point, dtype=float), np.asarray(travel, dtype=float)
    k = _rotation_about(p)
    return np.array([*way, 0.0]) + turn * k, angle_sd**2 * np.outer(k, k)
