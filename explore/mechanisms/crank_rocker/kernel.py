"""The crank-rocker, compiled: closed-form metrics and windows. Limit positions and strokes are in `rocking`."""

import math

import numpy as np

from explore.compiling import PIECES_SIGNATURE, compiled
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.arctangent import arctangent
from explore.mechanisms.crank_rocker.columns import (
    CLUTCH,
    CYCLE,
    DRIVE_OVERLAPPED_TO_EXTENDED,
    DRIVE_SLOW,
    EXTENDED_TO_OVERLAPPED,
    INTERVAL,
    OVERLAPPED_TO_EXTENDED,
    PHASES,
    RETURN,
    MetricColumn,
    ParameterColumn,
)
from explore.mechanisms.four_bar import ACCELERATIONS, ROCKER_VELOCITY
from explore.mechanisms.rocking import SLOW_PASSES_ZERO

_DEGREES = 180.0 / math.pi


@compiled("void(float64[:, ::1], float64[:, ::1], int8[::1], float64[:, ::1], float64[:, ::1], float64[::1])")
def closed_form(parameters, metrics, status, kernel, singular, noise):
    """Fill class, margins, limit positions and transmission angles of a block of designs.

    See `explore.model.mechanism.Mechanism` for the arguments. Metrics are in the declared order and units, NaN where
    undefined.
    """
    for i in range(parameters.shape[0]):
        crank, coupler = parameters[i, ParameterColumn.CRANK], parameters[i, ParameterColumn.COUPLER]
        rocker, ground = parameters[i, ParameterColumn.ROCKER], parameters[i, ParameterColumn.GROUND]
        branch = parameters[i, ParameterColumn.BRANCH]
        metrics[:, i] = np.nan
        row = kernel[i]
        linkage_class, margin, turns = rocking.prepare(
            crank, coupler, rocker, ground, branch, row, singular, noise, status, i
        )
        metrics[MetricColumn.LINKAGE_CLASS, i] = linkage_class
        metrics[MetricColumn.GRASHOF_MARGIN, i] = margin
        if turns == 0.0:
            continue
        row[PHASES] = parameters[i, ParameterColumn.PHASES]
        four_crank_ground, p_min, q_min = row[four_bar.FOUR_CRANK_GROUND], row[four_bar.E1_E2], row[four_bar.E3_E4]
        smallest = 2.0 * arctangent(math.sqrt(p_min), math.sqrt(q_min + four_crank_ground))
        largest = 2.0 * arctangent(math.sqrt(p_min + four_crank_ground), math.sqrt(q_min))
        metrics[MetricColumn.TRANSMISSION_ANGLE_MIN, i] = smallest * _DEGREES
        metrics[MetricColumn.TRANSMISSION_ANGLE_MAX, i] = largest * _DEGREES
        if linkage_class == four_bar.DOUBLE_CRANK:
            continue
        swing, middle, time_ratio = rocking.solve_limit_positions(crank, coupler, rocker, ground, branch, row)
        metrics[MetricColumn.SWING_ANGLE, i] = swing * _DEGREES
        metrics[MetricColumn.MID_ANGLE, i] = middle * _DEGREES
        metrics[MetricColumn.TIME_RATIO, i] = time_ratio
        metrics[MetricColumn.MEAN_OUTPUT_RATIO, i] = swing / (2.0 * math.pi)


@compiled("float64(float64[::1], float64[::1], float64, float64[:, ::1], float64[:, ::1])")
def _velocity_difference(row, shift, t, node, scratch):
    """Rocker velocity at a point of the drive stroke minus that at the point shifted from it.

    The point is tan(offset/2) = T sinh(t) as in `explore.quadrature.node_placement`; ``shift`` holds sine and cosine of
    half the shift, the anchor and T. Sines and cosines of half angles are rotated, because sums of angles would lose
    the last bits of an offset, which matter next to a singularity.
    """
    tangent = shift[3] * math.sinh(t)
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    shifted_sine, shifted_cosine = sine * shift[1] + cosine * shift[0], cosine * shift[1] - sine * shift[0]
    if shift[2] == 0.0:
        node[0, 0], node[1, 0], node[0, 1], node[1, 1] = sine, cosine, shifted_sine, shifted_cosine
    else:
        node[0, 0], node[1, 0], node[0, 1], node[1, 1] = cosine, -sine, shifted_cosine, -shifted_sine
    four_bar.fill(row, node[0], node[1], 2, ACCELERATIONS, scratch)
    return scratch[ROCKER_VELOCITY, 0] - scratch[ROCKER_VELOCITY, 1]


@compiled("float64(float64[::1], float64[::1], float64, float64, float64, float64[:, ::1], float64[:, ::1])")
def _find_root(row, shift, low, high, sign, node, scratch):
    """Root of the velocity difference times `sign` between low, where that is negative, and high.

    By regula falsi (Illinois) with bisection.
    """
    at_low = sign * _velocity_difference(row, shift, low, node, scratch)
    at_high = sign * _velocity_difference(row, shift, high, node, scratch)
    root, side = low, 0
    for k in range(100):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        if k % 4 == 3 or not low < middle < high:
            middle = 0.5 * (low + high)
        if abs(middle - root) <= 3e-16 * abs(middle) or not low < middle < high:
            break
        root = middle
        value = sign * _velocity_difference(row, shift, root, node, scratch)
        if value == 0.0:
            break
        if value < 0.0:
            low, at_low = root, value
            at_high = 0.5 * at_high if side == -1 else at_high
            side = -1
        else:
            high, at_high = root, value
            at_low = 0.5 * at_low if side == 1 else at_low
            side = 1
    return root


