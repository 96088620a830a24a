"""Names of points, links, slots and parameters of a table: what they must not be."""

import re

from explore.mechanisms.linkages.loads import SPEED
from explore.mechanisms.linkages.table import FRAME
from explore.model.name_checks import OWN_COLUMNS
from explore.model.quantities import FLUCTUATION, OUTPUT_STATISTICS, STATISTICS
from explore.studies.request.formula_text import RESERVED

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_LONGEST_NAME = 40
#: Endings of the signals of points, links, slots and joints.
_SIGNALS = ("x", "y", "velocity", "acceleration", "curvature", "angle", "position")
#: Endings of statistics of signals, of windows, and of columns that results add.
_OTHERS = (
    *STATISTICS, FLUCTUATION, "drive", "return", "forward", "backward", "cycle", "range", "interval", "margin", "label",
)  # fmt: skip
#: Beginnings of names of metrics.
_PREFIXES = ("envelope_", "assembles_")
#: Names of metrics, windows and columns that are whole.
_WHOLE = (
    *OUTPUT_STATISTICS, "time_ratio", "swing_angle", "stroke", "footprint", "cycle", "range", "drive", "return",
    "forward", "backward", "interval", "assembly_intervals",
    *OWN_COLUMNS, "transmission_angle", "drive_torque", "drive_power", "drive_force", "positive_power",
    "friction_power", "positive_work", "net_work", "energy_fluctuation", "speed_fluctuation",
    "motor_torque_max", "pin_force_peak", "lock_ratio",
)  # fmt: skip


def reason_against(name: str) -> str:
    """Why nothing in a table can have this name; empty if it can."""
    if not _IDENTIFIER.fullmatch(name) or len(name) > _LONGEST_NAME:
        return f"a name has letters, digits and _, at most {_LONGEST_NAME}, and begins with a letter"
    if name == FRAME:
        return f"{FRAME} is the link that does not move; choose another name"
    if name == SPEED:
        return f"{SPEED} is the speed of the driver; choose another name"
    if name in RESERVED:
        return "this is a function or a word of formulas and conditions; choose another name"
    if name in _WHOLE:
        return "this is the name of a metric, a window or a column; choose another"
    ending = name.rpartition("_")[2] if "_" in name else ""
    if ending in (*_SIGNALS, *_OTHERS):
        kind = "signals" if ending in _SIGNALS else "other columns"
        return f"names that end with _{ending} are of {kind}; choose another"
    if "_force_on_" in name or "_turning_of_" in name or name.endswith(("_normal_force", "_lock_ratio")):
        return "this is the name of a signal of a joint; choose another"
    prefix = next((each for each in _PREFIXES if name.startswith(each)), "")
    return f"names that begin with {prefix} are of metrics; choose another" if prefix else ""
