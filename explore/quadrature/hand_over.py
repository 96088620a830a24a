"""Where one of several equal mechanisms behind one-way clutches hands the output over to the next."""

import math

import numpy as np

from explore.compiling import LANES
from explore.subroutines import subroutine

_MOST_STEPS = 100
_CLOSE = 3e-16

# Rows of the state: bracket and its values, root, side of the last change, whether the lane is done; sine and cosine of
# half the shift; sign of the difference, and the difference.
_LOW, _HIGH, _AT_LOW, _AT_HIGH, _ROOT, _SIDE, _DONE, _SINE, _COSINE, _SIGN, _VALUE = (row * LANES for row in range(11))
STATE_SIZE = 11 * LANES


@subroutine()
def _difference(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals):
    """Fill the rate at points of the stroke, `points` in t, minus the rate at the points shifted from them.

    A point is tan(offset/2) = T sinh(t). Tangents are rotated, because sums of angles would lose the last bits of an
    offset, which matter next to a singularity.
    """
    for lane in range(LANES):
        tangent = scale[lane] * math.sinh(points[lane])
        tangents[lane] = tangent
        tangents[LANES + lane] = (tangent * state[_COSINE + lane] + state[_SINE + lane]) / (
            state[_COSINE + lane] - tangent * state[_SINE + lane]
        )
    fill(constants, tangents, anchor, law, variant, 2, needs, signals)
    for lane in range(LANES):
        state[_VALUE + lane] = state[_SIGN + lane] * (
            signals[row * LANES + lane] - signals[(rows + row) * LANES + lane]
        )


@subroutine()
def _find_roots(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals):
    """Find the root in each lane between LOW, where the difference is negative, and HIGH: regula falsi (Illinois)."""
    for side in (_LOW, _HIGH):
        for lane in range(LANES):
            points[lane] = state[side + lane]
        _difference(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals)
        for lane in range(LANES):
            state[(_AT_LOW if side == _LOW else _AT_HIGH) + lane] = state[_VALUE + lane]
    for lane in range(LANES):
        state[_ROOT + lane], state[_SIDE + lane], state[_DONE + lane] = state[_LOW + lane], 0.0, 0.0
    for k in range(_MOST_STEPS):
        working = False
        for lane in range(LANES):
            low, high, at_low, at_high = (
                state[_LOW + lane],
                state[_HIGH + lane],
                state[_AT_LOW + lane],
                state[_AT_HIGH + lane],
            )
            middle = (low * at_high - high * at_low) / (at_high - at_low)
            if k % 4 == 3 or not low < middle < high:
                middle = 0.5 * (low + high)
            if abs(middle - state[_ROOT + lane]) <= _CLOSE * abs(middle) or not low < middle < high:
                state[_DONE + lane] = 1.0
            points[lane] = state[_ROOT + lane] if state[_DONE + lane] == 1.0 else middle
            working = working or state[_DONE + lane] == 0.0
        if not working:
            break
        _difference(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals)
        for lane in range(LANES):
            if state[_DONE + lane] == 1.0:
                continue
            value = state[_VALUE + lane]
            state[_ROOT + lane] = points[lane]
            if value == 0.0:
                state[_DONE + lane] = 1.0
            elif value < 0.0:
                state[_LOW + lane], state[_AT_LOW + lane] = points[lane], value
                state[_AT_HIGH + lane] *= 0.5 if state[_SIDE + lane] == -1.0 else 1.0
                state[_SIDE + lane] = -1.0
            else:
                state[_HIGH + lane], state[_AT_HIGH + lane] = points[lane], value
                state[_AT_LOW + lane] *= 0.5 if state[_SIDE + lane] == 1.0 else 1.0
                state[_SIDE + lane] = 1.0


@subroutine(allocates=True)
def find_hand_overs(
    fill, constants, anchor, law, variant, needs, rows, row, rate_row, rising, scale, periods, first, last
):
    """Replace the ends of strokes by the two points, a period apart, where one clutch hands over to the next.

    A period has one such pair, because the rate has one extreme on each stroke. The point where the rate changes more
    is solved for; the other follows.

    Parameters
    ----------
    needs, rows, row, rate_row
        Of `fill`; `row` is the rate of the output and `rate_row` its derivative.
    rising : (LANES,) array
        1 where the magnitude of the rate is that of a positive rate, -1 of a negative one.
    scale, periods : (LANES,) arrays
        T, and rad.
    first, last : (LANES,) arrays
        Half-tangents of the ends; replaced.
    """
    state, points = np.zeros(STATE_SIZE), np.zeros(LANES)
    tangents, signals = np.zeros(2 * LANES), np.zeros(2 * rows * LANES)
    begin, end = np.zeros(LANES), np.zeros(LANES)
    for lane in range(LANES):
        sine, cosine = math.sin(0.5 * periods[lane]), math.cos(0.5 * periods[lane])
        cosine = 0.0 if abs(cosine) < 1e-15 else cosine
        latest = (last[lane] * cosine - sine) / (cosine + last[lane] * sine)
        state[_SINE + lane], state[_COSINE + lane], state[_SIGN + lane] = sine, cosine, rising[lane]
        state[_LOW + lane], state[_HIGH + lane] = (
            math.asinh(first[lane] / scale[lane]),
            math.asinh(latest / scale[lane]),
        )
    _find_roots(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals)
    for lane in range(LANES):
        points[lane] = state[_ROOT + lane]
    _difference(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals)
    again = False
    for lane in range(LANES):
        begin[lane], end[lane] = tangents[lane], tangents[LANES + lane]
        points[lane] = (
            1.0 if abs(signals[(rows + rate_row) * LANES + lane]) > abs(signals[rate_row * LANES + lane]) else 0.0
        )
        again = again or points[lane] == 1.0
    if again:
        chosen = points.copy()
        for lane in range(LANES):
            sine, cosine = state[_SINE + lane], state[_COSINE + lane]
            earliest = (first[lane] * cosine + sine) / (cosine - first[lane] * sine)
            state[_SINE + lane], state[_SIGN + lane] = -sine, -rising[lane]
            state[_LOW + lane], state[_HIGH + lane] = (
                math.asinh(earliest / scale[lane]),
                math.asinh(last[lane] / scale[lane]),
            )
        _find_roots(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals)
        for lane in range(LANES):
            points[lane] = state[_ROOT + lane]
        _difference(fill, constants, anchor, law, variant, needs, rows, row, scale, state, points, tangents, signals)
        for lane in range(LANES):
            if chosen[lane] == 1.0:
                begin[lane], end[lane] = tangents[LANES + lane], tangents[lane]
    for lane in range(LANES):
        first[lane], last[lane] = begin[lane], end[lane]
