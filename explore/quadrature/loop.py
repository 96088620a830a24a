"""The compiled loop over designs: windows to panels, panels to nodes, nodes to statistics and their error bound.

Numba has no cheap records, so arrays and constants are passed as long argument lists.
"""

import math

import numpy as np
from numba import types

from explore.compiling import FILL_SIGNATURE, PIECES_SIGNATURE, compiled, function_type
from explore.quadrature.magnitudes import POWERS, power_means
from explore.quadrature.moments import (
    FLAG_CV,
    FLAG_EXTREMES,
    FLAG_RESIDUAL,
    FLAG_SQUARES,
    FLAG_STD,
    FLAG_TERMS,
    mean_and_variance,
    refined_minimum,
)
from explore.quadrature.node_placement import map_panel, model_errors, node_count, place_nodes
from explore.quadrature.rules import LARGEST_NODE_COUNT

#: Columns of the statistics of one window and row; ROOT_MEAN and ROOT_POWER_MEAN are means of powers of the root of a
#: row that holds squares.
MEAN, VARIANCE, MINIMUM, MAXIMUM, ROOT_MEAN, ROOT_POWER_MEAN, BOUND = range(7)
N_STATISTICS = 7
MOST_PIECES = 3
NODE_CAPACITY = MOST_PIECES * (LARGEST_NODE_COUNT + 2)
#: Natural logarithm of the tolerance over the target of the first node count: a cv multiplies the error by a few.
HEADROOM = 1.5
#: Most node counts that are tried for one design and window.
MOST_ROUNDS = 4
#: Rounding error of one statistic relative to the rms of its signal, from the accuracy campaign.
ROUNDING = 4e-15

FILL_TYPE, PIECES_TYPE = function_type(FILL_SIGNATURE), function_type(PIECES_SIGNATURE)
_F1, _F2 = types.float64[::1], types.float64[:, ::1]
_I1, _I2, _I3 = types.int64[::1], types.int64[:, ::1], types.int64[:, :, ::1]


@compiled()
def _signal_bound(flags, quadrature, rounding, mean, variance, tolerance):
    """Bound of the worst flagged statistic of one signal, in the norms of `explore.evaluation.evaluate`."""
    rms = math.sqrt(mean * mean + variance)
    std = math.sqrt(variance)
    bound = quadrature + rounding
    if flags & FLAG_STD and std > 0.0:
        bound = max(bound, (0.5 * quadrature * rms + rounding * std) / std + rounding)
    if flags & FLAG_CV and abs(mean) >= 1e3 * tolerance * rms and std > 0.0:
        bound = max(
            bound,
            quadrature * (0.5 * rms * rms / variance + rms / abs(mean)) + rounding * (rms / std + rms / abs(mean)),
        )
    return bound


@compiled()
def _term_sum_bound(flags, s, terms, quadrature, values, noise, tolerance):
    """Bound of the worst statistic of a signal that is a sum of terms, and the rounding part of the bound."""
    mean, variance = values[s, MEAN], values[s, VARIANCE]
    squares = flags & FLAG_SQUARES != 0
    signal_rms = math.sqrt(abs(mean)) if squares else math.sqrt(mean * mean + variance)
    terms_rms = math.sqrt(values[terms, MEAN] * values[terms, MEAN] + values[terms, VARIANCE])
    rounding = ROUNDING
    if signal_rms > 0.0:
        # The terms round at most like accelerations. Their sum may be much smaller than a term.
        rounding = ROUNDING * (1.0 + 0.2 * terms_rms * (1.0 + noise * (1.0 + noise)) / signal_rms)
    if flags & FLAG_RESIDUAL and signal_rms > 0.0:
        quadrature *= (terms_rms / signal_rms) ** 2
    if squares:
        return quadrature + rounding, rounding
    bound = _signal_bound(flags, quadrature, rounding, mean, variance, tolerance)
    return bound, _signal_bound(flags, 0.0, rounding, mean, variance, tolerance)


