"""Whole blocks of designs through a mechanism's functions, tile after tile."""

import numpy as np
from numba import types

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled, function_type
from explore.base.subroutines import subroutine

_CLOSE, _FILL = function_type(CLOSE_SIGNATURE), function_type(FILL_SIGNATURE)
_F1, _F2, _F3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]


@subroutine(no_alias=True)
def load_tile(parameters, start, tile):
    """Fill the rows of parameters of a tile with those of the designs from `start` on, the last one repeated."""
    lanes = min(LANES, parameters.shape[1] - start)
    for p in range(parameters.shape[0]):
        row = tile[p * LANES :]
        if lanes == LANES:
            for lane in range(LANES):
                row[lane] = parameters[p, start + lane]
        else:
            for lane in range(LANES):
                row[lane] = parameters[p, start + min(lane, lanes - 1)]


@subroutine(no_alias=True)
def _store_rows(tile, start, columns):
    """Fill the designs of a tile from `start` on, as many as there are, in columns (m, n)."""
    lanes = min(LANES, columns.shape[1] - start)
    for m in range(columns.shape[0]):
        row = tile[m * LANES :]
        if lanes == LANES:
            for lane in range(LANES):
                columns[m, start + lane] = row[lane]
        else:
            for lane in range(lanes):
                columns[m, start + lane] = row[lane]


@compiled(
    types.void(_CLOSE, _F2, types.int64, types.int64, types.int64, types.int64, _F2, _F2, types.int8[::1]),
    allocates=True,
)
def close_all(close, parameters, record_rows, first_parameter, first_metric, status_row, constants, metrics, status):
    """Evaluate the closed form of every design from `parameters` (p, n).

    Fill `metrics` (m, n), `status` (n,) and the first `constants` (k, n). A tile of records has `record_rows` rows; the
    parts begin at `first_parameter`, `first_metric` and `status_row`.
    """
    record = np.zeros(record_rows * LANES)
    n = parameters.shape[1]
    for start in range(0, n, LANES):
        lanes = min(LANES, n - start)
        load_tile(parameters, start, record[first_parameter * LANES :])
        close(record)
        _store_rows(record, start, constants)
        _store_rows(record[first_metric * LANES :], start, metrics)
        for lane in range(lanes):
            status[start + lane] = np.int8(record[status_row * LANES + lane])


@compiled(
    types.void(_FILL, _F2, types.int64, _F2, types.int64, types.int64, types.int64, types.int64[::1], _F3),
    allocates=True,
)
def fill_rows(fill, constants, rows_read, tangents, anchor, needs, rows, chosen, values):
    """Fill `values` (t, m, n), m `chosen` rows of the signals of n designs at t half-tangents (t, n) from the anchor.

    The lanes are designs. `fill` reads the first `rows_read` rows of the constants (k, n), and takes `anchor`, `needs`
    and `rows`.
    """
    count, n = tangents.shape
    tile, nodes, out = np.empty(rows_read * LANES), np.empty(count * LANES), np.empty(count * rows * LANES)
    for start in range(0, n, LANES):
        load_tile(tangents, start, nodes)
        load_tile(constants[:rows_read], start, tile)
        fill(tile, nodes, anchor, 0, 0, count, needs, out)
        for j in range(count):
            for m in range(len(chosen)):
                row = out[(j * rows + chosen[m]) * LANES :]
                for lane in range(min(LANES, n - start)):
                    values[j, m, start + lane] = row[lane]


@compiled(
    types.void(_FILL, _F1, types.int64[::1], types.int64[::1], _F1, types.int64, types.int64, types.int64, _F2),
    allocates=True,
)
def fill_motion_of_design(fill, constants, anchors, laws, tangents, variant, needs, rows, signals):
    """Fill the signals (rows, t) of one design with constants (k,) at t angles; the lanes are nodes.

    Each half-tangent counts from its own anchor, under its own law; `fill` takes `variant`, `needs` and `rows`.
    """
    tile, out = np.empty(len(constants) * LANES), np.empty(rows * LANES)
    node, numbers = np.empty(LANES), np.empty(LANES, np.int64)
    for k in range(len(constants)):
        tile[k * LANES : (k + 1) * LANES] = constants[k]
    count = len(tangents)
    done = np.zeros(count, np.bool_)
    for first in range(count):
        if done[first]:
            continue
        # The next tile: angles from here on with the same anchor and law.
        lanes = 0
        for j in range(first, count):
            if not done[j] and anchors[j] == anchors[first] and laws[j] == laws[first] and lanes < LANES:
                node[lanes], numbers[lanes], done[j] = tangents[j], j, True
                lanes += 1
            if lanes == LANES:
                break
        for lane in range(lanes, LANES):
            node[lane] = node[0]
        fill(tile, node, anchors[first], laws[first], variant, 1, needs, out)
        for row in range(rows):
            for lane in range(lanes):
                signals[row, numbers[lane]] = out[row * LANES + lane]
