"""The compiled loop over designs: windows to panels, panels to nodes, nodes to statistics and their error bound."""

import math

import numpy as np
from numba import types

from explore.compiling import FILL_SIGNATURE, PIECES_SIGNATURE, compiled, function_type
from explore.magnitudes import POWERS, power_means
from explore.quadrature import LARGEST, model_errors, node_count, panel, place_nodes
from explore.statistics import CV, EXTREMES, REST, SQUARES, STD, TERMS, moments, refined_minimum

#: Columns of the statistics of one window and row: of a row of squares the means of the root's powers; the bound.
MEAN, VARIANCE, MINIMUM, MAXIMUM, ROOT_MEAN, ROOT_POWER_MEAN, BOUND = range(7)
STATISTICS = 7
PIECES = 3
CAPACITY = PIECES * (LARGEST + 2)
#: Natural logarithm by which the first node count undercuts the tolerance: a cv multiplies the error by a few.
HEADROOM = 1.5
#: How often the nodes of a design may be increased when its statistics turn out to need it.
ROUNDS = 4
#: Rounding of one statistic in units of the signal's own size, from the accuracy campaign.
ROUNDING = 4e-15


FILL, PIECES_FUNCTION = function_type(FILL_SIGNATURE), function_type(PIECES_SIGNATURE)
_F1, _F2 = types.float64[::1], types.float64[:, ::1]
_I1, _I2, _I3 = types.int64[::1], types.int64[:, ::1], types.int64[:, :, ::1]


@compiled()
def _bounds(asked, quadrature, rounding, mean, variance, tolerance):
    """Bound of the worst statistic asked of one signal; see `explore.evaluate` for the norms."""
    rms = math.sqrt(mean * mean + variance)
    std = math.sqrt(variance)
    bound = quadrature + rounding
    if asked & STD and std > 0.0:
        bound = max(bound, (0.5 * quadrature * rms + rounding * std) / std + rounding)
    if asked & CV and abs(mean) >= 1e3 * tolerance * rms and std > 0.0:
        bound = max(
            bound,
            quadrature * (0.5 * rms * rms / variance + rms / abs(mean)) + rounding * (rms / std + rms / abs(mean)),
        )
    return bound


@compiled()
def _loaded_bounds(asked, s, terms, quadrature, found, noise, tolerance):
    """Bound of a signal that is a sum of terms, and the part of it that is rounding."""
    mean, variance = found[s, MEAN], found[s, VARIANCE]
    squares = asked & SQUARES != 0
    size = math.sqrt(abs(mean)) if squares else math.sqrt(mean * mean + variance)
    most = math.sqrt(found[terms, MEAN] * found[terms, MEAN] + found[terms, VARIANCE])
    # The terms are of the kind of accelerations at most, and may be larger than what is left of them.
    rounding = ROUNDING * (1.0 + 0.2 * most * (1.0 + noise * (1.0 + noise)) / size) if size > 0.0 else ROUNDING
    if asked & REST and size > 0.0:
        quadrature *= (most / size) ** 2
    if squares:
        return quadrature + rounding, rounding
    bound = _bounds(asked, quadrature, rounding, mean, variance, tolerance)
    return bound, _bounds(asked, 0.0, rounding, mean, variance, tolerance)


