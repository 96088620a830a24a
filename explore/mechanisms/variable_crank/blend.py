"""The slider's law: constant speed, and smooth reversals about the dead centres.

Over a reversal of width D the speed is V (1 - 2 S(z)), where S is the smoothstep of order 1, 2 or 3 and z falls from
1/2 at the dead centre to 0 where the speed is reached::

    S1 = 3 z^2 - 2 z^3,    S2 = 10 z^3 - 15 z^4 + 6 z^5,    S3 = 35 z^4 - 84 z^5 + 70 z^6 - 20 z^7

The slider lags behind one of constant speed by V/w D Q(z), with Q the integral of 2 S.
"""

import math

from explore.base.subroutines import subroutine

# Of each order: the largest slope of the speed, Q(1/2), and the places where S is half of 1, 2 and 5 %.
_SLOPES = (3.0, 3.75, 4.375)
_LAGS = (0.1875, 0.15625, 0.13671875)
_PLACES = (
    (0.041400150716043125, 0.058903135778195254, 0.094299324050246077),
    (0.082829187201476797, 0.10563984355077435, 0.14663279963467312),
    (0.11770375166895195, 0.14227037700685726, 0.18405156764008301),
)


@subroutine(inlined=True)
def _by_order(order, first, second, third):
    """One of three numbers."""
    return third if order == 3.0 else second if order == 2.0 else first


@subroutine(inlined=True)
def slope_of(order):
    """The largest slope of the speed over a reversal, times width over speed."""
    return _by_order(order, _SLOPES[0], _SLOPES[1], _SLOPES[2])


@subroutine(inlined=True)
def lag_of(order):
    """Q at a dead centre."""
    return _by_order(order, _LAGS[0], _LAGS[1], _LAGS[2])


@subroutine(inlined=True)
def blend(order, z):
    """Q, twice S, and the slope of twice S, at z from 0 to 1/2."""
    square = z * z
    fourth = square * square
    q1, s1, d1 = square * z * (2.0 - z), square * (6.0 - 4.0 * z), 12.0 * z * (1.0 - z)
    q2 = fourth * (5.0 + z * (-6.0 + 2.0 * z))
    s2 = square * z * (20.0 + z * (-30.0 + 12.0 * z))
    d2 = 60.0 * square * (1.0 - z) * (1.0 - z)
    q3 = fourth * z * (14.0 + z * (-28.0 + z * (20.0 - 5.0 * z)))
    s3 = fourth * (70.0 + z * (-168.0 + z * (140.0 - 40.0 * z)))
    d3 = 280.0 * square * z * (1.0 - z) * (1.0 - z) * (1.0 - z)
    return _by_order(order, q1, q2, q3), _by_order(order, s1, s2, s3), _by_order(order, d1, d2, d3)


@subroutine(inlined=True)
def shares(order, width):
    """Shares of the turn with a speed within 1, 2 and 5 % of the wanted one; `width` in rad."""
    reversal = width / math.pi
    one = _by_order(order, _PLACES[0][0], _PLACES[1][0], _PLACES[2][0])
    two = _by_order(order, _PLACES[0][1], _PLACES[1][1], _PLACES[2][1])
    five = _by_order(order, _PLACES[0][2], _PLACES[1][2], _PLACES[2][2])
    return 1.0 - reversal * (1.0 - 2.0 * one), 1.0 - reversal * (1.0 - 2.0 * two), 1.0 - reversal * (1.0 - 2.0 * five)
