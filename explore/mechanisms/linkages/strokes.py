"""Strokes of designs of a linkage: the two reversals of its output, counted, and solved for to their last digits."""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages import cells as cell
from explore.mechanisms.linkages import minima as minimum
from explore.mechanisms.linkages import reversals as reversal
from explore.mechanisms.linkages import statuses
from explore.mechanisms.linkages.programs import (
    DISTANCE_ROW,
    GREATEST_PLACE_ROW,
    GREATEST_ROW,
    LEAST_PLACE_ROW,
    LEAST_ROW,
    OTHERS_ROW,
    SINGULAR_ANGLE_ROW,
)


@subroutine(allocates=True)
def find_strokes(record, sizes, check, rate, constants):
    """Fill the places of the output's reversals, the time ratio, and the statuses of lanes without strokes."""
    rates = np.empty((reversal.CELLS + 1) * reversal.RATE_ROWS * LANES)
    tangents, anchors, counts, doubts = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    places, tile = np.empty(4 * LANES), np.empty(sizes.constants * LANES)
    for j in range(reversal.CELLS + 1):
        cell.place_lanes(reversal.reversal_node(j), tangents, anchors)
        rate(constants, tangents, anchors, rates[j * reversal.RATE_ROWS * LANES :])
    reversal.find_reversals(rates, counts, doubts, places)
    for lane in range(LANES):
        distance = constants[DISTANCE_ROW * LANES + lane]
        is_doubtful = doubts[lane] == 1.0 or distance < minimum.NEAR
        if is_doubtful and counts[lane] <= 2.0 and record[sizes.status * LANES + lane] == 1.0:
            cell.copy_lane(constants, lane, sizes.constants, tile)
            _count_reversals(sizes, check, rate, tile, rates, lane, counts, places)
    _place_reversals(rate, constants, counts, places)
    for lane in range(LANES):
        turns = record[sizes.status * LANES + lane] == 1.0
        least, greatest = constants[LEAST_ROW * LANES + lane], constants[GREATEST_ROW * LANES + lane]
        if turns and counts[lane] == 2.0:
            record[(sizes.interval + 2) * LANES + lane] = reversal.time_ratio(least, greatest)
        else:
            constants[LEAST_ROW * LANES + lane] = constants[GREATEST_ROW * LANES + lane] = math.nan
            constants[LEAST_PLACE_ROW * LANES + lane] = constants[GREATEST_PLACE_ROW * LANES + lane] = math.nan
            if turns:
                is_undecided = counts[lane] == reversal.UNDECIDED
                record[sizes.status * LANES + lane] = (
                    statuses.STROKES_NOT_DECIDED if is_undecided else statuses.NO_STROKES
                )


@subroutine(allocates=True)
def _count_reversals(sizes, check, rate, tile, rates, lane, counts, places):
    """Count the reversals of a lane in doubt; the tile's lanes are its design."""
    cells, halves = np.empty(cell.MOST_CELLS * reversal.CELL_SIZE), np.empty(2 * LANES * reversal.CELL_SIZE)
    tangents, anchors, marks = np.empty(LANES), np.empty(LANES), np.empty(reversal.RATE_ROWS * LANES)
    minima, found = np.empty(2 * minimum.MOST_MINIMA), 0
    distance, knows_all = tile[DISTANCE_ROW * LANES], sizes.is_harmonic > 0 and sizes.of_motion == sizes.functions
    if knows_all and 0.0 < distance < minimum.NEAR <= tile[OTHERS_ROW * LANES]:
        minima[0], minima[1], found = tile[SINGULAR_ANGLE_ROW * LANES], 2.0 * math.atanh(distance), 1
    elif distance < minimum.NEAR:
        found = minimum.find_minima(sizes, check, tile, minima)
    waiting, count = reversal.collect_rates(rates, lane, cells), 0.0
    while waiting > 0 and waiting < cell.MOST_CELLS - LANES:
        taken = cell.place_middles(cells, 1, waiting, tangents, anchors)
        rate(tile, tangents, anchors, marks)
        waiting, count = reversal.halve_rates(
            cells, waiting, taken, marks, halves, count, lane, places, minima, found
        )  # fmt: skip
    is_complete = waiting == 0 and found < minimum.MOST_MINIMA
    counts[lane] = count if is_complete else reversal.UNDECIDED


@subroutine(allocates=True)
def _place_reversals(rate, constants, counts, places):
    """Fill the half-tangents of the reversals of lanes with two, and the places of the output there."""
    tangents, anchors, low, high = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    marks = np.empty(reversal.RATE_ROWS * LANES)
    for number in range(2):
        reversal.begin_search(places, counts, 2 * number, tangents, anchors, low, high)
        change, rounds = 1.0, 0
        while change > reversal.SAME and rounds < 60:
            rate(constants, tangents, anchors, marks)
            change, rounds = reversal.improve(marks, 1.0 - 2.0 * number, tangents, low, high), rounds + 1
        rate(constants, tangents, anchors, marks)
        for lane in range(LANES):
            constants[(LEAST_ROW + number) * LANES + lane] = reversal.from_anchor(tangents[lane], anchors[lane])
            constants[(LEAST_PLACE_ROW + number) * LANES + lane] = marks[3 * LANES + lane]
