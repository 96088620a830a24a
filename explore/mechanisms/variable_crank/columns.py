"""Rows of the variable crank's record and of its signals."""

from enum import IntEnum


class Row(IntEnum):
    """Rows of a tile of designs: constants for `fill`, marks, status, parameters, metrics."""

    #: The rod, the slider's travel per radian, the regular angle from the anchor, its sine and cosine, the slider's
    #: position there and its excess over the rod, the width of a reversal, rad.
    LENGTH = 0
    TRAVEL = 1
    REGULAR_OFFSET = 2
    REGULAR_SINE = 3
    REGULAR_COSINE = 4
    REGULAR_POSITION = 5
    REGULAR_EXCESS = 6
    WIDTH = 7
    ORDER = 8
    VELOCITY_SCALE = 9
    CRANK_SPEED = 10
    SLIDER_MASS = 11
    FRICTION_COEFFICIENT = 12
    FREE_FALL = 13
    #: Half-tangents of the marks from the anchor.
    OUTER = 14
    STEADY_START = 15
    STEADY_STOP = 16
    INNER = 17
    BACK_START = 18
    BACK_STOP = 19
    STATUS = 20
    ROD = 21
    SLIDER_SPEED = 22
    SPEED = 23
    REVERSAL_TIME = 24
    BLEND_ORDER = 25
    MASS = 26
    FRICTION = 27
    GRAVITY = 28
    STROKE = 29
    REGULAR_ANGLE = 30
    REGULAR_CRANK = 31
    CRANK_OUTER = 32
    CRANK_INNER = 33
    SLIDER_ACCELERATION_MAX = 34
    STEADY_SHARE = 35
    SPEED_SHARE_1 = 36
    SPEED_SHARE_2 = 37
    SPEED_SHARE_5 = 38


# Rows of the signals. Those of terms bound the rounding of the signals that are sums of them.
POSITION, VELOCITY, ACCELERATION, CRANK_LENGTH, CRANK_RATE, ROD_ANGLE, PRESSURE_ANGLE, CURVATURE = range(8)
THRUST, GUIDE_FORCE, GROOVE_FORCE, TORQUE, POWER, POSITIVE_POWER, FRICTION_POWER = range(8, 15)
ACCELERATION_TERMS, RATE_TERMS, PRESSURE_TERMS, CURVATURE_TERMS, FORCE_TERMS, TORQUE_TERMS, POWER_TERMS = range(15, 22)
SIGNAL_ROWS = 22

# Bits of `needs`: the slider alone, the crank's length with the rod, the groove, forces.
SLIDER, CRANK, GROOVE, FORCES = 1, 2, 4, 8

#: Laws between the breaks, in the order of the marks: those from the inner dead centre on are of the way back, and the
#: second of either way is that of a steady speed.
FIRST_LAW_BACK, STEADY_LAW = 3, 1
