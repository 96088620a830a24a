"""Rows of the variable crank's record and of its signals."""

from explore.model.points import MOST_POINTS, PLACE_ROWS, POINT_ROWS, SLOT_ROWS, record_rows

# Constants: the rod, the slider's travel per radian, the regular angle from 90 degrees, its sine and cosine, the
# slider's position there and its excess over the rod, the width of a reversal, rad.
_CONSTANTS = (
    "LENGTH", "TRAVEL", "REGULAR_OFFSET", "REGULAR_SINE", "REGULAR_COSINE", "REGULAR_POSITION", "REGULAR_EXCESS",
    "WIDTH", "ORDER", "CRANK_SPEED",
)  # fmt: skip
# Constants that are half-tangents of the marks from the anchor.
_MARKS = ("OUTER", "STEADY_START", "STEADY_STOP", "INNER", "BACK_START", "BACK_STOP")
_PARAMETERS = ("ROD", "SLIDER_SPEED", "SPEED", "REVERSAL_TIME", "BLEND_ORDER")
# Parameters of the load, in the order of the declaration.
_LOADS = (
    "MASS", "FRICTION", "GRAVITY", "CONSTANT_FORCE", "OPPOSING_FORCE", "STIFFNESS", "DAMPING", "ROD_MASS",
    "ROD_CENTROID", "ROD_INERTIA", "PIN_MASS", "DISC_MASS", "DISC_CENTROID",
)  # fmt: skip
_METRICS = (
    "STROKE", "REGULAR_ANGLE", "REGULAR_CRANK", "CRANK_OUTER", "CRANK_INNER", "SLIDER_ACCELERATION_MAX",
    "STEADY_SHARE", "SPEED_SHARE_1", "SPEED_SHARE_2", "SPEED_SHARE_5",
)  # fmt: skip
#: Rows of a tile of designs; the row MIDDLE is the slider's position at mid-stroke.
Row = record_rows(
    "Row",
    (
        *_CONSTANTS, *(f"LOAD_{load}" for load in _LOADS), "MIDDLE", *PLACE_ROWS, *_MARKS, "STATUS", *_PARAMETERS,
        *_LOADS, *SLOT_ROWS, *_METRICS,
    ),
    0,
    __name__,
)  # fmt: skip

#: Number of the parameters of the load.
LOAD_SIZE = len(_LOADS)

# Rows of the signals. Those of terms bound the rounding of the signals that are sums of them.
POSITION, VELOCITY, ACCELERATION, CRANK_LENGTH, CRANK_RATE, ROD_ANGLE, PRESSURE_ANGLE, CURVATURE = range(8)
THRUST, GUIDE_FORCE, GROOVE_FORCE, SLOT_FORCE, CRANK_PIN, SLIDER_PIN, DISC_PIVOT = range(8, 15)
TORQUE, POWER, POSITIVE_POWER, FRICTION_POWER = range(15, 19)
#: Rows of the slot's force and of the forces in pins.
PIN_ROWS = (SLOT_FORCE, CRANK_PIN, SLIDER_PIN, DISC_PIVOT)
#: Rows that hold squares.
SQUARES = PIN_ROWS[1:]

ACCELERATION_TERMS, RATE_TERMS, PRESSURE_TERMS, CURVATURE_TERMS, FORCE_TERMS, TORQUE_TERMS, POWER_TERMS = range(19, 26)
# Additions of the masses of rod and pin: the force that turns the rod; the force that presses the slider on its guide,
# with its terms; forces on the rod, on rod and pin, with their terms, and in the groove; power, with its terms.
TURN, PRESSED, PRESSED_TERMS, ROD_X, ROD_Y, LINKS_X, LINKS_Y, LINKS_TERMS, LINKS_GROOVE = range(26, 35)
LINKS_POWER, LINKS_POWER_TERMS, DISC_TERMS = 35, 36, 37
#: Row of the second derivative of the crank's length by time.
CRANK_SECOND_RATE = 38
#: Row that is the first of the points.
FIRST_POINT = 39

SIGNAL_ROWS = FIRST_POINT + MOST_POINTS * POINT_ROWS

# Bits of `needs`: the slider alone, the crank's length, the groove and the rod's angle, forces, forces in pins, two for
# each point.
SLIDER, CRANK, GROOVE, FORCES, PINS, POINTS = 1, 2, 4, 8, 16, 32
ALL_POINTS = POINTS * (4**MOST_POINTS - 1)

# Laws between the breaks have the numbers of their first marks.
#: Number of the first law of the way back, at the inner dead centre.
FIRST_LAW_BACK = 3
#: Number of the law of a steady speed, from the first law of either way.
STEADY_LAW = 1
