"""What motion told of a table, number by number, each with its uncertainty; and what it did not tell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.pose import Array
from ..problem import Object
from .fit import SD_FRICTION, MotionFit
from .pressure import KnownFeet
from .radii import Radius

# A number is unknown while its standard deviation is above this part of what it was without data.
UNKNOWN = 0.5
# A turning radius whose standard deviation is above this part of it is not known well enough to plan with.
VAGUE = 0.1
# So few or such short pushes fit at noise level while radii are far off, whatever the uncertainties say [m].
FEW_PUSHES, SHORT_PUSH = 5, 0.06
# Ends that scatter so many times as much as noise explains are not those of the scene's object: where all is as the
# scene says it is 1.0 to 1.1 times, with an outline that is a tenth too large 4.5, with a mirrored picture 14.
UNEXPLAINED = 3.0


@dataclass(frozen=True, eq=False)
class Summary:
    """Values and standard deviations, in SI.

    Attributes:
        centre, centre_sd: centre of friction in O (2,). rho, rho_sd: ρ of a small turn, the mean over all directions of
            pushing [m²]. friction, friction_sd: of the finger. shares, shares_sd: of the loads on known feet, else
            empty. slid: whether the finger slid enough to tell its friction; else that is a lower bound.
        untold: what the motion does not tell, in words.
    """

    centre: Array
    centre_sd: Array
    rho: float
    rho_sd: float
    friction: float
    friction_sd: float
    shares: Array
    shares_sd: Array
    slid: bool
    untold: tuple[str, ...]


def summarise(fit: MotionFit, names: Sequence[str], radii: Sequence[Radius]) -> Summary:
    """The summary of a fit; names and radii of the pushes that matter."""
    centre, centre_sd = _with_sd(fit, lambda thing: thing.cof)
    rho, rho_sd = _with_sd(fit, lambda thing: np.array([0.5 * np.trace(thing.support.covariance)]))
    slid = bool(np.sqrt(fit.covariance[-1, -1]) < UNKNOWN * SD_FRICTION)
    untold = list(fit.seen.notes)
    shares, sd = np.empty(0), np.empty(0)
    if isinstance(fit.pressure, KnownFeet):
        spread = fit.pressure.at(fit.numbers)
        shares = spread.loads
        sd = np.sqrt(np.einsum("kp,pq,kq->k", spread.by_loads, fit.covariance[:-1, :-1], spread.by_loads))
        before = np.sqrt(
            np.einsum("kp,p,kp->k", spread.by_loads, 1 / fit.pressure.precision, spread.by_loads)
        )
        open_ = [str(k + 1) for k in np.flatnonzero(sd > UNKNOWN * before)]
        if open_:
            untold.append(f"the load on foot {', '.join(open_)}: kept near the scene's")
    if not slid:
        few = "it slid too little to tell more than a lower bound; kept at that or the scene's"
        untold.append(f"the finger's friction: {few}")
    for name, radius in zip(names, radii, strict=True):
        if np.isfinite(radius.value) and radius.sd > VAGUE * radius.value:
            untold.append(
                f"the turning radius of {name}: {1000 * radius.value:.1f} ± {1000 * radius.sd:.1f} mm"
            )
    if fit.scatter > UNEXPLAINED:
        untold.append(
            f"why the ends scatter {fit.scatter:.0f} times as much as noise explains, so that nothing above is sure: a"
            " mirrored image, an outline, tag, fingertip or feet other than the scene's, or friction that changes from"
            " place to place"
        )
    pushes, ways = len(np.unique(fit.seen.stretches.push)), fit.seen.longest
    if pushes < FEW_PUSHES or ways < SHORT_PUSH:
        untold.append(
            f"whether the radii are right: {pushes} push{'es' * (pushes > 1)} with up to {1000 * ways:.0f} mm of way in"
            f" use fit at noise level while radii may be far off; take {FEW_PUSHES} or more of"
            f" {1000 * SHORT_PUSH:.0f} mm or more"
        )
    return Summary(
        centre,
        centre_sd,
        float(rho[0]),
        float(rho_sd[0]),
        fit.thing.friction,
        fit.friction_sd,
        shares,
        sd,
        slid,
        tuple(untold),
    )


def _with_sd(fit: MotionFit, of: Callable[[Object], Array]) -> tuple[Array, Array]:
    """A value of the object and its standard deviations, by the slopes over the numbers."""
    value = of(fit.thing)
    slopes = np.zeros((len(value), len(fit.covariance)))
    for k, sd in enumerate(np.sqrt(np.diag(fit.covariance))):
        step = np.zeros(len(fit.covariance))
        step[k] = 0.05 * sd
        slopes[:, k] = (of(fit.at(step)) - of(fit.at(-step))) / (0.1 * sd)
    return value, np.sqrt(np.einsum("ip,pq,iq->i", slopes, fit.covariance, slopes))
