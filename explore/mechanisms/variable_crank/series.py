"""How far the crank is from the singular position, as a series: the two roots of the loop without cancellation.

With d = phi - phi* and X = X* - c d,

    l - X sin(phi) = d^2 G(d),    G = l (1 - cos d)/d^2 + c sin(phi*) (d cos d - sin d)/d^2 + c cos(phi*) sin(d)/d,

which has no zero: its root is smooth where that of the difference, as it stands, loses half of the digits.
"""

import math

from explore.base.subroutines import subroutine

# Coefficients of sin(d)/d and of (1 - cos d)/d^2 in powers of -d^2, the highest first: up to d = 3 the rest is below
# 1e-16 of the first.
_SINE = tuple(1.0 / math.factorial(2 * k + 1) for k in reversed(range(16)))
_COSINE = tuple(1.0 / math.factorial(2 * k + 2) for k in reversed(range(16)))


@subroutine(inlined=True)
def _term(p3, p2, p1, p, q2, q1, q, x, sine, cosine):
    """One more term of Horner's scheme for two polynomials and their derivatives, with these coefficients."""
    return p3 * x + p2, p2 * x + p1, p1 * x + p, p * x + sine, q2 * x + q1, q1 * x + q, q * x + cosine


@subroutine(inlined=True)
def separation(rod, along, across, d):
    """G and its first two derivatives; `along` is c cos(phi*), `across` is c sin(phi*)."""
    x = -d * d
    p, p1, p2, p3 = 0.0, 0.0, 0.0, 0.0
    q, q1, q2 = 0.0, 0.0, 0.0
    # Without a loop, because loops over lanes around a loop do not vectorise.
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[0], _COSINE[0])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[1], _COSINE[1])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[2], _COSINE[2])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[3], _COSINE[3])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[4], _COSINE[4])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[5], _COSINE[5])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[6], _COSINE[6])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[7], _COSINE[7])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[8], _COSINE[8])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[9], _COSINE[9])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[10], _COSINE[10])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[11], _COSINE[11])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[12], _COSINE[12])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[13], _COSINE[13])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[14], _COSINE[14])
    p3, p2, p1, p, q2, q1, q = _term(p3, p2, p1, p, q2, q1, q, x, _SINE[15], _COSINE[15])
    # p2, p3 and q2 are the second and third derivatives over 2 and 6; x' = -2 d.
    slope = -2.0 * d * p1
    second = -2.0 * p1 - 8.0 * x * p2
    third = 24.0 * d * p2 + 48.0 * d * x * p3
    value = rod * q + across * slope + along * p
    first = -2.0 * rod * d * q1 + across * second + along * slope
    return value, first, rod * (-2.0 * q1 - 8.0 * x * q2) + across * third + along * second
