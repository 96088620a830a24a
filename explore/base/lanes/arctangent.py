"""The angle of a vector, without branches: loops over nodes that call it vectorise, unlike those that call `atan2`."""

import math

from explore.base.subroutines import subroutine

_TAN_EIGHTH = 0.41421356237309503  # tan(pi/8); the angle of a steeper vector is computed from pi/4
_QUARTER, _HALF = 0.25 * math.pi, 0.5 * math.pi
#: Error of the double nearest to pi/4; the errors for pi/2 and pi are two and four times this.
_QUARTER_PI_ERROR = 3.061616997868383e-17


@subroutine(contract=True, inlined=True)
def _excess(z):
    """(arctan(t)/t - 1)/z for z = t^2 up to tan^2(pi/8).

    The polynomial through Chebyshev's nodes of order 11, in Estrin's scheme; z times its error is below 7e-18.
    """
    z2 = z * z
    z4 = z2 * z2
    low = (-0.3333333333333333 + 0.1999999999999552 * z) + z2 * (-0.14285714284666542 + 0.11111111015256361 * z)
    middle = (-0.09090904578123901 + 0.07692183190826087 * z) + z2 * (-0.06664511447381939 + 0.058581489128021295 * z)
    high = (-0.05085449737939841 + 0.03923165829557509 * z) + z2 * -0.019176887119047435
    return low + z4 * (middle + z4 * high)


@subroutine(contract=True, inlined=True)
def arctangent(y, x):
    """Angle of the vector (x, y), rad, between -pi and pi; NaN for the null vector.

    A polynomial after the reduction to at most tan(pi/8) by the octant; one division. Within 2 units in the last place
    (``tests/test_elementary.py``).
    """
    width, height = abs(x), abs(y)
    # max and min could return the other argument for a NaN
    longer, shorter = (width, height) if width > height else (height, width)
    is_steep = shorter > _TAN_EIGHTH * longer
    t = (shorter - longer if is_steep else shorter) / (shorter + longer if is_steep else longer)
    z = t * t
    correction = t * (z * _excess(z))
    octant_angle = (_QUARTER if is_steep else 0.0) + (t + (correction + (_QUARTER_PI_ERROR if is_steep else 0.0)))
    quadrant_angle = _HALF - (octant_angle - 2.0 * _QUARTER_PI_ERROR) if height > width else octant_angle
    half_turn_angle = math.pi - (quadrant_angle - 4.0 * _QUARTER_PI_ERROR) if x < 0.0 else quadrant_angle
    return -half_turn_angle if y < 0.0 else half_turn_angle
