"""The compiled loop: designs to panels, panels to tiles of nodes, tiles to statistics and their error bound.

Designs are taken in chunks that fit into the cache. In each chunk the panels of one window are sorted by their rule; a
tile holds panels with the same rule, padded by repetition, so that no result depends on the neighbours of a design.

Numba has no cheap records, so arrays and constants are passed as long argument lists.
"""

import math

import numpy as np
from numba import types

from explore.compiling import LANES, compiled
from explore.quadrature import bounds
from explore.quadrature.bin_filling import PanelSums, TileWork, fill_bin
from explore.quadrature.bounds import BOUNDS_SIZE, CHUNK, FLAG_EXTREMES, FLAG_SQUARES
from explore.quadrature.chunks import (
    CLOSE_TYPE,
    CODES,
    MOST_KINDS,
    add_panels,
    close_chunk,
    constant,
    gather_constants,
    sort_by_rule,
)
from explore.quadrature.extremes import STATE_SIZE
from explore.quadrature.hand_over import find_hand_overs
from explore.quadrature.magnitudes import POWERS, power_means
from explore.quadrature.merging import bound_rows, choose_next, collect, copy_numbers, merge, merge_regular
from explore.quadrature.panels import (
    ANCHOR,
    CENTRE,
    FIRST,
    LAST,
    LENGTH,
    PANEL_CAPACITY,
    PANELS_SIZE,
    SCALE,
    TARGET,
    count_nodes,
    map_panels,
)
from explore.quadrature.slots import (
    BOUND,
    CLUTCH,
    MAXIMUM,
    MEAN,
    MINIMUM,
    PHASES,
    RATE,
    RATE_DERIVATIVE,
    RATE_NEEDS,
    ROOT_MEAN,
    ROOT_POWER_MEAN,
    VARIANCE,
)
from explore.quadrature.tiles import FILL_TYPE, NODE_CAPACITY, SHAPE_SIZE, SUMS_SIZE

#: Natural logarithm of the tolerance over the target of the first node count: a cv multiplies the error by a few.
HEADROOM = 1.5
#: Most node counts that are tried for one design and window.
MOST_ROUNDS = 4

_F1, _F2 = types.float64[::1], types.float64[:, ::1]
_I1, _I2, _I3 = types.int64[::1], types.int64[:, ::1], types.int64[:, :, ::1]


@compiled()
def _store(
    b, n, live, all_live, designs, first_panel, panel_count, stride, w, flags, slots, means, variances, row_bounds,
    final_bounds, lows, highs, statistics, nodes, worst,
):  # fmt: skip
    """Store the statistics of the live designs; a later round replaces those of this one."""
    together = all_live and designs[live[n - 1]] - designs[live[0]] == n - 1
    for s in range(flags.shape[1]):
        if not flags[w, s]:
            continue
        at, base = s * CHUNK, s * PANEL_CAPACITY
        for slot, source in (
            (slots[w, s, MEAN], means),
            (slots[w, s, VARIANCE], variances),
            (slots[w, s, BOUND], row_bounds),
        ):
            if slot < 0:
                continue
            if together:
                first = designs[live[0]]
                copy_numbers(statistics[slot, first:], source[at:], n)
            else:
                for j in range(n):
                    statistics[slot, designs[live[j]]] = source[at + j]
        if flags[w, s] & FLAG_SQUARES:
            for j in range(n):
                final_bounds[at + live[j]] = row_bounds[at + j]
        low_slot, high_slot = slots[w, s, MINIMUM], slots[w, s, MAXIMUM]
        if low_slot < 0 and high_slot < 0:
            continue
        for j in range(n):
            i = live[j]
            # Over the rest of a period the signal is 0.
            low, high = (0.0, 0.0) if b[bounds.REST + j] > 0.0 else (math.inf, -math.inf)
            for p in range(panel_count[i]):
                k = base + first_panel[i] + p * stride
                low, high = min(low, lows[k]), max(high, highs[k])
            if low_slot >= 0:
                statistics[low_slot, designs[i]] = low
            if high_slot >= 0:
                statistics[high_slot, designs[i]] = high
    for j in range(n):
        nodes[designs[live[j]]] += int(b[bounds.TOTAL + j])
        worst[live[j]] = b[bounds.WORST + j]


