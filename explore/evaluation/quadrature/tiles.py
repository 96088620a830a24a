"""Tiles: panels with the same rule, one in each lane, from nodes to moments and tails."""

from explore.base.compiling import FILL_SIGNATURE, LANES, function_type
from explore.base.lanes.elementary import exponential
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.anchored import turn_by
from explore.evaluation.quadrature.chunks import gather_constants
from explore.evaluation.quadrature.panels import CENTRE, DECAY, HALF, SCALE, TURNED
from explore.evaluation.quadrature.rules import LARGEST_NODE_COUNT

FILL_TYPE = function_type(FILL_SIGNATURE)
#: Largest number of nodes of a tile, a rule and the two ends of the panel, rounded up to a multiple of four.
NODE_CAPACITY = LARGEST_NODE_COUNT + 4

# Rows of a tile's shape: half length in t, T e^c/2 and T e^-c/2 (c the centre), centre, T, how finely extremes are
# looked for, the half-tangent that nodes are turned by, and rho^-2.
TILE_HALF, TILE_UP, TILE_DOWN, TILE_CENTRE, TILE_SCALE, TILE_RESOLUTION, TILE_TURNED, _DECAY = (
    row * LANES for row in range(8)
)
SHAPE_SIZE = 8 * LANES
# Rows of the sums over a tile's nodes of one signal: integrals, mean, the two parts of its tail.
INTEGRAL, DEVIATIONS, MEAN, FIRST_TAIL, SECOND_TAIL = (row * LANES for row in range(5))
SUMS_SIZE = 5 * LANES
#: Smallest resolution: rounding hides finer steps.
_FINEST = 1e-8


@subroutine(fast=True)
def _scale_exponentials(shape):
    for lane in range(LANES):
        growth = exponential(shape[TILE_CENTRE + lane])
        half_scale = 0.5 * shape[TILE_SCALE + lane]
        shape[TILE_UP + lane], shape[TILE_DOWN + lane] = half_scale * growth, half_scale / growth


@subroutine(no_alias=True)
def gather_shapes(panels, lane_panels, is_adaptive, shape):
    """Fill the shapes of the panels of a tile. A panel of the adaptive rule may be as narrow as its signal."""
    for lane in range(LANES):
        k = lane_panels[lane]
        shape[TILE_HALF + lane], shape[TILE_CENTRE + lane] = panels[HALF + k], panels[CENTRE + k]
        shape[TILE_SCALE + lane], shape[_DECAY + lane] = panels[SCALE + k], panels[DECAY + k]
        shape[TILE_TURNED + lane] = panels[TURNED + k]
        shape[TILE_RESOLUTION + lane] = max(panels[HALF + k], _FINEST) if is_adaptive else 1.0
    _scale_exponentials(shape)


@subroutine()
def take_panels(sizes, chosen, is_adaptive, work, tile):
    """Fill panels, designs, constants and shapes of a tile from the chosen panels, the last one in the lanes left."""
    for lane in range(LANES):
        tile.lane_panels[lane] = chosen[min(lane, len(chosen) - 1)]
        tile.lane_designs[lane] = work.owner[tile.lane_panels[lane]]
    gather_constants(
        work.constants, sizes.n_constants, sizes.n_fill_constants, tile.lane_designs, tile.offsets, tile.constants
    )  # fmt: skip
    gather_shapes(work.panels, tile.lane_panels, is_adaptive, tile.shape)


@subroutine(fast=True, no_alias=True)
def _place_pair(shape, abscissa, rule_weight, low_tangents, high_tangents, low_weights, high_weights):
    """Fill half-tangents and weights (rad) of a symmetric pair of nodes: one exponential serves both."""
    for lane in range(LANES):
        half = shape[TILE_HALF + lane]
        growth = exponential(half * abscissa)
        decay = 1.0 / growth
        up, down = shape[TILE_UP + lane], shape[TILE_DOWN + lane]
        low, high = up * decay - down * growth, up * growth - down * decay
        low_square, high_square = 1.0 + low * low, 1.0 + high * high
        share = 2.0 * half * rule_weight / (low_square * high_square)
        low_tangents[lane], high_tangents[lane] = low, high
        low_weights[lane] = share * high_square * (up * decay + down * growth)
        high_weights[lane] = share * low_square * (up * growth + down * decay)


