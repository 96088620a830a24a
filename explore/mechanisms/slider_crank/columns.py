"""Rows of the slider-crank's record and of its signals."""

from enum import IntEnum


class Row(IntEnum):
    """Rows of a tile of designs: constants, the first six for `fill`, status, parameters, metrics."""

    #: Rod minus or plus crank, minus or plus offset.
    MINUS_MINUS = 0
    MINUS_PLUS = 1
    PLUS_PLUS = 2
    PLUS_MINUS = 3
    MOVING_CRANK = 4
    MOVING_OFFSET = 5
    #: Half-tangents of the dead centres from the anchor, and of the distances of the singularities.
    OUTER = 6
    INNER = 7
    SINGULAR_ABOVE = 8
    SINGULAR_BELOW = 9
    NOISE = 10
    STATUS = 11
    CRANK = 12
    ROD = 13
    OFFSET = 14
    STROKE = 15
    TIME_RATIO = 16
    OUTER_ANGLE = 17
    INNER_ANGLE = 18
    PRESSURE_ANGLE_MAX = 19
    TRANSMISSION_ANGLE_MIN = 20
    TURNING_MARGIN = 21


#: Constants that `fill` reads.
FILL_SIZE = 6

# Rows of the signals, and the bits of `needs` that request them.
POSITION, VELOCITY, ACCELERATION, ROD_ANGLE, ROD_VELOCITY, ROD_ACCELERATION = range(6)
SIGNAL_ROWS = 6
SLIDER, SLIDER_ACCELERATION, ANGLE, ROD_RATES = 1, 2, 4, 8
