"""Whether a linkage assembles at every crank angle, and how far its links turn, from values at nodes of the turn.

The factors of all joints must stay positive. In a cell between two nodes a factor is positive if the least Bernstein
coefficient of the cubic through its values and slopes at the ends exceeds `SAFETY` sixteenths of what the cubic over
the double cell missed in its middle. Cells that this does not decide are halved.

Rows of the values of a node: the factors, and behind them squares of distances that must not vanish at complex angles
either; the slopes of both by the angle; and the sizes of the terms of the factors.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine

#: Nodes of each half turn, from a quarter of a turn before its anchor to a quarter after it.
NODES = 17
#: Nodes of the turn at which the directions of links are followed.
DIRECTION_NODES = 256
#: Verdict on a design that turns; -1 - s is one that is blocked at factor s.
TURNS = 1.0
#: Verdict on a design that is not decided yet.
DOUBTFUL = 0.0
#: Verdict on a design whose factor 0 is too close to tell; that of factor s is larger by s.
FIRST_TIE = 2.0
#: Largest number of cells of one half turn that wait to be halved.
MOST_CELLS = 512
#: Factor on what a cubic misses when a factor is taken for positive.
SAFETY = 4.0
#: Largest half-tangent of the distance of a singularity.
_FARTHEST = 0.99
#: Largest tangent of the angle from a node to a minimum that is looked for from it.
_NEAR = 0.5
#: Share of the distance of the nearest zero that is relied on, because zeros of no minimum are not looked for.
_SHARE = 0.9
#: Narrowest cell that is halved, rad.
_FINEST = 1e-7
#: Rounding error of a factor, relative to the size of its terms.
_ROUNDING = 1e-14
#: Largest turn of a link between two nodes that is followed, rad.
_LARGEST_STEP = 1.0
#: Largest half swing of a link about the middle of its range, rad: less than half a turn.
_LARGEST_SWING = 3.0


@subroutine()
def node_tangent(j):
    """Half-tangent, from its anchor, of node j of a half turn."""
    return math.tan(0.25 * math.pi * (2.0 * j / (NODES - 1) - 1.0))


@subroutine(no_alias=True)
def sift(values, factors, functions, verdicts):
    """Fill the verdict of each lane from the nodes of both half turns.

    `functions` is the number of factors and squares of distances.
    """
    rows, width = 2 * functions + factors, math.pi / (NODES - 1)
    for lane in range(LANES):
        verdicts[lane] = TURNS
    for s in range(factors - 1, -1, -1):
        for j in range(2 * NODES):
            value = values[(j * rows + s) * LANES :]
            size = values[(j * rows + 2 * functions + s) * LANES :]
            for lane in range(LANES):
                verdicts[lane] = verdicts[lane] if value[lane] >= -_ROUNDING * size[lane] else -1.0 - s
    for s in range(factors):
        for cell in range(2 * (NODES - 1)):
            j = cell + cell // (NODES - 1)
            before = j - 1 if j % NODES > 0 else j
            after = j + 2 if j % NODES < NODES - 2 else j + 1
            f0, f1 = values[(j * rows + s) * LANES :], values[((j + 1) * rows + s) * LANES :]
            d0, d1 = values[(j * rows + functions + s) * LANES :], values[((j + 1) * rows + functions + s) * LANES :]
            fl, dl = values[(before * rows + s) * LANES :], values[(before * rows + functions + s) * LANES :]
            fr, dr = values[(after * rows + s) * LANES :], values[(after * rows + functions + s) * LANES :]
            size = values[(j * rows + 2 * functions + s) * LANES :]
            for lane in range(LANES):
                left = abs(0.5 * (fl[lane] + f1[lane]) + 0.25 * width * (dl[lane] - d1[lane]) - f0[lane])
                right = abs(0.5 * (f0[lane] + fr[lane]) + 0.25 * width * (d0[lane] - dr[lane]) - f1[lane])
                left, right = left if before < j else 0.0, right if after > j + 1 else 0.0
                missed = left if left > right else right
                low = min(
                    min(f0[lane], f0[lane] + width * d0[lane] / 3.0), min(f1[lane], f1[lane] - width * d1[lane] / 3.0)
                )
                sure = low - SAFETY / 16.0 * missed > _ROUNDING * size[lane]
                verdicts[lane] = DOUBTFUL if (verdicts[lane] == TURNS) & (not sure) else verdicts[lane]


@subroutine(no_alias=True)
def locate(values, factors, functions, distances):
    """Fill the half-tangent of the distance of the nearest complex zero of all functions, tanh(distance/2).

    Near each node a function is taken for the first harmonic a - b cos(theta - phi) of the same value, slope and
    curvature, the last from the slopes of the neighbours: its zeros are at the distance arcosh(a/b) above phi. A zero
    counts if phi is near the node, where the harmonic holds.
    """
    rows, width = 2 * functions + factors, math.pi / (NODES - 1)
    for lane in range(LANES):
        distances[lane] = _FARTHEST
    for s in range(functions):
        for j in range(2 * NODES - 2):
            at = j + j // (NODES - 1)  # each node of the turn once
            before = at - 1 if at > 0 else 2 * NODES - 2
            before = NODES - 2 if at == NODES else before
            f, d = values[(at * rows + s) * LANES :], values[(at * rows + functions + s) * LANES :]
            left = values[(before * rows + functions + s) * LANES :]
            right = values[((at + 1) * rows + functions + s) * LANES :]
            for lane in range(LANES):
                curvature = (right[lane] - left[lane]) * (0.5 / width)
                slope = d[lane]
                amplitude = math.sqrt(slope * slope + curvature * curvature)
                # cosh(distance) - 1 where the minimum is near
                excess = (f[lane] - slope * slope / (amplitude + curvature)) / amplitude
                distance = math.sqrt(excess / (excess + 2.0))
                near = (curvature > 0.0) & (abs(slope) <= _NEAR * curvature)
                distance = distance if excess >= 0.0 else 0.0
                distances[lane] = distance if near & (distance < distances[lane]) else distances[lane]
    for lane in range(LANES):
        distances[lane] *= _SHARE


@subroutine()
def collect_cells(values, factors, functions, half, lane, cells):
    """Fill the cells of one half turn of one lane; return their number.

    A cell has its start and width, rad from the anchor, then the factors and slopes of its two ends.
    """
    rows, width, length = 2 * functions + factors, math.pi / (NODES - 1), 2 + 4 * factors
    for j in range(NODES - 1):
        cell, at = cells[j * length :], half * NODES + j
        cell[0], cell[1] = (j - 0.5 * (NODES - 1)) * width, width
        for s in range(factors):
            cell[2 + s] = values[(at * rows + s) * LANES + lane]
            cell[2 + factors + s] = values[(at * rows + functions + s) * LANES + lane]
            cell[2 + 2 * factors + s] = values[((at + 1) * rows + s) * LANES + lane]
            cell[2 + 3 * factors + s] = values[((at + 1) * rows + functions + s) * LANES + lane]
    return NODES - 1


@subroutine()
def place_middles(cells, factors, count, tangents):
    """Fill the half-tangents of the middles of the last cells, one a lane; return the number of cells."""
    taken = min(count, LANES)
    for lane in range(LANES):
        cell = cells[(count - taken + min(lane, taken - 1)) * (2 + 4 * factors) :]
        tangents[lane] = math.tan(0.5 * (cell[0] + 0.5 * cell[1]))
    return taken


@subroutine()
def halve_cells(cells, factors, functions, count, taken, middles, children):
    """Replace the last cells by those halves that are not decided; return their number and the verdict."""
    length, n_children, first = 2 + 4 * factors, 0, count - taken
    for q in range(taken):
        cell = cells[(first + q) * length :]
        for s in range(factors):
            if not middles[s * LANES + q] >= -_ROUNDING * middles[(2 * functions + s) * LANES + q]:
                return 0, -1.0 - s
        width = 0.5 * cell[1]
        for side in range(2):
            doubt = -1
            for s in range(factors):
                fm, dm = middles[s * LANES + q], middles[(functions + s) * LANES + q]
                f0, d0 = cell[2 + s], cell[2 + factors + s]
                f1, d1 = cell[2 + 2 * factors + s], cell[2 + 3 * factors + s]
                missed = abs(0.5 * (f0 + f1) + 0.125 * cell[1] * (d0 - d1) - fm)
                low = (
                    min(min(f0, f0 + width * d0 / 3.0), min(fm, fm - width * dm / 3.0))
                    if side == 0
                    else min(min(fm, fm + width * dm / 3.0), min(f1, f1 - width * d1 / 3.0))
                )
                if not low - SAFETY / 16.0 * missed > _ROUNDING * middles[(2 * functions + s) * LANES + q]:
                    doubt = s if doubt < 0 else doubt
            if doubt >= 0:
                if width < _FINEST:
                    return 0, FIRST_TIE + doubt
                child = children[n_children * length :]
                child[0], child[1] = cell[0] + side * width, width
                for s in range(2 * factors):
                    row = s if s < factors else functions + s - factors
                    child[2 + s] = cell[2 + s] if side == 0 else middles[row * LANES + q]
                    child[2 + 2 * factors + s] = middles[row * LANES + q] if side == 0 else cell[2 + 2 * factors + s]
                n_children += 1
    for k in range(n_children * length):
        cells[first * length + k] = children[k]
    return first + n_children, DOUBTFUL


@subroutine()
def direction_node(j):
    """Half-tangent and anchor of node j of a turn that begins at crank angle 0."""
    quarter = DIRECTION_NODES // 4
    if j <= quarter:
        return math.tan(0.25 * math.pi * j / quarter), 0
    if j < 3 * quarter:
        return math.tan(0.25 * math.pi * (j / quarter - 2.0)), 1
    return math.tan(0.25 * math.pi * (j / quarter - 4.0)), 0


@subroutine(no_alias=True)
def follow_directions(j, links, directions, before, ranges):
    """Follow the angles of links from the node before to node j.

    Rows of `directions` and `before`: cosine and sine of each link. Rows of `ranges` for each link: the angle at crank
    angle 0, rad, the turn since, its least and greatest value, the largest step.
    """
    for link in range(links):
        cosine, sine = directions[2 * link * LANES :], directions[(2 * link + 1) * LANES :]
        old_cosine, old_sine = before[2 * link * LANES :], before[(2 * link + 1) * LANES :]
        start, turn, least = (
            ranges[5 * link * LANES :],
            ranges[(5 * link + 1) * LANES :],
            ranges[(5 * link + 2) * LANES :],
        )
        greatest, largest = ranges[(5 * link + 3) * LANES :], ranges[(5 * link + 4) * LANES :]
        for lane in range(LANES):
            c, s = cosine[lane], sine[lane]
            if j == 0:
                start[lane] = arctangent(s, c)
                turn[lane] = least[lane] = greatest[lane] = largest[lane] = 0.0
            else:
                step = arctangent(old_cosine[lane] * s - old_sine[lane] * c, old_cosine[lane] * c + old_sine[lane] * s)
                turn[lane] += step
                least[lane] = turn[lane] if turn[lane] < least[lane] else least[lane]
                greatest[lane] = turn[lane] if turn[lane] > greatest[lane] else greatest[lane]
                largest[lane] = abs(step) if not abs(step) <= largest[lane] else largest[lane]
            old_cosine[lane], old_sine[lane] = c, s


@subroutine(no_alias=True)
def place_references(links, ranges, references):
    """Fill the middle of each link's range, rad, its cosine and sine; NaN for links that turn fully or too fast."""
    for link in range(links):
        for lane in range(LANES):
            at = 5 * link * LANES + lane
            start, turn, largest = ranges[at], ranges[at + LANES], ranges[at + 4 * LANES]
            least, greatest = ranges[at + 2 * LANES], ranges[at + 3 * LANES]
            rocks = (abs(turn) < 1.0) & (greatest - least < 2.0 * _LARGEST_SWING) & (largest < _LARGEST_STEP)
            middle = start + 0.5 * (least + greatest) if rocks else math.nan
            references[3 * link * LANES + lane] = middle
            references[(3 * link + 1) * LANES + lane] = math.cos(middle)
            references[(3 * link + 2) * LANES + lane] = math.sin(middle)
