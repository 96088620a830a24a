"""Windows behind one-way clutches: strokes cut to the part that drives the output."""

import math

import numpy as np

from explore.compiling import LANES
from explore.quadrature.chunks import constant, gather_constants
from explore.quadrature.hand_over import find_hand_overs
from explore.quadrature.panels import ANCHOR, CENTRE, FIRST, LAST, LENGTH, SCALE
from explore.quadrature.slots import PHASES, RATE, RATE_DERIVATIVE, RATE_NEEDS
from explore.subroutines import subroutine


@subroutine(allocates=True)
def shorten_to_clutches(fill, sizes, window, count, work, tile):
    """Cut each stroke, one panel, to the part that drives the output; fill the lengths that it is averaged over."""
    pending = np.empty(count, np.int64)
    for anchor in range(2):
        n = 0
        for k in range(count):
            i = work.owner[k]
            if int(work.panels[ANCHOR + k]) != anchor:
                continue
            period = 2.0 * math.pi / constant(work.constants, sizes.n_constants, window[PHASES], i)
            length = work.panels[LENGTH + k]
            work.averaging[i], work.rest[i] = period, max(period - length, 0.0)
            if period < length:
                pending[n] = k
                n += 1
        for start in range(0, n, LANES):
            _cut_tile(fill, sizes, window, anchor, pending[start : min(start + LANES, n)], work, tile)


@subroutine(allocates=True)
def _cut_tile(fill, sizes, window, anchor, chosen, work, tile):
    """Cut the chosen panels, at most a tile of them."""
    panels, needs = work.panels, window[RATE_NEEDS]
    scale, periods, rising = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    first, last = np.empty(LANES), np.empty(LANES)
    for lane in range(LANES):
        k = chosen[min(lane, len(chosen) - 1)]
        tile.lane_panels[lane], tile.lane_designs[lane] = k, work.owner[k]
        scale[lane], periods[lane] = panels[SCALE + k], work.averaging[work.owner[k]]
        first[lane], last[lane] = panels[FIRST + k], panels[LAST + k]
        tile.tangents[lane] = scale[lane] * math.sinh(panels[CENTRE + k])
    gather_constants(
        work.constants, sizes.n_constants, sizes.n_fill_constants, tile.lane_designs, tile.offsets, tile.constants
    )  # fmt: skip
    fill(tile.constants, tile.tangents, anchor, 0, 0, 1, needs, tile.signals)
    for lane in range(LANES):
        rising[lane] = 1.0 if tile.signals[window[RATE] * LANES + lane] > 0.0 else -1.0
    find_hand_overs(
        fill, tile.constants, anchor, 0, 0, needs, sizes.rows, window[RATE], window[RATE_DERIVATIVE], rising, scale,
        periods, first, last,
    )  # fmt: skip
    for lane in range(LANES):
        panels[FIRST + tile.lane_panels[lane]], panels[LAST + tile.lane_panels[lane]] = first[lane], last[lane]
