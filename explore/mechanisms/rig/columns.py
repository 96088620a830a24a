"""Columns of the test rig's arrays, rows of its signals, and the codes of its windows."""

from enum import IntEnum

from explore.mechanisms import four_bar
from explore.mechanisms.rocking import ROCKING_SIZE


class ParameterColumn(IntEnum):
    """Columns of the parameters that the closed form takes: lengths, load, speed."""

    CRANK = 0
    COUPLER = 1
    ROCKER = 2
    GROUND = 3
    CONSTANT_TORQUE = 4
    OPPOSING_TORQUE = 5
    STIFFNESS = 6
    DAMPING = 7
    INERTIA = 8
    CRANK_MASS = 9
    COUPLER_MASS = 10
    ROCKER_MASS = 11
    CRANK_CENTROID = 12
    COUPLER_CENTROID = 13
    ROCKER_CENTROID = 14
    COUPLER_INERTIA = 15
    ROCKER_INERTIA = 16
    GRAVITY = 17
    SPEED = 18


class MetricColumn(IntEnum):
    """Rows of the metrics that the closed form fills, one column of results each."""

    LINKAGE_CLASS = 0
    GRASHOF_MARGIN = 1
    SWING_ANGLE = 2
    MID_ANGLE = 3
    TIME_RATIO = 4
    TRANSMISSION_ANGLE_WORST = 5
    SIZE = 6
    SWING_SENSITIVITY_CRANK = 7
    SWING_SENSITIVITY_COUPLER = 8
    SWING_SENSITIVITY_ROCKER = 9
    SWING_SENSITIVITY_GROUND = 10


class KernelColumn(IntEnum):
    """Columns of a kernel row after those of `rocking`.

    The load in the order of `ParameterColumn`, in SI units; lengths, m; mid-angle, rad; ratio of coupler force to
    torque times the root of p q; sum of masses and inertias of the links; bits of `four_bar.fill` that the load needs;
    cosine and sine amplitudes of a sine close to the rocker's velocity.
    """

    CONSTANT_TORQUE = ROCKING_SIZE
    OPPOSING_TORQUE = ROCKING_SIZE + 1
    STIFFNESS = ROCKING_SIZE + 2
    DAMPING = ROCKING_SIZE + 3
    INERTIA = ROCKING_SIZE + 4
    CRANK_MASS = ROCKING_SIZE + 5
    COUPLER_MASS = ROCKING_SIZE + 6
    ROCKER_MASS = ROCKING_SIZE + 7
    CRANK_CENTROID = ROCKING_SIZE + 8
    COUPLER_CENTROID = ROCKING_SIZE + 9
    ROCKER_CENTROID = ROCKING_SIZE + 10
    COUPLER_INERTIA = ROCKING_SIZE + 11
    ROCKER_INERTIA = ROCKING_SIZE + 12
    GRAVITY = ROCKING_SIZE + 13
    SPEED = ROCKING_SIZE + 14
    COUPLER_LENGTH = ROCKING_SIZE + 15
    ROCKER_LENGTH = ROCKING_SIZE + 16
    GROUND_LENGTH = ROCKING_SIZE + 17
    MID_ANGLE = ROCKING_SIZE + 18
    LEVER = ROCKING_SIZE + 19
    MASSES = ROCKING_SIZE + 20
    MOTION_NEEDS = ROCKING_SIZE + 21
    COSINE = ROCKING_SIZE + 22
    SINE = ROCKING_SIZE + 23


LOAD_SIZE = 15
KERNEL_SIZE = ROCKING_SIZE + len(KernelColumn)

# Rows of the signal array after those of the four-bar. The rows of the pins hold squares; the rows of terms hold the
# size of the terms that add up to force and torque.
COUPLER_FORCE, PIN_A, PIN_B, PIN_C, PIN_D, DRIVE_TORQUE, FORCE_TERMS, TORQUE_TERMS = range(
    four_bar.SIGNAL_ROWS, four_bar.SIGNAL_ROWS + 8
)
ROCKER_FORCE, ROCKER_MOMENT, DEVIATION, DEVIATION_COSINE, DEVIATION_SINE = range(
    four_bar.SIGNAL_ROWS + 8, four_bar.SIGNAL_ROWS + 13
)
SIGNAL_ROWS = four_bar.SIGNAL_ROWS + 13
#: Bits of the needs that `fill` takes beside those of the four-bar.
FORCES, TORQUE, HARMONICS = 16, 32, 64

CYCLE, OVERLAPPED_TO_EXTENDED, EXTENDED_TO_OVERLAPPED = range(3)