@compiled()
def _worst_bound(flags, orders, term_rows, w, values, errors, noise, tolerance):
    """Bound of the worst statistic over all rows, and whether more nodes can lower one that misses the tolerance."""
    slow_rms, largest_rms = 0.0, 0.0
    second, fourth = errors[0], errors[1]
    for s in range(flags.shape[1]):
        if flags[w, s] and flags[w, s] != FLAG_TERMS and term_rows[s] < 0:
            rms = math.sqrt(values[s, MEAN] * values[s, MEAN] + values[s, VARIANCE])
            largest_rms = max(largest_rms, rms)
            slow_rms = max(slow_rms, rms) if orders[w, s] == 2 else slow_rms
    worst, improvable = 0.0, False
    for s in range(flags.shape[1]):
        if flags[w, s] and term_rows[s] >= 0:
            quadrature = errors[orders[w, s] // 2 - 1]
            bound, rounding = _term_sum_bound(flags[w, s], s, term_rows[s], quadrature, values, noise, tolerance)
            improvable = improvable or (bound > tolerance and bound > 2.0 * rounding)
            values[s, BOUND] = bound
            worst = max(worst, bound)
        elif flags[w, s] and flags[w, s] != FLAG_TERMS:
            mean, variance = values[s, MEAN], values[s, VARIANCE]
            rms = math.sqrt(mean * mean + variance)
            # Intermediate terms and signals of the same order may be larger than this signal, and so their rounding.
            terms = largest_rms + noise * (1.0 + noise) if orders[w, s] == 4 else slow_rms + noise
            rounding = ROUNDING * (1.0 + 0.2 * terms / rms) if rms > 0.0 else ROUNDING
            bound = _signal_bound(
                flags[w, s], fourth if orders[w, s] == 4 else second, rounding, mean, variance, tolerance
            )
            if bound > tolerance:
                improvable = improvable or bound > 2.0 * _signal_bound(
                    flags[w, s], 0.0, rounding, mean, variance, tolerance
                )
            values[s, BOUND] = bound
            worst = max(worst, bound)
    return worst, improvable


@compiled()
def _sample_moments(
    fill, row, needs, flags, orders, term_rows, w, ends, noise, tolerance,
    panels, parts, shapes, offsets, size_of, row_of, table,
    t, sin_half, cos_half, weight, scratch, values,
):  # fmt: skip
    """Sample until the moments meet the tolerance or more nodes cannot lower the bound; return nodes and bound."""
    order = 2
    for s in range(flags.shape[1]):
        order = max(order, orders[w, s] if flags[w, s] else 2)
    target = math.log(tolerance) - HEADROOM
    nodes, total, worst = 0, 0, 0.0
    for _ in range(MOST_ROUNDS):
        total, second, fourth, sixth, is_finest = 0, 0.0, 0.0, 0.0, True
        for p in range(panels):
            half, rate = shapes[p, 1], shapes[p, 3]
            count = node_count(target, half, rate, order, size_of)
            place_nodes(
                shapes, p, int(parts[p, 0]), count, total, row_of, table, ends,
                t, sin_half, cos_half, weight,
            )  # fmt: skip
            errors = model_errors(count, half, rate)
            second += errors[0]
            fourth += errors[1]
            sixth += errors[2]
            is_finest = is_finest and count == LARGEST_NODE_COUNT
            offsets[p] = total
            total += count + 2 if ends else count
        offsets[panels] = total
        nodes += total
        fill(row, sin_half, cos_half, total, needs[w], scratch)
        for s in range(flags.shape[1]):
            if flags[w, s]:
                mean, variance = mean_and_variance(scratch, s, weight, total, parts[3, 0], parts[3, 1])
                values[s, MEAN], values[s, VARIANCE] = mean, variance
        worst, improvable = _worst_bound(flags, orders, term_rows, w, values, (second, fourth, sixth), noise, tolerance)
        if not improvable or is_finest:
            break
        # Continue from the modelled error of this count, which may be far below the target.
        reached = math.log(sixth if order == 6 else fourth if order == 4 else second)
        target = min(target, reached) - math.log(worst / tolerance) - 0.5
    return nodes, worst


@compiled()
def _find_extreme(fill, kernel, needs, row, panels, sign, parts, shapes, offsets, t, scratch, node, node_signals):
    """Extreme of the signal over all panels, refined from each local minimum of ``sign * signal`` at the samples."""
    best = np.inf
    samples = scratch[row]
    for p in range(panels):
        begin, end = offsets[p], offsets[p + 1]
        for j in range(begin, end):
            value = sign * samples[j]
            left = sign * samples[j - 1] if j > begin else np.inf
            right = sign * samples[j + 1] if j < end - 1 else np.inf
            if value <= left and value <= right:
                low, high = t[max(j - 1, begin)], t[min(j + 1, end - 1)]
                refined, _ = refined_minimum(
                    fill, kernel, shapes[p], int(parts[p, 0]), row, needs, sign,
                    low, t[j], high, value, node, node_signals,
                )  # fmt: skip
                best = min(best, refined)
    return sign * best


@compiled()
def _fill_extremes(
    fill, row, needs, s, panels, has_minimum, has_maximum, rest, parts, shapes, offsets, t, scratch,
    node, node_signals, values,
):  # fmt: skip
    """Fill the requested extremes of a signal, which is 0 over the part `rest` of the averaging length."""
    if has_minimum:
        low = _find_extreme(fill, row, needs, s, panels, 1.0, parts, shapes, offsets, t, scratch, node, node_signals)
        values[s, MINIMUM] = min(low, 0.0) if rest > 0.0 else low
    if has_maximum:
        high = _find_extreme(fill, row, needs, s, panels, -1.0, parts, shapes, offsets, t, scratch, node, node_signals)
        values[s, MAXIMUM] = max(high, 0.0) if rest > 0.0 else high


@compiled()
def _repeats_row_before(slots, w, s, scratch, total):
    """Whether the row before has the same samples, as with pin forces without masses, and all extremes of this row."""
    if s == 0:
        return False
    for k in (MINIMUM, MAXIMUM):
        if slots[w, s, k] >= 0 and slots[w, s - 1, k] < 0:
            return False
    for j in range(total):  # noqa: SIM110  (compiled)
        if scratch[s, j] != scratch[s - 1, j]:  # most rows differ in the first sample
            return False
    return True


@compiled()
def _fill_extremes_and_powers(
    fill, kernel, needs, flags, s, w, slots, panels, parts, shapes, offsets, tolerance,
    size_of, row_of, table, t, scratch, node, node_signals, values,
):  # fmt: skip
    """Fill extremes and means of powers of one row; return the nodes used and the largest bound of the powers."""
    if flags & FLAG_EXTREMES and _repeats_row_before(slots, w, s, scratch, offsets[panels]):
        values[s, MINIMUM], values[s, MAXIMUM] = values[s - 1, MINIMUM], values[s - 1, MAXIMUM]
    elif flags & FLAG_EXTREMES:
        _fill_extremes(
            fill, kernel, needs, s, panels, slots[w, s, MINIMUM] >= 0, slots[w, s, MAXIMUM] >= 0, parts[3, 1],
            parts, shapes, offsets, t, scratch, node, node_signals, values,
        )  # fmt: skip
    nodes, worst = 0, 0.0
    for k in range(POWERS if flags & FLAG_SQUARES else 0):
        if slots[w, s, ROOT_MEAN + k] >= 0:
            mean, bound, count = power_means(
                fill, kernel, needs, s, k, panels, parts, shapes, tolerance, size_of, row_of, table, node, node_signals
            )
            values[s, ROOT_MEAN + k] = mean / parts[3, 0]
            values[s, BOUND] += bound
            worst = max(worst, values[s, BOUND])
            nodes += count
    return nodes, worst


@compiled(
    types.void(
        FILL_TYPE, PIECES_TYPE, _F2, _F2, _F1, types.boolean[::1],
        _I1, _F2, types.int64, _I1, _I2, _I2, _I1, types.float64,
        _I1, _I1, _F2,
        _I3, _F2, _I1, _F1,
    ), allocates=True)  # fmt: skip
def sample(
    fill, pieces, kernel, singular, noise, active,
    windows, intervals, drive, needs, flags, orders, term_rows, tolerance,
    size_of, row_of, table,
    slots, statistics, nodes, error,
):  # fmt: skip
    """Statistics of every active design over every window.

    Parameters
    ----------
    fill, pieces
        Compiled functions of the mechanism.
    kernel : (n, k), singular : (n, 3), noise : (n,)
        From the closed form of the mechanism.
    active : (n,)
        Which designs to sample; the entries of the others are not changed.
    windows : (w,), intervals : (w, 2), drive
        Codes of the windows, start and stop (rad) of explicit ones, code of the drive stroke.
    needs : (w,), flags : (w, s), orders : (w, s)
        Bits of the signals to fill; for each row, flags of `explore.quadrature.moments` (0: skip) and pole order.
    term_rows : (s,)
        For a signal that is a sum of terms, the row with the size of the terms; -1 for other signals.
    tolerance : float
        Relative, in the norms of `explore.evaluation.evaluate`.
    size_of, row_of, table
        From `explore.quadrature.rules`.
    slots : (w, s, 7)
        Row of `statistics` for each statistic (MEAN, VARIANCE, … of this module) of a row over a window; -1 for none.
    statistics : (m, n), nodes : (n,), error : (n,)
        Filled: statistics for unit speed and rad; signal evaluations; bound.
    """
    rows = flags.shape[1]
    # Small enough for the first-level cache at usual node counts.
    scratch, values = np.empty((rows, NODE_CAPACITY)), np.zeros((rows, N_STATISTICS))
    t, sin_half = np.empty(NODE_CAPACITY), np.empty(NODE_CAPACITY)
    cos_half, weight = np.empty(NODE_CAPACITY), np.empty(NODE_CAPACITY)
    node, node_signals = np.empty((2, 1)), np.empty((rows, 1))
    parts, shapes = np.zeros((MOST_PIECES + 1, 3)), np.zeros((MOST_PIECES, 4))
    offsets = np.zeros(MOST_PIECES + 1, np.int64)
    for i in range(kernel.shape[0]):
        if not active[i]:
            continue
        row = kernel[i]
        for w in range(windows.shape[0]):
            panels = pieces(row, windows[w], drive, intervals[w, 0], intervals[w, 1], parts)
            ends = False
            for p in range(panels):
                map_panel(parts, p, singular, i, shapes)
            for s in range(rows):
                ends = ends or (flags[w, s] & FLAG_EXTREMES) != 0
            count, worst = _sample_moments(
                fill, row, needs, flags, orders, term_rows, w, ends, noise[i], tolerance,
                panels, parts, shapes, offsets, size_of, row_of, table,
                t, sin_half, cos_half, weight, scratch, values,
            )  # fmt: skip
            nodes[i] += count
            for s in range(rows):
                if not flags[w, s]:
                    continue
                # A call only where needed: here each array argument costs two atomic reference counts.
                if flags[w, s] & (FLAG_EXTREMES | FLAG_SQUARES):
                    count, bound = _fill_extremes_and_powers(
                        fill, row, needs[w], flags[w, s], s, w, slots, panels, parts, shapes, offsets, tolerance,
                        size_of, row_of, table, t, scratch, node, node_signals, values,
                    )  # fmt: skip
                    nodes[i] += count
                    worst = max(worst, bound)
                for k in range(N_STATISTICS):
                    if slots[w, s, k] >= 0:
                        statistics[slots[w, s, k], i] = values[s, k]
            error[i] = max(error[i], worst)
