"""Means of powers of a magnitude, of which the samples are squares.

Where a magnitude touches 0, or nearly does, its odd powers have a corner, or nearly have one, that no rule over a whole
panel resolves. So each panel is cut at the local minima; what is left at the ends of a piece, at worst an algebraic
singularity there, Gauss-Legendre rules resolve: for the power 10/3 like N^-8.7, for the mean like N^-4 (Trefethen,
Approximation Theory and Approximation Practice, chapters 19 and 28).

The rules of 16, 32, ... nodes are compared until two agree, and the difference of the last two is the bound: an
estimate of the error of the rule before the last.
"""

import numpy as np

from explore.compiling import compiled
from explore.quadrature import LARGEST, place_nodes
from explore.statistics import refined_minimum

#: How many powers there are: 1 and 10/3.
POWERS = 2
_FEWEST, _ROUNDS = 16, 6
#: The most pieces of a panel. A magnitude has few minima; from there on they are left uncut, and the bound tells.
_MOST = 16


@compiled(allocates=True)
def power_means(
    fill, kernel, needs, row, power, panels, parts, shapes, offsets, tolerance,
    t, scratch, size_of, row_of, table, node, one,
):  # fmt: skip
    """Integral of a row of squares raised to a power, its relative error bound, and the nodes taken.

    `t` and `scratch` are the samples of the panels; the other arguments are those of `explore.sampling`.
    """
    cuts, shape = np.empty(_MOST + 1), np.zeros((1, 4))
    where, weight, sine, cosine = np.empty(LARGEST), np.empty(LARGEST), np.empty(LARGEST), np.empty(LARGEST)
    signals = np.empty((scratch.shape[0], LARGEST))
    total, error, nodes = 0.0, 0.0, 0
    for p in range(panels):
        pieces = _cuts(fill, kernel, needs, row, p, parts, shapes, offsets, t, scratch, node, one, cuts)
        shape[0, 2] = shapes[p, 2]
        anchor = int(parts[p, 0])
        for k in range(pieces):
            shape[0, 0], shape[0, 1] = 0.5 * (cuts[k] + cuts[k + 1]), 0.5 * (cuts[k + 1] - cuts[k])
            before, integral, asked = np.inf, 0.0, _FEWEST
            for _ in range(_ROUNDS):
                count = size_of[min(asked, LARGEST)]
                place_nodes(shape, 0, anchor, count, 0, row_of, table, False, where, sine, cosine, weight)
                fill(kernel, sine, cosine, count, needs, signals)
                integral = 0.0
                for j in range(count):
                    integral += weight[j] * max(signals[row, j], 0.0) ** power
                nodes += count
                if abs(integral - before) <= 0.01 * tolerance * integral or count == LARGEST:
                    break
                before, asked = integral, 2 * asked
            total += integral
            error += abs(integral - before)
    return total, error / total if total > 0.0 else 0.0, nodes


@compiled()
def _cuts(fill, kernel, needs, row, p, parts, shapes, offsets, t, scratch, node, one, cuts):
    """Ends of the pieces between the local minima of a panel, in t, into `cuts`; how many pieces."""
    begin, end = offsets[p], offsets[p + 1]
    values = scratch[row]
    cuts[0], pieces = shapes[p, 0] - shapes[p, 1], 1
    for j in range(begin + 1, end - 1):
        if values[j] <= values[j - 1] and values[j] < values[j + 1] and pieces < _MOST:
            _, at = refined_minimum(
                fill, kernel, shapes[p], int(parts[p, 0]), row, needs, 1.0,
                t[j - 1], t[j], t[j + 1], values[j], node, one,
            )  # fmt: skip
            cuts[pieces] = at
            pieces += 1
    cuts[pieces] = shapes[p, 0] + shapes[p, 1]
    return pieces
