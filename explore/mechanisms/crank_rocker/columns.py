"""Columns of the crank-rocker's arrays, and the codes of its windows and drives."""

from enum import IntEnum

from explore.mechanisms.rocking import ROCKING_SIZE


class ParameterColumn(IntEnum):
    """Columns of the parameters that the closed form takes."""

    CRANK = 0
    COUPLER = 1
    ROCKER = 2
    GROUND = 3
    PHASES = 4
    BRANCH = 5


class MetricColumn(IntEnum):
    """Rows of the metrics that the closed form fills, one column of results each."""

    LINKAGE_CLASS = 0
    GRASHOF_MARGIN = 1
    SWING_ANGLE = 2
    MID_ANGLE = 3
    TIME_RATIO = 4
    MEAN_OUTPUT_RATIO = 5
    TRANSMISSION_ANGLE_MIN = 6
    TRANSMISSION_ANGLE_MAX = 7


# Column of a kernel row after those of `rocking`.
PHASES = ROCKING_SIZE
KERNEL_SIZE = ROCKING_SIZE + 1

CYCLE, DRIVE, RETURN, OVERLAPPED_TO_EXTENDED, EXTENDED_TO_OVERLAPPED, CLUTCH, INTERVAL = range(7)
DRIVE_SLOW, DRIVE_FAST, DRIVE_OVERLAPPED_TO_EXTENDED, DRIVE_EXTENDED_TO_OVERLAPPED = range(4)
DRIVES = {
    "slow": DRIVE_SLOW,
    "fast": DRIVE_FAST,
    "overlapped_to_extended": DRIVE_OVERLAPPED_TO_EXTENDED,
    "extended_to_overlapped": DRIVE_EXTENDED_TO_OVERLAPPED,
}
