"""Rows of the test rig's record and signals."""

from enum import IntEnum

from explore.mechanisms import four_bar
from explore.mechanisms.rocking import ROCKING_SIZE


class Row(IntEnum):
    """Rows of a tile of designs after those of `rocking`: constants, status, parameters, metrics.

    The constants are the load in the order of the parameters, in SI units; lengths, m; mid-angle, rad; ratio of coupler
    force to torque times the root of p q; cosine and sine amplitudes of a sine close to the rocker's velocity; and the
    variant, whose bits tell which kinds of load a design has.
    """

    LOAD_CONSTANT_TORQUE = ROCKING_SIZE
    LOAD_OPPOSING_TORQUE = ROCKING_SIZE + 1
    LOAD_STIFFNESS = ROCKING_SIZE + 2
    LOAD_DAMPING = ROCKING_SIZE + 3
    LOAD_INERTIA = ROCKING_SIZE + 4
    LOAD_CRANK_MASS = ROCKING_SIZE + 5
    LOAD_COUPLER_MASS = ROCKING_SIZE + 6
    LOAD_ROCKER_MASS = ROCKING_SIZE + 7
    LOAD_CRANK_CENTROID = ROCKING_SIZE + 8
    LOAD_COUPLER_CENTROID = ROCKING_SIZE + 9
    LOAD_ROCKER_CENTROID = ROCKING_SIZE + 10
    LOAD_COUPLER_INERTIA = ROCKING_SIZE + 11
    LOAD_ROCKER_INERTIA = ROCKING_SIZE + 12
    LOAD_GRAVITY = ROCKING_SIZE + 13
    LOAD_SPEED = ROCKING_SIZE + 14
    COUPLER_LENGTH = ROCKING_SIZE + 15
    ROCKER_LENGTH = ROCKING_SIZE + 16
    GROUND_LENGTH = ROCKING_SIZE + 17
    MIDDLE = ROCKING_SIZE + 18
    LEVER = ROCKING_SIZE + 19
    COSINE = ROCKING_SIZE + 20
    SINE = ROCKING_SIZE + 21
    VARIANT = ROCKING_SIZE + 22
    STATUS = ROCKING_SIZE + 23
    CRANK = ROCKING_SIZE + 24
    COUPLER = ROCKING_SIZE + 25
    ROCKER = ROCKING_SIZE + 26
    GROUND = ROCKING_SIZE + 27
    CONSTANT_TORQUE = ROCKING_SIZE + 28
    OPPOSING_TORQUE = ROCKING_SIZE + 29
    STIFFNESS = ROCKING_SIZE + 30
    DAMPING = ROCKING_SIZE + 31
    INERTIA = ROCKING_SIZE + 32
    CRANK_MASS = ROCKING_SIZE + 33
    COUPLER_MASS = ROCKING_SIZE + 34
    ROCKER_MASS = ROCKING_SIZE + 35
    CRANK_CENTROID = ROCKING_SIZE + 36
    COUPLER_CENTROID = ROCKING_SIZE + 37
    ROCKER_CENTROID = ROCKING_SIZE + 38
    COUPLER_INERTIA = ROCKING_SIZE + 39
    ROCKER_INERTIA = ROCKING_SIZE + 40
    GRAVITY = ROCKING_SIZE + 41
    SPEED = ROCKING_SIZE + 42
    LINKAGE_CLASS = ROCKING_SIZE + 43
    GRASHOF_MARGIN = ROCKING_SIZE + 44
    SWING_ANGLE = ROCKING_SIZE + 45
    MID_ANGLE = ROCKING_SIZE + 46
    TIME_RATIO = ROCKING_SIZE + 47
    TRANSMISSION_ANGLE_WORST = ROCKING_SIZE + 48
    SIZE = ROCKING_SIZE + 49
    SWING_SENSITIVITY_CRANK = ROCKING_SIZE + 50
    SWING_SENSITIVITY_COUPLER = ROCKING_SIZE + 51
    SWING_SENSITIVITY_ROCKER = ROCKING_SIZE + 52
    SWING_SENSITIVITY_GROUND = ROCKING_SIZE + 53


LOAD_SIZE = 15

# Bits of the variant: the load has a spring, a damper, inertia of the rocker, a torque against the motion, masses.
HAS_STIFFNESS, HAS_DAMPING, HAS_INERTIA, HAS_OPPOSING_TORQUE, HAS_MASSES = 1, 2, 4, 8, 16

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
#: Number of the law that holds on the stroke through crank angle 0, where the rocker turns clockwise.
CLOCKWISE = 0
