"""The crank-rocker, compiled. Limit positions are in `rocking`, the motion in `four_bar`."""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.crank_rocker.columns import Row

_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(contract=True, inlined=True)
def fill_closed_form(record, parameters, metrics, lane):
    """Fill the constants of `rocking`, status and metrics of one lane; return the mid-angle, rad.

    In their parts of the record, the rows from the number of linkages to the branch and the metrics are as in `Row`.
    """
    crank, coupler = parameters[Row.CRANK * LANES + lane], parameters[Row.COUPLER * LANES + lane]
    rocker, ground = parameters[Row.ROCKER * LANES + lane], parameters[Row.GROUND * LANES + lane]
    branch = parameters[Row.BRANCH * LANES + lane]
    linkage_class, margin, status = rocking.prepare(crank, coupler, rocker, ground, branch, record, lane)
    swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, branch, record, lane)
    rocks, turns = linkage_class == four_bar.CRANK_ROCKER, linkage_class <= four_bar.DOUBLE_CRANK
    p_least, p_largest = record[four_bar.P_LEAST * LANES + lane], record[four_bar.P_LARGEST * LANES + lane]
    q_least, q_largest = record[four_bar.Q_LEAST * LANES + lane], record[four_bar.Q_LARGEST * LANES + lane]
    smallest = four_bar.transmission_angle(p_least, q_largest)
    largest = four_bar.transmission_angle(p_largest, q_least)
    parameters[Row.N_LINKAGES * LANES + lane] = parameters[Row.PHASES * LANES + lane]
    parameters[Row.STATUS * LANES + lane] = status
    metrics[Row.LINKAGE_CLASS * LANES + lane] = linkage_class
    metrics[Row.GRASHOF_MARGIN * LANES + lane] = margin
    metrics[Row.SWING_ANGLE * LANES + lane] = swing * _DEGREES if rocks else _NAN
    metrics[Row.MID_ANGLE * LANES + lane] = middle * _DEGREES if rocks else _NAN
    metrics[Row.TIME_RATIO * LANES + lane] = time_ratio if rocks else _NAN
    metrics[Row.MEAN_OUTPUT_RATIO * LANES + lane] = swing / (2.0 * math.pi) if rocks else _NAN
    metrics[Row.TRANSMISSION_ANGLE_MIN * LANES + lane] = smallest * _DEGREES if turns else _NAN
    metrics[Row.TRANSMISSION_ANGLE_MAX * LANES + lane] = largest * _DEGREES if turns else _NAN
    return middle


@compiled(CLOSE_SIGNATURE, contract=True)
def close(record):
    """Fill class, margins, limit positions and transmission angles; see `explore.model.mechanism.Mechanism`.

    Metrics are in declared units, NaN where undefined.
    """
    for lane in range(LANES):
        fill_closed_form(record, record, record, lane)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, _piece, _variant, count, needs, out):
    """Fill the signals of `four_bar`; see `explore.model.mechanism.Mechanism`."""
    four_bar.fill_motion(constants, tangents, anchor, count, needs, four_bar.SIGNAL_ROWS, out)
