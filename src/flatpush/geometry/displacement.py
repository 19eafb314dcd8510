"""The displacement of a pose by a body twist on plain numbers; pose.exp says the same of arrays."""

import math

from ..formulas import formula


@formula
def displaced(
    qx: float, qy: float, qt: float, a: float, b: float, w: float, s: float
) -> tuple[float, float, float]:
    """A pose moved by s times a body twist for unit time: X · exp(s V)."""
    a, b, w = s * a, s * b, s * w
    if abs(w) > 1e-4:  # below it the next term of the series is less than rounding
        sine, versine = math.sin(w) / w, (1 - math.cos(w)) / w
    else:
        sine, versine = 1 - w * w / 6, w / 2 - w * w * w / 24
    x, y = sine * a - versine * b, versine * a + sine * b
    c, d = math.cos(qt), math.sin(qt)
    return qx + c * x - d * y, qy + d * x + c * y, qt + w
