"""Tiles: panels with the same rule, one in each lane, from nodes to moments and tails."""

from explore.compiling import FILL_SIGNATURE, LANES, function_type
from explore.lanes.elementary import exponential
from explore.quadrature.panels import CENTRE, DECAY, HALF, SCALE
from explore.quadrature.rules import LARGEST_NODE_COUNT
from explore.subroutines import subroutine

FILL_TYPE = function_type(FILL_SIGNATURE)
#: Most nodes of a tile: a rule and the two ends of the panel.
NODE_CAPACITY = LARGEST_NODE_COUNT + 2

# Rows of a tile's shape: half length in t, T e^c/2 and T e^-c/2 (c the centre), centre, T, how finely extremes are
# looked for, and rho^-2.
TILE_HALF, TILE_UP, TILE_DOWN, TILE_CENTRE, TILE_SCALE, TILE_RESOLUTION, _DECAY = (row * LANES for row in range(7))
_LOW_TANGENT, _HIGH_TANGENT, _LOW_WEIGHT, _HIGH_WEIGHT = (row * LANES for row in range(7, 11))
SHAPE_SIZE = 11 * LANES
# Rows of the sums over a tile's nodes of one signal: integrals, mean, the two parts of its tail.
INTEGRAL, DEVIATIONS, _MEAN, FIRST_TAIL, SECOND_TAIL = (row * LANES for row in range(5))
SUMS_SIZE = 5 * LANES
#: Least resolution: rounding hides finer steps.
_FINEST = 1e-8


@subroutine(fast=True)
def _scale_exponentials(shape):
    for lane in range(LANES):
        growth = exponential(shape[TILE_CENTRE + lane])
        half_scale = 0.5 * shape[TILE_SCALE + lane]
        shape[TILE_UP + lane], shape[TILE_DOWN + lane] = half_scale * growth, half_scale / growth


@subroutine()
def gather_shapes(panels, lane_panels, is_adaptive, shape):
    """Fill the shapes of the panels of a tile. A panel of the adaptive rule may be as narrow as its signal."""
    for lane in range(LANES):
        k = lane_panels[lane]
        shape[TILE_HALF + lane], shape[TILE_CENTRE + lane] = panels[HALF + k], panels[CENTRE + k]
        shape[TILE_SCALE + lane], shape[_DECAY + lane] = panels[SCALE + k], panels[DECAY + k]
        shape[TILE_RESOLUTION + lane] = max(panels[HALF + k], _FINEST) if is_adaptive else 1.0
    _scale_exponentials(shape)


@subroutine(fast=True, inlined=True)
def _place_pair(shape, abscissa, rule_weight):
    """Fill half-tangents and weights (rad) of a symmetric pair of nodes: one exponential serves both."""
    for lane in range(LANES):
        half = shape[TILE_HALF + lane]
        growth = exponential(half * abscissa)
        decay = 1.0 / growth
        up, down = shape[TILE_UP + lane], shape[TILE_DOWN + lane]
        low, high = up * decay - down * growth, up * growth - down * decay
        low_square, high_square = 1.0 + low * low, 1.0 + high * high
        share = 2.0 * half * rule_weight / (low_square * high_square)
        shape[_LOW_TANGENT + lane], shape[_HIGH_TANGENT + lane] = low, high
        shape[_LOW_WEIGHT + lane] = share * high_square * (up * decay + down * growth)
        shape[_HIGH_WEIGHT + lane] = share * low_square * (up * growth + down * decay)


@subroutine(inlined=True)
def _store_pair(shape, tangents, weights, low, high):
    for lane in range(LANES):
        tangents[low * LANES + lane], weights[low * LANES + lane] = (
            shape[_LOW_TANGENT + lane],
            shape[_LOW_WEIGHT + lane],
        )
        tangents[high * LANES + lane], weights[high * LANES + lane] = (
            shape[_HIGH_TANGENT + lane],
            shape[_HIGH_WEIGHT + lane],
        )


@subroutine()
def place_nodes(shape, count, ends, row_of, table, tangents, weights):
    """Fill half-tangents and weights of the nodes of a tile, ascending in t.

    With `ends` the two ends of each panel are added as first and last node, with weight 0.
    """
    row, pairs = row_of[count], (count + 1) // 2
    begin = 1 if ends else 0
    last = begin + count - 1
    for j in range(pairs):
        _place_pair(shape, table[row + j, 0], table[row + j, 1])
        _store_pair(shape, tangents, weights, begin + j, last - j)
    if ends:
        _place_pair(shape, 1.0, 0.0)
        _store_pair(shape, tangents, weights, 0, last + 1)


