"""The extended kernel of the test rig, compiled: what `kernel` fills, and points of the coupler."""

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.mechanisms import four_bar, four_bar_forces
from explore.mechanisms.floating_link import fill_places
from explore.mechanisms.four_bar_points import fill_points, motion_needs
from explore.mechanisms.rig import kernel
from explore.mechanisms.rig.columns import EXTENDED_SIGNAL_ROWS, POINTS, SIGNAL_ROWS, ExtendedRow
from explore.model.points import PLACES_SIZE


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill what `kernel.close` does, and the places of points; see `explore.model.mechanism.Mechanism`."""
    parameters, metrics = record[PLACES_SIZE * LANES :], record[2 * PLACES_SIZE * LANES :]
    for lane in range(LANES):
        kernel.fill_closed_form(record, parameters, metrics, lane)
    for lane in range(LANES):
        rocks = record[ExtendedRow.LINKAGE_CLASS * LANES + lane] == four_bar.CRANK_ROCKER
        four_bar_forces.fill_load_constants(
            record, lane, ExtendedRow.CRANK, ExtendedRow.CONSTANT_TORQUE, ExtendedRow.SPEED, rocks
        )
        fill_places(record, lane, ExtendedRow.PLACES, ExtendedRow.POINT_1_ALONG)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, variant, count, needs, out):
    """Fill the signals of `kernel.fill` and those of points; see `explore.model.mechanism.Mechanism`."""
    motion = motion_needs(needs, POINTS)
    kernel.fill_signals(constants, tangents, anchor, law, variant, count, needs, motion, EXTENDED_SIGNAL_ROWS, out)
    if needs >= POINTS:
        for j in range(count):
            signals = out[j * EXTENDED_SIGNAL_ROWS * LANES :]
            fill_points(
                constants, tangents[j * LANES :], anchor, needs, POINTS, ExtendedRow.PLACES, SIGNAL_ROWS, signals
            )
