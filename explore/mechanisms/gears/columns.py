"""Rows of the record and of the signals of a gear pair, and the bits of `needs`."""

from enum import IntEnum

# Constants of both laws: ln m, the sector b, the law constant k, the ratio at 0, the driven angle at b, and the order
# of the return law; of the sine law: C1, C0, C3 - C0, the angle of the lowest ratio before the joint, and the
# constants of the integral; then the pair's and the drive's parameters, and the joints as half-tangents.
LOG_GROWTH, SECTOR_ANGLE, CONSTANT, START, DRIVEN_SECTOR, ORDER = range(6)
FREQUENCY, AMPLITUDE, LOWEST, DIP = 6, 7, 8, 9
BETA, ONE_LESS_BETA, SCALE, OFFSET = 10, 11, 12, 13
DISTANCE, N_TRAINS, SHIFT = 14, 15, 16
START_JOINT, END_JOINT = 17, 18
GEARS_SIZE = 19

# Rows of the signals.
RATIO, RATIO_RATE, RATIO_ACCELERATION, SPEED_RATIO, SPEED_RATIO_RATE, DRIVEN_ANGLE = range(6)
DRIVER_RADIUS, DRIVEN_RADIUS, PITCH_TILT, PITCH_LENGTH, DRIVER_CURVATURE, DRIVEN_CURVATURE = range(6, 12)
DRIVER_TERMS, DRIVEN_TERMS, TRAIN_RATIO, OVERALL_RATIO = range(12, 16)
SIGNAL_ROWS = 16

RATIOS, ANGLES, PITCH_CURVES, TRAIN, DRIVE = 1, 2, 4, 8, 16


class Row(IntEnum):
    """Rows of a tile of designs after the constants: status, parameters, metrics."""

    STATUS = GEARS_SIZE
    GROWTH = GEARS_SIZE + 1
    SECTOR = GEARS_SIZE + 2
    CENTRE_DISTANCE = GEARS_SIZE + 3
    RETURN_ORDER = GEARS_SIZE + 4
    BRANCH = GEARS_SIZE + 5
    TRAINS = GEARS_SIZE + 6
    PHASE_SHIFT = GEARS_SIZE + 7
    LAW_CONSTANT = GEARS_SIZE + 8
    RETURN_AMPLITUDE = GEARS_SIZE + 9
    RETURN_FREQUENCY = GEARS_SIZE + 10
    RETURN_SHIFT = GEARS_SIZE + 11
    RETURN_MEAN = GEARS_SIZE + 12
    RATIO_START = GEARS_SIZE + 13
    RATIO_END = GEARS_SIZE + 14
    RATIO_MIN = GEARS_SIZE + 15
    RATIO_MAX = GEARS_SIZE + 16
    DRIVEN_SECTOR = GEARS_SIZE + 17
    CONVEXITY_DRIVER = GEARS_SIZE + 18
    CONVEXITY_DRIVEN = GEARS_SIZE + 19
    TANGENT_TILT_MAX = GEARS_SIZE + 20
    CURVATURE_JUMP = GEARS_SIZE + 21
    PHASE_SHIFT_MAX = GEARS_SIZE + 22
    DRIVE_RATIO_MAX = GEARS_SIZE + 23
    RIPPLE = GEARS_SIZE + 24