@subroutine()
def place_nodes(shape, count, ends, row_of, table, tangents, weights):
    """Fill half-tangents and weights of the nodes of a tile, ascending in t.

    With `ends` the two ends of each panel are added as first and last node, with weight 0.
    """
    row, pairs = row_of[count], (count + 1) // 2
    begin = 1 if ends else 0
    last = begin + count - 1
    for j in range(pairs):
        # the node in the middle is its own counterpart, with the same numbers
        low, high = (begin + j) * LANES, (last - j) * LANES
        _place_pair(
            shape, table[row + j, 0], table[row + j, 1], tangents[low:], tangents[high:], weights[low:], weights[high:]
        )
    if ends:
        high = (last + 1) * LANES
        _place_pair(shape, 1.0, 0.0, tangents, tangents[high:], weights, weights[high:])
    turn_nodes(shape, last + 1 + begin, tangents)


@subroutine(fast=True, no_alias=True)
def turn_nodes(shape, count, tangents):
    """Turn nodes by the angles of their panels, if these are not from the anchor."""
    turned = 0.0
    for lane in range(LANES):
        turned += abs(shape[TILE_TURNED + lane])
    for j in range(count if turned > 0.0 else 0):
        row = tangents[j * LANES :]
        for lane in range(LANES):
            row[lane] = turn_by(row[lane], shape[TILE_TURNED + lane])


@subroutine(inlined=True)
def sample_abscissa(table, rule, count, j):
    """Abscissa of sample j of a rule with the two ends, between -1 and 1."""
    if j == 0 or j == count + 1:
        return -1.0 if j == 0 else 1.0
    return -table[rule + j - 1, 0] if 2 * (j - 1) < count else table[rule + count - j, 0]


@subroutine(inlined=True)
def four_nodes(signals, rows, s, j, last):
    """One signal at four nodes from node j on; at the last one instead of those that are none."""
    first, second = signals[(j * rows + s) * LANES :], signals[(min(j + 1, last) * rows + s) * LANES :]
    return (
        first, second, signals[(min(j + 2, last) * rows + s) * LANES :],
        signals[(min(j + 3, last) * rows + s) * LANES :],
    )  # fmt: skip


@subroutine(fast=True, no_alias=True)
def _add_integrals(signals, rows, flags, j, last, weights, masses, sums):
    """Add four nodes to the weights and integrals."""
    # LLVM would unroll a loop of constant length with so short a body instead of vectorising it.
    width = len(masses)
    w1, w2, w3, w4 = four_nodes(weights, 1, 0, j, j + 3)
    for lane in range(width):
        masses[lane] = masses[lane] + ((w1[lane] + w2[lane]) + (w3[lane] + w4[lane]))
    for s in range(rows):
        if not flags[s]:
            continue
        x1, x2, x3, x4 = four_nodes(signals, rows, s, j, last)
        row = sums[s * SUMS_SIZE :]
        for lane in range(width):
            pairs = (w1[lane] * x1[lane] + w2[lane] * x2[lane]) + (w3[lane] * x3[lane] + w4[lane] * x4[lane])
            row[INTEGRAL + lane] = row[INTEGRAL + lane] + pairs


