"""The crank-rocker, compiled. Limit positions are in `rocking`, the motion in `four_bar`."""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.crank_rocker.columns import Row

_DEGREES = 180.0 / math.pi
_NAN = math.nan


@subroutine(contract=True, inlined=True)
def fill_closed_form(record, parameters, metrics, middle_row):
    """Fill the constants of `rocking`, status and metrics, and the mid-angle, rad, in a row of its own if there is one.

    The rows from the number of linkages to the branch are so many `parameters` further down than in `Row`, and those of
    the metrics so many `metrics`. They are of one array, and the loop is here, or it would not vectorise.
    """
    for lane in range(LANES):
        own, closed = parameters * LANES + lane, metrics * LANES + lane
        crank, coupler = record[Row.CRANK * LANES + own], record[Row.COUPLER * LANES + own]
        rocker, ground = record[Row.ROCKER * LANES + own], record[Row.GROUND * LANES + own]
        branch = record[Row.BRANCH * LANES + own]
        linkage_class, margin, status = rocking.prepare(crank, coupler, rocker, ground, branch, record, lane)
        swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, branch, record, lane)
        rocks, turns = linkage_class == four_bar.CRANK_ROCKER, linkage_class <= four_bar.DOUBLE_CRANK
        p_least, p_largest = record[four_bar.P_LEAST * LANES + lane], record[four_bar.P_LARGEST * LANES + lane]
        q_least, q_largest = record[four_bar.Q_LEAST * LANES + lane], record[four_bar.Q_LARGEST * LANES + lane]
        smallest = four_bar.transmission_angle(p_least, q_largest)
        largest = four_bar.transmission_angle(p_largest, q_least)
        record[Row.N_LINKAGES * LANES + own] = record[Row.PHASES * LANES + own]
        record[Row.STATUS * LANES + own] = status
        record[Row.LINKAGE_CLASS * LANES + closed] = linkage_class
        record[Row.GRASHOF_MARGIN * LANES + closed] = margin
        record[Row.SWING_ANGLE * LANES + closed] = swing * _DEGREES if rocks else _NAN
        record[Row.MID_ANGLE * LANES + closed] = middle * _DEGREES if rocks else _NAN
        record[Row.TIME_RATIO * LANES + closed] = time_ratio if rocks else _NAN
        record[Row.MEAN_OUTPUT_RATIO * LANES + closed] = swing / (2.0 * math.pi) if rocks else _NAN
        record[Row.TRANSMISSION_ANGLE_MIN * LANES + closed] = smallest * _DEGREES if turns else _NAN
        record[Row.TRANSMISSION_ANGLE_MAX * LANES + closed] = largest * _DEGREES if turns else _NAN
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
