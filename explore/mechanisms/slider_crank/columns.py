"""Rows of the slider-crank's record and of its signals."""

from enum import IntEnum, auto

from explore.model.points import MOST_POINTS, PLACES_SIZE, POINT_ROWS


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


class ExtendedRow(IntEnum):
    """Rows of the extended kernel: the constants of `Row`, those of the load, status, parameters, metrics."""

    MINUS_MINUS = 0
    MINUS_PLUS = auto()
    PLUS_PLUS = auto()
    PLUS_MINUS = auto()
    MOVING_CRANK = auto()
    MOVING_OFFSET = auto()
    OUTER = auto()
    INNER = auto()
    SINGULAR_ABOVE = auto()
    SINGULAR_BELOW = auto()
    NOISE = auto()
    #: The load in the order of the parameters, and the position at mid-stroke.
    LOAD_CONSTANT_FORCE = auto()
    LOAD_OPPOSING_FORCE = auto()
    LOAD_STIFFNESS = auto()
    LOAD_DAMPING = auto()
    LOAD_MASS = auto()
    LOAD_FRICTION = auto()
    LOAD_GRAVITY = auto()
    LOAD_CRANK_MASS = auto()
    LOAD_CRANK_CENTROID = auto()
    LOAD_ROD_MASS = auto()
    LOAD_ROD_CENTROID = auto()
    LOAD_ROD_INERTIA = auto()
    LOAD_SPEED = auto()
    MIDDLE = auto()
    #: The first of the places of points.
    PLACES = 25
    STATUS = 25 + PLACES_SIZE
    CRANK = auto()
    ROD = auto()
    OFFSET = auto()
    CONSTANT_FORCE = auto()
    OPPOSING_FORCE = auto()
    STIFFNESS = auto()
    DAMPING = auto()
    MASS = auto()
    FRICTION = auto()
    GRAVITY = auto()
    CRANK_MASS = auto()
    CRANK_CENTROID = auto()
    ROD_MASS = auto()
    ROD_CENTROID = auto()
    ROD_INERTIA = auto()
    SPEED = auto()
    POINT_1_ALONG = auto()
    POINT_1_ACROSS = auto()
    POINT_2_ALONG = auto()
    POINT_2_ACROSS = auto()
    POINT_3_ALONG = auto()
    POINT_3_ACROSS = auto()
    POINT_4_ALONG = auto()
    POINT_4_ACROSS = auto()
    STROKE = auto()
    TIME_RATIO = auto()
    OUTER_ANGLE = auto()
    INNER_ANGLE = auto()
    PRESSURE_ANGLE_MAX = auto()
    TRANSMISSION_ANGLE_MIN = auto()
    TURNING_MARGIN = auto()


#: Constants of the load that are parameters.
LOAD_SIZE = ExtendedRow.MIDDLE - ExtendedRow.LOAD_CONSTANT_FORCE

# Rows of the extended kernel's signals after those of the motion, and the bits of `needs` beside those of the motion.
# The rows of pins hold squares; those of terms the size of the terms that add up to forces and to torques.
THRUST, GUIDE_FORCE, CRANK_PIVOT, CRANK_PIN, SLIDER_PIN, FORCE_TERMS = range(SIGNAL_ROWS, SIGNAL_ROWS + 6)
TORQUE, POSITIVE_TORQUE, LOST_TORQUE, TORQUE_TERMS = range(SIGNAL_ROWS + 6, SIGNAL_ROWS + 10)
FIRST_POINT = SIGNAL_ROWS + 10
EXTENDED_SIGNAL_ROWS = FIRST_POINT + MOST_POINTS * POINT_ROWS
FORCES, POINTS = 16, 32

#: Number of the law that holds from the outer to the inner dead centre.
INWARD = 0
