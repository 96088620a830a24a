"""The extended kernel of the crank-rocker, compiled: its motion and forces under load."""

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.mechanisms import four_bar, four_bar_forces
from explore.mechanisms.crank_rocker import kernel
from explore.mechanisms.crank_rocker.columns import ExtendedRow, Row
from explore.mechanisms.four_bar_forces import FORCES, LOADED_SIGNAL_ROWS, TORQUE, Load

#: Number of rows by which the parameters are further down than in `Row`.
_PARAMETERS = ExtendedRow.CRANK - Row.CRANK
#: Number of rows by which the metrics are further down than in `Row`.
_METRICS = ExtendedRow.LINKAGE_CLASS - Row.LINKAGE_CLASS


@compiled(CLOSE_SIGNATURE, contract=True)
def close(record):
    """Fill what `kernel.close` does, and constants of forces; see `explore.model.mechanism.Mechanism`."""
    kernel.fill_closed_form(record, _PARAMETERS, _METRICS, Load.MIDDLE)
    for lane in range(LANES):
        rocks = record[ExtendedRow.LINKAGE_CLASS * LANES + lane] == four_bar.CRANK_ROCKER
        four_bar_forces.fill_load_constants(
            record, lane, ExtendedRow.CRANK, ExtendedRow.CONSTANT_TORQUE, ExtendedRow.SPEED, rocks
        )


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, variant, count, needs, out):
    """Fill the signals of a four-bar under load; see `explore.model.mechanism.Mechanism`."""
    motion = four_bar_forces.motion_needs(needs, variant)
    four_bar.fill_motion(constants, tangents, anchor, count, motion, LOADED_SIGNAL_ROWS, out)
    if needs & (FORCES | TORQUE):
        for j in range(count):
            signals = out[j * LOADED_SIGNAL_ROWS * LANES :]
            four_bar_forces.fill_forces(constants, tangents[j * LANES :], anchor, law, variant, needs, signals)
