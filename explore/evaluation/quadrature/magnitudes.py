"""Means of powers of a magnitude, of which the samples are squares.

Where a magnitude touches 0, or nearly does, its odd powers have a corner, or nearly have one, that no rule over a whole
panel resolves. So each panel is cut at its local minima: where all singularities of the signals are declared, at those
near 0, and at all of them elsewhere and where that does not suffice. The corners are then at the ends of the pieces, at
worst as algebraic singularities. A substitution by a polynomial whose first two derivatives are 0 at the ends clusters
the nodes there: a power p of the distance becomes one of 3 p, for which Gauss-Legendre rules converge like N^-(6 p +
2), at worst N^-8. In a panel without cuts nothing is clustered.

The rules of 20, 40, ... 320 nodes are compared until two agree. The bound is the difference of the last two, which
estimates the error of the last but one, and at least a hundredth of the difference before, because two rules may agree
by accident.

Over a turn without breaks, and with all singularities far away, a magnitude that stays away from 0 has equispaced
nodes, of which each rule has all nodes of the one before.

Here the lanes of a tile are nodes of one design.
"""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential, logarithm, tangent
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.bounds import FLAG_SQUARES
from explore.evaluation.quadrature.brent import ACTIVE, BEST, minimise, start_lane
from explore.evaluation.quadrature.chunks import gather_design
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, PANEL_CAPACITY, SCALE, SINGULAR, VARIANT
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT
from explore.evaluation.quadrature.slots import CLUTCH, KIND, ROOT_MEAN
from explore.evaluation.quadrature.storing import add_bound
from explore.evaluation.quadrature.tiles import TILE_RESOLUTION, TILE_SCALE, TILE_TURNED
from explore.evaluation.quadrature.windows import TURN
from explore.model.quadrature import MOST_SINGULARITIES

#: Number of powers: power 0 has the exponent 1, power 1 the exponent 10/3.
POWERS = 2
#: Number of nodes of the first rule.
FEWEST_NODES = 20
#: Number of rules, each of twice as many nodes as the one before.
ROUNDS = 5
#: Largest number of equispaced nodes over a turn; the number of the first rule is that of the lanes.
_MOST_EQUISPACED = 128
#: Least half-tangent of the distance of singularities from the real axis for equispaced nodes.
_FAR = 0.2
#: Factor on the bounds of rules over minima that are not cut at.
_MARGIN = 4.0
#: Square over the largest one below which a magnitude is near 0.
_NEAR_ZERO = 1.0 / 64.0
#: Smallest square whose cube root is taken; smaller ones have this root.
_LEAST_SQUARE = 1e-300
#: Number of samples of a panel from which its local minima are refined.
_SEARCH_NODES = 96


@subroutine()
def power_means(
    fill, needs, rows, row, power, panels, begin, panel_count, stride, highest, tolerance, size_of, row_of, table, tile
):
    """Integral of a power of a magnitude, its relative error bound, and the number of nodes used.

    The lanes of the constants of the tile are all the same design; its panels are every `stride`-th from `begin` on. Of
    the `rows` of the signals, `row` holds the squares; `power` is the number of the power. At first panels are cut at
    minima of up to `highest` times the largest square.
    """
    total, error, nodes = 0.0, 0.0, 0
    for p in range(begin, begin + panel_count * stride, stride):
        for lane in range(LANES):
            tile.shape[TILE_SCALE + lane], tile.shape[TILE_RESOLUTION + lane] = panels[SCALE + p], 1.0
            tile.shape[TILE_TURNED + lane] = 0.0
        integral, bound, count = _integrate_panel(
            fill, needs, rows, row, power, panels, p, highest, tolerance, size_of, row_of, table, tile
        )
        nodes += count
        if highest < 1.0 and bound > 0.2 * tolerance * integral:
            integral, bound, count = _integrate_panel(
                fill, needs, rows, row, power, panels, p, 1.0, tolerance, size_of, row_of, table, tile
            )
            nodes += count
        total, error = total + integral, error + bound
    return total, error / total if total > 0.0 else 0.0, nodes


