"""Means of powers of a magnitude, of which the samples are squares.

Where a magnitude touches 0, or nearly does, its odd powers have a corner, or nearly have one, that no rule over a whole
panel resolves. So each panel is cut at its local minima. The corners are then at the ends of the pieces, at worst as
algebraic singularities. A substitution by a polynomial whose first two derivatives are 0 at the ends clusters the nodes
there: a power p of the distance becomes one of 3 p, for which Gauss-Legendre rules converge like N^-(6 p + 2), at worst
N^-8.

The rules of 20, 40, ... 320 nodes are compared until two agree. The bound is the difference of the last two, which
estimates the error of the last but one, and at least a hundredth of the difference before, because two rules may agree
by accident.

Here the lanes of a tile are nodes of one design.
"""

import math

import numpy as np

from explore.base.compiling import LANES
from explore.base.lanes.elementary import exponential, logarithm
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_SQUARES
from explore.evaluation.quadrature.brent import ACTIVE, BEST, minimise, start_lane
from explore.evaluation.quadrature.chunks import gather_design
from explore.evaluation.quadrature.panels import ANCHOR, CENTRE, HALF, LAW, SCALE, VARIANT
from explore.evaluation.quadrature.slots import BOUND, ROOT_MEAN
from explore.evaluation.quadrature.tiles import TILE_RESOLUTION, TILE_SCALE, TILE_TURNED

#: Number of powers: power 0 has the exponent 1, power 1 the exponent 10/3.
POWERS = 2
#: Number of nodes of the first rule.
FEWEST_NODES = 20
#: Number of rules, each of twice as many nodes as the one before.
ROUNDS = 5
#: Smallest square whose cube root is taken; smaller ones have this root.
_LEAST_SQUARE = 1e-300
#: Number of samples of a panel from which its local minima are refined.
_SEARCH_NODES = 96


@subroutine()
def power_means(
    fill, needs, rows, row, power, panels, begin, panel_count, stride, tolerance, size_of, row_of, table, tile
):
    """Integral of a power of a magnitude, its relative error bound, and the number of nodes used.

    The lanes of the constants of the tile are all the same design; its panels are every `stride`-th from `begin` on. Of
    the `rows` of the signals, `row` holds the squares; `power` is the number of the power.
    """
    tangents, weight, signals, cuts = tile.tangents, tile.weights, tile.signals, tile.marks
    total, error, nodes = 0.0, 0.0, 0
    for p in range(begin, begin + panel_count * stride, stride):
        anchor, law, variant = int(panels[ANCHOR + p]), int(panels[LAW + p]), int(panels[VARIANT + p])
        centre, half = panels[CENTRE + p], panels[HALF + p]
        for lane in range(LANES):
            tile.shape[TILE_SCALE + lane], tile.shape[TILE_RESOLUTION + lane] = panels[SCALE + p], 1.0
            tile.shape[TILE_TURNED + lane] = 0.0
        place_between(
            centre, -half, half, panels[SCALE + p], _SEARCH_NODES, row_of, table, False, tile.roots, tangents, weight
        )  # fmt: skip
        fill(tile.constants, tangents, anchor, law, variant, _SEARCH_NODES // LANES, needs, signals)
        nodes += _SEARCH_NODES
        pieces = _cut_at_minima(fill, needs, rows, row, anchor, law, variant, centre, half, cuts, tile)
        for k in range(pieces):
            integral, difference, bound, requested_count = 0.0, np.inf, np.inf, FEWEST_NODES
            for _ in range(ROUNDS):
                count = size_of[requested_count]
                place_between(
                    centre, cuts[k], cuts[k + 1], panels[SCALE + p], count, row_of, table, True, tile.roots, tangents,
                    weight,
                )  # fmt: skip
                fill(tile.constants, tangents, anchor, law, variant, (count + LANES - 1) // LANES, needs, signals)
                previous, integral = integral, 0.0
                for group in range((count + LANES - 1) // LANES):
                    squares = signals[(group * rows + row) * LANES :]
                    integral += sum_powers(squares, weight[group * LANES :], power)
                nodes += count
                if count > FEWEST_NODES:
                    bound = max(abs(integral - previous), 0.01 * difference if count > 2 * FEWEST_NODES else 0.0)
                    difference = abs(integral - previous)
                if bound <= 0.2 * tolerance * integral:
                    break
                requested_count = 2 * requested_count
            total += integral
            error += bound
    return total, error / total if total > 0.0 else 0.0, nodes


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
def _cut_at_minima(fill, needs, rows, row, anchor, law, variant, centre, half, cuts, tile):
    """Fill the ends of the pieces between the minima of a panel, in t from its centre; return the number of pieces.

    There are at most as many minima as lanes; the error bound includes further ones, which are rare.
    """
    t, samples, state = tile.roots, tile.signals, tile.state
    lanes, first, last = 0, centre - half, centre + half
    for lane in range(LANES):
        state[ACTIVE + lane], state[BEST + lane] = 0.0, 0.5 * (first + last)
    for j in range(_SEARCH_NODES):
        # The ends of the panel are not sampled: a minimum may lie between the last sample and the end.
        value = samples[(j // LANES * rows + row) * LANES + j % LANES]
        left = samples[((j - 1) // LANES * rows + row) * LANES + (j - 1) % LANES] if j > 0 else np.inf
        right = samples[((j + 1) // LANES * rows + row) * LANES + (j + 1) % LANES] if j < _SEARCH_NODES - 1 else np.inf
        if value <= left and value < right and lanes < LANES:
            low, high = t[j - 1] if j > 0 else first, t[j + 1] if j < _SEARCH_NODES - 1 else last
            previous = 2.0 * (high - low) if left < np.inf and right < np.inf else 0.0
            start_lane(state, lanes, low, t[j], high, left, value, right, previous)
            lanes += 1
    if lanes > 0:
        minimise(fill, tile.constants, tile.shape, anchor, law, variant, needs, row, 1.0, state, tile.tangents, samples)
    cuts[0], pieces = -half, 1
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
    for s in range(sizes.rows):
        if not tables.flags[w, s] & FLAG_SQUARES:
            continue
        for power in range(POWERS):
            slot = tables.slots[w, s, ROOT_MEAN + power]
            if slot < 0:
                continue
            mean, bound, count = power_means(
                fill, tables.row_needs[s], sizes.rows, s, power, work.panels, work.first_panel[i], work.panel_count[i],
                stride, tables.tolerance, tables.size_of, tables.row_of, tables.rules, tile,
            )  # fmt: skip
            statistics[slot, design] = mean / work.averaging[i]
            if tables.slots[w, s, BOUND] >= 0:
                statistics[tables.slots[w, s, BOUND], design] += bound
            work.final_bounds[s * CHUNK + i] += bound
            error[design] = max(error[design], work.final_bounds[s * CHUNK + i])
            nodes[design] += count
