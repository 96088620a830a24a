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
    """Fill the squares of the amplifications of every flagged row, for each panel of a tile, from its samples.

    The masses of the tile are stored by then: `tile.node` holds sums here.
    """
    rows, used = sizes.rows, (count + STRIDE - 1) // STRIDE
    for j in range(used):
        few, tangents = tile.few_tangents[j * LANES :], tile.tangents[_node(j, used, count) * LANES :]
        for lane in range(LANES):
            few[lane] = tangents[lane]
    disturbed_fill(
        tile.constants, tile.few_tangents, anchor, law, variant, used, tables.needs[w], tile.disturbed
    )  # fmt: skip
    _weigh_nodes(tables.is_anchored, used, count, tile)
    scale = 1.0 / (DISTURBANCE * DISTURBANCE)
    for s in range(rows):
        if not tables.flags[w, s]:
            continue
        if tables.flags[w, s] & FLAG_EXTREMES:
            _store_largest(s, rows, used, count, lanes, scale, signals, tile, sums)
        tile.node[:] = 0.0
        for j in range(used):
            at = (_node(j, used, count) * rows + s) * LANES
            _add_squares(tile.disturbed[(j * rows + s) * LANES :], signals[at:], tile.values[j * LANES :], tile.node)
        for lane in range(len(tile.node)):
            square = tile.node[lane] * scale / tile.marks[lane]
            tile.node[lane] = square if square == square else math.inf
        for lane in range(lanes):
            sums.roundings[s * PANEL_CAPACITY + tile.lane_panels[lane]] = tile.node[lane]


@subroutine(inlined=True)
def _node(j, used, count):
    """The node that is sampled once more as number j: the last one too, for extremes at the end of a window."""
    return j * STRIDE if j + 1 < used else count - 1


@subroutine()
def _weigh_nodes(is_anchored, used, count, tile):
    """Fill weights in the mean square of those nodes in the tile's values, and their sums in its marks.

    Nodes that crowd where a signal is large count by what they stand for, an end by its neighbour.
    """
    sums = tile.marks[:LANES]
    sums[:] = 0.0
    for j in range(used):
        node = min(max(_node(j, used, count), 1), count - 2)
        weights, own = tile.weights[node * LANES :], tile.values[j * LANES :]
        for lane in range(len(sums)):
            own[lane] = weights[lane] if is_anchored else 1.0
            sums[lane] += own[lane]


@subroutine(no_alias=True)
def _add_squares(disturbed, plain, weights, totals):
    """Add the squares of changes at a node, times its weights."""
    for lane in range(len(totals)):
        change = disturbed[lane] - plain[lane]
        totals[lane] += weights[lane] * (change * change)


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
def merge_roundings(n, s, flags, regular, per_design, stride, work, sums):
    """Fill the amplifications of a row over the windows of the live designs, relative to the rms of the row.

    Those of a row of squares are relative to the mean of these. The largest one, of extremes, counts relative to the
    largest sample. `regular` tells that panel p of the live design j has the number ``p * n + j``.
    """
    base, averaging = s * PANEL_CAPACITY, work.bounds[bounds.AVERAGING :]
    means, variances = work.means[s * CHUNK :], work.variances[s * CHUNK :]
    together = regular and not flags & FLAG_EXTREMES
    if together:
        work.terms[:n] = 0.0
        for part in range(per_design):
            roundings = sums.roundings[base + part * n :]
            _add_regular(n, part, sums.masses[part * n :], roundings, averaging, work.panel_count, work.terms)
    for j in range(0 if together else n):
        i, total, most, largest = work.live[j], 0.0, 0.0, 0.0
        for p in range(work.panel_count[i]):
            k = work.first_panel[i] + p * stride
            total += sums.masses[k] * sums.roundings[base + k] / averaging[j]
            if flags & FLAG_EXTREMES:
                most = max(most, sums.largest_roundings[base + k])
                largest = max(largest, sums.largest_samples[base + k])
        size = means[j] * means[j] + (0.0 if flags & FLAG_SQUARES else variances[j])
        work.terms[j] = max(total, most * (size / largest)) if largest > 0.0 else total
    _take_roots(n, flags, means, work.terms)


@subroutine(no_alias=True)
def _add_regular(n, part, masses, roundings, averaging, panel_count, totals):
    """Add the panel of this number of each design that has as many."""
    for j in range(n):
        share = masses[j] * roundings[j] / averaging[j]
        totals[j] += share if part < panel_count[j] else 0.0


@subroutine(no_alias=True)
def _take_roots(n, flags, means, totals):
    """Replace mean squares of amplifications by what counts as terms."""
    for j in range(n):
        mean = abs(means[j]) if flags & FLAG_SQUARES else 1.0
        totals[j] = _SHARE * math.sqrt(totals[j] / mean) if mean != 0.0 else 0.0
