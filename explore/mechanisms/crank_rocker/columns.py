"""Rows of the crank-rocker's record."""

from enum import IntEnum

from explore.mechanisms.rocking import ROCKING_SIZE


class Row(IntEnum):
    """Rows of a tile of designs after those of `rocking`: constants, status, parameters, metrics."""

    N_LINKAGES = ROCKING_SIZE
    STATUS = ROCKING_SIZE + 1
    CRANK = ROCKING_SIZE + 2
    COUPLER = ROCKING_SIZE + 3
    ROCKER = ROCKING_SIZE + 4
    GROUND = ROCKING_SIZE + 5
    PHASES = ROCKING_SIZE + 6
    BRANCH = ROCKING_SIZE + 7
    LINKAGE_CLASS = ROCKING_SIZE + 8
    GRASHOF_MARGIN = ROCKING_SIZE + 9
    SWING_ANGLE = ROCKING_SIZE + 10
    MID_ANGLE = ROCKING_SIZE + 11
    TIME_RATIO = ROCKING_SIZE + 12
    MEAN_OUTPUT_RATIO = ROCKING_SIZE + 13
    TRANSMISSION_ANGLE_MIN = ROCKING_SIZE + 14
    TRANSMISSION_ANGLE_MAX = ROCKING_SIZE + 15
