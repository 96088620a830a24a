"""The angle of a vector, without branches: loops over nodes that call it vectorise, unlike those that call `atan2`."""

import math

from explore.subroutines import subroutine

_TAN_EIGHTH = 0.41421356237309503  # tan(pi/8); the angle of a steeper vector is computed from pi/4
_QUARTER, _HALF = 0.25 * math.pi, 0.5 * math.pi
#: pi/4 minus its nearest double; twice and four times that are the errors of pi/2 and pi.
_QUARTER_PI_ERROR = 3.061616997868383e-17


@subroutine(inlined=True)
def arctangent(y, x):
    """Angle of the vector (x, y), rad, between -pi and pi; NaN for the null vector.

    S. L. Moshier's rational approximation (Cephes Math Library, atan.c, 1995), after the reduction to at most
    tan(pi/8) by the octant; two divisions. Within 2 units in the last place (``tests/test_arctangent.py``).
    """
    width, height = abs(x), abs(y)
    # max and min could return the other argument for a NaN
    longer, shorter = (width, height) if width > height else (height, width)
    is_steep = shorter > _TAN_EIGHTH * longer
    t = (shorter - longer if is_steep else shorter) / (shorter + longer if is_steep else longer)
    z = t * t
    numerator = (((-0.8750608600031904 * z - 16.157537187333652) * z - 75.00855792314705) * z - 122.88666844901361) * z
    denominator = (
        (((z + 24.858464901423062) * z + 165.02700983169885) * z + 432.88106049129027) * z + 485.3903996359137
    ) * z
    correction = t * (z * (numerator - 64.85021904942025) / (denominator + 194.5506571482614))
    octant_angle = (_QUARTER if is_steep else 0.0) + (t + (correction + (_QUARTER_PI_ERROR if is_steep else 0.0)))
    quadrant_angle = _HALF - (octant_angle - 2.0 * _QUARTER_PI_ERROR) if height > width else octant_angle
    half_turn_angle = math.pi - (quadrant_angle - 4.0 * _QUARTER_PI_ERROR) if x < 0.0 else quadrant_angle
    return -half_turn_angle if y < 0.0 else half_turn_angle