@compiled(allocates=True)
def _shorten_to_clutches(
    fill, constants, constant_count, fill_rows, window, count, panels, owner, rows, averaging, rest, work,
):  # fmt: skip
    """Cut each stroke, one panel, to the part that drives the output; fill the lengths that it is averaged over."""
    scale, periods, first, last, rising = (
        np.ones(LANES),
        np.ones(LANES),
        np.zeros(LANES),
        np.zeros(LANES),
        np.zeros(LANES),
    )
    tangents, signals = np.zeros(LANES), np.zeros(rows * LANES)
    pending = np.empty(count, np.int64)
    for anchor in range(2):
        n = 0
        for k in range(count):
            i = owner[k]
            if int(panels[ANCHOR + k]) != anchor:
                continue
            period = 2.0 * math.pi / constant(constants, constant_count, window[PHASES], i)
            length = panels[LENGTH + k]
            averaging[i], rest[i] = period, max(period - length, 0.0)
            if period < length:
                pending[n] = k
                n += 1
        for start in range(0, n, LANES):
            for lane in range(LANES):
                k = pending[start + min(lane, min(LANES, n - start) - 1)]
                work.lane_panels[lane], work.lane_designs[lane] = k, owner[k]
                scale[lane], periods[lane] = panels[SCALE + k], averaging[owner[k]]
                first[lane], last[lane] = panels[FIRST + k], panels[LAST + k]
                tangents[lane] = scale[lane] * math.sinh(panels[CENTRE + k])
            gather_constants(constants, constant_count, fill_rows, work.lane_designs, work.offsets, work.constants)
            fill(work.constants, tangents, anchor, 0, 0, 1, window[RATE_NEEDS], signals)
            for lane in range(LANES):
                rising[lane] = 1.0 if signals[window[RATE] * LANES + lane] > 0.0 else -1.0
            find_hand_overs(
                fill, work.constants, anchor, 0, 0, window[RATE_NEEDS], rows, window[RATE], window[RATE_DERIVATIVE],
                rising, scale, periods, first, last,
            )  # fmt: skip
            for lane in range(LANES):
                panels[FIRST + work.lane_panels[lane]], panels[LAST + work.lane_panels[lane]] = (
                    first[lane],
                    last[lane],
                )


@compiled()
def _fill_powers(
    fill, constants, constant_count, fill_rows, needs, rows, w, flags, slots, panels, i, first, panel_count, stride,
    averaging, tolerance, size_of, row_of, table, work, design, final_bounds, statistics, nodes, error,
):  # fmt: skip
    """Fill the means of powers of the magnitudes of one design, number i of the chunk."""
    for lane in range(LANES):
        work.lane_designs[lane] = i
    gather_constants(constants, constant_count, fill_rows, work.lane_designs, work.offsets, work.constants)
    for s in range(rows):
        if not flags[w, s] & FLAG_SQUARES:
            continue
        for power in range(POWERS):
            slot = slots[w, s, ROOT_MEAN + power]
            if slot >= 0:
                mean, bound, count = power_means(
                    fill, work.constants, needs, rows, s, power, panels, first, panel_count, stride, tolerance,
                    size_of, row_of, table,
                )  # fmt: skip
                statistics[slot, design] = mean / averaging
                if slots[w, s, BOUND] >= 0:
                    statistics[slots[w, s, BOUND], design] += bound
                final_bounds[s * CHUNK + i] += bound
                error[design] = max(error[design], final_bounds[s * CHUNK + i])
                nodes[design] += count


@compiled(
    types.void(
        CLOSE_TYPE, FILL_TYPE, types.int64, types.int64, types.int64, types.int64, types.int64, _F2, _I1,
        _I2, _F2, _I1, _I1, _I1, types.int64, types.int64, _I1, _I2, _I2, _I1, types.float64,
        _I1, _I1, _F2,
        _I3, _F2, _I1, _F1,
    ), allocates=True)  # fmt: skip
