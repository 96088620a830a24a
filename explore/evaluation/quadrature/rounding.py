"""Rounding errors of signals, from samples whose operations are disturbed; see `explore.base.lanes.disturbance`.

Every few nodes of a panel, and its last one, are sampled once more, disturbed. An amplification is the change of a
sample over the disturbance: what a relative error of each operation is multiplied by. Over a window the mean square
counts relative to that of the signal, for extremes the largest one relative to the largest sample, too. Nodes stand
closer than singularities are far, and amplifications are as smooth as signals.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import DISTURBANCE
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_EXTREMES, FLAG_SQUARES
from explore.evaluation.quadrature.panels import PANEL_CAPACITY

#: Number of nodes of which one is sampled once more.
STRIDE = 4
#: Share of an amplification that counts as terms, so that 4e-16 of it, 3.6 unit roundoffs, are the bound.
_SHARE = 0.5


@subroutine(no_alias=True)
def fill_roundings(disturbed_fill, sizes, tables, w, anchor, law, variant, count, lanes, signals, tile, sums):
    """Fill the squares of the amplifications of every flagged row, for each panel of a tile, from its samples."""
    rows, used = sizes.rows, (count + STRIDE - 1) // STRIDE
    for j in range(used):
        for lane in range(LANES):
            tile.few_tangents[j * LANES + lane] = tile.tangents[_node(j, used, count) * LANES + lane]
    disturbed_fill(
        tile.constants, tile.few_tangents, anchor, law, variant, used, tables.needs[w], tile.disturbed
    )  # fmt: skip
    scale = 1.0 / (DISTURBANCE * DISTURBANCE)
    for s in range(rows):
        if not tables.flags[w, s]:
            continue
        totals, plain = tile.disturbed[s * LANES :], signals[s * LANES :]
        if tables.flags[w, s] & FLAG_EXTREMES:
            _store_largest(s, rows, used, count, lanes, scale, signals, tile, sums)
        for j in range(used):
            _add_squares(j, totals[j * rows * LANES :], plain[_node(j, used, count) * rows * LANES :], totals)
        for lane in range(lanes):
            square = totals[lane] * scale / used
            sums.roundings[s * PANEL_CAPACITY + tile.lane_panels[lane]] = square if square == square else math.inf


@subroutine(inlined=True)
def _node(j, used, count):
    """The node that is sampled once more as number j: the last one too, for extremes at the end of a window."""
    return j * STRIDE if j + 1 < used else count - 1


@subroutine(inlined=True)
def _add_squares(j, disturbed, plain, totals):
    """Add the squares of changes at node j; those of node 0 overwrite its samples."""
    for lane in range(LANES):
        change = disturbed[lane] - plain[lane]
        totals[lane] = change * change + (totals[lane] if j > 0 else 0.0)


@subroutine()
def _store_largest(s, rows, used, count, lanes, scale, signals, tile, sums):
    """Store the squares of the largest amplification and of the largest sample of a row, for each panel of a tile."""
    for lane in range(lanes):
        most, largest = 0.0, 0.0
        for j in range(used):
            plain = signals[(_node(j, used, count) * rows + s) * LANES + lane]
            change = tile.disturbed[(j * rows + s) * LANES + lane] - plain
            # not a number where a disturbed design has no motion
            most = most if change * change <= most else change * change
            largest = max(largest, plain * plain)
        at = s * PANEL_CAPACITY + tile.lane_panels[lane]
        sums.largest_roundings[at] = most * scale if most == most else math.inf
        sums.largest_samples[at] = largest


@subroutine()
def merge_roundings(n, s, flags, stride, work, sums):
    """Fill the amplifications of a row over the windows of the live designs, relative to the rms of the row.

    Those of a row of squares are relative to the mean of these. The largest one, of extremes, counts relative to the
    largest sample.
    """
    for j in range(n):
        i, total, most, largest = work.live[j], 0.0, 0.0, 0.0
        for p in range(work.panel_count[i]):
            k = work.first_panel[i] + p * stride
            at = s * PANEL_CAPACITY + k
            total += sums.masses[k] * sums.roundings[at] / work.bounds[bounds.AVERAGING + j]
            if flags & FLAG_EXTREMES:
                most, largest = max(most, sums.largest_roundings[at]), max(largest, sums.largest_samples[at])
        mean = work.means[s * CHUNK + j]
        size = mean * mean + (0.0 if flags & FLAG_SQUARES else work.variances[s * CHUNK + j])
        total = max(total, most * (size / largest)) if largest > 0.0 else total
        if flags & FLAG_SQUARES:
            total = total / abs(mean) if mean != 0.0 else 0.0
        work.terms[j] = _SHARE * math.sqrt(total)
