"""Chunks of designs: their constants, the panels of a window, and the panels sorted by rule.

The constants of a chunk are stored tile after tile, ``constants[(tile * constant_count + row) * LANES + lane]``. Panel
p of design i has the number ``first_panel[i] + p * stride``.
"""

from numba import types

from explore.base.compiling import CLOSE_SIGNATURE, LANES, function_type
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.anchored import turn_interval, turn_window
from explore.evaluation.quadrature.bounds import CHUNK
from explore.evaluation.quadrature.panels import (
    ANCHOR,
    COUNT,
    FIRST,
    LAST,
    LAW,
    PANEL_CAPACITY,
    SCALE,
    SINGULAR,
    SPREAD,
    VARIANT,
)
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT
from explore.evaluation.quadrature.windows import (
    ARC,
    INTERVAL,
    LARGEST_TANGENT,
    LONGER,
    TIE,
    TURN,
    add_interval,
    add_window,
)
from explore.model.quadrature import MOST_SINGULARITIES

#: Largest number of panels of one design and window: three for each part between `MOST_BREAKS` breaks and the ends.
MOST_PANELS = 24
#: Largest number of combinations of variant, law, anchor and kind of nodes in one chunk: each panel may have its own.
MOST_KINDS = PANEL_CAPACITY

#: Number of laws that panels can have: two bits for each of 16 senses.
LAWS = 1 << 32

CODES = LARGEST_NODE_COUNT + 1

CLOSE_TYPE = function_type(CLOSE_SIGNATURE)
_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


@subroutine(no_alias=True)
def _gather(columns, designs, first, together, tile):
    """Fill the rows of a tile with columns (m, n) of designs: from the `first` on, if they stand `together`."""
    for m in range(columns.shape[0]):
        row, source = tile[m * LANES :], columns[m, first:]
        if together:
            for lane in range(LANES):
                row[lane] = source[lane]
        else:
            for lane in range(LANES):
                row[lane] = columns[m, designs[min(lane, len(designs) - 1)]]


