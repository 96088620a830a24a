"""Zeros of signals, and places where they reach levels: other signals have corners there.

They are found before the adaptive rule samples, and made ends of panels.

A power without its negative part has corners at the zeros of the power, forces with friction at those of the guide's
force. A pulse between two zeros may be narrower than any distance of nodes. The signal itself is smooth there, so
that samples of it show a pair of zeros as a dip: a local minimum of its magnitude.

The lanes of a tile are points of one panel. A bracket is cut into `LANES` + 1 parts at once, by position in the panel,
between -1 and 1.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.disturbance import DISTURBANCE
from explore.base.lanes.elementary import exponential
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.adaptive import place_part
from explore.evaluation.quadrature.bounds import ROUNDING
from explore.evaluation.quadrature.chunks import gather_design
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, LENGTH, SCALE, VARIANT
from explore.evaluation.quadrature.tiles import NODE_CAPACITY

#: Smallest number of tiles of samples of a panel.
_FEWEST_TILES = 16
#: Number of tiles of samples per length in t, where all singularities are at least pi/2 off the real axis.
_TILES_PER_LENGTH = 2.0
#: Largest number of places on one panel where a row is at one level.
MOST_ZEROS = 64
#: Largest number of places that one panel is cut at.
_MOST_PLACES = 192
#: Largest number of panels of one window after cuts.
_MOST_PANELS = 1024
#: Largest value of a row that is rounding, over what disturbing its operations and its node by `DISTURBANCE` changes.
_ROUNDED = 1e-2
#: Number of cuts of a bracket from a length of 1 to below rounding.
_MOST_CUTS = 14
#: Smallest distance of a zero from other zeros and from the ends of a panel, in t relative to 1 + |t|.
_SHORTEST = 1e-13


@subroutine()
def _fill_inside(fill, needs, panels, k, low, high, tile):
    """Fill the signals at as many points as lanes inside a part of panel k."""
    for lane in range(LANES):
        position = low + (high - low) * (lane + 1) / (LANES + 1)
        growth = exponential(panels[CENTRE + k] + panels[HALF + k] * position)
        tile.node[lane] = 0.5 * panels[SCALE + k] * (growth - 1.0 / growth)
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.node_signals)


@subroutine()
def _find_zero(fill, needs, row, level, panels, k, low, high, is_above, tile):
    """Position where the row passes a level between `low`, where it is above or not, and `high`."""
    for _ in range(_MOST_CUTS):
        _fill_inside(fill, needs, panels, k, low, high, tile)
        passed = 0
        while passed < LANES and (tile.node_signals[row * LANES + passed] > level) == is_above:
            passed += 1
        step = (high - low) / (LANES + 1)
        low, high = low + passed * step, low + (passed + 1) * step if passed < LANES else high
    return 0.5 * (low + high)


@subroutine()
def _find_crossing(fill, needs, row, level, panels, k, low, high, at_low, best, at_high, sign, tile):
    """Position between `low` and `high` where ``sign * (row - level)`` is not positive; NaN if there is none.

    `at_low`, `best` and `at_high` are values at both and at a point between them, or at the lower of both. A dip is not
    deeper than the row changes between these.
    """
    for _ in range(_MOST_CUTS):
        if best > max(at_low, at_high) - best:
            return math.nan
        _fill_inside(fill, needs, panels, k, low, high, tile)
        least, best = -1, min(at_low, at_high)
        if at_high < at_low:
            least = LANES
        for lane in range(LANES):
            value = sign * (tile.node_signals[row * LANES + lane] - level)
            if value < best:
                least, best = lane, value
        step = (high - low) / (LANES + 1)
        if best < 0.0 or (best == 0.0 and sign > 0.0):
            return low + (least + 1) * step
        if least > 0:
            at_low = sign * (tile.node_signals[row * LANES + least - 1] - level)
        if least < LANES - 1:
            at_high = sign * (tile.node_signals[row * LANES + least + 1] - level)
        low, high = low + max(least, 0) * step, low + min(least + 2, LANES + 1) * step
    return math.nan


@subroutine()
def insert(panels, k, position, zeros, count, most):
    """Insert a zero into the ascending positions of others, unless it is one of them or an end; return their number.

    It is `most` + 1 where there is no room.
    """
    at = count
    while at > 0 and zeros[at - 1] > position:
        at -= 1
    before, after = zeros[at - 1] if at > 0 else -1.0, zeros[at] if at < count else 1.0
    least = _SHORTEST * (1.0 + abs(panels[CENTRE + k] + panels[HALF + k] * position))
    if count > most or min(position - before, after - position) * panels[HALF + k] < least:
        return count
    if count == most:
        return count + 1
    for i in range(count, at, -1):
        zeros[i] = zeros[i - 1]
    zeros[at] = position
    return count + 1


@subroutine(inlined=True)
def _relative_rounding(noise):
    """Bound of the rounding error of a sample, over the size of its terms."""
    return ROUNDING * (1.0 + noise * (1.0 + noise))


@subroutine()
def sample_row(fill, needs, rows, row, terms_row, noise, panels, k, tile):
    """Fill samples of a row on panel k and bounds of their rounding errors; return the number of the last sample.

    Where the size of its terms is not known, a row is rounded like its largest sample.
    """
    tiles = min(max(_FEWEST_TILES, math.ceil(2.0 * _TILES_PER_LENGTH * panels[HALF + k])), NODE_CAPACITY)
    last = tiles * LANES - 1
    for j in range(last + 1):
        growth = exponential(panels[CENTRE + k] + panels[HALF + k] * (2.0 * j / last - 1.0))
        tile.tangents[j] = 0.5 * panels[SCALE + k] * (growth - 1.0 / growth)
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    fill(tile.constants, tile.tangents, anchor, law, variant, tiles, needs, tile.signals)
    values, roundings, largest = tile.weights, tile.roots, 0.0
    for j in range(last + 1):
        values[j] = tile.signals[(j // LANES * rows + row) * LANES + j % LANES]
        largest = max(largest, abs(values[j]))
    for j in range(last + 1):
        terms = tile.signals[(j // LANES * rows + terms_row) * LANES + j % LANES] if terms_row >= 0 else largest
        roundings[j] = _relative_rounding(noise) * terms
    return last


@subroutine()
def collect_zeros(fill, needs, row, level, panels, k, last, count, most, tile):
    """Add the places on panel k where a row is at a level to the first `count` of the positions in the tile's state.

    Return their number, `most` + 1 if there are more that are not rounding. The samples 0 to `last` of the row are in
    the tile.
    """
    values, roundings = tile.weights, tile.roots
    for j in range(last + 1):
        former, own, later = values[max(j - 1, 0)] - level, values[j] - level, values[min(j + 1, last)] - level
        is_rounding = max(abs(former), abs(own), abs(later)) <= roundings[j]
        if count > most or (count == most and is_rounding):
            continue
        before, here = 2.0 * max(j - 1, 0) / last - 1.0, 2.0 * j / last - 1.0
        after = 2.0 * min(j + 1, last) / last - 1.0
        sign = 1.0 if own > 0.0 else -1.0
        if j > 0 and (former > 0.0) != (own > 0.0):
            zero = _find_zero(fill, needs, row, level, panels, k, before, here, former > 0.0, tile)
            count = insert(panels, k, zero, tile.state, count, most)
        left, value, right = sign * former, sign * own, sign * later
        if value > min(left, right) or value == max(left, right):
            continue
        crossing = _find_crossing(fill, needs, row, level, panels, k, before, after, left, value, right, sign, tile)
        if crossing == crossing:  # not NaN
            zero = _find_zero(fill, needs, row, level, panels, k, before, crossing, sign > 0.0, tile)
            count = insert(panels, k, zero, tile.state, count, most)
            zero = _find_zero(fill, needs, row, level, panels, k, crossing, after, sign < 0.0, tile)
            count = insert(panels, k, zero, tile.state, count, most)
    return count


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
        is_rounding = is_rounding and abs(tile.weights[j] - level) <= _relative_rounding(noise) * largest
    return is_rounding and largest < math.inf


@subroutine()
def half_angle(panels, k, position):
    """Half the angle from the anchor at a position of panel k, rad."""
    growth = math.exp(panels[CENTRE + k] + panels[HALF + k] * position)
    return math.atan(0.5 * panels[SCALE + k] * (growth - 1.0 / growth))


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
        _fill_inside(fill, needs, panels, k, zeros[i - 1] if i > 0 else -1.0, zeros[i] if i < found else 1.0, tile)
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