@subroutine(fast=True, no_alias=True)
def _add_deviations(signals, rows, flags, j, last, weights, roots, factors, sums, width):
    """Add four nodes to the sums of squared deviations and to the parts of tails."""
    w1, w2, w3, w4 = four_nodes(weights, 1, 0, j, j + 3)
    r1, r2, r3, r4 = four_nodes(roots, 1, 0, j, j + 3)
    a1, b1, a2, b2 = factors[2 * j], factors[2 * j + 1], factors[2 * j + 2], factors[2 * j + 3]
    a3, b3, a4, b4 = factors[2 * j + 4], factors[2 * j + 5], factors[2 * j + 6], factors[2 * j + 7]
    for s in range(rows):
        if not flags[s]:
            continue
        x1, x2, x3, x4 = four_nodes(signals, rows, s, j, last)
        row = sums[s * SUMS_SIZE :]
        for lane in range(width):
            mean = row[MEAN + lane]
            y1, y2, y3, y4 = x1[lane] - mean, x2[lane] - mean, x3[lane] - mean, x4[lane] - mean
            squares = (w1[lane] * y1 * y1 + w2[lane] * y2 * y2) + (w3[lane] * y3 * y3 + w4[lane] * y4 * y4)
            row[DEVIATIONS + lane] = row[DEVIATIONS + lane] + squares
            u1, u2, u3, u4 = r1[lane] * y1, r2[lane] * y2, r3[lane] * y3, r4[lane] * y4
            row[FIRST_TAIL + lane] = row[FIRST_TAIL + lane] + ((a1 * u1 + a2 * u2) + (a3 * u3 + a4 * u4))
            row[SECOND_TAIL + lane] = row[SECOND_TAIL + lane] + ((b1 * u1 + b2 * u2) + (b3 * u3 + b4 * u4))


@subroutine()
def _pad(count, weights, roots, factors):
    """Let the nodes that fill up the last four add nothing."""
    padded = (count + 3) // 4 * 4
    for k in range(count * LANES, padded * LANES):
        weights[k] = roots[k] = 0.0
    for k in range(2 * count, 2 * padded):
        factors[k] = 0.0


@subroutine(fast=True)
def fill_moments(signals, rows, flags, count, weights, roots, factors, masses, sums):
    """Fill weights, integrals, those of squared deviations from the mean, and the two parts of tails.

    The deviations are summed in a second pass, so that a swing of a fraction of a degree loses no digits. The loops
    over rows are inside those over nodes, because one sum alone would wait for its own last addition. Four nodes at
    once save loads and stores of sums.

    Rows with `flags` other than 0 are summed into `sums` (rows, SUMS_SIZE), the weights into `masses` (LANES,). `roots`
    and `factors` of the nodes are from `quadrature.tails`; there is room for three more nodes.
    """
    width = len(masses)
    for lane in range(width):
        masses[lane] = 0.0
    for s in range(rows):
        if flags[s]:
            sums[s * SUMS_SIZE : (s + 1) * SUMS_SIZE] = 0.0
    _pad(count, weights, roots, factors)
    for j in range(0, count, 4):
        _add_integrals(signals, rows, flags, j, count - 1, weights, masses, sums)
    for s in range(rows):
        row = sums[s * SUMS_SIZE :]
        for lane in range(width if flags[s] else 0):
            row[MEAN + lane] = row[INTEGRAL + lane] / masses[lane]
    for j in range(0, count, 4):
        _add_deviations(signals, rows, flags, j, count - 1, weights, roots, factors, sums, width)


@subroutine(fast=True)
def join_tails(sums, rows, flags, is_adaptive, shape):
    """Replace the first parts of tails by the tails, which `explore.evaluation.quadrature.tails` describes."""
    decay = shape[_DECAY:]
    for s in range(rows):
        if not flags[s]:
            continue
        first, second = sums[s * SUMS_SIZE + FIRST_TAIL :], sums[s * SUMS_SIZE + SECOND_TAIL :]
        if is_adaptive:
            for lane in range(LANES):
                first[lane] = abs(first[lane]) + abs(second[lane])
        else:
            # to the order N of the error; the polynomials have the orders N - 1 and N - 2
            for lane in range(LANES):
                first[lane] = decay[lane] * (first[lane] * first[lane] + decay[lane] * second[lane] * second[lane])
