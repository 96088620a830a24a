"""Senses of pieces: the signs of signals that others jump with, which the law of a piece says to `fill`.

A law holds at the ends of a piece too, where such a signal is 0 to rounding. It is told at the centre, and every node
that is sampled later has to agree: where one does not, a zero was missed, and the design is left to the adaptive rule.
"""

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import DISTURBANCE
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.brent import TRIAL, fill_trial_tangents
from explore.evaluation.quadrature.chunks import sort_by_rule
from explore.evaluation.quadrature.equispaced import leave_panel
from explore.evaluation.quadrature.panels import ANCHOR, COUNT, LAW, VARIANT
from explore.evaluation.quadrature.pieces import PIECE_COUNTS
from explore.evaluation.quadrature.single_cuts import code_of_sense
from explore.evaluation.quadrature.tiles import TILE_CENTRE, take_panels


@subroutine()
def tell_senses(fill, disturbed_fill, sizes, tables, w, count, work, tile):
    """Add the codes of the senses to the laws of all panels; leave those to the adaptive rule that have none."""
    panels = work.panels
    for k in range(count):
        work.todo[k], panels[COUNT + k] = k, float(PIECE_COUNTS[0])
    n_bins = sort_by_rule(
        panels, work.todo, count, tables.size_of, work.kinds, work.codes, work.histogram, work.order, work.starts
    )
    for b in range(n_bins):
        for start in range(work.starts[b], work.starts[b + 1], LANES):
            lanes = min(LANES, work.starts[b + 1] - start)
            _tell_tile(fill, disturbed_fill, sizes, tables, w, work.order[start : start + lanes], work, tile)


@subroutine()
def _tell_tile(fill, disturbed_fill, sizes, tables, w, chosen, work, tile):
    """Add the codes of the senses to the laws of the chosen panels, which share anchor, law and variant."""
    panels, needs, k = work.panels, tables.needs[w], chosen[0]
    take_panels(sizes, chosen, True, work, tile)
    for lane in range(LANES):
        tile.search[TRIAL + lane] = tile.shape[TILE_CENTRE + lane]
    fill_trial_tangents(tile.shape, tile.search, tile.node)
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.node_signals)
    for lane in range(LANES):
        tile.node[lane] += DISTURBANCE * (1.0 + abs(tile.node[lane]))
    disturbed_fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.disturbed)
    for i in range(tables.sense_count):
        row = tables.corner_rows[i, 0] * LANES
        for lane in range(len(chosen)):
            value = tile.node_signals[row + lane]
            code = code_of_sense(value, abs(tile.disturbed[row + lane] - value))
            panels[LAW + chosen[lane]] += float(1 << 2 * i) * code
            if code == 0.0:
                leave_panel(panels, chosen[lane])


@subroutine()
def leave_other_senses(signals, rows, tables, law, count, lanes, work, tile):
    """Leave panels of a tile to the adaptive rule where a node has another sense than their law says.

    `signals` begin with the first of the `count` nodes.
    """
    for i in range(tables.sense_count):
        code, row = law >> 2 * i & 3, tables.corner_rows[i, 0]
        sign = 1.0 if code == 1 else -1.0 if code == 2 else 0.0
        for j in range(count):
            at = (j * rows + row) * LANES
            for lane in range(lanes):
                if sign * signals[at + lane] < 0.0:
                    leave_panel(work.panels, tile.lane_panels[lane])
