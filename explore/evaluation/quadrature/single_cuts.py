"""Cuts of the panels of one design where rows are at levels: signals have corners there, or other laws beyond."""

import math

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import DISTURBANCE
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.adaptive import place_part
from explore.evaluation.quadrature.chunks import gather_design
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, LENGTH, VARIANT
from explore.evaluation.quadrature.zeros import (
    MOST_ZEROS,
    collect_zeros,
    fill_inside,
    half_angle,
    relative_rounding,
    sample_row,
)

#: Largest number of places that one panel is cut at.
_MOST_PLACES = 192
#: Largest number of panels of one window after cuts.
_MOST_PANELS = 1024
#: Largest value of a row that is rounding, over what disturbing its operations and its node by `DISTURBANCE` changes.
_ROUNDED = 1e-2


@subroutine()
def _is_rounding(fill, needs, rows, row, level, noise, panels, k, count, tile):
    """Whether a row less a level is on panel k rounding of the largest sample of all panels: its terms cancel there.

    The samples of panel k are in the tile again afterwards.
    """
    largest = 0.0
    for other in range(count):
        last = sample_row(fill, needs, rows, row, -1, noise, panels, other, tile)
        for j in range(last + 1):
            largest = max(largest, abs(tile.weights[j]))
    last, is_rounding = sample_row(fill, needs, rows, row, -1, noise, panels, k, tile), True
    for j in range(last + 1):
        is_rounding = is_rounding and abs(tile.weights[j] - level) <= relative_rounding(noise) * largest
    return is_rounding and largest < math.inf


@subroutine(inlined=True)
def code_of_sense(value, change):
    """What a law says of a signal: 1 where it is positive, 2 where it is negative, 0 where all that it is is rounding.

    `change` is what disturbing its operations and its node by `DISTURBANCE` changes.
    """
    return 0.0 if abs(value) <= _ROUNDED * change else 1.0 if value > 0.0 else 2.0


@subroutine()
def _tell_senses(fill, disturbed_fill, needs, row, panels, k, found, weight, tile):
    """Add to the laws of the parts of panel k, in the tile's weights, the code of a row's sign there.

    Where all that a row is in a part is its rounding, it has the sign of the next part, or else of the one before: such
    a part lies between two places of one zero, as the end of a window and what the search finds.
    """
    zeros, codes, laws = tile.state, tile.roots, tile.weights
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    for i in range(found + 1):
        low, high = zeros[i - 1] if i > 0 else -1.0, zeros[i] if i < found else 1.0
        fill_inside(fill, needs, panels, k, low, math.nan, high, tile)
        for lane in range(LANES):
            tile.node[lane] += DISTURBANCE * (1.0 + abs(tile.node[lane]))
        disturbed_fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.disturbed)
        largest = change = 0.0
        for lane in range(LANES):
            value = tile.node_signals[row * LANES + lane]
            largest = value if abs(value) > abs(largest) else largest
            change = max(change, abs(tile.disturbed[row * LANES + lane] - value))
        codes[i] = code_of_sense(largest, change)
    for i in range(found - 1, -1, -1):
        codes[i] = codes[i + 1] if codes[i] == 0.0 else codes[i]
    for i in range(found + 1):
        codes[i] = codes[i - 1] if codes[i] == 0.0 and i > 0 else codes[i]
        laws[i] += weight * codes[i]


@subroutine()
def cut_at_corners(
    fill, disturbed_fill, sizes, needs, corner_rows, corner_levels, sense_count, work, tile, count
):  # fmt: skip
    """Cut the panels of a window of one design where rows are at levels: first at senses, on which others depend.

    Return the number of panels, and whether a panel has more zeros than it is cut at.
    """
    is_missed = False
    if sense_count > 0:
        rows, levels = corner_rows[:sense_count], corner_levels[:sense_count]
        count, is_missed = _cut(fill, disturbed_fill, sizes, needs, rows, levels, True, work, tile, count)
    if sense_count < len(corner_rows):
        rows, levels = corner_rows[sense_count:], corner_levels[sense_count:]
        count, others = _cut(fill, disturbed_fill, sizes, needs, rows, levels, False, work, tile, count)
        is_missed = is_missed or others
    return count, is_missed


@subroutine()
def _cut(fill, disturbed_fill, sizes, needs, corner_rows, corner_levels, tells_senses, work, tile, count):
    """Cut panels where rows are at levels, and tell the laws of the parts if these are senses."""
    panels, zeros, number, is_missed = work.panels, tile.state, count, False
    design = work.owner[0]
    gather_design(sizes, design, work, tile)
    for k in range(count):
        found = last = 0
        for i in range(len(corner_rows)):
            row, terms_row = corner_rows[i, 0], corner_rows[i, 1]
            if i == 0 or row != corner_rows[i - 1, 0]:
                last = sample_row(fill, needs, sizes.rows, row, terms_row, work.noise[design], panels, k, tile)
            most = min(found + MOST_ZEROS, _MOST_PLACES, max(_MOST_PANELS - number, found))
            found = collect_zeros(fill, needs, row, corner_levels[i], panels, k, last, found, most, tile)
            if found > most:
                level, noise = corner_levels[i], work.noise[design]
                is_rounding = terms_row < 0 and _is_rounding(
                    fill, needs, sizes.rows, row, level, noise, panels, k, number, tile
                )
                found, is_missed = most, is_missed or not is_rounding
        if tells_senses:
            for i in range(found + 1):
                tile.weights[i] = 0.0
            for i in range(len(corner_rows)):
                row, weight = corner_rows[i, 0], float(1 << 2 * i)
                _tell_senses(fill, disturbed_fill, needs, row, panels, k, found, weight, tile)
        centre, half, end, at_end = panels[CENTRE + k], panels[HALF + k], 1.0, half_angle(panels, k, 1.0)
        for i in range(found, -1, -1):  # the first part replaces the panel
            begin, to = zeros[i - 1] if i > 0 else -1.0, number if i > 0 else k
            at_begin = half_angle(panels, k, begin)
            place_part(panels, work.owner, k, to, centre + 0.5 * half * (begin + end), 0.5 * half * (end - begin))
            panels[LENGTH + to] = 2.0 * (at_end - at_begin)
            if tells_senses:
                panels[LAW + to] = tile.weights[i]
            end, at_end, number = begin, at_begin, number + (1 if i > 0 else 0)
            if i > 0:
                panels[CENTRE + k], panels[HALF + k] = centre, half
    return number, is_missed
