"""How far the crank is from the singular position, as a series: the two roots of the loop without cancellation.

With d = phi - phi* and X = X* - c d,

    l - X sin(phi) = d^2 G(d),    G = l (1 - cos d)/d^2 + c sin(phi*) (d cos d - sin d)/d^2 + c cos(phi*) sin(d)/d,

which has no zero: its root is smooth where that of the difference, as it stands, loses half of the digits. Stumpff's
functions c_k = sum of (-d^2)^j/(k + 2j)! are sin(d)/d for k = 1 and (1 - cos d)/d^2 for k = 2, and satisfy

    c_k = 1/k! - d^2 c_{k + 2},    dc_k/d(d^2) = (k c_{k + 2} - c_{k + 1})/2.
"""

import math

from explore.base.subroutines import subroutine

# Coefficients of c_6 and c_7 in powers of -d^2, the highest first: up to d = pi the rest is below 1e-17 of the first.
_SIXTH = tuple(1.0 / math.factorial(6 + 2 * j) for j in reversed(range(12)))
_SEVENTH = tuple(1.0 / math.factorial(7 + 2 * j) for j in reversed(range(12)))


@subroutine(inlined=True)
def _three_terms(c6, c7, x, k):
    """Three more terms of Horner's scheme for c_6 and c_7 in x = -d^2, from coefficient k on."""
    c6, c7 = c6 * x + _SIXTH[k], c7 * x + _SEVENTH[k]
    c6, c7 = c6 * x + _SIXTH[k + 1], c7 * x + _SEVENTH[k + 1]
    return c6 * x + _SIXTH[k + 2], c7 * x + _SEVENTH[k + 2]


@subroutine(inlined=True)
def separation(rod, along, across, d):
    """G and its first two derivatives; `along` is c cos(phi*), `across` is c sin(phi*)."""
    square = d * d
    # Without a loop, because loops over lanes around a loop do not vectorise.
    c6, c7 = _three_terms(0.0, 0.0, -square, 0)
    c6, c7 = _three_terms(c6, c7, -square, 3)
    c6, c7 = _three_terms(c6, c7, -square, 6)
    c6, c7 = _three_terms(c6, c7, -square, 9)
    c5, c4 = 1.0 / 120.0 - square * c7, 1.0 / 24.0 - square * c6
    c3, c2 = 1.0 / 6.0 - square * c5, 0.5 - square * c4
    c1 = 1.0 - square * c3
    # derivatives of c_1, and of c_2, by d
    bend = 3.0 * (c5 - c4) + c3
    slope, second = d * (c3 - c2), (c3 - c2) + square * bend
    third = d * (3.0 * bend + square * (15.0 * (c7 - c6) + (6.0 * c5 - c4)))
    incline = 2.0 * c4 - c3
    value = rod * c2 + across * slope + along * c1
    first = rod * d * incline + across * second + along * slope
    return value, first, rod * (incline + square * (8.0 * c6 - 5.0 * c5 + c4)) + across * third + along * second
