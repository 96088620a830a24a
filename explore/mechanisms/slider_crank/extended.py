"""The extended kernel of the slider-crank, compiled: its motion and forces under load."""

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.mechanisms.slider_crank.columns import (
    EXTENDED_SIGNAL_ROWS,
    FORCES,
    ROD_RATES,
    SLIDER,
    SLIDER_ACCELERATION,
    ExtendedRow,
    Row,
)
from explore.mechanisms.slider_crank.forces import fill_forces, fill_load_constants
from explore.mechanisms.slider_crank.kernel import GUIDE_LOCKED, close_designs, fill_motion
from explore.model.status import Status

#: Number of rows by which the lengths are further down than in `Row`.
_LENGTHS = ExtendedRow.CRANK - Row.CRANK
#: Number of rows by which the metrics are further down than in `Row`.
_METRICS = ExtendedRow.STROKE - Row.STROKE

_OK = float(Status.OK)


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill what `kernel.close` does, and constants of forces; see `explore.model.mechanism.Mechanism`."""
    close_designs(record, _LENGTHS, _METRICS)
    for lane in range(LANES):
        status, can_lock = record[ExtendedRow.STATUS * LANES + lane], fill_load_constants(record, lane)
        record[ExtendedRow.STATUS * LANES + lane] = 1.0 * GUIDE_LOCKED if can_lock & (status == _OK) else status


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, _variant, count, needs, out):
    """Fill the signals of the motion, forces and torques; see `explore.model.mechanism.Mechanism`."""
    motion = needs
    if needs & FORCES:
        motion |= SLIDER | SLIDER_ACCELERATION | ROD_RATES
    fill_motion(constants, tangents, anchor, count, motion, EXTENDED_SIGNAL_ROWS, out)
    if needs & FORCES:
        for j in range(count):
            signals = out[j * EXTENDED_SIGNAL_ROWS * LANES :]
            fill_forces(constants, tangents[j * LANES :], anchor, law, signals)
