"""Signals behind a first-order lag over a turn: what they follow, and the range of the integral that they lag by.

The torque M of a motor that loses the torque k per speed, and drives a flywheel J at about the speed w, follows the
torque T of the drive: M' = r (T - M) over the input angle, with r = k/(J w). The flywheel stores e with e' = M - T, so
that M is the mean of T less r e, and e is periodic. With r = 0 the motor is steady.

Each panel is cut into 1, 2, 4, ... equal parts, until two such cuts agree. On a part T is taken as the polynomial
through the 16 nodes of Gauss and Legendre, and with that (e exp(r phi))' is integrated up to each node. The extremes of
e are where e' passes 0: a secant between two nodes tells the place, e is computed there anew, and its slope tells the
rest. What is between nodes without a sign of e' there is less than what the next cut tells.

Here the lanes of a tile are nodes of one design.
"""

import math

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.chunks import gather_design
from explore.evaluation.quadrature.fluctuations import next_panel
from explore.evaluation.quadrature.magnitudes import place_between
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, SCALE, VARIANT
from explore.evaluation.quadrature.slots import LAGGED_FLUCTUATION, LAGGED_MAX, MEAN, VARIANCE
from explore.evaluation.quadrature.storing import add_bound

#: Number of nodes of a part of a panel.
_NODES = 16
#: Number of cuts of the panels, each into twice as many parts as the one before.
_CUTS = 7
#: Largest rate, whose motor gives what the load takes a thousandth of a radian later, and is not resolved beyond.
_LARGEST_RATE = 1e3
#: Largest number of parts of the first cut.
_MOST_PARTS = 256
#: Largest exponent of exp(r phi) on a part of the first cut, on an average.
_GROWTH = 4.0
#: Rate up to which e begins a turn at 0; error of the mean over such a rate would take all digits of e.
_STEADY = 1e-16
#: Full turn, rad.
_TURN = 2.0 * math.pi
#: First of the numbers -e' at the ends and nodes of a part, behind e there.
_SLOPES = _NODES + 2
#: First of the angles of ends and nodes from the first end.
_ANGLES = 2 * _SLOPES
#: First number of the part up to an extreme, behind all of the whole part.
_REFINED = 3 * _SLOPES


