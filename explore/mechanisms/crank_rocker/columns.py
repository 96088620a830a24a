"""Rows of the crank-rocker's record."""

from explore.mechanisms.four_bar_forces import LOAD_ROWS, LOADED_SIZE
from explore.mechanisms.rocking import ROCKING_SIZE
from explore.model.points import SLOT_ROWS, record_rows

_PARAMETERS = ("CRANK", "COUPLER", "ROCKER", "GROUND", "PHASES", "BRANCH")
_METRICS = (
    "LINKAGE_CLASS", "GRASHOF_MARGIN", "SWING_ANGLE", "MID_ANGLE", "TIME_RATIO", "MEAN_OUTPUT_RATIO",
    "TRANSMISSION_ANGLE_MIN", "TRANSMISSION_ANGLE_MAX",
)  # fmt: skip
#: Rows of a tile of designs, which follow the constants of `rocking`.
Row = record_rows("Row", ("N_LINKAGES", "STATUS", *_PARAMETERS, *_METRICS), ROCKING_SIZE, __name__)
#: Rows of the extended kernel, which follow the constants of a four-bar under load.
ExtendedRow = record_rows(
    "ExtendedRow",
    ("N_LINKAGES", "STATUS", *_PARAMETERS, *LOAD_ROWS, *SLOT_ROWS, *_METRICS),
    LOADED_SIZE,
    __name__,
)
