"""How far rounding moves the reversals of the output: what disturbed operations change its rate by, over its slope.

Strokes that are equally long but for that are half a turn each: the same one is slow in all such designs, not the one
that rounding makes longer.
"""

import math

import numpy as np
from numba import types

from explore.base.compiling import FILL_SIGNATURE, LANES, compiled, function_type
from explore.base.lanes.disturbance import DISTURBANCE
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.programs import CLOSED_ERROR_ROW, GREATEST_ROW, LEAST_ROW

#: Number of times that the rate is disturbed at each reversal.
NODES = 8
#: Bound of an error over what a disturbance of that size changes, as that of samples; see `quadrature.rounding`.
_SHARE = 4e-16 / DISTURBANCE
#: Rounding of the lengths of strokes from the half-tangents of their ends, rad.
_ROUNDING = 3e-15
#: Largest half-tangent at which a rate is disturbed: beyond it is half a turn.
_LARGEST = 1e15
#: Largest difference of strokes that are called equally long, relative, however far rounding moves their ends.
_EQUAL = 1e-9
#: Least half-tangent of the end of a stroke of half a turn, so that the other end has a finite one.
_LEAST = 1e-17

_F1 = types.float64[::1]
#: Type of `bound_marks`.
BOUND_MARKS_SIGNATURE = types.void(_F1, types.int64, function_type(FILL_SIGNATURE))


@compiled(BOUND_MARKS_SIGNATURE, allocates=True)
def bound_marks(record, ratio_row, disturbed_rate):
    """Fill the bound of the errors of strokes in a record that is closed.

    `disturbed_rate` fills the output's rate and its slope by the angle.
    """
    tangents, rates, errors = np.empty(NODES * LANES), np.empty(2 * NODES * LANES), np.zeros(LANES)
    for row in range(LEAST_ROW, GREATEST_ROW + 1):
        repeat_mark(record[row * LANES :], tangents)
        disturbed_rate(record, tangents, 0, 0, 0, NODES, 1, rates)
        add_error(rates, errors)
    store_error(errors, ratio_row, record)


@subroutine()
def repeat_mark(marks, tangents):
    """Fill the nodes at which a rate is disturbed."""
    for k in range(NODES * LANES):
        tangents[k] = min(max(marks[k % LANES], -_LARGEST), _LARGEST)


@subroutine()
def add_error(rates, errors):
    """Add the error of a mark of each lane, rad, from disturbed rates and slopes."""
    for lane in range(LANES):
        total = 0.0
        for j in range(NODES):
            change = rates[2 * j * LANES + lane] / rates[(2 * j + 1) * LANES + lane]
            total += change * change
        errors[lane] += _SHARE * math.sqrt(total / NODES)


@subroutine()
def store_error(errors, ratio_row, record):
    """Fill the sum of the errors of both marks over the lengths of the strokes, for lanes that have these.

    Strokes that differ by less take half a turn each.
    """
    for lane in range(LANES):
        at, ratio = CLOSED_ERROR_ROW * LANES + lane, record[ratio_row * LANES + lane]
        error = (errors[lane] + _ROUNDING) * (1.0 + ratio) * (1.0 + 1.0 / ratio) / (2.0 * math.pi)
        # not a number where a disturbed design has no motion
        error = error if error == error else math.inf
        record[at] = error if ratio == ratio else record[at]
        if ratio - 1.0 <= min(error, _EQUAL):
            record[ratio_row * LANES + lane] = 1.0
            _place_opposite(record, lane)


@subroutine()
def _place_opposite(record, lane):
    """Place the mark of a lane that is farther from the anchor half a turn from the other one."""
    near, far = LEAST_ROW * LANES + lane, GREATEST_ROW * LANES + lane
    if abs(record[near]) > abs(record[far]):
        near, far = far, near
    record[near] = math.copysign(max(abs(record[near]), _LEAST), record[near])
    record[far] = -1.0 / record[near]
