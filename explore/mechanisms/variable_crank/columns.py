"""Rows of the variable crank's record and of its signals."""

from enum import IntEnum, auto


class Row(IntEnum):
    """Rows of a tile of designs: constants for `fill`, marks, status, parameters, metrics."""

    #: The rod, the slider's travel per radian, the regular angle from the anchor, its sine and cosine, the slider's
    #: position there and its excess over the rod, the width of a reversal, rad.
    LENGTH = 0
    TRAVEL = auto()
    REGULAR_OFFSET = auto()
    REGULAR_SINE = auto()
    REGULAR_COSINE = auto()
    REGULAR_POSITION = auto()
    REGULAR_EXCESS = auto()
    WIDTH = auto()
    ORDER = auto()
    VELOCITY_SCALE = auto()
    CRANK_SPEED = auto()
    #: The load in the order of the parameters, and the slider's position at mid-stroke.
    LOAD_MASS = auto()
    LOAD_FRICTION = auto()
    LOAD_GRAVITY = auto()
    LOAD_CONSTANT_FORCE = auto()
    LOAD_OPPOSING_FORCE = auto()
    LOAD_STIFFNESS = auto()
    LOAD_DAMPING = auto()
    MIDDLE = auto()
    #: Half-tangents of the marks from the anchor.
    OUTER = auto()
    STEADY_START = auto()
    STEADY_STOP = auto()
    INNER = auto()
    BACK_START = auto()
    BACK_STOP = auto()
    STATUS = auto()
    ROD = auto()
    SLIDER_SPEED = auto()
    SPEED = auto()
    REVERSAL_TIME = auto()
    BLEND_ORDER = auto()
    MASS = auto()
    FRICTION = auto()
    GRAVITY = auto()
    CONSTANT_FORCE = auto()
    OPPOSING_FORCE = auto()
    STIFFNESS = auto()
    DAMPING = auto()
    STROKE = auto()
    REGULAR_ANGLE = auto()
    REGULAR_CRANK = auto()
    CRANK_OUTER = auto()
    CRANK_INNER = auto()
    SLIDER_ACCELERATION_MAX = auto()
    STEADY_SHARE = auto()
    SPEED_SHARE_1 = auto()
    SPEED_SHARE_2 = auto()
    SPEED_SHARE_5 = auto()


#: Constants of the load that are parameters.
LOAD_SIZE = Row.MIDDLE - Row.LOAD_MASS

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
