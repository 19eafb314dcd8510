"""Which pushes would teach most: those that reduce the uncertainty of the turning radii most."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry import OutlinePoint, rotate
from ..geometry.pose import Array
from ..simulation.plant import Plant
from .fit import MotionFit, information
from .motion import PLACES, STRETCH, Stretches, touching
from .radii import slopes, turning_radius

# Directions of the finger to the inward normal [rad], and the place along an edge, that are tried.
DIRECTIONS = np.deg2rad([-30.0, 0.0, 30.0])
ALONG = (0.2, 0.5, 0.8)
MOST_PLACES = 24
# A short stretch of smoothed poses has about this part of one frame's variance.
_SMOOTHED_VARIANCE = 0.2


@dataclass(frozen=True, eq=False)
class Suggestion:
    """A push to make next.

    Attributes:
        at: where the finger touches. direction: of the finger in O, to the left of the inward normal [rad].
        length: [m].
        uncertainty: root mean square of the radii's relative standard deviations after it and those before it.
    """

    at: OutlinePoint
    direction: float
    length: float
    uncertainty: float


def suggest(
    fit: MotionFit, places: Sequence[OutlinePoint], tip_radius: float, *, count: int = 3, length: float = 0.1
) -> tuple[Suggestion, ...]:
    """The next pushes, one after the other the one that leaves least uncertain.

    Args:
        fit: what is known until now. places: whose turning radii matter.
        tip_radius: of the finger [m]. count: how many pushes are suggested. length: of each [m].
    """
    thing = fit.thing
    values = np.array([turning_radius(thing, at) for at in places])
    kept = np.isfinite(values)
    G = slopes(fit, places)[kept] / values[kept, None]
    known = np.linalg.inv(fit.covariance)
    outline = thing.outline
    edges = range(1) if outline.is_circle else range(len(outline.vertices))
    tried = [outline.at(edge, along) for edge in edges for along in ALONG]
    if outline.is_circle:
        tried = [outline.at(0, k / 12) for k in range(12)]
    tried = tried[:: max(1, len(tried) // MOST_PLACES)]
    options = []
    for at in tried:
        for direction in DIRECTIONS:
            teaches = _information(fit, at, float(direction), length, tip_radius)
            if teaches is not None:
                options.append((at, float(direction), teaches))
    found: list[Suggestion] = []
    for _ in range(min(count, len(options))):
        left = [_left(known + teaches, G) for _, _, teaches in options]
        k = int(np.argmin(left))
        at, direction, teaches = options[k]
        known = known + teaches
        found.append(Suggestion(at, direction, length, float(left[k])))
    return tuple(found)


def _left(known: Array, G: Array) -> float:
    covariance = np.linalg.inv(known)
    return float(np.sqrt(np.mean(np.einsum("ip,pq,iq->i", G, covariance, G)))) if len(G) else 0.0


def _information(
    fit: MotionFit, at: OutlinePoint, direction: float, length: float, tip_radius: float
) -> Array | None:
    """What a push would tell of the numbers, (p + 1, p + 1); None where the finger does not fit there."""
    thing = fit.thing
    begin = at.point - tip_radius * at.normal
    if thing.outline.nearest(begin).distance < tip_radius - 1e-6:
        return None
    way = np.linspace(0.0, length, round(length / STRETCH) * (PLACES - 1) + 1)
    tips = begin + np.outer(way, rotate(direction, at.normal))
    plant = Plant(thing, [[0.0, 0.0]], tip_radius)
    run = plant.follow(np.zeros(3), np.column_stack([tips, np.zeros(len(tips))]))
    starts, ends, ways = [], [], []
    for a in range(0, len(way) - PLACES + 1, PLACES - 1):
        b = a + PLACES - 1
        gap, corner = touching(thing.outline, run.object[b], tips[b], tip_radius)[2:]
        if corner or abs(gap) > 1e-6 or run.outcome:
            break
        starts.append(run.object[a])
        ends.append(run.object[b])
        ways.append(tips[a : b + 1])
    if not starts:
        return None
    variance = np.full((len(starts), 2), _SMOOTHED_VARIANCE)
    stretches = Stretches(
        np.array(starts), np.array(ends), variance, np.array(ways), np.zeros(len(starts), dtype=int)
    )
    return information(fit, stretches, tip_radius)