@compiled()
def _worst_bound(asked, orders, term_rows, w, found, errors, noise, tolerance):
    """Bound of the worst statistic over all rows, and whether more nodes would lower it enough."""
    slow, fast = 0.0, 0.0
    second, fourth = errors[0], errors[1]
    for s in range(asked.shape[1]):
        if asked[w, s] and asked[w, s] != TERMS and term_rows[s] < 0:
            rms = math.sqrt(found[s, MEAN] * found[s, MEAN] + found[s, VARIANCE])
            fast = max(fast, rms)
            slow = max(slow, rms) if orders[w, s] == 2 else slow
    worst, improvable = 0.0, False
    for s in range(asked.shape[1]):
        if asked[w, s] and term_rows[s] >= 0:
            quadrature = errors[orders[w, s] // 2 - 1]
            bound, rounding = _loaded_bounds(asked[w, s], s, term_rows[s], quadrature, found, noise, tolerance)
            improvable = improvable or (bound > tolerance and bound > 2.0 * rounding)
            found[s, BOUND] = bound
            worst = max(worst, bound)
        elif asked[w, s] and asked[w, s] != TERMS:
            mean, variance = found[s, MEAN], found[s, VARIANCE]
            rms = math.sqrt(mean * mean + variance)
            # Intermediate terms and signals of the same kind are rounded too, and may be larger than this signal.
            terms = fast + noise * (1.0 + noise) if orders[w, s] == 4 else slow + noise
            rounding = ROUNDING * (1.0 + 0.2 * terms / rms) if rms > 0.0 else ROUNDING
            bound = _bounds(asked[w, s], fourth if orders[w, s] == 4 else second, rounding, mean, variance, tolerance)
            if bound > tolerance:
                improvable = improvable or bound > 2.0 * _bounds(asked[w, s], 0.0, rounding, mean, variance, tolerance)
            found[s, BOUND] = bound
            worst = max(worst, bound)
    return worst, improvable


@compiled()
def _moments(
    fill, row, needs, asked, orders, term_rows, w, ends, noise, tolerance,
    panels, parts, shapes, offsets, size_of, row_of, table,
    t, sin_half, cos_half, weight, scratch, found,
):  # fmt: skip
    """Sample until the moments meet the tolerance or more nodes cannot help: (nodes, bound)."""
    order = 2
    for s in range(asked.shape[1]):
        order = max(order, orders[w, s] if asked[w, s] else 2)
    target = math.log(tolerance) - HEADROOM
    nodes, total, worst = 0, 0, 0.0
    for _ in range(ROUNDS):
        total, second, fourth, sixth, full = 0, 0.0, 0.0, 0.0, True
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
            full = full and count == LARGEST
            offsets[p] = total
            total += count + 2 if ends else count
        offsets[panels] = total
        nodes += total
        fill(row, sin_half, cos_half, total, needs[w], scratch)
        for s in range(asked.shape[1]):
            if asked[w, s]:
                mean, variance = moments(scratch, s, weight, total, parts[3, 0], parts[3, 1])
                found[s, MEAN], found[s, VARIANCE] = mean, variance
        worst, improvable = _worst_bound(asked, orders, term_rows, w, found, (second, fourth, sixth), noise, tolerance)
        if not improvable or full:
            break
        # Aim lower than what was reached, which may be far below what was asked.
        reached = math.log(sixth if order == 6 else fourth if order == 4 else second)
        target = min(target, reached) - math.log(worst / tolerance) - 0.5
    return nodes, worst


@compiled()
def _extreme(fill, kernel, needs, row, panels, sign, parts, shapes, offsets, t, scratch, node, one):
    """Smallest ``sign * signal`` over all panels, refined from every local minimum of the samples."""
    best = np.inf
    values = scratch[row]
    for p in range(panels):
        begin, end = offsets[p], offsets[p + 1]
        for j in range(begin, end):
            value = sign * values[j]
            left = sign * values[j - 1] if j > begin else np.inf
            right = sign * values[j + 1] if j < end - 1 else np.inf
            if value <= left and value <= right:
                low, high = t[max(j - 1, begin)], t[min(j + 1, end - 1)]
                refined, _ = refined_minimum(
                    fill, kernel, shapes[p], int(parts[p, 0]), row, needs, sign,
                    low, t[j], high, value, node, one,
                )  # fmt: skip
                best = min(best, refined)
    return sign * best


@compiled()
def _extremes(
    fill, row, needs, s, panels, lowest, highest, rest, parts, shapes, offsets, t, scratch, node, one, found
):  # fmt: skip
    """The extremes asked of a signal, which is 0 where it rests."""
    if lowest:
        low = _extreme(fill, row, needs, s, panels, 1.0, parts, shapes, offsets, t, scratch, node, one)
        found[s, MINIMUM] = min(low, 0.0) if rest > 0.0 else low
    if highest:
        high = _extreme(fill, row, needs, s, panels, -1.0, parts, shapes, offsets, t, scratch, node, one)
        found[s, MAXIMUM] = max(high, 0.0) if rest > 0.0 else high


@compiled()
def _repeats(slots, w, s, scratch, total):
    """Whether a row has the samples of the one before, as pin forces have without masses, of which as much is asked."""
    if s == 0:
        return False
    for k in (MINIMUM, MAXIMUM):
        if slots[w, s, k] >= 0 and slots[w, s - 1, k] < 0:
            return False
    for j in range(total):  # noqa: SIM110  (compiled)
        if scratch[s, j] != scratch[s - 1, j]:  # most often the first already
            return False
    return True


@compiled(
    types.void(
        FILL, PIECES_FUNCTION, _F2, _F2, _F1, types.boolean[::1],
        _I1, _F2, types.int64, _I1, _I2, _I2, _I1, types.float64,
        _I1, _I1, _F2,
        _I3, _F2, _I1, _F1,
    ), allocates=True)  # fmt: skip
def sample(
    fill, pieces, kernel, singular, noise, active,
    windows, intervals, drive, needs, asked, orders, term_rows, tolerance,
    size_of, row_of, table,
    slots, statistics, nodes, error,
):  # fmt: skip
    """Statistics of every active design over every window.

    Parameters
    ----------
    fill, pieces
        Compiled functions of the mechanism.
    kernel : (n, k), singular : (n, 3), noise : (n,)
        From its closed form.
    active : (n,)
        Which designs to sample; the others keep what they have.
    windows : (w,), intervals : (w, 2), drive
        Codes of the windows, start and stop (rad) of explicit ones, code of the drive stroke.
    needs : (w,), asked : (w, s), orders : (w, s)
        What the kernel must fill, what is asked of each row (0: nothing), and its pole order.
    term_rows : (s,)
        Of rows under load, the row with the size of their terms; -1 for the others.
    tolerance : float
        Relative, see `explore.evaluate`.
    size_of, row_of, table
        From `explore.quadrature.rules`.
    slots : (w, s, 7)
        Which row of `statistics` takes mean, variance, minimum, maximum, and so on as the constants of this module
        name them, of a signal over a window; -1 for none.
    statistics : (m, n), nodes : (n,), error : (n,)
        Filled: statistics for unit speed and rad; signal evaluations; bound.
    """
    rows = asked.shape[1]
    # Small enough for the first-level cache at usual node counts.
    scratch, found = np.empty((rows, CAPACITY)), np.zeros((rows, STATISTICS))
    t, sin_half, cos_half, weight = np.empty(CAPACITY), np.empty(CAPACITY), np.empty(CAPACITY), np.empty(CAPACITY)
    node, one = np.empty((2, 1)), np.empty((rows, 1))
    parts, shapes, offsets = np.zeros((PIECES + 1, 3)), np.zeros((PIECES, 4)), np.zeros(PIECES + 1, np.int64)
    for i in range(kernel.shape[0]):
        if not active[i]:
            continue
        row = kernel[i]
        for w in range(windows.shape[0]):
            panels = pieces(row, windows[w], drive, intervals[w, 0], intervals[w, 1], parts)
            rest, ends = parts[3, 1], False
            for p in range(panels):
                panel(parts, p, singular, i, shapes)
            for s in range(rows):
                ends = ends or (asked[w, s] & EXTREMES) != 0
            count, worst = _moments(
                fill, row, needs, asked, orders, term_rows, w, ends, noise[i], tolerance,
                panels, parts, shapes, offsets, size_of, row_of, table,
                t, sin_half, cos_half, weight, scratch, found,
            )  # fmt: skip
            nodes[i] += count
            for s in range(rows):
                if not asked[w, s]:
                    continue
                if asked[w, s] & EXTREMES and _repeats(slots, w, s, scratch, offsets[panels]):
                    found[s, MINIMUM], found[s, MAXIMUM] = found[s - 1, MINIMUM], found[s - 1, MAXIMUM]
                elif asked[w, s] & EXTREMES:
                    _extremes(
                        fill, row, needs[w], s, panels, slots[w, s, MINIMUM] >= 0, slots[w, s, MAXIMUM] >= 0, rest,
                        parts, shapes, offsets, t, scratch, node, one, found,
                    )  # fmt: skip
                for k in range(POWERS if asked[w, s] & SQUARES else 0):
                    if slots[w, s, ROOT_MEAN + k] >= 0:
                        mean, bound, count = power_means(
                            fill, row, needs[w], s, k, panels, parts, shapes, tolerance,
                            size_of, row_of, table, node, one,
                        )  # fmt: skip
                        found[s, ROOT_MEAN + k] = mean / parts[3, 0]
                        found[s, BOUND] += bound
                        worst = max(worst, found[s, BOUND])
                        nodes[i] += count
                for k in range(STATISTICS):
                    if slots[w, s, k] >= 0:
                        statistics[slots[w, s, k], i] = found[s, k]
            error[i] = max(error[i], worst)
