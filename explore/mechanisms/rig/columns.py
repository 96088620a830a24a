"""Rows of the test rig's record and signals."""

from enum import IntEnum, auto

from explore.mechanisms.four_bar_forces import LOADED_SIGNAL_ROWS, LOADED_SIZE
from explore.model.points import MOST_POINTS, POINT_ROWS, rows_with_points


class Row(IntEnum):
    """Rows of a tile of designs after those of a four-bar under load: constants, status, parameters, metrics.

    The constants are cosine and sine amplitudes of a sine close to the rocker's velocity.
    """

    COSINE = LOADED_SIZE
    SINE = auto()
    STATUS = auto()
    CRANK = auto()
    COUPLER = auto()
    ROCKER = auto()
    GROUND = auto()
    CONSTANT_TORQUE = auto()
    OPPOSING_TORQUE = auto()
    STIFFNESS = auto()
    DAMPING = auto()
    INERTIA = auto()
    CRANK_MASS = auto()
    COUPLER_MASS = auto()
    ROCKER_MASS = auto()
    CRANK_CENTROID = auto()
    COUPLER_CENTROID = auto()
    ROCKER_CENTROID = auto()
    COUPLER_INERTIA = auto()
    ROCKER_INERTIA = auto()
    GRAVITY = auto()
    SPEED = auto()
    LINKAGE_CLASS = auto()
    GRASHOF_MARGIN = auto()
    SWING_ANGLE = auto()
    MID_ANGLE = auto()
    TIME_RATIO = auto()
    TRANSMISSION_ANGLE_WORST = auto()
    SIZE = auto()
    SWING_SENSITIVITY_CRANK = auto()
    SWING_SENSITIVITY_COUPLER = auto()
    SWING_SENSITIVITY_ROCKER = auto()
    SWING_SENSITIVITY_GROUND = auto()


#: Rows of the extended kernel: the places of points are the constants from the first row on that `Row` has not.
EXTENDED_ROWS = rows_with_points(Row, Row.LINKAGE_CLASS)
PLACES = int(Row.STATUS)

# Rows of the signal array after those of a four-bar under load; those of points begin where the others end.
DEVIATION, DEVIATION_COSINE, DEVIATION_SINE = range(LOADED_SIGNAL_ROWS, LOADED_SIGNAL_ROWS + 3)
SIGNAL_ROWS = LOADED_SIGNAL_ROWS + 3
EXTENDED_SIGNAL_ROWS = SIGNAL_ROWS + MOST_POINTS * POINT_ROWS
#: Bits of the needs that `fill` takes beside those of a four-bar under load; the second is the first of the points.
HARMONICS, POINTS = 64, 128