@subroutine(fast=True)
def _add_integrals(signals, rows, flags, first, second, present, weights, masses, sums):
    """Add two nodes to the weights and integrals; `present` is 0 for a second one that is none, else 1."""
    # LLVM would unroll a loop of constant length with so short a body instead of vectorising it.
    width = len(masses)
    first_weight, second_weight = weights[first * LANES :], weights[second * LANES :]
    for lane in range(width):
        masses[lane] = masses[lane] + first_weight[lane] + present * second_weight[lane]
    for s in range(rows):
        if not flags[s]:
            continue
        one, other = signals[(first * rows + s) * LANES :], signals[(second * rows + s) * LANES :]
        row = sums[s * SUMS_SIZE :]
        for lane in range(width):
            row[INTEGRAL + lane] = (
                row[INTEGRAL + lane] + first_weight[lane] * one[lane] + present * second_weight[lane] * other[lane]
            )


@subroutine(fast=True)
def _add_deviations(signals, rows, flags, first, second, present, weights, roots, factors, sums, width):
    """Add two nodes to the sums of squared deviations and to the parts of tails; see `_add_integrals`."""
    first_weight, second_weight = weights[first * LANES :], weights[second * LANES :]
    first_root, second_root = roots[first * LANES :], roots[second * LANES :]
    a, b = factors[2 * first], factors[2 * first + 1]
    c, d = present * factors[2 * second], present * factors[2 * second + 1]
    for s in range(rows):
        if not flags[s]:
            continue
        one, other = signals[(first * rows + s) * LANES :], signals[(second * rows + s) * LANES :]
        row = sums[s * SUMS_SIZE :]
        for lane in range(width):
            x, y = one[lane] - row[_MEAN + lane], other[lane] - row[_MEAN + lane]
            row[DEVIATIONS + lane] = (
                row[DEVIATIONS + lane] + first_weight[lane] * x * x + present * second_weight[lane] * y * y
            )
            u, v = first_root[lane] * x, second_root[lane] * y
            row[FIRST_TAIL + lane] = row[FIRST_TAIL + lane] + a * u + c * v
            row[SECOND_TAIL + lane] = row[SECOND_TAIL + lane] + b * u + d * v


@subroutine(fast=True)
def fill_moments(signals, rows, flags, count, weights, roots, factors, masses, sums):
    """Fill weights, integrals, those of squared deviations from the mean, and the two parts of tails.

    The deviations are summed in a second pass, so that a swing of a fraction of a degree loses no digits. The loops
    over rows are inside those over nodes, because one sum alone would wait for its own last addition. Two nodes at once
    halve the loads and stores of sums.

    Parameters
    ----------
    flags : (rows,) array
        The rows whose sums are needed have flags other than 0.
    roots, factors
        From `explore.quadrature.tails`.
    masses : (LANES,), sums : (rows, SUMS_SIZE)
        Filled.
    """
    width = len(masses)
    for lane in range(width):
        masses[lane] = 0.0
    sums[: rows * SUMS_SIZE] = 0.0
    for j in range(0, count, 2):
        present = 1.0 if j + 1 < count else 0.0
        _add_integrals(signals, rows, flags, j, min(j + 1, count - 1), present, weights, masses, sums)
    for s in range(rows):
        row = sums[s * SUMS_SIZE :]
        for lane in range(width):
            row[_MEAN + lane] = row[INTEGRAL + lane] / masses[lane]
    for j in range(0, count, 2):
        present = 1.0 if j + 1 < count else 0.0
        _add_deviations(signals, rows, flags, j, min(j + 1, count - 1), present, weights, roots, factors, sums, width)


@subroutine(fast=True)
def join_tails(sums, rows, is_adaptive, shape):
    """Replace the first parts of tails by the tails, which `explore.quadrature.tails` describes."""
    decay = shape[_DECAY:]
    for s in range(rows):
        first, second = sums[s * SUMS_SIZE + FIRST_TAIL :], sums[s * SUMS_SIZE + SECOND_TAIL :]
        if is_adaptive:
            for lane in range(LANES):
                first[lane] = abs(first[lane]) + abs(second[lane])
        else:
            # to the order N of the error; the polynomials have the orders N - 1 and N - 2
            for lane in range(LANES):
                first[lane] = decay[lane] * (first[lane] * first[lane] + decay[lane] * second[lane] * second[lane])
