"""Windows behind one-way clutches: strokes cut to the part that drives the output."""

import math

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import hand_over
from explore.evaluation.quadrature.chunks import constant, gather_constants
from explore.evaluation.quadrature.hand_over import find_hand_overs
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, FIRST, LAST, LENGTH, SCALE, SPREAD
from explore.evaluation.quadrature.slots import PHASES, RATE, RATE_DERIVATIVE, RATE_NEEDS


@subroutine()
def shorten_to_clutches(fill, sizes, window, count, work, tile):
    """Cut each stroke, one panel, to the part that drives the output; fill the lengths that it is averaged over."""
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
                work.order[n] = k
                n += 1
        for start in range(0, n, LANES):
            _cut_tile(fill, sizes, window, anchor, work.order[start : min(start + LANES, n)], work, tile)


@subroutine(contract=True)
def _place_middles(state, tangents):
    """Replace the middles of strokes, in t, by their half-tangents."""
    for lane in range(LANES):
        growth = exponential(tangents[lane])
        tangents[lane] = 0.5 * state[hand_over.SCALE + lane] * (growth - 1.0 / growth)


@subroutine()
def _cut_tile(fill, sizes, window, anchor, chosen, work, tile):
    """Cut the chosen panels, at most a tile of them."""
    panels, needs, state = work.panels, window[RATE_NEEDS], tile.state
    for lane in range(LANES):
        k = chosen[min(lane, len(chosen) - 1)]
        tile.lane_panels[lane], tile.lane_designs[lane] = k, work.owner[k]
        state[hand_over.SCALE + lane], state[hand_over.PERIOD + lane] = panels[SCALE + k], work.averaging[work.owner[k]]
        state[hand_over.FIRST + lane], state[hand_over.LAST + lane] = panels[FIRST + k], panels[LAST + k]
        tile.tangents[lane] = panels[CENTRE + k]
    _place_middles(state, tile.tangents)
    gather_constants(
        work.constants, sizes.n_constants, sizes.n_fill_constants, tile.lane_designs, tile.offsets, tile.constants
    )  # fmt: skip
    fill(tile.constants, tile.tangents, anchor, 0, 0, 1, needs, tile.signals)
    for lane in range(LANES):
        state[hand_over.RISING + lane] = 1.0 if tile.signals[window[RATE] * LANES + lane] > 0.0 else -1.0
    find_hand_overs(
        fill, tile.constants, anchor, 0, 0, needs, sizes.rows, window[RATE], window[RATE_DERIVATIVE], state,
        tile.tangents, tile.signals,
    )  # fmt: skip
    for lane in range(LANES):
        k = tile.lane_panels[lane]
        first, last = state[hand_over.FIRST + lane], state[hand_over.LAST + lane]
        panels[FIRST + k], panels[LAST + k], panels[SPREAD + k] = first, last, last - first
