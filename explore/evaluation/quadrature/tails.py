"""What the samples of a panel tell of the error of its rule: factors of the nodes, and the check of the error model.

A tail has two parts. With the graded rule these are the components of a signal along the last two of the orthonormal
polynomials in the variable of the rule, of the orders N - 2 and N - 1. Their shares in the mean square of the signal
fall like rho^-2N, as the error of the rule does. So shares that exceed the modelled error tell of a singularity that
the mechanism has not declared.

With the adaptive rule the parts are the differences, at both ends of the panel, of the signal from the polynomial
through its samples. They exceed the error of the integral also where the signal has a corner or a jump, be it beyond
the last node.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_RESIDUAL, FLAG_SQUARES, FLAG_TERMS, ROUNDING
from explore.evaluation.quadrature.panels import PANEL_CAPACITY

# Of 200,000 crank-rockers, among them near kites, slider-like ones and tiny cranks, over all windows and with three
# tolerances, none exceeds 0.06. Where a wrong declaration leads to an error beyond ten times the bound, the excess is
# at least 0.17.
#: Largest excess of the shares of tails over the error model that a right declaration has.
LARGEST_EXCESS = 0.1
# Of 35,000 statistics of fourteen linkages near limits, 35 have more; five that were 2 to 96 times above their bounds
# had 8e-3 or more.
#: Largest excess where the distance of other singularities than the nearest is estimated.
LARGEST_ANCHORED_EXCESS = 1e-4
#: Share of the excess that counts where a row holds squares: only their mean is used, not its mean square.
_OF_SQUARES = 1e-3


@subroutine()
def place_factors(count, ends, is_adaptive, row_of, table, factors):
    """Fill the factors of each node of a panel in the two parts of tails, node after node.

    The table has q, the normalized polynomial of order N - 1. At the nodes that of order N - 2 is
    sqrt((2N - 1)(2N - 3))/(N - 1) x q, and the Lagrange polynomial of a node is sqrt(N - 1/2) (1 + x)/(N q) at 1.
    """
    row, begin, samples = row_of[count], 1 if ends else 0, count + 2 if ends else count
    ratio = math.sqrt((2.0 * count - 1.0) * (2.0 * count - 3.0)) / (count - 1.0)
    factors[0] = factors[2 * samples - 1] = 1.0 if is_adaptive else 0.0
    factors[1] = factors[2 * samples - 2] = 0.0
    for j in range((count + 1) // 2):
        low, high = 2 * (begin + j), 2 * (begin + count - 1 - j)
        x, weight, q = table[row + j, 0], table[row + j, 1], table[row + j, 2]
        mirrored = q if count % 2 == 1 else -q
        if is_adaptive:
            scale = math.sqrt(count - 0.5) / count
            near, far = -scale * (1.0 + x) / q, -scale * (1.0 - x) / mirrored
            factors[low], factors[low + 1] = near, far
            factors[high], factors[high + 1] = far, near
        else:
            root = math.sqrt(weight)
            factors[low], factors[low + 1] = root * mirrored, -ratio * root * x * mirrored
            factors[high], factors[high + 1] = root * q, ratio * root * x * q


@subroutine(no_alias=True)
def fill_roots(weights, count, are_ones, roots):
    """Fill what samples are multiplied by in tails: the roots of their weights, or 1: adaptive, equispaced nodes."""
    if are_ones:
        for j in range(count * LANES):
            roots[j] = 1.0
    else:
        for j in range(count * LANES):
            roots[j] = math.sqrt(weights[j])


@subroutine(no_alias=True)
def check_model(b, n, regular, per_design, live, first_panel, panel_count, stride, w, tables, tails, means, variances):
    """Fill how many times the shares of tails exceed the modelled error, for the worst row of each live design.

    `regular` tells that panel p of the live design j has the number ``p * n + j``, and each has `per_design`.
    """
    flags, orders, term_rows = tables.flags, tables.orders, tables.term_rows
    b[bounds.EXCESS : bounds.EXCESS + n] = 0.0
    total = b[bounds.TAILS : bounds.TAILS + n]
    for s in range(flags.shape[1]):
        if not flags[w, s] or flags[w, s] == FLAG_TERMS:
            continue
        base, at = s * PANEL_CAPACITY, (term_rows[s] if flags[w, s] & FLAG_RESIDUAL else s) * CHUNK
        total[:] = 0.0
        for p in range(per_design if regular else 0):
            tail = tails[base + p * n : base + p * n + n]
            for j in range(n):
                total[j] += tail[j]
        for j in range(0 if regular else n):
            for p in range(panel_count[live[j]]):
                total[j] += tails[base + first_panel[live[j]] + p * stride]
        order = orders[w, s]
        model = b[bounds.SECOND if order == 2 else bounds.FOURTH if order == 4 else bounds.SIXTH :]
        share = _OF_SQUARES if flags[w, s] & FLAG_SQUARES else 1.0
        for j in range(n):
            square = means[at + j] * means[at + j] + variances[at + j]
            excess = share * total[j] / (b[bounds.AVERAGING + j] * square * (model[j] + ROUNDING))
            b[bounds.EXCESS + j] = excess if excess > b[bounds.EXCESS + j] else b[bounds.EXCESS + j]
