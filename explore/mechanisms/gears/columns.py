"""Rows of the record and of the signals of a gear pair, and the bits of `needs`."""

from explore.model.points import record_rows

# Constants of both laws: ln m, the sector b, the law constant k, the ratio at 0, the driven angle at b, and the order
# of the return law; of the sine law: C1, C0, C3 - C0, the angle of the lowest ratio before the joint, and the
# constants of the integral; or of a smoothstep law, from TURNED on, its integral up to the end of each panel of the
# return; then the pair's and the drive's parameters, and the joints as half-tangents; the input angles at which the
# second pair of the first train is at the end and at the start of its working sector; the ratio of a drive without
# ripple, else 0.
LOG_GROWTH, SECTOR_ANGLE, CONSTANT, START, DRIVEN_SECTOR, ORDER = range(6)
FREQUENCY, AMPLITUDE, LOWEST, DIP = 6, 7, 8, 9
BETA, ONE_LESS_BETA, SCALE, OFFSET = 10, 11, 12, 13
TURNED, N_PANELS = 6, 8
DISTANCE, N_TRAINS, SHIFT = 14, 15, 16
START_JOINT, END_JOINT = 17, 18
SECOND_END, SECOND_START = 19, 20
STEADY = 21
GEARS_SIZE = 22

# Rows of the signals.
RATIO, RATIO_RATE, RATIO_ACCELERATION, SPEED_RATIO, SPEED_RATIO_RATE, DRIVEN_ANGLE = range(6)
DRIVER_RADIUS, DRIVEN_RADIUS, PITCH_TILT, PITCH_LENGTH, DRIVER_CURVATURE, DRIVEN_CURVATURE = range(6, 12)
DRIVER_TERMS, DRIVEN_TERMS, TRAIN_RATIO, OVERALL_RATIO, TRAIN_JOINTS, FIRST_JOINTS, SECOND_JOINTS = range(12, 19)
SIGNAL_ROWS = 19

RATIOS, ANGLES, PITCH_CURVES, TRAIN, DRIVE, JOINTS, PITCH_LENGTHS = 1, 2, 4, 8, 16, 32, 64


#: Rows of a tile of designs after the constants: status, parameters, metrics.
Row = record_rows(
    "Row",
    (
        "STATUS", "GROWTH", "SECTOR", "CENTRE_DISTANCE", "RETURN_ORDER", "BRANCH", "TRAINS", "PHASE_SHIFT",
        "LAW_CONSTANT", "RETURN_AMPLITUDE", "RETURN_FREQUENCY", "RETURN_SHIFT", "RETURN_MEAN", "RATIO_START",
        "RATIO_END", "RATIO_MIN", "RATIO_MAX", "DRIVEN_SECTOR", "CONVEXITY_DRIVER", "CONVEXITY_DRIVEN",
        "TANGENT_TILT_MAX", "CURVATURE_JUMP", "PHASE_SHIFT_MAX", "DRIVE_RATIO_MAX", "RIPPLE",
    ),
    GEARS_SIZE,
    __name__,
)  # fmt: skip
