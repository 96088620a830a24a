"""How far the crank is from the singular position, as a series: the two roots of the loop without cancellation.

With d = phi - phi* and X = X* - c d,

    l - X sin(phi) = d^2 G(d),    G = l (1 - cos d)/d^2 + c sin(phi*) (d cos d - sin d)/d^2 + c cos(phi*) sin(d)/d,

which has no zero: its root is smooth where that of the difference, as it stands, loses half of the digits.
"""

import math

from explore.subroutines import subroutine

#: Coefficients of sin(d)/d and of (1 - cos d)/d^2 in powers of -d^2, the highest first: up to d = 3 the rest is below
#: 1e-16 of the first.
_SINE = tuple(1.0 / math.factorial(2 * k + 1) for k in reversed(range(16)))
_COSINE = tuple(1.0 / math.factorial(2 * k + 2) for k in reversed(range(16)))


@subroutine(inlined=True)
def separation(rod, along, across, d):
    """G and its first two derivatives; `along` is c cos(phi*), `across` is c sin(phi*)."""
    x = -d * d
    p, p1, p2, p3 = 0.0, 0.0, 0.0, 0.0
    q, q1, q2 = 0.0, 0.0, 0.0
    for k in range(16):
        p3 = p3 * x + p2
        p2 = p2 * x + p1
        p1 = p1 * x + p
        p = p * x + _SINE[k]
        q2 = q2 * x + q1
        q1 = q1 * x + q
        q = q * x + _COSINE[k]
    # p2, p3 and q2 are the second and third derivatives over 2 and 6; x' = -2 d.
    slope = -2.0 * d * p1
    second = -2.0 * p1 - 8.0 * x * p2
    third = 24.0 * d * p2 + 48.0 * d * x * p3
    value = rod * q + across * slope + along * p
    first = -2.0 * rod * d * q1 + across * second + along * slope
    return value, first, rod * (-2.0 * q1 - 8.0 * x * q2) + across * third + along * second
