"""The intervals of crank angles at which all joints of a linkage assemble, where its crank does not turn.

Cells are halved until all factors are positive in them, or one is negative that the joints before it do not spoil, or
they are too narrow. What is left between a place that assembles and one that does not is a border. An angle at which
two lines are parallel, where their joint has no place, is a border of both sides.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import NODES, copy_cell, exceeds, halve_cell, place_angle
from explore.mechanisms.linkages.turning import ROUNDING, TURNS

#: Largest number of intervals that are told.
MOST_REACHES = 4
#: Rows of what is told: the number of intervals, then start and end of each, deg.
REACH_ROWS = 1 + 2 * MOST_REACHES
#: Largest number of borders that are looked for.
MOST_BORDERS = 32
#: Numbers of a border: start and width, rad, its sense, and the error of one that is not narrowed further, rad.
BORDER_SIZE = 4
#: Largest number of factors that are known to be of lines or not: bits of an integer, in JavaScript, too.
MOST_LINES = 31
#: Width of a border, rad.
NARROWEST = 2e-16
#: Narrowest cell that is halved, rad: no interval or gap that is wider is missed.
_FINEST = 1e-8
#: Largest number of rounds of halving: a factor that is 0 all over an interval, or no number, is decided by none.
MOST_ROUNDS = 4096
#: Largest start of an interval, deg: a start that rounding puts before 360 deg is at 0.
_LARGEST_START = 360.0 - 1e-11
#: Largest distance from the middle of a cell of its parallel lines, widths of it.
_WITHIN = 0.501
#: Distance of the same parallel lines, rad: where they only nearly cross, rounding makes some of one.
_SAME = 1e-6
#: Largest length that is a turn: between both sides of the same parallel lines, deg.
_NO_LENGTH = 1e-11
#: Rounding error of angles of up to two turns, told in deg, rad.
_OF_ANGLES = 4e-15
#: Type of an array of numbers.
_F1 = "float64[::1]"


@subroutine()
def _assembles(values, first, step, factors):
    """Whether all factors, one every `step` numbers from the first on, are positive or 0."""
    result = True
    for s in range(factors):
        result = result and values[first + s * step] >= 0.0
    return result


@compiled(f"int64({_F1}, int64, int64, int64)")
def assembling_node(values, rows, factors, lane):
    """The first node of a lane at which all joints assemble; -1 for none."""
    for j in range(2 * NODES):
        if _assembles(values, j * rows * LANES + lane, LANES, factors):
            return j
    return -1


@subroutine()
def _is_decided(cell, child, factors, functions, middles, q):
    """Whether a half of a cell assembles throughout, or nowhere."""
    for s in range(factors):
        middle, tiny = middles[s * LANES + q], ROUNDING * middles[(2 * functions + s) * LANES + q]
        if not exceeds(cell, child, factors, s, 1.0, middle, tiny):
            return exceeds(cell, child, factors, s, -1.0, middle, tiny)
    return True


@subroutine()
def _find_parallel(cell, child, factors, functions, lines, middles, q, borders, found):
    """Note both sides of an angle in a half of a cell at which two lines are parallel; return the number of borders.

    There the square of their sine has a slope of 0, which is as good as straight in so narrow a cell.
    """
    for s in range(min(factors, MOST_LINES)):
        before, behind = child[2 + factors + s], child[2 + 3 * factors + s]
        middle, tiny = middles[s * LANES + q], ROUNDING * middles[(2 * functions + s) * LANES + q]
        if lines >> s & 1 == 0 or not before < behind or exceeds(cell, child, factors, s, 1.0, middle, tiny):
            continue
        share = -before / (behind - before)
        # a bit beyond the ends: what is beside the seam of the turn may be rounded away from either
        if abs(share - 0.5) > _WITHIN or found > MOST_BORDERS - 2:
            continue
        angle = child[0] + child[1] * share
        for k in range(found):
            apart = abs(borders[BORDER_SIZE * k] - angle)
            if borders[BORDER_SIZE * k + 3] > 0.0 and min(apart, abs(apart - 2.0 * math.pi)) < _SAME:
                return found
        error = tiny / math.sqrt(0.5 * (behind - before) / child[1])
        for side in range(2):
            border = borders[BORDER_SIZE * found :]
            border[0], border[1], border[2], border[3] = angle, 0.0, 2.0 * side - 1.0, error + _OF_ANGLES
            found += 1
        return found
    return found


@compiled(f"Tuple((int64, int64))({_F1}, int64, int64, int64, int64, int64, {_F1}, {_F1}, {_F1}, int64)")
def halve_borders(cells, factors, functions, lines, waiting, taken, middles, children, borders, found):
    """Replace the last cells by those halves that are not decided; return their number, and that of borders found.

    A border has its start and width, rad, and 1 where the linkage assembles behind it, -1 where it does before.
    `lines` are the bits of the factors that vanish where two lines are parallel.
    """
    size, n_children, first = 2 + 4 * factors, 0, waiting - taken
    for q in range(taken):
        cell = cells[(first + q) * size :]
        for side in range(2):
            child = children[n_children * size :]
            halve_cell(cell, factors, functions, middles, q, side, child)
            if _is_decided(cell, child, factors, functions, middles, q):
                continue
            if child[1] >= _FINEST:
                n_children += 1
                continue
            begins, ends = _assembles(child, 2, 1, factors), _assembles(child, 2 + 2 * factors, 1, factors)
            if begins != ends and found < MOST_BORDERS:
                border = borders[BORDER_SIZE * found :]
                border[0], border[1], border[2], border[3] = child[0], child[1], 1.0 if ends else -1.0, 0.0
                found += 1
            elif begins and ends and lines > 0:
                found = _find_parallel(cell, child, factors, functions, lines, middles, q, borders, found)
    for k in range(n_children):
        copy_cell(children, k, cells, first + k, size)
    return first + n_children, found


@compiled(f"void({_F1}, int64, {_F1}, {_F1})")
def place_in_border(borders, number, tangents, anchors):
    """Place one angle a lane between the ends of a border."""
    border = borders[BORDER_SIZE * number :]
    for lane in range(LANES):
        tangents[lane], anchors[lane] = place_angle(border[0] + border[1] * (lane + 1.0) / (LANES + 1.0))


@compiled(f"void({_F1}, int64, {_F1}, int64)")
def narrow_border(borders, number, values, factors):
    """Narrow a border to the part between two of the placed angles that the linkage assembles at one of."""
    border, step = borders[BORDER_SIZE * number :], 0
    while step < LANES and _assembles(values, step, LANES, factors) != (border[2] > 0.0):
        step += 1
    border[1] /= LANES + 1.0
    border[0] += step * border[1]


@compiled(f"float64({_F1}, int64, int64)")
def border_error(values, factors, functions):
    """The error of a border, rad, from values beside it: the rounding error of the factor that vanishes there."""
    nearest, error = math.inf, math.inf
    for s in range(factors):
        slope = abs(values[(functions + s) * LANES])
        away, own = abs(values[s * LANES]) / slope, ROUNDING * values[(2 * functions + s) * LANES] / slope
        nearest, error = (away, own + away) if away < nearest else (nearest, error)
    return error + _OF_ANGLES


@compiled(f"void({_F1}, {_F1})", no_alias=True)
def tell_turns(verdicts, out):
    """Fill the intervals of all lanes: the turn of those that are known to turn."""
    for row in range(REACH_ROWS):
        told = (1.0, 0.0, 360.0)[row] if row < 3 else math.nan
        here = out[row * LANES :]
        for lane in range(LANES):
            here[lane] = told if verdicts[lane] == TURNS else math.nan


@compiled(f"void(boolean, int64, {_F1})")
def tell_turn(turns, lane, out):
    """Fill the intervals of a lane: the turn, or that nothing is told."""
    for row in range(REACH_ROWS):
        out[row * LANES + lane] = math.nan
    if turns:
        out[lane] = 1.0
        out[LANES + lane] = 0.0
        out[2 * LANES + lane] = 360.0


@compiled(f"void({_F1}, int64, boolean, int64, {_F1})")
def tell_reaches(borders, found, assembles, lane, out):
    """Fill the intervals of a lane, ascending from crank angle 0 on, from all borders.

    Without borders the linkage assembles everywhere or nowhere.
    """
    tell_turn(found == 0 and assembles, lane, out)
    number, last = 1 if found == 0 and assembles else 0, -1.0
    for _ in range(found):
        start, end = math.inf, math.inf
        for k in range(found):
            angle = _degrees_from(borders[BORDER_SIZE * k], 0.0)
            angle = 0.0 if angle > _LARGEST_START else angle
            start = angle if (borders[BORDER_SIZE * k + 2] > 0.0) & (last < angle) & (angle < start) else start
        if start == math.inf:
            break
        for k in range(found):
            length = _degrees_from(borders[BORDER_SIZE * k], start)
            length = length if length > _NO_LENGTH else 360.0
            end = start + length if (borders[BORDER_SIZE * k + 2] < 0.0) & (start + length < end) else end
        number, last = number + 1, start
        if number <= MOST_REACHES:
            out[(2 * number - 1) * LANES + lane], out[2 * number * LANES + lane] = start, end
    out[lane] = number


@subroutine(inlined=True)
def _degrees_from(angle, start):
    """An angle, rad, from a start, deg: between 0 and 360 deg."""
    degrees = angle * (180.0 / math.pi) - start
    return degrees - 360.0 * math.floor(degrees / 360.0)
