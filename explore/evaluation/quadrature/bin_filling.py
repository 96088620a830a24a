"""Bins: panels of the same kind and rule, tile after tile, from nodes to moments and extremes of each panel."""

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.bounds import FLAG_EXTREMES
from explore.evaluation.quadrature.equispaced import place_equispaced, place_equispaced_factors, repeat_turn
from explore.evaluation.quadrature.extremes import RESULT, find_minimum
from explore.evaluation.quadrature.panels import ANCHOR, COUNT, LAW, PANEL_CAPACITY, SCALE, VARIANT
from explore.evaluation.quadrature.pieces import add_coefficients
from explore.evaluation.quadrature.resolving import CHECKS, place_checks, resolve_rows
from explore.evaluation.quadrature.rounding import fill_roundings
from explore.evaluation.quadrature.senses import leave_other_senses
from explore.evaluation.quadrature.slots import MAXIMUM, MINIMUM
from explore.evaluation.quadrature.tails import fill_roots, place_factors
from explore.evaluation.quadrature.tiles import (
    DEVIATIONS,
    FIRST_TAIL,
    INTEGRAL,
    SUMS_SIZE,
    fill_moments,
    join_tails,
    place_nodes,
    take_panels,
)


@subroutine()
def _repeats_row_before(samples, rows, row, count):
    """Whether a row has the same samples as the one before, as with pin forces without masses."""
    for j in range(count):
        at = (j * rows + row) * LANES
        for lane in range(LANES):
            if samples[at + lane] != samples[at - LANES + lane]:  # most rows differ in the first sample
                return False
    return True


@subroutine()
def _fill_extremes(fill, sizes, tables, w, anchor, law, variant, count, lanes, tile, sums):
    """Fill the requested extremes of every flagged row, over each panel of a tile."""
    rows, slots = sizes.rows, tables.slots
    for s in range(rows):
        if not tables.flags[w, s] & FLAG_EXTREMES:
            continue
        for statistic in (MINIMUM, MAXIMUM):
            if slots[w, s, statistic] < 0:
                continue
            sign, values = (1.0, sums.lows) if statistic == MINIMUM else (-1.0, sums.highs)
            if s > 0 and slots[w, s - 1, statistic] >= 0 and _repeats_row_before(tile.signals, rows, s, count + 2):
                for lane in range(lanes):
                    at = s * PANEL_CAPACITY + tile.lane_panels[lane]
                    values[at] = values[at - PANEL_CAPACITY]
                continue
            find_minimum(
                fill, rows, anchor, law, variant, tables.row_needs[s], s, sign, count, tables.rules,
                tables.row_of[count], tile.signals, tile,
            )  # fmt: skip
            for lane in range(lanes):
                values[s * PANEL_CAPACITY + tile.lane_panels[lane]] = sign * tile.state[RESULT + lane]


@subroutine()
def _store_sums(rows, flags, w, lanes, tile, sums):
    """Store the sums of the tile's rows for its panels."""
    for lane in range(lanes):
        sums.masses[tile.lane_panels[lane]] = tile.node[lane]
    for s in range(rows):
        if flags[w, s]:
            base, row = s * PANEL_CAPACITY, s * SUMS_SIZE
            for lane in range(lanes):
                sums.integrals[base + tile.lane_panels[lane]] = tile.sums[row + INTEGRAL + lane]
                sums.deviations[base + tile.lane_panels[lane]] = tile.sums[row + DEVIATIONS + lane]
                sums.tails[base + tile.lane_panels[lane]] = tile.sums[row + FIRST_TAIL + lane]


@subroutine()
def fill_bin(fill, disturbed_fill, sizes, tables, w, begin, end, ends, pieces, extremes, rare, work, tile, sums):
    """Fill moments and extremes of the panels ``order[begin:end]``, which share rule, anchor, law and variant.

    Adaptive panels and `pieces` have the differences from the interpolant at both ends as their tails.
    """
    unmodelled = tables.is_adaptive or pieces
    panels, first = work.panels, work.order[begin]
    count, anchor = int(panels[COUNT + first]), int(panels[ANCHOR + first])
    law, variant = int(panels[LAW + first]), int(panels[VARIANT + first])
    is_turn = panels[SCALE + first] == 0.0
    samples = count + 2 if ends and not is_turn else count
    evaluated = samples
    # A turn has no ends: the neighbours of its first and last node are copies.
    signals = tile.signals[sizes.rows * LANES if ends and is_turn else 0 :]
    if is_turn:
        place_equispaced(count, tile.tangents, tile.weights)
        place_equispaced_factors(count, tile.factors)
        fill_roots(tile.weights, count, True, tile.roots)
        if rare is not None:  # noqa: SIM102  (alone, so that Numba leaves out the block)
            if tables.is_resolved:
                place_checks(count, tile.tangents)
                evaluated = count + CHECKS
    else:
        place_factors(count, ends, unmodelled, tables.row_of, tables.rules, tile.factors)
    for start in range(begin, end, LANES):
        lanes = min(LANES, end - start)
        take_panels(sizes, work.order[start : start + lanes], unmodelled, work, tile)
        if not is_turn:
            place_nodes(tile.shape, count, ends, tables.row_of, tables.rules, tile.tangents, tile.weights)
            fill_roots(tile.weights, samples, unmodelled, tile.roots)
        fill(tile.constants, tile.tangents, anchor, law, variant, evaluated, tables.needs[w], signals)
        fill_moments(
            signals, sizes.rows, tables.flags[w], samples, tile.weights, tile.roots, tile.factors, tile.node, tile.sums,
        )  # fmt: skip
        join_tails(tile.sums, sizes.rows, tables.flags[w], unmodelled, tile.shape)
        if rare is not None:
            if pieces:
                nodes = signals[sizes.rows * LANES :]
                leave_other_senses(nodes, sizes.rows, tables, law, count, lanes, work, tile)
                add_coefficients(
                    nodes, sizes.rows, tables.flags[w], count, tables.piece_factors, tile.sums, tile.parts
                )  # fmt: skip
            elif tables.is_resolved:
                resolve_rows(
                    signals, sizes.rows, tables.flags[w], count, tables.turn_factors, tile.sums, tile.parts
                )  # fmt: skip
        _store_sums(sizes.rows, tables.flags, w, lanes, tile, sums)
        if sizes.is_disturbed:
            fill_roundings(
                disturbed_fill, sizes, tables, w, anchor, law, variant, samples, lanes, signals, tile, sums
            )  # fmt: skip
        if extremes is not None:
            if is_turn:
                repeat_turn(tile.signals, sizes.rows, count)
            _fill_extremes(fill, sizes, tables, w, anchor, law, variant, count, lanes, tile, sums)
