"""Rows of the variable crank's record and of its signals."""

from enum import IntEnum, auto

from explore.model.points import MOST_POINTS, PLACES_SIZE, POINT_ROWS


class Row(IntEnum):
    """Rows of a tile of designs: constants for `fill`, marks, status, parameters, metrics."""

    #: The rod, the slider's travel per radian, the regular angle from 90 degrees, its sine and cosine, the slider's
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
    LOAD_ROD_MASS = auto()
    LOAD_ROD_CENTROID = auto()
    LOAD_ROD_INERTIA = auto()
    LOAD_PIN_MASS = auto()
    LOAD_DISC_MASS = auto()
    LOAD_DISC_CENTROID = auto()
    MIDDLE = auto()
    #: The first of the places of points.
    PLACES = 25
    #: Half-tangents of the marks from the anchor.
    OUTER = 25 + PLACES_SIZE
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
    ROD_MASS = auto()
    ROD_CENTROID = auto()
    ROD_INERTIA = auto()
    PIN_MASS = auto()
    DISC_MASS = auto()
    DISC_CENTROID = auto()
    POINT_1_ALONG = auto()
    POINT_1_ACROSS = auto()
    POINT_2_ALONG = auto()
    POINT_2_ACROSS = auto()
    POINT_3_ALONG = auto()
    POINT_3_ACROSS = auto()
    POINT_4_ALONG = auto()
    POINT_4_ACROSS = auto()
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
THRUST, GUIDE_FORCE, GROOVE_FORCE, SLOT_FORCE, CRANK_PIN, SLIDER_PIN, DISC_PIVOT = range(8, 15)
TORQUE, POWER, POSITIVE_POWER, FRICTION_POWER = range(15, 19)
#: Those of the forces in pins, and of them those that hold squares.
PIN_ROWS = (SLOT_FORCE, CRANK_PIN, SLIDER_PIN, DISC_PIVOT)
SQUARES = PIN_ROWS[1:]
ACCELERATION_TERMS, RATE_TERMS, PRESSURE_TERMS, CURVATURE_TERMS, FORCE_TERMS, TORQUE_TERMS, POWER_TERMS = range(19, 26)
#: What the masses of rod and pin add: the force that turns the rod, what presses the slider on its guide, with its
#: terms; forces on the rod, on rod and pin, with their terms, and in the groove; power, with its terms.
TURN, PRESSED, PRESSED_TERMS, ROD_X, ROD_Y, LINKS_X, LINKS_Y, LINKS_TERMS, LINKS_GROOVE = range(26, 35)
LINKS_POWER, LINKS_POWER_TERMS, DISC_TERMS = 35, 36, 37
#: Rows of the second derivative of the crank's length by time, and of the points.
CRANK_SECOND_RATE, FIRST_POINT = 38, 39
SIGNAL_ROWS = FIRST_POINT + MOST_POINTS * POINT_ROWS

# Bits of `needs`: the slider alone, the crank's length with the rod, the groove, forces, forces in pins, two for each
# point.
SLIDER, CRANK, GROOVE, FORCES, PINS, POINTS = 1, 2, 4, 8, 16, 32
ALL_POINTS = POINTS * (4**MOST_POINTS - 1)

#: Laws between the breaks, in the order of the marks: those from the inner dead centre on are of the way back, and the
#: second of either way is that of a steady speed.
FIRST_LAW_BACK, STEADY_LAW = 3, 1
