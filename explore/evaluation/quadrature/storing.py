"""Statistics of the designs of a chunk into the arrays of the whole block."""

import math

from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_SQUARES
from explore.evaluation.quadrature.merging import copy_numbers
from explore.evaluation.quadrature.panels import PANEL_CAPACITY
from explore.evaluation.quadrature.slots import (
    BOUND,
    FLUCTUATION,
    LAGGED_FLUCTUATION,
    LAGGED_MAX,
    MAXIMUM,
    MEAN,
    MINIMUM,
    VARIANCE,
)


@subroutine()
def _store_extremes(n, designs, stride, base, low_slot, high_slot, statistics, work, sums):
    """Store the extremes of one row over the panels of each live design."""
    for j in range(n):
        i = work.live[j]
        # Over the rest of a period the signal is 0.
        low, high = (0.0, 0.0) if work.rest[i] > 0.0 else (math.inf, -math.inf)
        for p in range(work.panel_count[i]):
            k = base + work.first_panel[i] + p * stride
            low, high = min(low, sums.lows[k]), max(high, sums.highs[k])
        if low_slot >= 0:
            statistics[low_slot, designs[i]] = low
        if high_slot >= 0:
            statistics[high_slot, designs[i]] = high


@subroutine()
def store(n, all_live, designs, stride, w, flags, slots, statistics, nodes, work, sums):
    """Store the statistics of the n live designs; a later round replaces those of this one.

    They are all of the chunk, if `all_live`; `designs` has the numbers of the chunk's designs in the block.
    """
    live = work.live
    together = all_live and designs[live[n - 1]] - designs[live[0]] == n - 1
    for s in range(flags.shape[1]):
        if not flags[w, s]:
            continue
        at = s * CHUNK
        for slot, source in (
            (slots[w, s, MEAN], work.means),
            (slots[w, s, VARIANCE], work.variances),
            (slots[w, s, BOUND], work.row_bounds),
        ):
            if slot >= 0 and together:
                copy_numbers(statistics[slot, designs[live[0]] :], source[at:], n)
            elif slot >= 0:
                for j in range(n):
                    statistics[slot, designs[live[j]]] = source[at + j]
        if (
            flags[w, s] & FLAG_SQUARES
            or max(slots[w, s, FLUCTUATION], slots[w, s, LAGGED_FLUCTUATION], slots[w, s, LAGGED_MAX]) >= 0
        ):
            for j in range(n):
                work.final_bounds[at + live[j]] = work.row_bounds[at + j]
        low_slot, high_slot = slots[w, s, MINIMUM], slots[w, s, MAXIMUM]
        if low_slot >= 0 or high_slot >= 0:
            _store_extremes(n, designs, stride, s * PANEL_CAPACITY, low_slot, high_slot, statistics, work, sums)
    for j in range(n):
        nodes[designs[live[j]]] += int(work.bounds[bounds.TOTAL + j])
        work.worst[live[j]] = work.bounds[bounds.WORST + j]
        work.excess[live[j]] = work.bounds[bounds.EXCESS + j]


@subroutine()
def add_bound(s, i, design, slots, bound, statistics, error, work):
    """Add to the bound of row s what integrals between places of its own are off by; `i` numbers the design."""
    if slots[BOUND] >= 0:
        statistics[slots[BOUND], design] += bound
    work.final_bounds[s * CHUNK + i] += bound
    error[design] = max(error[design], work.final_bounds[s * CHUNK + i])
