"""Mean and variance over the turn of the links of loops of four bars, whose driver turns and whose other link rocks.

They are those of `explore.mechanisms.four_bar_integrals`, which need the four lengths alone: the turn may begin
anywhere, and a mirrored loop has the same.
"""

import numpy as np
from numba import types

from explore.base.compiling import INTEGRALS, LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.four_bar import FOUR_BAR_SIZE, prepare
from explore.mechanisms.four_bar_integrals import ROWS, integrals

#: Lengths of a loop.
_LENGTHS = 4
#: Numbers of a link.
_SIZE = INTEGRALS * LANES

_F1 = types.float64[::1]
#: Type of `fill_turn_moments`.
TURN_MOMENTS_SIGNATURE = types.void(_F1, _F1, _F1, _F1, _F1, _F1, _F1)


@compiled(TURN_MOMENTS_SIGNATURE, allocates=True)
def fill_turn_moments(record, starts, stops, rows, lengths, places, out):
    """Fill mean, variance and bounds of their errors of links, over a turn from any start on.

    `rows` and `lengths` have four entries a loop: crank, coupler, rocker and ground, each a row of the record, or -1
    and its value; `places` has two, where coupler and rocker are in `out`, -1 for one that is not wanted. The bounds
    are not numbers where the ground is not longer than the crank: then all links turn.
    """
    given, constants = np.empty(_LENGTHS * LANES), np.empty(FOUR_BAR_SIZE * LANES)
    moments = np.empty(len(ROWS) * _SIZE)
    for first in range(0, len(rows), _LENGTHS):
        for k in range(_LENGTHS):
            row = int(rows[first + k])
            for lane in range(LANES):
                given[k * LANES + lane] = abs(record[row * LANES + lane]) if row >= 0 else lengths[first + k]
        _prepare(given, constants)
        integrals(constants, starts, stops, moments)
        for link in range(len(ROWS)):
            place = int(places[first // _LENGTHS * len(ROWS) + link])
            if place >= 0:
                _store(moments[link * _SIZE : (link + 1) * _SIZE], out[place * _SIZE :])


@subroutine(no_alias=True)
def _prepare(given, constants):
    """Fill the constants of the loop in each lane."""
    for lane in range(LANES):
        prepare(
            given[lane], given[LANES + lane], given[2 * LANES + lane], given[3 * LANES + lane], 1.0, constants, lane
        )  # fmt: skip


@subroutine()
def _store(moments, out):
    """Take the moments of a link that rocks, whose mean is exactly 0."""
    for k in range(_SIZE):
        out[k] = moments[k]
    for lane in range(LANES):
        # times 0, because a bound that is not a number stays so
        out[lane], out[2 * LANES + lane] = 0.0, 0.0 * moments[2 * LANES + lane]
