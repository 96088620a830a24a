"""Integrals of signals over windows in closed form, for mechanisms that have them, tile after tile of designs."""

import numpy as np
from numba import types

from explore.base.compiling import CLOSE_SIGNATURE, INTEGRALS, INTEGRALS_SIGNATURE, LANES, compiled, function_type
from explore.base.lanes.designs import load_tile
from explore.evaluation.quadrature.windows import INTERVAL, TURN, orient

#: Half-tangent of half a turn: its square is a double.
HALF_TURN = 1e150

_F2, _F3 = types.float64[:, ::1], types.float64[:, :, ::1]


@compiled(CLOSE_SIGNATURE)
def leave_open(record):
    """Fill nothing of a record, for integrals of the parameters alone."""


@compiled(
    types.void(
        function_type(CLOSE_SIGNATURE), function_type(INTEGRALS_SIGNATURE), _F2, types.int64, types.int64, types.int64,
        types.int64, types.int64, types.float64, types.float64, types.int64, types.int64[::1], _F3,
    ), allocates=True)  # fmt: skip
def integrate(
    close, integrals, parameters, record_rows, first_parameter, kind, start_row, stop_row, start, stop, count, signals,
    results,
):  # fmt: skip
    """Integrals of every design over one window, which fill `results` (s, INTEGRALS, n) for the s wanted signals.

    `close` and `integrals`, compiled functions of the mechanism, take tiles of `record_rows` rows, of which the p
    parameters (p, n) begin at `first_parameter`. `kind`, `start_row` and `stop_row` are those of the window in
    `explore.evaluation.quadrature.slots`, `start` and `stop` half-tangents of the ends of an explicit interval.
    `integrals` fills the rows of `count` signals, of which the numbers in `signals` are wanted.
    """
    record, out = np.zeros(record_rows * LANES), np.empty(count * INTEGRALS * LANES)
    starts, stops = np.empty(LANES), np.empty(LANES)
    n = parameters.shape[1]
    for first in range(0, n, LANES):
        load_tile(parameters, first, record[first_parameter * LANES :])
        close(record)
        if kind == TURN or kind == INTERVAL:
            starts[:], stops[:] = (-HALF_TURN, HALF_TURN) if kind == TURN else (start, stop)
        else:
            for lane in range(LANES):
                starts[lane], stops[lane] = orient(
                    kind, record[start_row * LANES + lane], record[stop_row * LANES + lane]
                )
        integrals(record, starts, stops, out)
        lanes = min(LANES, n - first)
        for s in range(len(signals)):
            for row in range(INTEGRALS):
                source, to = out[(signals[s] * INTEGRALS + row) * LANES :], results[s, row, first:]
                if lanes == LANES:
                    for lane in range(LANES):
                        to[lane] = source[lane]
                else:
                    for lane in range(lanes):
                        to[lane] = source[lane]
