"""Functions of the expressions of a table: of angles in degrees, exact at multiples of 90 deg."""

import math

from explore.base.subroutines import subroutine

_RADIANS = math.pi / 180.0


@subroutine()
def sine_of_degrees(x):
    """The sine of an angle, deg."""
    rest = x - 360.0 * math.floor(x / 360.0 + 0.5)
    if rest == 180.0 or rest == -180.0 or rest == 0.0:
        return 0.0
    if rest == 90.0:
        return 1.0
    if rest == -90.0:
        return -1.0
    return math.sin(rest * _RADIANS)


@subroutine()
def cosine_of_degrees(x):
    """The cosine of an angle, deg."""
    rest = x - 360.0 * math.floor(x / 360.0 + 0.5)
    return 0.0 if rest == 90.0 or rest == -90.0 else math.cos(rest * _RADIANS)


@subroutine()
def tangent_of_degrees(x):
    """The tangent of an angle, deg."""
    return sine_of_degrees(x) / cosine_of_degrees(x)


@subroutine()
def degrees_of(y, x):
    """The angle of the vector (x, y), deg."""
    return math.atan2(y, x) * (1.0 / _RADIANS)
