"""Near singularities of a design: minima of its functions that are small beside their maxima, and zeros above these."""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import place_angle

#: Half-tangent of the distance of singularities below which a pulse may hide between nodes.
NEAR = 0.06
#: Largest number of minima of one design.
MOST_MINIMA = 32
#: Number of cells of the turn, a multiple of the lanes.
_CELLS = 32
#: Value beside a minimum over the greatest one, below which a zero may be near.
_SMALL = 0.1
#: Rounds that narrow a minimum, each to a seventeenth.
_ROUNDS = 8


@subroutine(allocates=True)
def find_minima(sizes, check, tile, minima):
    """Fill angle and distance, rad, of the zero above each minimum of what motions depend on; return their number.

    A function is like a parabola there. All lanes of the tile are one design.
    """
    functions, rows, width = sizes.functions, 2 * sizes.functions + sizes.factors, 2.0 * math.pi / _CELLS
    values, tangents, anchors = np.empty(rows * LANES), np.empty(LANES), np.empty(LANES)
    samples = np.empty(2 * functions * (_CELLS + 1))
    for first in range(0, _CELLS, LANES):
        for lane in range(LANES):
            tangents[lane], anchors[lane] = place_angle(width * (first + lane))
        check(tile, tangents, anchors, values)
        for s in range(2 * functions):
            for lane in range(LANES):
                samples[s * (_CELLS + 1) + first + lane] = values[s * LANES + lane]
    found = 0
    for s in range(sizes.of_motion):
        own, slopes = samples[s * (_CELLS + 1) :], samples[(functions + s) * (_CELLS + 1) :]
        own[_CELLS], slopes[_CELLS] = own[0], slopes[0]
        greatest = 0.0
        for j in range(_CELLS):
            greatest = max(greatest, own[j])
        for j in range(_CELLS):
            is_small = min(own[j], own[j + 1]) < _SMALL * greatest
            if is_small and slopes[j] < 0.0 and slopes[j + 1] >= 0.0 and found < MOST_MINIMA:
                minima[2 * found], least = _narrow(check, tile, width * j, width, s, functions + s, values)
                minima[2 * found + 1] = math.sqrt(2.0 * max(least, 0.0) * width / (slopes[j + 1] - slopes[j]))
                found += 1
    return found


@subroutine(allocates=True)
def _narrow(check, tile, start, width, own, slope, values):
    """The angle in a cell at which a slope turns positive, and the function there, from their rows."""
    tangents, anchors, below = np.empty(LANES), np.empty(LANES), 0
    for _ in range(_ROUNDS):
        width /= LANES + 1
        for lane in range(LANES):
            tangents[lane], anchors[lane] = place_angle(start + width * (lane + 1))
        check(tile, tangents, anchors, values)
        below = 0
        for lane in range(LANES):
            below += 1 if below == lane and values[slope * LANES + lane] < 0.0 else 0
        start += below * width
    return start + 0.5 * width, values[own * LANES + min(below, LANES - 1)]
