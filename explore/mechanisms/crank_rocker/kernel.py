"""The crank-rocker, compiled. Limit positions are in `rocking`, the motion in `four_bar`."""

import math

from explore.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.crank_rocker.columns import Row
from explore.subroutines import subroutine

_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(contract=True, inlined=True)
def fill_closed_form(record, lane, lengths, metrics):
    """Fill the constants of `rocking`, status and metrics of one lane; return the mid-angle, rad.

    Parameters
    ----------
    lengths, metrics
        How much further down than in `Row` the rows from the number of linkages on are, and those of the metrics.
    """
    crank, coupler = record[(Row.CRANK + lengths) * LANES + lane], record[(Row.COUPLER + lengths) * LANES + lane]
    rocker, ground = record[(Row.ROCKER + lengths) * LANES + lane], record[(Row.GROUND + lengths) * LANES + lane]
    branch = record[(Row.BRANCH + lengths) * LANES + lane]
    linkage_class, margin, status = rocking.prepare(crank, coupler, rocker, ground, branch, record, lane)
    swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, branch, record, lane)
    rocks, turns = linkage_class == four_bar.CRANK_ROCKER, linkage_class <= four_bar.DOUBLE_CRANK
    p_least, p_largest = record[four_bar.P_LEAST * LANES + lane], record[four_bar.P_LARGEST * LANES + lane]
    q_least, q_largest = record[four_bar.Q_LEAST * LANES + lane], record[four_bar.Q_LARGEST * LANES + lane]
    smallest = four_bar.transmission_angle(p_least, q_largest)
    largest = four_bar.transmission_angle(p_largest, q_least)
    record[(Row.N_LINKAGES + lengths) * LANES + lane] = record[(Row.PHASES + lengths) * LANES + lane]
    record[(Row.STATUS + lengths) * LANES + lane] = status
    record[(Row.LINKAGE_CLASS + metrics) * LANES + lane] = linkage_class
    record[(Row.GRASHOF_MARGIN + metrics) * LANES + lane] = margin
    record[(Row.SWING_ANGLE + metrics) * LANES + lane] = swing * _DEGREES if rocks else _NAN
    record[(Row.MID_ANGLE + metrics) * LANES + lane] = middle * _DEGREES if rocks else _NAN
    record[(Row.TIME_RATIO + metrics) * LANES + lane] = time_ratio if rocks else _NAN
    record[(Row.MEAN_OUTPUT_RATIO + metrics) * LANES + lane] = swing / (2.0 * math.pi) if rocks else _NAN
    record[(Row.TRANSMISSION_ANGLE_MIN + metrics) * LANES + lane] = smallest * _DEGREES if turns else _NAN
    record[(Row.TRANSMISSION_ANGLE_MAX + metrics) * LANES + lane] = largest * _DEGREES if turns else _NAN
    return middle


@compiled(CLOSE_SIGNATURE, contract=True)
def close(record):
    """Fill class, margins, limit positions and transmission angles; see `explore.model.mechanism.Mechanism`.

    Metrics are in declared units, NaN where undefined.
    """
    for lane in range(LANES):
        fill_closed_form(record, lane, 0, 0)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, _piece, _variant, count, needs, out):
    """Fill the signals of `four_bar`; see `explore.model.mechanism.Mechanism`."""
    four_bar.fill_motion(constants, tangents, anchor, count, needs, four_bar.SIGNAL_ROWS, out)
