"""The extended kernel of the crank-rocker, compiled: its motion, forces under load, points of the coupler."""

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.mechanisms import four_bar, four_bar_forces
from explore.mechanisms.crank_rocker import kernel
from explore.mechanisms.crank_rocker.columns import EXTENDED_SIGNAL_ROWS, FIRST_POINT, POINTS, ExtendedRow, Row
from explore.mechanisms.floating_link import fill_places
from explore.mechanisms.four_bar_forces import FORCES, TORQUE, Load
from explore.mechanisms.four_bar_points import fill_points, motion_needs

#: Number of rows by which the parameters are further down than in `Row`.
_PARAMETERS = ExtendedRow.CRANK - Row.CRANK
#: Number of rows by which the metrics are further down than in `Row`.
_METRICS = ExtendedRow.LINKAGE_CLASS - Row.LINKAGE_CLASS


@compiled(CLOSE_SIGNATURE, contract=True)
def close(record):
    """Fill what `kernel.close` does, and constants of forces and points; see `explore.model.mechanism.Mechanism`."""
    parameters, metrics = record[_PARAMETERS * LANES :], record[_METRICS * LANES :]
    for lane in range(LANES):
        record[Load.MIDDLE * LANES + lane] = kernel.fill_closed_form(record, parameters, metrics, lane)
    for lane in range(LANES):
        rocks = record[ExtendedRow.LINKAGE_CLASS * LANES + lane] == four_bar.CRANK_ROCKER
        four_bar_forces.fill_load_constants(
            record, lane, ExtendedRow.CRANK, ExtendedRow.CONSTANT_TORQUE, ExtendedRow.SPEED, rocks
        )
        fill_places(record, lane, ExtendedRow.PLACES, ExtendedRow.POINT_1_ALONG)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, variant, count, needs, out):
    """Fill the signals of a four-bar under load and of points; see `explore.model.mechanism.Mechanism`."""
    motion = four_bar_forces.motion_needs(needs, variant) | motion_needs(needs, POINTS)
    four_bar.fill_motion(constants, tangents, anchor, count, motion, EXTENDED_SIGNAL_ROWS, out)
    if needs & (FORCES | TORQUE):
        for j in range(count):
            signals = out[j * EXTENDED_SIGNAL_ROWS * LANES :]
            four_bar_forces.fill_forces(constants, tangents[j * LANES :], anchor, law, variant, needs, signals)
    if needs >= POINTS:
        for j in range(count):
            signals = out[j * EXTENDED_SIGNAL_ROWS * LANES :]
            fill_points(
                constants, tangents[j * LANES :], anchor, needs, POINTS, ExtendedRow.PLACES, FIRST_POINT, signals
            )
