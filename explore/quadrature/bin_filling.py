"""Bins: panels of the same kind and rule, tile after tile, from nodes to moments and extremes of each panel."""

from typing import NamedTuple

import numpy as np

from explore.compiling import LANES, compiled
from explore.quadrature.bounds import FLAG_EXTREMES
from explore.quadrature.chunks import gather_constants
from explore.quadrature.extremes import RESULT, find_minimum
from explore.quadrature.panels import ANCHOR, COUNT, LAW, PANEL_CAPACITY, VARIANT
from explore.quadrature.slots import MAXIMUM, MINIMUM
from explore.quadrature.tiles import DEVIATIONS, INTEGRAL, SUMS_SIZE, fill_moments, gather_shapes, place_nodes


class TileWork(NamedTuple):
    """Work space for one tile: Numba passes a named tuple as its members."""

    lane_panels: np.ndarray
    lane_designs: np.ndarray
    offsets: np.ndarray
    constants: np.ndarray
    shape: np.ndarray
    tangents: np.ndarray
    weights: np.ndarray
    signals: np.ndarray
    sums: np.ndarray
    state: np.ndarray
    node: np.ndarray
    node_signals: np.ndarray


class PanelSums(NamedTuple):
    """Weights of panels, one number each, and the sums and extremes of their signals, row after row."""

    masses: np.ndarray
    integrals: np.ndarray
    deviations: np.ndarray
    lows: np.ndarray
    highs: np.ndarray


@compiled()
def _repeats_row_before(samples, rows, row, count):
    """Whether a row has the same samples as the one before, as with pin forces without masses."""
    for j in range(count):
        at = (j * rows + row) * LANES
        for lane in range(LANES):
            if samples[at + lane] != samples[at - LANES + lane]:  # most rows differ in the first sample
                return False
    return True


@compiled()
def _fill_extremes(fill, anchor, law, variant, needs, rows, w, flags, slots, count, table, rule, lanes, work, sums):
    """Fill the requested extremes of every flagged row, over each panel of a tile."""
    for s in range(rows):
        if not flags[w, s] & FLAG_EXTREMES:
            continue
        for statistic in (MINIMUM, MAXIMUM):
            if slots[w, s, statistic] < 0:
                continue
            sign, values = (1.0, sums.lows) if statistic == MINIMUM else (-1.0, sums.highs)
            if s > 0 and slots[w, s - 1, statistic] >= 0 and _repeats_row_before(work.signals, rows, s, count + 2):
                for lane in range(lanes):
                    at = s * PANEL_CAPACITY + work.lane_panels[lane]
                    values[at] = values[at - PANEL_CAPACITY]
                continue
            find_minimum(
                fill, work.constants, work.shape, anchor, law, variant, needs, rows, s, sign, count, table, rule,
                work.signals, work.state, work.node, work.node_signals,
            )  # fmt: skip
            for lane in range(lanes):
                values[s * PANEL_CAPACITY + work.lane_panels[lane]] = sign * work.state[RESULT + lane]


@compiled()
def fill_bin(
    fill, constants, constant_count, fill_rows, panels, order, begin, end, owner, ends, needs, rows, used, w, flags,
    slots, row_of, table, work, sums,
):  # fmt: skip
    """Fill moments and extremes of the panels ``order[begin:end]``, which share rule, anchor, law and variant.

    Parameters
    ----------
    used
        The rows whose moments are needed.
    work, sums
        TileWork, and the PanelSums that are filled.
    """
    first = order[begin]
    count, anchor = int(panels[COUNT + first]), int(panels[ANCHOR + first])
    law, variant = int(panels[LAW + first]), int(panels[VARIANT + first])
    samples = count + 2 if ends else count
    lane_panels, masses = work.lane_panels, work.node
    for start in range(begin, end, LANES):
        lanes = min(LANES, end - start)
        for lane in range(LANES):
            lane_panels[lane] = order[start + min(lane, lanes - 1)]
            work.lane_designs[lane] = owner[lane_panels[lane]]
        gather_constants(constants, constant_count, fill_rows, work.lane_designs, work.offsets, work.constants)
        gather_shapes(panels, lane_panels, work.shape)
        place_nodes(work.shape, count, ends, row_of, table, work.tangents, work.weights)
        fill(work.constants, work.tangents, anchor, law, variant, samples, needs, work.signals)
        fill_moments(work.signals, rows, used, samples, work.weights, masses, work.sums)
        for lane in range(lanes):
            sums.masses[lane_panels[lane]] = masses[lane]
        for u in range(len(used)):
            base, row = used[u] * PANEL_CAPACITY, u * SUMS_SIZE
            for lane in range(lanes):
                sums.integrals[base + lane_panels[lane]] = work.sums[row + INTEGRAL + lane]
                sums.deviations[base + lane_panels[lane]] = work.sums[row + DEVIATIONS + lane]
        if ends:
            _fill_extremes(
                fill, anchor, law, variant, needs, rows, w, flags, slots, count, table, row_of[count], lanes, work,
                sums,
            )  # fmt: skip