@subroutine(no_alias=True)
def close_chunk(close, parameters, kept, designs, first_parameter, constant_count, record, constants):
    """Fill the constants of a chunk of designs, tile after tile; the last tile is filled up with its last design.

    They are those that were `kept` (k, n), or what `close` fills where not all were.
    """
    count = len(designs)
    for tile in range((count + LANES - 1) // LANES):
        begin = tile * LANES
        first = designs[begin]
        together = begin + LANES <= count and designs[begin + LANES - 1] - first == LANES - 1
        to = constants[tile * constant_count * LANES :]
        if kept.shape[0] == constant_count:
            _gather(kept, designs[begin:], first, together, to)
        else:
            _gather(parameters, designs[begin:], first, together, record[first_parameter * LANES :])
            close(record)
            for j in range(constant_count * LANES):
                to[j] = record[j]


@subroutine(inlined=True)
def constant(constants, constant_count, row, design):
    """One constant of one design of the chunk."""
    return constants[(design // LANES * constant_count + row) * LANES + design % LANES]


@subroutine(no_alias=True)
def _fill_constant_rows(constants, constant_count, count, shift, singular_rows, variant_row, panels):
    """Fill singularities and variants of the panels ``shift + i`` of the designs i."""
    for tile in range((count + LANES - 1) // LANES):
        base, to = tile * constant_count * LANES, shift + tile * LANES
        lanes = min(LANES, count - tile * LANES)
        for s in range(MOST_SINGULARITIES):
            row = panels[SINGULAR + s * PANEL_CAPACITY + to :]
            source = constants[base + max(singular_rows[s], 0) * LANES :]
            for lane in range(lanes):
                row[lane] = source[lane] if singular_rows[s] >= 0 else 1.0
        row, source = panels[VARIANT + to :], constants[base + max(variant_row, 0) * LANES :]
        for lane in range(lanes):
            row[lane] = source[lane] if variant_row >= 0 else 0.0


@subroutine(no_alias=True)
def _add_one_panel_each(constants, constant_count, count, kind, start_row, stop_row, panels):
    """Fill one panel for each design, if every arc goes past one anchor and not past the other; return whether so.

    Without branches: `explore.evaluation.quadrature.windows.add_window` does the same for any arc.
    """
    simple = True
    for tile in range((count + LANES - 1) // LANES):
        base, to = tile * constant_count * LANES, tile * LANES
        starts, stops = constants[base + start_row * LANES :], constants[base + stop_row * LANES :]
        anchors, firsts = panels[ANCHOR + to :], panels[FIRST + to :]
        lasts, laws, spreads = panels[LAST + to :], panels[LAW + to :], panels[SPREAD + to :]
        lanes = min(LANES, count - tile * LANES)
        for lane in range(lanes):
            start, stop = starts[lane], stops[lane]
            if kind != ARC:
                product = -start * stop if start < stop else -1.0 / (start * stop)
                swap = (product > 1.0 + TIE) != (kind == LONGER)
                start, stop = stop if swap else start, start if swap else stop
            at_anchor = (start < 0.0) & (stop > 0.0)
            first, last = start if at_anchor else -1.0 / start, stop if at_anchor else -1.0 / stop
            anchors[lane], firsts[lane], lasts[lane] = 0.0 if at_anchor else 1.0, first, last
            laws[lane], spreads[lane] = 0.0, last - first
            simple &= (first < 0.0) & (last > 0.0) & (first > -LARGEST_TANGENT) & (last < LARGEST_TANGENT)
    return simple


@subroutine()
def _add_regular_panels(
    constants, constant_count, count, window, singular_rows, variant_row, panels, first_panel, panel_count, owner
):
    """Fill two panels for each design of a turn, one for each of a stroke; return their number, 0 for other windows."""
    kind, per_design = window[0], 0
    if kind == TURN:
        per_design = 2
        for p in range(2):
            for i in range(count):
                k = p * count + i
                panels[ANCHOR + k], panels[FIRST + k], panels[LAST + k], panels[LAW + k] = float(p), -1.0, 1.0, 0.0
                panels[SPREAD + k] = 2.0
    elif kind != INTERVAL:
        simple = _add_one_panel_each(constants, constant_count, count, kind, window[1], window[2], panels)
        per_design = 1 if simple else 0
    for p in range(per_design):
        _fill_constant_rows(constants, constant_count, count, p * count, singular_rows, variant_row, panels)
        for i in range(count):
            owner[p * count + i] = i
    if per_design > 0:
        for i in range(count):
            first_panel[i], panel_count[i] = i, per_design
    return per_design


@subroutine()
def add_panels(
    constants, constant_count, begin, count, capacity, window, interval, breaks, singular_rows, is_anchored,
    variant_row, panels, first_panel, panel_count, owner, positions,
):  # fmt: skip
    """Fill the panels of a window of the designs of the chunk from `begin` on, as many as fit into a `capacity`.

    They are about the places of singularities where `is_anchored`. Return the first design that is left, the number of
    panels and the stride, which is 1 below the full capacity.
    """
    is_turned = is_anchored and window[0] != TURN
    if len(breaks) == 0 and not is_turned and begin == 0 and count <= CHUNK and capacity == PANEL_CAPACITY:
        per_design = _add_regular_panels(
            constants, constant_count, count, window, singular_rows, variant_row, panels, first_panel, panel_count,
            owner,
        )  # fmt: skip
        if per_design > 0:
            return count, per_design * count, count
    k = 0
    for i in range(begin, count):
        if k + MOST_PANELS > capacity:
            return i, k, 1
        first_panel[i] = k
        start = stop = 0.0
        if window[1] >= 0:
            start = constant(constants, constant_count, window[1], i)
            stop = constant(constants, constant_count, window[2], i)
        for j in range(len(breaks)):
            positions[j] = constant(constants, constant_count, breaks[j], i)
        first, kind, anchor, offset = k, window[0], interval[0], interval[1]
        if is_turned:
            place = constant(constants, constant_count, singular_rows[1], i)
            place = place if place == place else 0.0  # not NaN
            if kind == INTERVAL:
                anchor, offset = turn_interval(anchor, offset, place)
            else:
                kind, start, stop = turn_window(kind, start, stop, place)
        if kind == INTERVAL:
            k = add_interval(panels, k, anchor, offset, interval[2], positions, len(breaks))
        else:
            k = add_window(panels, k, kind, start, stop, positions, len(breaks))
        panel_count[i] = k - first
        variant = constant(constants, constant_count, variant_row, i) if variant_row >= 0 else 0.0
        for p in range(first, k):
            owner[p], panels[VARIANT + p] = i, variant
        for s in range(MOST_SINGULARITIES):
            value = constant(constants, constant_count, singular_rows[s], i) if singular_rows[s] >= 0 else 1.0
            for p in range(first, k):
                panels[SINGULAR + s * PANEL_CAPACITY + p] = value
    return count, k, 1


@subroutine(no_alias=True)
def gather_constants(constants, constant_count, rows, designs, offsets, tile):
    """Fill the first `rows` rows of a tile with the constants of any designs of the chunk.

    `offsets` is work space; its numbers are unsigned, because signed indices would be tested for being negative.
    """
    width = len(designs)
    for lane in range(width):
        offsets[lane] = designs[lane] // LANES * constant_count * LANES + designs[lane] % LANES
    for row in range(rows):
        source, to = constants[row * LANES :], tile[row * LANES :]
        for lane in range(width):
            to[lane] = source[offsets[lane]]


@subroutine()
def gather_design(sizes, design, work, tile):
    """Fill all lanes of a tile with the constants of one design of the chunk."""
    for lane in range(LANES):
        tile.lane_designs[lane] = design
    gather_constants(
        work.constants, sizes.n_constants, sizes.n_fill_constants, tile.lane_designs, tile.offsets, tile.constants
    )  # fmt: skip


@subroutine()
def sort_by_rule(panels, todo, count, size_of, kinds, codes, histogram, order, starts):
    """Round node counts up to rules; sort the panels ``todo[:count]``; return the number of bins.

    Bin b, ``order[starts[b] : starts[b + 1]]``, has panels of one kind (variant, law, anchor, and whether the nodes are
    equispaced) and one rule.
    """
    n_kinds = 0
    for t in range(count):
        k = todo[t]
        size = size_of[int(panels[COUNT + k])]
        panels[COUNT + k] = size
        rule = 1 if panels[SCALE + k] == 0.0 else 0
        kind = ((int(panels[VARIANT + k]) * LAWS + int(panels[LAW + k])) * 2 + int(panels[ANCHOR + k])) * 2 + rule
        number = 0
        while number < n_kinds and kinds[number] != kind:
            number += 1
        if number == n_kinds:
            kinds[number] = kind
            n_kinds += 1
        codes[t] = number * CODES + size
    span = n_kinds * CODES
    histogram[: span + 1] = 0
    for t in range(count):
        histogram[codes[t] + 1] += 1
    n_bins = 0
    for code in range(span):
        if histogram[code + 1] > 0:
            starts[n_bins] = histogram[code]
            n_bins += 1
        histogram[code + 1] += histogram[code]
    starts[n_bins] = count
    for t in range(count):
        order[histogram[codes[t]]] = todo[t]
        histogram[codes[t]] += 1
    return n_bins
