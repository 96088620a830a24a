"""The angle of a vector without branches, so that a loop over nodes vectorises; the C library's takes one at a time."""

import math

from explore.compiling import compiled

_TAN_EIGHTH = 0.41421356237309503  # of pi/8: beyond it the angle is taken from pi/4
_QUARTER, _HALF = 0.25 * math.pi, 0.5 * math.pi
#: What the double nearest to pi/4 lacks; twice that is what pi/2 and four times what pi lacks.
_LACKS = 3.061616997868383e-17


@compiled("float64(float64, float64)")
def arctangent(y, x):
    """Angle of the vector (x, y), rad, between -pi and pi; NaN for the null vector.

    S. L. Moshier's rational approximation (Cephes Math Library, atan.c, 1995), after the reduction to at most
    tan(pi/8) by the octant; two divisions. Within 2 units in the last place (``tests/test_arctangent.py``).
    """
    wide, high = abs(x), abs(y)
    # not max and min, which would take the number beside a NaN
    longer, shorter = (wide, high) if wide > high else (high, wide)
    beyond = shorter > _TAN_EIGHTH * longer
    t = (shorter - longer if beyond else shorter) / (shorter + longer if beyond else longer)
    z = t * t
    above = (((-0.8750608600031904 * z - 16.157537187333652) * z - 75.00855792314705) * z - 122.88666844901361) * z
    below = ((((z + 24.858464901423062) * z + 165.02700983169885) * z + 432.88106049129027) * z + 485.3903996359137) * z
    part = t * (z * (above - 64.85021904942025) / (below + 194.5506571482614))
    octant = (_QUARTER if beyond else 0.0) + (t + (part + (_LACKS if beyond else 0.0)))
    quadrant = _HALF - (octant - 2.0 * _LACKS) if high > wide else octant
    half = math.pi - (quadrant - 4.0 * _LACKS) if x < 0.0 else quadrant
    return -half if y < 0.0 else half
