"""Rows of the slider-crank's record and of its signals."""

from explore.model.points import SLOT_ROWS, record_rows

# Constants: rod minus or plus crank, minus or plus offset; the lengths that move; half-tangents of the dead centres
# from the anchor, and of the distances of the singularities.
_CONSTANTS = (
    "MINUS_MINUS", "MINUS_PLUS", "PLUS_PLUS", "PLUS_MINUS", "MOVING_CRANK", "MOVING_OFFSET",
    "OUTER", "INNER", "SINGULAR_ABOVE", "SINGULAR_BELOW", "NOISE",
)  # fmt: skip
_LENGTHS = ("CRANK", "ROD", "OFFSET")
# Parameters of the load, in the order of `loads.PARAMETERS`, and the speed.
_LOADS = (
    "CONSTANT_FORCE", "OPPOSING_FORCE", "STIFFNESS", "DAMPING", "MASS", "FRICTION", "GRAVITY", "CRANK_MASS",
    "CRANK_CENTROID", "ROD_MASS", "ROD_CENTROID", "ROD_INERTIA", "SPEED",
)  # fmt: skip
_METRICS = (
    "STROKE", "TIME_RATIO", "OUTER_ANGLE", "INNER_ANGLE", "PRESSURE_ANGLE_MAX", "TRANSMISSION_ANGLE_MIN",
    "TURNING_MARGIN",
)  # fmt: skip
#: Rows of a tile of designs.
Row = record_rows("Row", (*_CONSTANTS, "STATUS", *_LENGTHS, *_METRICS), 0, __name__)
#: Rows of the extended kernel; the row MIDDLE is the position at mid-stroke.
ExtendedRow = record_rows(
    "ExtendedRow",
    (
        *_CONSTANTS, *(f"LOAD_{load}" for load in _LOADS), "MIDDLE", "STATUS", *_LENGTHS, *_LOADS,
        *SLOT_ROWS, *_METRICS,
    ),
    0,
    __name__,
)  # fmt: skip

#: Number of the constants that `fill` reads.
FILL_SIZE = 6
#: Number of the parameters of the load, with the speed.
LOAD_SIZE = len(_LOADS)

# Rows of the signals, and the bits of `needs` that request them.
POSITION, VELOCITY, ACCELERATION, ROD_ANGLE, ROD_VELOCITY, ROD_ACCELERATION = range(6)
SIGNAL_ROWS = 6
SLIDER, SLIDER_ACCELERATION, ANGLE, ROD_RATES = 1, 2, 4, 8

# Rows of the extended kernel's signals after those of the motion, and the bits of `needs` beside those of the motion.
# The rows of pins hold squares; those of terms the size of the terms that add up to forces and to torques.
THRUST, GUIDE_FORCE, CRANK_PIVOT, CRANK_PIN, SLIDER_PIN, FORCE_TERMS = range(SIGNAL_ROWS, SIGNAL_ROWS + 6)
TORQUE, POSITIVE_TORQUE, LOST_TORQUE, TORQUE_TERMS = range(SIGNAL_ROWS + 6, SIGNAL_ROWS + 10)
EXTENDED_SIGNAL_ROWS = SIGNAL_ROWS + 10
FORCES = 16

#: Number of the law from the outer to the inner dead centre.
INWARD = 0
