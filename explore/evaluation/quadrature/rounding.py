"""Rounding errors of signals, from samples whose operations are disturbed; see `explore.base.lanes.disturbance`.

Every few nodes of a panel are sampled once more, disturbed. An amplification is the change of a sample over the
disturbance: what a relative error of each operation is multiplied by. Over a window the mean square counts, for
extremes the largest one. Nodes stand closer than singularities are far, and amplifications are as smooth as signals.
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
            tile.few_tangents[j * LANES + lane] = tile.tangents[j * STRIDE * LANES + lane]
    disturbed_fill(
        tile.constants, tile.few_tangents, anchor, law, variant, used, tables.needs[w], tile.disturbed
    )  # fmt: skip
    scale = 1.0 / (DISTURBANCE * DISTURBANCE)
    for s in range(rows):
        if not tables.flags[w, s]:
            continue
        largest = tables.flags[w, s] & FLAG_EXTREMES != 0
        totals = tile.disturbed[s * LANES :]
        for j in range(used):
            disturbed, plain = tile.disturbed[(j * rows + s) * LANES :], signals[(j * STRIDE * rows + s) * LANES :]
            _add_squares(j, largest, disturbed, plain, totals)
        for lane in range(lanes):
            square = totals[lane] * scale if largest else totals[lane] * scale / used
            sums.roundings[s * PANEL_CAPACITY + tile.lane_panels[lane]] = square if square == square else math.inf


@subroutine(inlined=True)
def _add_squares(j, largest, disturbed, plain, totals):
    """Add the squares of changes at node j, or take the largest; the first overwrite the changes of node 0."""
    for lane in range(LANES):
        change = disturbed[lane] - plain[lane]
        square, total = change * change, totals[lane] if j > 0 else 0.0
        # not a number where a disturbed design has no motion
        most = total if square <= total else square
        totals[lane] = most if largest else total + square


@subroutine()
def merge_roundings(n, s, flags, stride, work, sums):
    """Fill the amplifications of a row over the windows of the live designs, relative to the rms of the row.

    Those of a row of squares are relative to the mean of these.
    """
    for j in range(n):
        i, total = work.live[j], 0.0
        for p in range(work.panel_count[i]):
            k = work.first_panel[i] + p * stride
            square = sums.roundings[s * PANEL_CAPACITY + k]
            if flags & FLAG_EXTREMES:
                total = max(total, square)
            else:
                total += sums.masses[k] * square / work.bounds[bounds.AVERAGING + j]
        if flags & FLAG_SQUARES:
            mean = work.means[s * CHUNK + j]
            total = total / abs(mean) if mean != 0.0 else 0.0
        work.terms[j] = _SHARE * math.sqrt(total)
