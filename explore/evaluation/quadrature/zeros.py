"""Zeros of signals, and places where they reach levels: other signals have corners there.

They are found before the adaptive rule samples, and made ends of panels.

A power without its negative part has corners at the zeros of the power, forces with friction at those of the guide's
force. A pulse between two zeros may be narrower than any distance of nodes. The signal itself is smooth there, so
that samples of it show a pair of zeros as a dip: a local minimum of its magnitude.

The lanes of a tile are points of one panel. A bracket is cut into `LANES` + 1 parts at once, by position in the panel,
between -1 and 1: equal ones, or such that crowd about a place that a secant tells.
"""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.bounds import ROUNDING
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, SCALE, VARIANT
from explore.evaluation.quadrature.tiles import NODE_CAPACITY

#: Smallest number of tiles of samples of a panel.
_FEWEST_TILES = 16
#: Number of tiles of samples per length in t, where all singularities are at least pi/2 off the real axis.
_TILES_PER_LENGTH = 2.0
#: Largest number of places on one panel where a row is at one level.
MOST_ZEROS = 64
#: Number of cuts of a bracket into equal parts from a length of 1 to below rounding.
_MOST_CUTS = 14
#: Length of a bracket, in positions, up to which it is rounding.
_ROUNDED_AWAY = 2.0**-52
#: Distances of crowded cuts from the place of the secant, over the distance of the end of the bracket.
_CROWDED = 16.0 ** -np.array([*range(1, LANES // 2 + 1), *range(LANES // 2, 0, -1)])
#: Smallest distance of a zero from other zeros and from the ends of a panel, in t relative to 1 + |t|.
_SHORTEST = 1e-13


@subroutine(inlined=True)
def _cut_at(low, middle, high, lane):
    """The place of a cut of a bracket: by equal parts if `middle` is NaN, or else crowded about this."""
    if lane < 0 or lane == LANES:
        return low if lane < 0 else high
    if middle != middle:
        return low + (high - low) * (lane + 1) / (LANES + 1)
    return middle + (low - middle if lane < LANES // 2 else high - middle) * _CROWDED[lane]


@subroutine()
def fill_inside(fill, needs, panels, k, low, middle, high, tile):
    """Fill the signals at as many points as lanes inside a part of panel k; see `_cut_at`."""
    for lane in range(LANES):
        growth = exponential(panels[CENTRE + k] + panels[HALF + k] * _cut_at(low, middle, high, lane))
        tile.node[lane] = 0.5 * panels[SCALE + k] * (growth - 1.0 / growth)
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    fill(tile.constants, tile.node, anchor, law, variant, 1, needs, tile.node_signals)


@subroutine()
def _find_zero(fill, needs, row, level, panels, k, low, high, is_above, tile):
    """Position where the row passes a level between `low`, where it is above or not, and `high`."""
    at_low = at_high = middle = math.nan
    for _ in range(2 * _MOST_CUTS):  # where no secant helps every other cut is one into equal parts
        fill_inside(fill, needs, panels, k, low, middle, high, tile)
        passed, values = 0, tile.node_signals[row * LANES : (row + 1) * LANES]
        while passed < LANES and (values[passed] > level) == is_above:
            passed += 1
        at_low = values[passed - 1] - level if passed > 0 else at_low
        at_high = values[passed] - level if passed < LANES else at_high
        length = high - low
        low, high = _cut_at(low, middle, high, passed - 1), _cut_at(low, middle, high, passed)
        if high - low <= _ROUNDED_AWAY:
            break
        middle = low + (high - low) * (at_low / (at_low - at_high))
        # equal parts again where the secant did not help
        middle = middle if low < middle < high and (LANES + 1) * (high - low) <= 1.01 * length else math.nan
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
        fill_inside(fill, needs, panels, k, low, math.nan, high, tile)
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
def relative_rounding(noise):
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
        roundings[j] = relative_rounding(noise) * terms
    return last


@subroutine(no_alias=True)
def _count_marks(before, own, later, level):
    """Number of samples of a tile that are beyond the level from the one before, or in a dip towards it.

    Samples after one that is NaN count, as the first after a gap may be beyond the level.
    """
    count = 0
    for lane in range(len(own)):
        sign = 1.0 if own[lane] > level else -1.0
        left, value, right = sign * (before[lane] - level), sign * (own[lane] - level), sign * (later[lane] - level)
        count += 0 if (left > 0.0) & ((value > left) | (value > right)) else 1
    return count


@subroutine()
def collect_zeros(fill, needs, row, level, panels, k, last, count, most, tile):
    """Add the places on panel k where a row is at a level to the first `count` of the positions in the tile's state.

    Return their number, `most` + 1 if there are more that are not rounding. The samples 0 to `last` of the row are in
    the tile.
    """
    values = tile.weights
    for first in range(0, last + 1, LANES):
        stop = first + LANES
        if first > 0 and stop <= last:
            own, later = values[first:stop], values[first + 1 : stop + 1]
            if _count_marks(values[first - 1 : stop - 1], own, later, level) == 0:
                continue
        for j in range(first, min(stop, last + 1)):
            passes, is_dip = _marks_of(values, j, last, level)
            if passes or is_dip:
                count = _collect_beside(
                    fill, needs, row, level, panels, k, j, last, passes, is_dip, count, most, tile
                )  # fmt: skip
    return count


@subroutine(inlined=True)
def _marks_of(values, j, last, level):
    """Whether the level is between a sample and the one before, and whether there is a dip towards it."""
    former, own, later = values[max(j - 1, 0)] - level, values[j] - level, values[min(j + 1, last)] - level
    sign = 1.0 if own > 0.0 else -1.0
    left, value, right = sign * former, sign * own, sign * later
    return j > 0 and (former > 0.0) != (own > 0.0), value <= min(left, right) and value != max(left, right)


@subroutine()
def _collect_beside(fill, needs, row, level, panels, k, j, last, passes, is_dip, count, most, tile):
    """Add the place between sample j and the one before, and those of a dip at it; see `collect_zeros`."""
    values = tile.weights
    former, own, later = values[max(j - 1, 0)] - level, values[j] - level, values[min(j + 1, last)] - level
    sign = 1.0 if own > 0.0 else -1.0
    if count > most or (count == most and max(abs(former), abs(own), abs(later)) <= tile.roots[j]):
        return count
    before, here = 2.0 * max(j - 1, 0) / last - 1.0, 2.0 * j / last - 1.0
    after = 2.0 * min(j + 1, last) / last - 1.0
    if passes:
        zero = _find_zero(fill, needs, row, level, panels, k, before, here, former > 0.0, tile)
        count = insert(panels, k, zero, tile.state, count, most)
    if not is_dip:
        return count
    crossing = _find_crossing(
        fill, needs, row, level, panels, k, before, after, sign * former, sign * own, sign * later, sign, tile
    )  # fmt: skip
    if crossing == crossing:  # not NaN
        zero = _find_zero(fill, needs, row, level, panels, k, before, crossing, sign > 0.0, tile)
        count = insert(panels, k, zero, tile.state, count, most)
        zero = _find_zero(fill, needs, row, level, panels, k, crossing, after, sign < 0.0, tile)
        count = insert(panels, k, zero, tile.state, count, most)
    return count


@subroutine()
def half_angle(panels, k, position):
    """Half the angle from the anchor at a position of panel k, rad."""
    growth = math.exp(panels[CENTRE + k] + panels[HALF + k] * position)
    return math.atan(0.5 * panels[SCALE + k] * (growth - 1.0 / growth))