def _integrate_polynomials() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Factors of each weighted value in the integrals up to all nodes, (16, 16), and of values for the last end.

    The polynomial through values y is the sum of (n + 1/2) w_i P_n(x_i) P_n(x) y_i, and P_n has the integral
    (P_{n+1} - P_{n-1})/(2n + 1).
    """
    nodes, weights = legendre.leggauss(_NODES)
    polynomials, orders = legendre.legvander(nodes, _NODES), np.arange(_NODES)
    terms = (orders + 0.5)[:, np.newaxis] * polynomials[:, :-1].T
    integrals = np.column_stack([1.0 + nodes, (polynomials[:, 2:] - polynomials[:, :-2]) / (2.0 * orders[1:] + 1.0)])
    return (integrals @ terms).T.copy(), terms.sum(axis=0) * weights


_INTEGRALS, _LAST_END = _integrate_polynomials()
#: Places of the ends and nodes of a part, between -1 and 1.
_PLACES = np.array([-1.0, *legendre.leggauss(_NODES)[0], 1.0])


@subroutine()
def fill_lags(fill, sizes, tables, w, i, design, stride, statistics, nodes, error, work, tile):
    """Fill the lagged statistics of the signals of one design, number i of the chunk and `design` of the block."""
    gather_design(sizes, i, work, tile)
    for s in range(sizes.rows):
        slots = tables.slots[w, s]
        if slots[LAGGED_FLUCTUATION] < 0 and slots[LAGGED_MAX] < 0:
            continue
        mean, variance = statistics[slots[MEAN], design], statistics[slots[VARIANCE], design]
        rms = math.sqrt(mean * mean + variance)
        if not rms < math.inf:
            continue
        rate, low, high, bound, count = _measure(fill, sizes, tables, s, i, stride, mean, rms, work, tile)
        if slots[LAGGED_FLUCTUATION] >= 0:
            statistics[slots[LAGGED_FLUCTUATION], design] = high - low
        if slots[LAGGED_MAX] >= 0:
            statistics[slots[LAGGED_MAX], design] = mean - rate * low
        add_bound(s, i, design, slots, bound, statistics, error, work)
        nodes[design] += count


@subroutine()
def _measure(fill, sizes, tables, s, i, stride, mean, rms, work, tile):
    """The rate r of the lag of a row of one design, the extremes of e, an error bound, and the number of nodes.

    The bound is of the range of e, over the rms times a turn, and of r times the least e, over the rms.
    """
    rows, rate = sizes.rows, _rate_of_lag(fill, tables, s, work.first_panel[i], work, tile)
    if not rate <= _LARGEST_RATE:
        return rate, math.nan, math.nan, 0.0, _NODES
    low = high = previous_low = previous_high = 0.0
    difference = bound = math.inf
    nodes, parts = _NODES, 1
    while parts < _MOST_PARTS and rate * _TURN > _GROWTH * work.panel_count[i] * parts:
        parts *= 2
    for number in range(_CUTS):
        start, taken = 0.0, parts * work.panel_count[i] * _NODES
        if rate > _STEADY:
            end = _end_of_turn(fill, rows, tables, s, i, stride, mean, rate, parts, work, tile)
            start = -end / math.expm1(-_TURN * rate)
        end, low, high = _follow_turn(fill, rows, tables, s, i, stride, mean, rate, parts, start, work, tile)
        nodes += 2 * taken if rate > _STEADY else taken
        if number > 0:
            guard, change = 0.01 * difference, abs((high - low) - (previous_high - previous_low))
            difference = max(change / _TURN, rate * abs(low - previous_low))
            bound = max(difference, guard if number > 1 else 0.0) + abs(end - start) * max(1.0 / _TURN, rate)
            bound = bound / rms if rms > 0.0 else 0.0
        if bound <= 0.1 * tables.tolerance:
            break
        previous_low, previous_high, parts = low, high, 2 * parts
    return rate, low, high, bound, nodes


@subroutine()
def _rate_of_lag(fill, tables, s, k, work, tile):
    """The rate of the lag of a row of the design of panel k."""
    _place_part(work.panels, k, -1.0, 1.0, tables, tile)
    _fill_nodes(fill, tables, s, work.panels, k, tile)
    return tile.signals[tables.lag_rows[s] * LANES]


@subroutine()
def _end_of_turn(fill, rows, tables, s, i, stride, mean, rate, parts, work, tile):
    """What e is after a turn of panels in `parts` each if it is 0 at the beginning."""
    energy, last = 0.0, -1.0
    for _ in range(work.panel_count[i]):
        k, last = next_panel(work.panels, work.first_panel[i], work.panel_count[i], stride, last)
        for part in range(parts):
            _place_part(work.panels, k, 2.0 * part / parts - 1.0, 2.0 * (part + 1) / parts - 1.0, tables, tile)
            _fill_nodes(fill, tables, s, work.panels, k, tile)
            total, turned = _drive_part(rows, s, mean, rate, tile)
            energy = (energy - total) * math.exp(-rate * turned)
    return energy


@subroutine()
def _follow_turn(fill, rows, tables, s, i, stride, mean, rate, parts, energy, work, tile):
    """Follow e, which is `energy` at the beginning, over a turn of panels in `parts` each; its end and extremes."""
    low = high = energy
    last = -1.0
    for _ in range(work.panel_count[i]):
        k, last = next_panel(work.panels, work.first_panel[i], work.panel_count[i], stride, last)
        for part in range(parts):
            begin, end = 2.0 * part / parts - 1.0, 2.0 * (part + 1) / parts - 1.0
            _place_part(work.panels, k, begin, end, tables, tile)
            _fill_nodes(fill, tables, s, work.panels, k, tile)
            points = tile.values
            _follow_part(rows, s, mean, rate, energy, tile, points)
            energy = points[_NODES + 1]
            for j in range(_NODES + 2):
                low, high = min(low, points[j]), max(high, points[j])
            for j in range(_NODES + 1):
                if points[_SLOPES + j] * points[_SLOPES + j + 1] < 0.0:
                    extreme = _refine(fill, rows, tables, s, mean, rate, k, begin, end, j, work, tile)
                    low, high = min(low, extreme), max(high, extreme)
    return energy, low, high


@subroutine()
def _place_part(panels, k, begin, end, tables, tile):
    """Fill the nodes of a part of panel k between two positions; their t from its centre are the roots of the tile."""
    place_between(
        panels[CENTRE + k], panels[HALF + k] * begin, panels[HALF + k] * end, panels[SCALE + k], _NODES, tables.row_of,
        tables.rules, False, tile.roots, tile.tangents, tile.weights,
    )  # fmt: skip


@subroutine()
def _fill_nodes(fill, tables, s, panels, k, tile):
    """Fill the signals at the nodes of a part of panel k."""
    anchor, law, variant = int(panels[ANCHOR + k]), int(panels[LAW + k]), int(panels[VARIANT + k])
    fill(tile.constants, tile.tangents, anchor, law, variant, _NODES // LANES, tables.row_needs[s], tile.signals)


@subroutine(fast=True, no_alias=True)
def _integrate(weighted, integrals):
    """Fill the integrals up to each node of a part, of values times weights."""
    for j in range(len(integrals)):
        integrals[j] = 0.0
    for k in range(len(weighted)):
        factors, value = _INTEGRALS[k], weighted[k]
        for j in range(len(integrals)):
            integrals[j] += factors[j] * value


@subroutine()
def _drive_part(rows, s, mean, rate, tile):
    """Fill angles of the nodes of a part, exp(r phi), and its product with T less its mean, weighted; return the sum.

    Angles and r phi begin at the first end. Return the angle of the last end, too.
    """
    angles, growths, driving = tile.marks[:_NODES], tile.marks[_NODES : 2 * _NODES], tile.marks[2 * _NODES : 3 * _NODES]
    weights, total, turned = tile.weights[:_NODES], 0.0, 0.0
    _integrate(weights, angles)
    for first in range(0, _NODES, LANES):
        values = tile.signals[(first // LANES * rows + s) * LANES :]
        for lane in range(LANES):
            growths[first + lane] = exponential(rate * angles[first + lane])
            driving[first + lane] = weights[first + lane] * growths[first + lane] * (values[lane] - mean)
    for j in range(_NODES):
        total, turned = total + driving[j], turned + weights[j]
    return total, turned


@subroutine()
def _follow_part(rows, s, mean, rate, energy, tile, points):
    """Fill e, which is `energy` at the first end, -e' and angles at the ends and nodes of a part."""
    total, turned = _drive_part(rows, s, mean, rate, tile)
    angles, growths, driving = tile.marks, tile.marks[_NODES:], tile.marks[2 * _NODES : 3 * _NODES]
    _integrate(driving, points[1 : _NODES + 1])
    first = last = 0.0
    for j in range(_NODES):
        points[1 + j] = (energy - points[1 + j]) / growths[j]
        value = tile.signals[(j // LANES * rows + s) * LANES + j % LANES] - mean
        points[_SLOPES + 1 + j], points[_ANGLES + 1 + j] = rate * points[1 + j] + value, angles[j]
        first += _LAST_END[_NODES - 1 - j] * points[_SLOPES + 1 + j]
        last += _LAST_END[j] * points[_SLOPES + 1 + j]
    points[0], points[_NODES + 1] = energy, (energy - total) * math.exp(-rate * turned)
    points[_SLOPES], points[_SLOPES + _NODES + 1] = first, last
    points[_ANGLES], points[_ANGLES + _NODES + 1] = 0.0, turned


@subroutine()
def _refine(fill, rows, tables, s, mean, rate, k, begin, end, j, work, tile):
    """The extreme of e between points j and j + 1 of a part of panel k; e' has different signs there."""
    points, beside = tile.values, tile.values[_REFINED:]
    slope = points[_SLOPES + j + 1] - points[_SLOPES + j]
    share = -points[_SLOPES + j] / slope
    place = _PLACES[j] + share * (_PLACES[j + 1] - _PLACES[j])
    _place_part(work.panels, k, begin, begin + 0.5 * (1.0 + place) * (end - begin), tables, tile)
    _fill_nodes(fill, tables, s, work.panels, k, tile)
    _follow_part(rows, s, mean, rate, points[0], tile, beside)
    rest = beside[_SLOPES + _NODES + 1]
    turned = points[_ANGLES + j + 1] - points[_ANGLES + j]
    return beside[_NODES + 1] + 0.5 * rest * rest * turned / slope
