"""Reversals of the output in pairs of doubles: where doubles lose digits, they lose those of its rate as well."""

import math

import numpy as np
from numba import types

from explore.base.compiling import LANES, compiled
from explore.mechanisms.linkages.mark_errors import NODES, add_error, repeat_mark, store_error
from explore.mechanisms.linkages.pair_operations import PAIR_SIZES, fill_pairs
from explore.mechanisms.linkages.programs import GREATEST_ROW, LEAST_ROW
from explore.mechanisms.linkages.reversals import time_ratio

#: Number of Newton's steps from the places that doubles tell.
_STEPS = 3

_F1, _I1 = types.float64[::1], types.int64[::1]
#: Type of `sharpen_marks`.
MARKS_SIGNATURE = types.void(_F1, types.int64, PAIR_SIZES, _F1, _I1)


@compiled(MARKS_SIGNATURE, allocates=True)
def sharpen_marks(record, ratio_row, sizes, literals, integers):
    """Solve for the reversals in a record that is closed; fill the time ratio and the bound that follow from them.

    The program of these tables gives the output's rate and its slope by the angle.
    """
    rates, tangents, errors = np.empty(2 * NODES * LANES), np.empty(NODES * LANES), np.zeros(LANES)
    for row in (LEAST_ROW, GREATEST_ROW):
        marks = record[row * LANES :]
        for _ in range(_STEPS):
            fill_pairs(record, marks, 0, 1, rates, sizes, literals, integers, 0)
            for lane in range(LANES):
                mark = marks[lane] - 0.5 * (1.0 + marks[lane] * marks[lane]) * rates[lane] / rates[LANES + lane]
                # none at half a turn, whose half-tangent is infinite
                marks[lane] = mark if math.isfinite(mark) else marks[lane]
        repeat_mark(marks, tangents)
        fill_pairs(record, tangents, 0, NODES, rates, sizes, literals, integers, 1)
        add_error(rates, errors)
    for lane in range(LANES):
        least, greatest = record[LEAST_ROW * LANES + lane], record[GREATEST_ROW * LANES + lane]
        if least == least and greatest == greatest:
            record[ratio_row * LANES + lane] = time_ratio(least, greatest)
    store_error(errors, ratio_row, record)
