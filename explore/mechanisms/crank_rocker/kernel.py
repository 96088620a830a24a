"""The crank-rocker, compiled. Limit positions are in `rocking`, the motion in `four_bar`."""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.crank_rocker.columns import Row

_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(contract=True, inlined=True)
def fill_closed_form(record, parameter_offset, metric_offset, middle_row):
    """Fill the constants of `rocking`, status and metrics, and the mid-angle, rad, in `middle_row`, -1 for nowhere.

    The offsets are numbers of rows by which those from N_LINKAGES to BRANCH, and the metrics, are further down than in
    `Row`. The loop over lanes is here, and the record one array, or it would not vectorise.
    """
    for lane in range(LANES):
        given, metric = parameter_offset * LANES + lane, metric_offset * LANES + lane
        crank, coupler = record[Row.CRANK * LANES + given], record[Row.COUPLER * LANES + given]
        rocker, ground = record[Row.ROCKER * LANES + given], record[Row.GROUND * LANES + given]
        branch = record[Row.BRANCH * LANES + given]
        linkage_class, margin, status = rocking.prepare(crank, coupler, rocker, ground, branch, record, lane)
        swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, branch, record, lane)
        rocks, turns = linkage_class == four_bar.CRANK_ROCKER, linkage_class <= four_bar.DOUBLE_CRANK
        p_least, p_largest = record[four_bar.P_LEAST * LANES + lane], record[four_bar.P_LARGEST * LANES + lane]
        q_least, q_largest = record[four_bar.Q_LEAST * LANES + lane], record[four_bar.Q_LARGEST * LANES + lane]
        smallest = four_bar.transmission_angle(p_least, q_largest)
        largest = four_bar.transmission_angle(p_largest, q_least)
        record[Row.N_LINKAGES * LANES + given] = record[Row.PHASES * LANES + given]
        record[Row.STATUS * LANES + given] = status
        record[Row.LINKAGE_CLASS * LANES + metric] = linkage_class
        record[Row.GRASHOF_MARGIN * LANES + metric] = margin
        record[Row.SWING_ANGLE * LANES + metric] = swing * _DEGREES if rocks else _NAN
        record[Row.MID_ANGLE * LANES + metric] = middle * _DEGREES if rocks else _NAN
        record[Row.TIME_RATIO * LANES + metric] = time_ratio if rocks else _NAN
        record[Row.MEAN_OUTPUT_RATIO * LANES + metric] = swing / (2.0 * math.pi) if rocks else _NAN
        record[Row.TRANSMISSION_ANGLE_MIN * LANES + metric] = smallest * _DEGREES if turns else _NAN
        record[Row.TRANSMISSION_ANGLE_MAX * LANES + metric] = largest * _DEGREES if turns else _NAN
        if middle_row >= 0:
            record[middle_row * LANES + lane] = middle


@compiled(CLOSE_SIGNATURE, contract=True)
def close(record):
    """Fill class, margins, limit positions and transmission angles; see `explore.model.mechanism.Mechanism`.

    Metrics are in declared units, NaN where undefined.
    """
    fill_closed_form(record, 0, 0, -1)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, _piece, _variant, count, needs, out):
    """Fill the signals of `four_bar`; see `explore.model.mechanism.Mechanism`."""
    four_bar.fill_motion(constants, tangents, anchor, count, needs, four_bar.SIGNAL_ROWS, out)
