"""What is known of the steering of every push of one object, and how one push teaches the others."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ...geometry.pose import Array
from ...planning.options import PushOption
from ...problem import Scene
from ..learning.belief import SD_COF, SD_RHO, SteeringBelief, SteeringEstimate
from .turning import Turning, axle_of, turning_of

# What was learned is used once it knows the heading of the axle so much better than the prior.
BETTER = 0.9


@dataclass(frozen=True, eq=False)
class Steering:
    """Of one push; build with steering_of.

    Attributes:
        cof, rho: centre of friction in O and ρ [m²], as far as is known now: the prior, or what was learned.
        turning: of its limit surface, at the place where it lands.
        point: the contact where it lands. belief: what its own motions tell. prior: what was believed before them.
    """

    cof: Array
    rho: float
    turning: Turning
    point: Array
    belief: SteeringBelief
    prior: SteeringEstimate

    def observed(self, point: ArrayLike, displacement: ArrayLike, covariance: ArrayLike) -> "Steering":
        """With a stretch of sticking; see SteeringBelief.observed."""
        return replace(self, belief=self.belief.observed(point, displacement, covariance))


def steering_of(scene: Scene, option: PushOption) -> Steering:
    """The prior of a push."""
    car, place = option.car, option.placement
    assert car is not None
    assert place is not None
    rho = axle_of(car)
    prior = SteeringBelief.prior(car.cof, rho, SD_COF * scene.object.outline.size, SD_RHO * rho)
    return Steering(car.cof, rho, turning_of(car, rho), place.points[0], prior, prior.estimate())


def shared(pushes: Sequence[Steering], only: int | None = None) -> tuple[Steering, ...]:
    """The same pushes, each knowing what all have seen: they have one centre of friction, and each a ρ of its own.

    Args:
        only: the push that is told; the others stay as they are. Default: all.
    """
    gains, pulls = [], []
    for push in pushes:
        if push.belief.count == 0:
            gains.append(np.zeros((2, 2)))
            pulls.append(np.zeros(2))
            continue
        before, after = push.prior, push.belief.estimate()
        less, more = (np.linalg.inv(e.covariance[:2, :2]) for e in (before, after))
        gains.append(more - less)
        pulls.append(more @ after.cof - less @ before.cof)
    known = []
    for k, push in enumerate(pushes):
        if only is not None and k != only:
            known.append(push)
            continue
        belief = push.belief
        information, pull = belief.information.copy(), belief.information @ belief.before
        for j in range(len(pushes)):
            if j != k:
                information[:2, :2] += gains[j]
                pull[:2] += pulls[j]
        told = replace(
            belief,
            information=information,
            before=np.asarray(np.linalg.solve(information, pull), dtype=float),
        )
        estimate, prior = told.estimate(), push.prior
        better = estimate.axle(push.point).heading_sd < BETTER * prior.axle(push.point).heading_sd
        known.append(
            replace(push, cof=estimate.cof, rho=estimate.rho)
            if better and estimate.believable(prior)
            else replace(push, cof=prior.cof, rho=prior.rho)
        )
    return tuple(known)