def sample(
    close, fill, record_rows, first_parameter, constant_count, fill_rows, rows, parameters, designs,
    windows, intervals, breaks, singular_rows, singular_anchors, noise_row, variant_row,
    needs, flags, orders, term_rows, tolerance,
    size_of, row_of, table,
    slots, statistics, nodes, error,
):  # fmt: skip
    """Statistics of designs over every window.

    Parameters
    ----------
    close, fill
        Compiled functions of the mechanism.
    record_rows, first_parameter, constant_count, fill_rows, rows
        Rows of a tile of records, the first of the parameters, the number of constants and of those that `fill` reads,
        the number of signal rows.
    parameters : (p, n) array
        Of the closed form.
    designs : (d,) array
        The designs to sample; the entries of the others are not changed.
    windows : (w, 8), intervals : (w, 2)
        Specifications of the windows, with the columns KIND … of `explore.quadrature.slots`, and the ends (rad) of
        explicit ones.
    breaks : (b,)
        Rows of the constants that hold the half-tangents where laws change.
    singular_rows, singular_anchors : (3,)
        Rows of the constants that hold the half-tangents of the distances of singularities, and their anchors; -1 for
        none.
    noise_row, variant_row
        Rows of the constants that hold the amplification of rounding errors and the variant; -1 for none.
    needs : (w,), flags : (w, s), orders : (w, s)
        Bits of the signals to fill; for each row, flags of `explore.quadrature.bounds` (0: skip) and pole order.
    term_rows : (s,)
        For a signal that is a sum of terms, the row with the size of the terms; -1 for other signals.
    tolerance : float
        Relative, in the norms of `explore.evaluation.evaluate`.
    size_of, row_of, table
        From `explore.quadrature.rules`.
    slots : (w, s, 7)
        Row of `statistics` for each statistic (MEAN, VARIANCE, … of `explore.quadrature.slots`) of a row over a window;
        -1 for none.
    statistics : (m, n), nodes : (n,), error : (n,)
        Filled: statistics for unit speed and rad; signal evaluations; bound.
    """
    record, constants = np.zeros(record_rows * LANES), np.empty((CHUNK + LANES) * constant_count)
    panels, b = np.zeros(PANELS_SIZE), np.zeros(BOUNDS_SIZE)
    owner, first_panel = np.empty(PANEL_CAPACITY, np.int64), np.empty(CHUNK, np.int64)
    panel_count, live = np.empty(CHUNK, np.int64), np.empty(CHUNK, np.int64)
    positions = np.empty(max(len(breaks), 1))
    work = TileWork(
        np.empty(LANES, np.int64), np.empty(LANES, np.int64), np.empty(LANES, np.uint64),
        np.empty(constant_count * LANES), np.zeros(SHAPE_SIZE), np.empty(NODE_CAPACITY * LANES),
        np.empty(NODE_CAPACITY * LANES), np.empty(rows * NODE_CAPACITY * LANES), np.empty(rows * SUMS_SIZE),
        np.zeros(STATE_SIZE), np.empty(LANES), np.empty(rows * LANES),
    )  # fmt: skip
    sums = PanelSums(
        np.empty(PANEL_CAPACITY), np.empty(rows * PANEL_CAPACITY), np.empty(rows * PANEL_CAPACITY),
        np.empty(rows * PANEL_CAPACITY), np.empty(rows * PANEL_CAPACITY),
    )  # fmt: skip
    means, variances = np.empty(rows * CHUNK), np.empty(rows * CHUNK)
    terms = np.empty(CHUNK)
    row_bounds, final_bounds = np.empty(rows * CHUNK), np.empty(rows * CHUNK)
    averaging, rest, noise, worst = np.empty(CHUNK), np.empty(CHUNK), np.empty(CHUNK), np.empty(CHUNK)
    todo, order = np.empty(PANEL_CAPACITY, np.int64), np.empty(PANEL_CAPACITY, np.int64)
    codes, starts = np.empty(PANEL_CAPACITY, np.int64), np.empty(PANEL_CAPACITY + 1, np.int64)
    kinds, histogram = np.empty(MOST_KINDS, np.int64), np.empty(MOST_KINDS * CODES + 1, np.int64)
    log_target = math.log(tolerance) - HEADROOM
    for start in range(0, len(designs), CHUNK):
        here = designs[start : start + CHUNK]
        close_chunk(close, parameters, here, first_parameter, constant_count, record, constants)
        for w in range(windows.shape[0]):
            ends, powers, pole_order = False, False, 2
            for s in range(rows):
                if flags[w, s]:
                    ends = ends or (flags[w, s] & FLAG_EXTREMES) != 0
                    pole_order = max(pole_order, orders[w, s])
                    powers = powers or slots[w, s, ROOT_MEAN] >= 0 or slots[w, s, ROOT_POWER_MEAN] >= 0
            used = np.flatnonzero(flags[w])
            begin = 0
            while begin < len(here):
                until, count, stride = add_panels(
                    constants, constant_count, begin, len(here), windows[w], intervals[w, 0], intervals[w, 1], breaks,
                    singular_rows, variant_row, panels, first_panel, panel_count, owner, positions,
                )  # fmt: skip
                map_panels(panels, count, singular_anchors)
                for i in range(begin, until):
                    total = 0.0
                    for p in range(panel_count[i]):
                        total += panels[LENGTH + first_panel[i] + p * stride]
                    averaging[i], rest[i], live[i - begin] = total, 0.0, i
                    noise[i] = constant(constants, constant_count, noise_row, i) if noise_row >= 0 else 0.0
                if windows[w, CLUTCH]:
                    _shorten_to_clutches(
                        fill, constants, constant_count, fill_rows, windows[w], count, panels, owner, rows, averaging,
                        rest, work,
                    )  # fmt: skip
                    map_panels(panels, count, singular_anchors)
                panels[TARGET : TARGET + count] = log_target
                for k in range(count):
                    todo[k] = k
                n, n_todo = until - begin, count
                regular = begin == 0 and stride > 1 and until == len(here)
                for number in range(MOST_ROUNDS):
                    if n == 0:
                        break
                    count_nodes(panels, count, pole_order)
                    n_bins = sort_by_rule(panels, todo, n_todo, size_of, kinds, codes, histogram, order, starts)
                    for k in range(n_bins):
                        fill_bin(
                            fill, constants, constant_count, fill_rows, panels, order, starts[k], starts[k + 1], owner,
                            ends, needs[w], rows, used, w, flags, slots, row_of, table, work, sums,
                        )  # fmt: skip
                    collect(
                        b, panels, count, n, live, first_panel, panel_count, stride, 2 if ends else 0, averaging, rest,
                        noise,
                    )  # fmt: skip
                    for u in range(len(used)):
                        if regular and number == 0:
                            merge_regular(
                                b, n, count // n, used[u], sums.masses, sums.integrals, sums.deviations, means,
                                variances,
                            )  # fmt: skip
                        else:
                            merge(
                                b, n, live, first_panel, panel_count, stride, used[u], sums.masses, sums.integrals,
                                sums.deviations, means, variances,
                            )  # fmt: skip
                    bound_rows(b, n, w, flags, orders, term_rows, tolerance, means, variances, row_bounds, terms)
                    _store(
                        b, n, live, number == 0, here, first_panel, panel_count, stride, w, flags, slots, means,
                        variances, row_bounds, final_bounds, sums.lows, sums.highs, statistics, nodes, worst,
                    )  # fmt: skip
                    n, n_todo = choose_next(
                        b, panels, n, live, first_panel, panel_count, stride, pole_order, tolerance, todo
                    )  # fmt: skip
                for i in range(begin, until):
                    error[here[i]] = max(error[here[i]], worst[i])
                if powers:
                    for i in range(begin, until):
                        _fill_powers(
                            fill, constants, constant_count, fill_rows, needs[w], rows, w, flags, slots, panels, i,
                            first_panel[i], panel_count[i], stride, averaging[i], tolerance, size_of, row_of, table,
                            work, here[i], final_bounds, statistics, nodes, error,
                        )  # fmt: skip
                begin = until
