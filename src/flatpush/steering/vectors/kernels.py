"""Building blocks of loops that LLVM vectorises: selects instead of branches, angles without a library call."""

import math
from typing import Any

import numba as nb
import numpy as np
from numba.extending import intrinsic

from ...compiled import block

TURN = 2 * math.pi
SLACK = 2e-10  # an arc that falls short of zero by less than this is zero [rad]


@intrinsic
def _widest_vectors(typing: Any) -> Any:
    """Asks LLVM for 512-bit vectors where there are any; left alone it often prefers 256 bits."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(builder.function.attributes, set):
            set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return nb.void(), generate


@intrinsic
def _select(typing: Any, condition: Any, yes: Any, no: Any) -> Any:
    """yes if condition else no, both evaluated."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return nb.float64(nb.boolean, nb.float64, nb.float64), generate


@block
def _small(a: float, b: float) -> float:
    return _select(a < b, a, b)


@block
def _large(a: float, b: float) -> float:
    return _select(a > b, a, b)


@block
def _turned(tangent: float, x: float, y: float) -> float:
    """The angle of (x, y) in [0, 2π), given the tangent of half its angle to the nearest axis; nearly 2π is 0."""
    angle = 2.0 * _arctan(tangent)
    angle = _select(abs(y) > abs(x), 0.5 * math.pi - angle, angle)
    angle = _select(x < 0.0, math.pi - angle, angle)
    angle = _select(y < 0.0, TURN - angle, angle)
    return _select(angle > TURN - SLACK, 0.0, angle)


@block
def _arctan(r: float) -> float:
    """For -tan(π/8) to tan(π/8): Chebyshev interpolant of arctan(√q)/√q, error 7e-17."""
    q = r * r
    q2 = q * q
    q4 = q2 * q2
    a0 = (-0.33333333333328435 + q * 0.19999999998854434) + q2 * (
        -0.14285714180925005 + q * 0.11111106178547345
    )
    a1 = (-0.09090773034671443 + q * 0.07689952983789837) + q2 * (
        -0.06640229875349955 + q * 0.0568832979330602
    )
    a2 = -0.043480005258692 + q * 0.021134787499439724
    return r + r * (q * (a0 + q4 * (a1 + q4 * a2)))


@block
def _ratio(v: float) -> float:
    """arccos(u) / (2 √(1 - u²)) for u = v + 1/2 in [0, 1]: Chebyshev interpolant of 20 points, error 2e-16."""
    v2 = v * v
    v4 = v2 * v2
    v8 = v4 * v4
    a0 = (0.6045997880780725 - v * 0.26360014128128484) + v2 * (0.13946638410418252 - v * 0.07934858768997932)
    a1 = (0.04689303178690287 - v * 0.028366855369540537) + v2 * (
        0.0174327682243274 - v * 0.010835837048777015
    )
    a2 = (0.006793418257451521 - v * 0.004287769922502439) + v2 * (
        0.0027211509471287026 - v * 0.0017344464971302707
    )
    a3 = (0.0011075761022916412 - v * 0.0007107824360194774) + v2 * (
        0.00046888248617533626 - v * 0.0003025004906798706
    )
    a4 = (0.0001564208378702588 - v * 0.00010113684862478225) + v2 * (
        0.00013916874905365843 - v * 9.050764638240007e-05
    )
    return (a0 + v4 * a1) + v8 * ((a2 + v4 * a3) + v8 * a4)


@block
def _heading(angle: float) -> tuple[float, float, float]:
    """An angle in [0, 2π), its cosine and its sine: Chebyshev interpolants on a quarter either way, error 2e-16."""
    turned = angle - TURN * np.floor(angle * (1.0 / TURN))
    turned = _select((turned < 0.0) | (turned >= TURN), 0.0, turned)  # NaN stays
    r = 0.5 * math.pi - abs(turned - math.pi)
    q = r * r
    q2 = q * q
    q4 = q2 * q2
    s0 = (1.0 - q * 0.16666666666666666) + q2 * (0.008333333333333186 - q * 0.00019841269841208676)
    s1 = (2.7557319211229593e-06 - q * 2.5052106890568332e-08) + q2 * (
        1.6058940878425258e-10 - q * 7.643026556333697e-13
    )
    c0 = (1.0 - q * 0.4999999999999997) + q2 * (0.04166666666666388 - q * 0.001388888888877299)
    c1 = (2.48015872774149e-05 - q * 2.75573163910235e-07) + q2 * (
        2.0876561839817064e-09 - q * 1.1462901898655284e-11
    )
    sine = r * (s0 + q4 * (s1 + q4 * 2.7215749245979445e-15))
    cosine = c0 + q4 * (c1 + q4 * 4.608976969480383e-14)
    return turned, -sine, _select(turned < math.pi, cosine, -cosine)
