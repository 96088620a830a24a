"""Where the output of a linkage turns back: the zeros of its rate over the turn, and whether there are exactly two.

A cell of the turn has no zero if the rate keeps its sign in it, and one or none if the rate is monotonic, each by more
than its cubic may miss. Cells that neither decides are halved, and so are those wider than their gap to the place of a
near singularity and the distance of that, since a pulse of the rate hides between their ends. Rows of the values of a
node: the rate, its slope by the angle, the rounding error of both, and the place or angle of the output.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import SAFETY, copy_cell, halve_cell, least, missed

#: Cells of the turn at first.
CELLS = 64
#: Rows of the values of a node.
RATE_ROWS = 4
#: Numbers of a cell.
CELL_SIZE = 6
#: Number of reversals of a design that was not decided.
UNDECIDED = -1.0
#: Angle of the first node, as a share of a cell: outputs like to turn back at round angles, where no node is.
_OFFSET = 0.37
#: Greatest slope of what a cubic misses, times the width, over what that over twice the width misses in its middle.
_SLOPE = 0.2
#: Change of a place, relative to 1 and its half-tangent, that is rounding.
SAME = 4e-16
#: Narrowest cell that is halved, rad.
_FINEST = 1e-7
#: Largest number of reversals of one design that are counted.
_MOST = 6
#: Width of a cell at first, rad.
_WIDTH = 2.0 * math.pi / CELLS
#: Type of an array of numbers.
_F1 = "float64[::1]"


@subroutine(inlined=True)
def reversal_node(j):
    """Angle of node j, rad."""
    return _WIDTH * (j + _OFFSET)


@subroutine(inlined=True)
def _is_sure(f0, f1, d0, d1, width, error, tiny):
    """Whether a cell has no zero, or is known to have the one or none that the signs at its ends tell."""
    sign = 1.0 if f0 >= 0.0 else -1.0
    keeps = least(sign * f0, sign * f1, sign * d0, sign * d1, width) - SAFETY / 16.0 * error > tiny
    middle, margin = 3.0 * (f1 - f0) / width - d0 - d1, SAFETY * _SLOPE * error / width + tiny
    rises = min(min(d0, d1), middle) > margin
    falls = max(max(d0, d1), middle) < -margin
    return keeps | rises | falls


@compiled(f"void({_F1}, {_F1}, {_F1}, {_F1})", no_alias=True)
def find_reversals(values, counts, doubts, places):
    """Fill the number of reversals of each lane, whether some cell is not decided, and the cells of reversals.

    Rows of `places`: start and width, rad, of the cell with the last reversal from backwards to forwards, then of that
    from forwards to backwards. `values` are those of nodes 0 to `CELLS`.
    """
    for lane in range(LANES):
        counts[lane] = doubts[lane] = 0.0
    size = RATE_ROWS * LANES
    for j in range(CELLS):
        at = values[j * size :]
        to = values[(j + 1) * size :]
        before = values[(j - 1 if j > 0 else CELLS - 1) * size :]
        after = values[(j + 2 if j + 1 < CELLS else 1) * size :]
        for lane in range(LANES):
            f0, d0, f1, d1 = at[lane], at[LANES + lane], to[lane], to[LANES + lane]
            left = missed(before[lane], f1, before[LANES + lane], d1, 2.0 * _WIDTH, f0)
            right = missed(f0, after[lane], d0, after[LANES + lane], 2.0 * _WIDTH, f1)
            error = left if left > right else right
            sure = _is_sure(f0, f1, d0, d1, _WIDTH, error, at[2 * LANES + lane])
            doubts[lane] = doubts[lane] if sure else 1.0
            rises, falls = (f0 < 0.0) & (f1 >= 0.0), (f0 >= 0.0) & (f1 < 0.0)
            counts[lane] += 1.0 if rises | falls else 0.0
            places[lane] = reversal_node(j) if rises else places[lane]
            places[LANES + lane] = _WIDTH if rises else places[LANES + lane]
            places[2 * LANES + lane] = reversal_node(j) if falls else places[2 * LANES + lane]
            places[3 * LANES + lane] = _WIDTH if falls else places[3 * LANES + lane]


@compiled(f"int64({_F1}, int64, {_F1})")
def collect_rates(values, lane, cells):
    """Fill all cells of one lane; return their number."""
    for j in range(CELLS):
        cell = cells[j * CELL_SIZE :]
        cell[0], cell[1] = reversal_node(j), _WIDTH
        for k in range(4):
            cell[2 + k] = values[((j + k // 2) * RATE_ROWS + k % 2) * LANES + lane]
    return CELLS


@subroutine()
def _is_wide(start, width, minima, found):
    """Whether a cell is wider than its gap to the angle of one of `minima` and than the distance of that one."""
    wide = 0
    for k in range(found):
        apart = minima[2 * k] - start - 0.5 * width
        apart -= 2.0 * math.pi * math.floor(apart / (2.0 * math.pi) + 0.5)
        wide += 1 if width > max(abs(apart) - 0.5 * width, minima[2 * k + 1]) else 0
    return wide > 0


@compiled(f"Tuple((int64, float64))({_F1}, int64, int64, {_F1}, {_F1}, float64, int64, {_F1}, {_F1}, int64)")
def halve_rates(cells, waiting, taken, middles, children, count, lane, places, minima, found):
    """Replace the last cells by those halves that are not decided.

    `minima` has angle and distance, rad, of each of the `found` near singularities.
    Return their number, and the number of reversals found so far in those that are: `UNDECIDED` if there are too many,
    or one that is too close to another, or to where the output only rests, to tell.
    """
    n_children, first = 0, waiting - taken
    for q in range(taken):
        cell = cells[(first + q) * CELL_SIZE :]
        error = missed(cell[2], cell[4], cell[3], cell[5], cell[1], middles[q])
        for side in range(2):
            child = children[n_children * CELL_SIZE :]
            halve_cell(cell, 1, 1, middles, q, side, child)
            f0, f1 = child[2], child[4]
            sure = _is_sure(f0, f1, child[3], child[5], child[1], error, middles[2 * LANES + q])
            if not sure or _is_wide(child[0], child[1], minima, found):
                if child[1] < _FINEST:
                    return 0, UNDECIDED
                n_children += 1
            elif (f0 >= 0.0) != (f1 >= 0.0):
                row = 0 if f1 >= 0.0 else 2
                places[row * LANES + lane], places[(row + 1) * LANES + lane] = child[0], child[1]
                count += 1.0
                if count > _MOST:
                    return 0, count
    for k in range(n_children):
        copy_cell(children, k, cells, first + k, CELL_SIZE)
    return first + n_children, count


@compiled(f"void({_F1}, {_F1}, int64, {_F1}, {_F1}, {_F1}, {_F1})")
def begin_search(places, counts, row, tangents, anchors, low, high):
    """Fill the ends of the cells with a reversal as half-tangents from an anchor, and a place between them.

    Lanes without exactly two reversals have an empty cell: `improve` leaves them where they are.
    """
    for lane in range(LANES):
        start = places[row * LANES + lane] if counts[lane] == 2.0 else 0.0
        width = places[(row + 1) * LANES + lane] if counts[lane] == 2.0 else 0.0
        half_turns = math.floor((start + 0.5 * width) / math.pi + 0.5)
        low[lane] = math.tan(0.5 * (start - half_turns * math.pi))
        high[lane] = math.tan(0.5 * (start + width - half_turns * math.pi))
        tangents[lane], anchors[lane] = 0.5 * (low[lane] + high[lane]), half_turns % 2.0


@compiled(f"float64({_F1}, float64, {_F1}, {_F1}, {_F1})", no_alias=True)
def improve(rates, sign, tangents, low, high):
    """Improve the places of reversals by Newton's method, kept between two ends; return the largest change.

    `sign` is 1 where the rate rises. A place that changes by rounding only stays, so that a lane does not depend on how
    long the others take.
    """
    largest = 0.0
    for lane in range(LANES):
        u, rate, slope = tangents[lane], sign * rates[lane], sign * rates[LANES + lane]
        low[lane] = u if rate < 0.0 else low[lane]
        high[lane] = u if rate >= 0.0 else high[lane]
        better = u - rate / slope * (0.5 + 0.5 * u * u)
        inside = (better >= low[lane]) & (better <= high[lane])
        better = better if inside else 0.5 * (low[lane] + high[lane])
        change = abs(better - u) / (1.0 + abs(u))
        largest = change if change > largest else largest
        tangents[lane] = better if change > SAME else u
    return largest


@subroutine(inlined=True)
def from_anchor(tangent, anchor):
    """The half-tangent from the anchor of a place that is given from the anchor (0) or its opposite (1)."""
    return tangent if anchor == 0.0 else -1.0 / tangent


@subroutine(inlined=True)
def time_ratio(least_at, greatest_at):
    """The longer of the crank intervals between two half-tangents over the shorter."""
    apart = 2.0 * abs(math.atan(greatest_at) - math.atan(least_at))
    rest = 2.0 * math.pi - apart
    return max(apart, rest) / min(apart, rest)