@compiled("UniTuple(float64, 2)(float64[::1], int64, float64, float64)", allocates=True)
def _find_hand_over(row, anchor, first, last):
    """Half-tangents of the two points of the drive stroke, a period apart, where one clutch hands over to the next.

    A period has one such pair, because the rocker velocity has one extreme on each stroke (without exception in the
    10,000 designs of the accuracy campaign). The point of the larger acceleration is solved for; the other follows.
    """
    node, scratch, shift = np.empty((2, 2)), np.empty((four_bar.SIGNAL_ROWS, 2)), np.empty(4)
    constant_term = row[four_bar.E1_E2] if anchor == 0 else row[four_bar.E3_E4]
    scale = math.sqrt(constant_term / (constant_term + row[four_bar.FOUR_CRANK_GROUND]))
    sine = math.sin(math.pi / row[PHASES])
    cosine = 0.0 if row[PHASES] == 2.0 else math.cos(math.pi / row[PHASES])
    shift[0], shift[1], shift[2], shift[3] = sine, cosine, anchor, scale
    sign = -1.0 if anchor == 0 else 1.0
    latest = (last * cosine - sine) / (cosine + last * sine)
    t = _find_root(row, shift, math.asinh(first / scale), math.asinh(latest / scale), sign, node, scratch)
    _velocity_difference(row, shift, t, node, scratch)
    begin = scale * math.sinh(t)
    end = (begin * cosine + sine) / (cosine - begin * sine)
    if abs(scratch[four_bar.ROCKER_ACCELERATION, 1]) > abs(scratch[four_bar.ROCKER_ACCELERATION, 0]):
        shift[0] = -sine
        earliest = (first * cosine + sine) / (cosine - first * sine)
        t = _find_root(row, shift, math.asinh(earliest / scale), math.asinh(last / scale), -sign, node, scratch)
        end = scale * math.sinh(t)
        begin = (end * cosine - sine) / (cosine + end * sine)
    return begin, end


@compiled("int64(float64, float64, float64[:, ::1])")
def _interval_pieces(start, stop, out):
    """Fill the pieces of an explicit interval (rad), and return their number.

    One piece where it keeps its distance from the opposite of an anchor, else quarter turns.
    """
    out[3, 0] = stop - start
    anchor = np.round(0.5 * (start + stop) / math.pi)
    reach = 0.9 * math.pi
    if stop - anchor * math.pi < reach and start - anchor * math.pi > -reach:
        out[0, 0] = anchor % 2.0
        out[0, 1] = math.tan(0.5 * (start - anchor * math.pi))
        out[0, 2] = math.tan(0.5 * (stop - anchor * math.pi))
        return 1
    count = 0
    anchor = np.floor(start / math.pi + 0.5)
    while count < 3:
        end = min(stop, (anchor + 0.5) * math.pi)
        out[count, 0] = anchor % 2.0
        out[count, 1] = math.tan(0.5 * (start - anchor * math.pi))
        out[count, 2] = math.tan(0.5 * (end - anchor * math.pi))
        count += 1
        if end == stop:
            break
        start = end
        anchor += 1.0
    return count


@compiled(PIECES_SIGNATURE)
def pieces(row, window, drive, start, stop, out):
    """Fill the smooth pieces of a window; see `explore.model.mechanism.Mechanism`."""
    out[3, 1] = 0.0
    if window == CYCLE:
        out[0, 0], out[0, 1], out[0, 2] = 0.0, -1.0, 1.0
        out[1, 0], out[1, 1], out[1, 2] = 1.0, -1.0, 1.0
        out[3, 0] = 2.0 * math.pi
        return 2
    if window == INTERVAL:
        return _interval_pieces(start, stop, out)
    forward = row[four_bar.BRANCH] > 0.0
    if window == OVERLAPPED_TO_EXTENDED or window == EXTENDED_TO_OVERLAPPED:
        through_zero = (window == OVERLAPPED_TO_EXTENDED) == forward
    else:
        if drive >= DRIVE_OVERLAPPED_TO_EXTENDED:
            through_zero = (drive == DRIVE_OVERLAPPED_TO_EXTENDED) == forward
        else:
            through_zero = (row[SLOW_PASSES_ZERO] == 1.0) == (drive == DRIVE_SLOW)
        if window == RETURN:
            through_zero = not through_zero
    first, last = rocking.stroke_ends(row, through_zero)
    anchor = 0 if through_zero else 1
    length = 2.0 * (math.atan(last) - math.atan(first))
    out[3, 0] = length
    if window == CLUTCH:
        period = 2.0 * math.pi / row[PHASES]
        out[3, 0], out[3, 1] = period, max(period - length, 0.0)
        if period < length:
            first, last = _find_hand_over(row, anchor, first, last)
    out[0, 0], out[0, 1], out[0, 2] = anchor, first, last
    return 1