@subroutine()
def _integrate_panel(fill, needs, rows, row, power, panels, p, highest, tolerance, size_of, row_of, table, tile):
    """Integral over panel p, cut at minima of up to `highest` times the largest square; its error bound; nodes."""
    anchor, law, variant = int(panels[ANCHOR + p]), int(panels[LAW + p]), int(panels[VARIANT + p])
    centre, half, scale = panels[CENTRE + p], panels[HALF + p], panels[SCALE + p]
    whole = _sum_between(
        fill, needs, rows, row, power, anchor, law, variant, centre, -half, half, scale, _SEARCH_NODES, row_of, table,
        False, tile,
    )  # fmt: skip
    pieces = _cut_at_minima(fill, needs, rows, row, anchor, law, variant, centre, half, highest, tile)
    total, error, nodes = 0.0, 0.0, _SEARCH_NODES
    for k in range(pieces):
        # A panel without minima near 0 keeps the samples that they are looked for among.
        is_whole = tile.marks[k + 1] == math.inf
        wanted = size_of[_SEARCH_NODES // 4 if is_whole else FEWEST_NODES]
        previous, difference, bound = 0.0, math.inf, math.inf
        for number in range(ROUNDS):
            integral = whole
            if wanted != _SEARCH_NODES or not is_whole:
                integral = _sum_between(
                    fill, needs, rows, row, power, anchor, law, variant, centre, tile.marks[k],
                    half if is_whole else tile.marks[k + 1], scale, wanted, row_of, table, not is_whole, tile,
                )  # fmt: skip
                nodes += wanted
            if number > 0:
                # Between other minima than those near 0 two rules that agree do not suffice.
                guard = 0.01 * difference if number > 1 else math.inf if highest < 1.0 else 0.0
                difference = abs(integral - previous)
                bound = max(difference, guard) * (_MARGIN if highest < 1.0 else 1.0)
            if bound <= 0.2 * tolerance * integral or 2 * wanted > LARGEST_NODE_COUNT:
                break
            previous, wanted = integral, size_of[2 * wanted]
        total, error = total + integral, error + bound
    return total, error, nodes


@subroutine()
def _sum_between(
    fill, needs, rows, row, power, anchor, law, variant, centre, first, last, scale, count, row_of, table, clustered,
    tile,
):  # fmt: skip
    """Integral of a power of a magnitude between two places of a panel by one rule; the tile keeps the samples."""
    place_between(centre, first, last, scale, count, row_of, table, clustered, tile.roots, tile.tangents, tile.weights)
    groups, integral = (count + LANES - 1) // LANES, 0.0
    fill(tile.constants, tile.tangents, anchor, law, variant, groups, needs, tile.signals)
    for group in range(groups):
        squares = tile.signals[(group * rows + row) * LANES :]
        integral += sum_powers(squares, tile.weights[group * LANES :], power)
    return integral


@subroutine()
def _turn_mean(fill, needs, rows, row, power, anchor, law, variant, tolerance, tile):
    """Integral over a turn of a power of a magnitude by equispaced nodes, its relative error bound, number of nodes.

    The bound is infinite where the magnitude is near 0, or where the rule with the most nodes does not suffice. The
    lanes of the constants of the tile are all the same design.
    """
    for lane in range(LANES):
        tile.weights[lane] = 1.0
    # Nodes are a third of a step behind half a turn from the anchor, whose half-tangent is infinite.
    total, least, largest, offset, count = 0.0, math.inf, 0.0, 1.0 / 3.0, 0
    integral, difference, bound = 0.0, math.inf, math.inf
    while count < _MOST_EQUISPACED:
        # As many nodes as there are, midway between them.
        added = max(count, LANES)
        shift, groups = (offset + 0.5) % 1.0 if count > 0 else offset, added // LANES
        for j in range(added):
            tile.tangents[j] = tangent(math.pi * ((j + shift) / added - 0.5))
        fill(tile.constants, tile.tangents, anchor, law, variant, groups, needs, tile.signals)
        for group in range(groups):
            squares = tile.signals[(group * rows + row) * LANES :]
            total += sum_powers(squares, tile.weights, power)
            for lane in range(LANES):
                least, largest = min(least, squares[lane]), max(largest, squares[lane])
        count += added
        if not least > _NEAR_ZERO * largest:
            return 0.0, math.inf, count
        previous, integral = integral, 2.0 * math.pi * total / count
        if count > added:
            guard, difference = 0.01 * difference, abs(integral - previous)
            bound, offset = _MARGIN * max(difference, guard), 2.0 * offset % 1.0
        if bound <= 0.2 * tolerance * integral:
            return integral, bound / integral, count
    return integral, math.inf, count


@subroutine(fast=True, inlined=True)
def sum_powers(squares, weight, power):
    """The weighted sum of a power of the magnitudes of a tile."""
    total = 0.0
    if power == 0:
        for lane in range(LANES):
            square = squares[lane]
            total += weight[lane] * math.sqrt(square if square > 0.0 else 0.0)
        return total
    for lane in range(LANES):
        value = squares[lane]
        square = value if value > _LEAST_SQUARE else _LEAST_SQUARE
        root = exponential(logarithm(square) * (1.0 / 3.0))
        cube = root * root * root  # a step of Halley's method, for the last digits
        root = root * (cube + 2.0 * square) / (2.0 * cube + square)
        total += weight[lane] * (root * root * (value if value > 0.0 else 0.0))
    return total


@subroutine(fast=True)
def place_between(panel_centre, first, last, scale, count, row_of, table, clustered, t, tangents, weight):
    """Fill nodes between two places of a panel, in t from its centre: t, half-tangents, weights (rad), ascending.

    They are `clustered` at both ends or not. The tile is filled up with the last node. The length of a short panel has
    more digits than the t of its ends.
    """
    row = row_of[count]
    centre, half = panel_centre + 0.5 * (first + last), 0.5 * (last - first)
    for j in range((count + 1) // 2):
        t[j], t[count - 1 - j] = -table[row + j, 0], table[row + j, 0]
        weight[j] = weight[count - 1 - j] = table[row + j, 1]
    width = (count + LANES - 1) // LANES * LANES
    for j in range(count, width):
        t[j], weight[j] = t[count - 1], 0.0
    bend, steep = (1.0, 1.875) if clustered else (0.0, 1.0)
    for start in range(0, width, LANES):
        places, factors, points = t[start:], weight[start:], tangents[start:]
        for lane in range(LANES):
            s = places[lane]
            square = s * s
            step = half * s * (steep + bend * (square * (-1.25 + 0.375 * square)))
            rate = half * steep * (1.0 - bend * square) * (1.0 - bend * square)
            growth = exponential(centre + step)
            shrinking = 1.0 / growth
            tangent, slope = 0.5 * scale * (growth - shrinking), 0.5 * scale * (growth + shrinking)
            places[lane], points[lane] = centre + step, tangent
            factors[lane] = 2.0 * factors[lane] * rate * slope / (1.0 + tangent * tangent)


@subroutine()
def _cut_at_minima(fill, needs, rows, row, anchor, law, variant, centre, half, highest, tile):
    """Fill the ends of the pieces between minima of a panel, in t from its centre; return the number of pieces.

    Minima are squares of up to `highest` times the largest one. Where none is near 0, below 1, the end of the piece is
    infinite. There are at most as many minima as lanes; the error bound includes further ones, which are rare.
    """
    t, samples, state, cuts = tile.roots, tile.signals, tile.state, tile.marks
    lanes, first, last, largest, cuts[0] = 0, centre - half, centre + half, 0.0, -half
    for group in range(_SEARCH_NODES // LANES):
        for lane in range(LANES):
            largest = max(largest, samples[(group * rows + row) * LANES + lane])
    for lane in range(LANES):
        state[ACTIVE + lane], state[BEST + lane] = 0.0, 0.5 * (first + last)
    for j in range(_SEARCH_NODES):
        # The ends of the panel are not sampled: a minimum may lie between the last sample and the end.
        value = samples[(j // LANES * rows + row) * LANES + j % LANES]
        left = samples[((j - 1) // LANES * rows + row) * LANES + (j - 1) % LANES] if j > 0 else np.inf
        right = samples[((j + 1) // LANES * rows + row) * LANES + (j + 1) % LANES] if j < _SEARCH_NODES - 1 else np.inf
        if value <= left and value < right and value <= highest * largest and lanes < LANES:
            low, high = t[j - 1] if j > 0 else first, t[j + 1] if j < _SEARCH_NODES - 1 else last
            previous = 2.0 * (high - low) if left < np.inf and right < np.inf else 0.0
            start_lane(state, lanes, low, t[j], high, left, value, right, previous)
            lanes += 1
    if lanes == 0:
        cuts[1] = math.inf if highest < 1.0 else half
        return 1
    minimise(fill, tile.constants, tile.shape, anchor, law, variant, needs, row, 1.0, state, tile.tangents, samples)
    pieces = 1
    for lane in range(lanes):
        if cuts[pieces - 1] < state[BEST + lane] - centre < half:
            cuts[pieces] = state[BEST + lane] - centre
            pieces += 1
    cuts[pieces] = half
    return pieces


@subroutine()
def fill_powers(fill, sizes, tables, w, i, design, stride, statistics, nodes, error, work, tile):
    """Fill the means of powers of the magnitudes of one design, number i of the chunk and `design` of the block."""
    gather_design(sizes, i, work, tile)
    # Only where all singularities are declared do bends show between few nodes.
    is_declared = not (tables.is_located or tables.is_resolved or tables.is_anchored or tables.is_adaptive)
    has_turn = is_declared and tables.windows[w, KIND] == TURN and tables.windows[w, CLUTCH] == 0
    has_turn = has_turn and len(tables.breaks) == 0 and len(tables.corner_rows) == 0
    panel = work.first_panel[i]
    for k in range(MOST_SINGULARITIES):
        has_turn = has_turn and work.panels[SINGULAR + k * PANEL_CAPACITY + panel] >= _FAR
    anchor, law = int(work.panels[ANCHOR + panel]), int(work.panels[LAW + panel])
    variant = int(work.panels[VARIANT + panel])
    for s in range(sizes.rows):
        if not tables.flags[w, s] & FLAG_SQUARES:
            continue
        for power in range(POWERS):
            slot = tables.slots[w, s, ROOT_MEAN + power]
            if slot < 0:
                continue
            needs, integral, bound = tables.row_needs[s], 0.0, math.inf
            if has_turn:
                integral, bound, count = _turn_mean(
                    fill, needs, sizes.rows, s, power, anchor, law, variant, tables.tolerance, tile
                )
                nodes[design] += count
            if bound == math.inf:
                integral, bound, count = power_means(
                    fill, needs, sizes.rows, s, power, work.panels, panel, work.panel_count[i], stride,
                    _NEAR_ZERO if is_declared else 1.0, tables.tolerance, tables.size_of, tables.row_of, tables.rules,
                    tile,
                )  # fmt: skip
                nodes[design] += count
            statistics[slot, design] = integral / work.averaging[i]
            add_bound(s, i, design, tables.slots[w, s], bound, statistics, error, work)
