"""What planning needs of a fitted table: turning radii of pushes, with what the data leave open about them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..contact import PointContact
from ..friction import Exact
from ..geometry import OutlinePoint
from ..geometry.pose import Array
from ..problem import Object
from .fit import MotionFit

_STEP = 0.05  # of a number, by its standard deviation: radii bend where a foot comes under a turning centre
# Families that explain the motion nearly as well count with what they say, down to this weight.
_LEAST_WEIGHT = 0.01


@dataclass(frozen=True, eq=False)
class Radius:
    """The turning radius of one finger's push at a place.

    Attributes:
        value: half the distance between the turning centres [m]; nan where the finger cannot turn the object both ways.
        sd: its standard deviation [m], over the numbers of the fit and over families that explain the motion as well.
    """

    value: float
    sd: float


def turning_radius(thing: Object, at: OutlinePoint) -> float:
    """Half the distance between the turning centres of one finger at a point [m]; nan where it turns only one way."""
    contact = PointContact(at.point - thing.cof, at.normal, thing.friction, hook=True)
    surface = Exact(thing.support.centred())
    left, right = (surface.twist(contact.wrench(force)) for force in contact.force_edges())
    if not left[2] * right[2] < 0:
        return float("nan")
    apart = [np.array([-V[1], V[0]]) / V[2] for V in (left, right)]
    return float(0.5 * np.hypot(*(apart[0] - apart[1])))


def radii(fit: MotionFit, places: Sequence[OutlinePoint]) -> tuple[Radius, ...]:
    """The radii of pushes under a fit."""
    weighed = [(1.0, fit)] + [
        (w, other)
        for other in fit.others
        if (w := np.exp(0.5 * (fit.evidence - other.evidence))) > _LEAST_WEIGHT
    ]
    total = sum(w for w, _ in weighed)
    best = np.array([turning_radius(fit.thing, at) for at in places])
    variance = np.zeros(len(places))
    for w, one in weighed:
        values = np.array([turning_radius(one.thing, at) for at in places])
        G = slopes(one, places)
        own = np.einsum("ip,pq,iq->i", G, one.covariance, G)
        variance += w / total * (own + np.nan_to_num(values - best) ** 2)
    return tuple(Radius(float(r), float(np.sqrt(v))) for r, v in zip(best, variance, strict=True))


def slopes(fit: MotionFit, places: Sequence[OutlinePoint]) -> Array:
    """Derivatives of the radii by the numbers of a fit and log μ, (n, p + 1); 0 where a push cannot turn both ways."""
    found = np.zeros((len(places), len(fit.covariance)))
    for k, sd in enumerate(np.sqrt(np.diag(fit.covariance))):
        step = np.zeros(len(fit.covariance))
        step[k] = _STEP * sd
        ahead, behind = (
            np.array([turning_radius(fit.at(s * step), at) for at in places]) for s in (1.0, -1.0)
        )
        found[:, k] = np.nan_to_num((ahead - behind) / (2 * step[k]))
    return found
