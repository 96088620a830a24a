"""Rows of the test rig's record and signals."""

from explore.mechanisms.four_bar_forces import LOAD_ROWS, LOADED_SIGNAL_ROWS, LOADED_SIZE
from explore.model.points import SLOT_ROWS, record_rows

# Constants: amplitudes of cosine and sine of a sine close to the rocker's velocity.
_CONSTANTS = ("COSINE", "SINE")
_PARAMETERS = ("CRANK", "COUPLER", "ROCKER", "GROUND", *LOAD_ROWS)
_METRICS = (
    "LINKAGE_CLASS", "GRASHOF_MARGIN", "SWING_ANGLE", "MID_ANGLE", "TIME_RATIO", "TRANSMISSION_ANGLE_WORST", "SIZE",
    "SWING_SENSITIVITY_CRANK", "SWING_SENSITIVITY_COUPLER", "SWING_SENSITIVITY_ROCKER", "SWING_SENSITIVITY_GROUND",
)  # fmt: skip
#: Rows of a tile of designs, which follow the constants of a four-bar under load.
Row = record_rows("Row", (*_CONSTANTS, "STATUS", *_PARAMETERS, *SLOT_ROWS, *_METRICS), LOADED_SIZE, __name__)

# Rows of the signal array after those of a four-bar under load.
DEVIATION, DEVIATION_COSINE, DEVIATION_SINE = range(LOADED_SIGNAL_ROWS, LOADED_SIGNAL_ROWS + 3)
SIGNAL_ROWS = LOADED_SIGNAL_ROWS + 3

#: Bit of the needs of the deviation from a sine.
HARMONICS = 64
