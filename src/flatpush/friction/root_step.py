"""A step towards the rotation about a held point at which friction does no work, on plain numbers."""

import math

from ..formulas import formula


@formula
def root_step(
    w: float, slope: float, bend: float, low: float, high: float, before: float, arm: float
) -> tuple[float, bool]:
    """Newton's step for the root of a slope that rises with ω, kept within a bracket; halving where it is slow.

    Args:
        w: where the slope was taken [rad per length]. slope, bend: there, the derivative of the dissipation by ω and
            the derivative of that. low, high: between which the root lies, infinite where none is known.
        before: size of the slope before the last step. arm: distance of the point, of one at unit distance at least.

    Returns:
        What to add to ω, and whether it then is the root.
    """
    size = abs(w) + 1 / arm
    reach = 4 * size
    if bend > 0:
        step = min(max(-slope / bend, -reach), reach)
    else:
        step = -reach if slope > 0 else reach
    bracketed = low > -math.inf and high < math.inf
    if bracketed and (not low < w + step < high or abs(slope) > before / 2):
        step = (low + high) / 2 - w
    elif abs(slope) <= 1e-8 * arm and abs(step) <= 1e-8 * size:
        return step, True  # Newton has converged: the error of this step is of second order
    if w + step == w or (bracketed and high - low <= 1e-16 * size):
        return 0.0, True
    return step, False
