"""Rows of the crank-rocker's record."""

from enum import IntEnum, auto

from explore.mechanisms.four_bar_forces import LOADED_SIGNAL_ROWS, LOADED_SIZE
from explore.mechanisms.rocking import ROCKING_SIZE
from explore.model.points import MOST_POINTS, PLACES_SIZE, POINT_ROWS


class Row(IntEnum):
    """Rows of a tile of designs after those of `rocking`: constants, status, parameters, metrics."""

    N_LINKAGES = ROCKING_SIZE
    STATUS = auto()
    CRANK = auto()
    COUPLER = auto()
    ROCKER = auto()
    GROUND = auto()
    PHASES = auto()
    BRANCH = auto()
    LINKAGE_CLASS = auto()
    GRASHOF_MARGIN = auto()
    SWING_ANGLE = auto()
    MID_ANGLE = auto()
    TIME_RATIO = auto()
    MEAN_OUTPUT_RATIO = auto()
    TRANSMISSION_ANGLE_MIN = auto()
    TRANSMISSION_ANGLE_MAX = auto()


class ExtendedRow(IntEnum):
    """Rows of the extended kernel after those of a four-bar under load: constants, status, parameters, metrics.

    The places of points, then, from the last constant to the branch, those of `Row`; so are the metrics.
    """

    PLACES = LOADED_SIZE
    N_LINKAGES = LOADED_SIZE + PLACES_SIZE
    STATUS = auto()
    CRANK = auto()
    COUPLER = auto()
    ROCKER = auto()
    GROUND = auto()
    PHASES = auto()
    BRANCH = auto()
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
    POINT_1_ALONG = auto()
    POINT_1_ACROSS = auto()
    POINT_2_ALONG = auto()
    POINT_2_ACROSS = auto()
    POINT_3_ALONG = auto()
    POINT_3_ACROSS = auto()
    POINT_4_ALONG = auto()
    POINT_4_ACROSS = auto()
    LINKAGE_CLASS = auto()
    GRASHOF_MARGIN = auto()
    SWING_ANGLE = auto()
    MID_ANGLE = auto()
    TIME_RATIO = auto()
    MEAN_OUTPUT_RATIO = auto()
    TRANSMISSION_ANGLE_MIN = auto()
    TRANSMISSION_ANGLE_MAX = auto()


#: Rows of the signal array of the extended kernel: the first of the points, and all; the first bit of their needs.
FIRST_POINT = LOADED_SIGNAL_ROWS
EXTENDED_SIGNAL_ROWS = FIRST_POINT + MOST_POINTS * POINT_ROWS
POINTS = 64
