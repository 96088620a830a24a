"""How far the outputs of designs move in a dwell of an angle, or how long they rest within a travel."""

import math

import numpy as np
from numba import types

from explore.base.compiling import compiled
from explore.mechanisms.targets.dwell_errors.pieces import (
    MOST_PIECES,
    PIECE_SIZE,
    POWER,
    lay_pieces,
    make_ends,
    note_cells,
)
from explore.mechanisms.targets.dwell_errors.travels import (
    MOST_REVERSALS,
    N_STARTS,
    find_reversals,
    least_travel,
    longest_rest,
    middle_start,
    travel,
)
from explore.mechanisms.targets.path_errors.curve import ROWS, TURN

# Measures of a design: the least travel in the dwell or the angle of the longest rest, rad; the bound of its error and
# what this is relative to, the travel in the turn or the turn; and the input angle at which the dwell starts, rad, with
# the bound of its error.
VALUE, ERROR, SCALE, BEGIN, BEGIN_ERROR = range(5)
N_MEASURES = 5

#: Error of a least travel by that of its start, over the travel in the turn.
_START_ERROR = 1e-13

_F2 = types.float64[:, ::1]


@compiled(types.void(ROWS, _F2, types.boolean, types.float64, types.float64, _F2), allocates=True)
def measure_dwells(output, designs, turns, angle, most, measures):
    """Measure designs, (n, p): fill `measures` (n, N_MEASURES).

    It is NaN where the first number of a design is, or where its output is not defined.

    `output` is a curve at rows of angles, whose first two numbers are cosine and sine of the output's angle in the
    frame, times a positive number, if it `turns`, or its place and any number; then come both derivatives by the input
    angle. The dwell has an angle, rad; or if that is 0, the output moves by `most` in it.
    """
    pieces, cells = np.empty((MOST_PIECES, PIECE_SIZE)), np.empty(N_STARTS + 1, np.int64)
    ends, events = make_ends(designs.shape[1]), np.empty(2 * MOST_REVERSALS + 1)
    reversals, travels = np.empty((MOST_REVERSALS, 2)), np.empty(N_STARTS)
    for k in range(len(designs)):
        measures[k, :] = math.nan
        if math.isnan(designs[k, 0]):
            continue
        count, error, end = lay_pieces(output, designs[k], turns, ends, pieces)
        if count == 0:
            continue
        found = find_reversals(pieces, count, reversals)
        note_cells(pieces, count, cells)
        motion = pieces, cells, end - pieces[0, POWER], reversals, min(found, MOST_REVERSALS)
        whole = travel(motion, 0.0, TURN)
        error = whole if found > MOST_REVERSALS else 2.0 * error + _START_ERROR * whole
        if angle > 0.0:
            begin, value = least_travel(motion, angle, math.nan, travels, events)
            begin, moved = middle_start(motion, angle, begin, error)
        else:
            value, begin, error_of_angle = longest_rest(motion, most, error, travels, events)
            begin, moved = middle_start(motion, value, begin, error)
            error = error_of_angle
        measures[k, VALUE], measures[k, ERROR], measures[k, SCALE] = value, error, whole if angle > 0.0 else TURN
        measures[k, BEGIN], measures[k, BEGIN_ERROR] = begin - TURN * math.floor(begin / TURN), moved
